//! A change of gait by the thesis' own rule beside the robot's: position of each foot relative to its neutral
//! point.

use plotters::style::text_anchor::HPos;

use super::PlotError;
use super::canvas::{
    ALERT, Area, Axes, BAND, CHANGE, Drawn, FINE, HEADING, INK, LABEL, Mark, NARROW_LEFT, NUMBERS, STANCE,
    SWING, TITLE, WIDTH, draw_trace, fill, fine, letters, panel, picture, thinned, write, write_key,
};
use super::course::{Change, Course};
use crate::motion::horse::thesis_rule::ThesisRule;

const HEAD: u32 = 84;
const ROW: u32 = 104;
/// Free space over and under the traces, as a share.
const MARGIN: f64 = 0.06;
/// Time shown before the order to change, and after the end of the change, in swing times.
const BEFORE: f64 = 4.0;
const AFTER: f64 = 5.0;
/// Number of moments drawn for the thesis' rule.
const MOMENTS: u32 = 800;

/// One of the two rules.
struct Side<'a> {
    title: &'a str,
    /// Start and end of the change, s.
    change_s: (f64, f64),
    /// Trace of each foot.
    marks: Vec<Vec<Mark>>,
}

/// The first change of gait in `course`, which is `change`, beside the same change by the thesis' `rule`,
/// with feet that swing for `swing_s`. One row per foot; time 0 is the time of the order.
///
/// # Errors
/// No known error: only the drawing library's signature contains them.
pub fn comparison(
    course: &Course<'_>,
    change: &Change,
    rule: &ThesisRule,
    swing_s: f64,
) -> Result<String, PlotError> {
    let (first_s, last_s) = course.times_s();
    let from_s = (-BEFORE * swing_s).max(first_s - change.ordered_s);
    let to_s = (change.settled_s + AFTER * swing_s).min(last_s) - change.ordered_s;
    let sides = [thesis(rule, swing_s, (from_s, to_s)), own(course, change, (from_s, to_s))];
    let reach_m =
        course.subject.ranges.iter().map(|range| range.half_excursion_m).fold(f64::INFINITY, f64::min);
    let marks = sides.iter().flat_map(|side| side.marks.iter().flatten());
    let furthest_m = marks.map(|mark| mark.forward_m.abs()).fold(0.0, f64::max);
    let top_m = (1.0 + MARGIN) * if reach_m.is_finite() { furthest_m.max(reach_m) } else { furthest_m };

    let rows = u32::try_from(sides[1].marks.len()).unwrap_or(0);
    picture(HEAD + rows * (ROW + TITLE) + NUMBERS, |area| {
        let name = |side: usize| {
            let gait = course.subject.gait_names.get(change.gaits[side]).map_or("", String::as_str);
            format!("{gait} at {:.2} m/s", change.speeds_m_s[side])
        };
        let heading = format!("From {} to {}: each foot ahead of its neutral point, m", name(0), name(1));
        write(area, &heading, (8.0, 16.0), &letters(HEADING, INK, HPos::Left))?;
        let key = [
            (STANCE, "standing"),
            (SWING, "in the air"),
            (ALERT, "out of reach"),
            (BAND, "reach"),
            (CHANGE, "change of gait"),
        ];
        write_key(area, 8.0, 40.0, &key)?;
        for (place, side) in sides.iter().enumerate() {
            let middle = f64::from(WIDTH) * (0.25 + 0.5 * if place == 0 { 0.0 } else { 1.0 });
            write(area, side.title, (middle, 70.0), &letters(LABEL + 1.0, INK, HPos::Center))?;
        }
        let below = area.split_vertically(fine(f64::from(HEAD))).1;
        for (column, side) in below.split_evenly((1, 2)).iter().zip(&sides) {
            let mut rest = column.clone();
            for (foot, marks) in side.marks.iter().enumerate() {
                let is_last = foot + 1 == side.marks.len();
                let height = ROW + TITLE + if is_last { NUMBERS } else { 0 };
                let (own, below) = rest.split_vertically(i32::try_from(height * FINE).unwrap_or(0));
                rest = below;
                let axes = Axes {
                    title: Some(&course.foot_name(foot)),
                    left: NARROW_LEFT,
                    x: from_s..to_s,
                    y: -top_m..top_m,
                    x_label: is_last.then_some("time since the change was ordered, s"),
                    ticks: (6, 5),
                };
                draw_foot(&own, axes, side, marks, reach_m)?;
            }
        }
        Ok(())
    })
}

fn draw_foot(area: &Area<'_>, axes: Axes<'_>, side: &Side<'_>, marks: &[Mark], reach_m: f64) -> Drawn {
    let (time, height) = ((axes.x.start, axes.x.end), (axes.y.start, axes.y.end));
    let reach = reach_m.is_finite().then_some((-reach_m, reach_m));
    let mut panel = panel(area, axes, |panel| {
        fill(panel, side.change_s, height, CHANGE)?;
        reach.map_or(Ok(()), |reach| fill(panel, time, reach, BAND))
    })?;
    draw_trace(&mut panel, marks, reach)
}

fn thesis(rule: &ThesisRule, swing_s: f64, (from_s, to_s): (f64, f64)) -> Side<'static> {
    let mark = |leg: usize, moment: u32| {
        let time_s = from_s + (to_s - from_s) * f64::from(moment) / f64::from(MOMENTS);
        let foot = rule.foot(leg, time_s);
        Mark { time_s, forward_m: foot.forward_m, is_swing: foot.is_swing }
    };
    let landings = rule.legs().iter().map(|leg| leg.lift_off_s() + swing_s);
    Side {
        title: "the thesis' rule",
        change_s: (0.0, landings.fold(0.0, f64::max).min(to_s)),
        marks: (0..4).map(|leg| (0..=MOMENTS).map(|moment| mark(leg, moment)).collect()).collect(),
    }
}

fn own(course: &Course<'_>, change: &Change, (from_s, to_s): (f64, f64)) -> Side<'static> {
    let feet = course.frames.first().map_or(0, |frame| frame.feet.len());
    let mark = |foot: usize, frame: usize| {
        let frame = &course.frames[frame];
        let time_s = frame.time_s - change.ordered_s;
        let target = frame.feet.get(foot).filter(|_| (from_s..=to_s).contains(&time_s))?;
        Some(Mark { time_s, forward_m: target.excursion_m, is_swing: target.is_swing })
    };
    let under_way = course.spans().into_iter().find(|span| span.is_changing);
    let under_way = under_way.map_or((change.ordered_s, change.ordered_s), |span| (span.from_s, span.to_s));
    Side {
        title: "hippocamp's rule",
        change_s: (under_way.0 - change.ordered_s, under_way.1 - change.ordered_s),
        marks: (0..feet)
            .map(|foot| thinned(course).filter_map(|frame| mark(foot, frame)).collect())
            .collect(),
    }
}
