//! The robot as the program knows it: checked, in SI units, never changed after loading.
//!
//! Comes in: a robot file, through [`crate::config`]. Goes out: [`Robot`]. One schema serves horses,
//! tentacles and figures.

mod arm;
mod balance;
pub mod ball_joint;
mod figure;
mod firmware;
mod gait;
mod imu;
mod kinematics;
mod pace;
mod physics;
mod posture;
mod reflex;
pub mod segments;
pub mod servo_model;
mod shared_range;
pub mod tendon;
mod tentacle;

use std::ops::Range;

use glam::{DQuat, DVec3};

use crate::units::ServoId;
pub use arm::{
    ArmError, ArmGeometry, ArmJoint, Bending, GROUPS, diameter, hinges_in_place, is_ball_joint, link_length,
};
pub use balance::BalanceSettings;
pub use ball_joint::BallJoint;
pub use figure::{FigureMotion, FigurePose};
pub use firmware::Firmware;
pub use imu::{IMU_BAUDS, IMU_LINE, IMU_RATES_HZ, IMU_SAMPLE_BYTES, ImuNoise, ImuSettings};
pub use pace::Pace;
pub use physics::{Foot, Ground, Physics, Step};
pub use posture::Posture;
pub use reflex::{Detector, FallDirection, GetUp, KeyPose, Lying, ReflexMode, ReflexSettings, YieldSettings};
pub use servo_model::{OVERLOAD_ALARM, Protocol, Registers, START_MIN_S, ServoModel};
pub use shared_range::{Axis, SharedRange};
pub use tendon::TendonDrive;
pub use tentacle::{ArmSettings, Between, Carrier, PathError, Pole, TentacleMotion, TipPath, WAYPOINTS_MAX};

/// A whole robot.
#[derive(Debug, Clone)]
pub struct Robot {
    /// Name, from the file.
    pub name: String,
    /// Cycles of the loop per second.
    pub rate_hz: f64,
    /// Mass of the trunk, kg.
    pub trunk_mass_kg: f64,
    /// Centre of the trunk's mass in the body frame, m.
    pub trunk_center_m: DVec3,
    /// Limbs, in file order.
    pub chains: Vec<Chain>,
    /// All joints of all chains, in file order; [`Chain::joints`] says which are whose.
    pub joints: Vec<Joint>,
    /// Buses, in file order; none for a robot that exists only on paper.
    pub buses: Vec<Bus>,
    /// What it does.
    pub motion: Motion,
    /// What keeps it from harm.
    pub safety: SafetySettings,
    /// The body of the simulated robot; none where simulated joints turn freely.
    pub physics: Option<Physics>,
    /// True where its feet bear its weight, as those of every real robot do; false where simulated joints turn freely.
    pub bears_weight: bool,
    /// How it keeps its balance on its feet; none where it does not. Acts only where they bear its weight.
    pub balance: Option<BalanceSettings>,
    /// What it does when it stops.
    pub stop_action: StopAction,
    /// The inertial measurement unit in its trunk; none where it has none.
    pub imu: Option<ImuSettings>,
    /// What it does when it falls; none where the file says nothing.
    pub reflex: Option<ReflexSettings>,
    /// What an arm does that is loaded beyond its limit; none where the file says nothing.
    pub yielding: Option<YieldSettings>,
}

impl Robot {
    /// The same robot with joints that turn freely, as on simulated buses without a body.
    #[must_use]
    pub fn without_body(self) -> Robot {
        Robot { physics: None, bears_weight: false, ..self }
    }
}

/// A limb: joints from the body outwards.
#[derive(Debug, Clone)]
pub struct Chain {
    /// Name, from the file.
    pub name: String,
    /// Place of the first joint in the body frame, m.
    pub root_m: DVec3,
    /// Rotation from the chain's own frame to the body frame.
    pub root_rotation: DQuat,
    /// Its joints, as indices into [`Robot::joints`]; where tendons bend it, their winches, lift and sweep of each
    /// section, whose angles are the winches' turns.
    pub joints: Range<usize>,
    /// What bends it, where that is not a servo in every joint.
    pub tendons: Option<TendonDrive>,
    /// What it stands on, where it does.
    pub foot: Option<Foot>,
}

