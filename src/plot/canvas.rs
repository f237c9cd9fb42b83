//! Common parts of all pictures: size, colours, letters, panels with a time axis.

use std::ops::Range;

use plotters::coord::Shift;
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::PlotError;
use super::course::Course;

/// Width of every picture, pixels.
pub(super) const WIDTH: u32 = 800;
/// The library places everything on whole pixels; a pixel of the picture is this many of them.
pub(super) const FINE: u32 = 4;
/// Space left of a panel for numbers and names, and right of it, pixels.
pub(super) const LEFT: u32 = 76;
pub(super) const RIGHT: u32 = 12;
/// Space left of a panel that shares the width with others, pixels.
pub(super) const NARROW_LEFT: u32 = 44;
/// Sizes of letters, pixels.
pub(super) const HEADING: f64 = 15.0;
pub(super) const LABEL: f64 = 12.0;

// The colours of the page that plays recordings.
pub(super) const PAPER: RGBColor = RGBColor(0xff, 0xff, 0xff);
pub(super) const INK: RGBColor = RGBColor(0x22, 0x26, 0x2b);
pub(super) const FAINT: RGBColor = RGBColor(0x6b, 0x70, 0x77);
pub(super) const LINE: RGBColor = RGBColor(0xdd, 0xda, 0xd2);
pub(super) const NEAR: RGBColor = RGBColor(0x2b, 0x5c, 0x8a);
pub(super) const FAR: RGBColor = RGBColor(0xa9, 0xbf, 0xd3);
pub(super) const TRUNK: RGBColor = RGBColor(0xd9, 0xc7, 0xa8);
pub(super) const STANCE: RGBColor = RGBColor(0x2f, 0x7d, 0x4f);
pub(super) const SWING: RGBColor = RGBColor(0xe0, 0x8a, 0x1e);
pub(super) const ALERT: RGBColor = RGBColor(0xc2, 0x36, 0x6b);
/// Permitted range.
pub(super) const BAND: RGBColor = RGBColor(0xdc, 0xe8, 0xf2);
/// Change of gait.
pub(super) const CHANGE: RGBColor = RGBColor(0xf6, 0xe3, 0xc4);

/// Opacity of both, so that each shows through the other.
const OPACITY: f64 = 0.7;

pub(super) type Drawn<T = ()> = Result<T, DrawingAreaErrorKind<std::io::Error>>;
pub(super) type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
pub(super) type Panel<'a, 'b> = ChartContext<'a, SVGBackend<'b>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;

/// A picture `height` pixels high, drawn by `draw` in fine pixels.
pub(super) fn picture(height: u32, draw: impl FnOnce(&Area<'_>) -> Drawn) -> Result<String, PlotError> {
    let mut svg = String::new();
    {
        let area = SVGBackend::with_string(&mut svg, (WIDTH * FINE, height * FINE)).into_drawing_area();
        let drawn = area.fill(&PAPER).and_then(|()| draw(&area)).and_then(|()| area.present());
        drawn.map_err(|error| PlotError(error.to_string()))?;
    }
    let fine = format!("width=\"{}\" height=\"{}\"", WIDTH * FINE, height * FINE);
    Ok(svg.replacen(&fine, &format!("width=\"{WIDTH}\" height=\"{height}\""), 1))
}

/// Pixels as the library counts them.
pub(super) fn fine(pixels: f64) -> i32 {
    #[allow(clippy::cast_possible_truncation, reason = "a few thousand at most")]
    {
        (pixels * f64::from(FINE)).round() as i32
    }
}

/// Style for letters `size` pixels high. The library has its own unit for sizes.
pub(super) fn letters(size: f64, color: RGBColor, horizontal: HPos) -> TextStyle<'static> {
    let font = ("sans-serif", size * 1.24 * f64::from(FINE)).into_font();
    font.color(&color).pos(Pos::new(horizontal, VPos::Center))
}

