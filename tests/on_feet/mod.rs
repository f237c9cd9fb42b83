//! A standing or walking horse without buses: generator, inverse kinematics and safety at the loop's rate, and
//! servos that are always at their goals. Every cycle is checked for everything that must always hold.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use hippocamp::counts::{self, Goals};
use hippocamp::ik::{Limbs, Method};
use hippocamp::model::Robot;
use hippocamp::motion::horse::{Drive, HorsePlan};
use hippocamp::motion::{Activity, Command, Order, posture_pull};
use hippocamp::observe::{CycleRecord, Facts, Observer};
use hippocamp::safety::Safety;
use hippocamp::signals::{JointState, JointTargets, Permission, Slot, State, Status, Targets};
use hippocamp::telemetry::Telemetry;

/// A foot's planned places, from one another, m: rounding of places some hundred metres away.
const ROUNDING_M: f64 = 1e-9;
/// Largest permitted residual of inverse kinematics, m.
const RESIDUAL_MAX_M: f64 = 1e-4;

/// The horse, and measurements of it.
pub(crate) struct OnFeet<'r> {
    pub(crate) robot: &'r Robot,
    pub(crate) drive: Drive,
    limbs: Limbs,
    safety: Safety,
    targets: Targets,
    joints: JointTargets,
    goals: Goals,
    state: State,
    slots: Vec<Slot>,
    pub(crate) telemetry: Telemetry<'r>,
    /// Number of goals that safety changed, summed over the cycles.
    pub(crate) interventions: u64,
    landed_s: [f64; 4],
    was_swing: [bool; 4],
    pub(crate) shortest_stance_s: f64,
}

impl<'r> OnFeet<'r> {
    /// Standing on its neutral points.
    pub(crate) fn new(robot: &'r Robot, plan: &HorsePlan) -> OnFeet<'r> {
        let mut horse = OnFeet {
            robot,
            drive: Drive::standing(plan.clone()),
            limbs: Limbs::new(robot, Method::CcdThenFinish),
            safety: Safety::new(robot),
            targets: Targets::new(robot),
            joints: JointTargets::new(robot),
            goals: Goals::limp(robot),
            state: State::new(robot),
            slots: vec![Slot::Missing; robot.joints.len()],
            telemetry: Telemetry::new(robot),
            interventions: 0,
            landed_s: [f64::NEG_INFINITY; 4],
            was_swing: [false; 4],
            shortest_stance_s: f64::INFINITY,
        };
        // The pose of the stand, in which the redundant joints have settled.
        horse.joints.angles_rad.copy_from_slice(&plan.sit_pose_rad);
        horse.targets.posture_pull = posture_pull(robot.period_s());
        for _ in 0..200 {
            horse.drive.write(plan.settings.stand_height_m, &mut horse.targets);
            horse.limbs.solve(&horse.targets, &mut horse.joints);
        }
        for (known, angle) in horse.state.joints.iter_mut().zip(&horse.joints.angles_rad) {
            *known = JointState {
                is_known: true,
                position_rad: *angle,
                voltage_v: 12.0,
                temperature_c: 30.0,
                ..JointState::default()
            };
        }
        horse
    }

    /// One cycle.
    ///
    /// # Panics
    /// If something that must hold does not.
    pub(crate) fn step(&mut self, command: Command) {
        let dt_s = self.robot.period_s();
        self.drive.step(dt_s, Some(command));
        self.drive.write(self.drive.plan().settings.stand_height_m, &mut self.targets);
        self.limbs.solve(&self.targets, &mut self.joints);
        let goals = self.safety.check(dt_s, dt_s, &self.joints, &mut self.state);
        let interventions = goals.interventions();
        self.interventions += u64::from(interventions);
        counts::goals(self.robot, goals, &mut self.goals);
        self.judge(command);
        for (known, goal) in self.state.joints.iter_mut().zip(&self.state.goal_rad) {
            known.position_rad = *goal;
        }
        let facts = Facts {
            order: Order::Drive(command),
            activity: Activity::Walking,
            speed_m_s: self.drive.velocity().speed_m_s,
            interventions,
            ..Facts::limp(dt_s)
        };
        self.telemetry.observe(&CycleRecord {
            facts,
            status: Status::LIMP,
            targets: &self.targets,
            joints: &self.joints,
            goals: self.goals.servos(),
            slots: &self.slots,
            state: &self.state,
            buses: &[],
        });
    }

    fn judge(&mut self, command: Command) {
        let now_s = self.drive.now_s();
        let what = || format!("{command:?} at {now_s:.2} s");
        assert_eq!(self.state.permission, Permission::Move, "{}", what());
        for (joint, angle) in self.robot.joints.iter().zip(&self.joints.angles_rad) {
            let (low, high) = joint.range_rad;
            assert!((low..=high).contains(angle), "{} at {angle}: {}", joint.name, what());
        }
        let reach_m = self.drive.plan().reach.level.half_excursion_m;
        for (leg, foot) in self.targets.feet().iter().enumerate() {
            let residual_m = self.joints.residual_m[foot.chain];
            assert!(
                residual_m <= RESIDUAL_MAX_M,
                "leg {leg} misses by {residual_m} m, {foot:?}, trunk {} turned {:?}: {}",
                self.targets.trunk_in_world,
                self.targets.trunk_orientation.to_euler(glam::EulerRot::ZYX),
                what()
            );
            assert!(foot.excursion_m.abs() <= reach_m + ROUNDING_M, "leg {leg}: {}", what());
            assert!(foot.in_world.is_finite() && foot.in_world.z >= -1e-9, "leg {leg}: {}", what());
            match (self.was_swing[leg], foot.is_swing) {
                (true, false) => self.landed_s[leg] = now_s,
                (false, true) => {
                    // Seen at most one cycle late at either end.
                    let stance_s = now_s - self.landed_s[leg] + self.robot.period_s();
                    self.shortest_stance_s = self.shortest_stance_s.min(stance_s);
                }
                _ => {}
            }
            self.was_swing[leg] = foot.is_swing;
        }
    }

    /// Checks of the whole run.
    pub(crate) fn assert_kept(&self) {
        let (joints, feet) = (self.telemetry.joints_report(), self.telemetry.feet_report().unwrap());
        assert_eq!((joints.range_violations, joints.rate_violations), (0, 0));
        assert!(feet.stance_slip_planned_max_m <= ROUNDING_M, "slip of {} m", feet.stance_slip_planned_max_m);
        assert!(feet.swing_velocity_jump_max_m_s <= 0.0, "jump of {} m/s", feet.swing_velocity_jump_max_m_s);
    }
}
