//! Everything that makes real robots fail, looked at one after the other; nothing is changed.
//!
//! Comes in: a robot file and where its buses are. Goes out: a [`Line`] a matter: well, worth a word, or wrong, and what
//! to do. Servos are only read. It is to be asked before a robot moves; a run repeats what it cannot do without.

mod imu;
mod lines;
mod loops;
mod machine;
mod power;
mod servos;

use std::sync::atomic::AtomicBool;

use crate::bus::serial::Device;
use crate::model::Robot;
pub use lines::{Line, Lines, Verdict};

/// Looks at a robot of which the unit file has been read into `robot`, its buses at `devices`, in their order, and its
/// inertial measurement unit at `imu`. Ends
/// early once `stop` is set. `tell` hears every line as soon as it is known.
pub fn examine(
    robot: &Robot,
    devices: &[Device],
    imu: Option<&Device>,
    stop: &AtomicBool,
    tell: &mut dyn FnMut(&Line),
) -> Vec<Line> {
    let mut lines = Lines::new(tell);
    machine::examine(&mut lines);
    let mut is_whole = true;
    for (bus, device) in devices.iter().enumerate() {
        is_whole &= servos::examine(robot, bus, device, stop, &mut lines);
    }
    for bus in 0..robot.buses.len() {
        power::examine(robot, bus, &mut lines);
    }
    imu::examine(robot, imu, &mut lines);
    if is_whole && !stop.load(std::sync::atomic::Ordering::Relaxed) {
        loops::examine(robot, devices, &mut lines);
    }
    lines.into_all()
}
