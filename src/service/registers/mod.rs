//! Control tables by name: the meaning of each register, in the units people use.
//!
//! Names are those of the ROBOTIS manual, in lower case; a Feetech register with the same function has the same
//! name, so that one script serves both. Data and their sources are in `dynamixel_x` and `feetech`.

mod dynamixel_x;
mod feetech;
mod value;

use std::borrow::Cow;

use crate::model::servo_model::{Encoding, Register};
use crate::model::{Firmware, Protocol};
pub use value::{BadValue, Value, baud_code, baud_of_code};
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
    /// Its address and encoding. The byte order is the family's ([`Family::is_big_endian`]).
    pub register: Register,
    /// Which side may change it.
    pub access: Access,
    /// The meaning of one count.
    pub scale: Scale,
    /// Lowest and highest count that may be written, over all models of the family.
    pub range: (i64, i64),
    /// The meaning of its values, if that is not plain; may be empty.
    pub note: &'static str,
}

/// Servos with the same control table apart from details.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Family {
    /// Dynamixel X series.
    DynamixelX,
    /// Feetech STS and SMS.
    FeetechSts,
    /// Feetech SCS: 10 bit, words with the high byte first.
    FeetechScs,
}

impl Family {
    /// True if words have the high byte first.
    pub fn is_big_endian(self) -> bool {
        self == Family::FeetechScs
    }

    /// Counts of the position register in a full turn, whether or not the servo can turn that far.
    pub fn counts_per_turn(self) -> f64 {
        match self {
            Family::DynamixelX | Family::FeetechSts => 4096.0,
            // SCS0009: 300 degrees are 1024 counts.
            Family::FeetechScs => 1024.0 * 360.0 / 300.0,
        }
    }

    /// Its protocol.
    pub fn protocol(self) -> Protocol {
        match self {
            Family::DynamixelX => Protocol::Dynamixel,
            Family::FeetechSts | Family::FeetechScs => Protocol::Feetech,
        }
    }
}

/// What a servo reports about itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Identity {
    /// Its control table.
    pub family: Family,
    /// Content of its model number register.
    pub model_number: u16,
    /// Version of its firmware.
    pub firmware: Firmware,
    /// True if its speed registers count single steps per second, and not 50 (Feetech STS, a bit of `phase`).
    pub is_speed_fine: bool,
}

/// Known model numbers, beside those a robot file may name ([`crate::model::servo_model::SERVO_MODELS`]). Sources:
/// ROBOTIS e-manual; the tables of the libraries lerobot and rustypot.
const OTHER_MODELS: [(Protocol, u16, &str); 4] = [
    (Protocol::Dynamixel, 1190, "XL330-M077"),
    (Protocol::Dynamixel, 1090, "2XL430-W250"),
    (Protocol::Feetech, 521, "STS3036"),
    (Protocol::Feetech, 11272, "SM8512BL"),
];

impl Identity {
    /// Names of the models with this number, such as `STS3215-7V4 or STS3215-12V`; `None` if it is unknown.
    pub fn model_names(&self) -> Option<String> {
        let protocol = self.family.protocol();
        let known = crate::model::servo_model::SERVO_MODELS.iter();
        let known = known.map(|model| (model.protocol, model.model_number, model.name));
        let mut names = Vec::new();
        for (of, number, name) in known.chain(OTHER_MODELS) {
            if (of, number) == (protocol, self.model_number) && !names.contains(&name) {
                names.push(name);
            }
        }
        (!names.is_empty()).then(|| names.join(" or "))
    }

    /// All its registers, by address. An unknown model is treated as one of its family's.
    pub fn registers(&self) -> Vec<RegisterInfo> {
        match self.family {
            Family::DynamixelX => dynamixel_x::table(self.model_number),
            Family::FeetechSts => feetech::STS.to_vec(),
            Family::FeetechScs => feetech::SCS.to_vec(),
        }
    }

    /// The register of this name.
    pub fn register(&self, name: &str) -> Option<RegisterInfo> {
        self.registers().into_iter().find(|register| register.name == name)
    }

