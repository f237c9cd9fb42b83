//! The pipeline, once, top to bottom.

use crate::bus::{Buses, Ports, Slot};
use crate::counts::{self, Goals};
use crate::estimate;
use crate::ik::{Limbs, Method};
use crate::model::Robot;
use crate::motion::horse::HorsePlan;
use crate::motion::{Generator, Order};
use crate::safety::Safety;
use crate::signals::{JointTargets, Permission, State, Targets};
use crate::telemetry::{CycleRecord, Telemetry};
use crate::units::Time;

/// Everything a cycle needs, sized once from the robot: after the first, a cycle allocates nothing.
#[derive(Debug)]
pub struct Cycle<'r, P> {
    robot: &'r Robot,
    generator: Generator,
    limbs: Limbs,
    safety: Safety,
    buses: Buses<P>,
    telemetry: Telemetry,
    // What the stages hand to each other.
    targets: Targets,
    joints: JointTargets,
    goals: Goals,
    slots: Vec<Slot>,
    state: State,
    began: Option<Time>,
}

impl<'r, P: Ports> Cycle<'r, P> {
    /// A limp `robot` on `buses`, to walk as `plan` says for `walk_for_s` when ordered to.
    pub fn new(robot: &'r Robot, plan: HorsePlan, method: Method, walk_for_s: f64, buses: Buses<P>) -> Self {
        Cycle::with_generator(robot, Generator::new(robot, plan, walk_for_s), method, buses)
    }

    /// A limp `robot` on `buses`, moved by `generator`.
    pub fn with_generator(robot: &'r Robot, generator: Generator, method: Method, buses: Buses<P>) -> Self {
        Cycle {
            robot,
            generator,
            limbs: Limbs::new(robot, method),
            safety: Safety::new(robot),
            buses,
            telemetry: Telemetry::new(robot),
            targets: Targets::new(robot),
            joints: JointTargets::new(robot),
            goals: Goals::limp(robot),
            slots: vec![Slot::Missing; robot.joints.len()],
            state: State::new(robot),
            began: None,
        }
    }

    /// One cycle, as ordered. Motion goes on by one period whatever the clock says: after a late
    /// cycle the robot goes on from where it is, instead of leaping to where it should have been.
    pub fn step(&mut self, order: Order) {
        let dt_s = self.robot.period_s();
        let began = self.buses.ports_mut().now();
        let gap_s = self.began.map_or(dt_s, |before| began.since(before).as_secs_f64());
        self.began = Some(began);
        let is_held = self.state.permission == Permission::Hold;

        self.generator.step(dt_s, &self.state, order, &mut self.targets);
        self.limbs.solve(&self.targets, &mut self.joints);
        let command = self.safety.check(dt_s, gap_s, &self.joints, &mut self.state);
        counts::goals(self.robot, command, &mut self.goals);
        let interventions = command.interventions();
        let computed = self.buses.ports_mut().now();
        self.buses.exchange(&self.goals, &mut self.slots);
        let exchanged = self.buses.ports_mut().now();
        estimate::update(self.robot, gap_s, &self.slots, &mut self.state);
        self.telemetry.observe(
            self.robot,
            &CycleRecord {
                targets: &self.targets,
                joints: &self.joints,
                goals: &self.goals,
                state: &self.state,
                interventions,
                is_held,
                dt_s,
            },
        );

        self.telemetry.observe_buses(self.buses.statistics());

        let ended = self.buses.ports_mut().now();
        let work = computed.since(began) + ended.since(exchanged);
        self.telemetry.note_work(u64::try_from(work.as_micros()).unwrap_or(u64::MAX));
    }

    /// What the robot is doing.
    pub fn generator(&self) -> &Generator {
        &self.generator
    }

    /// What is known of the robot.
    pub fn state(&self) -> &State {
        &self.state
    }

    /// The targets and goals of the last cycle, for those who look on.
    pub fn goals(&self) -> &Goals {
        &self.goals
    }

    /// What safety found.
    pub fn safety(&self) -> &Safety {
        &self.safety
    }

    /// The observers.
    pub fn telemetry(&self) -> &Telemetry {
        &self.telemetry
    }

    /// The observers, to note how punctual the loop is.
    pub fn telemetry_mut(&mut self) -> &mut Telemetry {
        &mut self.telemetry
    }

    /// The buses.
    pub fn buses(&self) -> &Buses<P> {
        &self.buses
    }

    /// The buses, to wait on their clock and to end the run.
    pub fn buses_mut(&mut self) -> &mut Buses<P> {
        &mut self.buses
    }
}
