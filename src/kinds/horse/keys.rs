//! Driving from the keyboard: each key changes the order by a step.

use super::Repertoire;
use crate::kinds::KeyDriver;
use crate::motion::{GaitChoice, Order, Posture};
use crate::operator::{Ending, Instruction, Key};

/// Steps of speed and turn from zero to the most.
const STEPS: i8 = 10;
/// Steps of height and pitch either way, and their size: a share of the standing height, and a degree.
const POSTURE_STEPS: i8 = 10;
const RISE_SHARE: f64 = 0.02;
const PITCH_RAD: f64 = std::f64::consts::PI / 180.0;

/// The order built up by keys; at first, to stand.
#[derive(Debug, Clone, PartialEq)]
pub struct Keys {
    repertoire: Repertoire,
    gait: GaitChoice,
    /// In steps; positive is forward and left, and up and nose down.
    speed: i8,
    turn: i8,
    rise: i8,
    pitch: i8,
    ending: Ending,
}

impl Keys {
    /// For a robot with this `repertoire`.
    pub fn new(repertoire: Repertoire) -> Keys {
        Keys {
            repertoire,
            gait: GaitChoice::Stand,
            speed: 0,
            turn: 0,
            rise: 0,
            pitch: 0,
            ending: Ending::default(),
        }
    }

    /// Changes speed and turn; a standing robot takes the gait that suits them.
    fn walk_off(&mut self, faster: i8, left: i8) {
        if self.gait == GaitChoice::Stand {
            self.gait = GaitChoice::Auto;
        }
        self.speed = step(self.speed, faster, STEPS);
        self.turn = step(self.turn, left, STEPS);
    }

    fn take_gait(&mut self, digit: char) -> Option<&'static str> {
        let index = usize::try_from(digit.to_digit(10)?.checked_sub(1)?).ok()?;
        if index >= self.repertoire.gaits.len() {
            return Some("there is no gait of this number");
        }
        if !self.repertoire.can_do(index) {
            return Some("this robot's servos are too slow for that gait");
        }
        self.gait = GaitChoice::Gait(index);
        None
    }
}

impl KeyDriver for Keys {
    fn help(&self) -> Vec<String> {
        let gaits = self.repertoire.gaits.iter().zip(1..=9).enumerate();
        let doable = gaits.filter(|(index, _)| self.repertoire.can_do(*index));
        let gaits: Vec<String> = doable.map(|(_, (gait, key))| format!("{key} {}", gait.name)).collect();
        vec![
            "up, down or w, s     faster, slower and backwards".to_owned(),
            "left, right or a, d  turn".to_owned(),
            format!("gaits                {}", gaits.join(", ")),
            "                     n, p next, previous; g the gait that suits the speed".to_owned(),
            "space or 0           stop and stand".to_owned(),
            "r, f and t, b        higher, lower; nose up, nose down".to_owned(),
            "q                    stop, sit down and end".to_owned(),
            "x or Esc             EMERGENCY STOP: the stop action at once".to_owned(),
        ]
    }

    fn press(&mut self, key: Key) -> Option<&'static str> {
        if self.ending.takes(key) {
            return None;
        }
        match key {
            Key::Up | Key::Character('w') => self.walk_off(1, 0),
            Key::Down | Key::Character('s') => self.walk_off(-1, 0),
            Key::Left | Key::Character('a') => self.walk_off(0, 1),
            Key::Right | Key::Character('d') => self.walk_off(0, -1),
            Key::Character(' ' | '0') => (self.gait, self.speed, self.turn) = (GaitChoice::Stand, 0, 0),
            Key::Character('g') => self.gait = GaitChoice::Auto,
            Key::Character('n') => self.gait = self.repertoire.next(self.gait),
            Key::Character('p') => self.gait = self.repertoire.previous(self.gait),
            Key::Character(digit @ '1'..='9') => return self.take_gait(digit),
            Key::Character('r') => self.rise = step(self.rise, 1, POSTURE_STEPS),
            Key::Character('f') => self.rise = step(self.rise, -1, POSTURE_STEPS),
            Key::Character('b') => self.pitch = step(self.pitch, 1, POSTURE_STEPS),
            Key::Character('t') => self.pitch = step(self.pitch, -1, POSTURE_STEPS),
            Key::Character(_) | Key::Escape | Key::Gone => {}
        }
        None
    }

    fn instruction(&self) -> Instruction {
        let share = |steps: i8| f64::from(steps) / f64::from(STEPS);
        let posture = Posture {
            rise_m: f64::from(self.rise) * RISE_SHARE * self.repertoire.stand_height_m,
            pitch_rad: f64::from(self.pitch) * PITCH_RAD,
            ..Posture::default()
        };
        let command = self.repertoire.command(self.gait, share(self.speed), share(self.turn), posture);
        self.ending.or(Order::Drive(command))
    }
}

