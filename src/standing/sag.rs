//! Sag correction: joints on position servos give way under load, and their goals compensate for it.
//!
//! Input: the desired joint angles, the load on each foot, and the trunk's attitude. Output:
//! [`JointTargets::offset_rad`]. A servo turns its error into torque, so a joint that must hold a torque stands
//! off its goal by that torque over the servo's stiffness: the correction moves the goal by the same amount
//! to the other side. No goal leaves its joint's range for this; the other joints of a leg compensate, as far
//! as possible for the foot, what one joint cannot.

use glam::{DMat3, DQuat, DVec3, EulerRot};

use super::{Sole, Standing, TrunkMotion};
use crate::model::Robot;
use crate::signals::{JointTargets, State, Targets};

/// Time in which the correction is faded in once the robot is on its feet, s.
const FADE_S: f64 = 0.5;
/// Time constant of a change of load, applied twice so that no goal's speed jumps, s: in a trot one pair of
/// feet takes over from the other at once.
const SMOOTHING_S: f64 = 0.015;
/// Damping of the joints' compensation for others, m^2 of lever: keeps a stretched leg from jumping.
const DAMPING_M2: f64 = 1e-5;

/// The correction of one robot.
#[derive(Debug, Clone)]
pub struct Sag {
    standing: Standing,
    joints: Vec<SaggingJoint>,
    loads: Vec<f64>,
    /// Chains with a foot.
    legs: Vec<usize>,
    wanted_rad: Vec<f64>,
    /// Intermediate stage of the smoothing; the correction follows it.
    lead_rad: Vec<f64>,
    /// Share of the correction that is applied, 0 to 1.
    share: f64,
    lean_brake_hz: f64,
}

/// Data of a joint.
#[derive(Debug, Clone, Copy)]
struct SaggingJoint {
    range_rad: (f64, f64),
    /// Stiffness at a supply of 1 V, N m/rad, and the supply to assume if none is reported, V; `None` without
    /// a servo.
    stiffness: Option<(f64, f64)>,
}

impl Sag {
    /// The correction for `robot`; `None` if its file does not ask for it, its feet bear no weight, or it has no
    /// known foot.
    pub fn new(robot: &Robot) -> Option<Sag> {
        let balance = robot.balance.filter(|balance| balance.sag_correction && robot.bears_weight)?;
        let soles = Sole::all_of(robot);
        let joint = |joint: &crate::model::Joint| SaggingJoint {
            range_rad: joint.goal_range_rad(),
            stiffness: joint
                .servo
                .map(|servo| (servo.model.stiffness_nm_rad(1.0), servo.model.nominal_voltage_v)),
        };
        (!soles.is_empty()).then(|| Sag {
            standing: Standing::new(robot, &soles, balance.friction),
            joints: robot.joints.iter().map(joint).collect(),
            loads: vec![0.0; robot.chains.len()],
            legs: soles.iter().map(|sole| sole.chain).collect(),
            wanted_rad: vec![0.0; robot.joints.len()],
            lead_rad: vec![0.0; robot.joints.len()],
            share: 0.0,
            lean_brake_hz: balance.lean_brake_hz,
        })
    }

    /// Writes the correction for this cycle, `dt_s` after the last one. It is zero while the robot is off its
    /// feet: the next stage in charge starts from the last goals, which contain the correction.
    pub fn step(&mut self, dt_s: f64, targets: &Targets, state: &State, joints: &mut JointTargets) {
        let is_on_feet = !targets.feet().is_empty();
        if !is_on_feet || !joints.angles_rad.iter().all(|angle| angle.is_finite()) {
            self.share = 0.0;
            self.lead_rad.fill(0.0);
            joints.offset_rad.fill(0.0);
            return;
        }
        self.loads.fill(0.0);
        for foot in targets.feet() {
            self.loads[foot.chain] = foot.load_share;
        }
        let trunk = trunk(targets, state, self.lean_brake_hz);
        self.standing.solve(&joints.angles_rad, &trunk, &self.loads);
        self.work_out(joints, state);
        self.share = (self.share + dt_s / FADE_S).min(1.0);
        let pace = 1.0 - (-dt_s / SMOOTHING_S).exp();
        for (index, sag) in joints.offset_rad.iter_mut().enumerate() {
            let lead = &mut self.lead_rad[index];
            *lead += pace * (self.share * self.wanted_rad[index] - *lead);
            // The last correction may be too large for the joint's present angle.
            *sag = within(&self.joints[index], joints.angles_rad[index], *sag + pace * (*lead - *sag));
        }
    }

