//! A judge of runs that trusts neither the report nor safety: only the simulated servos' own registers and shafts.
//!
//! Input: the true registers and motion of every servo, once per cycle ([`ServoTruth`]); the holds that the
//! operator sees; the report. Output: [`Finding`]s. It takes from the robot file only ranges, counts, rates
//! and times.

mod end;
mod servo_judge;
#[cfg(test)]
mod tests;
mod throw;

use hw_sim::{ServoTruth, World};

use crate::model::{Robot, StopAction};
use crate::signals::Permission;
use crate::signals::Status;
pub use end::Ended;
use servo_judge::{Limits, ServoJudge};

/// Kinds of fault in a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Violation {
    /// A servo with torque took a goal outside its joint's range, except on the way in from a start outside.
    Range,
    /// A servo with torque took a goal further from its last one than the joint's rate allows.
    Rate,
    /// A motor threw its shaft: torque came on, or a goal jumped, far from the shaft's position.
    Snap,
    /// A servo gained torque or a goal after the run, or a motor without torque turns its shaft.
    Moved,
    /// A servo has torque though the run ended limp or never began.
    Torque,
    /// The run did not end, or held for longer than its times allow.
    Endless,
    /// The report contradicts what happened.
    Report,
    /// The program panicked.
    Panic,
}

impl Violation {
    /// All kinds.
    pub const ALL: [Violation; 8] = [
        Violation::Range,
        Violation::Rate,
        Violation::Snap,
        Violation::Moved,
        Violation::Torque,
        Violation::Endless,
        Violation::Report,
        Violation::Panic,
    ];

    /// Its name in tables and files.
    pub fn name(self) -> &'static str {
        match self {
            Violation::Range => "range",
            Violation::Rate => "rate",
            Violation::Snap => "snap",
            Violation::Moved => "moved",
            Violation::Torque => "torque",
            Violation::Endless => "endless",
            Violation::Report => "report",
            Violation::Panic => "panic",
        }
    }
}

/// One fault.
#[derive(Debug, Clone, PartialEq)]
pub struct Finding {
    /// Its kind.
    pub wrong: Violation,
    /// Its time, s since power-up.
    pub time_s: f64,
    /// Its place and amount, in words.
    pub what: String,
}

/// Most findings of each kind that are kept per run.
const MOST_OF_A_KIND: usize = 5;
/// How much longer a hold may last than its times add up to, s: cycles take a little longer while a servo is
/// silent.
const HOLD_SLACK_S: f64 = 3.0;
/// Largest slope of the curve by which poses change: the slow rate holds at the steepest point.
const CURVE_SLOPE: f64 = 1.875;
/// Most time for rising, letting go and waiting for replies at the end, without torque ramps, s.
const ENDS_S: f64 = 8.0;

/// Judges one run.
#[derive(Debug)]
pub struct Judge {
    eyes: Vec<ServoJudge>,
    findings: Vec<Finding>,
    /// Time of the last check, s since power-up.
    looked_s: f64,
    /// True if the run is over and the program no longer talks to the servos.
    is_over: bool,
    /// Time since which safety has held the robot without a break, s of the run.
    held_since_s: Option<f64>,
    hold_most_s: f64,
    run_most_s: f64,
    /// Number of checks at which each bus's servos were unreachable, all servos together.
    unreachable_looks: Vec<u64>,
    looks: u64,
}

impl Judge {
    /// A judge for a run of `robot` that gets the order to stop at once at `told_s`, s of the run, at the latest.
    pub fn new(robot: &Robot, told_s: f64) -> Judge {
        let safety = &robot.safety;
        let limits = Limits { period_s: robot.period_s(), rate_share: safety.rate_share };
        let mut places = vec![0; robot.buses.len()];
        let eyes = robot.joints.iter().enumerate().filter_map(|(index, joint)| {
            let servo = joint.servo?;
            let place = places.get_mut(servo.bus)?;
            *place += 1;
            Some(ServoJudge::new(index, joint, servo, *place - 1, &limits))
        });
        // From one end of the widest range to the other at the slow rate: the time to bring a joint in after
        // a silence and, along a curve, to sit down.
        let widest_rad =
            robot.joints.iter().map(|joint| joint.range_rad.1 - joint.range_rad.0).fold(0.0, f64::max) * 1.2;
        let way_s = widest_rad / safety.slow_rate_rad_s;
        let hold_most_s = safety.hold_s + safety.fault_delay_s + safety.coast_s + way_s + HOLD_SLACK_S;
        // The robot is held for hold_s and, because fault-free time cancels a fifth of it, for a fifth of the
        // motion; after each hold a joint may have to come in.
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

    /// The findings so far.
    pub fn findings(&self) -> &[Finding] {
        &self.findings
    }

    /// True if a fault of this kind was found.
    pub fn has(&self, wrong: Violation) -> bool {
        self.findings.iter().any(|finding| finding.wrong == wrong)
    }

    /// Checks all servos of `world`: at the beginning of each cycle, and after the run.
    pub fn look(&mut self, world: &World) {
        let now_s = std::time::Duration::from_nanos(world.now_ns()).as_secs_f64();
        self.look_at(now_s, |bus, place| world.truth(bus, place).unwrap_or_default());
    }

    /// Checks the true registers and motion of each servo at `now_s`; `truth` takes its bus and its index there.
    pub fn look_at(&mut self, now_s: f64, truth: impl Fn(usize, usize) -> ServoTruth) {
        // Values written since the last check were written just after that check.
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

    /// Takes the operator's view, once per cycle. True if the run should be given up because it does not end.
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
            self.find(Violation::Endless, now_s, || {
                format!("held for {held_s:.1} s while {activity:?}, {most_s:.1} s are the most, and no stop action")
            });
        } else if now_s > self.run_most_s {
            let most_s = self.run_most_s;
            self.find(Violation::Endless, now_s, || format!("still {activity:?} after {most_s:.1} s"));
        } else {
            return false;
        }
        true
    }

    fn find(&mut self, wrong: Violation, time_s: f64, what: impl FnOnce() -> String) {
        if self.findings.iter().filter(|finding| finding.wrong == wrong).count() < MOST_OF_A_KIND {
            self.findings.push(Finding { wrong, time_s, what: what() });
        }
    }

    /// True if a run of `robot` that has ended leaves its servos without torque: always, unless its stop
    /// action is to hold its pose.
    fn ends_limp(robot: &Robot) -> bool {
        robot.stop_action == StopAction::SitThenLimp
    }
}
