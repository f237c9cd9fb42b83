//! Control tables by name: the meaning of each register, in the units people use.
//!
//! Names are those of the ROBOTIS manual, in lower case; a Feetech register with the same function has the same
//! name, so that one script serves both. The tables and their sources are in the folders of the protocols.

mod value;

use std::borrow::Cow;
use std::f64::consts::TAU;

use crate::model::servo_model::{Encoding, Register};
use crate::model::{Firmware, Protocol, Registers};
pub use value::{BadValue, Value};
pub(crate) use value::{decode_bytes, encode_bytes};

/// Which side may change a register, and whether the value survives without power.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Access {
    /// The servo alone.
    Fixed,
    /// A setting: it survives without power, and can be written only without torque.
    Setting,
    /// Lost without power.
    Volatile,
}

/// The meaning of one count of a register.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Scale {
    /// A number without unit, a switch, or bits.
    Plain,
    /// This much of a unit.
    Linear(f64, &'static str),
    /// The code of a line rate, bit/s.
    Baud,
    /// Current, with a unit that depends on the model.
    Current,
    /// Speed of a Feetech STS; a bit of its `phase` chooses the unit.
    PhasedSpeed,
}

/// One register.
#[derive(Debug, Clone, PartialEq)]
pub struct RegisterInfo {
    /// Name, such as `present_position`.
    pub name: Cow<'static, str>,
    /// Its address and encoding. The byte order is the series'.
    pub register: Register,
    /// Which side may change it.
    pub access: Access,
    /// The meaning of one count.
    pub scale: Scale,
    /// Lowest and highest count that may be written, over all models of the series.
    pub range: (i64, i64),
    /// The meaning of its values, if that is not plain; may be empty.
    pub note: &'static str,
}

/// Servos with the same control table apart from details.
#[derive(Debug)]
pub struct Series {
    /// The maker's name of it.
    pub name: &'static str,
    /// Its protocol.
    pub protocol: Protocol,
    /// The registers that the loop uses.
    pub registers: &'static Registers,
    /// Counts of the position register in a full turn, whether or not the servo can turn that far.
    pub counts_per_turn: f64,
    /// All registers of the model with this number, by address. An unknown model is treated as one of the series.
    pub(super) table: fn(u16) -> Vec<RegisterInfo>,
    /// One count of a current register of the model with this number, A; `None` if it does not measure current.
    pub(super) current_unit_a: fn(u16) -> Option<f64>,
    /// Settings that a new servo needs beside id, line rate and return delay, in the order of writing.
    pub(crate) setup: &'static [Target],
    /// The offset that a servo adds to its position, if it has one.
    pub(crate) offset: Option<Offset>,
    /// Name of the setting that limits the register [`Registers::torque_limit`].
    pub(crate) torque_ceiling: &'static str,
}

impl Series {
    /// The new value of the setting of this name; `None` if it stays as it is.
    pub(crate) fn wanted(&self, name: &str) -> Option<i64> {
        self.setup.iter().find(|target| target.name == name).and_then(|target| match target.want {
            Want::Count(count) => Some(count),
            Want::Bits { .. } => None,
        })
    }
}

impl Series {
    /// Address and value of each setting of a servo of the model `number` that has been set up and calibrated; `held` is the
    /// byte at an address of a new servo.
    pub(crate) fn after_setup(&self, number: u16, held: impl Fn(u16) -> u8) -> Vec<(u16, i64)> {
        let table = (self.table)(number);
        let kept = self.setup.iter().filter(|target| !target.is_for_new);
        kept.filter_map(|target| {
            let address = table.iter().find(|register| register.name == target.name)?.register.address;
            Some((address, target.want.applied_to(i64::from(held(address)))))
        })
        .collect()
    }
}

impl PartialEq for Series {
    fn eq(&self, other: &Series) -> bool {
        self.name == other.name
    }
}

impl Eq for Series {}

/// How a servo uses its register `homing_offset`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Offset {
    /// 1 if the servo adds it to the encoder's value, -1 if it subtracts it.
    pub(crate) sign: i64,
    /// The largest that it applies in position mode, counts.
    pub(crate) largest: i64,
}

/// The content that a register should have.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Want {
    /// This count.
    Count(i64),
    /// Some of its bits.
    Bits { of: i64, set: i64 },
}

impl Want {
    /// The count that a register which held `held` should hold.
    pub(crate) fn applied_to(self, held: i64) -> i64 {
        match self {
            Want::Count(count) => count,
            Want::Bits { of, set } => held & !of | set,
        }
    }
}

/// A register to set before a robot can use the servo.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Target {
    /// Its name.
    pub name: &'static str,
    pub(crate) want: Want,
    /// True if it is set only while the servo is new: later the calibration may change it.
    pub is_for_new: bool,
}

/// A register that should hold `count`.
pub(crate) const fn count(name: &'static str, count: i64) -> Target {
    Target { name, want: Want::Count(count), is_for_new: false }
}

/// The facts that a servo reports about itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Identity {
    /// Its control table.
    pub series: &'static Series,
    /// Content of its model number register.
    pub model_number: u16,
    /// Version of its firmware.
    pub firmware: Firmware,
    /// True if its speed registers count single steps per second, and not 50 (Feetech STS, a bit of `phase`).
    pub is_speed_fine: bool,
}

impl Identity {
    /// Names of the models with this number, such as `STS3215-7V4 or STS3215-12V`; `None` if it is unknown.
    pub fn model_names(&self) -> Option<String> {
        let spec = self.series.protocol.spec();
        let known = spec.models.iter().map(|model| (model.model_number, model.name));
        let mut names = Vec::new();
        for (number, name) in known.chain(spec.other_models.iter().copied()) {
            if number == self.model_number && !names.contains(&name) {
                names.push(name);
            }
        }
        (!names.is_empty()).then(|| names.join(" or "))
    }

