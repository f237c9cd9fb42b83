//! A stroke of a motion script, and the places strokes go to.

use super::number::Limits;
use super::reader::Section;
use super::{POLE_MEANING, meters};
use crate::model::{Pole, Robot, TentacleMotion};
use crate::motion::tentacle::winder;
use crate::motion::{Stroke, StrokeCommand};

/// Fastest strokes, times the robot file's.
const TEMPO_MAX: f64 = 4.0;
/// Furthest turn towards a goal either way, degrees.
const TURN_MAX_DEG: f64 = 180.0;

/// The kinds of stroke a script may name.
#[derive(Debug, Clone, Copy)]
enum Kind {
    Placeless(Stroke),
    Reach,
    Wind,
}

/// What an entry asks for, which leaves as it was in the `last` one what it does not name.
pub(super) fn read(
    section: &Section<'_>,
    arms: (&Robot, &TentacleMotion),
    last: &mut StrokeCommand,
) -> Option<StrokeCommand> {
    let stroke = if section.has("stroke") { read_stroke(section, arms) } else { Some(last.stroke) };
    let meaning = "how many times as fast as the robot file says";
    let tempo = section.number_or("tempo", meaning, Limits::FromTo(0.0, TEMPO_MAX), last.tempo);
    let meaning = "the turn of the strokes in degrees, to the left if positive";
    let limits = Limits::FromTo(-TURN_MAX_DEG, TURN_MAX_DEG);
    let turn_deg = section.number_or("turn_deg", meaning, limits, last.turn_rad.to_degrees());
    *last = StrokeCommand { stroke: stroke?, tempo: tempo?, turn_rad: turn_deg?.to_radians() };
    Some(*last)
}

fn read_stroke(section: &Section<'_>, (robot, tentacle): (&Robot, &TentacleMotion)) -> Option<Stroke> {
    let placeless = Stroke::PLACELESS.map(|(name, stroke)| (name, Kind::Placeless(stroke)));
    let placed = [("reach", Kind::Reach), ("wind", Kind::Wind)];
    let kinds: Vec<_> = placeless.into_iter().chain(placed).collect();
    match section.choice("stroke", "a stroke", &kinds)? {
        Kind::Placeless(stroke) => Some(stroke),
        Kind::Reach => {
            let meaning = "the point to reach for, in the body, in mm";
            let point = match (section.has("point_mm"), tentacle.reach_in_body) {
                (false, Some(point)) => Some(point),
                _ => section.vector("point_mm", meaning).map(meters),
            };
            let direction = match section.has("direction") {
                false => Some(None),
                true => section.vector("direction", "where the tip is to point to, in the body").map(Some),
            };
            Some(Stroke::Reach { point_in_body: point?, direction: direction? })
        }
        Kind::Wind => {
            match (section.has("radius_mm") | section.has("point_mm") | section.has("axis"), tentacle.pole) {
                (false, Some(pole)) => Some(Stroke::Wind(pole)),
                _ => {
                    let pole = read_pole(section)?;
                    let Err(reason) = winder::check(robot, tentacle, pole) else {
                        return Some(Stroke::Wind(pole));
                    };
                    section.fault("point_mm", format!("{POLE_MEANING}: {reason}"));
                    None
                }
            }
        }
    }
}

/// A pole in the keys of `section`.
pub(super) fn read_pole(section: &Section<'_>) -> Option<Pole> {
    let point = section.vector("point_mm", "a point on the pole's axis, in the body, in mm");
    let axis = section.vector("axis", "the direction of the pole's axis, in the body");
    let axis = axis.and_then(|axis| {
        let unit = axis.try_normalize();
        if unit.is_none() {
            section.fault("axis", "a direction, such as [0, 0, 1] for an upright pole");
        }
        unit
    });
    let radius_mm = section.number("radius_mm", "the pole's radius in mm", Limits::Positive);
    Some(Pole { point_in_body: meters(point?), axis: axis?, radius_m: radius_mm? / 1000.0 })
}