    /// Torques and forces of the last cycle.
    pub fn standing(&self) -> &Standing {
        &self.standing
    }

    fn work_out(&mut self, targets: &JointTargets, state: &State) {
        for (index, joint) in self.joints.iter().enumerate() {
            let angle = targets.angles_rad[index];
            let wanted = self.give_rad(index, joint, state);
            self.wanted_rad[index] = within(joint, angle, wanted);
        }
        for leg in 0..self.legs.len() {
            self.make_up(self.legs[leg], targets, state);
        }
    }

    /// How far a joint gives way, rad: its negative is the correction.
    fn give_rad(&self, index: usize, joint: &SaggingJoint, state: &State) -> f64 {
        let Some((per_volt, nominal_v)) = joint.stiffness else { return 0.0 };
        let measured = &state.joints[index];
        let supply_v = if measured.voltage_v > 0.0 { measured.voltage_v } else { nominal_v };
        self.standing.torques_nm()[index] / (per_volt * supply_v)
    }

    /// Makes the joints of a leg that have room correct the foot's remaining error from the others.
    fn make_up(&mut self, chain: usize, targets: &JointTargets, state: &State) {
        let posture = self.standing.posture();
        let tip = posture.tip(chain).0;
        let joints = posture.joints_of(chain);
        let (mut off_m, mut square) = (DVec3::ZERO, DMat3::from_diagonal(DVec3::splat(DAMPING_M2)));
        for index in joints.clone() {
            let lever = posture.lever(index, tip);
            let left_rad = self.give_rad(index, &self.joints[index], state) - self.wanted_rad[index];
            if left_rad.abs() > 0.0 {
                off_m += lever * left_rad;
            } else {
                square += DMat3::from_cols(lever * lever.x, lever * lever.y, lever * lever.z);
            }
        }
        if off_m.length() <= 0.0 {
            return;
        }
        let pull = square.inverse() * off_m;
        for index in joints {
            let joint = self.joints[index];
            let is_spent = (self.give_rad(index, &joint, state) - self.wanted_rad[index]).abs() > 0.0;
            if !is_spent {
                let more = posture.lever(index, tip).dot(pull);
                self.wanted_rad[index] =
                    within(&joint, targets.angles_rad[index], self.wanted_rad[index] + more);
            }
        }
    }
}

/// Attitude of the trunk: as measured, or as planned if it is unknown. A trunk that tips over should be braked: the
/// acceleration that holds the posture (the source's 4.1), beyond what stiff joints do by themselves.
fn trunk(targets: &Targets, state: &State, lean_brake_hz: f64) -> TrunkMotion {
    let (mut roll_rad, mut pitch_rad) = (state.body.roll_rad, state.body.pitch_rad);
    if !state.body.is_known {
        let turn: DQuat = targets.trunk_orientation;
        (_, pitch_rad, roll_rad) = turn.to_euler(EulerRot::ZYX);
    }
    let mut acceleration_m_s2 = DVec3::ZERO;
    if state.body.is_known && state.body.rate_rad_s.is_finite() {
        let rate = state.body.rate_rad_s;
        // On its soles the trunk moves in the direction of its turn.
        let speed_m_s = targets.trunk_in_world.z * DVec3::new(rate.y, -rate.x, 0.0);
        acceleration_m_s2 = -lean_brake_hz * speed_m_s;
    }
    TrunkMotion { roll_rad, pitch_rad, acceleration_m_s2 }
}

/// The part of a correction that leaves the goal in its range; it never pushes a joint further out.
fn within(joint: &SaggingJoint, angle_rad: f64, wanted_rad: f64) -> f64 {
    let (low, high) = joint.range_rad;
    wanted_rad.clamp((low - angle_rad).min(0.0), (high - angle_rad).max(0.0))
}
