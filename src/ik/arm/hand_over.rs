//! From one motion of an arm to the next without a leap.
//!
//! When the motion changes, what each joint is away from the new one and how fast it was are kept, and fade: the
//! offset by a quintic that begins with that offset and speed and ends at rest at nothing. So position and speed are
//! continuous, and the time it takes keeps both below the joints' limits. The new motion begins at rest.

use crate::model::{Joint, SafetySettings};

/// Shortest time a change takes, s.
const SHORTEST_S: f64 = 0.5;
/// Share of its limits that a change may take of a joint's speed and acceleration; the rest is the new motion's.
const SHARE: f64 = 0.5;
/// Largest slope and second derivative of [`fall`].
const FALL_SLOPE_MAX: f64 = 1.875;
const FALL_CURVATURE_MAX: f64 = 5.7736;
/// Largest second derivative of [`swing`].
const SWING_CURVATURE_MAX: f64 = 3.9408;

/// Fades one arm's change.
#[derive(Debug, Clone)]
pub struct HandOver {
    joints: Vec<Fading>,
    period_s: f64,
    acceleration_rad_s2: f64,
    change: Option<u32>,
    since_s: f64,
    duration_s: f64,
}

#[derive(Debug, Clone, Copy)]
struct Fading {
    range_rad: (f64, f64),
    rate_rad_s: f64,
    /// The last angle that went out, and the one before, rad.
    last_rad: f64,
    before_rad: f64,
    /// At the change.
    offset_rad: f64,
    speed_rad_s: f64,
}

impl HandOver {
    /// For an arm of these joints, limited so, that is solved once in `period_s`.
    pub fn new(joints: &[Joint], limits: &SafetySettings, period_s: f64) -> HandOver {
        let fading = |joint: &Joint| Fading {
            range_rad: joint.goal_range_rad(),
            rate_rad_s: limits.rate_share * joint.no_load_speed_rad_s(),
            last_rad: 0.0,
            before_rad: 0.0,
            offset_rad: 0.0,
            speed_rad_s: 0.0,
        };
        HandOver {
            joints: joints.iter().map(fading).collect(),
            period_s,
            acceleration_rad_s2: limits.acceleration_rad_s2,
            change: None,
            since_s: 0.0,
            duration_s: 0.0,
        }
    }

    /// Whether a target of this change begins a motion.
    pub fn is_new(&self, change: u32) -> bool {
        self.change != Some(change)
    }

    /// The arm was not moved by targets: what comes next is a change.
    pub fn pass(&mut self, angles: &[f64]) {
        self.change = None;
        self.note(angles);
    }

    /// Turns the `angles` (rad) of the motion that goes by the number `change` into those to go out.
    pub fn fade(&mut self, change: u32, angles: &mut [f64]) {
        if self.is_new(change) {
            self.begin(angles);
        } else {
            self.since_s += self.period_s;
        }
        self.change = Some(change);
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
        // The angles that come in are one period on.
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
