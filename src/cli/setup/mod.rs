//! `hippocamp setup`: turns a box of new servos into a robot whose servos have the addresses in its file.
//!
//! In: a robot file, devices, a person who plugs in one servo after the other. Out: servos with ids, rates and
//! modes; a backup of each as delivered; the unit file with the devices.
//!
//! The addresses of the servos, and the backups, show what is done; so the user can break off anywhere and run it
//! again.

mod backups;
mod bench;
mod newcomer;
mod unit;

use std::io::IsTerminal;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};

use anyhow::{Context, Result, bail};

use self::backups::Backups;
use self::bench::{Job, SetupBus, SetupProgress};
use self::unit::UnitNotes;
use super::confirm::confirm;
use super::load::load_file;
use super::ports::{self, PortOption};
use super::{BadInput, interrupt};
use crate::service::setup::{carry_out, changes, targets};
use crate::service::{Address, ServiceError};

/// Options of `setup`.
#[derive(Debug, clap::Args)]
pub(super) struct SetupArguments {
    /// The robot file.
    pub(super) robot: PathBuf,
    /// The unit file of this robot [default: the robot file's name with .unit.toml for .toml]; created if it does not
    /// exist.
    #[arg(long, value_name = "FILE")]
    pub(super) unit: Option<PathBuf>,
    /// Serial device of a bus, instead of the unit file's; written to the unit file.
    #[arg(long = "port", value_name = "BUS=PATH")]
    ports: Vec<PortOption>,
    /// Do not ask: wait for each servo to appear, and set it up.
    #[arg(long)]
    yes: bool,
}

/// Sets up all servos of the robot.
pub(super) fn setup(options: &SetupArguments) -> Result<()> {
    if !options.yes && !std::io::stdin().is_terminal() {
        return Err(BadInput(
            "standard input is not a terminal, so nobody can be asked: --yes sets up every servo that appears"
                .to_owned(),
        )
        .into());
    }
    let robot = load_file(&options.robot, None)?.robot;
    if robot.buses.is_empty() {
        return Err(BadInput(format!("{} has no servos: it exists on paper only", robot.name)).into());
    }
    let mut notes = UnitNotes::open(&options.robot, options.unit.as_deref())?;
    let devices = ports::devices_for_tools(&robot, notes.file(), &options.ports)?;
    let stop = interrupt::catch()?;
    let backups = Backups::beside(notes.path());
    let mut benches = bench::open(&robot, &devices)?;
    notes.set_devices(&devices)?;

    let mut is_all_there = true;
    for bench in &mut benches {
        let bus = bench.name.clone();
        say!("bus {bus} on {}: {} servos", bench.port.path().display(), bench.jobs.len());
        for index in bench.order() {
            ServoSetup { bench, index, backups: &backups, notes: &mut notes, yes: options.yes, stop }
                .finish()?;
        }
        is_all_there &= bench.check_all(&backups)?;
    }
    if !is_all_there {
        bail!("not all servos answer as they should: see above; plug all of them in and run this again");
    }
    say!(
        "all servos are set up; unit file {}; next: hippocamp calibrate {}",
        notes.path().display(),
        options.robot.display()
    );
    Ok(())
}

/// The set-up of one servo.
struct ServoSetup<'a> {
    bench: &'a mut SetupBus,
    index: usize,
    backups: &'a Backups,
    notes: &'a mut UnitNotes,
    yes: bool,
    stop: &'a AtomicBool,
}

