//! Things that go wrong on the simulated buses while the robot walks: a short loss coasts, a long one holds and
//! then takes the stop action, with a message a person can act on; and no goal ever leaves its limits.

mod common;

use common::{Scenario, Watched, shipped};
use hippocamp::model::{Robot, StopAction};
use hippocamp::motion::Activity;
use hippocamp::signals::Permission;
use hippocamp::telemetry::Outcome;

/// When faults begin, s since power-up: in mid-walk (asserted).
const FAULT_S: f64 = 6.0;
/// Room for cycles to pass between a cause and what follows it, s.
const SLACK_S: f64 = 0.05;

/// What a fault may do to a run.
enum Effect {
    /// The robot walks on as if nothing had been.
    None,
    /// The robot stands still until the fault has passed, then walks on.
    Hold {
        /// From the fault to the hold, s.
        after_s: f64,
    },
    /// The robot stands still, and then takes its stop action.
    Stop {
        /// From the fault to the hold, s.
        after_s: f64,
        /// What the message must say.
        says: &'static [&'static str],
        /// Servos that hear nothing any more, and so cannot be let go.
        unreachable: std::ops::RangeInclusive<u8>,
    },
}
use Effect::{Hold, Stop};

/// No servo.
#[allow(clippy::reversed_empty_ranges, reason = "meant to be empty")]
const NOBODY: std::ops::RangeInclusive<u8> = 1..=0;

struct Case {
    faults: &'static str,
    effect: Effect,
    /// Lost replies, from and to.
    missing: (u64, u64),
    /// Damaged ones.
    corrupt: (u64, u64),
    /// For how long goals may fail to reach a servo that later hears again, s.
    blind_s: f64,
}

fn robot_with(file: &str, stop_action: StopAction) -> Robot {
    let mut robot = shipped(file);
    robot.stop_action = stop_action;
    robot
}

fn watch(robot: &Robot, faults: &str) -> Watched {
    let watched = Scenario { faults, ..Scenario::from_sitting(robot, "walk", 6.0) }.watch();
    let at_fault = watched.first(|moment| moment.time_s >= FAULT_S - 0.1).map(|moment| moment.activity);
    assert_eq!(at_fault, Some(Activity::Walking), "the fault must come in mid-walk");
    watched
}
