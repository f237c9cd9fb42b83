//! Driving a figure from the keyboard: each key asks for a pose.

use crate::kinds::KeyDriver;
use crate::model::FigureMotion;
use crate::motion::Order;
use crate::operator::{Ending, Instruction, Key};

/// The orders for a figure by keys so far; at first, to stand.
#[derive(Debug, Clone, PartialEq)]
pub struct PoseKeys {
    /// Names of the poses, the stand first.
    names: Vec<String>,
    pose: usize,
    ending: Ending,
}

impl PoseKeys {
    /// For a figure with these settings.
    pub fn new(figure: &FigureMotion) -> PoseKeys {
        PoseKeys {
            names: figure.poses.iter().map(|pose| pose.name.clone()).collect(),
            pose: 0,
            ending: Ending::default(),
        }
    }
}

impl KeyDriver for PoseKeys {
    fn help(&self) -> Vec<String> {
        let poses: Vec<String> =
            self.names.iter().zip(0..10).skip(1).map(|(name, key)| format!("{key} {name}")).collect();
        vec![
            format!("poses       {}", poses.join(", ")),
            "space or 0  stand".to_owned(),
            "n, p        the next pose, the one before".to_owned(),
            "q           stand, sit down and end".to_owned(),
            "x or Esc    EMERGENCY STOP: the stop action at once".to_owned(),
        ]
    }

    fn press(&mut self, key: Key) -> Option<&'static str> {
        if self.ending.takes(key) {
            return None;
        }
        match key {
            Key::Character(' ') => self.pose = 0,
            Key::Character('n') | Key::Right => self.pose = (self.pose + 1).min(self.names.len() - 1),
            Key::Character('p') | Key::Left => self.pose = self.pose.saturating_sub(1),
            Key::Character(digit) => {
                let pose = digit.to_digit(10).and_then(|digit| usize::try_from(digit).ok())?;
                if pose >= self.names.len() {
                    return Some("there is no pose of this number");
                }
                self.pose = pose;
            }
            Key::Up | Key::Down | Key::Escape | Key::Gone => {}
        }
        None
    }

    fn instruction(&self) -> Instruction {
        self.ending.or(Order::Take(self.pose))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config;

    fn typed(text: &str) -> (Order, Option<&'static str>) {
        let robot = config::parse(include_str!("../../../config/figure.toml"), "figure").unwrap().robot;
        let mut keys = PoseKeys::new(robot.motion.figure().unwrap());
        let mut note = None;
        for character in text.chars() {
            note = keys.press(Key::of(character));
        }
        (keys.instruction().order, note)
    }

    #[test]
    fn a_figure_stands_until_a_key_asks_for_a_pose() {
        let orders = ["", "1", "13", "3 ", "30", "nn", "nnp", "p"].map(|text| typed(text).0);
        assert_eq!(orders, [0, 1, 3, 0, 0, 2, 1, 0].map(Order::Take));
        assert_eq!(typed("9"), (Order::Take(0), Some("there is no pose of this number")));
        assert_eq!(typed(&"n".repeat(100)).0, Order::Take(6), "the last one stays");
    }

    #[test]
    fn an_ordered_end_stays_and_only_an_emergency_stop_replaces_it() {
        assert_eq!(typed("2q3").0, Order::Stop);
        assert_eq!(typed("2qx").0, Order::StopAtOnce);
        assert_eq!(typed("2xq ").0, Order::StopAtOnce);
    }
}
