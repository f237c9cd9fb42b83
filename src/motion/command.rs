//! What an operator asks of the robot: gait, speed, turn, posture.

use serde::{Deserialize, Serialize};

/// What the operator wants.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Order {
    /// Stand up and do what the run was planned for.
    Go,
    /// Stand up and do this, until told otherwise.
    Drive(Command),
    /// Slow down, stop, and take the stop action.
    Stop,
    /// Take the stop action from here, without slowing down first.
    StopAtOnce,
}

impl Order {
    /// True if the robot is to end on its feet or off them.
    pub fn is_stop(self) -> bool {
        matches!(self, Order::Stop | Order::StopAtOnce)
    }
}

/// How the robot is to move. What it cannot do is held to what it can.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Command {
    /// Who is in the air when.
    pub gait: GaitChoice,
    /// Speed of the trunk, m/s; negative is backwards.
    pub speed_m_s: f64,
    /// Turn of the trunk, rad/s; positive is to the left.
    pub yaw_rate_rad_s: f64,
    /// How the trunk is carried.
    pub posture: Posture,
}

impl Command {
    /// Straight ahead and level at `speed_m_s` in the gait with index `gait`.
    pub fn ahead(gait: usize, speed_m_s: f64) -> Command {
        Command { gait: GaitChoice::Gait(gait), speed_m_s, ..Command::default() }
    }

    /// True if every number is one.
    pub fn is_finite(&self) -> bool {
        let Posture { rise_m, pitch_rad, roll_rad, sway_m } = self.posture;
        [self.speed_m_s, self.yaw_rate_rad_s, rise_m, pitch_rad, roll_rad, sway_m]
            .iter()
            .all(|number| number.is_finite())
    }
}

/// Which gait.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum GaitChoice {
    /// None: every foot on the ground.
    #[default]
    Stand,
    /// The gait that suits the speed.
    Auto,
    /// This one, index into [`crate::model::HorseMotion::gaits`]; at speed 0 it steps on the spot.
    Gait(usize),
}

/// How the trunk is carried, from standing level at its standing height.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Posture {
    /// Above the standing height, m.
    pub rise_m: f64,
    /// Nose down, rad.
    pub pitch_rad: f64,
    /// Left side up, rad.
    pub roll_rad: f64,
    /// To the left of its feet, m.
    pub sway_m: f64,
}

impl Posture {
    /// The posture `share` of the way from this one to `other`.
    pub fn towards(self, other: Posture, share: f64) -> Posture {
        let between = |a: f64, b: f64| a + (b - a) * share;
        Posture {
            rise_m: between(self.rise_m, other.rise_m),
            pitch_rad: between(self.pitch_rad, other.pitch_rad),
            roll_rad: between(self.roll_rad, other.roll_rad),
            sway_m: between(self.sway_m, other.sway_m),
        }
    }
}
