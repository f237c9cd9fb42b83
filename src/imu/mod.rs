//! The inertial measurement unit: turns the bytes of its line into an [`ImuReading`].
//!
//! Takes the bytes that have arrived, once a cycle. Returns the trunk's attitude and rates at the last measurement,
//! in the body frame, and the measurement's age. It never waits; a silent, noisy or missing line only lets the
//! reading grow old. [`crate::estimate`] decides what the robot makes of it.

mod clock;
mod codec;
mod line;
mod plausible;
mod serial;

use glam::{DQuat, DVec3, EulerRot};

use crate::bus::{PortError, Ports};
use crate::model::{ImuSettings, Robot};
use crate::signals::ImuReading;
use clock::ArrivalClock;
pub use codec::{
    CONTENT, Decoder, Frame, KEY, KindsHeard, RawSample, Register, Sampler, baud_code, command, frames_in,
    rate_code, read_command,
};
pub use line::{ImuLine, ImuLineError};
use plausible::Filter;
pub use serial::SerialImu;

/// Bytes taken from the line at once.
const PIECE_BYTES: usize = 256;
/// Most pieces taken in a cycle, so that a line that never falls silent cannot hold up the loop: more than the
/// system keeps of a line.
const PIECES_MAX: usize = 20;
/// Bytes that the system keeps of a line. It drops later ones, so the last bytes in a full buffer have an unknown
/// age.
const KEPT_BYTES: usize = 4095;

/// Reads one unit.
#[derive(Debug)]
pub struct Imu {
    /// `None` if the robot has no unit.
    settings: Option<ImuSettings>,
    sampler: Sampler,
    clock: ArrivalClock,
    /// `None` if the robot has no unit.
    filter: Option<Filter>,
    last: Option<RawSample>,
    /// Bytes since the last measurement.
    behind: u32,
    reading: ImuReading,
    is_gone: bool,
}

impl Imu {
    /// The unit of `robot`, if it has one; no reading yet.
    pub fn new(robot: &Robot) -> Imu {
        Imu {
            settings: robot.imu.clone(),
            sampler: Sampler::default(),
            clock: ArrivalClock::new(robot.imu.as_ref()),
            filter: robot.imu.as_ref().map(|imu| Filter::new(1.0 / imu.rate_hz, imu.stale_s)),
            last: None,
            behind: 0,
            reading: ImuReading::default(),
            is_gone: false,
        }
    }

    /// Takes the bytes that have arrived from `ports`. Never waits, and allocates nothing.
    pub fn read(&mut self, ports: &mut impl Ports) {
        let Some(settings) = &self.settings else { return };
        let looked = ports.now();
        let mut piece = [0; PIECE_BYTES];
        let (mut latest, mut fresh, mut total) = (None, 0, 0);
        self.is_gone = false;
        for _ in 0..PIECES_MAX {
            let count = match ports.receive_imu(&mut piece) {
                Ok(count) => count,
                Err(PortError::ImuGone | PortError::Gone { .. }) => {
                    self.is_gone = true;
                    0
                }
            };
            total += count;
            for byte in piece.iter().take(count) {
                self.behind = self.behind.saturating_add(1);
                if let Some(sample) = self.sampler.push(*byte) {
                    (fresh, self.behind) = (fresh + 1, 0);
                    // A working unit's last digit always changes: nine equal numbers are a repeat of the old ones.
                    if self.last != Some(sample) {
                        self.last = Some(sample);
                        if self.filter.as_mut().is_some_and(|filter| filter.accepts(looked, &sample)) {
                            latest = Some(sample);
                        } else {
                            self.reading.implausible += 1;
                        }
                    }
                }
            }
            if count < PIECE_BYTES {
                break;
            }
        }
        let now = ports.now();
        if total >= KEPT_BYTES {
            // After a buffer overflow the last measurement is old.
            latest = None;
        }
        self.clock.note(now, fresh, self.behind, latest.is_some());
        if let Some(sample) = latest {
            let implausible = self.reading.implausible;
            self.reading = ImuReading { implausible, ..in_body(&sample, settings) };
        }
        self.reading.age_s = self.clock.age_s(now) + settings.wire_s() + settings.delay_s;
    }

    /// The last reading, with its age at the last look.
    pub fn reading(&self) -> &ImuReading {
        &self.reading
    }

    /// The kinds of frame that the unit has sent.
    pub fn kinds(&self) -> KindsHeard {
        self.sampler.kinds()
    }

    /// True if its line was gone at the last look.
    pub fn is_gone(&self) -> bool {
        self.is_gone
    }
}

/// The trunk's motion according to `sample`; its age stays 0.
pub fn in_body(sample: &RawSample, settings: &ImuSettings) -> ImuReading {
    let DVec3 { x: roll, y: pitch, z: yaw } = sample.angles_rad();
    // Rotates from the body's axes to the unit's to the world's.
    let attitude = DQuat::from_euler(EulerRot::ZYX, yaw, pitch, roll) * settings.rotation.inverse();
    let (yaw_rad, pitch_rad, roll_rad) = attitude.to_euler(EulerRot::ZYX);
    ImuReading {
        is_known: true,
        age_s: 0.0,
        rate_rad_s: settings.rotation * (sample.rate_rad_s() * settings.rate_sign),
        specific_force_m_s2: settings.rotation * sample.specific_force_m_s2(),
        roll_rad,
        pitch_rad,
        yaw_rad,
        implausible: 0,
    }
}

#[cfg(test)]
mod tests;
