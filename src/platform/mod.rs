//! What the loop needs of the operating system: its clock, its waits, and real-time scheduling.
//!
//! Code for only one system is in that system's file; there is one so far.

#[cfg(target_os = "linux")]
mod linux;
#[cfg(target_os = "linux")]
mod usage;
#[cfg(target_os = "linux")]
pub use linux::*;
#[cfg(target_os = "linux")]
pub use usage::{Meter, Usage};

#[cfg(not(target_os = "linux"))]
compile_error!(
    "hippocamp runs on Linux; for another system, write the functions of src/platform/linux.rs for it"
);
