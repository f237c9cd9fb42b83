//! An arm that is loaded beyond its limit gives way slowly, as if in honey, and then returns.
//!
//! This stage stands between inverse kinematics and safety. It treats each chain on its own:
//!
//! ```text
//!            over its load for a time             rests, and long enough
//! Holding --------------------------> Yielding -------------------------> Returning
//!    ^                                   ^                                   |  |
//!    |                                   +--- loaded again, 3 times at most -+  |
//!    +------------------------------ back at its target ------------------------+
//! ```
//! A load that is there at every return is no hand: safety handles a jam.

#[cfg(test)]
mod tests;

use std::ops::Range;

use crate::model::{Robot, YieldSettings};
use crate::motion::curves::smooth_step;
use crate::signals::{JointState, JointTargets, State};

/// Joints are at rest while they turn slower than this, rad/s.
const REST_RAD_S: f64 = 0.1;
/// How many times in a row an arm gives way.
const IN_A_ROW: u32 = 3;
/// An arm that never comes to rest returns anyway after this multiple of its shortest time, even against the hand.
const LONGEST: f64 = 10.0;

#[derive(Debug, Clone, Copy, PartialEq)]
enum Phase {
    Holding {
        over_s: f64,
    },
    /// Giving way for the `time`-th time in a row.
    Yielding {
        since_s: f64,
        time: u32,
    },
    Returning {
        since_s: f64,
        over_s: f64,
        time: u32,
    },
}

const HOLDING: Phase = Phase::Holding { over_s: 0.0 };

/// Watches the load of every chain.
#[derive(Debug, Clone)]
pub struct Yielding {
    settings: Option<YieldSettings>,
    limbs: Vec<(Range<usize>, Phase)>,
    /// Position of each joint when its arm began to return, rad.
    from_rad: Vec<f64>,
    times: u32,
}

impl Yielding {
    /// For a limp `robot`. It never yields if the robot's file has no settings for it.
    pub fn new(robot: &Robot) -> Yielding {
        Yielding {
            settings: robot.yielding,
            limbs: robot.chains.iter().map(|chain| (chain.joints.clone(), HOLDING)).collect(),
            from_rad: vec![0.0; robot.joints.len()],
            times: 0,
        }
    }

    /// Number of times an arm has given way.
    pub fn times(&self) -> u32 {
        self.times
    }

    /// True while an arm gives way or returns.
    pub fn is_yielding(&self) -> bool {
        self.limbs.iter().any(|(_, phase)| !matches!(phase, Phase::Holding { .. }))
    }

    /// Checks every chain `dt_s` after the last call, and changes the targets of those that yield.
    pub fn step(&mut self, dt_s: f64, state: &State, targets: &mut JointTargets) {
        let Some(settings) = self.settings else { return };
        if targets.is_limp || targets.only.is_some() {
            self.limbs.iter_mut().for_each(|(_, phase)| *phase = HOLDING);
            return;
        }
        for (joints, phase) in &mut self.limbs {
            let (Some(measured), Some(is_out)) =
                (state.joints.get(joints.clone()), state.is_out.get(joints.clone()))
            else {
                continue;
            };
            let before = *phase;
            *phase = before.next(dt_s, &settings, is_overloaded(&settings, measured, is_out), measured);
            if matches!(phase, Phase::Yielding { .. }) && !matches!(before, Phase::Yielding { .. }) {
                self.times = self.times.saturating_add(1);
            }
            let (Some(from), Some(angles), Some(shares)) = (
                self.from_rad.get_mut(joints.clone()),
                targets.angles_rad.get_mut(joints.clone()),
                targets.torque_shares.get_mut(joints.clone()),
            ) else {
                continue;
            };
            match *phase {
                Phase::Holding { .. } => {}
                Phase::Yielding { .. } => {
                    for (((angle, share), from), joint) in
                        angles.iter_mut().zip(shares).zip(from).zip(measured)
                    {
                        *angle = joint.position_rad;
                        *from = joint.position_rad;
                        *share = share.min(settings.torque_share);
                    }
                }
                Phase::Returning { since_s, .. } => {
                    let back = smooth_step(since_s / settings.return_s);
                    for ((angle, share), from) in angles.iter_mut().zip(shares).zip(from) {
                        *angle = *from + back * (*angle - *from);
                        let low = share.min(settings.torque_share);
                        *share = low + back * (*share - low);
                    }
                }
            }
        }
    }
}

impl Phase {
    fn next(
        self,
        dt_s: f64,
        settings: &YieldSettings,
        is_overloaded: bool,
        measured: &[JointState],
    ) -> Phase {
        let count = |over_s: f64| if is_overloaded { over_s + dt_s } else { 0.0 };
        match self {
            Phase::Holding { over_s } if count(over_s) > settings.after_s => {
                Phase::Yielding { since_s: 0.0, time: 1 }
            }
            Phase::Holding { over_s } => Phase::Holding { over_s: count(over_s) },
            Phase::Yielding { since_s, time } => {
                let is_still = measured.iter().all(|joint| joint.speed_rad_s.abs() < REST_RAD_S);
                let since_s = since_s + dt_s;
                let is_over = since_s >= settings.for_s && is_still;
                if is_over || since_s >= LONGEST * settings.for_s {
                    Phase::Returning { since_s: 0.0, over_s: 0.0, time }
                } else {
                    Phase::Yielding { since_s, time }
                }
            }
            Phase::Returning { over_s, time, .. } if time < IN_A_ROW && count(over_s) > settings.after_s => {
                Phase::Yielding { since_s: 0.0, time: time + 1 }
            }
            Phase::Returning { since_s, .. } if since_s + dt_s >= settings.return_s => HOLDING,
            Phase::Returning { since_s, over_s, time } => {
                Phase::Returning { since_s: since_s + dt_s, over_s: count(over_s), time }
            }
        }
    }
}

/// True if a joint that was heard just now, and has torque, bears more than permitted.
fn is_overloaded(settings: &YieldSettings, measured: &[JointState], is_out: &[bool]) -> bool {
    measured.iter().zip(is_out).any(|(joint, is_out)| {
        joint.is_known && joint.age_s <= 0.0 && !is_out && joint.load_share.abs() > settings.load_share
    })
}
