//! Checks the end of a run against the true state of its servos.

use super::{Judge, Violation};
use crate::bus::StartError;
use crate::model::Robot;
use crate::telemetry::{Outcome, Report};
use crate::trial::campaign::draw::Episode;
use hw_sim::faults::FaultKind;

/// The end of a run, for the judge.
#[derive(Debug)]
pub enum Ended {
    /// The run ended with a report.
    Reported(Box<Report>),
    /// The run never began.
    NotStarted(StartError),
    /// The run panicked outside of its loop.
    Panicked(String),
    /// The judge gave the run up.
    GivenUp,
}

/// A servo that was unreachable for this long at the end cannot have received the command to end, s.
const UNHEARD_S: f64 = 1.0;
/// Permitted error of the counted replies: a difference of this many, and a factor of this.
const REPLIES_SLACK: u64 = 100;
const REPLIES_TIMES: u64 = 3;

impl Judge {
    /// Judges the end of a run of `robot`, before anything else happens to its servos.
    pub fn judge_end(&mut self, robot: &Robot, episode: &Episode, ended: &Ended) {
        self.is_over = true;
        let now_s = self.looked_s;
        match ended {
            Ended::GivenUp => {}
            Ended::Panicked(said) => self.find(Violation::Panic, now_s, || said.clone()),
            Ended::NotStarted(error) => {
                let has_torque = |of: &str| format!("{of} has torque, though the run never began: {error}");
                for name in self.with_torque().into_iter().map(|(name, _)| name).collect::<Vec<_>>() {
                    self.find(Violation::Torque, now_s, || has_torque(&name));
                }
            }
            Ended::Reported(report) => {
                if report.reason.contains("panicked") {
                    self.find(Violation::Panic, now_s, || report.reason.clone());
                }
                if Judge::ends_limp(robot) {
                    self.judge_limp_end(report);
                }
                self.judge_counts(robot, episode, report);
            }
        }
    }

    /// Servos that have torque, and the time since which they have been reachable without a break, s.
    fn with_torque(&self) -> Vec<(String, Option<f64>)> {
        let on = self.eyes.iter().filter(|eye| eye.last().torque_on);
        on.map(|eye| (eye.joint().1.to_owned(), eye.reachable_since_s())).collect()
    }

    /// Checks that no reachable servo has torque, and that the report admits any that were not reached.
    fn judge_limp_end(&mut self, report: &Report) {
        let now_s = self.looked_s;
        for (name, reachable_since_s) in self.with_torque() {
            if report.is_end_heard {
                let said = &report.reason;
                self.find(Violation::Torque, now_s, || {
                    format!("{name} has torque, and the report says that all heard the end: {said}")
                });
            } else if reachable_since_s.is_some_and(|since_s| now_s - since_s > UNHEARD_S) {
                self.find(Violation::Torque, now_s, || {
                    format!("{name} has torque, and could be reached for the last {UNHEARD_S} s and more")
                });
            }
        }
        let unheard = self.eyes.iter().filter(|eye| {
            let is_long = |since_s: f64| now_s - since_s > UNHEARD_S + 0.5;
            eye.has_been_on() && eye.unreachable_since_s().is_some_and(is_long)
        });
        let unheard: Vec<String> = unheard.map(|eye| eye.joint().1.to_owned()).collect();
        if let (Some(name), true) = (unheard.first(), report.is_end_heard) {
            self.find(Violation::Report, now_s, || {
                format!("{name} could not be reached at the end, and the report says that all heard it")
            });
        }
    }

    /// Checks the report's counts against the truth.
    fn judge_counts(&mut self, robot: &Robot, episode: &Episode, report: &Report) {
        let now_s = self.looked_s;
        let is_clean = report.outcome == Outcome::Completed
            && report.joints.range_violations == 0
            && report.joints.rate_violations == 0;
        if is_clean && (self.has(Violation::Range) || self.has(Violation::Rate) || self.has(Violation::Snap))
        {
            self.find(Violation::Report, now_s, || {
                "goals left their limits, and the report counts none".to_owned()
            });
        }
        let is_quiet = episode.faults.iter().all(|fault| !may_cost_replies(fault.kind));
        for (index, bus) in report.buses.iter().enumerate() {
            let told = bus.missing + bus.corrupt;
            let truly = self.unreachable_looks.get(index).copied().unwrap_or_default();
            let name = &robot.buses[index].name;
            if told * REPLIES_TIMES + REPLIES_SLACK < truly {
                self.find(Violation::Report, now_s, || {
                    format!(
                        "bus {name}: servos could not be reached {truly} times, the report counts {told} lost"
                    )
                });
            }
            if is_quiet && report.servo_restarts == 0 && told > REPLIES_SLACK {
                self.find(Violation::Report, now_s, || {
                    format!(
                        "bus {name}: the report counts {told} lost replies, and nothing went wrong with any"
                    )
                });
            }
        }
    }
}

/// True if this kind of fault may cost a reply.
fn may_cost_replies(kind: FaultKind) -> bool {
    use FaultKind::{Hot, ImuFrozen, ImuGarbled, ImuSilent, ImuUnplugged, Push, Stuck};
    !matches!(kind, Hot { .. } | ImuFrozen | ImuGarbled | ImuSilent | ImuUnplugged | Push(_) | Stuck)
}
