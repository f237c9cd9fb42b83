//! Driving arms from the keyboard: each key asks for a stroke, or changes its tempo or turn by a step.

use crate::kinds::KeyDriver;
use crate::model::TentacleMotion;
use crate::motion::tentacle::strokes::STROKES;
use crate::motion::{Order, Stroke, StrokeCommand};
use crate::operator::{Ending, Instruction, Key};

/// Steps of tempo from zero to the robot file's, and the most steps.
const TEMPO_STEPS: i8 = 10;
const TEMPO_STEPS_MAX: i8 = 20;
/// One step of turn, and the most steps either way.
const TURN_RAD: f64 = std::f64::consts::PI / 18.0;
const TURN_STEPS_MAX: i8 = 9;

/// The orders for arms by keys so far; at first, to rest.
#[derive(Debug, Clone, PartialEq)]
pub struct StrokeKeys {
    /// Every stroke with a key, by its key; `None` if the robot file has no place for the stroke.
    strokes: Vec<(char, Option<Stroke>)>,
    stroke: Stroke,
    tempo: i8,
    turn: i8,
    ending: Ending,
}

impl StrokeKeys {
    /// For arms with these settings.
    pub fn new(tentacle: &TentacleMotion) -> StrokeKeys {
        let mut strokes: Vec<_> =
            STROKES.iter().filter_map(|kind| Some((kind.key?, kind.in_file(tentacle)))).collect();
        strokes.sort_by_key(|(key, _)| *key);
        StrokeKeys { strokes, stroke: Stroke::REST, tempo: TEMPO_STEPS, turn: 0, ending: Ending::default() }
    }
}

impl KeyDriver for StrokeKeys {
    fn help(&self) -> Vec<String> {
        let strokes = self.strokes.iter();
        let strokes: Vec<String> =
            strokes.filter_map(|(key, stroke)| Some(format!("{key} {}", stroke.as_ref()?.name))).collect();
        vec![
            format!("strokes              {}", strokes.join(", ")),
            "up, down or w, s     faster, slower".to_owned(),
            "left, right or a, d  turn the strokes".to_owned(),
            "space or 0           rest".to_owned(),
            "p                    park".to_owned(),
            "q                    rest, park, let go and end".to_owned(),
            "x or Esc             EMERGENCY STOP: the stop action at once".to_owned(),
        ]
    }

    fn press(&mut self, key: Key) -> Option<&'static str> {
        if self.ending.takes(key) {
            return None;
        }
        match key {
            Key::Up | Key::Character('w') => self.tempo = (self.tempo + 1).min(TEMPO_STEPS_MAX),
            Key::Down | Key::Character('s') => self.tempo = (self.tempo - 1).max(0),
            Key::Left | Key::Character('a') => self.turn = (self.turn + 1).min(TURN_STEPS_MAX),
            Key::Right | Key::Character('d') => self.turn = (self.turn - 1).max(-TURN_STEPS_MAX),
            Key::Character(' ' | '0') => self.stroke = Stroke::REST,
            Key::Character('p') => self.stroke = Stroke::PARK,
            Key::Character(key) => match self.strokes.iter().find(|(known, _)| *known == key) {
                Some((_, Some(stroke))) => self.stroke = *stroke,
                Some((_, None)) => {
                    return Some("the robot file names no place for that: see reach_mm, pole and path");
                }
                None => {}
            },
            Key::Escape | Key::Gone => {}
        }
        None
    }

    fn instruction(&self) -> Instruction {
        let command = StrokeCommand {
            stroke: self.stroke,
            tempo: f64::from(self.tempo) / f64::from(TEMPO_STEPS),
            turn_rad: f64::from(self.turn) * TURN_RAD,
        };
        self.ending.or(Order::Perform(command))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config;
    use crate::motion::Place;

    fn typed(text: &str) -> (Instruction, Option<&'static str>) {
        let robot = config::parse(include_str!("../../../config/tentacle.toml"), "tentacle").unwrap().robot;
        let mut keys = StrokeKeys::new(robot.motion.tentacle().unwrap());
        let mut note = None;
        for character in text.chars() {
            note = keys.press(Key::of(character));
        }
        (keys.instruction(), note)
    }

    fn command(text: &str) -> StrokeCommand {
        match typed(text).0.order {
            Order::Perform(command) => command,
            other => panic!("{text}: {other:?}"),
        }
    }

    #[test]
    fn arms_rest_until_a_key_is_pressed_and_then_change_strokes() {
        assert_eq!(command(""), StrokeCommand::default());
        let strokes = ["1", "2", "3", "12", "2 ", "3p"].map(|text| command(text).stroke);
        assert_eq!(strokes.map(|stroke| stroke.name), ["sway", "walk", "swim", "walk", "rest", "park"]);
        assert!(matches!(command("4").stroke, Stroke { name: "reach", place: Place::Point { .. } }));
        assert!(matches!(command("5").stroke, Stroke { name: "wind", place: Place::Pole(_) }));
        assert_eq!(command("6").stroke, Stroke::LET_GO);
        assert!(matches!(command("7").stroke, Stroke { name: "path", place: Place::Path(_) }));
    }

    #[test]
    fn every_key_of_the_table_asks_for_its_stroke() {
        for kind in STROKES {
            if let Some(key) = kind.key {
                assert_eq!(command(&key.to_string()).stroke.name, kind.name, "by {key}");
            }
        }
    }

    #[test]
    fn tempo_and_turn_change_in_steps_and_stop_at_their_limits() {
        assert!((command("2vvv").tempo - 0.7).abs() < 1e-12);
        assert!((command(&"^".repeat(100)).tempo - 2.0).abs() < 1e-12);
        assert!(command(&"v".repeat(100)).tempo.abs() < 1e-12);
        assert!((command("2<<").turn_rad - 20_f64.to_radians()).abs() < 1e-12, "left is positive");
        assert!((command(&">".repeat(100)).turn_rad + 90_f64.to_radians()).abs() < 1e-12);
    }

    #[test]
    fn an_ordered_end_stays_and_only_an_emergency_stop_replaces_it() {
        assert_eq!(typed("2q3").0.order, Order::Stop);
        assert_eq!(typed("2qx").0.order, Order::StopAtOnce);
        assert_eq!(typed("2xq ").0.order, Order::StopAtOnce);
    }
}
