//! Which faults are active, and when. In: a script. Out: answers to "is this so now?" for one bus. Never acts
//! itself.

mod kinds;
mod mistakes;
mod pushes;
mod reader;
mod script;
mod targets;
#[cfg(test)]
mod tests;
mod timeline;
mod writer;

use crate::config::BusConfig;
use crate::convert::nanoseconds;

pub use kinds::{FaultKind, KINDS, Kind, Scope, words};
use mistakes::Mistakes;
pub use mistakes::{FaultError, Mistake};
pub(crate) use pushes::Pushes;
pub use script::{FaultScript, GroundChange, ScriptedFault, ScriptedPush, Target};
use timeline::{Fault, Timeline};

/// Time without supply of a servo that is reset, ns: long enough for a motor step to see it.
const RESET_NS: u64 = 1_000_000;

/// The faults of one bus.
#[derive(Debug, Default)]
pub(crate) struct BusFaults {
    faults: Timeline,
    /// Times at which the adapter is pulled out, latest first.
    unplugs_ns: Vec<u64>,
    /// Ids the servos were built with, in their order.
    pub(crate) home_ids: Vec<u8>,
}

impl BusFaults {
    /// Active faults of a servo.
    fn on(&self, now_ns: u64, id: u8) -> impl Iterator<Item = &Fault> {
        self.faults.on(now_ns).filter(move |fault| fault.is_of(id))
    }

    /// True if a fault of this kind, which has no value of its own, is active on the servo.
    pub(crate) fn has(&self, now_ns: u64, id: u8, kind: FaultKind) -> bool {
        self.on(now_ns, id).any(|fault| fault.kind == kind)
    }

    /// The id that the servo takes for its own, if not its real one; if several, the last it took.
    pub(crate) fn wrong_id(&self, now_ns: u64, id: u8) -> Option<u8> {
        self.on(now_ns, id).find_map(|fault| match fault.kind {
            FaultKind::WrongId { as_id } => Some(as_id),
            _ => None,
        })
    }

    /// Extra delay of a reply, ns.
    pub(crate) fn late_ns(&self, now_ns: u64, id: u8) -> u64 {
        self.on(now_ns, id)
            .map(|fault| match fault.kind {
                FaultKind::Slow { delay_ms } => nanoseconds(delay_ms / 1000.0),
                _ => 0,
            })
            .sum()
    }

    /// Share of the replies with scrambled content; the largest if there are several.
    pub(crate) fn scrambled_share(&self, now_ns: u64, id: u8) -> f64 {
        let shares = self.on(now_ns, id).map(|fault| match fault.kind {
            FaultKind::Scrambled { share } => share,
            _ => 0.0,
        });
        shares.fold(0.0, f64::max)
    }

    /// True if the servo has no supply: its own plug is out, or it is being reset.
    pub(crate) fn takes_power(&self, now_ns: u64, id: u8) -> bool {
        self.on(now_ns, id).any(|fault| fault.kind == FaultKind::Reset || fault.is_one_plug())
    }

    pub(crate) fn echoes(&self, now_ns: u64) -> bool {
        self.faults.on(now_ns).any(|fault| fault.kind == FaultKind::Echo)
    }

    pub(crate) fn is_unplugged(&self, now_ns: u64) -> bool {
        self.faults.on(now_ns).any(Fault::is_adapters_plug)
    }

    /// Supply forced by a fault, V; the lowest if there are several.
    pub(crate) fn volts(&self, now_ns: u64) -> Option<f64> {
        let forced = self.faults.on(now_ns).filter_map(|fault| match fault.kind {
            FaultKind::LowVoltage { volts } => Some(volts),
            FaultKind::BrownOut => Some(0.0),
            _ => None,
        });
        forced.min_by(f64::total_cmp)
    }

    /// Temperature forced by a fault, °C; the highest if there are several.
    pub(crate) fn celsius(&self, now_ns: u64, id: u8) -> Option<f64> {
        let forced = self.on(now_ns, id).filter_map(|fault| match fault.kind {
            FaultKind::Hot { celsius } => Some(celsius),
            _ => None,
        });
        forced.max_by(f64::total_cmp)
    }