/// Writes `text` at a position in pixels.
pub(super) fn write(area: &Area<'_>, text: &str, at: (f64, f64), style: &TextStyle<'_>) -> Drawn {
    area.draw(&Text::new(text, (fine(at.0), fine(at.1)), style.clone()))
}

/// A line `width` pixels wide.
pub(super) fn line(color: RGBColor, width: f64) -> ShapeStyle {
    let width = u32::try_from(fine(width)).unwrap_or(1);
    ShapeStyle { color: color.into(), filled: true, stroke_width: width }
}

/// Axes and labels of a panel.
pub(super) struct Axes<'a> {
    /// Title above the panel, if any.
    pub(super) title: Option<&'a str>,
    /// Space left of it, pixels.
    pub(super) left: u32,
    pub(super) x: Range<f64>,
    pub(super) y: Range<f64>,
    /// Label below the horizontal axis; without it that axis has no numbers either.
    pub(super) x_label: Option<&'a str>,
    /// Approximate count of numbers on the axes; 0 across for none at all.
    pub(super) ticks: (usize, usize),
}

/// Height of a panel's title, and of the numbers and the label below it, pixels.
pub(super) const TITLE: u32 = 20;
pub(super) const NUMBERS: u32 = 40;

/// A panel that fills `area`. What `under` draws lies under the grid.
pub(super) fn panel<'a, 'b>(
    area: &Area<'b>,
    axes: Axes<'_>,
    under: impl FnOnce(&mut Panel<'a, 'b>) -> Drawn,
) -> Drawn<Panel<'a, 'b>>
where
    'b: 'a,
{
    if let Some(title) = axes.title {
        let place = (f64::from(axes.left), 0.55 * f64::from(TITLE));
        write(area, title, place, &letters(LABEL, INK, HPos::Left))?;
    }
    let numbers = if axes.x_label.is_some() { NUMBERS } else { 4 };
    let mut panel = ChartBuilder::on(area)
        .margin_top(if axes.title.is_some() { TITLE * FINE } else { 0 })
        .margin_right(RIGHT * FINE)
        .y_label_area_size(axes.left * FINE)
        .x_label_area_size(numbers * FINE)
        .build_cartesian_2d(axes.x, axes.y)?;
    under(&mut panel)?;
    let style = letters(LABEL, FAINT, HPos::Left);
    let mut mesh = panel.configure_mesh();
    mesh.light_line_style(TRANSPARENT)
        .bold_line_style(line(LINE, 0.5))
        .axis_style(line(FAINT, 0.75))
        .set_all_tick_mark_size(3 * FINE)
        .label_style(style.clone())
        .axis_desc_style(style)
        .x_label_formatter(&number)
        .y_label_formatter(&number)
        .y_labels(axes.ticks.1.max(2));
    if axes.ticks.1 == 0 {
        mesh.disable_y_mesh()
            .y_label_formatter(&|_| String::new())
            .set_tick_mark_size(LabelAreaPosition::Left, 0);
    }
    match axes.x_label {
        Some(label) => mesh.x_labels(axes.ticks.0).x_desc(label),
        None => mesh.x_labels(axes.ticks.0).x_label_formatter(&|_| String::new()),
    };
    mesh.draw()?;
    Ok(panel)
}

/// A number on an axis, without trailing zeros.
fn number(value: &f64) -> String {
    // Adding 0 turns -0 into 0.
    format!("{}", (value * 1e3).round() / 1e3 + 0.0)
}

/// Fills the area between two positions along the panel and two across it.
pub(super) fn fill(panel: &mut Panel<'_, '_>, x: (f64, f64), y: (f64, f64), color: RGBColor) -> Drawn {
    panel.draw_series([Rectangle::new([(x.0, y.0), (x.1, y.1)], color.mix(OPACITY).filled())])?;
    Ok(())
}

