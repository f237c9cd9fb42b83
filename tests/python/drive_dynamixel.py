"""Drives simulated Dynamixel servos with the maker's own dynamixel-sdk, unmodified.

Arguments: the port of a bus with the servos 1 to 4 (XM430-W210, 4 Mbaud, as their robot file has them).
"""

import sys
import time

from dynamixel_sdk import (
    COMM_RX_TIMEOUT,
    COMM_SUCCESS,
    GroupBulkRead,
    GroupBulkWrite,
    GroupSyncRead,
    GroupSyncWrite,
    PacketHandler,
    PortHandler,
    port_handler,
)

IDS = [1, 2, 3, 4]
MODEL = 1030
# Addresses of the X series' control table (e-manual).
RETURN_DELAY, TORQUE, LED, REGISTERED, P_GAIN = 9, 64, 65, 69, 84
GOAL_VELOCITY, GOAL_POSITION, PRESENT_POSITION, PRESENT_TEMPERATURE = 104, 116, 132, 146

# Patience, ms, twice: a machine that is busy with other things answers late. The package has 16.
port_handler.LATENCY_TIMER = 250
port = PortHandler(sys.argv[1])
packets = PacketHandler(2.0)
assert port.openPort() and port.setBaudRate(4_000_000)


def done(outcome, error=0):
    """The outcome of an instruction must be success, and the servo must not have refused."""
    assert outcome == COMM_SUCCESS, packets.getTxRxResult(outcome)
    assert error == 0, packets.getRxPacketError(error)


def read1(servo, address):
    value, outcome, error = packets.read1ByteTxRx(port, servo, address)
    done(outcome, error)
    return value


def read2(servo, address):
    value, outcome, error = packets.read2ByteTxRx(port, servo, address)
    done(outcome, error)
    return value


def read4(servo, address):
    value, outcome, error = packets.read4ByteTxRx(port, servo, address)
    done(outcome, error)
    return value


def signed(value):
    return value - (1 << 32) if value >> 31 else value


def word(value):
    return list(value.to_bytes(2, "little"))


def until(holds, what):
    """Waits for what a servo takes its time for."""
    deadline = time.monotonic() + 60
    while not holds():
        assert time.monotonic() < deadline, what


def ping():
    for servo in IDS:
        model, outcome, error = packets.ping(port, servo)
        done(outcome, error)
        assert model == MODEL, model
    _, outcome, _ = packets.ping(port, 77)
    assert outcome == COMM_RX_TIMEOUT, "nobody has this id"


def broadcast_ping():
    found, outcome = packets.broadcastPing(port)
    done(outcome)
    assert sorted(found) == IDS and all(model == MODEL for model, _ in found.values()), found


def read_and_write():
    for servo in IDS:
        done(*packets.write1ByteTxRx(port, servo, LED, 1))
        done(*packets.write2ByteTxRx(port, servo, P_GAIN, 500 + servo))
        assert (read1(servo, LED), read2(servo, P_GAIN)) == (1, 500 + servo)
    # Goal Velocity -1 and Profile Acceleration 253: FF FF FD in the data, so there is byte stuffing both ways.
    stuffed = [0xFF, 0xFF, 0xFF, 0xFF, 0xFD, 0x00, 0x00, 0x00]
    done(*packets.writeTxRx(port, 1, GOAL_VELOCITY, 8, stuffed))
    data, outcome, error = packets.readTxRx(port, 1, GOAL_VELOCITY, 8)
    done(outcome, error)
    assert data == stuffed, data
    done(*packets.writeTxRx(port, 1, GOAL_VELOCITY, 8, [0] * 8))
    # Refusals: a number out of range, a register that is only read, EEPROM with the torque on.
    _, error = packets.write1ByteTxRx(port, 1, LED, 2)
    assert error == 4, error
    _, error = packets.write1ByteTxRx(port, 1, PRESENT_TEMPERATURE, 0)
    assert error == 7, error
    done(*packets.write1ByteTxRx(port, 1, TORQUE, 1))
    _, error = packets.write1ByteTxRx(port, 1, RETURN_DELAY, 10)
    assert error == 7, error
    done(*packets.write1ByteTxRx(port, 1, TORQUE, 0))


