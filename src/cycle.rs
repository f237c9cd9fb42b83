//! One pass through the pipeline, top to bottom: `decide` from the state to goals, `learn` from replies to the state.

use crate::balance::Balance;
use crate::bus::Slot;
use crate::counts::{self, Goals};
use crate::estimate::{self, Estimator, Legs};
use crate::ik::{Limbs, Method};
use crate::model::Robot;
use crate::motion::horse::Drive;
use crate::motion::{Activity, Generator, Order, Plan};
use crate::observe::{CycleRecord, Facts};
use crate::reflex::{Control, Reflex};
use crate::safety::Safety;
use crate::signals::{ImuReading, JointTargets, Permission, State, Status, Targets};
use crate::standing::{Pacing, Sag};
use crate::stopwatch::Stage;
use crate::yielding::Yielding;

/// The stages before and after the buses, and the data they hand to each other, sized once from the robot: after
/// the first cycle, a cycle allocates nothing.
#[derive(Debug)]
pub struct Controller<'r> {
    robot: &'r Robot,
    reflex: Reflex<'r>,
    generator: Generator,
    balance: Balance,
    limbs: Limbs,
    /// `None` if sag correction is off, or no known load makes the joints sag.
    sag: Option<Sag>,
    pacing: Pacing,
    yielding: Yielding,
    safety: Safety,
    estimator: Estimator,
    legs: Legs,
    // Data that the stages hand to each other.
    targets: Targets,
    joints: JointTargets,
    goals: Goals,
    imu: ImuReading,
    state: State,
    // State of the last cycle.
    order: Order,
    is_held: bool,
    interventions: u32,
}

/// The stage that makes the targets of a cycle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Lead {
    /// The generator, as ordered.
    Generator,
    /// The generator, which stands still: safety holds the robot.
    HeldGenerator,
    /// The reflex, which has written them; the generator waits.
    Reflex,
}

impl<'r> Controller<'r> {
    /// A controller for a limp `robot` that follows `plan` for `move_for_s` when ordered to.
    pub fn new(robot: &'r Robot, plan: impl Into<Plan>, method: Method, move_for_s: f64) -> Self {
        Controller::with_generator(robot, Generator::new(robot, plan, move_for_s), method)
    }

    /// A controller for a limp `robot` that `generator` moves.
    pub fn with_generator(robot: &'r Robot, generator: Generator, method: Method) -> Self {
        Controller {
            robot,
            reflex: Reflex::new(robot),
            generator,
            balance: Balance::new(robot),
            limbs: Limbs::new(robot, method),
            sag: Sag::new(robot),
            pacing: Pacing::new(robot),
            yielding: Yielding::new(robot),
            safety: Safety::new(robot),
            estimator: Estimator::new(robot),
            legs: Legs::new(robot),
            targets: Targets::new(robot),
            joints: JointTargets::new(robot),
            goals: Goals::limp(robot),
            imu: ImuReading::default(),
            state: State::new(robot),
            order: Order::Go,
            is_held: false,
            interventions: 0,
        }
    }

    /// First half of a cycle that began `gap_s` after the one before: from the estimate to goals, as ordered.
    /// Motion advances by one period whatever the clock says: after a late cycle the robot continues
    /// from its present pose, instead of leaping to where it should have been.
    pub fn decide(&mut self, gap_s: f64, order: Order) -> &Goals {
        self.decide_timed(gap_s, order, |_| {})
    }

