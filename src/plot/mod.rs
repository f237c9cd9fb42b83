//! Pictures of a robot's planned motion: no servo, no bus, nothing measured.
//!
//! Input: orders over time. [`Course`] is the controller's response to them, cycle by cycle. Output: SVG, one
//! picture per function, the same bytes every time.

mod canvas;
mod comparison;
mod course;
mod fall;
mod feet;
mod footfalls;
mod joints;
mod poses;

pub use comparison::comparison;
pub use course::{Change, Course, CourseError, Frame, Span, Subject};
pub use fall::{FallRow, fall};
pub use feet::feet;
pub use footfalls::footfalls;
pub use joints::joints;
pub use poses::{front, poses};

/// A picture could not be drawn.
#[derive(Debug, thiserror::Error)]
#[error("the picture could not be drawn: {0}")]
pub struct PlotError(String);
