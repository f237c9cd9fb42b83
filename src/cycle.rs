//! One pass through the pipeline, top to bottom.

use std::time::Duration;

use crate::balance::Balance;
use crate::bus::{Buses, Ports, Slot};
use crate::counts::{self, Goals};
use crate::estimate::{self, Estimator, Legs};
use crate::ik::{Limbs, Method};
use crate::imu::Imu;
use crate::model::Robot;
use crate::motion::{Activity, Generator, Order, Plan};
use crate::reflex::{Charge, Reflex, Yielding};
use crate::safety::Safety;
use crate::signals::{ImuReading, JointTargets, Permission, State, Targets, TrueBody};
use crate::standing::Sag;
use crate::telemetry::{CycleRecord, Stage, Telemetry};
use crate::units::Time;

/// The stages before and after the buses, and the data they hand to each other, sized once from the robot: after
/// the first cycle, a cycle allocates nothing.
#[derive(Debug)]
pub struct Controller<'r> {
    robot: &'r Robot,
    reflex: Reflex<'r>,
    generator: Generator,
    balance: Balance,
    limbs: Limbs,
    yielding: Yielding,
    /// `None` if sag correction is off, or no known load makes the joints sag.
    sag: Option<Sag>,
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
            yielding: Yielding::new(robot),
            sag: Sag::new(robot),
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
    fn decide_timed(&mut self, gap_s: f64, order: Order, mut ended: impl FnMut(Stage)) -> &Goals {
        let dt_s = self.robot.period_s();
        let is_new_order = order != self.order;
        self.order = order;
        if order == Order::StopAtOnce || (order == Order::Stop && is_new_order) {
            // An operator who wants to stop does not wait for a fault to pass. A fault that comes later may pass.
            self.safety.give_up_waiting(&mut self.state);
        }
        self.is_held = self.state.permission == Permission::Hold;
        // A robot that releases its joints may sink as it likes: that is no fall.
        let doing = if self.generator.is_letting_go() { Activity::Done } else { self.generator.activity() };
        let charge = self.reflex.step(dt_s, order, doing, &self.state, &mut self.targets);
        if charge == Charge::GivenBack {
            self.generator.begin_anew(&self.state);
        }
        ended(Stage::Reflex);
        if charge != Charge::Reflex {
            self.generator.step(dt_s, &self.state, order, &mut self.targets);
        }
        ended(Stage::Generator);
        if self.is_held && charge != Charge::Reflex {
            // A held generator leaves its targets unchanged, with the balance feedback already in them.
            self.limbs.hold(&self.targets, &mut self.joints);
        } else {
            self.balance.step(dt_s, self.generator.speed_m_s(), &self.state, &mut self.targets);
            ended(Stage::Balance);
            self.limbs.solve(&self.targets, &mut self.joints);
        }
        ended(Stage::Kinematics);
        if let Some(sag) = &mut self.sag {
            sag.step(dt_s, &self.targets, &self.state, &mut self.joints);
        }
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

    /// The generator, which makes the targets.
    pub fn generator(&self) -> &Generator {
        &self.generator
    }

    /// The robot's present activity.
    pub fn activity(&self) -> Activity {
        self.reflex.activity().unwrap_or_else(|| self.generator.activity())
    }

    /// The reflex, which watches for falls.
    pub fn reflex(&self) -> &Reflex<'r> {
        &self.reflex
    }

    /// Record of the last cycle, in which the buses answered with `slots`.
    pub fn record<'a>(&'a self, slots: &'a [Slot]) -> CycleRecord<'a> {
        CycleRecord {
            order: self.order,
            activity: self.activity(),
            speed_m_s: self.generator.speed_m_s(),
            targets: &self.targets,
            joints: &self.joints,
            goals: self.goals.servos(),
            slots,
            imu: &self.imu,
            state: &self.state,
            interventions: self.interventions,
            is_held: self.is_held,
            dt_s: self.robot.period_s(),
            truth: None,
        }
    }
}

/// When a cycle began and how long its parts took.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct CycleTimes {
    /// Number of cycles before it in this run.
    pub number: u64,
    /// When it began.
    pub began: Time,
    /// Time since the cycle before began; for the first cycle, one period.
    pub gap: Duration,
    /// Computing time, without the exchange.
    pub work: Duration,
    /// Time of the exchange; all buses run at the same time.
    pub exchange: Duration,
}

/// The controller on its buses, observed.
#[derive(Debug)]
pub struct Cycle<'r, P> {
    robot: &'r Robot,
    controller: Controller<'r>,
    buses: Buses<P>,
    slots: Vec<Slot>,
    imu: Imu,
    telemetry: Telemetry,
    truth: Option<TrueBody>,
    times: Option<CycleTimes>,
}

