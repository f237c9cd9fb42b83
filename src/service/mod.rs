//! Single servos outside the loop: find, read, set up and back up.
//!
//! In: a serial device, a servo's address, register names. Out: values in people's units, or an error that says
//! what to do. Nothing here is used while a robot moves, and servos are without torque except where stated.
//!
//! ```no_run
//! use hippocamp::model::Protocol;
//! use hippocamp::service::{Address, ServicePort};
//! use hippocamp::units::ServoId;
//!
//! let mut port = ServicePort::open("/dev/ttyUSB0".as_ref())?;
//! let mut servo = port.servo(Address { protocol: Protocol::Feetech, baud: 1_000_000, id: ServoId(1) })?;
//! println!("{}", servo.read("present_input_voltage")?); // 12.10 V
//! # Ok::<(), hippocamp::service::ServiceError>(())
//! ```
//!
//! Only the program's own commands can write: a goal written here would skip the safety checks.

pub mod backup;
pub mod centre;
mod error;
mod line;
mod scan;
mod servo;
pub mod setup;

pub use crate::bus::table::{Access, BadValue, Identity, RegisterInfo, Series, Value};
pub use backup::{Backup, BackupError};
pub use error::{Address, ServiceError};
pub use line::ServicePort;
pub use scan::{Found, Pass, pass_time, scan_bauds};
pub use servo::Servo;
