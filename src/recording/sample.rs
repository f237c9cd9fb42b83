//! One cycle by value, with room for all of it taken once.

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
    /// Replies that never came, since the start.
    pub missing: u64,
    /// Replies that were damaged, since the start.
    pub corrupt: u64,
    /// Whether its port was gone when last used.
    pub is_gone: bool,
}

/// A [`CycleRecord`] by value, its times, and the buses after it.
#[derive(Debug, Clone)]
pub struct Sample {
    /// When the cycle was.
    pub times: CycleTimes,
    /// How late it began after its deadline.
    pub late: Duration,
    /// What the operator wanted.
    pub order: Order,
    /// What the robot was doing.
    pub activity: Activity,
    /// Planned speed, m/s.
    pub speed_m_s: f64,
    /// What the generator asked for.
    pub targets: Targets,
    /// What inverse kinematics made of it.
    pub joints: JointTargets,
    /// The goal registers that were sent, one a joint.
    pub goals: Vec<ServoGoal>,
    /// What the servos answered, one slot a joint.
    pub slots: Vec<Slot>,
    /// What the inertial measurement unit last said.
    pub imu: ImuReading,
    /// What is known of the robot after the exchange.
    pub state: State,
    /// Joints that were told something else than was asked.
    pub interventions: u32,
    /// True if motion time stood still this cycle.
    pub is_held: bool,
    /// Length of a cycle, s.
    pub dt_s: f64,
    /// What the robot truly does; only a simulated body tells.
    pub truth: Option<TrueBody>,
    /// Each bus.
    pub buses: Vec<BusSample>,
}

impl Sample {
    /// Room for a cycle of `robot`.
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

    /// Takes over a cycle of the robot this was made for. Allocates nothing.
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

        self.targets.aim = record.targets.aim;
        self.targets.trunk_in_world = record.targets.trunk_in_world;
        self.targets.trunk_turn = record.targets.trunk_turn;
        self.targets.posture_pull = record.targets.posture_pull;
        self.targets.pose_rad.clone_from(&record.targets.pose_rad);
        self.targets.tips_in_body.clone_from(&record.targets.tips_in_body);
        self.targets.feet.clone_from(&record.targets.feet);
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

    /// Joints and tip of each chain of `robot` by the measured angles, body frame, m.
    pub fn limbs_in_body(&self, robot: &Robot) -> Vec<Vec<DVec3>> {
        let limb = |chain: &Chain| {
            let joints = &self.state.joints[chain.joints.clone()];
            robot.places_in_body(chain, joints.iter().map(|joint| joint.position_rad))
        };
        robot.chains.iter().map(limb).collect()
    }

    /// Where to draw the trunk of `robot`, m, and how it is turned: as it truly is, where that is known; else where it
    /// is planned; while nothing is planned, so that what hangs lowest lies on the ground.
    pub fn trunk_in_world(&self, robot: &Robot) -> (DVec3, DQuat) {
        if let Some(truth) = &self.truth {
            return (truth.position_m, truth.turn);
        }
        (self.planned_trunk_in_world(robot), self.targets.trunk_turn)
    }

    fn planned_trunk_in_world(&self, robot: &Robot) -> DVec3 {
        let planned = self.targets.trunk_in_world;
        if !self.targets.feet.is_empty() {
            return planned;
        }
        let places = self.limbs_in_body(robot);
        let lowest_m = places.iter().flatten().map(|place| place.z).fold(0.0, f64::min);
        DVec3 { z: -lowest_m, ..planned }
    }
}