/// A hinge and the link behind it.
#[derive(Debug, Clone)]
pub struct Joint {
    /// Name: the chain's, a dot, the joint's own; `left_hind.hip`.
    pub name: String,
    /// Turning axis in the parent link's frame, unit length; positive turns are right-handed about it.
    pub axis: DVec3,
    /// From this joint to the next (or to the tip) at zero angle, in this joint's frame, m.
    pub link_m: DVec3,
    /// Lowest and highest angle, rad.
    pub range_rad: (f64, f64),
    /// Share of each turn CCD finds that this joint takes, 0 < s <= 1 (thesis 3.2).
    pub stiffness: f64,
    /// Mass of the link, kg.
    pub mass_kg: f64,
    /// Centre of the link's mass, in this joint's frame, m.
    pub center_m: DVec3,
    /// How far it may swing and twist together with the hinges before it in the same place, beyond their own ranges;
    /// only on the last of them, which carries the link.
    pub ball: Option<BallJoint>,
    /// The servo that turns it; none on a robot without buses.
    pub servo: Option<Servo>,
}

/// One servo in its place.
#[derive(Debug, Clone, Copy)]
pub struct Servo {
    /// What it is.
    pub model: &'static ServoModel,
    /// Index into [`Robot::buses`].
    pub bus: usize,
    /// Its address there.
    pub id: ServoId,
    /// True where a positive joint turn is a falling count.
    pub reversed: bool,
    /// Count at joint angle zero; may lie outside the servo's own range. Without a unit file the horn
    /// counts as mounted so that the middle of the joint's range is the middle of the servo's range.
    pub zero_count: f64,
    /// Firmware it was calibrated with, where the unit file says so.
    pub firmware: Option<Firmware>,
}

/// A serial bus.
#[derive(Debug, Clone)]
pub struct Bus {
    /// Name, from the file.
    pub name: String,
    /// Language.
    pub protocol: Protocol,
    /// Bits per second, 10 bits a byte.
    pub baud: u32,
    /// How much later than the wire the adapter hands bytes over, microseconds.
    pub adapter_latency_us: u32,
    /// How long a servo waits before it answers, microseconds.
    pub return_delay_us: u32,
    /// Resistance of the simulated supply with its wires and plugs, ohm.
    pub supply_ohm: f64,
}

/// What the robot does; one variant a kind of rig.
#[derive(Debug, Clone)]
pub enum Motion {
    /// A four-legged walker.
    Horse(HorseMotion),
    /// Arms that move like an octopus'.
    Tentacle(TentacleMotion),
    /// A human figure on two feet.
    Figure(FigureMotion),
}

impl Motion {
    /// The settings of a horse, if it is one.
    pub fn horse(&self) -> Option<&HorseMotion> {
        match self {
            Motion::Horse(horse) => Some(horse),
            Motion::Tentacle(_) | Motion::Figure(_) => None,
        }
    }

    /// The settings of a rig of arms, if it is one.
    pub fn tentacle(&self) -> Option<&TentacleMotion> {
        match self {
            Motion::Tentacle(tentacle) => Some(tentacle),
            Motion::Horse(_) | Motion::Figure(_) => None,
        }
    }

    /// The settings of a figure, if it is one.
    pub fn figure(&self) -> Option<&FigureMotion> {
        match self {
            Motion::Figure(figure) => Some(figure),
            Motion::Horse(_) | Motion::Tentacle(_) => None,
        }
    }
}

/// The legs' order in every array of four: left hind, left fore, right hind, right fore.
pub const LEG_NAMES: [&str; 4] = ["left hind", "left fore", "right hind", "right fore"];

