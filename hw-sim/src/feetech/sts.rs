//! Feetech STS memory table. Source: Feetech wiki, reference, memory-sts. Values that this page leaves open (gains,
//! masks, factory block) are the initial values in Waveshare's memory table for its ST3215, the same servo; or else
//! values seen in shipped STS3215, and are marked so.

use crate::registers::{Encoding::SignMagnitude, Register, ro, ro_as, rw, rw_as};

pub(crate) const MODEL_NUMBER: u16 = 3;
pub(crate) const ID: u16 = 5;
pub(crate) const BAUD: u16 = 6;
pub(crate) const RETURN_DELAY: u16 = 7;
pub(crate) const RESPONSE_LEVEL: u16 = 8;
pub(crate) const MIN_ANGLE: u16 = 9;
pub(crate) const MAX_ANGLE: u16 = 11;
pub(crate) const MAX_TEMPERATURE: u16 = 13;
pub(crate) const MAX_VOLTAGE: u16 = 14;
pub(crate) const MIN_VOLTAGE: u16 = 15;
pub(crate) const MAX_TORQUE: u16 = 16;
pub(crate) const PHASE: u16 = 18;
pub(crate) const UNLOAD_MASK: u16 = 19;
pub(crate) const LED_MASK: u16 = 20;
pub(crate) const POSITION_P: u16 = 21;
pub(crate) const POSITION_D: u16 = 22;
pub(crate) const MIN_START_TORQUE: u16 = 24;
pub(crate) const DEAD_BAND_POSITIVE: u16 = 26;
pub(crate) const DEAD_BAND_NEGATIVE: u16 = 27;
pub(crate) const PROTECTION_CURRENT: u16 = 28;
pub(crate) const ANGLE_RESOLUTION: u16 = 30;
pub(crate) const OFFSET: u16 = 31;
pub(crate) const MODE: u16 = 33;
pub(crate) const HOLDING_TORQUE: u16 = 34;
pub(crate) const PROTECTION_TIME: u16 = 35;
pub(crate) const OVERLOAD_TORQUE: u16 = 36;
pub(crate) const SPEED_P: u16 = 37;
pub(crate) const OVERCURRENT_TIME: u16 = 38;
pub(crate) const SPEED_I: u16 = 39;
pub(crate) const TORQUE_SWITCH: u16 = 40;
pub(crate) const ACCELERATION: u16 = 41;
pub(crate) const GOAL_POSITION: u16 = 42;
pub(crate) const GOAL_PWM: u16 = 44;
pub(crate) const RUNNING_SPEED: u16 = 46;
pub(crate) const TORQUE_LIMIT: u16 = 48;
pub(crate) const LOCK: u16 = 55;
pub(crate) const PRESENT_POSITION: u16 = 56;
pub(crate) const PRESENT_SPEED: u16 = 58;
pub(crate) const PRESENT_LOAD: u16 = 60;
pub(crate) const PRESENT_VOLTAGE: u16 = 62;
pub(crate) const PRESENT_TEMPERATURE: u16 = 63;
pub(crate) const ASYNC_FLAG: u16 = 64;
pub(crate) const STATUS: u16 = 65;
pub(crate) const MOVING: u16 = 66;
pub(crate) const GOAL_READ_BACK: u16 = 67;
pub(crate) const PRESENT_CURRENT: u16 = 69;
pub(crate) const MOVING_THRESHOLD: u16 = 80;

/// Addresses below this one are EPROM.
pub(crate) const EPROM_END: u16 = 40;

