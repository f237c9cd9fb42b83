//! Servo models as the robot has them: performance, counts, limits and the registers that the controller uses.
//!
//! The models themselves are data of their protocols, in `src/bus/dynamixel/models.rs` and its likes.

/// The protocol of a bus.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Protocol {
    /// Dynamixel Protocol 2.0.
    Dynamixel,
    /// Feetech FT-SCS.
    Feetech,
}

impl Protocol {
    /// Largest id a servo may have. Dynamixel: 252; Feetech allows 253, but vendor SDKs stop at 252.
    pub const ID_MAX: u8 = 252;
}

/// How a register's bits encode a number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Encoding {
    /// Unsigned integer.
    Unsigned,
    /// Two's complement over the register's width.
    TwosComplement,
    /// Sign and magnitude: this bit is the sign, the bits below it are the magnitude.
    SignMagnitude(u8),
}

/// One register of a control table. Its [`Registers`] give the byte order.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Register {
    /// First address.
    pub address: u16,
    /// Width, 1, 2 or 4 bytes.
    pub bytes: u8,
    /// Meaning of the bits.
    pub encoding: Encoding,
}

/// The registers the loop uses. All servos of one bus share one set.
#[derive(Debug, PartialEq, Eq)]
pub struct Registers {
    /// True if words come high byte first.
    pub is_big_endian: bool,
    /// True if one request can read all servos of a bus. Otherwise they are read one by one.
    pub has_sync_read: bool,
    /// Model number, read at start.
    pub model_number: Register,
    /// Firmware version: the major number and, if there is one, the minor number.
    pub firmware: (Register, Option<Register>),
    /// Registers and the values they must hold before a run: in other modes the registers above mean
    /// something else.
    pub expected: &'static [(Register, i64)],
    /// Return delay, in units of 2 microseconds; `None` if its address is unknown.
    pub return_delay: Option<Register>,
    /// Values written, in this order, before a run and again to a servo that may have restarted: torque off;
    /// no bus watchdog (one that has tripped rejects goals); no ramp of the servo's own (the goals are
    /// already smooth, and a ramp would only make it lag).
    pub preparation: &'static [(Register, i64)],
    /// Torque on (1) or off (0).
    pub torque_enable: Register,
    /// Values written, in this order, to make the shaft's present position the servo's middle count,
    /// permanently. Empty for servos that cannot do this.
    pub set_middle: &'static [(Register, i64)],
    /// Stops the servo when its bus has been silent for this many units of 20 ms; 0 means never. `None` for
    /// servos without such a watchdog.
    pub bus_watchdog: Option<Register>,
    /// Torque limit while moving, in units of [`ServoModel::torque_limit_full`].
    pub torque_limit: Register,
    /// Goal position, counts.
    pub goal_position: Register,
    /// Present position, counts.
    pub present_position: Register,
    /// Present speed.
    pub present_speed: Register,
    /// Present load or current.
    pub present_load: Register,
    /// Supply voltage, units of 0.1 V.
    pub present_voltage: Register,
    /// True if the load is the share of the supply on the motor. Otherwise it is the motor's current or torque.
    pub load_is_drive: bool,
    /// Temperature, degrees Celsius.
    pub present_temperature: Register,
    /// Causes of an alarm, one bit each.
    pub alarm_status: Register,
    /// Name of each alarm bit, in a word or two.
    pub alarm_names: &'static [(u8, &'static str)],
    /// True if every reply contains the alarm bits. Otherwise a reply only says that there is an alarm, and
    /// the register must be read for the cause.
    pub tells_alarms: bool,
    /// First address of the block read in every cycle; the block holds all the `present_` registers.
    pub feedback_address: u16,
    /// Length of that block, bytes.
    pub feedback_bytes: u16,
}

/// The alarm bit for too much load for too long; both makers use the same bit.
pub const OVERLOAD_ALARM: u8 = 0x20;

/// Shortest restart of any servo, s: Feetech's take 1.8 s (wiki, ft-scs 4.12); an XC330 took 0.4 s
/// (ROBOTIS-GIT/emanual, issue 1698). A servo that was silent for longer may have lost all its settings.
pub const START_MIN_S: f64 = 0.25;

