//! The same fall in two modes, as rows of stick figures: figures 1 and 2 of the paper on falling figures.

use glam::DVec3;
use plotters::style::text_anchor::HPos;

use super::PlotError;
use super::canvas::{FAR, HEADING, INK, LABEL, NEAR, TRUNK, WIDTH, letters, picture, write, write_key};
use super::poses::{Figure, Limb, draw_figure};
use crate::model::Robot;
use crate::trial::{Scene, Snapshot};

const HEAD: f64 = 54.0;
const COLUMNS: usize = 6;
/// Space for a row's name, and below it, pixels.
const NAME: f64 = 26.0;
const BELOW: f64 = 34.0;
/// Space beside a figure, pixels.
const SIDE: f64 = 6.0;
/// Largest height of a figure, pixels.
const TALLEST: f64 = 160.0;

/// One mode of falling.
#[derive(Debug)]
pub struct FallRow {
    /// Its name.
    pub name: &'static str,
    /// The trunk's largest impact, N.
    pub impact_n: f64,
    /// Its poses, from the push on.
    pub track: Vec<Snapshot>,
}

/// Draws `robot` in a fall, seen across the push, which goes to the right.
///
/// # Errors
/// No known error: only the drawing library's signature contains them.
pub fn fall(robot: &Robot, scene: &Scene, rows: &[FallRow]) -> Result<String, PlotError> {
    let last_s = rows.iter().filter_map(|row| row.track.last()).map(|last| last.time_s).fold(0.0, f64::max);
    let figures: Vec<Vec<Figure>> = rows.iter().map(|row| figures(robot, scene, row, last_s)).collect();
    let points = || {
        let all = figures.iter().flatten();
        all.flat_map(|figure| figure.trunk.iter().chain(figure.limbs.iter().flat_map(|limb| &limb.points)))
    };
    let (low, high) =
        points().fold((DVec3::ZERO, DVec3::ZERO), |(low, high), point| (low.min(*point), high.max(*point)));
    #[allow(clippy::cast_precision_loss, reason = "a handful")]
    let width = f64::from(WIDTH) / COLUMNS as f64;
    let fits = |pixels: f64, metres: f64| pixels / metres.max(1e-3);
    let pixels_a_metre = fits(width - 2.0 * SIDE, high.x - low.x).min(fits(TALLEST, high.z - low.z));
    let row_height = NAME + (high.z - low.z) * pixels_a_metre + BELOW;
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a few hundred pixels")]
    let height =
        (HEAD + row_height * f64::from(u32::try_from(rows.len()).unwrap_or(1))).clamp(1.0, 1e4) as u32;
    picture(height, |area| {
        let title = format!(
            "A push of {:.2} N s, {}, seen across it: the push goes to the right",
            scene.impulse_ns,
            side(scene.towards_rad)
        );
        write(area, &title, (8.0, 16.0), &letters(HEADING, INK, HPos::Left))?;
        write_key(area, 8.0, 38.0, &[(TRUNK, "trunk"), (NEAR, "right limbs"), (FAR, "left limbs")])?;
        let mut top = HEAD;
        for (row, figures) in rows.iter().zip(&figures) {
            let name = format!("{}: largest impact on the trunk {:.0} N", row.name, row.impact_n);
            write(area, &name, (8.0, top + 0.5 * NAME), &letters(LABEL, INK, HPos::Left))?;
            let mut left = SIDE;
            for figure in figures {
                let (x, floor) = (left - low.x * pixels_a_metre, top + row_height - BELOW);
                let at = |point: &DVec3| (x + point.x * pixels_a_metre, floor - point.z * pixels_a_metre);
                draw_figure(area, figure, (left, left + width - 2.0 * SIDE), at)?;
                left += width;
            }
            top += row_height;
        }
        Ok(())
    })
}

/// One pose per column, evenly spaced from the push to the end.
fn figures(robot: &Robot, scene: &Scene, row: &FallRow, last_s: f64) -> Vec<Figure> {
    let Some(first) = row.track.first() else { return Vec::new() };
    #[allow(clippy::cast_precision_loss, reason = "a handful")]
    let time_s = |column: usize| last_s * column as f64 / (COLUMNS - 1) as f64;
    let nearest = |time_s: f64| {
        let off_s = |pose: &&Snapshot| (pose.time_s - time_s).abs();
        row.track.iter().min_by(|a, b| off_s(a).total_cmp(&off_s(b))).unwrap_or(first)
    };
    (0..COLUMNS).map(|column| figure(robot, scene, first, nearest(time_s(column)))).collect()
}

fn figure(robot: &Robot, scene: &Scene, first: &Snapshot, pose: &Snapshot) -> Figure {
    // The push is in the trunk's frame at that moment.
    let heading = first.turn * DVec3::X;
    let towards = scene.towards_rad + heading.y.atan2(heading.x);
    let along = DVec3::new(towards.cos(), towards.sin(), 0.0);
    let seen = |in_body: DVec3| {
        let place = pose.position_m + pose.turn * in_body;
        let from_start = place - first.position_m.with_z(0.0);
        DVec3::new(from_start.dot(along), 0.0, place.z)
    };
    let half = 0.5 * robot.physics.as_ref().and_then(|physics| physics.trunk_box_m).unwrap_or_default();
    let middle = robot.trunk_center_m;
    // Two of its faces and the edges that join them: every edge at least once.
    let corner = |x: f64, y: f64, z: f64| seen(middle + half * DVec3::new(x, y, z));
    let face = |x: f64| {
        [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0)].map(|(y, z)| corner(x, y, z))
    };
    let trunk = face(-1.0).into_iter().chain(face(1.0)).collect();
    let limbs = robot.chains.iter().map(|chain| {
        let angles = pose.angles_rad.get(chain.joints.clone()).unwrap_or_default();
        Limb {
            points: robot.places_in_body(chain, angles.iter().copied()).into_iter().map(seen).collect(),
            is_near: chain.root_m.y <= 0.0,
            is_swing: None,
        }
    });
    let label = format!("{:.2} s{}", pose.time_s, if pose.is_down { ", down" } else { "" });
    Figure { label, trunk, limbs: limbs.collect() }
}

/// Direction of a push in words; `towards_rad` from ahead to the left.
fn side(towards_rad: f64) -> String {
    let left_deg = (towards_rad.to_degrees() + 180.0).rem_euclid(360.0) - 180.0;
    match left_deg.round() {
        0.0 => "straight ahead".to_owned(),
        -180.0 => "straight back".to_owned(),
        left if left > 0.0 => format!("{left:.0} degrees to the left of ahead"),
        right => format!("{:.0} degrees to the right of ahead", -right),
    }
}

#[cfg(test)]
mod tests {
    use super::side;

    #[test]
    fn the_direction_of_a_fall_is_named_by_the_shorter_angle() {
        let told = [0.0_f64, 27.0, 180.0, 315.0, 359.9].map(|deg| side(deg.to_radians()));
        let to = |way: &str| format!("{way} of ahead");
        let (left, right) = (to("27 degrees to the left"), to("45 degrees to the right"));
        assert_eq!(told, ["straight ahead", &left, "straight back", &right, "straight ahead"]);
    }
}
