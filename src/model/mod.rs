//! The robot as the program knows it: checked, in SI units, never changed after loading.
//!
//! Input: a robot file, through [`crate::config`]. Output: [`Robot`]. One schema serves horses,
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
pub(crate) use kinematics::ALMOST_INSIDE_RAD;
pub use pace::Pace;
pub use physics::{Foot, Ground, Physics, Step};
pub use posture::Posture;
pub use reflex::{Detector, FallDirection, GetUp, KeyPose, Lying, ReflexMode, ReflexSettings, YieldSettings};
pub use servo_model::{OVERLOAD_ALARM, Protocol, Registers, START_MIN_S, ServoModel};
pub use shared_range::{Axis, SharedRange};
pub use tendon::TendonDrive;
pub use tentacle::{
    ArmSettings, KeyInterpolation, PathError, Pole, TentacleMotion, TipPath, WAYPOINTS_MAX, WeightSupport,
};

/// A complete robot.
#[derive(Debug, Clone)]
pub struct Robot {
    /// Name, from the file.
    pub name: String,
    /// Cycles of the loop per second.
    pub rate_hz: f64,
    /// Mass of the trunk, kg.
    pub trunk_mass_kg: f64,
    /// Centre of mass of the trunk, body frame, m.
    pub trunk_center_m: DVec3,
    /// Limbs, in file order.
    pub chains: Vec<Chain>,
    /// All joints of all chains, in file order; [`Chain::joints`] gives each chain's range.
    pub joints: Vec<Joint>,
    /// Buses, in file order; empty for a robot that exists only on paper.
    pub buses: Vec<Bus>,
    /// The robot's kind of motion and its settings.
    pub motion: Motion,
    /// Limits that protect the robot.
    pub safety: SafetySettings,
    /// The body of the simulated robot; `None` if simulated joints turn freely.
    pub physics: Option<Physics>,
    /// True if the feet bear the robot's weight, as on every real robot; false if simulated joints turn freely.
    pub bears_weight: bool,
    /// How the robot balances on its feet; `None` if it does not. Acts only if the feet bear its weight.
    pub balance: Option<BalanceSettings>,
    /// The action it takes when it stops.
    pub stop_action: StopAction,
    /// The inertial measurement unit in its trunk; `None` if there is none.
    pub imu: Option<ImuSettings>,
    /// Its reaction to a fall; `None` if the file has no settings for it.
    pub reflex: Option<ReflexSettings>,
    /// How an arm reacts to a load beyond its limit; `None` if the file has no settings for it.
    pub yielding: Option<YieldSettings>,
}

impl Robot {
    /// Lowest supply voltage of a joint's servo, V; 0 for a joint without one.
    pub fn voltage_min_v(&self, joint: &Joint) -> f64 {
        joint.servo.map_or(0.0, |servo| self.buses[servo.bus].voltage_min_v)
    }

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
    /// Position of the first joint, body frame, m.
    pub root_m: DVec3,
    /// Rotation from the chain's own frame to the body frame.
    pub root_rotation: DQuat,
    /// Its joints, as indices into [`Robot::joints`]. On a tendon arm these are the winches, lift and sweep
    /// of each section, and their angles are the winches' turns.
    pub joints: Range<usize>,
    /// The tendon drive that bends it; `None` if each joint has its own servo.
    pub tendons: Option<TendonDrive>,
    /// The foot at its end, if any.
    pub foot: Option<Foot>,
}

/// A hinge and the link after it.
#[derive(Debug, Clone)]
pub struct Joint {
    /// Name: the chain's name, a dot and the joint's own, such as `left_hind.hip`.
    pub name: String,
    /// Turning axis in the parent link's frame, unit length; positive turns are right-handed about it.
    pub axis: DVec3,
    /// Vector from this joint to the next (or to the tip) at zero angle, in this joint's frame, m.
    pub link_m: DVec3,
    /// Lowest and highest angle, rad.
    pub range_rad: (f64, f64),
    /// Share of each CCD rotation that this joint takes, 0 < s <= 1 (thesis 3.2).
    pub stiffness: f64,
    /// Mass of the link, kg.
    pub mass_kg: f64,
    /// Centre of mass of the link, in this joint's frame, m.
    pub center_m: DVec3,
    /// Limits on the combined swing and twist of this hinge and those before it in the same place, in
    /// addition to their own ranges. Only the last of these hinges, which carries the link, has it.
    pub ball: Option<BallJoint>,
    /// The servo that turns it; `None` on a robot without buses.
    pub servo: Option<Servo>,
}

