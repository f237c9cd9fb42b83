//! The angle of every joint over time, and its range of motion: one column per chain, one row per joint.

use plotters::style::text_anchor::HPos;

use super::PlotError;
use super::canvas::{
    Area, Axes, BAND, CHANGE, Drawn, HEADING, INK, NARROW_LEFT, NEAR, NUMBERS, TITLE, draw, fill, fine,
    letters, line, panel, picture, shade_changes, thinned, write, write_key,
};
use super::course::Course;
use crate::model::{Chain, Joint};

const HEAD: u32 = 50;
const ROW: u32 = 84;
/// Number of chains side by side.
const COLUMNS: usize = 2;
/// Free space over and under the curves, as a share.
const MARGIN: f64 = 0.08;

/// One panel per joint, from the body outwards; the band is the joint's range. Angles after safety.
///
/// # Errors
/// No known error: only the drawing library's signature contains them.
pub fn joints(course: &Course<'_>) -> Result<String, PlotError> {
    let robot = course.subject.robot;
    let bands: Vec<&[Chain]> = robot.chains.chunks(COLUMNS).collect();
    let rows = |band: &[Chain]| {
        let longest = band.iter().map(|chain| chain.joints.len()).max().unwrap_or(0);
        u32::try_from(longest).unwrap_or(0)
    };
    let band_height = |band: &[Chain]| rows(band) * (ROW + TITLE) + NUMBERS;
    let height = HEAD + bands.iter().map(|band| band_height(band)).sum::<u32>();
    picture(height, |area| {
        write(area, "Each joint, degrees", (8.0, 16.0), &letters(HEADING, INK, HPos::Left))?;
        write_key(area, 8.0, 38.0, &[(NEAR, "goal"), (BAND, "range"), (CHANGE, "change of gait")])?;
        let mut rest = area.split_vertically(fine(f64::from(HEAD))).1;
        for band in &bands {
            let (own, below) = rest.split_vertically(fine(f64::from(band_height(band))));
            rest = below;
            for (column, chain) in own.split_evenly((1, COLUMNS)).iter().zip(*band) {
                let mut rest = column.clone();
                for index in chain.joints.clone() {
                    let is_last = index + 1 == chain.joints.end;
                    let row_height = ROW + TITLE + if is_last { NUMBERS } else { 0 };
                    let (own, below) = rest.split_vertically(fine(f64::from(row_height)));
                    rest = below;
                    draw_joint(&own, course, index, is_last)?;
                }
            }
        }
        Ok(())
    })
}

fn draw_joint(area: &Area<'_>, course: &Course<'_>, index: usize, is_last: bool) -> Drawn {
    let Joint { name, range_rad: (low, high), .. } = &course.subject.robot.joints[index];
    let range = (low.to_degrees(), high.to_degrees());
    let points: Vec<(f64, f64)> = thinned(course)
        .map(|frame| &course.frames[frame])
        .map(|frame| (frame.time_s, frame.goal_rad[index].to_degrees()))
        .collect();
    let angles = points.iter().map(|point| point.1);
    let (low, high) = angles.fold(range, |(low, high), angle| (low.min(angle), high.max(angle)));
    let free = MARGIN * (high - low).max(1e-3);
    let time = course.times_s();
    let axes = Axes {
        title: Some(&name.replace('_', " ").replace('.', ", ")),
        left: NARROW_LEFT,
        x: time.0..time.1,
        y: low - free..high + free,
        x_label: is_last.then_some("time since the robot stood, s"),
        ticks: (5, 4),
    };
    let mut panel = panel(area, axes, |panel| {
        shade_changes(panel, course, (low - free, high + free))?;
        fill(panel, time, range, BAND)
    })?;
    draw(&mut panel, points, line(NEAR, 1.4))
}
