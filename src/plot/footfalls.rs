//! The times when each foot is on the ground: Hildebrand's diagram, one bar per stance.

use plotters::element::Rectangle;
use plotters::style::Color;
use plotters::style::text_anchor::HPos;

use super::PlotError;
use super::canvas::{
    Axes, CHANGE, HEADING, INK, LABEL, LEFT, NUMBERS, fine, letters, name_gaits, panel, picture,
    shade_changes, write, write_key,
};
use super::course::Course;

const HEAD: u32 = 70;
const ROW: u32 = 30;
/// Share of a row a bar fills.
const BAR: f64 = 0.56;

/// One row per foot.
///
/// # Errors
/// No known error: only the drawing library's signature contains them.
pub fn footfalls(course: &Course<'_>) -> Result<String, PlotError> {
    let stances = course.stances();
    let rows = u32::try_from(stances.len()).unwrap_or(0);
    let height = HEAD + rows * ROW + NUMBERS;
    picture(height, |area| {
        write(area, "Feet on the ground", (8.0, 16.0), &letters(HEADING, INK, HPos::Left))?;
        write_key(area, f64::from(LEFT), 38.0, &[(INK, "standing"), (CHANGE, "change of gait")])?;
        name_gaits(area, course, 58.0)?;
        let time = course.times_s();
        let down = f64::from(rows);
        let (_, own) = area.split_vertically(fine(f64::from(HEAD)));
        let axes = Axes {
            title: None,
            left: LEFT,
            x: time.0..time.1,
            // The first foot is at the top.
            y: down..0.0,
            x_label: Some("time since the robot stood, s"),
            ticks: (10, 0),
        };
        let mut panel = panel(&own, axes, |panel| shade_changes(panel, course, (0.0, down)))?;
        let names = letters(LABEL, INK, HPos::Right);
        for (row, stances) in stances.iter().enumerate() {
            let middle = f64::from(u32::try_from(row).unwrap_or(0)) + 0.5;
            let bar = |(from_s, to_s): &(f64, f64)| {
                let (top, bottom) = (middle - 0.5 * BAR, middle + 0.5 * BAR);
                Rectangle::new([(*from_s, top), (*to_s, bottom)], INK.filled())
            };
            panel.draw_series(stances.iter().map(bar))?;
            let down = f64::from(HEAD) + middle * f64::from(ROW);
            write(area, &course.foot_name(row), (f64::from(LEFT) - 8.0, down), &names)?;
        }
        Ok(())
    })
}
