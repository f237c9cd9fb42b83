//! What the stages of the pipeline hand to each other, and who computes it.
//!
//! Buffers are sized from the robot once; a stage writes into them and the next one reads.
//! Frames: `_in_body` is the trunk's frame, `_in_world` the ground's, in which the plan begins at x = 0;
//! both x forward, y left, z up, metres. Joint arrays are in the order of [`Robot::joints`], radians.

mod activity;
mod order;
mod status;

use glam::{DQuat, DVec3};
use serde::{Deserialize, Serialize};

use crate::model::{Chain, GROUPS, Joint, Robot, TendonDrive};
pub use activity::Activity;
pub use order::{Command, GaitChoice, Order, Posture, Stroke, StrokeCommand};
pub use status::Status;

/// What the generator asks for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Aim {
    /// No torque.
    Limp,
    /// Joint angles: [`Targets::pose_rad`].
    Pose,
    /// Tip places: [`Targets::tips_in_body`].
    Tips,
    /// Places and turns of the soles of [`Targets::feet`]: [`Targets::tips_in_body`], [`Targets::sole_turns`]; of all other
    /// chains joint angles, [`Targets::pose_rad`].
    Soles,
    /// What each arm is to do: [`Targets::arms`].
    Arms,
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
    /// Share of the permitted torque that is asked for, 0 to 1.
    pub torque_share: f64,
    /// Tip of each chain, body frame, m.
    pub tips_in_body: Vec<DVec3>,
    /// Turn of the last link of each chain, body frame, from how it is at angle 0 of all joints.
    pub sole_turns: Vec<DQuat>,
    /// The planned place of the trunk, world frame, m.
    pub trunk_in_world: DVec3,
    /// The planned turn of the trunk, from the body frame to the world frame.
    pub trunk_turn: DQuat,
    /// Where each leg's foot is planned to be; empty while nothing walks.
    pub feet: Vec<FootTarget>,
    /// Share of the way to their neutral posture that joints to spare go in one cycle.
    pub posture_pull: f64,
    /// What the arm that each chain is, if it is one, is to do.
    pub arms: Vec<ArmTarget>,
    /// True while a servo that has tripped may be restarted: its joint may then hang as it likes.
    pub may_restart: bool,
}

/// Where places along one arm are to be.
#[derive(Debug, Clone, PartialEq)]
pub struct ArmTarget {
    /// Which of the fields below holds.
    pub aim: ArmAim,
    /// Ends of the arm's groups, body frame, m; the last is the tip.
    pub ends_in_body: [DVec3; GROUPS],
    /// Where the tip is to point, body frame, unit length.
    pub direction_in_body: DVec3,
    /// Ends of all links, root first, body frame, m.
    pub places_in_body: Vec<DVec3>,
    /// A line, by a point on it (m) and its direction, body frame, that the arm's suckers are to face, where its joints can
    /// twist: they are on the lower side, -z of each link.
    pub faced_in_body: Option<[DVec3; 2]>,
    /// Counts changes of what the arm does. When it is not what it was in the cycle before, the joints go over to the
    /// new targets from where they are and as fast as they are; what is new must begin at rest.
    pub change: u32,
}

/// Which places of an arm are asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ArmAim {
    /// The ends of its groups.
    #[default]
    Ends,
    /// Its tip alone.
    Tip,
    /// Its tip and where that points.
    TipAlong,
    /// The ends of all links.
    Places,
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
    /// Way of the plane its leg works in, fore and aft, since the walk began, m: a foot that stands falls behind
    /// the trunk by as much.
    pub plane_way_m: f64,
    /// True in the air.
    pub is_swing: bool,
    /// How much of its share of the weight it is to carry: 0 in the air, 1 while it stands; it changes smoothly before it
    /// lifts and after it lands.
    pub load_share: f64,
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
    /// Share of the permitted torque that is asked for, one a joint, 0 to 1.
    pub torque_shares: Vec<f64>,
    /// True while a servo that has tripped may be restarted.
    pub may_restart: bool,
    /// The first joint for which a target was asked that is not a number.
    pub not_finite: Option<usize>,
    /// Joint angles, rad.
    pub angles_rad: Vec<f64>,
    /// What is added to each angle to make the goal, so that the joint stands at the angle under its load, rad.
    pub sag_rad: Vec<f64>,
    /// What each chain's tip misses its target by, m; 0 where a pose was asked for.
    pub residual_m: Vec<f64>,
    /// What the ends of each arm's groups miss their targets by at most, m; 0 where others were asked for.
    pub group_residual_m: Vec<f64>,
    /// How many joints of each chain stand on a limit of their range; 0 where a pose was asked for.
    pub saturated: Vec<u32>,
}

