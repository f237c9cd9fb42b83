//! Sets up an inertial measurement unit and finds its orientation in the body, with a person's help.
//!
//! In: its line, a person who tilts the robot, the settings of the robot file. Out: a unit that measures at the
//! right rate, and its entry for the unit file. Touches nothing else.

use std::time::Duration;

use glam::{DMat3, DQuat, DVec3, EulerRot};

use super::Person;
use crate::imu::{
    CONTENT, Decoder, Frame, ImuLine, ImuLineError, KEY, RawSample, Register, Sampler, baud_code, command,
    in_body, rate_code,
};
use crate::model::ImuSettings;

/// Rates to listen at, likely ones first.
const BAUDS: [u32; 9] = [115_200, 921_600, 9_600, 230_400, 460_800, 57_600, 38_400, 19_200, 4_800];
/// How long to listen at each rate. A unit out of its box sends ten times a second; the second, longer time is for
/// one that was set to a slower rate.
const LISTEN: [Duration; 2] = [Duration::from_millis(350), Duration::from_millis(1200)];
/// Number of good frames that show that a rate is right: one in 256 is good by chance.
const FRAMES_LEAST: usize = 3;
/// Time between two commands, and after the last.
const PAUSE: Duration = Duration::from_millis(60);
/// How long the output rate is measured.
const RATE_TIME: Duration = Duration::from_millis(1000);
/// Largest relative error of the rate.
const RATE_TOLERANCE: f64 = 0.1;
/// How long each pose is measured.
const POSE_TIME: Duration = Duration::from_millis(800);
/// A unit that turns faster than this is not held still, rad/s; its own offset is far below this.
const STILL_RAD_S: f64 = 0.15;
/// Least and largest guided tilt, rad: 10 to 80 degrees.
const TILTS_RAD: (f64, f64) = (0.175, 1.4);
/// Largest difference between angles that should agree, rad: 12 degrees; hands are not exact.
const AGREE_RAD: f64 = 0.21;
/// Pause between looks at the line.
const LOOK: Duration = Duration::from_millis(5);

/// Why a unit could not be set up.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ImuSetupError {
    /// Its line cannot be used.
    #[error(transparent)]
    Line(#[from] ImuLineError),
    /// No data that could be understood.
    #[error(
        "no unit was heard at any of its line rates: check its power, and that its TX goes to the adapter's RX; if it \
         was set up by another program, that its protocol is the standard one"
    )]
    Silent,
    /// It does not follow its settings.
    #[error(
        "the unit was set to {wanted_hz} measurements a second and makes {found_hz:.0}: check that the adapter's TX goes \
         to its RX, and try again"
    )]
    Rate {
        /// The rate it was set to, Hz.
        wanted_hz: f64,
        /// The rate that was counted, Hz.
        found_hz: f64,
    },
    /// It fell silent.
    #[error("the unit fell silent: check its plug, and begin again")]
    Lost,
    /// A tilt too small or too large.
    #[error("{what}: it was tilted by {tilt_deg:.0} degrees; expected 10 to 80. Begin again")]
    Tilt {
        /// The tilt.
        what: &'static str,
        /// Its angle, degrees.
        tilt_deg: f64,
    },
    /// The two tilts contradict each other: they cannot both be the ones asked for.
    #[error(
        "nose down and left side down do not match ({off_deg:.0} degrees off a right angle, or one of them was the \
         other way round): begin again, and tilt it straight"
    )]
    Crooked {
        /// How far from a right angle, degrees.
        off_deg: f64,
    },
    /// Its angular rates fit the tilts with neither sign.
    #[error(
        "its turn rates do not match its tilts: set the unit back to its factory settings with its maker's \
         program, and begin again"
    )]
    Rates,
    /// Its angles use other axes than its accelerations.
    #[error(
        "its angles do not match its accelerations ({off_deg:.0} degrees apart): set its installation direction to \
         horizontal with its maker's program, and begin again"
    )]
    Angles {
        /// Angle between the two, degrees.
        off_deg: f64,
    },
    /// The person stopped.
    #[error("interrupted; nothing was kept")]
    Left,
}

/// What was found about a unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FoundImu {
    /// Its present line rate, bit/s.
    pub baud: u32,
    /// Roll, pitch and yaw of the unit in the body, degrees.
    pub rpy_deg: [f64; 3],
    /// True if it reports its angular rates with the opposite sign.
    pub rates_reversed: bool,
}

