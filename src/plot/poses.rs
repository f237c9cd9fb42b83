//! The robot as a stick figure, one pose after another, seen from its right side (figures 4.3 to 4.6 of the horse
//! thesis) or from the front.

use glam::{DQuat, DVec3};
use plotters::element::{Circle, PathElement};
use plotters::style::text_anchor::HPos;
use plotters::style::{Color, RGBColor};

use super::PlotError;
use super::canvas::{
    Area, Drawn, FAINT, FAR, HEADING, INK, LABEL, LINE, NEAR, STANCE, SWING, TRUNK, WIDTH, fine, letters,
    line, picture, write, write_key,
};
use super::course::{Course, Frame};

const HEAD: u32 = 50;
const COLUMNS: u32 = 4;
const ROWS: u32 = 3;
const POSES: u32 = COLUMNS * ROWS;
/// Poses per swing.
const POSES_A_SWING: f64 = 3.0;
/// Space over and under a figure, pixels.
const ROOM: f64 = 26.0;
/// Space beside a figure, pixels.
const SIDE: f64 = 10.0;
/// Height of a figure, pixels.
const TALLEST: f64 = 200.0;

/// The direction from which the robot is seen.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum View {
    /// Its right side: forward is to the right.
    Right,
    /// Its front: its left is to the right.
    Front,
}

/// Twelve poses: over the first change of gait if there is one, three per swing; otherwise from the middle on.
///
/// # Errors
/// No known error: only the drawing library's signature contains them.
pub fn poses(course: &Course<'_>) -> Result<String, PlotError> {
    seen_from(course, View::Right)
}

/// The same poses seen from the front.
///
/// # Errors
/// The same as for [`poses`].
pub fn front(course: &Course<'_>) -> Result<String, PlotError> {
    seen_from(course, View::Front)
}

fn seen_from(course: &Course<'_>, view: View) -> Result<String, PlotError> {
    let figures: Vec<Figure> = moments(course).map(|frame| figure(course, frame, view)).collect();
    let all = || figures.iter().flat_map(|figure| figure.limbs.iter().flat_map(|limb| &limb.points));
    let (low, high) =
        all().fold((DVec3::ZERO, DVec3::ZERO), |(low, high), point| (low.min(*point), high.max(*point)));
    let width = f64::from(WIDTH / COLUMNS);
    let pixels_a_metre =
        ((width - 2.0 * SIDE) / (high.x - low.x).max(1e-3)).min(TALLEST / (high.z - low.z).max(1e-3));
    let row = (high.z - low.z) * pixels_a_metre + 2.0 * ROOM;
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a few hundred pixels")]
    let height = HEAD + (row * f64::from(ROWS)).ceil().clamp(1.0, 1e4) as u32;
    picture(height, |area| {
        write(
            area,
            match view {
                View::Right => "Poses, seen from the right: forward is to the right",
                View::Front => "Poses, seen from the front: its left is to the right",
            },
            (8.0, 16.0),
            &letters(HEADING, INK, HPos::Left),
        )?;
        let feet = [(STANCE, "standing"), (SWING, "in the air")];
        let sides = [(NEAR, "right limbs"), (FAR, "left limbs")];
        let key = if course.stances().is_empty() { sides.to_vec() } else { [feet, sides].concat() };
        write_key(area, 8.0, 38.0, &key)?;
        for (figure, place) in figures.iter().zip(0..) {
            let corner = (
                width * f64::from(place % COLUMNS) + SIDE - low.x * pixels_a_metre,
                f64::from(HEAD) + row * f64::from(place / COLUMNS + 1) - ROOM,
            );
            let at = |point: &DVec3| {
                (corner.0 + point.x * pixels_a_metre, corner.1 - (point.z - low.z) * pixels_a_metre)
            };
            let span = (at(&low).0, at(&high).0);
            draw_figure(area, figure, span, at)?;
        }
        Ok(())
    })
}

/// Frames to show.
fn moments<'a>(course: &'a Course<'_>) -> impl Iterator<Item = &'a Frame> {
    let (from_s, to_s) = course.times_s();
    let apart_s = course.mean_swing_s().map_or(f64::INFINITY, |swing_s| swing_s / POSES_A_SWING);
    let apart_s = apart_s.min((to_s - from_s) / f64::from(POSES));
    let half_s = 0.5 * apart_s * f64::from(POSES - 1);
    let change = course.spans().into_iter().find(|span| span.is_changing);
    let middle_s = change.map_or(0.5 * (from_s + to_s), |span| 0.5 * (span.from_s + span.to_s));
    let first_s = (middle_s - half_s).min(to_s - 2.0 * half_s).max(from_s);
    (0..POSES).filter_map(move |pose| {
        let time_s = first_s + f64::from(pose) * apart_s;
        let frame = course.frames.partition_point(|frame| frame.time_s < time_s - 1e-9);
        course.frames.get(frame.min(course.frames.len() - 1))
    })
}

