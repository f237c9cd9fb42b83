//! `servo read` and `servo write`.

use anyhow::Result;

use super::ServoArguments;
use super::find::find;
use crate::cli::confirm::confirm;
use crate::service::{Access, RegisterInfo, ServiceError, ServicePort, Value};

/// Registers that make the shaft move or hold.
const MOVING: [&str; 5] = ["torque_enable", "goal_position", "goal_velocity", "goal_current", "goal_pwm"];

/// Prints the value of one register, or of all.
pub(super) fn read(which: &ServoArguments, register: Option<&str>) -> Result<()> {
    let mut port = ServicePort::open(&which.port)?;
    let mut servo = find(&mut port, which)?;
    match register {
        Some(name) => {
            let value = servo.read(name)?;
            say!("{value}{}", in_counts(&value));
        }
        None => {
            let identity = servo.identity();
            let model = identity.model_names().unwrap_or_else(|| "unknown model".to_owned());
            say!("{}: {model} ({}), firmware {}", servo.address(), identity.model_number, identity.firmware);
            for (register, value) in servo.read_all()? {
                print(&register, &value);
            }
        }
    }
    Ok(())
}

fn print(register: &RegisterInfo, value: &Value) {
    let kind = match register.access {
        Access::Fixed => "",
        Access::Setting => "setting",
        Access::Volatile => "volatile",
    };
    let text = format!("{value}{}", in_counts(value));
    say!("{:>4}  {:<26} {text:<26} {kind:<9} {}", register.register.address, register.name, register.note);
}

fn in_counts(value: &Value) -> String {
    if value.unit.is_empty() { String::new() } else { format!(" ({})", value.raw) }
}

/// Writes one register, and prints its new value.
pub(super) fn write(which: &ServoArguments, name: &str, value: f64, raw: bool, yes: bool) -> Result<()> {
    let mut port = ServicePort::open(&which.port)?;
    let mut servo = find(&mut port, which)?;
    let (identity, register) = (servo.identity(), servo.register(name)?);
    if register.access == Access::Fixed {
        return Err(ServiceError::Fixed { address: servo.address(), register: name.to_owned() }.into());
    }
    let raw = match raw {
        true => identity.raw_count(&register, value)?,
        false => identity.count(&register, value)?,
    };
    let (held, wanted) = (servo.read(name)?, identity.value(&register, raw));
    let warning = match register.access {
        _ if MOVING.contains(&name) && raw != 0 => {
            "; this can move the shaft at once: keep hands and wires clear"
        }
        Access::Setting => "; the torque is taken off for it",
        _ => "",
    };
    confirm(&format!("{}: {name} from {held} to {wanted}{warning}", servo.address()), yes)?;
    servo.write_raw(&register, raw)?;
    say!("{}: {name} is {}", servo.address(), servo.read(name)?);
    Ok(())
}
