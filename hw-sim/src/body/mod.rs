//! The seam where joint torque meets joint motion.
//!
//! In: the torque of every motor. Out: every shaft's new position and speed. [`FreeJoints`] turn each on its own;
//! a [`RigidBody`] couples them by links, masses, gravity and the ground, with the same friction and reflected
//! inertia, and knows the truth of the robot: a [`BodyState`].

mod config;
mod rigid;
mod state;

pub use config::{BodyConfig, BodyError, Chain, Foot, Ground, Link, ShaftLink, Step, Trunk};
pub use rigid::RigidBody;
pub use state::{BodyState, FootState, Push, PushFrame};

/// One output shaft.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ShaftState {
    /// Angle, rad; 0 at encoder count 0, positive where counts grow, not wrapped.
    pub position_rad: f64,
    /// Speed, rad/s.
    pub speed_rad_s: f64,
    /// Inertia of rotor and gears seen at the shaft, kg m².
    pub inertia_kg_m2: f64,
    /// Coulomb friction of the gearbox, N m, not negative.
    pub friction_nm: f64,
    /// The shaft is jammed: it must not move in this step.
    pub is_stuck: bool,
}

/// Whatever carries the shafts.
pub trait Body {
    /// Moves all shafts by `dt_s` seconds under motor torques (N m, one a shaft, same order, every step).
    fn step(&mut self, dt_s: f64, shafts: &mut [ShaftState], torques: &[f64]);

    /// A force from outside acts during the next step only. Joints that carry nothing do not feel it.
    fn push(&mut self, _push: &Push) {}

    /// What the robot truly does; none where joints carry nothing.
    fn state(&self) -> Option<&BodyState> {
        None
    }
}

/// Every shaft turns on its own: reflected inertia and friction, nothing attached.
#[derive(Debug, Clone, Copy, Default)]
pub struct FreeJoints;

impl Body for FreeJoints {
    fn step(&mut self, dt_s: f64, shafts: &mut [ShaftState], torques: &[f64]) {
        for (shaft, torque) in shafts.iter_mut().zip(torques) {
            if shaft.is_stuck {
                shaft.speed_rad_s = 0.0;
                continue;
            }
            let pushed = shaft.speed_rad_s + dt_s * torque / shaft.inertia_kg_m2;
            // Friction takes speed away but never turns it round; so a slow shaft sticks.
            let lost = dt_s * shaft.friction_nm / shaft.inertia_kg_m2;
            shaft.speed_rad_s = pushed.signum() * (pushed.abs() - lost).max(0.0);
            shaft.position_rad += dt_s * shaft.speed_rad_s;
        }
    }
}