fn step(now: i8, change: i8, most: i8) -> i8 {
    (now + change).clamp(-most, most)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::motion::Command;

    /// The instruction after these characters; arrows are `^v<>`.
    fn typed(text: &str) -> (Instruction, Option<&'static str>) {
        let mut keys = Keys::new(Repertoire::example());
        let mut note = None;
        for character in text.chars() {
            note = keys.press(Key::of(character));
        }
        (keys.instruction(), note)
    }

    fn command(text: &str) -> Command {
        match typed(text).0.order {
            Order::Drive(command) => command,
            other => panic!("{text}: {other:?}"),
        }
    }

    #[test]
    fn a_horse_stands_until_a_key_is_pressed() {
        assert_eq!(command(""), Command::default());
        assert_eq!(command("yz\t\n"), Command::default());
    }

    #[test]
    fn speed_and_turn_change_in_tenths_of_the_maximum() {
        let walk = command("1^^^<<");
        assert_eq!(walk.gait, GaitChoice::Gait(0));
        assert!((walk.speed_m_s - 0.03).abs() < 1e-12);
        assert!((walk.yaw_rate_rad_s - 0.06).abs() < 1e-12, "left is positive");
        let canter = command("1^^^<<3");
        assert!((canter.speed_m_s - 0.12).abs() < 1e-12, "three tenths of the canter's top");
        assert_eq!(command("www"), command("^^^"));
        assert_eq!(command("1ssadd"), command("1vv>"));
        assert!((command("1vv").speed_m_s + 0.01).abs() < 1e-12, "two tenths of the top speed backwards");
    }

    #[test]
    fn a_held_key_does_not_push_speed_beyond_its_limit() {
        let most = command(&format!("1{}", "^".repeat(100)));
        assert!((most.speed_m_s - 0.1).abs() < 1e-12);
        let less = command(&format!("1{}v", "^".repeat(100)));
        assert!((less.speed_m_s - 0.09).abs() < 1e-12);
        assert!(command(&"<".repeat(100)).yaw_rate_rad_s <= 0.3 + 1e-12);
        assert!(command(&"f".repeat(100)).posture.rise_m >= -0.04 - 1e-12);
    }

    #[test]
    fn an_arrow_from_a_stand_takes_the_gait_that_suits() {
        assert_eq!(command("^").gait, GaitChoice::Auto);
        assert!((command("^").speed_m_s - 0.04).abs() < 1e-12, "a tenth of the fastest gait's top");
        assert_eq!(command("<").gait, GaitChoice::Auto);
    }

    #[test]
    fn space_stops_the_walk_and_keeps_the_posture() {
        let stopped = command("3^^^<rt ");
        assert_eq!((stopped.gait, stopped.speed_m_s, stopped.yaw_rate_rad_s), (GaitChoice::Stand, 0.0, 0.0));
        assert!((stopped.posture.rise_m - 0.004).abs() < 1e-12);
        assert!((stopped.posture.pitch_rad + PITCH_RAD).abs() < 1e-12, "nose up is negative");
        assert_eq!(command("3^^^<rt0"), stopped);
        // The stop clears the speed asked for before it.
        assert!(command("1^^^ 1").speed_m_s.abs() < 1e-12);
    }

    #[test]
    fn gaits_that_the_robot_cannot_do_are_refused() {
        let (instruction, note) = typed("1^2");
        assert_eq!(instruction, typed("1^").0);
        assert!(note.is_some_and(|note| note.contains("too slow")));
        assert!(typed("9").1.is_some_and(|note| note.contains("no gait")));
        assert_eq!(command("1n").gait, GaitChoice::Gait(2), "trot is left out");
        assert_eq!(command("1np").gait, GaitChoice::Gait(0));
        assert!(!Keys::new(Repertoire::example()).help().concat().contains("trot"));
    }

    #[test]
    fn an_ordered_end_stays_and_only_an_emergency_stop_replaces_it() {
        assert_eq!(typed("1^q").0.order, Order::Stop);
        assert_eq!(typed("1^q^ 13").0.order, Order::Stop);
        assert_eq!(typed("1^x").0.order, Order::StopAtOnce);
        assert_eq!(typed("1^qx").0.order, Order::StopAtOnce);
        assert_eq!(typed("1^xq ").0.order, Order::StopAtOnce);
        let mut keys = Keys::new(Repertoire::example());
        keys.press(Key::Gone);
        assert_eq!(keys.instruction().order, Order::Stop);
        keys.press(Key::Escape);
        assert_eq!(keys.instruction().order, Order::StopAtOnce);
    }
}
