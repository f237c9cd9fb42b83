//! Pictures of what a robot is to do: no servo, no bus, nothing measured.
//!
//! Comes in: orders over time. [`Course`] is what the controller makes of them, cycle by cycle. Goes out: SVG, one
//! picture a function, the same bytes every time.

mod canvas;
mod comparison;
mod course;
mod fall;
mod feet;
mod footfalls;
mod joints;
mod poses;

pub use comparison::comparison;
pub use course::{Change, Course, CourseError, FootRange, Frame, Span, Subject};
pub use fall::{FallRow, fall};
pub use feet::feet;
pub use footfalls::footfalls;
pub use joints::joints;
pub use poses::{front, poses};

/// A picture could not be drawn.
#[derive(Debug, thiserror::Error)]
#[error("the picture could not be drawn: {0}")]
pub struct PlotError(String);
