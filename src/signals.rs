//! What the stages of the pipeline hand to each other, and who computes it.
//!
//! Buffers are sized from the robot once; a stage writes into them and the next one reads.
//! Frames: `_in_body` is the trunk's frame, `_in_world` the ground's, in which the plan begins at x = 0;
//! both x forward, y left, z up, metres. Joint arrays are in the order of [`Robot::joints`], radians.

use glam::DVec3;

use crate::model::Robot;

/// What the generator asks for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Aim {
    /// No torque.
    Limp,
    /// Joint angles: [`Targets::pose_rad`].
    Pose,
    /// Tip places: [`Targets::tips_in_body`].
    Tips,
    /// The angle of this joint alone, in [`Targets::pose_rad`]; all others have no torque.
    Joint(usize),
}

/// Computed by the generator.
#[derive(Debug, Clone)]
pub struct Targets {
    /// Which of the fields below holds.
    pub aim: Aim,
    /// Joint angles, rad.
    pub pose_rad: Vec<f64>,
    /// Tip of each chain, body frame, m.
    pub tips_in_body: Vec<DVec3>,
    /// The planned place of the trunk, world frame, m.
    pub trunk_in_world: DVec3,
    /// Where each leg's foot is planned to be; empty while nothing walks.
    pub feet: Vec<FootTarget>,
    /// Share of the way to their neutral posture that joints to spare go in one cycle.
    pub posture_pull: f64,
}

/// A foot's plan at one moment.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct FootTarget {
    /// The chain whose tip it is, index into [`Robot::chains`].
    pub chain: usize,
    /// Planned place, world frame, m.
    pub in_world: DVec3,
    /// Forward distance from the neutral foot point, body frame, m.
    pub excursion_m: f64,
    /// True in the air.
    pub is_swing: bool,
    /// Largest acceleration of this stride's swing curve, m/s^2; 0 in stance.
    pub swing_acceleration_m_s2: f64,
}

/// Computed by inverse kinematics.
#[derive(Debug, Clone)]
pub struct JointTargets {
    /// True when no torque is asked for; the angles mean nothing then.
    pub is_limp: bool,
    /// Where only one joint is to have torque: which.
    pub only: Option<usize>,
    /// Joint angles, rad.
    pub angles_rad: Vec<f64>,
    /// What each chain's tip misses its target by, m; 0 where a pose was asked for.
    pub residual_m: Vec<f64>,
}

/// How far the robot may go on, as safety judged in the cycle before.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Permission {
    /// Everything is well.
    #[default]
    Move,
    /// Something is wrong: stand still and wait for it to pass.
    Hold,
    /// It did not pass: take the stop action.
    Stop,
}

/// What flows back: computed by the estimator, but for the last two fields, which are safety's.
#[derive(Debug, Clone)]
pub struct State {
    /// Each joint as last heard.
    pub joints: Vec<JointState>,
    /// Goals safety let through last, rad; only meaningful once torque was on.
    pub goal_rad: Vec<f64>,
    /// What safety permits.
    pub permission: Permission,
}

/// One joint as its servo last reported it.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct JointState {
    /// True once the servo has been heard at all.
    pub is_known: bool,
    /// Time since it was last heard, s.
    pub age_s: f64,
    /// Joint angle, rad.
    pub position_rad: f64,
    /// Joint speed, rad/s.
    pub speed_rad_s: f64,
    /// Load as a share of stall torque, -1 to 1.
    pub load_share: f64,
    /// Supply voltage, V.
    pub voltage_v: f64,
    /// Temperature, degrees Celsius.
    pub temperature_c: f64,
    /// The servo's alarm bits.
    pub alarms: u8,
}

impl Targets {
    /// Targets of a limp `robot`.
    pub fn new(robot: &Robot) -> Targets {
        Targets {
            aim: Aim::Limp,
            pose_rad: vec![0.0; robot.joints.len()],
            tips_in_body: vec![DVec3::ZERO; robot.chains.len()],
            trunk_in_world: DVec3::ZERO,
            feet: Vec::with_capacity(robot.chains.len()),
            posture_pull: 0.0,
        }
    }
}

impl JointTargets {
    /// Joint targets of a limp `robot`.
    pub fn new(robot: &Robot) -> JointTargets {
        JointTargets {
            is_limp: true,
            only: None,
            angles_rad: vec![0.0; robot.joints.len()],
            residual_m: vec![0.0; robot.chains.len()],
        }
    }
}

impl State {
    /// Nothing heard yet.
    pub fn new(robot: &Robot) -> State {
        State {
            joints: vec![JointState::default(); robot.joints.len()],
            goal_rad: vec![0.0; robot.joints.len()],
            permission: Permission::Move,
        }
    }

    /// True if every servo was heard in the last exchange.
    pub fn is_fresh(&self) -> bool {
        self.joints.iter().all(|joint| joint.is_known && joint.age_s <= 0.0)
    }

    /// True once every servo has been heard.
    pub fn is_known(&self) -> bool {
        self.joints.iter().all(|joint| joint.is_known)
    }
}
