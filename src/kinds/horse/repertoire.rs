//! The capability of a horse, as a person who drives it needs to know it.

use crate::model::Gait;
use crate::motion::horse::{HorsePlan, Pace};
use crate::motion::{Command, GaitChoice, Posture};

/// The capability of a robot, as an operator needs to know it.
#[derive(Debug, Clone, PartialEq)]
pub struct Repertoire {
    /// Its gaits, in the order of [`crate::model::HorseMotion::gaits`].
    pub gaits: Vec<GaitOffer>,
    /// Its pace if the gait is chosen by speed.
    pub auto: Pace,
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
    /// Top speeds; 0 for a gait the robot cannot do even on the spot.
    pub pace: Pace,
}

impl Repertoire {
    /// The repertoire of a robot with this `plan`.
    pub fn of(plan: &HorsePlan) -> Repertoire {
        let horse = &plan.settings;
        let offer = |(gait, pace): (&Gait, &Pace)| GaitOffer { name: gait.name.clone(), pace: *pace };
        Repertoire {
            gaits: horse.gaits.iter().zip(&plan.paces).map(offer).collect(),
            auto: plan.pace(GaitChoice::Auto),
            yaw_rate_max_rad_s: horse.yaw_rate_max_rad_s,
            stand_height_m: horse.stand_height_m,
        }
    }

    /// Top speed of `choice` in the direction of `forward` (positive is forward), m/s, 0 or more.
    pub fn top_m_s(&self, choice: GaitChoice, forward: f64) -> f64 {
        let pace = match choice {
            GaitChoice::Stand => return 0.0,
            GaitChoice::Auto => self.auto,
            GaitChoice::Gait(index) => match self.gaits.get(index) {
                Some(gait) => gait.pace,
                None => return 0.0,
            },
        };
        if forward < 0.0 { pace.backward_m_s } else { pace.forward_m_s }
    }

    /// True if the robot can do the gait at this index.
    pub fn can_do(&self, index: usize) -> bool {
        self.top_m_s(GaitChoice::Gait(index), 1.0) > 0.0
    }

    /// The next gait after `choice`, in the file's order, that the robot can do; after the last, the last.
    pub(super) fn next(&self, choice: GaitChoice) -> GaitChoice {
        let first = if let GaitChoice::Gait(index) = choice { index + 1 } else { 0 };
        (first..self.gaits.len()).find(|index| self.can_do(*index)).map_or(choice, GaitChoice::Gait)
    }

    /// The last gait before `choice`, in the file's order, that the robot can do; before the first, the one chosen
    /// by speed.
    pub(super) fn previous(&self, choice: GaitChoice) -> GaitChoice {
        let GaitChoice::Gait(end) = choice else { return choice };
        (0..end).rfind(|index| self.can_do(*index)).map_or(GaitChoice::Auto, GaitChoice::Gait)
    }

    /// Command with speed and turn as shares of the maximum, -1 to 1.
    pub(super) fn command(
        &self,
        gait: GaitChoice,
        speed_share: f64,
        turn_share: f64,
        posture: Posture,
    ) -> Command {
        let is_moving = gait != GaitChoice::Stand;
        Command {
            gait,
            speed_m_s: speed_share * self.top_m_s(gait, speed_share),
            yaw_rate_rad_s: if is_moving { turn_share * self.yaw_rate_max_rad_s } else { 0.0 },
            posture,
        }
    }
}

#[cfg(test)]
impl Repertoire {
    /// A robot with a walk, a trot it cannot do, and a canter.
    pub(super) fn example() -> Repertoire {
        let pace = |forward_m_s| Pace { forward_m_s, backward_m_s: 0.5 * forward_m_s };
        let offer = |name: &str, top_m_s| GaitOffer { name: name.to_owned(), pace: pace(top_m_s) };
        Repertoire {
            gaits: vec![offer("walk", 0.1), offer("trot", 0.0), offer("canter", 0.4)],
            auto: pace(0.4),
            yaw_rate_max_rad_s: 0.3,
            stand_height_m: 0.2,
        }
    }
}
