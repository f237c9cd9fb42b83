//! Feetech SCS memory table: potentiometer servos, 10 bit, high byte first. Source: Feetech wiki, reference,
//! memory-scscl. Values that this page leaves open come from Feetech's manual of the SCS15 and are marked so.

use crate::registers::{Encoding::SignMagnitude, Register, ro, ro_as, rw};

/// SCS has these registers where STS has others. All other registers that both have are at the same address.
pub(crate) const HOLDING_TORQUE: u16 = 37;
pub(crate) const PROTECTION_TIME: u16 = 38;
pub(crate) const OVERLOAD_TORQUE: u16 = 39;
pub(crate) const LOCK: u16 = 48;
/// Running time, ms; in motor mode the drive, with its sign in bit 10.
pub(crate) const RUNNING_TIME: u16 = 44;

const fn big(register: Register) -> Register {
    Register { is_big_endian: true, ..register }
}

/// The whole table.
pub(super) static TABLE: &[Register] = &[
    ro(0, 1, "Firmware Major", 3),
    ro(1, 1, "Firmware Minor", 10),
    ro(2, 1, "END", 1),
    // Servo major and minor version.
    big(ro(3, 2, "Model Number", 1284)),
    rw(5, 1, "ID", (1, 0, 253)),
    rw(6, 1, "Baud Rate", (0, 0, 7)),
    // Undefined in the wiki; return delay, 2 µs a unit, in the SCS15's manual.
    rw(7, 1, "Return Delay", (0, 0, 254)),
    rw(8, 1, "Response Level", (1, 0, 1)),
    big(rw(9, 2, "Min Angle Limit", (20, 0, 1023))),
    big(rw(11, 2, "Max Angle Limit", (1003, 0, 1023))),
    rw(13, 1, "Max Temperature", (70, 0, 100)),
    // The SCS0009 is sold for 4.8 to 8.4 V.
    rw(14, 1, "Max Voltage", (90, 0, 254)),
    rw(15, 1, "Min Voltage", (40, 0, 254)),
    big(rw(16, 2, "Max Torque", (1000, 0, 1000))),
    // Speed 0 means highest (8): estimate.
    rw(18, 1, "Phase", (8, 0, 254)),
    // Voltage, overheating, overload (SCS15).
    rw(19, 1, "Unload Condition", (0x25, 0, 254)),
    rw(20, 1, "LED Alarm Condition", (0x25, 0, 254)),
    rw(21, 1, "Position P", (15, 0, 254)),
    rw(22, 1, "Position D", (0, 0, 254)),
    rw(23, 1, "Undefined 23", (0, 0, 254)),
    big(rw(24, 2, "Minimum Startup Torque", (0, 0, 1000))),
    rw(26, 1, "Positive Dead Band", (1, 0, 16)),
    rw(27, 1, "Negative Dead Band", (1, 0, 16)),
    rw(HOLDING_TORQUE, 1, "Holding Torque", (20, 0, 254)),
    rw(PROTECTION_TIME, 1, "Protection Time", (200, 0, 254)),
    rw(OVERLOAD_TORQUE, 1, "Overload Torque", (80, 0, 254)),
    rw(40, 1, "Torque Switch", (0, 0, 255)),
    rw(41, 1, "Undefined 41", (0, 0, 255)),
    big(rw(42, 2, "Goal Position", (0, 0, 1023))),
    big(rw(RUNNING_TIME, 2, "Running Time", (0, 0, 9999))),
    big(rw(46, 2, "Running Speed", (0, 0, 1000))),
    rw(LOCK, 1, "Lock", (1, 0, 1)),
    big(ro_as(56, 2, "Present Position", SignMagnitude(15))),
    big(ro_as(58, 2, "Present Speed", SignMagnitude(15))),
    big(ro_as(60, 2, "Present Load", SignMagnitude(10))),
    ro(62, 1, "Present Voltage", 0),
    ro(63, 1, "Present Temperature", 0),
    ro(64, 1, "Async Write Flag", 0),
    ro(65, 1, "Servo Status", 0),
    ro(66, 1, "Moving", 0),
    ro(78, 1, "PWM Mode Maximum Step", 20),
    ro(79, 1, "Moving Threshold", 1),
    ro(80, 1, "DTs (ms)", 20),
    ro(81, 1, "Minimum Speed Limit", 1),
    // 40 times 50 step/s is more than its 100 rpm.
    ro(82, 1, "Maximum Speed Limit", 40),
    ro(83, 1, "Acceleration", 20),
];
