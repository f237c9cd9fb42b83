//! One cycle by value, in memory that is allocated once.

use std::time::Duration;

use glam::{DQuat, DVec3};

use crate::bus::{BusStatistics, ServoGoal, Slot};
use crate::cycle::CycleTimes;
use crate::model::{Chain, Robot};
use crate::motion::{Activity, Order};
use crate::signals::{ImuReading, JointTargets, State, Targets, TrueBody};
use crate::telemetry::CycleRecord;

/// One bus after a cycle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct BusSample {
    /// Time of the last exchange.
    pub exchange: Duration,
    /// Missing replies since the start.
    pub missing: u64,
    /// Corrupt replies since the start.
    pub corrupt: u64,
    /// True if its port was gone when last used.
    pub is_gone: bool,
}

/// A [`CycleRecord`] by value, its times, and the buses after it.
#[derive(Debug, Clone)]
pub struct Sample {
    /// Times of the cycle.
    pub times: CycleTimes,
    /// Time by which it began after its deadline.
    pub late: Duration,
    /// The operator's order.
    pub order: Order,
    /// The robot's activity.
    pub activity: Activity,
    /// Planned speed, m/s.
    pub speed_m_s: f64,
    /// The generator's targets.
    pub targets: Targets,
    /// The result of inverse kinematics.
    pub joints: JointTargets,
    /// The goal registers that were sent, one per joint.
    pub goals: Vec<ServoGoal>,
    /// The replies of the servos, one slot per joint.
    pub slots: Vec<Slot>,
    /// The last reading of the inertial measurement unit.
    pub imu: ImuReading,
    /// The estimated state of the robot after the exchange.
    pub state: State,
    /// Joints whose goal safety changed.
    pub interventions: u32,
    /// True if motion time stood still in this cycle.
    pub is_held: bool,
    /// Length of a cycle, s.
    pub dt_s: f64,
    /// The true state of the trunk; only a simulated body reports it.
    pub truth: Option<TrueBody>,
    /// Each bus.
    pub buses: Vec<BusSample>,
}

impl Sample {
    /// An empty sample for `robot`.
    pub fn new(robot: &Robot) -> Sample {
        Sample {
            times: CycleTimes::default(),
            late: Duration::ZERO,
            order: Order::Go,
            activity: Activity::Limp,
            speed_m_s: 0.0,
            targets: Targets::new(robot),
            joints: JointTargets::new(robot),
            goals: vec![ServoGoal::Limp; robot.joints.len()],
            slots: vec![Slot::Missing; robot.joints.len()],
            imu: ImuReading::default(),
            state: State::new(robot),
            interventions: 0,
            is_held: false,
            dt_s: robot.period_s(),
            truth: None,
            buses: vec![BusSample::default(); robot.buses.len()],
        }
    }

    /// Copies a cycle of the same robot. Allocates nothing.
    pub fn copy_from<'s>(
        &mut self,
        record: &CycleRecord<'_>,
        times: CycleTimes,
        late: Duration,
        buses: impl Iterator<Item = BusStatistics<'s>>,
    ) {
        self.times = times;
        self.late = late;
        self.order = record.order;
        self.activity = record.activity;
        self.speed_m_s = record.speed_m_s;
        self.interventions = record.interventions;
        self.is_held = record.is_held;
        self.dt_s = record.dt_s;
        self.truth = record.truth;

        self.targets.copy_recorded(record.targets);
        self.joints.is_limp = record.joints.is_limp;
        self.joints.angles_rad.clone_from(&record.joints.angles_rad);
        self.joints.residual_m.clone_from(&record.joints.residual_m);
        self.state.joints.clone_from(&record.state.joints);
        self.state.goal_rad.clone_from(&record.state.goal_rad);
        self.state.permission = record.state.permission;
        self.state.outage = record.state.outage;
        let (body, known) = (&mut self.state.body, &record.state.body);
        body.is_known = known.is_known;
        (body.roll_rad, body.pitch_rad, body.yaw_rad) = (known.roll_rad, known.pitch_rad, known.yaw_rad);
        (body.rate_rad_s, body.velocity_m_s) = (known.rate_rad_s, known.velocity_m_s);
        body.is_in_contact.clone_from(&known.is_in_contact);
        self.imu = *record.imu;
        self.goals.copy_from_slice(record.goals);
        self.slots.copy_from_slice(record.slots);
        for (sample, bus) in self.buses.iter_mut().zip(buses) {
            *sample = BusSample {
                exchange: bus.times.last,
                missing: bus.counters.missing,
                corrupt: bus.counters.corrupt,
                is_gone: bus.is_gone,
            };
        }
    }

    /// The cycle, as the observers see it.
    pub fn record(&self) -> CycleRecord<'_> {
        CycleRecord {
            order: self.order,
            activity: self.activity,
            speed_m_s: self.speed_m_s,
            targets: &self.targets,
            joints: &self.joints,
            goals: &self.goals,
            slots: &self.slots,
            imu: &self.imu,
            state: &self.state,
            interventions: self.interventions,
            is_held: self.is_held,
            dt_s: self.dt_s,
            truth: self.truth,
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
        if let Some(truth) = &self.truth {
            return (truth.position_m, truth.turn);
        }
        (self.planned_trunk_in_world(robot), self.targets.trunk_turn)
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
