//! A judge of runs, who believes neither the report nor safety: only the simulated servos' own registers and shafts.
//!
//! Comes in: what every servo truly holds and does, once a cycle ([`ServoTruth`]); what the operator sees of holds; the
//! report. Goes out: [`Finding`]s. It knows of the robot what its file says: ranges, counts, rates, times.

mod end;
mod eye;
#[cfg(test)]
mod tests;
mod throw;

use hw_sim::{ServoTruth, World};

use crate::model::{Robot, StopAction};
use crate::signals::Permission;
use crate::signals::Status;
pub use end::Ended;
use eye::{Eye, Limits};

/// What can be wrong with a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Wrong {
    /// A servo with torque took a goal outside its joint's range, other than on the way in from a start outside.
    Range,
    /// A servo with torque took a goal further from the one before than the joint's rate allows.
    Rate,
    /// A shaft was thrown by its motor: torque came on, or a goal leapt, far from where it was.
    Snap,
    /// A servo has gained torque or a goal after the run, or a motor without torque turns its shaft.
    Moved,
    /// A servo has torque though the run ended limp or never began.
    Torque,
    /// The run did not end, or held for longer than its times allow.
    Endless,
    /// The report says something else than what was so.
    Report,
    /// Something panicked.
    Panic,
}

impl Wrong {
    /// All there are.
    pub const ALL: [Wrong; 8] = [
        Wrong::Range,
        Wrong::Rate,
        Wrong::Snap,
        Wrong::Moved,
        Wrong::Torque,
        Wrong::Endless,
        Wrong::Report,
        Wrong::Panic,
    ];

    /// The word for it in tables and files.
    pub fn name(self) -> &'static str {
        match self {
            Wrong::Range => "range",
            Wrong::Rate => "rate",
            Wrong::Snap => "snap",
            Wrong::Moved => "moved",
            Wrong::Torque => "torque",
            Wrong::Endless => "endless",
            Wrong::Report => "report",
            Wrong::Panic => "panic",
        }
    }
}

/// One thing that was wrong.
#[derive(Debug, Clone, PartialEq)]
pub struct Finding {
    /// What.
    pub wrong: Wrong,
    /// When, s since power-up.
    pub time_s: f64,
    /// Where and how much, in words.
    pub what: String,
}

/// A run has no more than so many findings of each kind that are worth telling.
const MOST_OF_A_KIND: usize = 5;
/// A hold may last this much longer than its times add up to, s: cycles take a little longer while a servo is silent.
const HOLD_SLACK_S: f64 = 3.0;
/// Largest slope of the curve on which poses change: the slow rate is kept where it is steepest.
const CURVE_SLOPE: f64 = 1.875;
/// Rising, letting go and waiting to be heard at the end take no longer than this, s, torque ramps left aside.
const ENDS_S: f64 = 8.0;

/// Judges one run.
#[derive(Debug)]
pub struct Judge {
    eyes: Vec<Eye>,
    findings: Vec<Finding>,
    /// Time of the last look, s since power-up.
    looked_s: f64,
    /// The run is over, and nobody talks to the servos any more.
    is_over: bool,
    /// Since when safety has held the robot without a break, s of the run.
    held_since_s: Option<f64>,
    hold_most_s: f64,
    run_most_s: f64,
    /// Looks at which each bus's servos could not be reached, all servos together.
    unreachable_looks: Vec<u64>,
    looks: u64,
}

