//! The inertial measurement unit: checks its device, its data, and its rate.

use std::time::Duration;

use super::lines::Lines;
use crate::bus::serial::Device;
use crate::imu::{ImuLine, ImuLineError, Sampler, SerialImu, in_body};
use crate::model::{ImuSettings, Robot};

/// How long to listen to it.
const LISTEN: Duration = Duration::from_millis(1000);
/// Time between looks.
const LOOK: Duration = Duration::from_millis(5);
/// Largest relative error of its rate.
const TOLERANCE: f64 = 0.1;
const ABOUT: &str = "imu";
const SETUP: &str = "'hippocamp imu setup'";

/// Examines the unit of `robot`, if it should have one. Only listens.
pub(super) fn examine(robot: &Robot, device: Option<&Device>, lines: &mut Lines<'_>) {
    let Some(settings) = &robot.imu else { return };
    let Some(device) = device else {
        let found = "there is no device for it: the robot will go slower, without feedback";
        return lines.warning(ABOUT, found, format!("{SETUP}, or --port imu=PATH"));
    };
    if let Err(error) = listen(settings, device, lines) {
        lines.fault(ABOUT, error.to_string(), SETUP);
    }
}

fn listen(settings: &ImuSettings, device: &Device, lines: &mut Lines<'_>) -> Result<(), ImuLineError> {
    let mut line = SerialImu::open(device)?;
    let (mut sampler, mut last, mut count, mut bytes) = (Sampler::default(), None, 0.0, 0);
    let end = line.now() + LISTEN;
    let mut piece = [0; 512];
    while line.now() < end {
        let received = line.receive(&mut piece)?;
        bytes += received;
        for sample in piece.iter().take(received).filter_map(|byte| sampler.push(*byte)) {
            count += 1.0;
            last = Some(sample);
        }
        line.wait(LOOK);
    }
    let hz = count / LISTEN.as_secs_f64();
    let path = device.path.display();
    match last {
        None if bytes == 0 => {
            lines.fault(ABOUT, format!("nothing is received from {path}"), "check its power and its plug")
        }
        None => {
            let unclear = || format!("not understood at {} bit/s", settings.baud);
            let words = sampler.kinds().missing().unwrap_or_else(unclear);
            lines.fault(ABOUT, format!("{path} is {words}"), SETUP);
        }
        Some(_) if (hz / settings.rate_hz - 1.0).abs() > TOLERANCE => lines.warning(
            ABOUT,
            format!("{path} measures {hz:.0} times a second, not {}", settings.rate_hz),
            SETUP,
        ),
        Some(sample) => {
            let reading = in_body(&sample, settings);
            let (roll_deg, pitch_deg) = (reading.roll_rad.to_degrees(), reading.pitch_rad.to_degrees());
            lines.ok(
                ABOUT,
                format!(
                    "measures {hz:.0} times a second; roll {roll_deg:.1}, pitch {pitch_deg:.1} degrees now"
                ),
            );
        }
    }
    Ok(())
}
