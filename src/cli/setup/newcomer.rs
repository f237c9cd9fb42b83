//! Finds the one new servo on a line: looks first at the factory address, and from time to time everywhere.

use std::collections::BTreeSet;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use anyhow::Result;

use super::backups::Backups;
use super::bench::SetupBus;
use crate::model::Protocol;
use crate::service::setup::factory_address;
use crate::service::{Address, ServiceError, scan_bauds};
use crate::units::ServoId;

/// One look in this many covers all rates and ids.
const WHOLE_LOOK_EVERY: u32 = 40;
const BETWEEN_LOOKS: Duration = Duration::from_millis(50);

/// Looks for a new servo repeatedly.
#[derive(Debug)]
pub(super) struct NewServoSearch {
    looks: u32,
    /// The number of the first look that covers everything.
    first_whole_look: u32,
    /// Messages already printed, so that none is repeated.
    said: BTreeSet<String>,
}

impl NewServoSearch {
    /// Looks everywhere soon if a person says that the servo `is_there`; otherwise gives the person time to plug it
    /// in, since a look everywhere takes a quarter of a minute.
    pub(super) fn new(is_there: bool) -> NewServoSearch {
        let first_whole_look = if is_there { 2 } else { WHOLE_LOOK_EVERY };
        NewServoSearch { looks: 0, first_whole_look, said: BTreeSet::new() }
    }

    /// True if it has tried all rates and ids.
    pub(super) fn has_looked_everywhere(&self) -> bool {
        self.looks > self.first_whole_look
    }

    /// The address of the new servo, if there is exactly one and it is of the joint's model; otherwise prints the
    /// obstacle.
    pub(super) fn look(
        &mut self,
        bench: &mut SetupBus,
        index: usize,
        backups: &Backups,
        stop: &AtomicBool,
    ) -> Result<Option<Address>> {
        let protocol = bench.jobs[index].home.protocol;
        let factory = factory_address(protocol);
        self.looks += 1;
        let is_whole = self.looks % WHOLE_LOOK_EVERY == self.first_whole_look % WHOLE_LOOK_EVERY;
        let found = match bench.is_taken(factory, backups) {
            true => Vec::new(),
            false => self.look_at(bench, factory)?,
        };
        let found = match found.is_empty() && is_whole {
            true => self.look_everywhere(bench, index, backups, stop)?,
            false => found,
        };
        match found[..] {
            [] => bench.port.pause(BETWEEN_LOOKS),
            [at] => return self.judge(bench, index, at),
            _ => {
                let several: Vec<String> = found.iter().map(Address::to_string).collect();
                self.say(format!("several new servos answer: {}; leave one plugged in", several.join(", ")));
            }
        }
        Ok(None)
    }

    fn look_at(&mut self, bench: &mut SetupBus, address: Address) -> Result<Vec<Address>> {
        match bench.port.servo(address) {
            Ok(_) => Ok(vec![address]),
            Err(ServiceError::NoAnswer { .. }) => Ok(Vec::new()),
            Err(error @ ServiceError::Damaged { .. }) => {
                self.say(error.to_string());
                Ok(Vec::new())
            }
            Err(error) => Err(error.into()),
        }
    }

    fn look_everywhere(
        &mut self,
        bench: &mut SetupBus,
        index: usize,
        backups: &Backups,
        stop: &AtomicBool,
    ) -> Result<Vec<Address>> {
        let protocol = bench.jobs[index].home.protocol;
        let ids: Vec<ServoId> = (0..=Protocol::ID_MAX).map(ServoId).collect();
        let mut found = Vec::new();
        for baud in scan_bauds(protocol) {
            let pass = match bench.port.scan(protocol, *baud, &ids, stop) {
                Err(ServiceError::Baud { .. }) => continue,
                result => result?,
            };
            for address in pass.found.iter().map(|found| found.address) {
                if !bench.is_taken(address, backups) {
                    found.push(address);
                } else if let Some(owner) = bench.jobs.iter().find(|job| job.home == address && !job.is_done)
                {
                    let (port, joint) = (bench.port.path().display(), &bench.jobs[index].joint);
                    self.say(format!(
                        "{address} answers where the servo of {} belongs; if it is the new one of {joint}, give it \
                         an unused id first: hippocamp servo id {port} {} 200",
                        owner.joint, address.id
                    ));
                }
            }
            for id in pass.damaged {
                let at = Address { protocol, baud: *baud, id };
                let owner = bench.jobs.iter().find(|job| job.home == at);
                let whose = owner.map_or_else(String::new, |job| {
                    format!(
                        " (one of them is that of {}: unplug it until the new one has its own id)",
                        job.joint
                    )
                });
                self.say(format!(
                    "only damaged answers from {at}: two servos have this id, leave one{whose}"
                ));
            }
            if pass.is_interrupted {
                break;
            }
        }
        Ok(found)
    }

    /// The address `at`, if the servo there can be the joint's.
    fn judge(&mut self, bench: &mut SetupBus, index: usize, at: Address) -> Result<Option<Address>> {
        let model = bench.jobs[index].model;
        let joint = bench.jobs[index].joint.clone();
        let identity = match bench.port.servo(at) {
            Ok(servo) => servo.identity(),
            Err(ServiceError::NoAnswer { .. } | ServiceError::Damaged { .. }) => return Ok(None),
            Err(error) => return Err(error.into()),
        };
        if identity.model_number != model.model_number {
            let name = identity.model_names().unwrap_or_else(|| "an unknown model".to_owned());
            self.say(format!(
                "{at} is {name} ({}), and {joint} has a {}: plug that in instead",
                identity.model_number, model.name
            ));
            bench.port.pause(BETWEEN_LOOKS);
            return Ok(None);
        }
        // Two servos that reply with the same bytes look like one; but their measurements differ.
        match bench.port.known_servo(at, identity).read_all() {
            Ok(_) => Ok(Some(at)),
            Err(error @ (ServiceError::NoAnswer { .. } | ServiceError::Damaged { .. })) => {
                self.say(error.to_string());
                Ok(None)
            }
            Err(error) => Err(error.into()),
        }
    }

    fn say(&mut self, text: String) {
        if self.said.insert(text.clone()) {
            say!("{text}");
        }
    }
}