/// One servo and its mounting.
#[derive(Debug, Clone, Copy)]
pub struct Servo {
    /// Its model.
    pub model: &'static ServoModel,
    /// Index into [`Robot::buses`].
    pub bus: usize,
    /// Its id on that bus.
    pub id: ServoId,
    /// True if the count falls when the joint turns in the positive direction.
    pub reversed: bool,
    /// Count at joint angle zero; may lie outside the servo's own range. Without a unit file the program
    /// assumes that the middle of the joint's range is the middle of the servo's range.
    pub zero_count: f64,
    /// The firmware version at calibration, if the unit file gives it.
    pub firmware: Option<Firmware>,
}

/// A serial bus.
#[derive(Debug, Clone)]
pub struct Bus {
    /// Name, from the file.
    pub name: String,
    /// Its protocol.
    pub protocol: Protocol,
    /// Bits per second, at 10 bits per byte.
    pub baud: u32,
    /// Delay of the adapter: how much later than the wire it hands bytes over, microseconds.
    pub adapter_latency_us: u32,
    /// Delay of a servo's reply, microseconds.
    pub return_delay_us: u32,
    /// Lowest supply voltage, V; 0 without servos.
    pub voltage_min_v: f64,
    /// Resistance of the simulated supply, including wires and plugs, ohm.
    pub supply_ohm: f64,
}

/// The robot's motion; one variant for each kind of robot.
#[derive(Debug, Clone)]
pub enum Motion {
    /// A four-legged walker.
    Horse(HorseMotion),
    /// Arms that move like those of an octopus.
    Tentacle(TentacleMotion),
    /// A human figure on two feet.
    Figure(FigureMotion),
}

impl Motion {
    /// The chains it stands on, indices into [`Robot::chains`]; empty for arms on a base.
    pub fn legs(&self) -> &[usize] {
        match self {
            Motion::Horse(horse) => &horse.legs,
            Motion::Tentacle(_) => &[],
            Motion::Figure(figure) => &figure.legs,
        }
    }

    /// True if it stands on legs, and so may fall.
    pub fn is_on_legs(&self) -> bool {
        !self.legs().is_empty()
    }

    /// Share of its limbs' weight that water or a counterweight carries, 0 to 1.
    pub fn carried_share(&self) -> f64 {
        self.tentacle().map_or(0.0, |tentacle| tentacle.carried_share)
    }

    /// Height of the trunk at which hands hold the robot until it stands, m; `None` if it gets up by itself.
    pub fn held_height_m(&self) -> Option<f64> {
        self.figure().map(|figure| figure.stand_height_m)
    }

    /// The settings of a horse, if it is one.
    pub fn horse(&self) -> Option<&HorseMotion> {
        if let Motion::Horse(horse) = self { Some(horse) } else { None }
    }

    /// The settings of a robot with arms, if it is one.
    pub fn tentacle(&self) -> Option<&TentacleMotion> {
        if let Motion::Tentacle(tentacle) = self { Some(tentacle) } else { None }
    }

    /// The settings of a figure, if it is one.
    pub fn figure(&self) -> Option<&FigureMotion> {
        if let Motion::Figure(figure) = self { Some(figure) } else { None }
    }
}

/// The legs' order in every array of four: left hind, left fore, right hind, right fore.
pub const LEG_NAMES: [&str; 4] = ["left hind", "left fore", "right hind", "right fore"];

