//! A stroke as it is recorded: flat fields, since readers of recordings know no unions.

use std::fmt;

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::messages::Vector3;
use crate::model::Pole;
use crate::motion::{Stroke, StrokeCommand};

/// A [`StrokeCommand`] in the fields of a message.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StrokeFields {
    /// Name of the stroke.
    stroke: String,
    tempo: f64,
    turn_rad: f64,
    /// Of `reach` and `wind`, body frame, m.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    point: Option<Vector3>,
    /// Of `reach` where the tip's direction matters, and the axis of `wind`, body frame.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    direction: Option<Vector3>,
    /// Of `wind`.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    radius_m: Option<f64>,
}

impl From<StrokeCommand> for StrokeFields {
    fn from(command: StrokeCommand) -> StrokeFields {
        let (point, direction, radius_m) = match command.stroke {
            Stroke::Reach { point_in_body, direction } => (Some(point_in_body), direction, None),
            Stroke::Wind(pole) => (Some(pole.point_in_body), Some(pole.axis), Some(pole.radius_m)),
            _ => (None, None, None),
        };
        StrokeFields {
            stroke: command.stroke.name().to_owned(),
            tempo: command.tempo,
            turn_rad: command.turn_rad,
            point: point.map(Vector3::from),
            direction: direction.map(Vector3::from),
            radius_m,
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
        let stroke = match fields.stroke.as_str() {
            "reach" => {
                Stroke::Reach { point_in_body: point()?, direction: fields.direction.map(DVec3::from) }
            }
            "wind" => Stroke::Wind(Pole {
                point_in_body: point()?,
                axis: fields.direction.map(DVec3::from).ok_or("a pole without an axis")?,
                radius_m: fields.radius_m.ok_or("a pole without a radius")?,
            }),
            name => {
                let found = Stroke::PLACELESS.iter().find(|(known, _)| *known == name);
                found.map(|(_, stroke)| *stroke).ok_or("a stroke of an unknown name")?
            }
        };
        Ok(StrokeCommand { stroke, tempo: fields.tempo, turn_rad: fields.turn_rad })
    }
}