    /// Like [`Controller::decide`]; calls `ended` at the end of every stage.
    pub(crate) fn decide_timed(&mut self, gap_s: f64, order: Order, mut ended: impl FnMut(Stage)) -> &Goals {
        let dt_s = self.robot.period_s();
        self.obey(order);
        let lead = self.take_lead(dt_s);
        ended(Stage::Reflex);
        if lead != Lead::Reflex {
            self.generator.step(dt_s, &self.state, order, &mut self.targets);
        }
        ended(Stage::Generator);
        if lead == Lead::HeldGenerator {
            // A held generator leaves its targets unchanged, with the balance feedback already in them.
            self.limbs.hold(&self.targets, &mut self.joints);
        } else {
            self.balance.step(dt_s, self.generator.speed_m_s(), &self.state, &mut self.targets);
            ended(Stage::Balance);
            self.limbs.solve(&self.targets, &mut self.joints);
        }
        ended(Stage::Kinematics);
        match &mut self.sag {
            Some(sag) => sag.step(dt_s, &self.targets, &self.state, &mut self.joints),
            None => self.joints.offset_rad.fill(0.0),
        }
        self.pacing.step(dt_s, &self.targets, &self.state, &mut self.joints);
        ended(Stage::Sag);
        self.yielding.step(dt_s, &self.state, &mut self.joints);
        ended(Stage::Yielding);
        let command = self.safety.check(dt_s, gap_s, &self.joints, &mut self.state);
        self.interventions = command.interventions();
        ended(Stage::Safety);
        counts::goals(self.robot, command, &mut self.goals);
        ended(Stage::Counts);
        &self.goals
    }

    /// Second half of a cycle: from replies, one slot per joint, and the reading of the inertial measurement unit
    /// to the estimate.
    pub fn learn(&mut self, gap_s: f64, slots: &[Slot], imu: &ImuReading) {
        self.imu = *imu;
        self.estimator.update(self.robot, gap_s, slots, imu, &mut self.state);
        self.legs.update(gap_s, self.targets.feet(), &mut self.state);
    }

    /// The same for a robot without buses: every joint reaches its goal, and a limp joint stays put.
    pub fn learn_from_goals(&mut self) {
        estimate::at_goals(self.robot, &mut self.state);
    }

    /// Takes note of the order. An operator who wants to stop does not wait for a fault to pass; a fault that comes later
    /// may pass.
    fn obey(&mut self, order: Order) {
        let is_new = order != self.order;
        self.order = order;
        if order == Order::StopAtOnce || (order == Order::Stop && is_new) {
            self.safety.give_up_waiting(&mut self.state);
        }
        self.is_held = self.state.permission == Permission::Hold;
    }

    /// Has the reflex look at the robot, and decides who makes the targets of this cycle.
    fn take_lead(&mut self, dt_s: f64) -> Lead {
        // A robot that releases its joints may sink as it likes: that is no fall.
        let is_letting_go = self.generator.is_letting_go();
        let doing = if is_letting_go { Activity::Done } else { self.generator.activity() };
        let control = self.reflex.step(dt_s, self.order, doing, &self.state, &mut self.targets);
        if control == Control::Returned {
            self.generator.restart(&self.state);
        }
        match control {
            Control::Reflex => Lead::Reflex,
            Control::Operator | Control::Returned if self.is_held => Lead::HeldGenerator,
            Control::Operator | Control::Returned => Lead::Generator,
        }
    }

    /// Record of the last cycle, in which the buses answered with `slots`.
    pub fn record<'a>(&'a self, slots: &'a [Slot]) -> CycleRecord<'a> {
        let (generator, drive) = (&self.generator, self.generator.drive());
        CycleRecord {
            facts: Facts {
                order: self.order,
                activity: self.reflex.activity().unwrap_or_else(|| generator.activity()),
                gait: drive.and_then(Drive::gait),
                is_changing_gait: drive.is_some_and(Drive::is_changing_gait),
                stroke: generator.stroke(),
                pose: generator.pose(),
                speed_m_s: generator.speed_m_s(),
                yaw_rate_rad_s: drive.map_or(0.0, |drive| drive.velocity().yaw_rate_rad_s),
                imu: self.imu,
                is_held: self.is_held,
                interventions: self.interventions,
                cause: self.safety.cause(),
                servo_restarts: self.safety.restarts(),
                falls: self.reflex.report(),
                failed_rise: generator.failed_rise(),
                arm_yields: self.robot.yielding.map(|_| self.yielding.times()),
                ..Facts::limp(self.robot.period_s())
            },
            status: Status::LIMP,
            targets: &self.targets,
            joints: &self.joints,
            goals: self.goals.servos(),
            slots,
            state: &self.state,
            buses: &[],
        }
    }

    /// Its generator.
    pub fn generator(&self) -> &Generator {
        &self.generator
    }

    /// Its generator, as it is at the end.
    pub(crate) fn into_generator(self) -> Generator {
        self.generator
    }
}
