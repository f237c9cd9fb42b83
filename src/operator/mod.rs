//! The operators: who tells a running robot what to do, cycle by cycle.
//!
//! Comes in: what was written, typed or moved (a script's entries, keys, sticks), and the time. Goes out: an
//! [`Instruction`](crate::run::Instruction). No terminal, device or file is touched here, nothing waits, and
//! once made no operator allocates.

mod gamepad;
mod key_codes;
mod keys;
mod script;

use crate::capability::{HorseCapability, top_speed};
use crate::model::{HorseMotion, Robot};
use crate::motion::{Command, GaitChoice, Posture};
pub use gamepad::{Axis, Button, Gamepad, PadEvent};
pub use key_codes::{Decoder, Key};
pub use keys::Keys;
pub use script::{Entry, Playback, Script};

/// Fastest turn that is asked for, rad/s: 20 degrees/s.
const YAW_RATE_MAX_RAD_S: f64 = std::f64::consts::PI / 9.0;

/// What a robot has to offer to an operator.
#[derive(Debug, Clone, PartialEq)]
pub struct Repertoire {
    /// Its gaits, in the order of [`HorseMotion::gaits`].
    pub gaits: Vec<GaitOffer>,
    /// Fastest turn, rad/s.
    pub yaw_rate_max_rad_s: f64,
    /// Height of the trunk when it stands, m.
    pub stand_height_m: f64,
}

/// One gait.
#[derive(Debug, Clone, PartialEq)]
pub struct GaitOffer {
    /// Name, from the robot file.
    pub name: String,
    /// Top speed, m/s; 0 for a gait the robot cannot do even on the spot.
    pub top_m_s: f64,
}

impl Repertoire {
    /// Works out what `robot` can do.
    pub fn of(robot: &Robot, horse: &HorseMotion, capability: &HorseCapability) -> Repertoire {
        let gaits = horse.gaits.iter().map(|gait| GaitOffer {
            name: gait.name.clone(),
            top_m_s: top_speed::of_gait(robot, &capability.plan(horse, gait)).m_s(),
        });
        Repertoire {
            gaits: gaits.collect(),
            yaw_rate_max_rad_s: YAW_RATE_MAX_RAD_S,
            stand_height_m: horse.stand_height_m,
        }
    }

    /// Top speed of what is chosen, m/s; chosen by speed, gaits are as fast as the fastest of them.
    pub fn top_m_s(&self, choice: GaitChoice) -> f64 {
        match choice {
            GaitChoice::Stand => 0.0,
            GaitChoice::Auto => self.gaits.iter().map(|gait| gait.top_m_s).fold(0.0, f64::max),
            GaitChoice::Gait(index) => self.gaits.get(index).map_or(0.0, |gait| gait.top_m_s),
        }
    }

    /// True for a gait the robot can do.
    pub fn can_do(&self, index: usize) -> bool {
        self.gaits.get(index).is_some_and(|gait| gait.top_m_s > 0.0)
    }

    /// The gait after `choice` in the file's order that the robot can do; the last one stays.
    fn next(&self, choice: GaitChoice) -> GaitChoice {
        let first = if let GaitChoice::Gait(index) = choice { index + 1 } else { 0 };
        (first..self.gaits.len()).find(|index| self.can_do(*index)).map_or(choice, GaitChoice::Gait)
    }

    /// The gait before `choice` in the file's order that the robot can do; before the first, the one chosen by speed.
    fn previous(&self, choice: GaitChoice) -> GaitChoice {
        let GaitChoice::Gait(end) = choice else { return choice };
        (0..end).rfind(|index| self.can_do(*index)).map_or(GaitChoice::Auto, GaitChoice::Gait)
    }

    /// Speed and turn as shares of the most there is, -1 to 1.
    fn command(&self, gait: GaitChoice, speed_share: f64, turn_share: f64, posture: Posture) -> Command {
        let is_moving = gait != GaitChoice::Stand;
        Command {
            gait,
            speed_m_s: speed_share * self.top_m_s(gait),
            yaw_rate_rad_s: if is_moving { turn_share * self.yaw_rate_max_rad_s } else { 0.0 },
            posture,
        }
    }
}

#[cfg(test)]
impl Repertoire {
    /// A robot with a walk, a trot it cannot do, and a canter.
    fn example() -> Repertoire {
        let offer = |name: &str, top_m_s| GaitOffer { name: name.to_owned(), top_m_s };
        Repertoire {
            gaits: vec![offer("walk", 0.1), offer("trot", 0.0), offer("canter", 0.4)],
            yaw_rate_max_rad_s: 0.3,
            stand_height_m: 0.2,
        }
    }
}