/// Positions with x to the right of the picture, from the trunk's middle, and z above the ground, m.
pub(super) struct Figure {
    pub(super) label: String,
    pub(super) trunk: Vec<DVec3>,
    pub(super) limbs: Vec<Limb>,
}

pub(super) struct Limb {
    pub(super) points: Vec<DVec3>,
    pub(super) is_near: bool,
    pub(super) is_swing: Option<bool>,
}

fn figure(course: &Course<'_>, frame: &Frame, view: View) -> Figure {
    let robot = course.subject.robot;
    // Seen along the trunk's side, whatever its heading.
    let forward = frame.trunk_orientation * DVec3::X;
    let facing = DQuat::from_rotation_z(-forward.y.atan2(forward.x)) * frame.trunk_orientation;
    let seen = |in_body: DVec3| {
        let place = facing * in_body + DVec3::Z * frame.trunk_in_world.z;
        match view {
            View::Right => place,
            View::Front => DVec3::new(place.y, -place.x, place.z),
        }
    };
    let limb = |(index, chain): (usize, &crate::model::Chain)| {
        let angles = frame.goal_rad[chain.joints.clone()].iter().copied();
        Limb {
            points: robot.places_in_body(chain, angles).into_iter().map(seen).collect(),
            is_near: chain.root_m.y <= 0.0,
            is_swing: frame.feet.iter().find(|foot| foot.chain == index).map(|foot| foot.is_swing),
        }
    };
    let (back, front) = robot.root_extent();
    let middle = 0.5 * (back + front);
    let trunk = match view {
        View::Right if front.z - back.z > front.x - back.x => {
            vec![middle.with_z(back.z), middle.with_z(front.z)]
        }
        View::Right => vec![middle.with_x(back.x), middle.with_x(front.x)],
        View::Front => outline(robot, middle),
    };
    Figure {
        label: format!("{:.2} s, {}", frame.time_s, course.name_of_frame(frame)),
        trunk: trunk.into_iter().map(seen).collect(),
        limbs: robot.chains.iter().enumerate().map(limb).collect(),
    }
}

/// The limbs' roots, in order round `middle` as seen from the front.
fn outline(robot: &crate::model::Robot, middle: DVec3) -> Vec<DVec3> {
    let mut roots: Vec<DVec3> = robot.chains.iter().map(|chain| chain.root_m).collect();
    let turn = |root: &DVec3| (root.z - middle.z).atan2(root.y - middle.y);
    roots.sort_by(|a, b| turn(a).total_cmp(&turn(b)));
    roots.extend(roots.first().copied());
    roots
}

pub(super) fn draw_figure(
    area: &Area<'_>,
    figure: &Figure,
    span: (f64, f64),
    at: impl Fn(&DVec3) -> (f64, f64),
) -> Drawn {
    let place = |point: &DVec3| {
        let (x, y) = at(point);
        (fine(x), fine(y))
    };
    let ground = fine(at(&DVec3::ZERO).1);
    let stroke = |points: Vec<(i32, i32)>, color: RGBColor, width: f64| {
        area.draw(&PathElement::new(points, line(color, width)))
    };
    stroke(vec![(fine(span.0), ground), (fine(span.1), ground)], LINE, 1.0)?;
    for is_near in [false, true] {
        if is_near {
            stroke(figure.trunk.iter().map(place).collect(), TRUNK, 8.0)?;
        }
        for limb in figure.limbs.iter().filter(|limb| limb.is_near == is_near) {
            let color = if is_near { NEAR } else { FAR };
            stroke(limb.points.iter().map(place).collect(), color, 2.5)?;
            if let (Some(is_swing), Some(tip)) = (limb.is_swing, limb.points.last()) {
                let color = if is_swing { SWING } else { STANCE };
                area.draw(&Circle::new(place(tip), fine(3.0), color.filled()))?;
            }
        }
    }
    let below = at(&DVec3::ZERO).1 + 14.0;
    write(area, &figure.label, (0.5 * (span.0 + span.1), below), &letters(LABEL, FAINT, HPos::Center))
}
