//! One bus, the servos it should have, and how far the set-up of each is.

use anyhow::Result;

use super::backups::Backups;
use crate::cli::Several;
use crate::cli::ports::PortOption;
use crate::model::{Robot, ServoModel};
use crate::service::setup::{changes, factory_address, targets};
use crate::service::{Address, ServiceError, ServicePort, scan_bauds};

/// A servo to set up.
pub(super) struct Job {
    /// Full name of the joint it turns.
    pub(super) joint: String,
    pub(super) model: &'static ServoModel,
    /// Its final address.
    pub(super) home: Address,
    /// True if this run has seen it done.
    pub(super) is_done: bool,
}

/// How far the set-up of a joint's servo is.
pub(super) enum SetupProgress {
    /// It answers at its address and all settings are right.
    Done,
    /// It answers here, and settings are left to write.
    Unfinished(Address),
    /// It is missing, or still new.
    Missing,
}

/// A bus and its line.
pub(super) struct SetupBus {
    pub(super) name: String,
    pub(super) port: ServicePort,
    pub(super) return_delay_us: u32,
    pub(super) jobs: Vec<Job>,
}

/// Opens the line of every bus, or lists all that cannot be opened.
pub(super) fn open(robot: &Robot, devices: &[PortOption]) -> Result<Vec<SetupBus>> {
    let mut benches = Vec::new();
    let mut faults = Vec::new();
    for (index, (bus, device)) in robot.buses.iter().zip(devices).enumerate() {
        let servos = robot.joints.iter().filter_map(|joint| Some((joint, joint.servo?)));
        let jobs = servos.filter(|(_, servo)| servo.bus == index).map(|(joint, servo)| Job {
            joint: joint.name.clone(),
            model: servo.model,
            home: Address { protocol: bus.protocol, baud: bus.baud, id: servo.id },
            is_done: false,
        });
        let (name, return_delay_us) = (bus.name.clone(), bus.return_delay_us);
        match ServicePort::open(device.path()) {
            Ok(port) => benches.push(SetupBus { name, port, return_delay_us, jobs: jobs.collect() }),
            Err(error) => faults.push(format!("bus {name}: {error}")),
        }
    }
    if faults.is_empty() { Ok(benches) } else { Err(Several { lines: faults, is_input: false }.into()) }
}

impl SetupBus {
    /// The jobs in the file's order, except that the servo whose final address is the factory address comes last:
    /// it would clash with every other new one.
    pub(super) fn order(&self) -> Vec<usize> {
        let mut order: Vec<usize> = (0..self.jobs.len()).collect();
        order.sort_by_key(|index| self.is_like_new(&self.jobs[*index]));
        order
    }

    fn is_like_new(&self, job: &Job) -> bool {
        job.home == factory_address(job.home.protocol)
    }

    /// True if the servo at `address` is one of the robot's own, and not a new one.
    pub(super) fn is_taken(&self, address: Address, backups: &Backups) -> bool {
        let owner = self.jobs.iter().find(|job| job.home == address);
        owner.is_some_and(|job| !self.is_like_new(job) || backups.has(&job.joint))
    }

    /// How far the servo of a job is. A servo at the factory address, or with the joint's id at another rate, is
    /// the joint's only if its set-up was begun.
    pub(super) fn standing(&mut self, index: usize, backups: &Backups) -> Result<SetupProgress> {
        let Job { joint, model, home, .. } = &self.jobs[index];
        let (home, number) = (*home, model.model_number);
        let was_begun = backups.has(joint);
        if was_begun || !self.is_like_new(&self.jobs[index]) {
            match self.port.servo(home) {
                Ok(servo) if servo.identity().model_number != number => {
                    let (address, found) = (servo.address(), servo.identity().model_number);
                    return Err(ServiceError::OtherModel { address, found, expected: number }.into());
                }
                Ok(mut servo) => {
                    let targets = targets(servo.identity().series, self.return_delay_us);
                    let is_done = changes(&mut servo, &targets, false)?.is_empty() && servo.is_locked()?;
                    return Ok(if is_done { SetupProgress::Done } else { SetupProgress::Unfinished(home) });
                }
                Err(ServiceError::NoAnswer { .. }) => {}
                Err(error) => return Err(error.into()),
            }
        }
        if was_begun {
            for baud in scan_bauds(home.protocol) {
                let at = Address { baud: *baud, ..home };
                if at == home || at == factory_address(home.protocol) {
                    continue;
                }
                match self.port.servo_at_once(at) {
                    Ok(servo) if servo.identity().model_number == number => {
                        return Ok(SetupProgress::Unfinished(at));
                    }
                    Ok(_) | Err(ServiceError::NoAnswer { .. } | ServiceError::Damaged { .. }) => {}
                    Err(ServiceError::Baud { .. }) => {}
                    Err(error) => return Err(error.into()),
                }
            }
        }
        Ok(SetupProgress::Missing)
    }

    /// True if every servo answers at its address with all settings right; prints which do not.
    pub(super) fn check_all(&mut self, backups: &Backups) -> Result<bool> {
        let mut is_all_there = true;
        for index in 0..self.jobs.len() {
            if !matches!(self.standing(index, backups)?, SetupProgress::Done) {
                is_all_there = false;
                let Job { joint, home, .. } = &self.jobs[index];
                say!("{joint}: {home} does not answer now: leave servos that are set up plugged in");
            }
        }
        Ok(is_all_there)
    }
}