impl<'r, P: Ports> Cycle<'r, P> {
    /// A limp `robot` on `buses` that follows `plan` for `move_for_s` when ordered to.
    pub fn new(
        robot: &'r Robot,
        plan: impl Into<Plan>,
        method: Method,
        move_for_s: f64,
        buses: Buses<P>,
    ) -> Self {
        Cycle::with_generator(robot, Generator::new(robot, plan, move_for_s), method, buses)
    }

    /// A limp `robot` on `buses` that `generator` moves.
    pub fn with_generator(robot: &'r Robot, generator: Generator, method: Method, buses: Buses<P>) -> Self {
        Cycle {
            robot,
            controller: Controller::with_generator(robot, generator, method),
            buses,
            slots: vec![Slot::Missing; robot.joints.len()],
            imu: Imu::new(robot),
            telemetry: Telemetry::new(robot),
            truth: None,
            times: None,
        }
    }

    /// Runs one cycle, as ordered.
    pub fn step(&mut self, order: Order) {
        let began = self.buses.ports_mut().now();
        let (number, gap) = match self.times {
            None => (0, Duration::from_secs_f64(self.robot.period_s())),
            Some(before) => (before.number + 1, began.since(before.began)),
        };
        let gap_s = gap.as_secs_f64();

        let (telemetry, buses) = (&mut self.telemetry, &mut self.buses);
        telemetry.end_stage(Stage::Orders, began);
        let ended = |stage| telemetry.end_stage(stage, buses.ports_mut().now());
        let goals = self.controller.decide_timed(gap_s, order, ended);
        let decided = self.buses.ports_mut().now();
        self.buses.exchange(goals, &mut self.slots);
        let exchanged = self.buses.ports_mut().now();
        self.telemetry.end_stage(Stage::Exchange, exchanged);
        self.imu.read(self.buses.ports_mut());
        self.end_stage(Stage::Imu);
        self.controller.learn(gap_s, &self.slots, self.imu.reading());
        self.end_stage(Stage::Estimate);
        self.truth = self.buses.ports_mut().true_body();
        let record = CycleRecord { truth: self.truth, ..self.controller.record(&self.slots) };
        self.telemetry.observe(self.robot, &record);
        self.telemetry.observe_buses(self.buses.statistics());

        let ended = self.buses.ports_mut().now();
        self.telemetry.end_stage(Stage::Telemetry, ended);
        let work = decided.since(began) + ended.since(exchanged);
        self.telemetry.note_work(u64::try_from(work.as_micros()).unwrap_or(u64::MAX));
        self.times = Some(CycleTimes { number, began, gap, work, exchange: exchanged.since(decided) });
    }

    /// Notes that a stage has ended.
    fn end_stage(&mut self, stage: Stage) {
        let now = self.buses.ports_mut().now();
        self.telemetry.end_stage(stage, now);
    }

    /// Notes the end of the cycle's last stage: everything done beside the pipeline.
    pub fn end_cycle(&mut self) {
        self.end_stage(Stage::Recording);
        let usage = self.buses.ports_mut().usage();
        self.telemetry.end_cycle(usage);
    }

    /// Record of the last cycle.
    pub fn record(&self) -> CycleRecord<'_> {
        CycleRecord { truth: self.truth, ..self.controller.record(&self.slots) }
    }

    /// Times of the last cycle; all zero before the first.
    pub fn times(&self) -> CycleTimes {
        self.times.unwrap_or_default()
    }

    /// The generator, which makes the targets.
    pub fn generator(&self) -> &Generator {
        self.controller.generator()
    }

    /// The robot's present activity.
    pub fn activity(&self) -> Activity {
        self.controller.activity()
    }

    /// The reflex, which watches for falls.
    pub fn reflex(&self) -> &Reflex<'r> {
        self.controller.reflex()
    }

    /// The stage that watches the load of arms.
    pub fn yielding(&self) -> &Yielding {
        &self.controller.yielding
    }

    /// The estimated state of the robot.
    pub fn state(&self) -> &State {
        &self.controller.state
    }

    /// The targets and goals of the last cycle, for observers.
    pub fn goals(&self) -> &Goals {
        &self.controller.goals
    }

    /// The safety stage, with its findings.
    pub fn safety(&self) -> &Safety {
        &self.controller.safety
    }

    /// The observers.
    pub fn telemetry(&self) -> &Telemetry {
        &self.telemetry
    }

    /// The observers, to note the punctuality of the loop.
    pub fn telemetry_mut(&mut self) -> &mut Telemetry {
        &mut self.telemetry
    }

    /// The buses.
    pub fn buses(&self) -> &Buses<P> {
        &self.buses
    }

    /// Returns the buses.
    pub fn into_buses(self) -> Buses<P> {
        self.buses
    }

    /// The buses, to wait on their clock and to end the run.
    pub fn buses_mut(&mut self) -> &mut Buses<P> {
        &mut self.buses
    }
}