    /// One count of a current register, A; `None` if the model does not measure current.
    fn current_unit_a(&self) -> Option<f64> {
        match (self.family, self.model_number) {
            // XL330-M288 and -M077; XL430s measure load instead; XM430s and all unknown models.
            (Family::DynamixelX, 1200 | 1190) => Some(0.001),
            (Family::DynamixelX, 1060 | 1090) => None,
            (Family::DynamixelX, _) => Some(0.002_69),
            (Family::FeetechSts, _) => Some(0.0065),
            (Family::FeetechScs, _) => None,
        }
    }
}

const UNSIGNED: Encoding = Encoding::Unsigned;
const RPM: &str = "rpm";
const DEGREES: &str = "deg";
const VOLTS: Scale = Scale::Linear(0.1, "V");
const CELSIUS: Scale = Scale::Linear(1.0, "C");
/// Steps of 2 us, both makers.
const DELAY: Scale = Scale::Linear(2.0, "us");

/// `address`, `bytes`, encoding.
type At = (u16, u8, Encoding);

const fn entry(
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

const fn fixed(at: At, name: &'static str, scale: Scale, note: &'static str) -> RegisterInfo {
    entry(at, name, Access::Fixed, scale, (0, 0), note)
}

const fn setting(
    at: At,
    name: &'static str,
    scale: Scale,
    range: (i64, i64),
    note: &'static str,
) -> RegisterInfo {
    entry(at, name, Access::Setting, scale, range, note)
}

const fn volatile(
    at: At,
    name: &'static str,
    scale: Scale,
    range: (i64, i64),
    note: &'static str,
) -> RegisterInfo {
    entry(at, name, Access::Volatile, scale, range, note)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::servo_model::{DYNAMIXEL_X, FEETECH_STS};

    fn identity(family: Family, model_number: u16) -> Identity {
        Identity { family, model_number, firmware: Firmware { major: 46, minor: None }, is_speed_fine: true }
    }

    #[test]
    fn tables_are_in_order_without_overlap_or_twin_names() {
        for (family, number) in [
            (Family::DynamixelX, 1200),
            (Family::DynamixelX, 1060),
            (Family::DynamixelX, 1030),
            (Family::FeetechSts, 777),
            (Family::FeetechScs, 1284),
        ] {
            let table = identity(family, number).registers();
            for pair in table.windows(2) {
                let end = pair[0].register.address + u16::from(pair[0].register.bytes);
                assert!(end <= pair[1].register.address, "{family:?}: {:?}", pair);
            }
            let mut names: Vec<_> = table.iter().map(|register| register.name.clone()).collect();
            names.sort();
            names.dedup();
            assert_eq!(names.len(), table.len(), "{family:?}");
        }
    }

    #[test]
    fn the_loop_and_the_tools_mean_the_same_registers() {
        let x = identity(Family::DynamixelX, 1030);
        let sts = identity(Family::FeetechSts, 777);
        for (identity, registers) in [(x, &DYNAMIXEL_X), (sts, &FEETECH_STS)] {
            for (name, register) in [
                ("model_number", registers.model_number),
                ("torque_enable", registers.torque_enable),
                ("goal_position", registers.goal_position),
                ("present_position", registers.present_position),
                ("present_velocity", registers.present_speed),
                ("present_input_voltage", registers.present_voltage),
                ("present_temperature", registers.present_temperature),
            ] {
                assert_eq!(identity.register(name).unwrap().register, register, "{name}");
            }
        }
    }

    #[test]
    fn models_are_named_by_their_numbers() {
        let names = |family, number| identity(family, number).model_names();
        assert_eq!(names(Family::FeetechSts, 777).unwrap(), "STS3215-7V4 or STS3215-12V");
        assert_eq!(names(Family::DynamixelX, 1030).unwrap(), "XM430-W210");
        assert_eq!(names(Family::FeetechScs, 1284).unwrap(), "SCS0009");
        assert_eq!(names(Family::DynamixelX, 1).as_deref(), None);
    }
}