    /// All its registers, by address. An unknown model is treated as one of its series.
    pub fn registers(&self) -> Vec<RegisterInfo> {
        (self.series.table)(self.model_number)
    }

    /// The register of this name.
    pub fn register(&self, name: &str) -> Option<RegisterInfo> {
        self.registers().into_iter().find(|register| register.name == name)
    }
}

pub(super) const UNSIGNED: Encoding = Encoding::Unsigned;
pub(super) const RPM: &str = "rpm";
pub(super) const DEGREES: &str = "deg";
pub(super) const VOLTS: Scale = Scale::Linear(0.1, "V");
pub(super) const CELSIUS: Scale = Scale::Linear(1.0, "C");
/// Steps of 2 us, both makers.
pub(super) const DELAY: Scale = Scale::Linear(2.0, "us");

/// `address`, `bytes`, encoding.
pub(super) type At = (u16, u8, Encoding);

pub(super) const fn entry(
    (address, bytes, encoding): At,
    name: &'static str,
    access: Access,
    scale: Scale,
    range: (i64, i64),
    note: &'static str,
) -> RegisterInfo {
    let register = Register { address, bytes, encoding };
    RegisterInfo { name: Cow::Borrowed(name), register, access, scale, range, note }
}

pub(super) const fn fixed(at: At, name: &'static str, scale: Scale, note: &'static str) -> RegisterInfo {
    entry(at, name, Access::Fixed, scale, (0, 0), note)
}

pub(super) const fn setting(
    at: At,
    name: &'static str,
    scale: Scale,
    range: (i64, i64),
    note: &'static str,
) -> RegisterInfo {
    entry(at, name, Access::Setting, scale, range, note)
}

pub(super) const fn volatile(
    at: At,
    name: &'static str,
    scale: Scale,
    range: (i64, i64),
    note: &'static str,
) -> RegisterInfo {
    entry(at, name, Access::Volatile, scale, range, note)
}

/// Revolutions per minute in rad/s.
pub(super) const fn rpm(value: f64) -> f64 {
    value * TAU / 60.0
}

/// The register of this name in `table`. It does not compile with a name that the table lacks.
pub(super) const fn named(table: &[RegisterInfo], name: &str) -> Register {
    let mut index = 0;
    while index < table.len() {
        if let Cow::Borrowed(of) = &table[index].name
            && is_same(of.as_bytes(), name.as_bytes())
        {
            return table[index].register;
        }
        index += 1;
    }
    panic!("the table has no register of this name")
}

const fn is_same(a: &[u8], b: &[u8]) -> bool {
    let mut index = 0;
    while index < a.len() && index < b.len() && a[index] == b[index] {
        index += 1;
    }
    index == a.len() && index == b.len()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bus::protocols::PROTOCOLS;

    fn identity(series: &'static Series, model_number: u16) -> Identity {
        Identity { series, model_number, firmware: Firmware { major: 46, minor: None }, is_speed_fine: true }
    }

    /// Every series with the number of every model that has it.
    fn all() -> Vec<Identity> {
        let series = || PROTOCOLS.iter().flat_map(|spec| spec.series.iter().copied());
        let numbers = |of: &'static Series| {
            let spec = of.protocol.spec();
            let known = spec.models.iter().filter(|model| model.registers == of.registers);
            let others = spec.other_models.iter().map(|(number, _)| *number);
            known.map(|model| model.model_number).chain(others).map(move |number| identity(of, number))
        };
        series().flat_map(numbers).collect()
    }

    #[test]
    fn tables_are_in_order_without_overlap_or_duplicate_names() {
        for identity in all() {
            let (table, name) = (identity.registers(), identity.series.name);
            for pair in table.windows(2) {
                let end = pair[0].register.address + u16::from(pair[0].register.bytes);
                assert!(end <= pair[1].register.address, "{name}: {:?}", pair);
            }
            let mut names: Vec<_> = table.iter().map(|register| register.name.clone()).collect();
            names.sort();
            names.dedup();
            assert_eq!(names.len(), table.len(), "{name}");
        }
    }

    #[test]
    fn the_loop_reads_its_feedback_in_one_block() {
        for identity in all() {
            let registers = identity.series.registers;
            let (start, end) =
                (registers.feedback_address, registers.feedback_address + registers.feedback_bytes);
            for of in [
                registers.present_position,
                registers.present_speed,
                registers.present_load,
                registers.present_voltage,
                registers.present_temperature,
            ] {
                let is_inside = of.address >= start && of.address + u16::from(of.bytes) <= end;
                assert!(is_inside, "{}: {of:?}", identity.series.name);
            }
        }
    }

    #[test]
    fn register_names_are_compared_whole() {
        assert!(is_same(b"lock", b"lock"));
        for other in ["loc", "lock_", "luck", ""] {
            assert!(!is_same(b"lock", other.as_bytes()), "{other}");
        }
    }

    #[test]
    fn models_are_named_by_their_numbers() {
        let names = |number: u16| {
            let of = all().into_iter().find(|of| of.model_number == number);
            of.and_then(|of| of.model_names())
        };
        assert_eq!(names(777).unwrap(), "STS3215-7V4 or STS3215-12V");
        assert_eq!(names(1030).unwrap(), "XM430-W210");
        assert_eq!(names(1284).unwrap(), "SCS0009");
        assert_eq!(names(1190).unwrap(), "XL330-M077");
        assert_eq!(identity(all()[0].series, 1).model_names(), None);
    }
}
