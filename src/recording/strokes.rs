//! A stroke as recorded: flat fields, since readers of recordings have no unions.

use std::fmt;

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::messages::Vector3;
use crate::model::{Pole, TipPath};
use crate::motion::tentacle::strokes::{self, Needs};
use crate::motion::{Place, Stroke, StrokeCommand};

/// A [`StrokeCommand`] in the fields of a message.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StrokeFields {
    /// Name of the stroke.
    stroke: String,
    tempo: f64,
    turn_rad: f64,
    /// Target of `reach`, or point of `wind`, body frame, m.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    point: Option<Vector3>,
    /// Direction of the tip in `reach`, if it matters, or the axis of `wind`, body frame.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    direction: Option<Vector3>,
    /// Radius of `wind`.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    radius_m: Option<f64>,
    /// Waypoints of `path`, body frame, m.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    waypoints: Option<Vec<Vector3>>,
    /// Speed of `path`.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    speed_m_s: Option<f64>,
}

impl From<StrokeCommand> for StrokeFields {
    fn from(command: StrokeCommand) -> StrokeFields {
        let (point, direction, radius_m, path) = match command.stroke.place {
            Place::Nowhere => (None, None, None, None),
            Place::Point { in_body, direction } => (Some(in_body), direction, None, None),
            Place::Path(path) => (None, None, None, Some(path)),
            Place::Pole(pole) => (Some(pole.point_in_body), Some(pole.axis), Some(pole.radius_m), None),
        };
        StrokeFields {
            stroke: command.stroke.name.to_owned(),
            tempo: command.tempo,
            turn_rad: command.turn_rad,
            point: point.map(Vector3::from),
            direction: direction.map(Vector3::from),
            radius_m,
            waypoints: path.map(|path| path.waypoints().iter().copied().map(Vector3::from).collect()),
            speed_m_s: path.map(|path| path.speed_m_s()),
        }
    }
}

impl fmt::Display for StrokeFields {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} at tempo {}", self.stroke, self.tempo)
    }
}

impl TryFrom<&StrokeFields> for StrokeCommand {
    type Error = &'static str;

    fn try_from(fields: &StrokeFields) -> Result<StrokeCommand, Self::Error> {
        let point = || fields.point.map(DVec3::from).ok_or("a stroke to a place that names none");
        let kind = strokes::find(&fields.stroke).ok_or("a stroke of an unknown name")?;
        let place = match kind.needs {
            Needs::Nothing => Place::Nowhere,
            Needs::Point => Place::Point { in_body: point()?, direction: fields.direction.map(DVec3::from) },
            Needs::Path => {
                let waypoints = fields.waypoints.as_deref().unwrap_or_default();
                let waypoints: Vec<DVec3> = waypoints.iter().copied().map(DVec3::from).collect();
                let speed_m_s = fields.speed_m_s.ok_or("a path without a speed")?;
                let path = TipPath::new(&waypoints, speed_m_s);
                Place::Path(path.map_err(|_| "a path without places or speed")?)
            }
            Needs::Pole => Place::Pole(Pole {
                point_in_body: point()?,
                axis: fields.direction.map(DVec3::from).ok_or("a pole without an axis")?,
                radius_m: fields.radius_m.ok_or("a pole without a radius")?,
            }),
        };
        let stroke = Stroke { name: kind.name, place };
        Ok(StrokeCommand { stroke, tempo: fields.tempo, turn_rad: fields.turn_rad })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strokes_round_trip_through_a_recording() {
        let pole = Pole { point_in_body: DVec3::X, axis: DVec3::Y, radius_m: 0.03 };
        let path = TipPath::new(&[DVec3::X, DVec3::new(0.1, 0.2, 0.3), DVec3::Z], 0.08).unwrap();
        for kind in strokes::STROKES {
            let places = match kind.needs {
                Needs::Nothing => vec![Place::Nowhere],
                Needs::Point => [None, Some(DVec3::NEG_Y)]
                    .map(|direction| Place::Point { in_body: DVec3::Z, direction })
                    .to_vec(),
                Needs::Path => vec![Place::Path(path)],
                Needs::Pole => vec![Place::Pole(pole)],
            };
            for place in places {
                let stroke = Stroke { name: kind.name, place };
                let command = StrokeCommand { stroke, tempo: 0.7, turn_rad: -0.2 };
                let text = serde_json::to_string(&StrokeFields::from(command)).unwrap();
                let fields: StrokeFields = serde_json::from_str(&text).unwrap();
                assert_eq!(StrokeCommand::try_from(&fields), Ok(command), "{text}");
            }
        }
    }
}