/// A line through `points`.
pub(super) fn draw(panel: &mut Panel<'_, '_>, points: Vec<(f64, f64)>, style: ShapeStyle) -> Drawn {
    panel.draw_series([PathElement::new(points, style)])?;
    Ok(())
}

/// Shades the times when `course` changes its gait.
pub(super) fn shade_changes(panel: &mut Panel<'_, '_>, course: &Course<'_>, y: (f64, f64)) -> Drawn {
    for span in course.spans().iter().filter(|span| span.is_changing) {
        fill(panel, (span.from_s, span.to_s), y, CHANGE)?;
    }
    Ok(())
}

/// Writes the names of the gaits of `course` above panels that begin at `top` pixels and span the picture.
pub(super) fn name_gaits(area: &Area<'_>, course: &Course<'_>, top: f64) -> Drawn {
    let (from_s, to_s) = course.times_s();
    let width = f64::from(WIDTH - LEFT - RIGHT);
    let place = |s: f64| f64::from(LEFT) + width * (s - from_s) / (to_s - from_s);
    let style = letters(LABEL, INK, HPos::Center);
    for span in course.spans() {
        let name = course.name_of(span.gait, span.is_changing);
        let (left, right) = (place(span.from_s), place(span.to_s));
        // Approximate width of the letters.
        if right - left > 0.6 * LABEL * f64::from(u32::try_from(name.len()).unwrap_or(u32::MAX)) {
            write(area, name, (0.5 * (left + right), top), &style)?;
        }
    }
    Ok(())
}

/// Indices of the frames of `course`, thinned to what a picture can show.
pub(super) fn thinned(course: &Course<'_>) -> impl Iterator<Item = usize> + Clone {
    let count = course.frames.len();
    let every = count.div_ceil(2 * WIDTH as usize).max(1);
    (0..count).filter(move |index| index % every == 0 || index + 1 == count)
}

/// A foot at one moment of a trace.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Mark {
    pub(super) time_s: f64,
    /// Forward, m.
    pub(super) forward_m: f64,
    pub(super) is_swing: bool,
}

/// Draws the positions of a foot, in stance or in swing, and again in a bright colour those beyond `limits`.
pub(super) fn draw_trace(panel: &mut Panel<'_, '_>, marks: &[Mark], limits: Option<(f64, f64)>) -> Drawn {
    let point = |mark: &Mark| (mark.time_s, mark.forward_m);
    let is_beyond = |mark: &Mark| {
        limits.is_some_and(|(low, high)| mark.forward_m < low - 1e-9 || mark.forward_m > high + 1e-9)
    };
    let style = |mark: &Mark| match (is_beyond(mark), mark.is_swing) {
        (true, _) => line(ALERT, 2.4),
        (false, true) => line(SWING, 1.3),
        (false, false) => line(STANCE, 2.0),
    };
    let mut rest = marks;
    while let Some(first) = rest.first() {
        let kind = (first.is_swing, is_beyond(first));
        let length = rest.iter().take_while(|mark| (mark.is_swing, is_beyond(mark)) == kind).count();
        // Include the first point of the next piece, so that the line continues.
        draw(panel, rest.iter().take(length + 1).map(point).collect(), style(first))?;
        rest = &rest[length..];
    }
    Ok(())
}

/// Writes the key to the colours in one row from `left` at the height `y`, pixels.
pub(super) fn write_key(area: &Area<'_>, left: f64, y: f64, entries: &[(RGBColor, &str)]) -> Drawn {
    let style = letters(LABEL, FAINT, HPos::Left);
    let mut x = left;
    for (color, meaning) in entries {
        let corners = [(fine(x), fine(y - 5.0)), (fine(x + 10.0), fine(y + 5.0))];
        area.draw(&Rectangle::new(corners, color.filled()))?;
        write(area, meaning, (x + 15.0, y), &style)?;
        x += 34.0 + 0.54 * LABEL * f64::from(u32::try_from(meaning.len()).unwrap_or(0));
    }
    Ok(())
}