impl ServoSetup<'_> {
    fn job(&self) -> &Job {
        &self.bench.jobs[self.index]
    }

    /// Continues with the joint's servo, however far it is, until it is done.
    fn finish(&mut self) -> Result<()> {
        let mut has_asked = false;
        loop {
            self.mind_the_user()?;
            let (at, is_new) = match self.standing()? {
                SetupProgress::Done => {
                    say!("{}: {} is set up", self.job().joint, self.job().home);
                    self.bench.jobs[self.index].is_done = true;
                    return Ok(());
                }
                SetupProgress::Unfinished(at) => {
                    say!("{}: {at} was begun before; continuing", self.job().joint);
                    (at, false)
                }
                SetupProgress::Missing => {
                    self.ask_for_servo(&mut has_asked)?;
                    (self.await_newcomer()?, true)
                }
            };
            match self.set_up(at, is_new) {
                Ok(()) => {
                    self.bench.jobs[self.index].is_done = true;
                    say!("{}: {}, set up and read back", self.job().joint, self.job().home);
                    return Ok(());
                }
                Err(error) => match error.downcast_ref::<ServiceError>() {
                    Some(ServiceError::NoAnswer { .. } | ServiceError::Damaged { .. }) => {
                        say!("{}: {error}; setup continues once it is back", self.job().joint);
                    }
                    _ => return Err(error.context(self.job().joint.clone())),
                },
            }
        }
    }

    fn standing(&mut self) -> Result<SetupProgress> {
        let standing = self.bench.standing(self.index, self.backups);
        standing.with_context(|| self.job().joint.clone())
    }

    fn ask_for_servo(&self, has_asked: &mut bool) -> Result<()> {
        let Job { joint, model, home, .. } = self.job();
        let sentence = format!(
            "{joint}: plug in its new {} (to be servo {} on bus {}), and no other new one",
            model.name, home.id, self.bench.name
        );
        if self.yes {
            // Asked once; then the program waits for the servo.
            if !std::mem::replace(has_asked, true) {
                say!("{sentence}");
            }
            return Ok(());
        }
        say!("{sentence}; then press Enter (q to end)");
        let mut line = String::new();
        let read = interrupt::while_asking(|| std::io::stdin().read_line(&mut line))
            .context("no answer can be read")?;
        if read == 0 || line.trim() == "q" {
            bail!("ended; run the same command again to continue");
        }
        Ok(())
    }

    fn await_newcomer(&mut self) -> Result<Address> {
        let mut seeker = newcomer::NewServoSearch::new(!self.yes);
        loop {
            if let Some(at) = seeker.look(self.bench, self.index, self.backups, self.stop)? {
                return Ok(at);
            }
            self.mind_the_user()?;
            if !self.yes && seeker.has_looked_everywhere() {
                say!("no new servo was found on {}", self.bench.port.path().display());
                self.ask_for_servo(&mut false)?;
            }
        }
    }

    fn mind_the_user(&self) -> Result<()> {
        match self.stop.load(Ordering::Relaxed) {
            true => bail!("interrupted; run the same command again to continue"),
            false => Ok(()),
        }
    }

    /// Backs up the servo at `at`, prints the changes, and writes them.
    fn set_up(&mut self, at: Address, is_new: bool) -> Result<()> {
        let Job { joint, home, .. } = self.job();
        let (joint, home) = (joint.clone(), *home);
        let mut servo = self.bench.port.servo(at)?;
        let targets = targets(servo.identity().series, self.bench.return_delay_us);
        let changes = changes(&mut servo, &targets, is_new)?;
        say!("{joint}: {at} will change:");
        for change in &changes {
            say!("  {} from {} to {}", change.register.name, change.held, change.wanted);
        }
        if at.id != home.id {
            say!("  id from {} to {}", at.id, home.id);
        }
        if at.baud != home.baud {
            say!("  baud_rate from {} to {} baud", at.baud, home.baud);
        }
        say!("  the torque is taken off for it");
        if !self.yes {
            confirm("write this", false)?;
        }
        if is_new {
            self.notes.forget_calibration(&joint)?;
        }
        // The backup marks a servo as begun: so it is saved only when everything else that a new servo needs is
        // done.
        let kept = self.backups.keep(&joint, &mut servo, &targets)?;
        say!("  as it was before: {}", kept.display());
        carry_out(&mut servo, &targets, &changes, home)?;
        Ok(())
    }
}
