//! One robot in one trial.

use std::time::Duration;

use glam::{DQuat, DVec3};
use hw_sim::body::{Push, PushFrame};
use hw_sim::{FaultScript, World};
use serde::{Serialize, Serializer};

use super::scene::PUSH_S;
use super::{Scene, TrialError};
use crate::bus::{Buses, SimPorts};
use crate::ik::Method;
use crate::model::{FallDirection, ReflexMode, Robot};
use crate::motion::{Activity, Order, Plan};
use crate::reflex::FallOutcome;
use crate::run::Cycle;
use crate::simulation;

/// A robot that does not stand by this time never will, s.
const STAND_BY_S: f64 = 20.0;
/// A robot that has not fallen this long after the push, and for which no fall is predicted, has kept its feet, s.
const KEPT_S: f64 = 2.0;
/// A robot whose fall was predicted is on the ground, or was let go of and lies, this long after the push, s.
const DOWN_S: f64 = 8.0;
/// Time for which the fall is observed after the trunk has hit the ground, s.
const AFTER_S: f64 = 1.0;
/// Loads and impacts are means over this time, s: shorter shocks come from the contact model, not the robot.
const WINDOW_S: f64 = 0.01;
/// Time between two poses of a track, s.
const POSE_EVERY_S: f64 = 0.05;

/// Outcome of a trial. Times in s since the push began.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Observed {
    /// Time when a fall was certain; `None` if it never was.
    pub predicted_s: Option<f64>,
    /// Its predicted direction at that time.
    #[serde(serialize_with = "direction_name")]
    pub direction: Option<FallDirection>,
    /// Time when the trunk hit the ground or was turned over; `None` if it never did.
    pub fallen_s: Option<f64>,
    /// Largest force of the ground on the trunk, mean over 10 ms, N.
    pub impact_n: f64,
    /// The same force on the head of a figure, N.
    pub head_impact_n: f64,
    /// Lean of the trunk when the fall was certain, degrees; `None` if it never was.
    pub told_at_deg: Option<f64>,
    /// Largest torque through the gears of any joint from when the fall was certain (from the push, if it
    /// never was): the motor's torque and that of its rotor's inertia; mean over 10 ms, N m.
    pub joint_load_nm: f64,
    /// Time of that torque.
    pub joint_load_s: f64,
    /// Outcome of the fall, as the robot saw it.
    pub outcome: FallOutcome,
    /// Poses since the push.
    #[serde(skip)]
    pub track: Vec<Snapshot>,
}

/// A pose.
#[derive(Debug, Clone, PartialEq)]
pub struct Snapshot {
    /// Time since the push began, s.
    pub time_s: f64,
    /// Origin of the body frame, world frame, m.
    pub position_m: DVec3,
    /// Rotation from the body frame to the world.
    pub turn: DQuat,
    /// Joint angles as the servos report them, rad.
    pub angles_rad: Vec<f64>,
    /// True while the trunk touches the ground.
    pub is_down: bool,
}

fn direction_name<S: Serializer>(of: &Option<FallDirection>, to: S) -> Result<S::Ok, S::Error> {
    of.map(FallDirection::name).serialize(to)
}

/// Impulses from the ground on the trunk, and through each joint, so far.
struct Impulses {
    at_s: f64,
    trunk_ns: f64,
    head_ns: f64,
    joints_nms: Vec<f64>,
}

impl Impulses {
    fn of(world: &World, head: Option<usize>) -> Impulses {
        let state = world.body();
        Impulses {
            at_s: Duration::from_nanos(world.now_ns()).as_secs_f64(),
            trunk_ns: state.map_or(0.0, |state| state.trunk_impulse_ns),
            head_ns: head
                .zip(state)
                .and_then(|(head, state)| state.chain_impulses_ns.get(head).copied())
                .unwrap_or_default(),
            joints_nms: state.map_or(Vec::new(), |state| state.joint_impulses_nms.clone()),
        }
    }

    /// Mean forces on trunk and head and largest mean joint torque since `before`, N and N m.
    fn since(&self, before: &Impulses) -> (f64, f64, f64) {
        let time_s = (self.at_s - before.at_s).max(1e-9);
        let joints = self.joints_nms.iter().zip(&before.joints_nms);
        let largest = joints.map(|(now, before)| (now - before).abs()).fold(0.0, f64::max);
        (
            (self.trunk_ns - before.trunk_ns) / time_s,
            (self.head_ns - before.head_ns) / time_s,
            largest / time_s,
        )
    }
}

