//! One cycle by value, in memory that is allocated once.

use glam::{DQuat, DVec3};

use crate::bus::{ServoGoal, Slot};
use crate::model::{Chain, Robot};
use crate::observe::{BusFacts, CycleRecord, Facts};
use crate::signals::{JointTargets, State, Status, Targets};

/// A [`CycleRecord`] by value, without what the operator saw.
#[derive(Debug, Clone)]
pub struct Sample {
    /// Its plain values.
    pub facts: Facts,
    /// The generator's targets.
    pub targets: Targets,
    /// The result of inverse kinematics.
    pub joints: JointTargets,
    /// The goal registers that were sent, one per joint.
    pub goals: Vec<ServoGoal>,
    /// The replies of the servos, one slot per joint.
    pub slots: Vec<Slot>,
    /// The estimated state of the robot after the exchange.
    pub state: State,
    /// Each bus.
    pub buses: Vec<BusFacts>,
}

impl Sample {
    /// An empty sample for `robot`.
    pub fn new(robot: &Robot) -> Sample {
        Sample {
            facts: Facts::limp(robot.period_s()),
            targets: Targets::new(robot),
            joints: JointTargets::new(robot),
            goals: vec![ServoGoal::Limp; robot.joints.len()],
            slots: vec![Slot::Missing; robot.joints.len()],
            state: State::new(robot),
            buses: vec![BusFacts::default(); robot.buses.len()],
        }
    }

    /// Copies a cycle of the same robot. Allocates nothing.
    pub fn copy_from(&mut self, cycle: &CycleRecord<'_>) {
        self.facts = cycle.facts;
        self.targets.clone_from(cycle.targets);
        self.joints.clone_from(cycle.joints);
        self.goals.copy_from_slice(cycle.goals);
        self.slots.copy_from_slice(cycle.slots);
        self.state.clone_from(cycle.state);
        self.buses.iter_mut().zip(cycle.buses).for_each(|(bus, seen)| *bus = *seen);
    }

    /// The cycle, as the observers see it.
    pub fn record(&self) -> CycleRecord<'_> {
        CycleRecord {
            facts: self.facts,
            status: Status::LIMP,
            targets: &self.targets,
            joints: &self.joints,
            goals: &self.goals,
            slots: &self.slots,
            state: &self.state,
            buses: &self.buses,
        }
    }

    /// Positions of the joints and the tip of each chain of `robot` at the measured angles, body frame, m.
    pub fn limbs_in_body(&self, robot: &Robot) -> Vec<Vec<DVec3>> {
        let limb = |chain: &Chain| {
            let joints = &self.state.joints[chain.joints.clone()];
            robot.places_in_body(chain, joints.iter().map(|joint| joint.position_rad))
        };
        robot.chains.iter().map(limb).collect()
    }

    /// Position, m, and orientation to draw the trunk of `robot`: its true pose if known, else the planned one.
    /// While nothing is planned, its lowest part lies on the ground.
    pub fn trunk_in_world(&self, robot: &Robot) -> (DVec3, DQuat) {
        if let Some(truth) = &self.facts.truth {
            return (truth.position_m, truth.orientation);
        }
        (self.planned_trunk_in_world(robot), self.targets.trunk_orientation)
    }

    fn planned_trunk_in_world(&self, robot: &Robot) -> DVec3 {
        let planned = self.targets.trunk_in_world;
        if !self.targets.feet().is_empty() {
            return planned;
        }
        let places = self.limbs_in_body(robot);
        let lowest_m = places.iter().flatten().map(|place| place.z).fold(0.0, f64::min);
        DVec3 { z: -lowest_m, ..planned }
    }
}
