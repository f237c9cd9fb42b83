//! What the operating system must do for the loop: its clock, its waits, and its real-time promises.
//!
//! Everything that only one system has stands in the file of that system; there is one so far.

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
