//! A show: a script of strokes on repeat; parks the arms when they get hot or a person asks for it.

use crate::model::{Robot, TentacleMotion};
use crate::motion::tentacle::strokes::STROKES;
use crate::motion::{Order, Place, Stroke, StrokeCommand};
use crate::operator::{Entry, Instruction, Key, Playback, Script};
use crate::signals::Status;

/// A servo this far below the safety limit is hot enough to park; it counts as cool once it is this much cooler
/// than that, K.
const HOT_BELOW_C: f64 = 5.0;
const COOLER_BY_C: f64 = 5.0;
/// How long arms let go of a pole, as a multiple of the stroke's time, and how long they rest at the end, s.
const LET_GO_STROKES: f64 = 2.0;
const REST_S: f64 = 4.0;

/// A show in progress.
#[derive(Debug, Clone, PartialEq)]
pub struct Show {
    playback: Playback,
    hot_c: f64,
    is_cooling: bool,
    is_parked: bool,
    ending: Option<Instruction>,
}

impl Show {
    /// The show of `script` on `robot`.
    pub fn new(robot: &Robot, script: Script) -> Show {
        Show {
            playback: Playback::new(script),
            hot_c: robot.safety.temperature_c - HOT_BELOW_C,
            is_cooling: false,
            is_parked: false,
            ending: None,
        }
    }

    /// A script of every stroke these arms can do, one after the other, on repeat, for `for_s`.
    pub fn of_all_strokes(tentacle: &TentacleMotion, for_s: f64) -> Script {
        let mut entries = Vec::new();
        let mut time_s = 0.0;
        let mut add = |stroke, lasts_s| {
            entries.push(Entry { time_s, order: Order::Perform(StrokeCommand::of(stroke)), line: 0 });
            time_s += lasts_s;
        };
        for kind in STROKES {
            let (Some(shown), Some(stroke)) = (kind.shown, kind.in_file(tentacle)) else { continue };
            add(stroke, shown.strokes * tentacle.stroke_time_s + shown.hold_s);
            if let Place::Pole(_) = stroke.place {
                add(Stroke::LET_GO, LET_GO_STROKES * tentacle.stroke_time_s);
            }
        }
        add(Stroke::PARK, REST_S);
        Script {
            before: Order::Perform(StrokeCommand::default()),
            entries,
            end_s: for_s,
            repeats_after_s: Some(time_s),
        }
    }

    /// Descriptions of the keys for people, a line each.
    pub fn help() -> [&'static str; 3] {
        [
            "p         park, and go on",
            "q         park, let go and end",
            "x or Esc  EMERGENCY STOP: the stop action at once",
        ]
    }

    /// Carries out `key`; returns a message for the person who pressed it, if any.
    pub fn press(&mut self, key: Key) -> Option<&'static str> {
        match key {
            Key::Escape | Key::Character('x') => self.ending = Some(Order::StopAtOnce.into()),
            Key::Character('q' | '\x04') => {
                self.ending.get_or_insert(Order::Stop.into());
            }
            Key::Gone => {
                let reason = "the keyboard's terminal is gone";
                self.ending.get_or_insert(Instruction { order: Order::Stop, reason });
            }
            Key::Character('p') => {
                self.is_parked = !self.is_parked;
                return Some(if self.is_parked { "parked: p goes on" } else { "the show goes on" });
            }
            _ => {}
        }
        None
    }

    /// The instruction for this cycle; and a message for a person, if any.
    pub fn instruction(&mut self, status: &Status) -> (Instruction, Option<&'static str>) {
        let was_cooling = self.is_cooling;
        let limit_c = if was_cooling { self.hot_c - COOLER_BY_C } else { self.hot_c };
        self.is_cooling = status.hottest_c > limit_c;
        let note = match (was_cooling, self.is_cooling) {
            (false, true) => Some("a servo is hot: parked until it is cool"),
            (true, false) => Some("cool again: the show goes on"),
            _ => None,
        };
        let waits = self.is_cooling || self.is_parked;
        let said = self.playback.instruction_unless(status, waits);
        let park = Order::Perform(StrokeCommand::of(Stroke::PARK));
        let instruction = if waits && !said.order.is_stop() { park.into() } else { said };
        (self.ending.unwrap_or(instruction), note)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config;
    use crate::motion::Activity;

    fn robot() -> Robot {
        config::parse(include_str!("../../../config/tentacle.toml"), "tentacle").unwrap().robot
    }

    fn status(time_s: f64, hottest_c: f64) -> Status {
        Status { time_s, activity: Activity::Standing, hottest_c, ..Status::LIMP }
    }

    fn stroke(instruction: Instruction) -> Stroke {
        match instruction.order {
            Order::Perform(command) => command.stroke,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn a_show_repeats_until_its_time_is_over() {
        let robot = robot();
        let script = Show::of_all_strokes(robot.motion.tentacle().unwrap(), 1000.0);
        let period_s = script.repeats_after_s.unwrap();
        let mut show = Show::new(&robot, script);
        assert_eq!(stroke(show.instruction(&status(0.0, 30.0)).0), Stroke::of("sway"));
        for round in 0..5 {
            let begin_s = f64::from(round) * period_s;
            assert_eq!(stroke(show.instruction(&status(begin_s + 0.5, 30.0)).0), Stroke::of("sway"));
            assert_eq!(stroke(show.instruction(&status(begin_s + period_s - 0.5, 30.0)).0), Stroke::PARK);
        }
        assert_eq!(show.instruction(&status(1001.0, 30.0)).0.order, Order::Stop);
    }

    #[test]
    fn a_show_parks_while_a_servo_is_hot_or_a_key_asks_and_resumes_where_it_was() {
        let robot = robot();
        let script = Show::of_all_strokes(robot.motion.tentacle().unwrap(), 1e6);
        let mut show = Show::new(&robot, script);
        let hot_c = robot.safety.temperature_c - 4.0;
        assert_eq!(stroke(show.instruction(&status(0.0, 30.0)).0), Stroke::of("sway"));
        let (instruction, note) = show.instruction(&status(1.0, hot_c));
        assert_eq!(stroke(instruction), Stroke::PARK);
        assert!(note.is_some_and(|note| note.contains("hot")));
        // A little cooler does not count as cool.
        assert_eq!(stroke(show.instruction(&status(100.0, hot_c - 3.0)).0), Stroke::PARK);
        assert_eq!(stroke(show.instruction(&status(199.99, hot_c - 3.0)).0), Stroke::PARK);
        assert_eq!(
            stroke(show.instruction(&status(200.0, 30.0)).0),
            Stroke::of("sway"),
            "its time stood still"
        );
        show.press(Key::Character('p'));
        assert_eq!(stroke(show.instruction(&status(200.01, 30.0)).0), Stroke::PARK);
        assert_eq!(stroke(show.instruction(&status(399.99, 30.0)).0), Stroke::PARK);
        show.press(Key::Character('p'));
        assert_eq!(stroke(show.instruction(&status(400.0, 30.0)).0), Stroke::of("sway"));
        show.press(Key::Character('q'));
        assert_eq!(show.instruction(&status(401.0, 30.0)).0.order, Order::Stop);
    }
}
