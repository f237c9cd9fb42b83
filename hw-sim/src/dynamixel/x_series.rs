//! Dynamixel X-series control table. Source: ROBOTIS e-manual, control tables of XL330-M288, XL430-W250,
//! XM430-W210 and XM430-W350. This is the XM430-W210's; the other models are changes to it, in `models`.

use crate::registers::{Encoding::TwosComplement, IndirectBlock, Register, ro, ro_as, rw, rw_as};

pub(crate) const MODEL_NUMBER: u16 = 0;
pub(crate) const FIRMWARE: u16 = 6;
pub(crate) const ID: u16 = 7;
pub(crate) const BAUD: u16 = 8;
pub(crate) const RETURN_DELAY: u16 = 9;
pub(crate) const DRIVE_MODE: u16 = 10;
pub(crate) const OPERATING_MODE: u16 = 11;
pub(crate) const SECONDARY_ID: u16 = 12;
pub(crate) const PROTOCOL_TYPE: u16 = 13;
pub(crate) const HOMING_OFFSET: u16 = 20;
pub(crate) const MOVING_THRESHOLD: u16 = 24;
pub(crate) const TEMPERATURE_LIMIT: u16 = 31;
pub(crate) const MAX_VOLTAGE: u16 = 32;
pub(crate) const MIN_VOLTAGE: u16 = 34;
pub(crate) const PWM_LIMIT: u16 = 36;
pub(crate) const CURRENT_LIMIT: u16 = 38;
pub(crate) const VELOCITY_LIMIT: u16 = 44;
pub(crate) const MAX_POSITION: u16 = 48;
pub(crate) const MIN_POSITION: u16 = 52;
pub(crate) const STARTUP_CONFIGURATION: u16 = 60;
pub(crate) const PWM_SLOPE: u16 = 62;
pub(crate) const SHUTDOWN: u16 = 63;
pub(crate) const TORQUE_ENABLE: u16 = 64;
pub(crate) const STATUS_RETURN_LEVEL: u16 = 68;
pub(crate) const REGISTERED_INSTRUCTION: u16 = 69;
pub(crate) const HARDWARE_ERROR: u16 = 70;
pub(crate) const VELOCITY_I: u16 = 76;
pub(crate) const VELOCITY_P: u16 = 78;
pub(crate) const POSITION_D: u16 = 80;
pub(crate) const POSITION_I: u16 = 82;
pub(crate) const POSITION_P: u16 = 84;
pub(crate) const FEEDFORWARD_2ND: u16 = 88;
pub(crate) const FEEDFORWARD_1ST: u16 = 90;
pub(crate) const BUS_WATCHDOG: u16 = 98;
pub(crate) const GOAL_PWM: u16 = 100;
pub(crate) const GOAL_CURRENT: u16 = 102;
pub(crate) const GOAL_VELOCITY: u16 = 104;
pub(crate) const PROFILE_ACCELERATION: u16 = 108;
pub(crate) const PROFILE_VELOCITY: u16 = 112;
pub(crate) const GOAL_POSITION: u16 = 116;
pub(crate) const REALTIME_TICK: u16 = 120;
pub(crate) const MOVING: u16 = 122;
pub(crate) const MOVING_STATUS: u16 = 123;
pub(crate) const PRESENT_PWM: u16 = 124;
pub(crate) const PRESENT_CURRENT: u16 = 126;
pub(crate) const PRESENT_VELOCITY: u16 = 128;
pub(crate) const PRESENT_POSITION: u16 = 132;
pub(crate) const VELOCITY_TRAJECTORY: u16 = 136;
pub(crate) const POSITION_TRAJECTORY: u16 = 140;
pub(crate) const PRESENT_VOLTAGE: u16 = 144;
pub(crate) const PRESENT_TEMPERATURE: u16 = 146;
pub(crate) const BACKUP_READY: u16 = 147;

/// Registers that a change of the operating mode resets, and that Control Table Backup stores.
pub(crate) const GAINS: [u16; 7] =
    [VELOCITY_I, VELOCITY_P, POSITION_D, POSITION_I, POSITION_P, FEEDFORWARD_2ND, FEEDFORWARD_1ST];

/// Addresses below this one are EEPROM: locked while torque is on.
pub(crate) const EEPROM_END: u16 = 64;

/// Signed limits of Goal Position outside position mode: 256 turns either way.
const TURNS_256: i64 = 1_048_575;

