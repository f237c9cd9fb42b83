//! Starts from any limp pose: slowly, by the shortest way, never past a limit.

mod common;

use std::f64::consts::PI;

use common::{ROBOTS, Scenario, goal_counts, is_full, plan, rate_counts_s, servo, shipped};
use hippocamp::bus::ServoGoal;
use hippocamp::cycle::Controller;
use hippocamp::ik::Method;
use hippocamp::model::{Joint, Robot};
use hippocamp::motion::horse::HorsePlan;
use hippocamp::motion::{Activity, Order};
use hippocamp::signals::{Feedback, ImuReading, Permission, Slot};
use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::{Rng, SeedableRng};

/// How far beyond its range a limp joint may lie, share of the range's width.
const BEYOND_SHARE: f64 = 0.5;
/// No start may take longer, s.
const LONGEST_START_S: f64 = 30.0;

/// A limp pose, in whole counts: each joint in its range or beyond it, where its encoder can still tell.
fn random_pose(robot: &Robot, chance: &mut Pcg64Mcg) -> Vec<f64> {
    let angle = |joint: &Joint| {
        let share = f64::from(chance.next_u32()) / f64::from(u32::MAX);
        let (low, high) = joint.range_rad;
        let reach_rad = (high - low) * (0.5 + BEYOND_SHARE);
        let servo = servo(joint);
        let wanted = joint.middle_rad() + (2.0 * share - 1.0) * reach_rad.min(PI - servo.count_rad());
        servo.angle_of(servo.count_of(wanted).round())
    };
    robot.joints.iter().map(angle).collect()
}

/// One joint's goals on the way from limp to standing: [`Way::next`] is told each, in counts.
struct Way {
    range: (f64, f64),
    /// Largest turns in a cycle, outside the range and inside, counts.
    steps: (f64, f64),
    last: f64,
    began_outside: bool,
}

impl Way {
    fn new(robot: &Robot, joint: &Joint, measured: f64) -> Way {
        let slow = robot.safety.slow_rate_rad_s / servo(joint).count_rad();
        let range = goal_counts(joint);
        Way {
            range,
            // Rounding to counts may add one.
            steps: (slow * robot.period_s() + 1.0, rate_counts_s(robot, joint) * robot.period_s() + 1.0),
            last: measured.round(),
            began_outside: outside(range, measured) > 0.0,
        }
    }

    fn next(&mut self, goal: f64) -> Result<(), String> {
        let (before, now) = (outside(self.range, self.last), outside(self.range, goal));
        let turn = (goal - self.last).abs();
        let step = if before > 0.0 { self.steps.0 } else { self.steps.1 };
        if now > before {
            return Err(format!("went out to {goal} from {} of {:?}", self.last, self.range));
        }
        if before > 0.0 && (goal - self.last) * towards(self.range, self.last) < 0.0 {
            return Err(format!("turned away from its range {:?}: {} to {goal}", self.range, self.last));
        }
        if turn > step + 1e-6 {
            return Err(format!("turned {turn} counts in a cycle, at most {step} are allowed"));
        }
        self.last = goal;
        Ok(())
    }
}

/// Whether `goal` is where a joint is measured, or at the border of its range if that is less than 6 degrees away.
fn is_first_goal(range: (f64, f64), measured: f64, goal: f64) -> bool {
    let border = measured.clamp(range.0, range.1);
    let is_near = (measured - border).abs() < 4096.0 * 6.0 / 360.0;
    (goal - measured).abs() <= 1.0 || is_near && (goal - border).abs() <= 1.0
}

/// The count of a joint's servo that is nearest to `angle_rad`.
fn count(joint: &Joint, angle_rad: f64) -> i32 {
    #[allow(clippy::cast_possible_truncation, reason = "a count of a servo")]
    let count = servo(joint).count_of(angle_rad).round() as i32;
    count
}

/// How far outside `range` a count is.
fn outside((low, high): (f64, f64), count: f64) -> f64 {
    (low - count).max(count - high).max(0.0)
}

