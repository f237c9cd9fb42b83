//! The operator's orders: for a horse gait, speed, turn and posture; for arms a stroke; for a figure a pose.

use glam::DVec3;
use serde::{Deserialize, Serialize};

use crate::model::{Pole, TipPath};

/// An order from the operator.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Order {
    /// Get up and carry out the run's plan.
    Go,
    /// Stand up and move like this until the next order: for a horse.
    Drive(Command),
    /// Get up and move like this until the next order: for arms.
    Perform(StrokeCommand),
    /// Stand up and take this pose, index into [`crate::model::FigureMotion::poses`], until the next order:
    /// for a figure.
    Take(usize),
    /// Slow down, stop, and take the stop action.
    Stop,
    /// Take the stop action at once, without slowing down first.
    StopAtOnce,
}

impl Order {
    /// True if the order ends the run, on its feet or off them.
    pub fn is_stop(self) -> bool {
        matches!(self, Order::Stop | Order::StopAtOnce)
    }
}

/// A motion command for a horse. Values beyond its capability are limited to it.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Command {
    /// The gait.
    pub gait: GaitChoice,
    /// Speed of the trunk, m/s; negative is backwards.
    pub speed_m_s: f64,
    /// Yaw rate of the trunk, rad/s; positive is to the left.
    pub yaw_rate_rad_s: f64,
    /// The trunk's posture.
    pub posture: Posture,
}

impl Command {
    /// Straight ahead and level at `speed_m_s` in the gait with index `gait`.
    pub fn ahead(gait: usize, speed_m_s: f64) -> Command {
        Command { gait: GaitChoice::Gait(gait), speed_m_s, ..Command::default() }
    }

    /// True if every number is finite.
    pub fn is_finite(&self) -> bool {
        let Posture { rise_m, pitch_rad, roll_rad, sway_m } = self.posture;
        [self.speed_m_s, self.yaw_rate_rad_s, rise_m, pitch_rad, roll_rad, sway_m]
            .iter()
            .all(|number| number.is_finite())
    }
}

/// The choice of gait.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum GaitChoice {
    /// No gait: every foot on the ground.
    #[default]
    Stand,
    /// The gait that fits the speed.
    Auto,
    /// This gait, index into [`crate::model::HorseMotion::gaits`]; at speed 0 it steps on the spot.
    Gait(usize),
}

/// The trunk's posture relative to standing level at the standing height.
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

/// A motion command for arms. Values beyond their capability are limited to it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StrokeCommand {
    /// The stroke.
    pub stroke: Stroke,
    /// Factor on the speed of strokes in the robot file, 0 or more.
    pub tempo: f64,
    /// Turn of the strokes towards a goal on the left, rad.
    pub turn_rad: f64,
}

/// A motion of the arms: a stroke of the table `motion::tentacle::strokes`, and its place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stroke {
    /// Its name in the table, in files and in options. Arms rest at a name that the table does not have.
    pub name: &'static str,
    /// Its place.
    pub place: Place,
}

/// The place of a stroke, body frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Place {
    /// No place: the stroke needs none.
    Nowhere,
    /// A point for a tip.
    Point {
        /// The point, body frame, m.
        in_body: DVec3,
        /// Direction of the tip, body frame, if it matters.
        direction: Option<DVec3>,
    },
    /// A path for a tip.
    Path(TipPath),
    /// A pole for an arm.
    Pole(Pole),
}

impl Default for StrokeCommand {
    fn default() -> StrokeCommand {
        StrokeCommand::of(Stroke::REST)
    }
}

impl StrokeCommand {
    /// This stroke, straight ahead at the robot file's tempo.
    pub fn of(stroke: Stroke) -> StrokeCommand {
        StrokeCommand { stroke, tempo: 1.0, turn_rad: 0.0 }
    }

    /// True if every number is finite.
    pub fn is_finite(&self) -> bool {
        self.stroke.place.is_finite() && self.tempo.is_finite() && self.turn_rad.is_finite()
    }
}

impl Stroke {
    /// Hold still in the parked pose.
    pub const REST: Stroke = Stroke::of("rest");
    /// The same, so that safety may restart servos.
    pub const PARK: Stroke = Stroke::of("park");
    /// Let go of a pole, back to rest.
    pub const LET_GO: Stroke = Stroke::of("let-go");

    /// The stroke of this name, which needs no place.
    pub const fn of(name: &'static str) -> Stroke {
        Stroke { name, place: Place::Nowhere }
    }
}

impl Place {
    /// True if every number is finite.
    pub fn is_finite(self) -> bool {
        match self {
            // A path is finite by construction.
            Place::Nowhere | Place::Path(_) => true,
            Place::Point { in_body, direction } => {
                in_body.is_finite() && direction.is_none_or(DVec3::is_finite)
            }
            Place::Pole(pole) => {
                pole.point_in_body.is_finite() && pole.axis.is_finite() && pole.radius_m.is_finite()
            }
        }
    }
}
