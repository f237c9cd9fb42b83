//! A stroke of a motion script, and its targets in space.

use glam::DVec3;

use super::number::Limits;
use super::reader::Section;
use super::{POLE_MEANING, meters};
use crate::model::{Pole, Robot, TentacleMotion, TipPath, WAYPOINTS_MAX};
use crate::motion::tentacle::route::sweep_towards;
use crate::motion::tentacle::strokes::{Needs, STROKES};
use crate::motion::tentacle::winder;
use crate::motion::{Place, Stroke, StrokeCommand};

/// Highest tempo, times the robot file's.
const TEMPO_MAX: f64 = 4.0;
/// Largest turn towards a goal either way, degrees.
const TURN_MAX_DEG: f64 = 180.0;

/// The stroke of an entry; values that the entry does not name stay as in `last`.
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
    let turn_rad = match section.has("goal_mm") {
        true => read_goal(section),
        false => {
            let turn_deg = section.number_or("turn_deg", meaning, limits, last.turn_rad.to_degrees());
            turn_deg.map(f64::to_radians)
        }
    };
    *last = StrokeCommand { stroke: stroke?, tempo: tempo?, turn_rad: turn_rad? };
    Some(*last)
}

/// The turn towards a goal, rad.
fn read_goal(section: &Section<'_>) -> Option<f64> {
    if section.has("turn_deg") {
        section.fault("goal_mm", "no such key beside turn_deg: strokes turn to the goal, or by an angle");
        return None;
    }
    let goal_mm = section.vector("goal_mm", "the point that strokes turn to, in the body, in mm")?;
    if goal_mm.truncate().length() <= 0.0 {
        section.fault("goal_mm", "a point beside the body's z axis: strokes turn to the left or the right");
        return None;
    }
    Some(sweep_towards(0.0, goal_mm, TURN_MAX_DEG.to_radians()))
}

fn read_stroke(section: &Section<'_>, arms: (&Robot, &TentacleMotion)) -> Option<Stroke> {
    let kinds: Vec<_> = STROKES.iter().map(|kind| (kind.name, kind)).collect();
    let kind = section.choice("stroke", "a stroke", &kinds)?;
    Some(Stroke { name: kind.name, place: read_place(section, kind.needs, arms)? })
}

/// The place of a stroke that needs `needs`: that of the entry, or else that of the robot file.
fn read_place(
    section: &Section<'_>,
    needs: Needs,
    (robot, tentacle): (&Robot, &TentacleMotion),
) -> Option<Place> {
    match needs {
        Needs::Nothing => Some(Place::Nowhere),
        Needs::Point => {
            let meaning = "the point to reach for, in the body, in mm";
            let point = match (section.has("point_mm"), tentacle.reach_in_body) {
                (false, Some(point)) => Some(point),
                _ => section.vector("point_mm", meaning).map(meters),
            };
            let direction = match section.has("direction") {
                false => Some(None),
                true => read_direction(section, "direction", "where the tip is to point to, in the body")
                    .map(Some),
            };
            Some(Place::Point { in_body: point?, direction: direction? })
        }
        Needs::Path => {
            match (section.has("points_mm") | section.has("speed_mm_s"), tentacle.path.as_deref()) {
                (false, Some(path)) => Some(Place::Path(*path)),
                _ => read_path(section).map(Place::Path),
            }
        }
        Needs::Pole => {
            match (section.has("radius_mm") | section.has("point_mm") | section.has("axis"), tentacle.pole) {
                (false, Some(pole)) => Some(Place::Pole(pole)),
                _ => {
                    let pole = read_pole(section)?;
                    let Err(reason) = winder::check(robot, tentacle, pole) else {
                        return Some(Place::Pole(pole));
                    };
                    section.fault("point_mm", format!("{POLE_MEANING}: {reason}"));
                    None
                }
            }
        }
    }
}

/// A path from the keys of `section`.
pub(super) fn read_path(section: &Section<'_>) -> Option<TipPath> {
    let meaning = "the places the tip goes through, in the body, in mm";
    let points_mm = section.vectors("points_mm", meaning, 2..=WAYPOINTS_MAX);
    let meaning = "the speed of the tip along the path in mm/s";
    let speed_mm_s = section.number("speed_mm_s", meaning, Limits::LENGTH);
    let points_m: Vec<_> = points_mm?.into_iter().map(meters).collect();
    let path = TipPath::new(&points_m, speed_mm_s? / 1000.0);
    path.map_err(|error| section.fault("points_mm", error.to_string())).ok()
}

/// A pole from the keys of `section`.
pub(super) fn read_pole(section: &Section<'_>) -> Option<Pole> {
    let point = section.vector("point_mm", "a point on the pole's axis, in the body, in mm");
    let axis = read_direction(section, "axis", "the direction of the pole's axis, in the body");
    let radius_mm = section.number("radius_mm", "the pole's radius in mm", Limits::LENGTH);
    Some(Pole { point_in_body: meters(point?), axis: axis?, radius_m: radius_mm? / 1000.0 })
}

/// A direction, normalised.
fn read_direction(section: &Section<'_>, key: &'static str, meaning: &'static str) -> Option<DVec3> {
    let unit = section.vector(key, meaning)?.try_normalize();
    if unit.is_none() {
        section.fault(key, "a direction, such as [0, 0, 1] for straight up");
    }
    unit
}
