//! What the legs know of the trunk: which feet stand, and how fast the trunk goes over them.

use glam::{DMat3, DQuat, DVec3};

use crate::model::{Foot, Posture, Robot, Servo};
use crate::signals::{FootTarget, JointState, State};

/// Standard gravity, m/s^2.
const GRAVITY_M_S2: f64 = 9.806_65;
/// Load from which a foot that is planned to stand does, as a share of what it carries where all feet stand; and to
/// where it still does.
const STANDS_SHARE: f64 = 0.25;
const STILL_STANDS_SHARE: f64 = 0.1;
/// The same of a foot that is planned to be in the air: what it takes to swing a leg is read as load too.
const STUMBLES_SHARE: f64 = 1.0;
/// Damping of the way from joint torques to foot force, m^2 of lever: legs of hinges side by side feel no sideways force.
const DAMPING_M2: f64 = 1e-5;
/// Time constant of the trunk's velocity, s: joint speeds are read in whole steps.
const SMOOTHING_S: f64 = 0.1;

/// The legs of one robot.
#[derive(Debug, Clone)]
pub struct Legs {
    posture: Posture,
    /// Each chain's foot, and the radius of its sole, m.
    soles_m: Vec<Option<f64>>,
    servos: Vec<Option<Servo>>,
    angles_rad: Vec<f64>,
    hold_nm: Vec<f64>,
    weight_n: f64,
}

impl Legs {
    /// Of `robot`.
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

    /// Updates contacts and velocity in `state` from its joints and how the trunk lies and turns, `dt_s` after the last
    /// time. `feet` are where each leg's foot is planned to be; none while nothing stands.
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
            let least = match (foot.is_swing, stood) {
                (true, _) => STUMBLES_SHARE,
                (false, true) => STILL_STANDS_SHARE,
                (false, false) => STANDS_SHARE,
            };
            let stands = share >= least;
            body.is_in_contact[foot.chain] = stands;
            if stands && !foot.is_swing {
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

    /// Force of the ground on a foot, body frame, N, that would explain what the motors of its leg hold beyond the leg.
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

    /// Velocity of the foot against the trunk, m/s.
    fn velocity_m_s(&self, chain: usize, at_m: DVec3, joints: &[JointState]) -> DVec3 {
        let of_joint = |index: usize| self.posture.lever(index, at_m) * joints[index].speed_rad_s;
        self.posture.joints_of(chain).map(of_joint).sum()
    }
}
