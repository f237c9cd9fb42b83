//! The transition from one motion of an arm to the next without a jump.
//!
//! When the motion changes, the difference of each joint from the new motion and its speed are stored, and fade:
//! the offset follows a quintic that begins with that offset and speed and ends at rest at zero. So position and
//! speed are continuous, and the duration is long enough to keep both below the joints' limits. The new motion
//! begins at rest. While the new motion of an arm is not yet known, the arm comes to rest where it is.

use crate::model::{Joint, SafetySettings};

/// Shortest duration of a change, s.
const SHORTEST_S: f64 = 0.5;
/// Share of a joint's speed and acceleration limits that a change may use; the rest is for the new motion.
const SHARE: f64 = 0.5;
/// Largest slope and second derivative of [`fall`].
const FALL_SLOPE_MAX: f64 = 1.875;
const FALL_CURVATURE_MAX: f64 = 5.7736;
/// Largest second derivative of [`swing`].
const SWING_CURVATURE_MAX: f64 = 3.9408;

/// Fades the change of one arm.
#[derive(Debug, Clone)]
pub struct HandOver {
    joints: Vec<Fading>,
    period_s: f64,
    acceleration_rad_s2: f64,
    change: Option<u32>,
    /// True while the arm waits for its motion.
    waits: bool,
    since_s: f64,
    duration_s: f64,
}

#[derive(Debug, Clone, Copy)]
struct Fading {
    range_rad: (f64, f64),
    rate_rad_s: f64,
    /// The last two angles sent, the newest first, rad.
    last_rad: f64,
    before_rad: f64,
    /// Angle at which it comes to rest while it waits.
    rest_rad: f64,
    /// Offset and speed at the change.
    offset_rad: f64,
    speed_rad_s: f64,
}

impl HandOver {
    /// For an arm with these joints and limits, which is solved once in `period_s`.
    pub fn new(joints: &[Joint], limits: &SafetySettings, period_s: f64) -> HandOver {
        let fading = |joint: &Joint| Fading {
            range_rad: joint.goal_range_rad(),
            rate_rad_s: limits.rate_share * joint.no_load_speed_rad_s(),
            last_rad: 0.0,
            before_rad: 0.0,
            rest_rad: 0.0,
            offset_rad: 0.0,
            speed_rad_s: 0.0,
        };
        HandOver {
            joints: joints.iter().map(fading).collect(),
            period_s,
            acceleration_rad_s2: limits.acceleration_rad_s2,
            change: None,
            waits: false,
            since_s: 0.0,
            duration_s: 0.0,
        }
    }

    /// True if a target with this change number begins a motion.
    pub fn is_new(&self, change: u32) -> bool {
        self.change != Some(change)
    }

    /// To be called when targets did not move the arm: whatever comes next is a change.
    pub fn pass(&mut self, angles: &[f64]) {
        self.change = None;
        self.waits = false;
        self.note(angles);
    }

    /// Writes the `angles` (rad) with which an arm comes to rest where it is while its motion is not yet known.
    pub fn wait(&mut self, angles: &mut [f64]) {
        if !self.waits {
            self.joints.iter_mut().for_each(|joint| joint.rest_rad = joint.last_rad);
        }
        for (angle, joint) in angles.iter_mut().zip(&self.joints) {
            *angle = joint.rest_rad;
        }
        self.fade_from(!self.waits, angles);
        (self.change, self.waits) = (None, true);
    }

    /// Turns the `angles` (rad) of the motion with number `change` into those to send.
    pub fn fade(&mut self, change: u32, angles: &mut [f64]) {
        self.fade_from(self.is_new(change), angles);
        (self.change, self.waits) = (Some(change), false);
    }

    /// Turns the `angles` of a motion, which may begin in this cycle, into those to send.
    fn fade_from(&mut self, begins: bool, angles: &mut [f64]) {
        if begins {
            self.begin(angles);
        } else {
            self.since_s += self.period_s;
        }
        let share = self.since_s / self.duration_s;
        if share < 1.0 {
            let (left, swung_s) = (fall(share), self.duration_s * swing(share));
            for (angle, joint) in angles.iter_mut().zip(&self.joints) {
                let faded_rad = *angle + left * joint.offset_rad + swung_s * joint.speed_rad_s;
                *angle = faded_rad.clamp(joint.range_rad.0, joint.range_rad.1);
            }
        }
        self.note(angles);
    }

