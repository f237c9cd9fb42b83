//! `servo backup` and `servo restore`.

use std::path::Path;

use anyhow::{Context, Result};

use super::find::{find, find_or_at};
use super::{ConfirmArguments, ServoArguments};
use crate::cli::confirm::confirm;
use crate::output::{Outputs, WriteMode};
use crate::service::{Backup, ServicePort, backup as kept};

/// Saves every register to `file`.
pub(super) fn backup(which: &ServoArguments, file: &Path) -> Result<()> {
    let mut outputs = Outputs::of_reading([&which.port]);
    outputs.claim("the backup", file, WriteMode::New)?;
    let mut port = ServicePort::open(&which.port)?;
    let mut servo = find(&mut port, which)?;
    let backup = Backup::of(&mut servo)?;
    backup.save(file).with_context(|| format!("{}", file.display()))?;
    say!("{}: {} registers written to {}", servo.address(), backup.registers.len(), file.display());
    Ok(())
}

/// Restores the content of `file`.
pub(super) fn restore(which: &ServoArguments, file: &Path, consent: &ConfirmArguments) -> Result<()> {
    let backup = Backup::load(file)?;
    let mut port = ServicePort::open(&which.port)?;
    let mut servo = find_or_at(&mut port, which, backup.home())?;
    let differences = kept::differences(&mut servo, &backup)?;
    if differences.is_empty() {
        say!("{}: its settings are those of {}", servo.address(), file.display());
        return Ok(());
    }
    for of in &differences {
        say!("  {} from {} to {}", of.register.name, of.held, of.wanted);
    }
    let count = differences.len();
    confirm(
        &format!("{}: {count} settings, as above; the torque is taken off", servo.address()),
        consent.yes,
    )?;
    kept::restore(&mut servo, &backup, &differences)?;
    say!("{}: every setting is that of {}", servo.address(), file.display());
    Ok(())
}
