//! The seam where joint torque meets joint motion.
//!
//! In: the torque of every motor. Out: every shaft's new position and speed. [`FreeJoints`] turns each shaft
//! independently. A [`RigidBody`] couples them through links, masses, gravity and the ground, with the same
//! friction and reflected inertia, and gives the true state of the robot: a [`BodyState`].
//!
//! Between the geared motor and the output shaft is free play: the motor turns by the backlash before the
//! shaft, and the encoder on it, follow. In a rigid body the two are one.

mod config;
mod mass;
mod rigid;
mod state;

pub use config::{
    BallStop, BodyConfig, BodyError, Chain, Foot, Ground, JointMechanics, Link, ShaftLink, Step, Trunk,
};
pub use mass::Mass;
pub use rigid::RigidBody;
pub use state::{BodyState, FootState, Push, PushFrame};

/// One output shaft and the geared motor that turns it. All values are seen at the shaft.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ShaftState {
    /// Angle, rad; 0 at encoder count 0, positive where counts grow, not wrapped.
    pub position_rad: f64,
    /// Speed, rad/s.
    pub speed_rad_s: f64,
    /// Speed of motor and gears, rad/s.
    pub motor_speed_rad_s: f64,
    /// How far the geared motor is ahead of the shaft, rad; at most half the backlash either way.
    pub slack_rad: f64,
    /// Free play between them, rad, not negative.
    pub backlash_rad: f64,
    /// Inertia of rotor and gears, kg m².
    pub inertia_kg_m2: f64,
    /// Coulomb friction of the gearbox, N m, not negative.
    pub friction_nm: f64,
    /// Share of the external torque that a gearbox at rest holds by itself, 0 to 1.
    pub holding_share: f64,
    /// External torque on the shaft, N m, positive where counts grow.
    pub load_nm: f64,
    /// The shaft is jammed: it must not move in this step.
    pub is_stuck: bool,
}

/// Gears slower than this are at rest, rad/s: below it the friction measured on an STS3215 falls
/// (kscalelabs/sysid, STS_3215_12V_20250317, model M4).
const RESTING_RAD_S: f64 = 0.055;

impl ShaftState {
    /// A shaft at 0, still, without load or backlash.
    pub fn at_rest(inertia_kg_m2: f64, friction_nm: f64) -> ShaftState {
        ShaftState {
            position_rad: 0.0,
            speed_rad_s: 0.0,
            motor_speed_rad_s: 0.0,
            slack_rad: 0.0,
            backlash_rad: 0.0,
            inertia_kg_m2,
            friction_nm,
            holding_share: 0.0,
            load_nm: 0.0,
            is_stuck: false,
        }
    }

    /// Friction under the present load, N m.
    pub fn present_friction_nm(&self) -> f64 {
        let is_at_rest = self.motor_speed_rad_s.abs() < RESTING_RAD_S;
        self.friction_nm + if is_at_rest { self.holding_share * self.load_nm.abs() } else { 0.0 }
    }
}

/// The body that carries the shafts.
pub trait Body {
    /// Moves all shafts by `dt_s` seconds under motor torques (N m, one for each shaft, always in the same
    /// order).
    fn step(&mut self, dt_s: f64, shafts: &mut [ShaftState], torques: &[f64]);

    /// Applies an external force during the next step only. Does nothing if the joints carry nothing.
    fn push(&mut self, _push: &Push) {}

    /// Two hands take hold of the trunk and keep it level and in place over the ground, or let it go. They
    /// carry none of its weight. Does nothing if the joints carry nothing: there is no trunk.
    fn hold_trunk(&mut self, _is_held: bool) {}

    /// Two hands carry the trunk, level and no lower than `height_m` above the ground (its frame's origin,
    /// m). Once the motors have kept all joints still for a while, the hands set the robot down and let go
    /// when it stands.
    fn carry_trunk(&mut self, _height_m: f64) {}

    /// The true state of the robot; `None` if joints carry nothing.
    fn state(&self) -> Option<&BodyState> {
        None
    }
}

/// Every shaft turns independently: reflected inertia, friction and load, nothing else attached. A shaft
/// without load stays where it is while the motor turns through the backlash; a loaded one rests against the
/// flank of the gear.
#[derive(Debug, Clone, Copy, Default)]
pub struct FreeJoints;

impl Body for FreeJoints {
    fn step(&mut self, dt_s: f64, shafts: &mut [ShaftState], torques: &[f64]) {
        for (shaft, torque) in shafts.iter_mut().zip(torques) {
            step_shaft(dt_s, shaft, *torque);
        }
    }
}

fn step_shaft(dt_s: f64, shaft: &mut ShaftState, torque_nm: f64) {
    // A jam holds the load.
    let load_nm = if shaft.is_stuck { 0.0 } else { shaft.load_nm };
    let pushed = shaft.motor_speed_rad_s + dt_s * (torque_nm + load_nm) / shaft.inertia_kg_m2;
    // Friction removes speed but never reverses it; so slow gears stick.
    let lost = dt_s * shaft.present_friction_nm() / shaft.inertia_kg_m2;
    shaft.motor_speed_rad_s = pushed.signum() * (pushed.abs() - lost).max(0.0);
    let half = 0.5 * shaft.backlash_rad;
    let ahead = shaft.slack_rad + dt_s * shaft.motor_speed_rad_s;
    // The load keeps the shaft pressed ahead against the gears.
    let is_loaded = load_nm.abs() > 0.0;
    shaft.slack_rad = if is_loaded { half.copysign(-load_nm) } else { ahead.clamp(-half, half) };
    let way = ahead - shaft.slack_rad;
    if shaft.is_stuck {
        if way.abs() > 0.0 {
            shaft.motor_speed_rad_s = 0.0;
        }
        shaft.speed_rad_s = 0.0;
    } else {
        shaft.position_rad += way;
        shaft.speed_rad_s = way / dt_s;
    }
}
