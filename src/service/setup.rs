//! The settings that a new servo needs before a robot can use it, and writing them.
//!
//! These registers are written, and no others (docs/servos.md has them as a table). Limits of temperature, voltage
//! and current, gains and protection that a person has chosen stay as they are.

use super::backup::Backup;
use super::error::{Address, ServiceError};
use super::servo::Servo;
pub use crate::bus::table::Target;
use crate::bus::table::{RegisterInfo, Series, Value, count};
use crate::model::Protocol;
use crate::units::ServoId;

/// All settings of a servo beside id and line rate, in the order of writing. `return_delay_us` is the bus's.
pub fn targets(series: &Series, return_delay_us: u32) -> Vec<Target> {
    let delay = count("return_delay_time", i64::from(return_delay_us / 2));
    std::iter::once(delay).chain(series.setup.iter().copied()).collect()
}

/// The address of a servo out of the box.
pub fn factory_address(protocol: Protocol) -> Address {
    Address { protocol, baud: protocol.spec().factory_rate, id: ServoId(1) }
}

/// A register to change.
#[derive(Debug, Clone, PartialEq)]
pub struct Change {
    /// The register.
    pub register: RegisterInfo,
    /// Its present value.
    pub held: Value,
    /// Its new value.
    pub wanted: Value,
}

/// The necessary changes to `servo` other than id and rate; `is_new` is false if it was set up before. Skips
/// registers that its firmware lacks.
///
/// # Errors
/// If no good answer came.
pub fn changes(servo: &mut Servo<'_>, targets: &[Target], is_new: bool) -> Result<Vec<Change>, ServiceError> {
    let identity = servo.identity();
    let held = servo.read_all()?;
    let wanted = targets.iter().filter(|target| is_new || !target.is_for_new);
    let change = |target: &Target| {
        let (register, held) = held.iter().find(|(register, _)| register.name == target.name)?;
        let wanted = identity.value(register, target.want.applied_to(held.raw));
        (wanted.raw != held.raw).then(|| Change { register: register.clone(), held: *held, wanted })
    };
    Ok(wanted.filter_map(change).collect())
}

/// True if writes of `targets`, id and rate alone can have changed a servo from `then` to `now`.
pub fn is_begun(then: &Backup, now: &Backup, targets: &[Target]) -> bool {
    let is_wanted = |name: &str, before: i64, count: i64| {
        targets
            .iter()
            .filter(|target| target.name == name)
            .any(|target| target.want.applied_to(before) == count)
    };
    then.model_number == now.model_number
        && now.settings().all(|(register, bytes)| {
            let name = &*register.name;
            let Some((_, before)) = then.settings().find(|(of, _)| of.name == name) else { return false };
            let count = |bytes: &[u8]| then.count(register, bytes);
            before == bytes
                || ["id", "baud_rate"].contains(&name)
                || is_wanted(name, count(before), count(bytes))
        })
}

/// Writes `changes`, then the servo's id, then its rate; reads everything back. If this breaks off anywhere, the
/// servo answers at its old address, or under its new id at its old rate, or at its new address.
///
/// # Errors
/// If the servo does not accept something.
pub(crate) fn carry_out(
    servo: &mut Servo<'_>,
    targets: &[Target],
    changes: &[Change],
    home: Address,
) -> Result<(), ServiceError> {
    servo.change_settings(|servo| {
        for change in changes {
            servo.put_setting(&change.register, change.wanted.raw)?;
        }
        if servo.address().id != home.id {
            let register = servo.register("id")?;
            servo.put_setting(&register, i64::from(home.id.0))?;
        }
        if servo.address().baud != home.baud {
            let register = servo.register("baud_rate")?;
            let code = servo.identity().count(&register, f64::from(home.baud))?;
            servo.put_setting(&register, code)?;
        }
        Ok(())
    })?;
    match self::changes(servo, targets, false)?.first() {
        None => Ok(()),
        Some(left) => {
            Err(ServiceError::NotKept { address: servo.address(), register: left.register.name.to_string() })
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bus::protocols::PROTOCOLS;
    use crate::bus::table::{Access, Identity, Want};
    use crate::model::Firmware;

    #[test]
    fn every_target_is_a_setting_that_accepts_its_value() {
        for series in PROTOCOLS.iter().flat_map(|spec| spec.series.iter().copied()) {
            let firmware = Firmware { major: 46, minor: None };
            let identity = Identity { series, model_number: 0, firmware, is_speed_fine: true };
            let name = series.name;
            for target in targets(series, 508) {
                let register = identity.register(target.name);
                let register = register.unwrap_or_else(|| panic!("{name}: {}", target.name));
                assert_eq!(register.access, Access::Setting, "{name}: {}", target.name);
                let (low, high) = register.range;
                let count = match target.want {
                    Want::Count(count) => count,
                    Want::Bits { of, set } => {
                        assert_eq!(set & !of, 0);
                        set
                    }
                };
                assert!((low..=high).contains(&count), "{name}: {}", target.name);
            }
            assert!(identity.register(series.torque_ceiling).is_some(), "{name}");
            assert_eq!(identity.register("homing_offset").is_some(), series.offset.is_some(), "{name}");
        }
    }
}
