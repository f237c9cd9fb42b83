//! An arm without buses, and its possible strokes.
#![allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "counts and times are small")]

use glam::DVec3;
use hippocamp::cycle::Controller;
use hippocamp::ik::Method;
use hippocamp::kinds::tentacle::TentacleCapability;
use hippocamp::model::Robot;
use hippocamp::motion::tentacle::{TentaclePlan, strokes};
use hippocamp::motion::{Activity, Order, Stroke, StrokeCommand};
use hippocamp::signals::Permission;
use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::Rng;

/// A robot that does not come to rest within this time never does, s.
const WAKES_S: f64 = 60.0;

pub(crate) fn plan(robot: &Robot, command: StrokeCommand) -> TentaclePlan {
    let tentacle = robot.motion.tentacle().unwrap();
    TentacleCapability::of(robot, tentacle).plan(robot, tentacle, command)
}

/// Every stroke, with the targets that the robot file names.
pub(crate) fn strokes(robot: &Robot) -> Vec<Stroke> {
    let tentacle = robot.motion.tentacle().unwrap();
    let names = ["rest", "sway", "walk", "swim", "reach", "path", "wind"];
    names.into_iter().filter_map(|name| strokes::named(name, tentacle)).collect()
}

pub(crate) fn chance(source: &mut Pcg64Mcg) -> f64 {
    (source.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
}

/// An arm without buses: its servos reach their goals at once. Every cycle checks the goals.
pub(crate) struct Arm<'r> {
    robot: &'r Robot,
    pub(crate) controller: Controller<'r>,
    /// Goals of the last two cycles, newest first, rad.
    pub(crate) goals: [Vec<f64>; 2],
    pub(crate) interventions: u32,
    /// The least distance so far between two arms, or between one and the base, skin to skin, m.
    pub(crate) clearance_m: f64,
    cycles: u64,
    /// How often its range stopped a joint harder than its acceleration limit allows.
    pub(crate) hard_stops: u32,
}

/// Distances are checked once in this many cycles.
const CLEARANCE_EVERY: u64 = 3;

impl<'r> Arm<'r> {
    /// An arm that is awake and at rest.
    pub(crate) fn awake(robot: &'r Robot) -> Arm<'r> {
        let plan = plan(robot, StrokeCommand::default());
        let controller = Controller::new(robot, plan, Method::CcdThenFinish, f64::MAX);
        let goals = [vec![0.0; robot.joints.len()], vec![0.0; robot.joints.len()]];
        let mut arm = Arm {
            robot,
            controller,
            goals,
            interventions: 0,
            clearance_m: f64::INFINITY,
            cycles: 0,
            hard_stops: 0,
        };
        let rest = Order::Perform(StrokeCommand::default());
        let cycles = (WAKES_S * robot.rate_hz) as usize;
        assert!((0..cycles).any(|_| arm.cycle(rest) == Activity::Standing), "it never wakes");
        arm.interventions = 0;
        arm.clearance_m = f64::INFINITY;
        arm
    }

    pub(crate) fn cycle(&mut self, order: Order) -> Activity {
        self.controller.decide(self.robot.period_s(), order);
        self.controller.learn_from_goals();
        let record = self.controller.record(&[]);
        self.interventions += record.facts.interventions;
        self.goals.swap(0, 1);
        self.goals[0].copy_from_slice(&record.state.goal_rad);
        assert_ne!(record.state.permission, Permission::Stop);
        let activity = record.facts.activity;
        self.cycles += 1;
        if self.cycles.is_multiple_of(CLEARANCE_EVERY) {
            self.clearance_m = self.clearance_m.min(clearance_m(self.robot, &self.goals[0]));
        }
        activity
    }

    /// The distance that the robot file requires between arms, m.
    pub(crate) fn clearance_wanted_m(&self) -> f64 {
        self.robot.motion.tentacle().unwrap().clearance_m
    }

    /// Performs `command` for `for_s`. Asserts that every goal is in its range, and that every joint keeps its
    /// limits of speed and acceleration.
    pub(crate) fn perform(&mut self, command: StrokeCommand, for_s: f64) {
        let dt_s = self.robot.period_s();
        for _ in 0..(for_s * self.robot.rate_hz) as usize {
            let before = self.goals.clone();
            self.cycle(Order::Perform(command));
            for (index, joint) in self.robot.joints.iter().enumerate() {
                let now = self.goals[0][index];
                let (low, high) = joint.goal_range_rad();
                assert!((low - 1e-9..=high + 1e-9).contains(&now), "{}: {now} rad", joint.name);
                let (speed, speed_before) =
                    ((now - before[0][index]) / dt_s, (before[0][index] - before[1][index]) / dt_s);
                let most = self.robot.safety.rate_share * joint.no_load_speed_rad_s();
                assert!(speed.abs() <= most * (1.0 + 1e-9), "{}: {speed} rad/s", joint.name);
                let acceleration = (speed - speed_before) / dt_s;
                // Range outranks acceleration: a joint does not overrun its limit to stop gently. It may only stop.
                let stops = acceleration * speed_before < 0.0 && speed.abs() < speed_before.abs();
                let is_at_end = now <= low + 1e-9 || now >= high - 1e-9;
                let most = self.robot.safety.acceleration_rad_s2;
                if stops && is_at_end && acceleration.abs() > most {
                    self.hard_stops += 1;
                    continue;
                }
                assert!(acceleration.abs() <= most * (1.0 + 1e-6), "{}: {acceleration} rad/s2", joint.name);
            }
        }
        let wanted_m = self.clearance_wanted_m();
        assert!(self.clearance_m >= wanted_m, "{command:?}: {} m of {wanted_m} m", self.clearance_m);
    }
}

/// The least distance between two arms, or between one and the base, skin to skin, in this pose, m. It compares
/// points along the links, five per link, and skips pairs of points in two root groups, or in a root group and the
/// base.
pub(crate) fn clearance_m(robot: &Robot, goals: &[f64]) -> f64 {
    let tentacle = robot.motion.tentacle().unwrap();
    let arms: Vec<(f64, Vec<(bool, DVec3)>)> = tentacle
        .arms
        .iter()
        .map(|arm| {
            let chain = &robot.chains[arm.chain];
            let mut ends = robot.places_in_body(chain, goals[chain.joints.clone()].iter().copied());
            ends.dedup();
            let links = ends.len() - 1;
            let along = (0..5 * links).map(|part| {
                let (link, share) = (part / 5, (part % 5) as f64 / 5.0);
                (3 * link >= links, ends[link].lerp(ends[link + 1], share))
            });
            (arm.radius_m, along.chain([(true, ends[links])]).collect())
        })
        .collect();
    let mut least_m = f64::INFINITY;
    for (index, (radius_m, places)) in arms.iter().enumerate() {
        for (other_m, others) in &arms[index + 1..] {
            for (is_outer, place) in places {
                for (is_others_outer, other) in others {
                    if *is_outer || *is_others_outer {
                        least_m = least_m.min(place.distance(*other) - radius_m - other_m);
                    }
                }
            }
        }
        let Some(base_m) = tentacle.base_radius_m else { continue };
        for (_, place) in places.iter().filter(|(is_outer, _)| *is_outer) {
            least_m = least_m.min(place.distance(robot.trunk_center_m) - base_m - radius_m);
        }
    }
    least_m
}
