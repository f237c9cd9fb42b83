//! `servo id`, `baud`, `center`, `reboot` and `reset`.

use anyhow::Result;

use super::find::find;
use super::{ConfirmArguments, ServoArguments};
use crate::cli::confirm::confirm;
use crate::service::{ServicePort, Servo, centre};

/// Gives the servo another id.
pub(super) fn id(which: &ServoArguments, id: u8, consent: &ConfirmArguments) -> Result<()> {
    change(which, "id", f64::from(id), consent)
}

/// Sets the servo to another rate.
pub(super) fn baud(which: &ServoArguments, baud: u32, consent: &ConfirmArguments) -> Result<()> {
    change(which, "baud_rate", f64::from(baud), consent)
}

fn change(which: &ServoArguments, name: &str, value: f64, consent: &ConfirmArguments) -> Result<()> {
    let mut port = ServicePort::open(&which.port)?;
    let mut servo = find(&mut port, which)?;
    // Checked before the user is asked.
    let raw = servo.identity().count(&servo.register(name)?, value)?;
    let (held, wanted) = (servo.read(name)?, servo.identity().value(&servo.register(name)?, raw));
    confirm(
        &format!("{}: {name} from {held} to {wanted}; the torque is taken off for it", servo.address()),
        consent.yes,
    )?;
    servo.write(name, value)?;
    say!("it is {} now", servo.address());
    Ok(())
}

/// Makes the shaft's present position the middle of the servo's counts.
pub(super) fn center(which: &ServoArguments, consent: &ConfirmArguments) -> Result<()> {
    let mut port = ServicePort::open(&which.port)?;
    let mut servo = find(&mut port, which)?;
    let plan = centre::plan(&mut servo)?;
    confirm(
        &format!(
            "{}: homing_offset from {} to {}, so that the shaft stands at the middle count instead of {}; the torque is \
             taken off for it",
            servo.address(),
            plan.held,
            plan.wanted,
            plan.present
        ),
        consent.yes,
    )?;
    let now = centre::carry_out(&mut servo, &plan)?;
    say!("{}: present_position is {now} ({})", servo.address(), now.raw);
    Ok(())
}

/// Restarts the servo.
pub(super) fn reboot(which: &ServoArguments, consent: &ConfirmArguments) -> Result<()> {
    restart(which, consent, "restart it: torque off, volatile registers as after power-on", |servo| {
        servo.reboot()
    })
}

/// Resets the servo's settings to the factory values.
pub(super) fn reset(which: &ServoArguments, consent: &ConfirmArguments) -> Result<()> {
    let what = "torque off, and every setting except id and rate back to its factory value ('servo backup' keeps \
                them first; a Feetech servo may also go back to its factory rate)";
    restart(which, consent, what, |servo| servo.reset())
}

fn restart(
    which: &ServoArguments,
    consent: &ConfirmArguments,
    what: &str,
    work: impl FnOnce(&mut Servo<'_>) -> Result<(), crate::service::ServiceError>,
) -> Result<()> {
    let mut port = ServicePort::open(&which.port)?;
    let mut servo = find(&mut port, which)?;
    confirm(&format!("{}: {what}", servo.address()), consent.yes)?;
    work(&mut servo)?;
    say!("{} is back, firmware {}", servo.address(), servo.identity().firmware);
    Ok(())
}
