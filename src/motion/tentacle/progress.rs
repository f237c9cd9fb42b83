//! The progress of a motion, such as winding or a path, and its speed: the speed never jumps.

/// Time in which it reaches its speed, as a share of the whole duration.
pub(super) const RAMP_SHARE: f64 = 0.2;
/// It has arrived when it is this close to the end.
const THERE: f64 = 1e-5;

/// Progress from 0, nothing, to 1, complete.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Progress {
    pub(super) share: f64,
    /// 1/s.
    speed: f64,
}

impl Progress {
    /// Advances for `dt_s` towards `goal`; the whole way takes about `time_s`.
    pub(super) fn step(&mut self, dt_s: f64, goal: f64, time_s: f64) {
        let fastest = 1.0 / ((1.0 - RAMP_SHARE) * time_s);
        let change = fastest / (RAMP_SHARE * time_s) * dt_s;
        let left = goal - self.share;
        // The speed from which whole steps of deceleration end exactly at the goal.
        let braking = (0.25 * change * change + 2.0 * change / dt_s * left.abs()).sqrt() - 0.5 * change;
        let wanted = left.signum() * braking.min(fastest).min(left.abs() / dt_s);
        self.speed += (wanted - self.speed).clamp(-change, change);
        self.share = (self.share + self.speed * dt_s).clamp(0.0, 1.0);
        if (goal - self.share).abs() < THERE && self.speed.abs() <= change {
            *self = Progress { share: goal, speed: 0.0 };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn progress_comes_to_rest_wherever_it_reverses() {
        let (dt_s, time_s) = (0.01, 4.0);
        let most = 1.0 / ((1.0 - RAMP_SHARE) * time_s) / (RAMP_SHARE * time_s) * dt_s;
        for turned_at in [10, 60, 150, 390] {
            let mut progress = Progress::default();
            for step in 0..1200 {
                let before = progress;
                progress.step(dt_s, if step < turned_at { 1.0 } else { 0.0 }, time_s);
                let speed_before = before.speed;
                let speed = (progress.share - before.share) / dt_s;
                assert!(
                    (speed - speed_before).abs() <= most + 2.0 * THERE / dt_s,
                    "{turned_at}: step {step}"
                );
            }
            assert_eq!(progress, Progress::default(), "turned at {turned_at}");
        }
        let mut progress = Progress::default();
        let steps = (0..).find(|_| {
            progress.step(dt_s, 1.0, time_s);
            progress.share >= 1.0
        });
        assert!(steps.is_some_and(|steps| (370..=440).contains(&steps)), "{steps:?} steps");
    }
}
