//! The ports: the single object that owns every serial line, the clock and the only wait.
//!
//! On hardware one implementation polls all descriptors at once; in simulation another advances an
//! event queue. All buses share it, so all are exchanged at the same time without a thread per bus.

use crate::model::Robot;
use crate::platform::Usage;
use crate::signals::TrueBody;
use crate::units::Time;

/// Why a port could not be used.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum PortError {
    /// The adapter is gone (unplugged, or its power is off).
    #[error("the port of bus {bus} is gone: plug its adapter in again")]
    Gone {
        /// Index of the bus in the robot file.
        bus: usize,
    },
    /// The line of the inertial measurement unit is gone.
    #[error("the port of the inertial measurement unit is gone: plug it in again")]
    ImuGone,
}

/// Every serial line of the robot, the clock, and the only wait of the program.
///
/// Buses are named by their index in [`crate::model::Robot::buses`].
pub trait Ports {
    /// The present time. Monotonic.
    fn now(&mut self) -> Time;

    /// Resources used by the loop's thread, which calls this; zero if time is virtual.
    fn usage(&mut self) -> Usage {
        Usage::default()
    }

    /// Discards all bytes that have arrived on `bus` and were not yet received.
    ///
    /// # Errors
    /// [`PortError::Gone`] when the line is not there.
    fn discard_input(&mut self, bus: usize) -> Result<(), PortError>;

    /// Hands `bytes` to the line of `bus` without waiting for them to leave.
    ///
    /// # Errors
    /// [`PortError::Gone`] when the line is not there.
    fn send(&mut self, bus: usize, bytes: &[u8]) -> Result<(), PortError>;

    /// Copies bytes that have arrived on `bus` into `into` and returns how many; 0 when there are none.
    /// Never waits.
    ///
    /// # Errors
    /// [`PortError::Gone`] when the line is not there.
    fn receive(&mut self, bus: usize, into: &mut [u8]) -> Result<usize, PortError>;

    /// Copies bytes that have arrived from the inertial measurement unit into `into` and returns how many; 0 when
    /// there are none, or no unit. Never waits.
    ///
    /// # Errors
    /// [`PortError::ImuGone`] when its line is not there.
    fn receive_imu(&mut self, _into: &mut [u8]) -> Result<usize, PortError> {
        Ok(0)
    }

    /// Waits until unreceived bytes are there on any bus, or until `deadline`. A line that is gone has no input.
    fn wait_for_input(&mut self, deadline: Time);

    /// Waits until `deadline`, whatever arrives.
    fn wait_until(&mut self, deadline: Time);

    /// The true state of the trunk, which only a simulated body reports; `None` on hardware, and if simulated
    /// joints turn freely.
    fn true_body(&self) -> Option<TrueBody> {
        None
    }

    /// The name of the line of `bus`, such as `/dev/ttyUSB0`, for messages to people; `None` if it has no such
    /// name.
    fn device(&self, _bus: usize) -> Option<&str> {
        None
    }

    /// From now on the servos of `robot` are known to be on their buses: a line that comes back is used
    /// again only if they are still there. Does nothing if lines cannot change servos.
    fn expect_servos(&mut self, _robot: &Robot) {}

    /// The lines that came back with other servos and were not used again: a sentence each, for people. Call it
    /// when the loop is over.
    fn strangers(&self) -> Vec<String> {
        Vec::new()
    }
}
