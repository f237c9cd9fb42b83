//! A standing or walking horse without buses: its controller at the loop's rate, and servos that reach their goals at
//! once. Every cycle is checked for everything that must always hold.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use hippocamp::cycle::Controller;
use hippocamp::ik::Method;
use hippocamp::model::Robot;
use hippocamp::motion::horse::{Drive, HorsePlan};
use hippocamp::motion::{Activity, Command, Order};
use hippocamp::observe::Observer;
use hippocamp::signals::{Permission, Slot};
use hippocamp::telemetry::Telemetry;

/// A foot's planned places, from one another, m: rounding of places some hundred metres away.
const ROUNDING_M: f64 = 1e-9;
/// Largest permitted residual of inverse kinematics, m.
const RESIDUAL_MAX_M: f64 = 1e-4;

/// The horse, and measurements of it.
pub(crate) struct OnFeet<'r> {
    pub(crate) robot: &'r Robot,
    controller: Controller<'r>,
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
            controller: Controller::new(robot, plan.clone(), Method::CcdThenFinish, f64::MAX),
            slots: vec![Slot::Missing; robot.joints.len()],
            telemetry: Telemetry::new(robot),
            interventions: 0,
            landed_s: [f64::NEG_INFINITY; 4],
            was_swing: [false; 4],
            shortest_stance_s: f64::INFINITY,
        };
        // It gets up first.
        while horse.controller.record(&horse.slots).facts.activity != Activity::Standing {
            horse.controller.learn_from_goals();
            horse.controller.decide(robot.period_s(), Order::Drive(Command::default()));
        }
        horse.controller.learn_from_goals();
        horse
    }

    pub(crate) fn drive(&self) -> &Drive {
        self.controller.generator().drive().unwrap()
    }

    /// One cycle.
    ///
    /// # Panics
    /// If something that must hold does not.
    pub(crate) fn step(&mut self, command: Command) {
        self.controller.decide(self.robot.period_s(), Order::Drive(command));
        self.judge(command);
        let record = self.controller.record(&self.slots);
        self.interventions += u64::from(record.facts.interventions);
        self.telemetry.observe(&record);
        self.controller.learn_from_goals();
    }

    fn judge(&mut self, command: Command) {
        let (record, drive) =
            (self.controller.record(&self.slots), self.controller.generator().drive().unwrap());
        let now_s = drive.now_s();
        let what = || format!("{command:?} at {now_s:.2} s");
        assert_eq!(record.state.permission, Permission::Move, "{}", what());
        for (joint, angle) in self.robot.joints.iter().zip(&record.joints.angles_rad) {
            let (low, high) = joint.range_rad;
            assert!((low..=high).contains(angle), "{} at {angle}: {}", joint.name, what());
        }
        let reach_m = drive.plan().reach.level.half_excursion_m;
        for (leg, foot) in record.targets.feet().iter().enumerate() {
            let residual_m = record.joints.residual_m[foot.chain];
            assert!(
                residual_m <= RESIDUAL_MAX_M,
                "leg {leg} misses by {residual_m} m, {foot:?}, trunk {} turned {:?}: {}",
                record.targets.trunk_in_world,
                record.targets.trunk_orientation.to_euler(glam::EulerRot::ZYX),
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