    fn begin(&mut self, angles: &[f64]) {
        // The incoming angles are already one period into the change.
        self.since_s = self.period_s;
        self.duration_s = SHORTEST_S;
        for (angle, joint) in angles.iter().zip(&mut self.joints) {
            joint.offset_rad = joint.last_rad - angle;
            joint.speed_rad_s = (joint.last_rad - joint.before_rad) / self.period_s;
            let (offset, speed) = (joint.offset_rad.abs(), joint.speed_rad_s.abs());
            let acceleration = SHARE * self.acceleration_rad_s2;
            let by_rate_s = FALL_SLOPE_MAX * offset / (SHARE * joint.rate_rad_s);
            // Half of the acceleration for the offset, half for the speed.
            let by_acceleration_s = (2.0 * FALL_CURVATURE_MAX * offset / acceleration).sqrt();
            let by_speed_s = 2.0 * SWING_CURVATURE_MAX * speed / acceleration;
            self.duration_s = self.duration_s.max(by_rate_s).max(by_acceleration_s).max(by_speed_s);
        }
    }

    fn note(&mut self, angles: &[f64]) {
        for (angle, joint) in angles.iter().zip(&mut self.joints) {
            joint.before_rad = joint.last_rad;
            joint.last_rad = *angle;
        }
    }
}

/// The quintic from 1 at u = 0 to 0 at u = 1, at rest and without curvature at both.
fn fall(u: f64) -> f64 {
    let v = 1.0 - u;
    v * v * v * (10.0 + v * (6.0 * v - 15.0))
}

/// The quintic that leaves 0 with slope 1 and ends at rest at 0 at u = 1, first and last without curvature.
fn swing(u: f64) -> f64 {
    let v = 1.0 - u;
    u * v * v * v * (1.0 + 3.0 * u)
}

#[cfg(test)]
mod tests {
    use glam::DVec3;
    use rand_pcg::Pcg64Mcg;
    use rand_pcg::rand_core::{Rng, SeedableRng};

    use super::*;
    use crate::model::{Servo, ServoModel};

    #[test]
    fn a_change_at_any_moment_keeps_within_speed_and_acceleration() {
        let limits = SafetySettings {
            rate_share: 0.5,
            acceleration_rad_s2: 40.0,
            slow_rate_rad_s: 0.3,
            torque_share: 0.5,
            torque_ramp_s: 1.0,
            coast_s: 0.1,
            hold_s: 1.0,
            tracking_error_rad: 1.0,
            fault_delay_s: 1.0,
            temperature_c: 60.0,
            tripped_servo: crate::model::TrippedServoPolicy::Stop,
        };
        let joint = Joint {
            name: String::new(),
            axis: DVec3::Z,
            link_m: DVec3::X,
            range_rad: (-1.5, 1.5),
            stiffness: 1.0,
            mass_kg: 0.0,
            center_m: DVec3::ZERO,
            ball: None,
            servo: Some(Servo {
                model: ServoModel::named("XL330-M288").unwrap(),
                bus: 0,
                id: crate::units::ServoId(1),
                reversed: false,
                zero_count: 2048.0,
                firmware: None,
            }),
        };
        let rate_rad_s = limits.rate_share * joint.no_load_speed_rad_s();
        let dt_s = 0.01;
        let mut source = Pcg64Mcg::seed_from_u64(11);
        let mut draw = move || (source.next_u64() >> 11) as f64 / (1_u64 << 53) as f64;
        let mut hand_over = HandOver::new(&[joint], &limits, dt_s);
        // Motions that swing from rest by up to 1.2 rad about any middle, and change every half to two seconds.
        let (mut middle, mut swing, mut since_s, mut until_s, mut change) = (0.0, 0.5, 0.0, 1.0, 0);
        let mut last: Option<(f64, f64)> = None;
        hand_over.pass(&[0.0]);
        hand_over.pass(&[0.0]);
        for step in 0..200_000 {
            since_s += dt_s;
            if since_s > until_s {
                (middle, swing, since_s, until_s) =
                    (1.2 * draw() - 0.6, 0.4 * draw(), dt_s, 0.5 + 1.5 * draw());
                change += 1;
            }
            let ramp_s = since_s - (1.0 - (-since_s / 0.5_f64).exp()) * 0.5;
            let mut angles = [middle + swing * (1.0 - (2.0 * ramp_s).cos())];
            hand_over.fade(change, &mut angles);
            let [angle] = angles;
            if let Some((before, speed)) = last {
                let speed_now = (angle - before) / dt_s;
                assert!(speed_now.abs() <= rate_rad_s, "{speed_now} rad/s at {step}");
                let acceleration = (speed_now - speed) / dt_s;
                assert!(acceleration.abs() <= 40.0, "{acceleration} rad/s^2 at {step}");
                last = Some((angle, speed_now));
            } else {
                last = Some((angle, angle / dt_s));
            }
        }
    }
}
