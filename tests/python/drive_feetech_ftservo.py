"""Drives simulated Feetech STS servos with the maker's own ftservo-python-sdk, unmodified.

Arguments: the port of a bus with the servos 1 to 4 (STS3215, 1 Mbaud), of which 1 is in the middle of its turn.
"""

import sys
import time

from scservo_sdk import (
    COMM_RX_TIMEOUT,
    COMM_SUCCESS,
    GroupSyncRead,
    PortHandler,
    port_handler,
    sms_sts,
)

IDS = [1, 2, 3, 4]
MODEL = 777
# Addresses of the STS memory table (Feetech wiki).
RETURN_DELAY, MIN_ANGLE, TORQUE, GOAL_POSITION, TORQUE_LIMIT, ASYNC_FLAG = 7, 9, 40, 42, 48, 64
PRESENT_POSITION, PRESENT_SPEED, PRESENT_VOLTAGE = 56, 58, 62

# Patience, ms: a machine that is busy with other things answers late. The package has 50 or less.
port_handler.LATENCY_TIMER = 500
port = PortHandler(sys.argv[1])
servos = sms_sts(port)
assert port.openPort() and port.setBaudRate(1_000_000)


def done(outcome, error=0):
    """The outcome of an instruction must be success, and the servo must have no alarm."""
    assert outcome == COMM_SUCCESS, servos.getTxRxResult(outcome)
    assert error == 0, servos.getRxPacketError(error)


def value(answer):
    number, outcome, error = answer
    done(outcome, error)
    return number


def until(holds, what):
    """Waits for what a servo takes its time for."""
    deadline = time.monotonic() + 60
    while not holds():
        assert time.monotonic() < deadline, what


def position(servo):
    return value(servos.ReadPos(servo))


def ping():
    for servo in IDS:
        assert value(servos.ping(servo)) == MODEL
    _, outcome, _ = servos.ping(77)
    assert outcome == COMM_RX_TIMEOUT, "nobody has this id"


def read_and_write():
    for servo in IDS:
        done(*servos.write2ByteTxRx(servo, TORQUE_LIMIT, 500 + servo))
        assert value(servos.read2ByteTxRx(servo, TORQUE_LIMIT)) == 500 + servo
        assert 40 < value(servos.read1ByteTxRx(servo, PRESENT_VOLTAGE)) < 140
    done(*servos.unLockEprom(2))
    done(*servos.write1ByteTxRx(2, RETURN_DELAY, 6))
    done(*servos.LockEprom(2))
    assert value(servos.read1ByteTxRx(2, RETURN_DELAY)) == 6


def sync_read():
    reader = GroupSyncRead(servos, PRESENT_POSITION, 8)
    for servo in IDS:
        assert reader.addParam(servo)
    done(reader.txRxPacket())
    for servo in IDS:
        assert reader.isAvailable(servo, PRESENT_POSITION, 2) == (True, 0)
        assert reader.getData(servo, PRESENT_POSITION, 2) == position(servo)
        assert reader.getData(servo, PRESENT_VOLTAGE, 1) > 40


def goals():
    """A goal for each servo, some way off on the side where there is room."""
    found = {servo: position(servo) for servo in IDS}
    return {servo: at + 200 if at < 2048 else at - 200 for servo, at in found.items()}


def get_there(wanted):
    for servo, goal in wanted.items():
        until(lambda: abs(position(servo) - goal) < 20, f"servo {servo} does not get to its goal")
        done(*servos.write1ByteTxRx(servo, TORQUE, 0))


def move_one():
    wanted = {3: goals()[3]}
    done(*servos.write1ByteTxRx(3, TORQUE, 1))
    done(*servos.WritePosEx(3, wanted[3], 1500, 50))
    get_there(wanted)


def move_all_at_once():
    wanted = goals()
    for servo, goal in wanted.items():
        done(*servos.write1ByteTxRx(servo, TORQUE, 1))
        assert servos.SyncWritePosEx(servo, goal, 1500, 50)
    done(servos.groupSyncWrite.txPacket())
    servos.groupSyncWrite.clearParam()
    get_there(wanted)


def register_and_act():
    wanted = goals()
    for servo, goal in wanted.items():
        done(*servos.write1ByteTxRx(servo, TORQUE, 1))
        before = value(servos.read2ByteTxRx(servo, GOAL_POSITION))
        done(*servos.RegWritePosEx(servo, goal, 1500, 50))
        after = value(servos.read2ByteTxRx(servo, GOAL_POSITION))
        assert (value(servos.read1ByteTxRx(servo, ASYNC_FLAG)), after) == (1, before)
    done(servos.RegAction())
    get_there(wanted)
    assert value(servos.read1ByteTxRx(1, ASYNC_FLAG)) == 0


def turn_like_a_wheel():
    done(*servos.unLockEprom(1))
    done(*servos.WheelMode(1))
    done(*servos.write1ByteTxRx(1, TORQUE, 1))
    for speed in (800, -800):
        done(*servos.WriteSpec(1, speed, 100))
        until(lambda: abs(value(servos.ReadSpeed(1)) - speed) < 100, f"servo 1 does not get to {speed}")
    done(*servos.WriteSpec(1, 0, 100))
    done(*servos.write1ByteTxRx(1, 33, 0))
    done(*servos.write1ByteTxRx(1, TORQUE, 0))
    done(*servos.LockEprom(1))


for step in (
    ping,
    read_and_write,
    sync_read,
    move_one,
    move_all_at_once,
    register_and_act,
    turn_like_a_wheel,
):
    step()
    print(step.__name__)
port.closePort()
