//! One cycle of a run: the controller on its buses, with the clock.

use std::time::Duration;

use super::LATE_SHARE;
use crate::bus::{Buses, Ports, Slot};
use crate::cycle::Controller;
use crate::ik::Method;
use crate::imu::Imu;
use crate::model::Robot;
use crate::motion::{Generator, Order, Plan};
use crate::observe::{BusFacts, CycleRecord, CycleTimes, Facts};
use crate::signals::TrueBody;
use crate::stopwatch::{Stage, Stopwatch};
use crate::units::Time;

/// The controller on its buses, timed.
#[derive(Debug)]
pub struct Cycle<'r, P> {
    robot: &'r Robot,
    controller: Controller<'r>,
    buses: Buses<P>,
    slots: Vec<Slot>,
    imu: Imu,
    stopwatch: Stopwatch,
    bus_facts: Vec<BusFacts>,
    truth: Option<TrueBody>,
    /// Number and beginning of the last cycle, and its gap; `None` before the first.
    last: Option<(u64, Time, Duration)>,
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
            stopwatch: Stopwatch::new(),
            bus_facts: vec![BusFacts::default(); robot.buses.len()],
            truth: None,
            last: None,
        }
    }

    /// Waits until `deadline`, and begins a cycle: orders come next.
    pub fn begin(&mut self, deadline: Time) {
        let tolerance = Duration::from_secs_f64(LATE_SHARE * self.robot.period_s());
        self.buses.ports_mut().wait_until(deadline);
        self.stopwatch.begin(deadline, self.buses.ports_mut().now(), tolerance);
    }

    /// Runs one cycle, as ordered.
    pub fn step(&mut self, order: Order) {
        let began = self.now();
        let (number, gap) = match self.last {
            None => (0, Duration::from_secs_f64(self.robot.period_s())),
            Some((number, before, _)) => (number + 1, began.since(before)),
        };
        let gap_s = gap.as_secs_f64();
        self.stopwatch.note(Stage::Orders, began);

        let (stopwatch, buses) = (&mut self.stopwatch, &mut self.buses);
        let ended = |stage| stopwatch.note(stage, buses.ports_mut().now());
        let goals = self.controller.decide_timed(gap_s, order, ended);
        self.buses.exchange(goals, &mut self.slots);
        self.end_stage(Stage::Exchange);
        self.imu.read(self.buses.ports_mut());
        self.end_stage(Stage::Imu);
        self.controller.learn(gap_s, &self.slots, self.imu.reading());
        self.end_stage(Stage::Estimate);

        self.truth = self.buses.ports_mut().true_body();
        for (facts, bus) in self.bus_facts.iter_mut().zip(self.buses.statistics()) {
            *facts = bus.into();
        }
        self.last = Some((number, began, gap));
    }

    /// Notes that a stage has ended.
    pub fn end_stage(&mut self, stage: Stage) {
        let now = self.now();
        self.stopwatch.note(stage, now);
    }

    /// Notes that everything beside the pipeline is done too.
    pub fn end(&mut self) {
        let usage = self.buses.ports_mut().usage();
        self.stopwatch.end(usage);
    }

    /// Record of the last cycle, without what its operator saw.
    pub fn record(&self) -> CycleRecord<'_> {
        let record = self.controller.record(&self.slots);
        let (number, began, gap) = self.last.unwrap_or_default();
        let times = CycleTimes {
            number,
            began,
            gap,
            late: self.stopwatch.late(),
            work: self.stopwatch.work(),
            exchange: self.stopwatch.took(Stage::Exchange),
        };
        let facts = Facts { times, truth: self.truth, ..record.facts };
        CycleRecord { facts, buses: &self.bus_facts, ..record }
    }

    /// The time on the clock of the buses.
    pub fn now(&mut self) -> Time {
        self.buses.ports_mut().now()
    }

    /// The buses.
    pub fn buses_mut(&mut self) -> &mut Buses<P> {
        &mut self.buses
    }

    /// Number of cycles that are over.
    pub(super) fn cycles(&self) -> u64 {
        self.last.map_or(0, |(number, ..)| number + 1)
    }

    /// The times of its cycles.
    pub(super) fn stopwatch(&self) -> &Stopwatch {
        &self.stopwatch
    }

    /// Its generator and its buses, as they are at the end.
    pub(crate) fn into_parts(self) -> (Generator, Buses<P>) {
        (self.controller.into_generator(), self.buses)
    }
}
