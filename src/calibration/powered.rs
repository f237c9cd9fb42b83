//! Each joint turned a little by its own motor: checks that it turns, and in the right direction.

use super::bench::Bench;
use super::zero::zero_count;
use super::{CalibrateError, Person, ways};
use crate::bus::{Buses, Ports};
use crate::config::Unit;
use crate::jog::turn;
use crate::model::{Joint, Robot, Servo};
use crate::run::Operator;
use crate::telemetry::Outcome;

/// How far a joint turns, rad; less if its range is less.
const TURN_RAD: f64 = 5.0 * std::f64::consts::PI / 180.0;
/// Torque during the turn, share of stall torque.
const TORQUE_SHARE: f64 = 0.2;
/// How long the joint is held there, s: long enough to come to rest.
const HOLD_S: f64 = 0.3;
/// A joint that covers less than this share of the way did not turn: friction and load keep every servo a little
/// off its goal.
const TURNED_SHARE: f64 = 0.5;

/// Turns every joint that is not checked yet. The second value is true if all servos have confirmed its end.
pub(super) fn check_all<P: Ports, H: Person>(
    robot: &Robot,
    mut buses: Buses<P>,
    unit: &mut Unit,
    person: &mut H,
    operator: &mut impl Operator,
    is_unattended: bool,
) -> (Result<(), CalibrateError>, bool) {
    let left: Vec<usize> =
        (0..unit.joints.len()).filter(|place| !unit.joints[*place].direction_checked).collect();
    if left.is_empty() {
        return (Ok(()), true);
    }
    person.hear("");
    person.hear(&format!(
        "Now each joint turns by itself: {:.0} degrees, at {:.0} % of its torque, one after the other; all others are \
         limp. Put the robot on its stand, all limbs free, and a hand on the power switch.",
        TURN_RAD.to_degrees(),
        100.0 * TORQUE_SHARE
    ));
    if !is_unattended {
        let mut bench = Bench::new(robot, buses, person);
        if let Err(error) = bench.ask("Press Enter to begin.") {
            return (Err(error), true);
        }
        buses = bench.buses;
    }
    let mut stuck = Vec::new();
    for place in left {
        let (result, is_heard, back) = check_one(robot, buses, unit, place, person, operator, is_unattended);
        match (result, back) {
            (Ok(true), Some(back)) => buses = back,
            (Ok(false), Some(back)) => {
                stuck.push(unit.joints[place].name.clone());
                buses = back;
            }
            (Err(error), _) => return (Err(error), is_heard),
            (Ok(_), None) => return (Ok(()), is_heard),
        }
    }
    (if stuck.is_empty() { Ok(()) } else { Err(CalibrateError::Stuck { joints: stuck }) }, true)
}