/// How far the robot may go on, as safety judged in the cycle before.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Permission {
    /// Everything is well.
    #[default]
    Move,
    /// Something is wrong: stand still and wait for it to pass.
    Hold,
    /// It did not pass: take the stop action.
    Stop,
}

/// What flows back: computed by the estimator, but for what is permitted, let through and out of service, which is safety's.
#[derive(Debug, Clone)]
pub struct State {
    /// Each joint as last heard.
    pub joints: Vec<JointState>,
    /// Goals safety let through last, rad; only meaningful once torque was on.
    pub goal_rad: Vec<f64>,
    /// What safety permits.
    pub permission: Permission,
    /// Joints whose servo has tripped: they are left without torque, and their goals are where they are.
    pub is_out: Vec<bool>,
    /// The joint that was taken out of service in this cycle, if one was; of several, one a cycle.
    pub outage: Option<Outage>,
    /// How the trunk lies and moves.
    pub body: BodyEstimate,
}

/// What the inertial measurement unit (IMU) in the trunk last said, turned from its mounting to the body frame.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ImuReading {
    /// True once it has been heard.
    pub is_known: bool,
    /// Time since this was measured, s.
    pub age_s: f64,
    /// Turn rate of the trunk about its x, y and z, rad/s.
    pub rate_rad_s: DVec3,
    /// Acceleration less gravity, body frame, m/s^2; (0, 0, 9.81) level and at rest.
    pub specific_force_m_s2: DVec3,
    /// Roll, rad: about x, positive lowers the right side.
    pub roll_rad: f64,
    /// Pitch, rad: about y, positive lowers the nose.
    pub pitch_rad: f64,
    /// Yaw, rad: about z, positive to the left; from wherever the unit counts.
    pub yaw_rad: f64,
    /// Measurements that passed their checksums and were dropped, since no trunk can have moved so; since the run began.
    pub implausible: u64,
}

/// How the trunk lies and moves, as far as the robot can tell.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct BodyEstimate {
    /// True while the IMU's word is recent enough to act on. Else the robot counts as level and still.
    pub is_known: bool,
    /// Roll, pitch and yaw now, rad (as in [`ImuReading`]); yaw from wherever the unit counts.
    pub roll_rad: f64,
    /// See `roll_rad`.
    pub pitch_rad: f64,
    /// See `roll_rad`.
    pub yaw_rad: f64,
    /// The unit's yaw when it was first heard, rad, from which `yaw_rad` counts; none before.
    pub yaw_start_rad: Option<f64>,
    /// Turn rate, body frame, rad/s.
    pub rate_rad_s: DVec3,
    /// Velocity of the body frame's origin, body frame, m/s.
    pub velocity_m_s: DVec3,
    /// Which chains' tips stand on the ground, one a chain.
    pub is_in_contact: Vec<bool>,
}

/// What a simulated robot truly does, whatever it knows of that itself.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrueBody {
    /// Origin of the body frame, m; here and below in a world whose origin is on the ground under the start.
    pub position_m: DVec3,
    /// Turn from the body frame to the world.
    pub turn: DQuat,
    /// Velocity of the body frame's origin, m/s.
    pub velocity_m_s: DVec3,
    /// Height of that origin above the ground's plane, m.
    pub height_m: f64,
    /// Force of the ground on the trunk, N.
    pub trunk_contact_n: f64,
    /// The trunk lies on the ground or is turned over.
    pub is_fallen: bool,
}

/// One joint as its servo last reported it.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct JointState {
    /// True once the servo has been heard at all.
    pub is_known: bool,
    /// Time since it was last heard, s.
    pub age_s: f64,
    /// True if it has sent damaged replies since.
    pub is_damaged: bool,
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
    /// The servo's alarm bits, as they come with its replies.
    pub alarms: u8,
    /// Why there is an alarm, as far as is known: bits of [`crate::model::Registers::alarm_status`]. 0 while there is
    /// none or the servo has not said why.
    pub alarm_causes: u8,
    /// What its torque switch said, in the cycle after it was asked ([`Question::Torque`]).
    pub has_torque: Option<bool>,
    /// The goal it holds, rad, in the cycle after it was asked ([`Question::Goal`]).
    pub held_goal_rad: Option<f64>,
    /// True if its last reply passed its checksum and was dropped all the same, since no servo can have measured it.
    pub is_implausible: bool,
}

/// What all servos of one bus are asked in the place of their feedback, for one cycle: what no reply tells.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Question {
    /// Whether they have torque: one that has started anew has none.
    Torque,
    /// Why they raise an alarm.
    Alarms,
    /// Which goal position they hold: after a silence nobody knows which of the goals that were sent it heard.
    Goal,
}

