//! `hippocamp servo`: reads, writes, centres, resets or backs up one servo, or changes its id or rate.

mod backup;
mod change;
mod find;
mod registers;

use std::path::PathBuf;

use anyhow::Result;

use super::interrupt;
use super::scan::protocol_parser;
use crate::model::Protocol;

/// A command for one servo.
#[derive(Debug, clap::Subcommand)]
pub(super) enum ServoCommand {
    /// Reads a register by name, or all of them.
    #[command(after_help = "Examples:\n  hippocamp servo read /dev/ttyUSB0 1\n  \
                            hippocamp servo read /dev/ttyUSB0 1 present_position")]
    Read {
        #[command(flatten)]
        which: ServoArguments,
        /// Its name; leave it out to read all registers.
        register: Option<String>,
    },
    /// Writes a register by name, in the unit 'servo read' shows.
    ///
    /// A setting that outlasts the power is written with the torque off. A goal or 'torque_enable 1' moves or holds
    /// the servo at once, past all of the controller's safety: keep hands and wires clear.
    #[command(after_help = "Example: hippocamp servo write /dev/ttyUSB0 1 return_delay_time 0")]
    Write {
        #[command(flatten)]
        which: ServoArguments,
        /// The register's name.
        register: String,
        /// The value, in the register's unit.
        #[arg(allow_negative_numbers = true)]
        value: f64,
        /// The value is the count in the register.
        #[arg(long)]
        raw: bool,
        #[command(flatten)]
        consent: ConfirmArguments,
    },
    /// Saves every register of the servo to a file.
    #[command(after_help = "Example: hippocamp servo backup /dev/ttyUSB0 1 left_hip.toml")]
    Backup {
        #[command(flatten)]
        which: ServoArguments,
        /// The file (TOML); must not exist yet.
        file: PathBuf,
    },
    /// Restores the settings in a file of 'servo backup', byte for byte, id and rate included.
    #[command(after_help = "Example: hippocamp servo restore /dev/ttyUSB0 1 left_hip.toml")]
    Restore {
        #[command(flatten)]
        which: ServoArguments,
        /// The file.
        file: PathBuf,
        #[command(flatten)]
        consent: ConfirmArguments,
    },
    /// Gives the servo another id, if that is free.
    #[command(after_help = "Example: hippocamp servo id /dev/ttyUSB0 1 7")]
    Id {
        #[command(flatten)]
        which: ServoArguments,
        /// The new id.
        #[arg(value_parser = clap::value_parser!(u8).range(0..=i64::from(Protocol::ID_MAX)))]
        new_id: u8,
        #[command(flatten)]
        consent: ConfirmArguments,
    },
    /// Sets the servo to another rate.
    #[command(name = "baud", after_help = "Example: hippocamp servo baud /dev/ttyUSB0 1 1000000")]
    Baud {
        #[command(flatten)]
        which: ServoArguments,
        /// The new rate, bit/s.
        new_baud: u32,
        #[command(flatten)]
        consent: ConfirmArguments,
    },
    /// Makes the shaft's present position the middle of the servo's counts.
    Center {
        #[command(flatten)]
        which: ServoArguments,
        #[command(flatten)]
        consent: ConfirmArguments,
    },
    /// Restarts the servo, as after power-on: this clears an overload, for example.
    Reboot {
        #[command(flatten)]
        which: ServoArguments,
        #[command(flatten)]
        consent: ConfirmArguments,
    },
    /// Resets every setting to the factory value, except id and rate.
    Reset {
        #[command(flatten)]
        which: ServoArguments,
        #[command(flatten)]
        consent: ConfirmArguments,
    },
}

/// Options that identify a servo.
#[derive(Debug, clap::Args)]
pub(super) struct ServoArguments {
    /// The serial device, such as /dev/ttyUSB0 or a path in /dev/serial/by-id.
    port: PathBuf,
    /// The servo's id.
    #[arg(value_parser = clap::value_parser!(u8).range(0..=i64::from(Protocol::ID_MAX)))]
    id: u8,
    /// Its rate, bit/s [default: found].
    #[arg(long)]
    baud: Option<u32>,
    /// Its protocol [default: found].
    #[arg(long, value_parser = protocol_parser())]
    protocol: Option<Protocol>,
}

/// The option to write without asking.
#[derive(Debug, clap::Args)]
pub(super) struct ConfirmArguments {
    /// Write without asking.
    #[arg(long)]
    yes: bool,
}

/// Carries out `command`.
pub(super) fn servo(command: &ServoCommand) -> Result<()> {
    // On Ctrl-C a write under way is finished.
    interrupt::catch()?;
    match command {
        ServoCommand::Read { which, register } => registers::read(which, register.as_deref()),
        ServoCommand::Write { which, register, value, raw, consent } => {
            registers::write(which, register, *value, *raw, consent.yes)
        }
        ServoCommand::Backup { which, file } => backup::backup(which, file),
        ServoCommand::Restore { which, file, consent } => backup::restore(which, file, consent),
        ServoCommand::Id { which, new_id, consent } => change::id(which, *new_id, consent),
        ServoCommand::Baud { which, new_baud, consent } => change::baud(which, *new_baud, consent),
        ServoCommand::Center { which, consent } => change::center(which, consent),
        ServoCommand::Reboot { which, consent } => change::reboot(which, consent),
        ServoCommand::Reset { which, consent } => change::reset(which, consent),
    }
}
