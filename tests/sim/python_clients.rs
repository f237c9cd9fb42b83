//! Packages of the servos' makers, unmodified, on the simulated servos.
//!
//! Left out, and said so, where the environment variable `HIPPOCAMP_PYTHON` does not name a Python with the packages
//! of `.ci/python-setup`.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::running::Sim;

/// A Python with the packages, if one is named.
pub(crate) fn python() -> Option<PathBuf> {
    let python = std::env::var_os("HIPPOCAMP_PYTHON").filter(|python| !python.is_empty());
    if python.is_none() {
        // Not captured, so that it is read whether the tests pass or not.
        #[allow(clippy::disallowed_methods, reason = "not captured")]
        writeln!(std::io::stderr(), "left out: HIPPOCAMP_PYTHON is not set").unwrap();
    }
    python.map(PathBuf::from)
}

/// Runs a script of `tests/python` on a port. `package` has a folder of its own beside the Python where it must not
/// be seen by the others.
fn run(python: &Path, script: &str, package: &str, port: &Path) {
    let packages = python.parent().and_then(Path::parent).unwrap().join("alone").join(package);
    let output = Command::new(python)
        .arg("-B")
        .arg(Path::new("tests/python").join(script))
        .arg(port)
        .env("PYTHONPATH", packages)
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "after {said}\n{}", String::from_utf8_lossy(&output.stderr));
}

#[test]
fn dynamixel_sdk() {
    let Some(python) = python() else { return };
    let sim = Sim::start("horse-dynamixel.toml", &[]);
    run(&python, "drive_dynamixel.py", "", &sim.port("left_hind"));
}

#[test]
fn ftservo_python_sdk() {
    let Some(python) = python() else { return };
    let sim = Sim::start("horse.toml", &[]);
    run(&python, "drive_feetech_ftservo.py", "ftservo-python-sdk", &sim.port("main"));
}

#[test]
fn feetech_servo_sdk() {
    let Some(python) = python() else { return };
    let sim = Sim::start("horse.toml", &[]);
    run(&python, "drive_feetech_scservo.py", "feetech-servo-sdk", &sim.port("main"));
}