/// Settings of a horse.
#[derive(Debug, Clone)]
pub struct HorseMotion {
    /// Chains that are the legs, in the order of [`LEG_NAMES`].
    pub legs: [usize; 4],
    /// Height of the body frame's origin above the ground when standing, m.
    pub stand_height_m: f64,
    /// The same when sitting, from which it stands up, m.
    pub sit_height_m: f64,
    /// Time a foot is in the air, every gait, s (thesis: P).
    pub swing_time_s: f64,
    /// Height of a foot in mid-swing, m.
    pub swing_lift_m: f64,
    /// Share of the swing time in which the foot gains, and again loses, its speed; 0 < r < 0.5.
    pub swing_ramp_share: f64,
    /// Largest acceleration of the trunk, and of every leg's plane in a turn, m/s^2.
    pub acceleration_m_s2: f64,
    /// Fastest turn of the trunk, rad/s.
    pub yaw_rate_max_rad_s: f64,
    /// The gaits it knows.
    pub gaits: Vec<Gait>,
}

/// A gait: who is in the air when (thesis 2.2, 3.3).
#[derive(Debug, Clone, PartialEq)]
pub struct Gait {
    /// Name used in files and options.
    pub name: String,
    /// Share of the period a foot stands, 0 < d < 1 (thesis: alpha).
    pub duty_factor: f64,
    /// Lift-off of each leg as a share of the period, 0 <= lag < 1, in the order of [`LEG_NAMES`].
    pub lags: [f64; 4],
    /// How the trunk rises and falls in it.
    pub bob: Bob,
    /// Where gaits are chosen by speed: the Froude number V^2 / (g h), h the standing height, above which a horse
    /// takes the next faster gait. None for a gait that is taken only by name.
    pub auto_froude_max: Option<f64>,
}

/// How the trunk rises and falls round its mean height: a cosine over the stride.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bob {
    /// From lowest to highest, m.
    pub rise_m: f64,
    /// How often in a stride.
    pub per_stride: u32,
    /// When it is highest: stride since the left hind's lift-off.
    pub highest_at: f64,
}

/// Limits that hold whatever the motion asks.
#[derive(Debug, Clone)]
pub struct SafetySettings {
    /// Joint speed limit as a share of the servo's no-load speed, 0 < s <= 1.
    pub rate_share: f64,
    /// Joint acceleration limit, rad/s^2.
    pub acceleration_rad_s2: f64,
    /// Joint speed while a joint outside its range is brought in, and in start-up and sitting, rad/s.
    pub slow_rate_rad_s: f64,
    /// Torque limit while moving, share of stall torque, 0 < s <= 1.
    pub torque_share: f64,
    /// Time in which the torque limit rises from nothing at start, s.
    pub torque_ramp_s: f64,
    /// A servo unheard for up to this long: the motion goes on, s.
    pub coast_s: f64,
    /// A hold that lasts this long ends in the stop action, s.
    pub hold_s: f64,
    /// Largest difference between goal and measurement, rad.
    pub tracking_error_rad: f64,
    /// How long the difference, the heat or the voltage may be wrong before the robot holds, s.
    pub fault_delay_s: f64,
    /// Highest servo temperature, degrees Celsius.
    pub temperature_c: f64,
    /// Lowest supply voltage, V.
    pub voltage_v: f64,
    /// What is done about a servo that raises an alarm.
    pub on_trip: OnTrip,
}

/// What is done about a servo that raises an alarm, which has often switched its torque off by itself, and about one
/// that is held up, which would soon.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum OnTrip {
    /// The robot holds, and stops if that does not pass.
    #[default]
    Stop,
    /// The joint is left without torque and the robot goes on; once it is parked, the servo is restarted
    /// if it is in alarm, and has its torque back.
    Freeze,
}

/// What the robot does when it stops, for whatever reason.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StopAction {
    /// Keep the last pose, torque on.
    Hold,
    /// Sit down slowly (arms go to where they are parked), then torque off.
    SitThenLimp,
}

impl SafetySettings {
    /// A servo unheard for longer than this, s, may have started again, and may not have heard the goals that were sent.
    pub fn lost_after_s(&self) -> f64 {
        self.coast_s.min(START_MIN_S)
    }
}