/// The whole table except indirect addressing.
pub(super) static TABLE: &[Register] = &[
    ro(MODEL_NUMBER, 2, "Model Number", 1030),
    ro(2, 4, "Model Information", 0),
    // 46 or later, so that fast sync read is available.
    ro(FIRMWARE, 1, "Firmware Version", 46),
    rw(ID, 1, "ID", (1, 0, 252)),
    rw(BAUD, 1, "Baud Rate", (1, 0, 7)),
    rw(RETURN_DELAY, 1, "Return Delay Time", (250, 0, 254)),
    rw(DRIVE_MODE, 1, "Drive Mode", (0, 0, 13)),
    rw(OPERATING_MODE, 1, "Operating Mode", (3, 0, 16)),
    // 0..=252 set the id; 253 and above switch it off.
    rw(SECONDARY_ID, 1, "Secondary ID", (255, 0, 255)),
    rw(PROTOCOL_TYPE, 1, "Protocol Type", (2, 1, 2)),
    rw_as(HOMING_OFFSET, 4, "Homing Offset", TwosComplement, (0, -1_044_479, 1_044_479)),
    rw(MOVING_THRESHOLD, 4, "Moving Threshold", (10, 0, 1023)),
    rw(TEMPERATURE_LIMIT, 1, "Temperature Limit", (80, 0, 100)),
    rw(MAX_VOLTAGE, 2, "Max Voltage Limit", (160, 95, 160)),
    rw(MIN_VOLTAGE, 2, "Min Voltage Limit", (95, 95, 160)),
    rw(PWM_LIMIT, 2, "PWM Limit", (885, 0, 885)),
    rw(CURRENT_LIMIT, 2, "Current Limit", (1193, 0, 1193)),
    rw(VELOCITY_LIMIT, 4, "Velocity Limit", (330, 0, 1023)),
    rw(MAX_POSITION, 4, "Max Position Limit", (4095, 0, 4095)),
    rw(MIN_POSITION, 4, "Min Position Limit", (0, 0, 4095)),
    rw(STARTUP_CONFIGURATION, 1, "Startup Configuration", (0, 0, 3)),
    rw(SHUTDOWN, 1, "Shutdown", (52, 0, 255)),
    rw(TORQUE_ENABLE, 1, "Torque Enable", (0, 0, 1)),
    rw(65, 1, "LED", (0, 0, 1)),
    rw(STATUS_RETURN_LEVEL, 1, "Status Return Level", (2, 0, 2)),
    ro(REGISTERED_INSTRUCTION, 1, "Registered Instruction", 0),
    ro(HARDWARE_ERROR, 1, "Hardware Error Status", 0),
    rw(VELOCITY_I, 2, "Velocity I Gain", (1920, 0, 16383)),
    rw(VELOCITY_P, 2, "Velocity P Gain", (100, 0, 16383)),
    rw(POSITION_D, 2, "Position D Gain", (0, 0, 16383)),
    rw(POSITION_I, 2, "Position I Gain", (0, 0, 16383)),
    rw(POSITION_P, 2, "Position P Gain", (800, 0, 16383)),
    rw(FEEDFORWARD_2ND, 2, "Feedforward 2nd Gain", (0, 0, 16383)),
    rw(FEEDFORWARD_1ST, 2, "Feedforward 1st Gain", (0, 0, 16383)),
    rw_as(BUS_WATCHDOG, 1, "Bus Watchdog", TwosComplement, (0, 0, 127)),
    // The limit registers narrow the ranges of these four goals; see the servo's own check.
    rw_as(GOAL_PWM, 2, "Goal PWM", TwosComplement, (885, -885, 885)),
    rw_as(GOAL_CURRENT, 2, "Goal Current", TwosComplement, (1193, -1193, 1193)),
    rw_as(GOAL_VELOCITY, 4, "Goal Velocity", TwosComplement, (330, -1023, 1023)),
    rw(PROFILE_ACCELERATION, 4, "Profile Acceleration", (0, 0, 32767)),
    rw(PROFILE_VELOCITY, 4, "Profile Velocity", (0, 0, 32767)),
    rw_as(GOAL_POSITION, 4, "Goal Position", TwosComplement, (0, -TURNS_256, TURNS_256)),
    ro(REALTIME_TICK, 2, "Realtime Tick", 0),
    ro(MOVING, 1, "Moving", 0),
    ro(MOVING_STATUS, 1, "Moving Status", 0),
    ro_as(PRESENT_PWM, 2, "Present PWM", TwosComplement),
    // Present Load on the XL430.
    ro_as(PRESENT_CURRENT, 2, "Present Current", TwosComplement),
    ro_as(PRESENT_VELOCITY, 4, "Present Velocity", TwosComplement),
    ro_as(PRESENT_POSITION, 4, "Present Position", TwosComplement),
    ro_as(VELOCITY_TRAJECTORY, 4, "Velocity Trajectory", TwosComplement),
    ro_as(POSITION_TRAJECTORY, 4, "Position Trajectory", TwosComplement),
    ro(PRESENT_VOLTAGE, 2, "Present Input Voltage", 0),
    ro(PRESENT_TEMPERATURE, 1, "Present Temperature", 0),
    ro(BACKUP_READY, 1, "Backup Ready", 0),
];

/// Name of all indirect address registers.
pub(crate) const INDIRECT_ADDRESS: &str = "Indirect Address";

/// Addresses below this one take no part in indirect addressing.
pub(crate) const INDIRECT_START: u16 = 168;

/// Indirect addressing of the XL330.
pub(super) const INDIRECT_XL330: &[IndirectBlock] = &[IndirectBlock { address: 168, data: 208, pairs: 20 }];
/// Indirect addressing of all others.
pub(super) const INDIRECT: &[IndirectBlock] = &[
    IndirectBlock { address: 168, data: 224, pairs: 28 },
    IndirectBlock { address: 578, data: 634, pairs: 28 },
];

/// The indirect address register of the data byte at `data`; `None` if that is no indirect data.
pub(super) fn indirect_address_of(blocks: &[IndirectBlock], data: u16) -> Option<u16> {
    let block = blocks.iter().find(|block| (block.data..block.data + block.pairs).contains(&data))?;
    Some(block.address + 2 * (data - block.data))
}

/// The registers of indirect addressing. A pointer may hold any address of RAM up to the last byte of indirect data.
/// As shipped, each data byte stands for itself.
pub(super) fn indirect_registers(blocks: &[IndirectBlock]) -> Vec<Register> {
    let last = blocks.iter().map(|block| block.data + block.pairs - 1).max().unwrap_or_default();
    let pairs =
        blocks.iter().flat_map(|block| (0..block.pairs).map(|n| (block.address + 2 * n, block.data + n)));
    pairs
        .flat_map(|(address, data)| {
            let range = (i64::from(data), i64::from(EEPROM_END), i64::from(last));
            [rw(address, 2, INDIRECT_ADDRESS, range), rw(data, 1, "Indirect Data", (0, 0, 255))]
        })
        .collect()
}
