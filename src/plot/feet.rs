//! Position of each foot, fore and aft of its root, over time: figures 4.7 and 4.8 of the horse thesis, for
//! all legs.

use plotters::style::text_anchor::HPos;

use super::PlotError;
use super::canvas::{ALERT, CHANGE, LEFT};
use super::canvas::{
    Axes, BAND, HEADING, INK, Mark, NUMBERS, STANCE, SWING, TITLE, draw_trace, fill, fine, letters,
    name_gaits, panel, picture, shade_changes, thinned, write, write_key,
};
use super::course::Course;

const HEAD: u32 = 66;
const ROW: u32 = 96;
/// Free space over and under the traces, as a share.
const MARGIN: f64 = 0.1;

/// One row per foot; the band is the foot's permitted range.
///
/// # Errors
/// No known error: only the drawing library's signature contains them.
pub fn feet(course: &Course<'_>) -> Result<String, PlotError> {
    let traces = traces(course);
    let rows = u32::try_from(traces.len()).unwrap_or(0);
    let height = HEAD + rows * (ROW + TITLE) + NUMBERS;
    picture(height, |area| {
        write(area, "Each foot ahead of its root, m", (8.0, 16.0), &letters(HEADING, INK, HPos::Left))?;
        let key = [
            (STANCE, "standing"),
            (SWING, "in the air"),
            (ALERT, "out of reach"),
            (BAND, "reach"),
            (CHANGE, "change of gait"),
        ];
        write_key(area, f64::from(LEFT), 38.0, &key)?;
        name_gaits(area, course, 58.0)?;
        let (mut rest, time) = (area.split_vertically(fine(f64::from(HEAD))).1, course.times_s());
        for (row, trace) in traces.iter().enumerate() {
            let is_last = row + 1 == traces.len();
            let row_height = ROW + TITLE + if is_last { NUMBERS } else { 0 };
            let (own, below) = rest.split_vertically(fine(f64::from(row_height)));
            rest = below;
            let (low, high) = trace.extent();
            let axes = Axes {
                title: Some(&trace.name),
                left: LEFT,
                x: time.0..time.1,
                y: low..high,
                x_label: is_last.then_some("time since the robot stood, s"),
                ticks: (10, 4),
            };
            let mut panel = panel(&own, axes, |panel| {
                shade_changes(panel, course, (low, high))?;
                trace.band.map_or(Ok(()), |band| fill(panel, time, band, BAND))
            })?;
            draw_trace(&mut panel, &trace.marks, trace.band)?;
        }
        Ok(())
    })
}

/// A foot's trace.
struct Trace {
    name: String,
    band: Option<(f64, f64)>,
    marks: Vec<Mark>,
}

fn traces(course: &Course<'_>) -> Vec<Trace> {
    let robot = course.subject.robot;
    // A course contains only times when the robot is on its feet: all frames have the same feet.
    let feet = course.frames.first().map_or(&[][..], |frame| &frame.feet);
    let trace = |(index, foot): (usize, &crate::signals::FootTarget)| {
        let chain = &robot.chains[foot.chain];
        let mark = |frame: usize| {
            let frame = &course.frames[frame];
            let foot = frame.feet.get(index)?;
            let in_body = frame.trunk_orientation.inverse() * (foot.in_world - frame.trunk_in_world);
            let forward_m = in_body.x - chain.root_m.x;
            Some(Mark { time_s: frame.time_s, forward_m, is_swing: foot.is_swing })
        };
        let band = course.subject.ranges.iter().find(|range| range.chain == foot.chain).map(|range| {
            let middle_m = range.neutral_m - chain.root_m.x;
            (middle_m - range.half_excursion_m, middle_m + range.half_excursion_m)
        });
        Trace { name: course.foot_name(index), band, marks: thinned(course).filter_map(mark).collect() }
    };
    feet.iter().enumerate().map(trace).collect()
}

impl Trace {
    /// Lowest and highest position to show, m.
    fn extent(&self) -> (f64, f64) {
        let band = self.band.into_iter().flat_map(|(low, high)| [low, high]);
        let all = self.marks.iter().map(|mark| mark.forward_m).chain(band);
        let (low, high) = all
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)));
        let free = MARGIN * (high - low).max(1e-3);
        (low - free, high + free)
    }
}
