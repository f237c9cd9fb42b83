//! Examines one after the other everything that makes real robots fail; changes nothing.
//!
//! In: a robot file and the devices of its buses. Out: a [`Line`] for each finding: ok, a warning or a fault, and
//! what to do. Servos are only read. Run it before a robot moves; a run repeats the checks that it depends on.

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

/// Examines a robot with its unit file already applied to `robot`, its buses at `devices`, in their order, and its
/// inertial measurement unit at `imu`. Ends early once `stop` is set. `tell` gets every line as soon as it is
/// known.
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
