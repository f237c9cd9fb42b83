//! Looking at a robot without touching it: what every servo reports, again and again.
//!
//! Comes in: a robot and its ports. Goes out: a [`Row`] a joint. Only reads are sent, so that torque, goals and
//! settings stay whatever they were; a servo that falls silent is told as lost, and is back as soon as it answers.

use crate::bus::{Buses, Ports, Slot};
use crate::counts;
use crate::model::{Joint, Robot, Servo};
use crate::signals::{JointState, State};
use crate::units::Time;

/// A servo unheard for longer than this counts as lost, s: a reply or two may be damaged on any line.
const LOST_AFTER_S: f64 = 0.5;
/// Servos asked in one look for what is not in the block of every exchange: all of them would take longer than a look.
const ASKED_MORE: usize = 4;

/// What a servo was last told to do.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum LastGoal {
    /// It was not asked yet, or did not answer.
    #[default]
    Unknown,
    /// Nothing: it has no torque.
    Limp,
    /// To go to this joint angle, rad.
    Angle(f64),
}

/// One joint, as its servo last reported it.
#[derive(Debug, Clone)]
pub struct Row<'m> {
    /// The joint.
    pub joint: &'m Joint,
    /// Its servo.
    pub servo: Servo,
    /// As last heard.
    pub state: JointState,
    /// True where it was never heard, or not for half a second.
    pub is_lost: bool,
    /// What it was last told.
    pub goal: LastGoal,
    /// Its alarms in words; empty where there is none.
    pub alarms: String,
}

/// What was asked of a servo beside the block of every exchange.
#[derive(Debug, Clone, Copy, Default)]
struct More {
    goal: LastGoal,
    alarm_bits: u8,
}

/// A robot that is looked at.
#[derive(Debug)]
pub struct Monitor<'r, P> {
    robot: &'r Robot,
    buses: Buses<P>,
    slots: Vec<Slot>,
    state: State,
    more: Vec<More>,
    /// The joint that is asked for more next.
    next: usize,
    looked: Option<Time>,
}

impl<'r, P: Ports> Monitor<'r, P> {
    /// Of `robot` on `ports`. Sends nothing yet.
    pub fn new(robot: &'r Robot, ports: P) -> Monitor<'r, P> {
        Monitor {
            robot,
            buses: Buses::new(robot, ports),
            slots: vec![Slot::Missing; robot.joints.len()],
            state: State::new(robot),
            more: vec![More::default(); robot.joints.len()],
            next: 0,
            looked: None,
        }
    }

    /// Asks every servo once, and some of them for goal, torque and alarms too.
    pub fn look(&mut self) {
        let now = self.buses.ports_mut().now();
        let gap_s = self.looked.map_or(0.0, |before| now.since(before).as_secs_f64());
        self.looked = Some(now);
        self.buses.look(&mut self.slots);
        // A monitor shows what the servos say, plausible or not.
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

    /// None where the servo does not answer; one that was silent just now is not waited for again.
    fn ask_more(&mut self, joint: usize) -> Option<More> {
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
        Some(More { goal, alarm_bits: u8::try_from(bits).unwrap_or(u8::MAX) })
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
