//! Scripted pushes of the trunk: when each comes, and in which direction.

use std::f64::consts::PI;

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

use super::kinds::FaultKind;
use super::script::{FaultScript, ScriptedPush};
use crate::body::Push;
use crate::convert::nanoseconds;

/// The pushes of a script that are still to come.
#[derive(Debug)]
pub(crate) struct Pushes {
    /// When each comes next, ns; `None` for one that will not come again.
    waiting: Vec<(Option<u64>, ScriptedPush)>,
    /// Random direction of the pushes for which the script gives none.
    chance: Pcg64Mcg,
}

impl Pushes {
    pub(crate) fn of(script: &FaultScript, seed: u64) -> Pushes {
        let pushes = script.faults.iter().filter_map(|fault| match fault.kind {
            FaultKind::Push(push) => Some((Some(nanoseconds(fault.at_s)), push)),
            _ => None,
        });
        // A separate random stream: the faults on the buses are the same with and without pushes.
        Pushes { waiting: pushes.collect(), chance: Pcg64Mcg::seed_from_u64(seed ^ 0x5075_7368) }
    }

    /// Removes and returns a push due by `now_ns`: start, end (exclusive), ns, and the push.
    pub(crate) fn take(&mut self, now_ns: u64) -> Option<(u64, u64, Push)> {
        let is_due =
            |(at_ns, _): &&mut (Option<u64>, ScriptedPush)| at_ns.is_some_and(|at_ns| at_ns <= now_ns);
        let (next_ns, push) = self.waiting.iter_mut().find(is_due)?;
        let from_ns = next_ns.take()?;
        *next_ns = push.every_s.map(|every_s| from_ns + nanoseconds(every_s).max(1));
        let towards_rad = push.towards_rad.unwrap_or_else(|| self.chance.random_range(-PI..PI));
        let force_n = push.impulse_n_s / push.for_s;
        let force_n = [force_n * towards_rad.cos(), force_n * towards_rad.sin(), 0.0];
        let until_ns = from_ns + nanoseconds(push.for_s);
        Some((from_ns, until_ns, Push { force_n, place_m: push.place_m, ..Push::default() }))
    }
}