impl Registers {
    /// Names of the alarm `bits` of [`Registers::alarm_status`], joined by commas; empty if there is no alarm.
    pub fn alarm_words(&self, bits: u8) -> String {
        let known =
            self.alarm_names.iter().filter(|(bit, _)| bits & bit != 0).map(|(_, name)| (*name).to_owned());
        let rest = self.alarm_names.iter().fold(bits, |rest, (bit, _)| rest & !bit);
        let unknown = (rest != 0).then(|| format!("bits 0x{rest:02X}"));
        known.chain(unknown).collect::<Vec<_>>().join(", ")
    }
}

/// The data that the controller needs about a servo model.
#[derive(Debug, PartialEq)]
pub struct ServoModel {
    /// Name used in robot files.
    pub name: &'static str,
    /// Protocol of its bus.
    pub protocol: Protocol,
    /// Value of its model-number register.
    pub model_number: u16,
    /// Stall torque at [`ServoModel::nominal_voltage_v`], N m.
    pub stall_torque_nm: f64,
    /// Stall current at that voltage, A.
    pub stall_current_a: f64,
    /// Share of the supply voltage that its position loop, with factory settings, applies per radian of error.
    pub position_gain_share_rad: f64,
    /// No-load speed at [`ServoModel::nominal_voltage_v`], rad/s.
    pub no_load_speed_rad_s: f64,
    /// Supply voltage at which the figures above hold, V.
    pub nominal_voltage_v: f64,
    /// Lowest supply voltage the maker allows, V.
    pub voltage_min_v: f64,
    /// Highest supply voltage the maker allows, V.
    pub voltage_max_v: f64,
    /// Factory temperature limit, degrees Celsius.
    pub temperature_max_c: u8,
    /// Highest baud rate it supports, bits per second.
    pub baud_max: u32,
    /// Counts in one full turn of the horn, even if it cannot turn that far.
    pub counts_per_turn: f64,
    /// Lowest and highest goal position in position mode, counts.
    pub count_range: (i32, i32),
    /// One unit of the speed register, rad/s.
    pub speed_unit_rad_s: f64,
    /// One unit of the load register as a share of stall torque.
    pub load_unit_share: f64,
    /// Value of the torque-limit register that means full stall torque.
    pub torque_limit_full: u16,
    /// Registers the loop uses.
    pub registers: &'static Registers,
    /// Source of the figures.
    pub source: &'static str,
}

/// Resolution of a servo's voltage reading, V: a reading this much above a limit may be at the limit.
const VOLTAGE_STEP_V: f64 = 0.1;

impl ServoModel {
    /// Torque per radian of position error at this supply, N m/rad.
    pub fn stiffness_nm_rad(&self, supply_v: f64) -> f64 {
        self.position_gain_share_rad * self.stall_torque_nm * supply_v / self.nominal_voltage_v
    }

    /// Torque of a motor that reports this share of its stall torque while it turns at `speed_rad_s`, N m.
    /// Where the load is the share of the supply on the motor, this subtracts the part that the motor's own speed
    /// takes.
    pub fn torque_nm(&self, load_share: f64, speed_rad_s: f64) -> f64 {
        let own = if self.registers.load_is_drive { speed_rad_s / self.no_load_speed_rad_s } else { 0.0 };
        (load_share - own) * self.stall_torque_nm
    }

    /// True if a servo that reports the supply `voltage_v` has more than its maximum. The servo counts in
    /// steps of 0.1 V, so a reading one step above may be the limit itself.
    pub fn is_too_much(&self, voltage_v: f64) -> bool {
        voltage_v > self.voltage_max_v + VOLTAGE_STEP_V
    }

    /// The middle count of its range: 2048 of a full turn (both makers' manuals), 512 of 300 degrees.
    pub fn middle_count(&self) -> f64 {
        if self.registers.is_big_endian { 512.0 } else { 0.5 * self.counts_per_turn }
    }
}