/// 1 where the range lies at larger counts, -1 at smaller ones.
fn towards((low, high): (f64, f64), count: f64) -> f64 {
    (0.5 * (low + high) - count).signum()
}

/// Brings `robot` from `pose` to its stand by its controller, without buses: its servos reach their goals at once.
/// Returns how many of its joints began outside their range.
fn get_up(robot: &Robot, plan: &HorsePlan, pose: &[f64]) -> Result<usize, String> {
    let mut controller = Controller::new(robot, plan.clone(), Method::CcdThenFinish, 1.0);
    let feedback = |position: i32| {
        Slot::Fresh(Feedback { position, voltage_decivolt: 120, temperature_c: 30, ..Feedback::default() })
    };
    let mut slots: Vec<Slot> =
        robot.joints.iter().zip(pose).map(|(joint, angle)| feedback(count(joint, *angle))).collect();
    let mut ways: Vec<Way> = robot
        .joints
        .iter()
        .zip(pose)
        .map(|(joint, angle)| Way::new(robot, joint, f64::from(count(joint, *angle))))
        .collect();
    let (mut is_first, mut torque, dt_s) = (true, 0.0, robot.period_s());
    let full = robot.safety.torque_share;
    for cycle in 0_u32.. {
        let time_s = f64::from(cycle) * dt_s;
        let goals = controller.decide(dt_s, Order::Go);
        for (index, (joint, goal)) in robot.joints.iter().zip(goals.servos()).enumerate() {
            let ServoGoal::Move { position, torque_limit } = *goal else { continue };
            let (servo, way) = (servo(joint), &mut ways[index]);
            let goal = f64::from(position);
            slots[index] = feedback(position);
            if is_first {
                if !is_first_goal(way.range, way.last, goal) {
                    return Err(format!("{}: first goal {goal}, measured {}", joint.name, way.last));
                }
                way.last = goal;
            }
            way.next(goal).map_err(|error| format!("{} at {time_s:.2} s: {error}", joint.name))?;
            let share = f64::from(torque_limit) / f64::from(servo.model.torque_limit_full);
            let most = if is_first { 0.02 } else { torque + 2.0 * dt_s / robot.safety.torque_ramp_s };
            if share > most {
                return Err(format!("{}: torque limit {share} at {time_s:.2} s", joint.name));
            }
            if index + 1 == robot.joints.len() {
                (is_first, torque) = (false, share);
            }
        }
        controller.learn(dt_s, &slots, &ImuReading::default());
        let record = controller.record(&slots);
        let permission = record.state.permission;
        if permission != Permission::Move || time_s > LONGEST_START_S {
            return Err(format!("{permission:?} after {time_s} s"));
        }
        if record.facts.activity == Activity::Walking {
            break;
        }
    }
    for (way, joint) in ways.iter().zip(&robot.joints) {
        if outside(way.range, way.last) > 0.0 {
            return Err(format!("{} stands at {}, outside {:?}", joint.name, way.last, way.range));
        }
    }
    if (torque - full).abs() > 0.001 {
        return Err(format!("stands with {torque} of its torque"));
    }
    let stands = controller.record(&slots).state.joints.iter().map(|joint| joint.position_rad);
    assert_stands(robot, plan, &stands.collect::<Vec<_>>(), 1e-3);
    Ok(ways.iter().filter(|way| way.began_outside).count())
}

/// Every foot is on its neutral point, to within `near_m`.
fn assert_stands(robot: &Robot, plan: &HorsePlan, angles: &[f64], near_m: f64) {
    for (leg, neutral) in plan.settings.legs.iter().zip(&plan.neutral_in_body) {
        let chain = &robot.chains[*leg];
        let tip = robot.tip_in_body(chain, angles[chain.joints.clone()].iter().copied());
        assert!(tip.distance(*neutral) < near_m, "foot of {} at {tip}, not {neutral}", chain.name);
    }
}

