"""Drives simulated Feetech STS servos with the package feetech-servo-sdk, unmodified.

Arguments: the port of a bus with the servos 1 to 4 (STS3215, 1 Mbaud).
"""

import sys
import time

from scservo_sdk import (
    COMM_SUCCESS,
    GroupSyncRead,
    GroupSyncWrite,
    PacketHandler,
    PortHandler,
    port_handler,
)

IDS = [1, 2, 3, 4]
MODEL = 777
# Addresses of the STS memory table (Feetech wiki).
TORQUE, GOAL_POSITION, TORQUE_LIMIT, PRESENT_POSITION, PRESENT_TEMPERATURE = 40, 42, 48, 56, 63

# Patience, ms: a machine that is busy with other things answers late. The package has 50 or less.
port_handler.LATENCY_TIMER = 500
port = PortHandler(sys.argv[1])
# 0: little endian, as the STS series is.
packets = PacketHandler(0)
assert port.openPort() and port.setBaudRate(1_000_000)


def done(outcome, error=0):
    """The outcome of an instruction must be success, and the servo must have no alarm."""
    assert outcome == COMM_SUCCESS, packets.getTxRxResult(outcome)
    assert error == 0, packets.getRxPacketError(error)


def value(answer):
    number, outcome, error = answer
    done(outcome, error)
    return number


def position(servo):
    return value(packets.read2ByteTxRx(port, servo, PRESENT_POSITION))


def ping():
    for servo in IDS:
        assert value(packets.ping(port, servo)) == MODEL


def read_and_write():
    for servo in IDS:
        done(*packets.write2ByteTxRx(port, servo, TORQUE_LIMIT, 600 + servo))
        assert value(packets.read2ByteTxRx(port, servo, TORQUE_LIMIT)) == 600 + servo
        assert 10 < value(packets.read1ByteTxRx(port, servo, PRESENT_TEMPERATURE)) < 60


def move_by_sync_write_and_watch_by_sync_read():
    found = {servo: position(servo) for servo in IDS}
    goals = {servo: at + 150 if at < 2048 else at - 150 for servo, at in found.items()}
    writer = GroupSyncWrite(port, packets, GOAL_POSITION, 2)
    reader = GroupSyncRead(port, packets, PRESENT_POSITION, 2)
    for servo, goal in goals.items():
        assert writer.addParam(servo, [goal & 0xFF, goal >> 8]) and reader.addParam(servo)
    done(writer.txPacket())
    for servo in IDS:
        done(*packets.write1ByteTxRx(port, servo, TORQUE, 1))
    deadline = time.monotonic() + 60
    far_off = IDS
    while far_off:
        assert time.monotonic() < deadline, f"servos {far_off} do not get to their goals"
        done(reader.txRxPacket())
        assert all(reader.isAvailable(servo, PRESENT_POSITION, 2) for servo in IDS)
        at = {servo: reader.getData(servo, PRESENT_POSITION, 2) for servo in IDS}
        far_off = [servo for servo in IDS if abs(at[servo] - goals[servo]) >= 20]
    for servo in IDS:
        done(*packets.write1ByteTxRx(port, servo, TORQUE, 0))


for step in (ping, read_and_write, move_by_sync_write_and_watch_by_sync_read):
    step()
    print(step.__name__)
port.closePort()