/// What one servo answered to a [`Question`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Told {
    /// Whether it has torque.
    Torque(bool),
    /// Why it raises an alarm: the bits of [`crate::model::Registers::alarm_status`].
    Alarms(u8),
    /// Which goal position it holds, counts.
    Goal(i32),
}

/// A joint that was just taken out of service, so that the robot goes on without it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Outage {
    /// The joint.
    pub joint: usize,
    /// Why.
    pub cause: OutageCause,
}

/// Why a joint is left without torque.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OutageCause {
    /// Its servo raised an alarm: why, as in [`Told::Alarms`]; 0 where it did not say.
    Alarm(u8),
    /// It did not follow its goal.
    Jam,
}

/// What one servo is to do in this cycle, in its own counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ServoGoal {
    /// Torque off.
    #[default]
    Limp,
    /// Torque on.
    Move {
        /// Goal position, counts.
        position: i32,
        /// Torque limit, in units of [`crate::model::ServoModel::torque_limit_full`].
        torque_limit: u16,
    },
    /// Whatever it was told last: nothing is said to it. A servo that is not heard may have started anew; it must not
    /// find a goal with all its torque when it wakes.
    Keep,
}

/// A servo's reply, in its own counts and register units; [`crate::counts`] turns it into SI units.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Feedback {
    /// Present position, counts; already sign-decoded.
    pub position: i32,
    /// Present speed, the model's speed unit; already sign-decoded.
    pub speed: i32,
    /// Present load (Feetech: 0.1 % of full duty; Dynamixel: the model's current unit); sign-decoded.
    pub load: i32,
    /// Supply voltage, 0.1 V.
    pub voltage_decivolt: u16,
    /// Temperature, degrees Celsius.
    pub temperature_c: u8,
    /// Alarm bits as they stood in the reply: Feetech's status byte; Dynamixel's alert bit (0x80).
    pub alarms: u8,
}

/// The result of one exchange for one servo. One slot a servo: a lost reply never discards the others.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Slot {
    /// A valid reply of this exchange.
    Fresh(Feedback),
    /// The answer to what was asked in the place of feedback.
    Told(Told),
    /// Bytes of a reply came, but did not pass their checksum or had the wrong shape.
    Corrupt,
    /// Nothing came before the deadline.
    #[default]
    Missing,
}

impl Slot {
    /// Whether a valid reply came.
    pub fn is_good(&self) -> bool {
        matches!(self, Slot::Fresh(_) | Slot::Told(_))
    }
}

impl Targets {
    /// Targets of a limp `robot`.
    pub fn new(robot: &Robot) -> Targets {
        Targets {
            aim: Aim::Limp,
            pose_rad: vec![0.0; robot.joints.len()],
            torque_share: 1.0,
            tips_in_body: vec![DVec3::ZERO; robot.chains.len()],
            sole_turns: vec![DQuat::IDENTITY; robot.chains.len()],
            trunk_in_world: DVec3::ZERO,
            trunk_turn: DQuat::IDENTITY,
            feet: Vec::with_capacity(robot.chains.len()),
            posture_pull: 0.0,
            may_restart: false,
            arms: robot.chains.iter().map(|chain| ArmTarget::new(chain, robot.joints_of(chain))).collect(),
        }
    }
}

impl ArmTarget {
    /// For `chain`, which has these joints, a target at the body frame's origin.
    pub fn new(chain: &Chain, joints: &[Joint]) -> ArmTarget {
        let hinged = || joints.iter().filter(|joint| joint.link_m.length() > 0.0).count();
        let links = chain.tendons.as_ref().map_or_else(hinged, TendonDrive::links);
        ArmTarget {
            aim: ArmAim::Ends,
            ends_in_body: [DVec3::ZERO; GROUPS],
            direction_in_body: DVec3::X,
            places_in_body: vec![DVec3::ZERO; links],
            faced_in_body: None,
            change: 0,
        }
    }
}

impl JointTargets {
    /// Joint targets of a limp `robot`.
    pub fn new(robot: &Robot) -> JointTargets {
        JointTargets {
            is_limp: true,
            only: None,
            torque_shares: vec![1.0; robot.joints.len()],
            may_restart: false,
            not_finite: None,
            angles_rad: vec![0.0; robot.joints.len()],
            sag_rad: vec![0.0; robot.joints.len()],
            residual_m: vec![0.0; robot.chains.len()],
            group_residual_m: vec![0.0; robot.chains.len()],
            saturated: vec![0; robot.chains.len()],
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
            is_out: vec![false; robot.joints.len()],
            outage: None,
            body: BodyEstimate { is_in_contact: vec![false; robot.chains.len()], ..BodyEstimate::default() },
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