/// Turns one joint and saves the result: false if it did not turn. Gives the buses back unless an error occurred.
fn check_one<P: Ports, H: Person>(
    robot: &Robot,
    mut buses: Buses<P>,
    unit: &mut Unit,
    place: usize,
    person: &mut H,
    operator: &mut impl Operator,
    is_unattended: bool,
) -> (Result<bool, CalibrateError>, bool, Option<Buses<P>>) {
    let name = unit.joints[place].name.clone();
    let Some(index) = robot.joints.iter().position(|joint| joint.name == name) else {
        return (Ok(true), true, Some(buses));
    };
    let joint = &robot.joints[index];
    let [forward, back] = ways(robot, index);
    loop {
        let built = as_built(robot, unit);
        let Some(servo) = built.joints[index].servo else { return (Ok(true), true, Some(buses)) };
        let mut bench = Bench::new(robot, buses, &mut *person);
        let start_rad = match bench.count(index) {
            Ok(count) => servo.angle_of(count),
            Err(error) => return (Err(error), true, None),
        };
        buses = bench.buses;
        let Some(goal_rad) = goal_rad(&built.joints[index], start_rad) else {
            return (Err(CalibrateError::OutsideRange { joint: name }), true, None);
        };
        let way = if goal_rad > start_rad { &forward } else { &back };
        person.hear(&format!(
            "{name}: turns {:.1} degrees; the end of its limb goes {way}.",
            (goal_rad - start_rad).abs().to_degrees()
        ));
        if let Err(error) = buses.arm_watchdogs(&built) {
            return (Err(error.into()), true, None);
        }
        let (report, back) = turn(&built, index, goal_rad, HOLD_S, buses, operator);
        buses = back;
        if person.wants_to_stop() {
            return (Err(CalibrateError::Left), report.is_end_heard, None);
        }
        if report.outcome != Outcome::Completed {
            return (Err(CalibrateError::Stopped { reason: report.reason }), report.is_end_heard, None);
        }
        let turned_rad = report.measured_rad.map_or(0.0, |measured| measured - start_rad);
        if turned_rad / (goal_rad - start_rad) < TURNED_SHARE {
            person.hear(&format!("{name}: did not turn; it is blocked, or too heavy for so little torque."));
            return (Ok(false), true, Some(buses));
        }
        if !is_unattended {
            let mut bench = Bench::new(robot, buses, &mut *person);
            let is_right = match bench.ask_whether(&format!("{name}: did the end of its limb go {way}?")) {
                Ok(is_right) => is_right,
                Err(error) => return (Err(error), true, None),
            };
            buses = bench.buses;
            if !is_right {
                let marked = servo.count_of(joint.middle_rad());
                let other = Servo { reversed: !servo.reversed, ..servo };
                unit.joints[place].reversed = Some(other.reversed);
                unit.joints[place].zero_count = zero_count(joint, &other, marked);
                if let Err(error) = person.keep(unit) {
                    return (Err(error.into()), true, None);
                }
                person.hear(&format!("{name}: mounted the other way round, which is recorded. Once more:"));
                continue;
            }
        }
        unit.joints[place].direction_checked = true;
        if let Err(error) = person.keep(unit) {
            return (Err(error.into()), true, None);
        }
        person.hear(&format!("{name}: turned {:.1} degrees, good.", turned_rad.to_degrees().abs()));
        return (Ok(true), true, Some(buses));
    }
}

/// The robot with its servos as in `unit`, and little torque.
fn as_built(robot: &Robot, unit: &Unit) -> Robot {
    let mut built = robot.clone();
    built.safety.torque_share = built.safety.torque_share.min(TORQUE_SHARE);
    for joint in &mut built.joints {
        let entry = unit.joints.iter().find(|entry| entry.name == joint.name);
        if let (Some(servo), Some(entry)) = (&mut joint.servo, entry) {
            *servo = entry.of(servo);
        }
    }
    built
}

/// A point a little further from `start_rad` towards the farther end of the joint's range, and within it; `None` if
/// the start is so far outside the range that it would be a long way.
fn goal_rad(joint: &Joint, start_rad: f64) -> Option<f64> {
    let (low, high) = joint.goal_range_rad();
    let turn_rad = if start_rad <= joint.middle_rad() { TURN_RAD } else { -TURN_RAD };
    let goal_rad = (start_rad + turn_rad).clamp(low, high);
    let way_rad = (goal_rad - start_rad).abs();
    (way_rad > 0.0 && way_rad <= TURN_RAD + 1e-9).then_some(goal_rad)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config;

    #[test]
    fn no_joint_turns_further_than_announced() {
        let robot = config::load(std::path::Path::new("config/horse.toml")).unwrap().robot;
        for joint in &robot.joints {
            let (low, high) = joint.goal_range_rad();
            for tenths in -900..=900 {
                let start_rad = joint.middle_rad() + f64::from(tenths).to_radians() / 10.0;
                match goal_rad(joint, start_rad) {
                    Some(goal_rad) => {
                        assert!(
                            (goal_rad - start_rad).abs() <= TURN_RAD + 1e-9
                                && low <= goal_rad
                                && goal_rad <= high
                        );
                    }
                    None => assert!(start_rad < low - TURN_RAD + 1e-9 || start_rad > high + TURN_RAD - 1e-9),
                }
            }
        }
    }
}
