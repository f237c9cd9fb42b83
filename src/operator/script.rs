//! Driving by a script: a new command at each of its times. [`crate::config`] reads scripts.

use super::Instruction;
use crate::motion::{Activity, Order};
use crate::signals::{Permission, Status};

/// Orders with their times.
#[derive(Debug, Clone, PartialEq)]
pub struct Script {
    /// The order before the first entry: to stand, or to rest.
    pub before: Order,
    /// In the order of their times; at least one.
    pub entries: Vec<Entry>,
    /// When the robot stops, s.
    pub end_s: f64,
    /// Period after which it restarts, s; `None` for a script that is played once.
    pub repeats_after_s: Option<f64>,
}

/// An order that holds from a time on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Entry {
    /// Time since the robot first stood, s.
    pub time_s: f64,
    /// The order from then on: to drive or to perform.
    pub order: Order,
    /// Its line in the script, from 1.
    pub line: usize,
}

impl Script {
    /// The order `time_s` seconds after the robot first stood.
    pub fn order_at(&self, time_s: f64) -> Order {
        if time_s >= self.end_s {
            return Order::Stop;
        }
        let time_s = self.repeats_after_s.map_or(time_s, |period_s| time_s.rem_euclid(period_s));
        let begun = self.entries.partition_point(|entry| entry.time_s <= time_s);
        let now = begun.checked_sub(1).and_then(|index| self.entries.get(index));
        now.map_or(self.before, |entry| entry.order)
    }
}

/// A script being played. Its time starts when the robot stands, and pauses while safety holds it.
#[derive(Debug, Clone, PartialEq)]
pub struct Playback {
    script: Script,
    /// Time of the script and of the run at the last cycle, s; `None` until the robot stands.
    at_s: Option<(f64, f64)>,
}

impl Playback {
    /// Plays `script` from its beginning.
    pub fn new(script: Script) -> Playback {
        Playback { script, at_s: None }
    }

    /// The instruction for this cycle.
    pub fn instruction(&mut self, status: &Status) -> Instruction {
        self.instruction_unless(status, false)
    }

    /// The same, but script time pauses while `waits` is true.
    pub fn instruction_unless(&mut self, status: &Status, waits: bool) -> Instruction {
        self.at_s = match self.at_s {
            None if status.activity != Activity::Standing => return self.script.before.into(),
            None => Some((0.0, status.time_s)),
            Some((script_s, _)) if waits || status.permission == Permission::Hold => {
                Some((script_s, status.time_s))
            }
            Some((script_s, run_s)) => Some((script_s + status.time_s - run_s, status.time_s)),
        };
        let script_s = self.at_s.map_or(0.0, |(script_s, _)| script_s);
        Instruction { order: self.script.order_at(script_s), reason: "the script is over" }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::motion::{Command, GaitChoice};

    fn walk(speed_m_s: f64) -> Command {
        Command { gait: GaitChoice::Gait(0), speed_m_s, ..Command::default() }
    }

    fn script() -> Script {
        let entry = |time_s, speed_m_s| Entry { time_s, order: Order::Drive(walk(speed_m_s)), line: 1 };
        let before = Order::Drive(Command::default());
        Script { before, entries: vec![entry(1.0, 0.1), entry(2.0, 0.2)], end_s: 3.0, repeats_after_s: None }
    }

    fn status(time_s: f64, activity: Activity, permission: Permission) -> Status {
        Status { time_s, activity, permission, ..Status::LIMP }
    }

    #[test]
    fn each_entry_holds_until_the_next() {
        let stand = Order::Drive(Command::default());
        let (slow, fast) = (Order::Drive(walk(0.1)), Order::Drive(walk(0.2)));
        let said = [0.0, 0.99, 1.0, 1.99, 2.0, 2.99, 3.0, 1e9].map(|time_s| script().order_at(time_s));
        assert_eq!(said, [stand, stand, slow, slow, fast, fast, Order::Stop, Order::Stop]);
    }

    #[test]
    fn script_time_begins_when_the_robot_stands_and_pauses_while_it_is_held() {
        use Permission::{Hold, Move};
        let mut playback = Playback::new(script());
        let mut at =
            |time_s, activity, permission| playback.instruction(&status(time_s, activity, permission)).order;
        let stand = Order::Drive(Command::default());
        assert_eq!(at(0.0, Activity::Limp, Move), stand);
        assert_eq!(at(7.0, Activity::Rising, Move), stand);
        assert_eq!(at(8.0, Activity::Standing, Move), stand);
        assert_eq!(at(9.5, Activity::Walking, Move), Order::Drive(walk(0.1)));
        assert_eq!(at(11.5, Activity::Walking, Hold), Order::Drive(walk(0.1)));
        assert_eq!(at(11.6, Activity::Walking, Move), Order::Drive(walk(0.1)));
        assert_eq!(at(12.1, Activity::Walking, Move), Order::Drive(walk(0.2)));
        assert_eq!(at(13.1, Activity::Walking, Move), Order::Stop);
    }
}
