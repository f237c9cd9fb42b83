//! What one servo truly holds and does, for a judge who believes no reply.

use super::World;
use crate::bus::Bus;
use crate::config::Protocol;
use crate::registers::{dynamixel_x, feetech_sts};

/// One servo: its own registers and its shaft, whatever it says of them.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ServoTruth {
    /// Goal position register, counts.
    pub goal: i64,
    /// The last goal position a host wrote and the servo took, counts; a goal other than this is the servo's own: it holds
    /// where it stands, or has started anew. None before the first.
    pub goal_taken: Option<i64>,
    /// How many goals it has taken since power-up, those that changed nothing too.
    pub goals_taken: u64,
    /// What it took last was meant for another servo, since it takes another's id for its own, or was spoilt on the line and
    /// passed its sum all the same: no host could help it.
    pub is_misled: bool,
    /// Torque limit register, as the maker counts it.
    pub torque_limit: i64,
    /// Is the bridge closed?
    pub torque_on: bool,
    /// Angle of the shaft, encoder counts with their fraction, never wrapped.
    pub position_counts: f64,
    /// Motor torque before gearbox friction, N m.
    pub torque_nm: f64,
    /// It runs, takes its own id for its own, hears its line, and is heard: no adapter is out and no fault silences it.
    pub is_reachable: bool,
}

impl World {
    /// What a servo truly holds and does now, by its bus and its place there, both in the order of configuration; none if
    /// there is no such servo.
    pub fn truth(&self, bus: usize, place: usize) -> Option<ServoTruth> {
        let (line, index) = (self.buses.get(bus)?, self.index_of(bus, place)?);
        let (shaft, servo) = (self.shafts.get(index)?, line.servos.get(place)?);
        let (goal, limit) = match servo.model.protocol {
            Protocol::Dynamixel => (dynamixel_x::GOAL_POSITION, dynamixel_x::GOAL_PWM),
            Protocol::Feetech if servo.model.is_scs => (feetech_sts::GOAL_POSITION, feetech_sts::MAX_TORQUE),
            Protocol::Feetech => (feetech_sts::GOAL_POSITION, feetech_sts::TORQUE_LIMIT),
        };
        Some(ServoTruth {
            goal: servo.get(goal),
            goal_taken: servo.goal_taken,
            goals_taken: servo.goals_taken,
            is_misled: servo.is_misled,
            torque_limit: servo.get(limit),
            torque_on: servo.is_torque_on(),
            position_counts: shaft.position_rad * servo.model.counts_per_rad(),
            torque_nm: servo.motor.torque_nm,
            is_reachable: line.reaches(place, self.now_ns),
        })
    }
}

impl Bus {
    /// Whether a servo hears the host, and the host it.
    fn reaches(&self, place: usize, now_ns: u64) -> bool {
        let (id, servo) = (self.home_id(place), &self.servos[place]);
        servo.is_awake()
            && !self.is_unplugged(now_ns)
            && !self.faults.is_silent(now_ns, id)
            && self.faults.wrong_id(now_ns, id).is_none_or(|wrong_id| wrong_id == id)
            && self.is_tuned(servo)
    }
}