def sync():
    write = GroupSyncWrite(port, packets, P_GAIN, 2)
    for servo in IDS:
        assert write.addParam(servo, word(600 + servo))
    done(write.txPacket())
    for fast in (False, True):
        reader = GroupSyncRead(port, packets, P_GAIN, 2)
        for servo in IDS:
            assert reader.addParam(servo)
        done(reader.fastSyncRead() if fast else reader.txRxPacket())
        for servo in IDS:
            assert reader.isAvailable(servo, P_GAIN, 2), (fast, servo)
            assert reader.getData(servo, P_GAIN, 2) == 600 + servo, (fast, servo)


def bulk():
    write = GroupBulkWrite(port, packets)
    assert write.addParam(1, P_GAIN, 2, word(700)) and write.addParam(3, LED, 1, [1])
    assert write.addParam(2, LED, 1, [0])
    done(write.txPacket())
    for fast in (False, True):
        reader = GroupBulkRead(port, packets)
        # In this order, and with these lengths: on a fast reply the package looks for a servo's length behind the
        # first byte of the whole request that equals its id.
        assert reader.addParam(4, PRESENT_POSITION, 4)
        assert reader.addParam(3, LED, 1) and reader.addParam(2, LED, 1)
        done(reader.fastBulkRead() if fast else reader.txRxPacket())
        assert reader.getData(4, PRESENT_POSITION, 4) == read4(4, PRESENT_POSITION), fast
        read = [reader.getData(3, LED, 1), reader.getData(2, LED, 1)]
        assert read == [1, 0], (fast, read)
    assert read2(1, P_GAIN) == 700


def register_and_act():
    for servo in IDS:
        done(*packets.regWriteTxRx(port, servo, P_GAIN, 2, word(800)))
        assert (read1(servo, REGISTERED), read2(servo, P_GAIN) == 800) == (1, False)
    done(packets.action(port, 254))
    for servo in IDS:
        assert (read1(servo, REGISTERED), read2(servo, P_GAIN)) == (0, 800)


def move():
    start = signed(read4(2, PRESENT_POSITION))
    goal = start + 300 if start < 2048 else start - 300
    done(*packets.write1ByteTxRx(port, 2, TORQUE, 1))
    done(*packets.write4ByteTxRx(port, 2, GOAL_POSITION, goal))
    until(lambda: abs(signed(read4(2, PRESENT_POSITION)) - goal) < 20, "servo 2 does not get to its goal")
    done(*packets.write1ByteTxRx(port, 2, TORQUE, 0))


def answers(servo):
    return packets.ping(port, servo)[1] == COMM_SUCCESS


def reboot():
    done(*packets.write2ByteTxRx(port, 3, P_GAIN, 123))
    done(*packets.write1ByteTxRx(port, 3, TORQUE, 1))
    done(*packets.reboot(port, 3))
    until(lambda: answers(3), "servo 3 does not come back")
    assert (read1(3, TORQUE), read2(3, P_GAIN)) == (0, 800), "what is not in the EEPROM is as shipped"


def factory_reset():
    done(*packets.write1ByteTxRx(port, 4, RETURN_DELAY, 33))
    # All but the id and the rate.
    done(*packets.factoryReset(port, 4, 0x02))
    until(lambda: answers(4), "servo 4 does not come back")
    assert read1(4, RETURN_DELAY) == 250, "as shipped"
    # All but the id: the rate is 57600 then.
    done(*packets.factoryReset(port, 4, 0x01))
    assert port.setBaudRate(57_600)
    until(lambda: answers(4), "servo 4 does not come back at the rate it was shipped with")
    done(*packets.write1ByteTxRx(port, 4, 8, 6))
    assert port.setBaudRate(4_000_000)
    until(lambda: answers(4), "servo 4 does not come back at its old rate")


for step in (
    ping,
    broadcast_ping,
    read_and_write,
    sync,
    bulk,
    register_and_act,
    move,
    reboot,
    factory_reset,
):
    step()
    print(step.__name__)
port.closePort()
