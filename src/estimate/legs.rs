//! Estimates from the legs which feet stand, and how fast the trunk moves over them.

use glam::{DMat3, DQuat, DVec3};

use crate::model::{Foot, Posture, Robot, Servo};
use crate::signals::{FootTarget, JointState, State};

/// Standard gravity, m/s^2.
const GRAVITY_M_S2: f64 = 9.806_65;
/// Load from which a foot in planned stance does stand, and load down to which it still stands; both as a share of
/// its load when all feet stand.
const STANDS_SHARE: f64 = 0.25;
const STILL_STANDS_SHARE: f64 = 0.1;
/// Damping of the map from joint torques to foot force, m^2 of lever: legs of parallel hinges feel no sideways
/// force.
const DAMPING_M2: f64 = 1e-5;
/// Time constant of the trunk's velocity, s: joint speeds come in whole steps.
const SMOOTHING_S: f64 = 0.1;

/// The legs of one robot.
#[derive(Debug, Clone)]
pub struct Legs {
    posture: Posture,
    /// Sole radius of each chain's foot, m.
    soles_m: Vec<Option<f64>>,
    servos: Vec<Option<Servo>>,
    angles_rad: Vec<f64>,
    hold_nm: Vec<f64>,
    weight_n: f64,
}

impl Legs {
    /// The legs of `robot`.
    pub fn new(robot: &Robot) -> Legs {
        let radius_m = |foot: Foot| match foot {
            Foot::Round { radius_m, .. } => radius_m,
            Foot::Plate { .. } => foot.below_tip_m(),
        };
        let mass_kg = robot.trunk_mass_kg + robot.joints.iter().map(|joint| joint.mass_kg).sum::<f64>();
        Legs {
            posture: Posture::new(robot),
            soles_m: robot.chains.iter().map(|chain| chain.foot.map(radius_m)).collect(),
            servos: robot.joints.iter().map(|joint| joint.servo).collect(),
            angles_rad: vec![0.0; robot.joints.len()],
            hold_nm: vec![0.0; robot.joints.len()],
            weight_n: mass_kg * GRAVITY_M_S2,
        }
    }

    /// Updates contacts and velocity in `state` from its joints and the trunk's attitude and turn rate, `dt_s`
    /// after the last update. `feet` holds the planned position of each leg's foot; empty while nothing stands.
    pub fn update(&mut self, dt_s: f64, feet: &[FootTarget], state: &mut State) {
        if feet.is_empty() || !state.is_known() {
            state.body.is_in_contact.fill(false);
            state.body.velocity_m_s = DVec3::ZERO;
            return;
        }
        for (angle, joint) in self.angles_rad.iter_mut().zip(&state.joints) {
            *angle = joint.position_rad;
        }
        self.posture.bend(&self.angles_rad);
        let body = &mut state.body;
        let to_body =
            (DQuat::from_rotation_y(body.pitch_rad) * DQuat::from_rotation_x(body.roll_rad)).inverse();
        let up = to_body * DVec3::Z;
        self.posture.hold(-up * GRAVITY_M_S2, &mut self.hold_nm);
        let (mut sum_m_s, mut standing) = (DVec3::ZERO, 0.0);
        for foot in feet {
            let Some(radius_m) = self.soles_m.get(foot.chain).copied().flatten() else { continue };
            let at_m = self.posture.tip(foot.chain).0 - up * radius_m;
            let share =
                self.force_n(foot.chain, at_m, &state.joints).dot(up) / (self.weight_n / self.feet_count());
            let stood = body.is_in_contact[foot.chain];
            let least = if stood { STILL_STANDS_SHARE } else { STANDS_SHARE };
            // The load of swinging a leg is measured too, so in the air the plan decides.
            let stands = !foot.is_swing && share >= least;
            body.is_in_contact[foot.chain] = stands;
            if stands {
                sum_m_s -= body.rate_rad_s.cross(at_m) + self.velocity_m_s(foot.chain, at_m, &state.joints);
                standing += 1.0;
            }
        }
        if standing > 0.0 {
            let pace = 1.0 - (-dt_s / SMOOTHING_S).exp();
            body.velocity_m_s += pace * (sum_m_s / standing - body.velocity_m_s);
        }
    }