/// Runs `scene` with `robot`, which reacts to falls in this `mode`.
///
/// # Errors
/// If the robot does not start or stand.
pub fn observe(
    robot: &Robot,
    plan: &Plan,
    scene: &Scene,
    mode: ReflexMode,
    is_tracked: bool,
) -> Result<Observed, TrialError> {
    let mut robot = robot.clone();
    if let Some(reflex) = &mut robot.reflex {
        reflex.mode = mode;
    }
    // The robot assumes the ground in its file, but stands on another.
    let mut on_ground = robot.clone();
    if let Some(physics) = &mut on_ground.physics {
        physics.ground.friction = scene.friction;
    }
    let robot = &robot;
    let head = robot.motion.figure().and_then(|figure| figure.head);
    let faults = FaultScript::default();
    let world = simulation::world_from_pose(&on_ground, plan.resting_pose_rad(), scene.world_seed, &faults)?;
    let mut buses = Buses::new(robot, SimPorts::on_virtual_clock(world));
    buses.prepare(robot)?;
    let plan = plan.clone().at_share(scene.gait, scene.speed_share);
    let mut cycle = Cycle::new(robot, plan, Method::CcdThenFinish, f64::INFINITY, buses);

    let start = cycle.now();
    let mut deadline = start;
    let (mut stood_s, mut push_s) = (None, None);
    let mut window: Option<Impulses> = None;
    let mut observed = Observed {
        predicted_s: None,
        direction: None,
        fallen_s: None,
        impact_n: 0.0,
        head_impact_n: 0.0,
        told_at_deg: None,
        joint_load_nm: 0.0,
        joint_load_s: 0.0,
        outcome: FallOutcome::None,
        track: Vec::new(),
    };
    loop {
        cycle.begin(deadline);
        cycle.step(Order::Go);
        deadline = deadline + Duration::from_secs_f64(robot.period_s());
        let time_s = deadline.since(start).as_secs_f64();
        let is_held = cycle.buses_mut().ports_mut().world().body().is_some_and(|body| body.is_held);
        if cycle.record().facts.activity == Activity::Standing && !is_held {
            stood_s.get_or_insert(time_s);
        }
        let Some(since_s) = stood_s.map(|stood_s| time_s - stood_s) else {
            if time_s > STAND_BY_S {
                return Err(TrialError::NeverStood(scene.number));
            }
            continue;
        };
        if push_s.is_none() && since_s >= scene.push_at_s {
            push_s = Some(time_s);
            let push = Push {
                force_n: scene.force_n(),
                frame: PushFrame::Trunk,
                place_m: robot.trunk_center_m.to_array(),
            };
            cycle.buses_mut().ports_mut().world_mut().push(push, PUSH_S);
        }
        let Some(pushed_s) = push_s.map(|push_s| time_s - push_s) else { continue };
        if let Some(report) = cycle.record().facts.falls {
            if report.falls > 0 && observed.predicted_s.is_none() {
                observed.predicted_s = Some(pushed_s);
                observed.direction = report.direction;
                let body = &cycle.record().state.body;
                observed.told_at_deg = Some(body.tilt_rad().to_degrees());
                // The effect of the push itself is the same in all modes.
                (observed.joint_load_nm, window) = (0.0, None);
            }
            observed.outcome = report.outcome;
        }
        let angles = || cycle.record().state.joints.iter().map(|joint| joint.position_rad);
        let angles_rad: Vec<f64> = if is_tracked { angles().collect() } else { Vec::new() };
        let world = cycle.buses_mut().ports_mut().world();
        let now = Impulses::of(world, head);
        let before = window.get_or_insert_with(|| Impulses::of(world, head));
        if now.at_s - before.at_s >= WINDOW_S - 1e-9 {
            let (impact_n, head_n, load_nm) = now.since(before);
            observed.head_impact_n = observed.head_impact_n.max(head_n);
            observed.impact_n = observed.impact_n.max(impact_n);
            if load_nm > observed.joint_load_nm {
                (observed.joint_load_nm, observed.joint_load_s) = (load_nm, pushed_s);
            }
            window = Some(now);
        }
        let Some(state) = world.body() else { continue };
        if state.is_fallen() {
            observed.fallen_s.get_or_insert(pushed_s);
        }
        let is_due = observed.track.last().is_none_or(|last| pushed_s - last.time_s >= POSE_EVERY_S - 1e-9);
        if is_tracked && is_due {
            observed.track.push(Snapshot {
                time_s: pushed_s,
                position_m: DVec3::from_array(state.position_m),
                turn: DQuat::from_array(state.rotation),
                angles_rad,
                is_down: state.trunk_contact_n > 0.0,
            });
        }
        let is_over = match observed.fallen_s {
            Some(fallen_s) => pushed_s >= fallen_s + AFTER_S,
            None if observed.predicted_s.is_some() => pushed_s >= DOWN_S,
            None => pushed_s >= KEPT_S,
        };
        if is_over {
            return Ok(observed);
        }
    }
}