    /// Pulls the adapter out at `now_ns`, for `for_ns`.
    pub(crate) fn unplug(&mut self, now_ns: u64, for_ns: u64) {
        let until_ns = now_ns.saturating_add(for_ns);
        self.faults.add(Fault { kind: FaultKind::Unplugged, from_ns: now_ns, until_ns, id: None });
        // The pending ones are later: this is the next.
        self.unplugs_ns.push(now_ns);
    }

    /// Puts the adapter back at `now_ns`.
    pub(crate) fn plug_in(&mut self, now_ns: u64) {
        self.faults.retain(|fault| !(fault.is_adapters_plug() && fault.is_on(now_ns)));
    }

    /// When the adapter is next pulled out.
    pub(crate) fn next_unplug_ns(&self) -> Option<u64> {
        self.unplugs_ns.last().copied()
    }

    /// Removes that event once it has happened.
    pub(crate) fn take_unplug(&mut self) {
        self.unplugs_ns.pop();
    }
}

/// The faults of the inertial measurement unit.
#[derive(Debug, Default)]
pub(crate) struct ImuFaults {
    faults: Timeline,
}

impl ImuFaults {
    pub(crate) fn is_on(&self, now_ns: u64, kind: FaultKind) -> bool {
        self.faults.on(now_ns).any(|fault| fault.kind == kind)
    }
}

/// A script sorted by target: the faults of every bus, of the host, and of the inertial measurement unit.
pub(crate) struct Assigned {
    pub(crate) buses: Vec<BusFaults>,
    pub(crate) stalls: HostStalls,
    pub(crate) imu: ImuFaults,
}

impl FaultKind {
    /// True for faults of the inertial measurement unit.
    pub fn is_of_imu(self) -> bool {
        self.scope() == Scope::Imu
    }
}

/// Moments at which the host oversleeps.
#[derive(Debug, Default)]
pub(crate) struct HostStalls {
    /// (from when, how long), ns.
    stalls: Vec<(u64, u64)>,
}

impl HostStalls {
    /// Sum of the stalls that are due; removes them.
    pub(crate) fn take(&mut self, now_ns: u64) -> u64 {
        let due: u64 = self.stalls.iter().filter(|(from, _)| *from <= now_ns).map(|(_, delay)| delay).sum();
        self.stalls.retain(|(from, _)| *from > now_ns);
        due
    }
}

impl FaultScript {
    /// Gives every bus its faults.
    pub(crate) fn assign(self, buses: &[BusConfig]) -> Result<Assigned, FaultError> {
        let mut assigned: Vec<BusFaults> = buses
            .iter()
            .map(|bus| BusFaults {
                home_ids: bus.servos.iter().map(|servo| servo.id).collect(),
                ..Default::default()
            })
            .collect();
        let mut stalls = HostStalls::default();
        let mut imu = ImuFaults::default();
        let mut mistakes = Mistakes::default();
        for fault in &self.faults {
            let places = targets::buses_of(&fault.target, buses).unwrap_or_else(|mistake| {
                mistakes.push(mistake);
                Vec::new()
            });
            let from_ns = nanoseconds(fault.at_s);
            let for_ns = match fault.kind {
                FaultKind::Reset => Some(RESET_NS),
                _ => fault.for_s.map(nanoseconds),
            };
            let until_ns = for_ns.map_or(u64::MAX, |for_ns| from_ns.saturating_add(for_ns));
            if let FaultKind::LateHost { delay_ms } = fault.kind {
                stalls.stalls.push((from_ns, nanoseconds(delay_ms / 1000.0)));
                continue;
            }
            if fault.kind.is_of_imu() {
                imu.faults.add(Fault { kind: fault.kind, from_ns, until_ns, id: None });
                continue;
            }
            if let FaultKind::Push(_) = fault.kind {
                continue;
            }
            for place in places {
                let faults = &mut assigned[place];
                faults.faults.add(Fault { kind: fault.kind, from_ns, until_ns, id: fault.target.id });
                if fault.kind == FaultKind::Unplugged && fault.target.id.is_none() {
                    faults.unplugs_ns.push(from_ns);
                }
            }
        }
        if let Some(error) = mistakes.finish(&self.file_name) {
            return Err(error);
        }
        for faults in &mut assigned {
            faults.unplugs_ns.sort_unstable_by(|a, b| b.cmp(a));
        }
        Ok(Assigned { buses: assigned, stalls, imu })
    }
}