    fn feet_count(&self) -> f64 {
        self.soles_m.iter().flatten().map(|_| 1.0).sum()
    }

    /// Force of the ground on a foot, body frame, N, that would explain the motor torques beyond the leg's own
    /// weight.
    fn force_n(&self, chain: usize, at_m: DVec3, joints: &[JointState]) -> DVec3 {
        let (mut torque, mut square) = (DVec3::ZERO, DMat3::from_diagonal(DVec3::splat(DAMPING_M2)));
        for index in self.posture.joints_of(chain) {
            let Some(servo) = &self.servos[index] else { continue };
            let JointState { load_share, speed_rad_s, .. } = joints[index];
            let measured = servo.model.torque_nm(load_share, speed_rad_s);
            let lever = self.posture.lever(index, at_m);
            torque += lever * (self.hold_nm[index] - measured);
            square += DMat3::from_cols(lever * lever.x, lever * lever.y, lever * lever.z);
        }
        square.inverse() * torque
    }

    /// Velocity of the foot relative to the trunk, m/s.
    fn velocity_m_s(&self, chain: usize, at_m: DVec3, joints: &[JointState]) -> DVec3 {
        let of_joint = |index: usize| self.posture.lever(index, at_m) * joints[index].speed_rad_s;
        self.posture.joints_of(chain).map(of_joint).sum()
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test may panic")]

    use std::path::Path;

    use super::*;
    use crate::config;

    /// Force of the ground on each foot and velocity of the trunk, from joints that hold and turn accordingly.
    #[test]
    fn joints_show_which_feet_stand_and_the_trunk_velocity() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("config/horse.toml");
        let robot = config::load(&path).unwrap().robot;
        let (mut legs, mut state) = (Legs::new(&robot), State::new(&robot));
        let (force_n, velocity) = (DVec3::Z * 7.0, DVec3::new(0.1, 0.0, -0.02));
        // The left hind foot is in planned stance, but nothing presses on it; the right fore foot swings.
        let pressed = [0.0, 1.0, 1.0, 0.3];
        for (index, joint) in robot.joints.iter().enumerate() {
            state.joints[index] =
                JointState { is_known: true, position_rad: joint.middle_rad(), ..JointState::default() };
            legs.angles_rad[index] = joint.middle_rad();
        }
        legs.posture.bend(&legs.angles_rad);
        legs.posture.hold(-DVec3::Z * GRAVITY_M_S2, &mut legs.hold_nm);
        for (chain, press) in pressed.iter().enumerate() {
            let at_m = legs.posture.tip(chain).0 - DVec3::Z * 0.01;
            let levers: Vec<(usize, DVec3)> =
                legs.posture.joints_of(chain).map(|joint| (joint, legs.posture.lever(joint, at_m))).collect();
            let outer = |lever: DVec3| DMat3::from_cols(lever * lever.x, lever * lever.y, lever * lever.z);
            let across = DMat3::from_diagonal(DVec3::Y);
            let square = levers.iter().fold(across, |square, (_, lever)| square + outer(*lever));
            for (joint, lever) in levers {
                let model = robot.joints[joint].servo.unwrap().model;
                let torque_nm = legs.hold_nm[joint] - lever.dot(force_n * *press);
                let speed_rad_s = lever.dot(square.inverse() * -velocity);
                state.joints[joint].speed_rad_s = speed_rad_s;
                state.joints[joint].load_share =
                    torque_nm / model.stall_torque_nm + speed_rad_s / model.no_load_speed_rad_s;
            }
        }
        let feet: Vec<FootTarget> =
            (0..4).map(|chain| FootTarget { chain, is_swing: chain == 3, ..FootTarget::default() }).collect();
        for _ in 0..100 {
            legs.update(0.01, &feet, &mut state);
        }
        assert_eq!(state.body.is_in_contact, [false, true, true, false]);
        assert!((state.body.velocity_m_s - velocity).length() < 1e-3, "{}", state.body.velocity_m_s);
        legs.update(0.01, &[], &mut state);
        assert_eq!(state.body.is_in_contact, [false; 4]);
    }
}
