//! Simulated servo buses that speak the same bytes as real ones.
//!
//! In: bytes the host sends, and the passing of virtual time. Out: the bytes that reach the host, each at the time
//! it would on a real line, and the true state of every shaft and register for tests. Never uses a global or the
//! controller's code; and, except for [`pty`], which serves other programs in real time, never a real clock or a
//! wait. The codecs here are written from the makers' manuals alone, so that they are a second opinion on the
//! controller's own.
//!
//! A [`World`] holds every bus of a robot. Down from there: `bus` (one line and its servos), `wire` (when each byte
//! crosses, and what happens when two talk at once), `protocols` (the list of them), `dynamixel` and `feetech`
//! (packets, the answers of servos, control tables and models), `servo`, `model`, `registers` and `motor` (what all
//! servos have, and what turns the shaft; these know no protocol), `supply` (how the
//! current of the servos lowers their voltage), `imu` (senses the attitude and rotation of the trunk), [`body`]
//! (where joint torque meets joint motion: free shafts, or a robot on the ground), [`faults`] (what goes wrong, and
//! when).
//!
//! ```
//! use hw_sim::{BusConfig, FaultScript, Model, Protocol, ServoConfig, World};
//!
//! let model = Model::named("STS3215-12V").ok_or("no such model")?.clone();
//! let servo = ServoConfig { model, id: 1, return_delay_us: 0, position_counts: 2048.0 };
//! let bus = BusConfig {
//!     name: "legs".into(),
//!     protocol: Protocol::Feetech,
//!     baud: 1_000_000,
//!     adapter_latency_us: 0,
//!     supply_v: 12.0,
//!     supply_ohm: 0.0,
//!     servos: vec![servo],
//! };
//! let mut world = World::new(&[bus], FaultScript::default(), 1)?;
//! world.host_send(0, &[0xFF, 0xFF, 0x01, 0x02, 0x01, 0xFB])?; // ping
//! world.advance_to(120_000); // 12 bytes at 10 µs
//! let mut reply = [0; 6];
//! assert_eq!(world.host_receive(0, &mut reply)?, 6);
//! assert_eq!(reply, [0xFF, 0xFF, 0x01, 0x02, 0x00, 0xFC]);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod body;
mod bus;
mod config;
mod convert;
mod decoder;
mod dynamixel;
mod error;
pub mod faults;
mod feetech;
mod imu;
mod model;
mod motor;
mod protocols;
#[cfg(target_os = "linux")]
pub mod pty;
pub mod registers;
mod reply;
mod requests;
mod servo;
mod supply;
mod wire;
mod world;

pub use bus::HeardRequest;
pub use config::{BusConfig, ServoConfig};
pub use error::{BuildError, Unplugged};
pub use faults::{FaultError, FaultScript};
pub use imu::ImuConfig;
pub use model::{Model, Protocol};
pub use requests::{Request, requests_in};
pub use wire::WireStatistics;
pub use world::{ServoTruth, Shaft, World};
