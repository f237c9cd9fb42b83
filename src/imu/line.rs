//! The line of a unit outside the loop.

use std::time::Duration;

/// Why a line cannot be used.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct ImuLineError(pub String);

/// The line of a unit.
pub trait ImuLine {
    /// Time on a monotonic clock.
    fn now(&mut self) -> Duration;
    /// Sends and receives at `baud` from now on, bit/s.
    ///
    /// # Errors
    /// [`ImuLineError`] when the line cannot do that.
    fn set_baud(&mut self, baud: u32) -> Result<(), ImuLineError>;
    /// Sends `bytes`.
    ///
    /// # Errors
    /// [`ImuLineError`] when the line is gone.
    fn send(&mut self, bytes: &[u8]) -> Result<(), ImuLineError>;
    /// Copies the bytes that have arrived and returns their number; never waits.
    ///
    /// # Errors
    /// [`ImuLineError`] when the line is gone.
    fn receive(&mut self, into: &mut [u8]) -> Result<usize, ImuLineError>;
    /// Waits for `time`.
    fn wait(&mut self, time: Duration);
}