impl Judge {
    /// Of a run of `robot` that is told to stop at once at `told_s`, s of the run, at the latest.
    pub fn new(robot: &Robot, told_s: f64) -> Judge {
        let safety = &robot.safety;
        let limits = Limits { period_s: robot.period_s(), rate_share: safety.rate_share };
        let mut places = vec![0; robot.buses.len()];
        let eyes = robot.joints.iter().enumerate().filter_map(|(index, joint)| {
            let servo = joint.servo?;
            let place = places.get_mut(servo.bus)?;
            *place += 1;
            Some(Eye::new(index, joint, servo, *place - 1, &limits))
        });
        // From one end of the widest range to the other at the slow rate: what it takes to bring a joint in after a
        // silence, and, along a curve, to sit down.
        let widest_rad =
            robot.joints.iter().map(|joint| joint.range_rad.1 - joint.range_rad.0).fold(0.0, f64::max) * 1.2;
        let way_s = widest_rad / safety.slow_rate_rad_s;
        let hold_most_s = safety.hold_s + safety.fault_delay_s + safety.coast_s + way_s + HOLD_SLACK_S;
        // The robot is held for hold_s and, since time without a fault makes good for a fifth of it, for a fifth of the
        // motion; each hold may be followed by a joint's way in.
        let motion_s = CURVE_SLOPE * way_s + 2.0 * safety.torque_ramp_s + ENDS_S;
        let run_most_s = told_s + 1.25 * motion_s + 2.0 * hold_most_s;
        Judge {
            eyes: eyes.collect(),
            findings: Vec::new(),
            looked_s: 0.0,
            is_over: false,
            held_since_s: None,
            hold_most_s,
            run_most_s,
            unreachable_looks: vec![0; robot.buses.len()],
            looks: 0,
        }
    }

    /// What was found so far.
    pub fn findings(&self) -> &[Finding] {
        &self.findings
    }

    /// Whether something of this kind was found.
    pub fn has(&self, wrong: Wrong) -> bool {
        self.findings.iter().any(|finding| finding.wrong == wrong)
    }

    /// Looks at all servos of `world`: at the beginning of each cycle, and after the run.
    pub fn look(&mut self, world: &World) {
        let now_s = std::time::Duration::from_nanos(world.now_ns()).as_secs_f64();
        self.look_at(now_s, |bus, place| world.truth(bus, place).unwrap_or_default());
    }

    /// Looks at what each servo, by its bus and its place there, truly holds and does at `now_s`.
    pub fn look_at(&mut self, now_s: f64, truth: impl Fn(usize, usize) -> ServoTruth) {
        // What was written since the last look was written just behind that.
        let written_s = self.looked_s;
        self.looks += 1;
        for index in 0..self.eyes.len() {
            let (bus, place) = self.eyes[index].place();
            let truth = truth(bus, place);
            self.unreachable_looks[bus] += u64::from(!truth.is_reachable && !self.is_over);
            if let Some((wrong, what)) = self.eyes[index].look(now_s, written_s, &truth, self.is_over) {
                self.find(wrong, now_s, || what);
            }
        }
        self.looked_s = now_s;
    }

    /// Sees what an operator sees, once a cycle. True if this run is to be given up: it does not end.
    pub fn note(&mut self, status: &Status) -> bool {
        let now_s = status.time_s;
        self.held_since_s = match status.permission {
            Permission::Hold => self.held_since_s.or(Some(now_s)),
            Permission::Move | Permission::Stop => None,
        };
        let held_s = self.held_since_s.map_or(0.0, |since_s| now_s - since_s);
        let activity = status.activity;
        if held_s > self.hold_most_s {
            let most_s = self.hold_most_s;
            self.find(Wrong::Endless, now_s, || {
                format!("held for {held_s:.1} s while {activity:?}, {most_s:.1} s are the most, and no stop action")
            });
        } else if now_s > self.run_most_s {
            let most_s = self.run_most_s;
            self.find(Wrong::Endless, now_s, || format!("still {activity:?} after {most_s:.1} s"));
        } else {
            return false;
        }
        true
    }

    fn find(&mut self, wrong: Wrong, time_s: f64, what: impl FnOnce() -> String) {
        if self.findings.iter().filter(|finding| finding.wrong == wrong).count() < MOST_OF_A_KIND {
            self.findings.push(Finding { wrong, time_s, what: what() });
        }
    }

    /// Whether a run of `robot` that has ended leaves its servos without torque: unless it is to hold its pose, always.
    fn ends_limp(robot: &Robot) -> bool {
        robot.stop_action == StopAction::SitThenLimp
    }
}
