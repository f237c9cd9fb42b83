//! One episode, determined by a robot, a seed and the episode's number alone.

use hw_sim::FaultScript;
use hw_sim::faults::ScriptedFault;

use super::faults;
use super::subject::Subject;
use crate::model::{Robot, StopAction, TrippedServoPolicy};
use crate::motion::{Order, Plan};
use crate::random::RandomStream;

/// Share of the episodes that use physics if the robot has a body: they take the longest.
const PHYSICS_SHARE: f64 = 0.1;
/// Share of the episodes that begin in the sitting or parked pose, from which a robot gets up soon.
const SITS_SHARE: f64 = 0.7;
/// Time after an order to stop when an operator turns it into an emergency stop, s.
pub(super) const PATIENCE_S: f64 = 12.0;
/// Latest start of a fault after the order to stop, s: most robots lie limp by then.
const LATEST_S: f64 = 6.0;

/// One run: the robot's plan, its orders, and its faults.
#[derive(Debug, Clone)]
pub struct Episode {
    /// Its number in the series of its seed and robot.
    pub number: u64,
    /// Random seed of the simulated servos, buses and sensors.
    pub world_seed: u64,
    /// True with the body of the robot file; false with joints that turn freely.
    pub has_physics: bool,
    /// True if it begins in the sitting or parked pose; otherwise each joint begins anywhere.
    pub sits: bool,
    /// The robot's stop action.
    pub stop_action: StopAction,
    /// Response to a servo that trips.
    pub tripped_servo: TrippedServoPolicy,
    /// The motion if the order says no more than to go.
    pub plan: Plan,
    /// Duration of that motion, s.
    pub move_for_s: f64,
    /// Orders and their times, s of the run; in order of time.
    pub orders: Vec<Ordered>,
    /// Time of the order to stop, s of the run.
    pub end_s: f64,
    /// The faults.
    pub faults: Vec<ScriptedFault>,
}

/// An order and its time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ordered {
    /// Time since the run began, s.
    pub at_s: f64,
    /// The order from then on.
    pub order: Order,
}

impl Episode {
    /// Episode `number` in the series of `seed` and `subject`.
    pub fn draw(subject: &Subject, seed: u64, number: u64) -> Episode {
        let robot = subject.robot();
        let mut chance = RandomStream::new(seed ^ subject.stream(), number);
        let world_seed = chance.whole();
        let has_physics = chance.is(PHYSICS_SHARE) && robot.physics.is_some();
        let sits = chance.is(SITS_SHARE);
        let stop_action = if chance.is(0.75) { StopAction::SitThenLimp } else { StopAction::Hold };
        // Only arms can continue without a joint.
        let may_freeze = !robot.motion.is_on_legs();
        let tripped_servo =
            if may_freeze && chance.is(0.6) { TrippedServoPolicy::Freeze } else { TrippedServoPolicy::Stop };
        let end_s = if chance.is(0.2) { chance.between(0.3, 10.0) } else { chance.between(10.0, 30.0) };
        let plan = subject.kind().any_plan(robot, &mut chance);
        let move_for_s = chance.between(0.0, end_s);
        let orders = orders(&mut chance, subject, end_s);
        let faults = faults::draw(&mut chance, robot, has_physics, end_s + LATEST_S, end_s);
        Episode {
            number,
            world_seed,
            has_physics,
            sits,
            stop_action,
            tripped_servo,
            plan,
            move_for_s,
            orders,
            end_s,
            faults,
        }
    }

    /// The robot of this episode.
    pub fn robot(&self, subject: &Subject) -> Robot {
        let mut robot = subject.robot().clone();
        if !self.has_physics {
            (robot.physics, robot.bears_weight) = (None, false);
        }
        robot.stop_action = self.stop_action;
        robot.safety.tripped_servo = self.tripped_servo;
        robot
    }

    /// Its faults as a script.
    pub fn script(&self) -> FaultScript {
        FaultScript::of(self.faults.clone())
    }

    /// The operator's order at this time of the run, s.
    pub fn order_at(&self, time_s: f64) -> Order {
        let begun = self.orders.partition_point(|ordered| ordered.at_s <= time_s);
        let last = begun.checked_sub(1).and_then(|index| self.orders.get(index)).map(|ordered| ordered.order);
        let is_over = time_s >= self.end_s;
        match last {
            // A person who has ordered a stop does not take it back, but may grow impatient.
            _ if time_s >= self.end_s + PATIENCE_S => Order::StopAtOnce,
            Some(Order::StopAtOnce) => Order::StopAtOnce,
            Some(Order::Stop) => Order::Stop,
            _ if is_over => Order::Stop,
            Some(order) => order,
            None => Order::Go,
        }
    }
}

/// Orders other than the plan's, at random times; some end the run long before its end.
fn orders(chance: &mut RandomStream, subject: &Subject, end_s: f64) -> Vec<Ordered> {
    let mut orders = Vec::new();
    let mut at_s = 0.0;
    while orders.len() < 12 && chance.is(0.75) {
        // While the robot gets up, orders other than a stop do not matter.
        at_s += if orders.is_empty() { chance.between(0.0, 8.0) } else { chance.log_between(0.05, 8.0) };
        if at_s >= end_s {
            break;
        }
        let order = subject.kind().any_order(subject.robot(), chance);
        orders.push(Ordered { at_s, order });
    }
    if chance.is(0.15) {
        // At any time: while it gets up, moves, or sits down.
        let order = if chance.is(0.5) { Order::StopAtOnce } else { Order::Stop };
        let at_s = chance.between(0.0, end_s + 3.0);
        orders.retain(|ordered| ordered.at_s < at_s);
        orders.push(Ordered { at_s, order });
    }
    orders
}