#[test]
fn a_thousand_limp_poses_end_in_the_stand() {
    for (file, poses) in ROBOTS.into_iter().zip([700, 300]) {
        let robot = shipped(file);
        let plan = plan(&robot, "walk", 0.9);
        let mut chance = Pcg64Mcg::seed_from_u64(9);
        let mut began_outside = 0;
        for number in 0..poses {
            let pose = random_pose(&robot, &mut chance);
            began_outside += get_up(&robot, &plan, &pose)
                .unwrap_or_else(|error| panic!("{file}, pose {number}: {error}\n{pose:?}"));
        }
        // Half of what is drawn lies beyond the ranges.
        let joints = robot.joints.len() * poses;
        assert!((0.4..0.6).contains(&(began_outside as f64 / joints as f64)), "{began_outside} of {joints}");
    }
}

#[test]
fn limp_poses_on_simulated_buses_end_in_the_stand() {
    for (file, poses) in ROBOTS.into_iter().zip(if is_full() { [40, 6] } else { [12, 2] }) {
        let robot = shipped(file);
        let mut chance = Pcg64Mcg::seed_from_u64(90);
        let mut scenario = Scenario::new(&robot, "walk", 1.0);
        for number in 0..poses {
            scenario.pose = Some(random_pose(&robot, &mut chance));
            scenario.seed = number;
            assert_stands_up(&robot, &scenario);
        }
    }
}

/// The same, checked on registers and shafts of simulated servos.
fn assert_stands_up(robot: &Robot, scenario: &Scenario<'_>) {
    let watched = scenario.watch_until(Activity::Walking);
    let pose = scenario.pose.as_deref().unwrap_or_default();
    let wakes = watched.first(|moment| moment.servos.iter().all(|servo| servo.torque_on));
    let wakes = wakes.unwrap_or_else(|| panic!("no torque"));
    let stands = watched.moments.iter().rfind(|moment| moment.activity == Activity::Standing);
    let stands = stands.unwrap_or_else(|| panic!("does not stand up from {pose:?}"));
    for (index, joint) in robot.joints.iter().enumerate() {
        let servo = servo(joint);
        let measured = servo.count_of(pose[index]);
        let first = wakes.servos[index];
        let goal = f64::from(first.goal);
        assert!(
            is_first_goal(goal_counts(joint), measured, goal),
            "{}: {first:?}, at {measured}",
            joint.name
        );
        assert!(
            f64::from(first.torque_limit) <= 0.02 * f64::from(servo.model.torque_limit_full),
            "{first:?}"
        );
        let mut way = Way::new(robot, joint, measured);
        let on = || watched.moments.iter().filter(|moment| moment.servos[index].torque_on);
        for moment in on() {
            let goal = f64::from(moment.servos[index].goal);
            if f64::from(moment.servos[index].torque_limit) < 0.004 * f64::from(servo.model.torque_limit_full)
            {
                // Next to no torque: a Dynamixel sets its goal to where it stands as its torque comes on, and takes ours
                // a cycle later.
                assert!(is_first_goal(way.range, measured, goal), "{}: {goal}, at {measured}", joint.name);
                way.last = goal;
                continue;
            }
            way.next(goal).unwrap_or_else(|error| panic!("{} at {} s: {error}", joint.name, moment.time_s));
        }
        let limits: Vec<i32> = on().map(|moment| moment.servos[index].torque_limit).collect();
        assert!(limits.is_sorted(), "{}: torque limits fall", joint.name);
        assert_eq!(limits.last(), Some(&i32::from(servo.model.torque_limit_full)), "{}", joint.name);
    }
    let angles: Vec<f64> = robot
        .joints
        .iter()
        .zip(&stands.servos)
        .map(|(joint, truth)| servo(joint).angle_of(truth.position))
        .collect();
    // Friction and dead band leave each joint some counts off.
    assert_stands(robot, &scenario.plan, &angles, 4e-3);
}
