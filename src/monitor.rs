//! Monitors a robot without touching it: reads what every servo reports, again and again.
//!
//! Takes a robot and its ports. Returns a [`Row`] per joint. It sends only reads, so torque, goals and
//! settings stay unchanged. A servo that falls silent is shown as lost, and is back as soon as it answers.

use crate::bus::{Buses, Ports, Slot};
use crate::counts;
use crate::model::{Joint, Robot, Servo};
use crate::signals::{JointState, State};
use crate::units::Time;

/// A servo unheard for longer than this counts as lost, s: any line may damage a reply or two.
const LOST_AFTER_S: f64 = 0.5;
/// Servos asked in one look for data beyond the usual feedback block: asking all would take longer than a look.
const ASKED_MORE: usize = 4;

/// The last command that a servo holds.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum LastGoal {
    /// The servo was not asked yet, or did not answer.
    #[default]
    Unknown,
    /// No goal: it has no torque.
    Limp,
    /// A goal at this joint angle, rad.
    Angle(f64),
}

/// One joint, as its servo last reported.
#[derive(Debug, Clone)]
pub struct Row<'m> {
    /// The joint.
    pub joint: &'m Joint,
    /// Its servo.
    pub servo: Servo,
    /// Its state when last heard.
    pub state: JointState,
    /// True if it was never heard, or not for half a second.
    pub is_lost: bool,
    /// The last command it holds.
    pub goal: LastGoal,
    /// Its alarms in words; empty if there are none.
    pub alarms: String,
}

/// Data that a servo reported beyond the usual feedback block.
#[derive(Debug, Clone, Copy, Default)]
struct ExtraData {
    goal: LastGoal,
    alarm_bits: u8,
}

/// A monitored robot.
#[derive(Debug)]
pub struct Monitor<'r, P> {
    robot: &'r Robot,
    buses: Buses<P>,
    slots: Vec<Slot>,
    state: State,
    more: Vec<ExtraData>,
    /// The joint that is asked for additional data next.
    next: usize,
    looked: Option<Time>,
}

impl<'r, P: Ports> Monitor<'r, P> {
    /// A monitor of `robot` on `ports`. Sends nothing yet.
    pub fn new(robot: &'r Robot, ports: P) -> Monitor<'r, P> {
        Monitor {
            robot,
            buses: Buses::new(robot, ports),
            slots: vec![Slot::Missing; robot.joints.len()],
            state: State::new(robot),
            more: vec![ExtraData::default(); robot.joints.len()],
            next: 0,
            looked: None,
        }
    }

    /// Asks every servo once, and some also for goal, torque and alarms.
    pub fn look(&mut self) {
        let now = self.buses.ports_mut().now();
        let gap_s = self.looked.map_or(0.0, |before| now.since(before).as_secs_f64());
        self.looked = Some(now);
        self.buses.look(&mut self.slots);
        // A monitor shows all reports of the servos, plausible or not.
        let joints = self.state.joints.iter_mut().zip(&self.robot.joints);
        for ((known, joint), slot) in joints.zip(&self.slots) {
            match (slot, &joint.servo) {
                (Slot::Fresh(reply), Some(servo)) => *known = counts::measured(servo, reply),
                _ => known.age_s += gap_s,
            }
        }
        for _ in 0..ASKED_MORE.min(self.robot.joints.len()) {
            let joint = self.next;
            self.next = (joint + 1) % self.robot.joints.len();
            self.more[joint] = self.ask_more(joint).unwrap_or_default();
        }
    }

    /// `None` if the servo does not answer; a servo that was just silent is not waited for again.
    fn ask_more(&mut self, joint: usize) -> Option<ExtraData> {
        let servo = self.robot.joints[joint].servo?;
        if !matches!(self.slots[joint], Slot::Fresh(_)) {
            return None;
        }
        let registers = servo.model.registers;
        let has_torque = self.buses.read(joint, registers.torque_enable).ok()? != 0;
        let goal = match has_torque {
            false => LastGoal::Limp,
            true => {
                let count = i32::try_from(self.buses.read(joint, registers.goal_position).ok()?).ok()?;
                LastGoal::Angle(servo.angle_of(f64::from(count)))
            }
        };
        let bits = self.buses.read(joint, registers.alarm_status).ok()?;
        Some(ExtraData { goal, alarm_bits: u8::try_from(bits).unwrap_or(u8::MAX) })
    }

    /// Every joint that has a servo, in the robot's order.
    pub fn rows(&self) -> impl Iterator<Item = Row<'_>> {
        let joints = self.robot.joints.iter().zip(&self.state.joints).zip(&self.more);
        joints.filter_map(|((joint, state), more)| {
            let servo = joint.servo?;
            let is_lost = !state.is_known || state.age_s > LOST_AFTER_S;
            let alarms = servo.model.registers.alarm_words(more.alarm_bits);
            let goal = if is_lost { LastGoal::Unknown } else { more.goal };
            Some(Row { joint, servo, state: *state, is_lost, goal, alarms })
        })
    }

    /// The ports, for their clock and wait.
    pub fn ports_mut(&mut self) -> &mut P {
        self.buses.ports_mut()
    }
}