/// Finds the unit on `line`, sets it up as `settings` says, and has `person` tilt the robot to find its mounting.
///
/// # Errors
/// The reason; a unit that was already set up stays so.
pub fn set_up(
    line: &mut impl ImuLine,
    settings: &ImuSettings,
    person: &mut impl Person,
) -> Result<FoundImu, ImuSetupError> {
    person.hear("Looking for the unit.");
    let baud = find(line, person)?;
    person.hear(&format!("Heard at {baud} bit/s."));
    configure(line, settings)?;
    person.hear(&format!(
        "It now measures {} times a second at {} bit/s, and stores that.",
        settings.rate_hz, settings.baud
    ));
    let mut tilts = Tilts { line, person, sampler: Sampler::default() };
    let level = tilts.pose("Put the robot level on its feet or its belly, and keep it still.")?;
    let nose = tilts.pose("Lower its nose by 20 to 45 degrees, and hold it still.")?;
    tilts.pose("Put it level again, and keep it still.")?;
    let left = tilts.pose("Lower its left side by 20 to 45 degrees, and hold it still.")?;
    judge(settings, &level, &nose, &left)
}

/// The line rate at which the unit talks.
fn find(line: &mut impl ImuLine, person: &mut impl Person) -> Result<u32, ImuSetupError> {
    for time in LISTEN {
        for baud in BAUDS {
            if person.wants_to_stop() {
                return Err(ImuSetupError::Left);
            }
            line.set_baud(baud)?;
            let (mut decoder, mut good, mut count) = (Decoder::default(), 0, 0);
            listen(line, time, |byte| {
                count += 1;
                good += usize::from(
                    decoder.push(byte).is_some_and(|frame| !matches!(frame, Frame::Other(0x5A..))),
                );
            })?;
            // At a wrong rate a good frame comes now and then.
            if good >= FRAMES_LEAST && good * 22 > count {
                return Ok(baud);
            }
        }
    }
    Err(ImuSetupError::Silent)
}

/// Sets what it sends, and its rates, and has it save that.
fn configure(line: &mut impl ImuLine, settings: &ImuSettings) -> Result<(), ImuSetupError> {
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "one of a few small numbers")]
    let rate = rate_code(settings.rate_hz.round() as u32);
    let (Some(rate), Some(baud)) = (rate, baud_code(settings.baud)) else {
        return Err(ImuSetupError::Rate { wanted_hz: settings.rate_hz, found_hz: 0.0 });
    };
    for (register, value) in [(Register::Key, KEY), (Register::Content, CONTENT), (Register::Baud, baud)] {
        line.send(&command(register, value))?;
        line.wait(PAUSE);
    }
    line.set_baud(settings.baud)?;
    for (register, value) in [(Register::Key, KEY), (Register::Rate, rate), (Register::Save, 0)] {
        line.send(&command(register, value))?;
        line.wait(PAUSE);
    }
    line.wait(PAUSE);
    listen(line, LOOK, |_| ())?;
    let (mut sampler, mut count) = (Sampler::default(), 0.0);
    listen(line, RATE_TIME, |byte| {
        if sampler.push(byte).is_some() {
            count += 1.0;
        }
    })?;
    let found_hz = count / RATE_TIME.as_secs_f64();
    if (found_hz / settings.rate_hz - 1.0).abs() > RATE_TOLERANCE {
        return Err(ImuSetupError::Rate { wanted_hz: settings.rate_hz, found_hz });
    }
    Ok(())
}

/// Passes every byte of the next `time` to `hear`.
fn listen(line: &mut impl ImuLine, time: Duration, mut hear: impl FnMut(u8)) -> Result<(), ImuSetupError> {
    let end = line.now() + time;
    let mut piece = [0; 512];
    loop {
        loop {
            let count = line.receive(&mut piece)?;
            piece.iter().take(count).for_each(|byte| hear(*byte));
            if count < piece.len() {
                break;
            }
        }
        if line.now() >= end {
            return Ok(());
        }
        line.wait(LOOK);
    }
}

/// A pose, and the rotation that led to it, in the unit's axes.
#[derive(Debug, Clone, Copy, Default)]
struct Pose {
    /// Direction of up, unit length.
    up: DVec3,
    /// Its rotation since the last pose, from its angular rates, rad.
    turn_rad: DVec3,
    last: RawSample,
}

struct Tilts<'t, L, P> {
    line: &'t mut L,
    person: &'t mut P,
    sampler: Sampler,
}

