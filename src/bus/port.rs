//! The ports: the one object that owns every serial line, the clock and the only wait.
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

    /// What the loop's thread, which calls this, has had of the machine; nothing where time is virtual.
    fn usage(&mut self) -> Usage {
        Usage::default()
    }

    /// Throws away whatever bytes have arrived on `bus` and were not yet received.
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

    /// Waits until bytes that were not yet received are there on any bus, or until `deadline`. A line that is
    /// gone has no input.
    fn wait_for_input(&mut self, deadline: Time);

    /// Waits until `deadline`, whatever arrives.
    fn wait_until(&mut self, deadline: Time);

    /// What the robot truly does, which only a simulated body tells; none of hardware, and where simulated joints turn
    /// freely.
    fn true_body(&self) -> Option<TrueBody> {
        None
    }

    /// What the line of `bus` is called where it comes from, such as `/dev/ttyUSB0`, for messages to people;
    /// none where it has no such name.
    fn device(&self, _bus: usize) -> Option<&str> {
        None
    }

    /// From now on the servos of `robot` are known to be on their buses: a line that was gone and is back is used
    /// again only if they are still there. Nothing to do where lines do not change hands.
    fn expect_servos(&mut self, _robot: &Robot) {}

    /// The lines that came back with other servos and were not used again: a sentence each, for people. To be asked
    /// when the loop is over.
    fn strangers(&self) -> Vec<String> {
        Vec::new()
    }
}