/// Settings of a horse.
#[derive(Debug, Clone)]
pub struct HorseMotion {
    /// Chains of the legs, in the order of [`LEG_NAMES`].
    pub legs: [usize; 4],
    /// Height of the body frame's origin above the ground when standing, m.
    pub stand_height_m: f64,
    /// Height of that origin when sitting, from which the robot stands up, m.
    pub sit_height_m: f64,
    /// Duration of a foot's swing, in every gait, s (thesis: P).
    pub swing_time_s: f64,
    /// Height of a foot in mid-swing, m.
    pub swing_lift_m: f64,
    /// Share of the swing in which the foot accelerates, and again that in which it slows down; 0 < r < 0.5.
    pub swing_ramp_share: f64,
    /// Largest acceleration of the trunk, and of every leg's plane in a turn, m/s^2.
    pub acceleration_m_s2: f64,
    /// Largest yaw rate of the trunk, rad/s.
    pub yaw_rate_max_rad_s: f64,
    /// The horse's gaits.
    pub gaits: Vec<Gait>,
}

/// A gait: when each foot is in swing (thesis 2.2, 3.3).
#[derive(Debug, Clone, PartialEq)]
pub struct Gait {
    /// Name used in files and options.
    pub name: String,
    /// Duty factor: share of the period that a foot is in stance, 0 < d < 1 (thesis: alpha).
    pub duty_factor: f64,
    /// Phase offset of each leg's lift-off as a share of the period, 0 <= phase offset < 1, in the order of [`LEG_NAMES`].
    pub phase_offsets: [f64; 4],
    /// How the trunk rises and falls in this gait.
    pub vertical_oscillation: VerticalOscillation,
    /// Froude number V^2 / (g h), h the standing height, above which a horse that chooses its gait by speed
    /// takes the next faster gait. `None` for a gait that is used only by name.
    pub auto_froude_max: Option<f64>,
}

/// How the trunk rises and falls about its mean height: a cosine over the stride.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VerticalOscillation {
    /// Height from lowest to highest point, m.
    pub rise_m: f64,
    /// Cycles per stride.
    pub per_stride: u32,
    /// Phase of its highest point: share of the stride since the left hind's lift-off.
    pub highest_at: f64,
}

/// Limits that hold whatever the motion requests.
#[derive(Debug, Clone)]
pub struct SafetySettings {
    /// Joint speed limit as a share of the servo's no-load speed, 0 < s <= 1.
    pub rate_share: f64,
    /// Joint acceleration limit, rad/s^2.
    pub acceleration_rad_s2: f64,
    /// Joint speed in start-up, in sitting, and while a joint outside its range is brought back in, rad/s.
    pub slow_rate_rad_s: f64,
    /// Torque limit while moving, share of stall torque, 0 < s <= 1.
    pub torque_share: f64,
    /// Time in which the torque limit rises from zero at start, s.
    pub torque_ramp_s: f64,
    /// The motion continues while a servo has been silent for no longer than this, s.
    pub coast_s: f64,
    /// A hold that lasts this long leads to the stop action, s.
    pub hold_s: f64,
    /// Largest difference between goal and measurement, rad.
    pub tracking_error_rad: f64,
    /// Time for which the tracking error, the temperature or the voltage may be wrong before the robot holds, s.
    pub fault_delay_s: f64,
    /// Highest servo temperature, degrees Celsius.
    pub temperature_c: f64,
    /// Response to a servo that raises an alarm.
    pub tripped_servo: TrippedServoPolicy,
}

/// Response to a servo that raises an alarm, which has often switched its torque off by itself, and to one
/// that is blocked, which would soon do so.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum TrippedServoPolicy {
    /// The robot holds, and stops if the fault does not clear.
    #[default]
    Stop,
    /// The joint is left without torque and the robot continues. Once it is parked, a servo that is in alarm
    /// is restarted, and the joint gets its torque back.
    Freeze,
}

/// The action a robot takes when it stops, for any reason.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StopAction {
    /// Keep the last pose, torque on.
    Hold,
    /// Sit down slowly (arms go to their parked pose), then torque off.
    SitThenLimp,
}

impl SafetySettings {
    /// Silence after which a servo may have restarted and may have missed the goals sent to it, s.
    pub fn lost_after_s(&self) -> f64 {
        self.coast_s.min(START_MIN_S)
    }
}
