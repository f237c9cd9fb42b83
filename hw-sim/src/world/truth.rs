//! The true state of one servo, for a test that trusts no reply.

use super::World;
use crate::bus::Bus;
use crate::faults::FaultKind;

/// One servo: its own registers and its shaft, whatever it reports.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ServoTruth {
    /// Goal position register, counts.
    pub goal: i64,
    /// The last goal position that a host wrote and the servo accepted, counts. A goal other than this is the
    /// servo's own: it holds its position, or has restarted. `None` before the first.
    pub goal_taken: Option<i64>,
    /// Number of goals it has accepted since power-up, including those that changed nothing.
    pub goals_taken: u64,
    /// True if the last goal it accepted was meant for another servo, since it takes that one's id for its own, or
    /// was corrupted on the line and still passed the checksum: no host could prevent it.
    pub is_misled: bool,
    /// Torque limit register, in the maker's unit.
    pub torque_limit: i64,
    /// True if the bridge is closed.
    pub torque_on: bool,
    /// Angle of the shaft, encoder counts with their fraction, never wrapped.
    pub position_counts: f64,
    /// Motor torque before gearbox friction, N m.
    pub torque_nm: f64,
    /// True if it runs, knows its own id, hears its line, and is heard: no adapter is out and no fault silences it.
    pub is_reachable: bool,
}

impl World {
    /// The true present state of a servo, by its bus and its index there, both in the order of configuration;
    /// `None` if there is no such servo.
    pub fn truth(&self, bus: usize, place: usize) -> Option<ServoTruth> {
        let (line, index) = (self.buses.get(bus)?, self.index_of(bus, place)?);
        let (shaft, servo) = (self.shafts.get(index)?, line.servos.get(place)?);
        Some(ServoTruth {
            goal: servo.goal(),
            goal_taken: servo.goal_taken,
            goals_taken: servo.goals_taken,
            is_misled: servo.is_misled,
            torque_limit: servo.torque_limit(),
            torque_on: servo.is_torque_on(),
            position_counts: shaft.position_rad * servo.model.counts_per_rad(),
            torque_nm: servo.motor.torque_nm,
            is_reachable: line.reaches(place, self.now_ns),
        })
    }
}

impl Bus {
    /// True if a servo and the host hear each other.
    fn reaches(&self, place: usize, now_ns: u64) -> bool {
        let (id, servo) = (self.home_id(place), &self.servos[place]);
        servo.is_awake()
            && !self.is_unplugged(now_ns)
            && !self.faults.has(now_ns, id, FaultKind::Silent)
            && self.faults.wrong_id(now_ns, id).is_none_or(|wrong_id| wrong_id == id)
            && self.is_tuned(servo)
    }
}
