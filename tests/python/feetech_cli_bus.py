"""Puts the simulated Feetech bus of the package feetech-cli behind a pseudo-terminal.

Arguments: where to put a link to the terminal, and how many servos there are (ids from 1). Says "ready" when it is
there. Ends at the end of standard input.
"""

import fcntl
import os
import pty
import select
import struct
import sys
import tty

from feetech_cli.simulator import SimulatedBus, SimulatedServo

link, count = sys.argv[1], int(sys.argv[2])
servos = [SimulatedServo(servo) for servo in range(1, count + 1)]
bus = SimulatedBus(servos)

master, slave = pty.openpty()
tty.setraw(slave)
os.symlink(os.ttyname(slave), link)
print("ready", flush=True)

heard = bytearray()
# Linux, asm-generic: TCGETS2, and struct termios2 up to its output speed. termios itself knows no free rates.
TCGETS2 = 0x802C542A
TERMIOS2 = struct.Struct("IIIIB19sII")


def line_rate():
    """The rate that a program has set, in bit/s."""
    return TERMIOS2.unpack(fcntl.ioctl(slave, TCGETS2, bytes(TERMIOS2.size)))[-1]


def take_packet():
    """The next whole packet of what was heard; the bus wants them whole. None where there is none."""
    while len(heard) >= 4:
        length = 4 + heard[3]
        if heard[:2] != b"\xff\xff" or heard[2] == 0xFF or heard[3] < 2:
            del heard[0]
        elif len(heard) < length:
            return None
        else:
            packet = bytes(heard[:length])
            del heard[:length]
            return packet
    return None


while True:
    ready, _, _ = select.select([master, sys.stdin], [], [])
    if sys.stdin in ready and not sys.stdin.buffer.read1(1):
        break
    if master not in ready:
        continue
    heard += os.read(master, 4096)
    bus.baudrate = line_rate()
    while (packet := take_packet()) is not None:
        bus.write(packet)
        answer = bus.read(1 << 16)
        if answer:
            os.write(master, answer)
# What they were told last, for whoever asks.
print(" ".join(str(servo.get("goal_position")) for servo in servos))