impl<L: ImuLine, P: Person> Tilts<'_, L, P> {
    /// Asks for the pose, waits for a line that confirms it, and measures.
    fn pose(&mut self, wanted: &str) -> Result<Pose, ImuSetupError> {
        let mut turn_rad = DVec3::ZERO;
        self.person.hear(&format!("{wanted} Then press Enter."));
        loop {
            turn_rad += self.watch(LOOK)?.1;
            if self.person.wants_to_stop() {
                return Err(ImuSetupError::Left);
            }
            if self.person.answer().is_none() {
                continue;
            }
            // Measurements from before are still on their way.
            turn_rad += self.watch(PAUSE)?.1;
            let (samples, turn) = self.watch(POSE_TIME)?;
            turn_rad += turn;
            let Some(last) = samples.last() else { return Err(ImuSetupError::Lost) };
            let mean = |of: fn(&RawSample) -> DVec3| {
                samples.iter().map(of).sum::<DVec3>() / samples.iter().map(|_| 1.0).sum::<f64>()
            };
            let is_still = samples.iter().all(|sample| sample.rate_rad_s().length() < STILL_RAD_S);
            let up = mean(RawSample::specific_force_m_s2).normalize_or_zero();
            if is_still && up != DVec3::ZERO {
                return Ok(Pose { up, turn_rad, last: *last });
            }
            self.person.hear("It moved. Hold it still, and press Enter again.");
        }
    }

    /// All measurements of the next `time`, and the rotation over it, rad.
    fn watch(&mut self, time: Duration) -> Result<(Vec<RawSample>, DVec3), ImuSetupError> {
        let (begun, mut samples) = (self.line.now(), Vec::new());
        let sampler = &mut self.sampler;
        listen(self.line, time, |byte| samples.extend(sampler.push(byte)))?;
        let took_s = self.line.now().saturating_sub(begun).as_secs_f64();
        let count: f64 = samples.iter().map(|_| 1.0).sum();
        let sum: DVec3 = samples.iter().map(RawSample::rate_rad_s).sum();
        Ok((samples, if count > 0.0 { sum * (took_s / count) } else { DVec3::ZERO }))
    }
}

/// The mounting of the unit, from the direction of up in its axes in each pose.
fn judge(settings: &ImuSettings, level: &Pose, nose: &Pose, left: &Pose) -> Result<FoundImu, ImuSetupError> {
    // The level direction away from the lowered side: the body's -x with the nose down, its -y with the left side
    // down.
    let aside = |pose: &Pose, what: &'static str| {
        let tilt_rad = level.up.angle_between(pose.up);
        if !(TILTS_RAD.0..=TILTS_RAD.1).contains(&tilt_rad) {
            return Err(ImuSetupError::Tilt { what, tilt_deg: tilt_rad.to_degrees() });
        }
        Ok((pose.up - level.up * pose.up.dot(level.up)).normalize())
    };
    let (x, y) = (-aside(nose, "nose down")?, -aside(left, "left side down")?);
    let z = level.up;
    let off_rad = (x.dot(y).clamp(-1.0, 1.0)).asin();
    if off_rad.abs() > AGREE_RAD || x.cross(y).dot(z) < 0.0 {
        return Err(ImuSetupError::Crooked { off_deg: off_rad.to_degrees().abs() });
    }
    // Both tilts contribute equally to the forward direction.
    let forward = (x + y.cross(z)).normalize();
    let rotation = DQuat::from_mat3(&DMat3::from_cols(forward, z.cross(forward), z).transpose()).normalize();
    // Up turns against the unit: a rotation by v takes up from u to u + u x v.
    let agrees = |pose: &Pose| pose.turn_rad.dot(pose.up.cross(level.up));
    let (with_nose, with_left) = (agrees(nose), agrees(left));
    if with_nose * with_left <= 0.0 {
        return Err(ImuSetupError::Rates);
    }
    let found = ImuSettings { rotation, ..settings.clone() };
    for pose in [level, nose, left] {
        let up = rotation * pose.up;
        let reading = in_body(&pose.last, &found);
        let told =
            (DQuat::from_rotation_y(reading.pitch_rad) * DQuat::from_rotation_x(reading.roll_rad)).inverse();
        let off_rad = (told * DVec3::Z).angle_between(up);
        if off_rad > AGREE_RAD {
            return Err(ImuSetupError::Angles { off_deg: off_rad.to_degrees() });
        }
    }
    let (yaw, pitch, roll) = rotation.to_euler(EulerRot::ZYX);
    // Hands and accelerometers are not more exact than this.
    let rounded = |angle: f64| (angle.to_degrees() * 10.0).round() / 10.0 + 0.0;
    Ok(FoundImu {
        baud: settings.baud,
        rpy_deg: [roll, pitch, yaw].map(rounded),
        rates_reversed: with_nose < 0.0,
    })
}