/// The whole table.
pub(super) static TABLE: &[Register] = &[
    ro(0, 1, "Firmware Major", 3),
    ro(1, 1, "Firmware Minor", 10),
    ro(2, 1, "END", 0),
    ro(MODEL_NUMBER, 2, "Model Number", 777),
    rw(ID, 1, "ID", (1, 0, 253)),
    rw(BAUD, 1, "Baud Rate", (0, 0, 7)),
    // Kept, but without a function in this series.
    rw(RETURN_DELAY, 1, "Return Delay", (0, 0, 254)),
    rw(RESPONSE_LEVEL, 1, "Response Level", (1, 0, 1)),
    rw(MIN_ANGLE, 2, "Min Angle Limit", (0, 0, 4094)),
    // The wiki's range starts at 1, but its multi-turn mode needs 0.
    rw(MAX_ANGLE, 2, "Max Angle Limit", (4095, 0, 4095)),
    rw(MAX_TEMPERATURE, 1, "Max Temperature", (70, 0, 100)),
    rw(MAX_VOLTAGE, 1, "Max Voltage", (140, 0, 254)),
    rw(MIN_VOLTAGE, 1, "Min Voltage", (40, 0, 254)),
    rw(MAX_TORQUE, 2, "Max Torque", (1000, 0, 1000)),
    // Speed unit 1 step/s (4), speed 0 means highest (8), full-angle feedback (16).
    rw(PHASE, 1, "Phase", (28, 0, 254)),
    // Overheating, overcurrent, overload.
    rw(UNLOAD_MASK, 1, "Unload Condition", (0x2C, 0, 254)),
    rw(LED_MASK, 1, "LED Alarm Condition", (0x2F, 0, 254)),
    rw(POSITION_P, 1, "Position P", (32, 0, 254)),
    rw(POSITION_D, 1, "Position D", (32, 0, 254)),
    rw(23, 1, "Position I", (0, 0, 254)),
    // One byte by the wiki; some clients treat 24 as a word.
    rw(MIN_START_TORQUE, 1, "Minimum Startup Torque", (16, 0, 254)),
    rw(25, 1, "Integral Limit", (0, 0, 254)),
    rw(DEAD_BAND_POSITIVE, 1, "Positive Dead Band", (1, 0, 16)),
    rw(DEAD_BAND_NEGATIVE, 1, "Negative Dead Band", (1, 0, 16)),
    rw(PROTECTION_CURRENT, 2, "Protection Current", (511, 0, 2047)),
    rw(ANGLE_RESOLUTION, 1, "Angle Resolution", (1, 1, 128)),
    rw_as(OFFSET, 2, "Position Offset", SignMagnitude(11), (0, -2047, 2047)),
    rw(MODE, 1, "Operating Mode", (0, 0, 3)),
    rw(HOLDING_TORQUE, 1, "Holding Torque", (20, 0, 254)),
    rw(PROTECTION_TIME, 1, "Protection Time", (200, 0, 254)),
    rw(OVERLOAD_TORQUE, 1, "Overload Torque", (80, 0, 254)),
    rw(SPEED_P, 1, "Speed P", (10, 0, 254)),
    rw(OVERCURRENT_TIME, 1, "Overcurrent Time", (200, 0, 254)),
    rw(SPEED_I, 1, "Speed I", (10, 0, 254)),
    rw(TORQUE_SWITCH, 1, "Torque Switch", (0, 0, 255)),
    rw(ACCELERATION, 1, "Acceleration", (0, 0, 254)),
    rw_as(GOAL_POSITION, 2, "Goal Position", SignMagnitude(15), (0, -32767, 32767)),
    rw_as(GOAL_PWM, 2, "PWM Open-Loop Speed", SignMagnitude(10), (0, -1000, 1000)),
    // With bit 3 of the phase, 0 is the highest speed.
    rw_as(RUNNING_SPEED, 2, "Running Speed", SignMagnitude(15), (0, -32767, 32767)),
    rw(TORQUE_LIMIT, 2, "Torque Limit", (1000, 0, 1000)),
    rw(50, 1, "Undefined 50", (0, 0, 255)),
    rw(51, 1, "Undefined 51", (0, 0, 255)),
    rw(52, 1, "Undefined 52", (0, 0, 255)),
    rw(53, 1, "Undefined 53", (0, 0, 255)),
    rw(54, 1, "Undefined 54", (0, 0, 255)),
    rw(LOCK, 1, "Lock", (1, 0, 1)),
    ro_as(PRESENT_POSITION, 2, "Present Position", SignMagnitude(15)),
    ro_as(PRESENT_SPEED, 2, "Present Speed", SignMagnitude(15)),
    ro_as(PRESENT_LOAD, 2, "Present Load", SignMagnitude(10)),
    ro(PRESENT_VOLTAGE, 1, "Present Voltage", 0),
    ro(PRESENT_TEMPERATURE, 1, "Present Temperature", 0),
    ro(ASYNC_FLAG, 1, "Async Write Flag", 0),
    ro(STATUS, 1, "Servo Status", 0),
    ro(MOVING, 1, "Moving", 0),
    ro_as(GOAL_READ_BACK, 2, "Goal Position Read-Back", SignMagnitude(15)),
    ro_as(PRESENT_CURRENT, 2, "Present Current", SignMagnitude(15)),
    ro(71, 2, "Undefined 71", 0),
    // Factory block (seen in servos).
    ro(MOVING_THRESHOLD, 1, "Moving Threshold", 1),
    ro(81, 1, "DTs (ms)", 20),
    ro(82, 1, "Speed Unit", 50),
    ro(83, 1, "Minimum Speed Limit", 1),
    ro(84, 1, "Maximum Speed Limit", 104),
    ro(85, 1, "Acceleration Limit", 254),
    ro(86, 1, "Acceleration Multiplier", 1),
];
