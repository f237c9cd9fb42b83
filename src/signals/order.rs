//! The operator's orders: for a horse gait, speed, turn and posture; for arms a stroke; for a figure a pose.

use glam::DVec3;
use serde::{Deserialize, Serialize};

use crate::model::{Pole, TentacleMotion, TipPath};

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

/// A motion of the arms.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Stroke {
    /// Go to the parked pose and stay there.
    Park,
    /// Hold still in the pose in which they left the parked pose.
    #[default]
    Rest,
    /// Sway idly.
    Sway,
    /// Walking strokes, each arm in its own role (Ishizuka 2008, 3.3.1).
    Walk,
    /// Swimming strokes, all arms alike (3.3.2).
    Swim,
    /// Bring the tip to a point.
    Reach {
        /// The point, body frame, m.
        point_in_body: DVec3,
        /// Direction of the tip, body frame, if it matters.
        direction: Option<DVec3>,
    },
    /// Bring the tip to the start of a path, and then along it.
    Path(TipPath),
    /// Wind round a pole.
    Wind(Pole),
    /// Unwind, back to rest.
    LetGo,
}

impl Default for StrokeCommand {
    fn default() -> StrokeCommand {
        StrokeCommand::of(Stroke::default())
    }
}

impl StrokeCommand {
    /// This stroke, straight ahead at the robot file's tempo.
    pub fn of(stroke: Stroke) -> StrokeCommand {
        StrokeCommand { stroke, tempo: 1.0, turn_rad: 0.0 }
    }

    /// True if every number is finite.
    pub fn is_finite(&self) -> bool {
        let place_is_finite = match self.stroke {
            Stroke::Reach { point_in_body, direction } => {
                point_in_body.is_finite() && direction.is_none_or(DVec3::is_finite)
            }
            Stroke::Wind(pole) => {
                pole.point_in_body.is_finite() && pole.axis.is_finite() && pole.radius_m.is_finite()
            }
            _ => true,
        };
        place_is_finite && self.tempo.is_finite() && self.turn_rad.is_finite()
    }
}

impl Stroke {
    /// Every stroke that needs no position, by its name in files and options.
    pub const PLACELESS: [(&str, Stroke); 6] = [
        ("park", Stroke::Park),
        ("rest", Stroke::Rest),
        ("sway", Stroke::Sway),
        ("walk", Stroke::Walk),
        ("swim", Stroke::Swim),
        ("let-go", Stroke::LetGo),
    ];

    /// The stroke of this name, to its position in the robot file; `None` if there is no such stroke or position.
    pub fn named(name: &str, tentacle: &TentacleMotion) -> Option<Stroke> {
        match name {
            "reach" => {
                tentacle.reach_in_body.map(|point_in_body| Stroke::Reach { point_in_body, direction: None })
            }
            "path" => tentacle.path.as_deref().copied().map(Stroke::Path),
            "wind" => tentacle.pole.map(Stroke::Wind),
            name => Stroke::PLACELESS.iter().find(|(known, _)| *known == name).map(|(_, stroke)| *stroke),
        }
    }

    /// Its name in files and options.
    pub fn name(self) -> &'static str {
        match self {
            Stroke::Park => "park",
            Stroke::Rest => "rest",
            Stroke::Sway => "sway",
            Stroke::Walk => "walk",
            Stroke::Swim => "swim",
            Stroke::Reach { .. } => "reach",
            Stroke::Path(_) => "path",
            Stroke::Wind(_) => "wind",
            Stroke::LetGo => "let-go",
        }
    }
}
