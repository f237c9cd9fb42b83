//! A person turns one joint by hand from end to end: shows which way its servo counts, and whether its encoder's
//! seam is on the way.

/// Movement of a joint that still counts as held still, counts.
const STILL_COUNTS: f64 = 4.0;
/// How long it must be still at its second end, s.
const REST_S: f64 = 0.5;
/// How long it must be still near its middle before it begins, s: so the way there does not count as the turn
/// forward.
const BEGIN_REST_S: f64 = 0.3;
/// The direction of a turn is clear after this share of half the joint's range, but at most [`TURN_MOST`] counts.
const TURN_SHARE: f64 = 0.4;
/// 10 degrees of 4096 counts a turn.
const TURN_MOST: f64 = 114.0;

/// The present stage of a sweep.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Stage {
    /// The joint is too far from its middle to begin.
    ToMiddle,
    /// Waiting for the turn forward.
    Forward,
    /// The turn forward is done; waiting for the turn back, to the other end.
    Back,
    /// It rests at its other end.
    Done(SweepResult),
}

/// The result of a sweep.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct SweepResult {
    /// Counts fall when the joint turns forward.
    pub(super) is_falling: bool,
    /// Counts have jumped from one end of the turn to the other.
    pub(super) has_seam: bool,
    /// Counts from end to end.
    pub(super) travel: f64,
    /// Position where it rests, counts from the marked pose.
    pub(super) end: f64,
}

/// A joint under observation while a person turns it.
#[derive(Debug, Clone)]
pub(super) struct Sweep {
    /// Counts in a turn, and in half the joint's range.
    turn: f64,
    half: f64,
    /// The last raw count; and its distance from the marked pose, counting whole turns.
    raw: Option<f64>,
    at: f64,
    stage: Stage,
    /// Start position, and lowest and highest position since.
    start: f64,
    low: f64,
    high: f64,
    /// +1 if the first turn was to higher counts.
    sign: f64,
    has_seam: bool,
    /// Position when it last moved, and time since then, s.
    rest_at: f64,
    rest_s: f64,
}

impl Sweep {
    /// For a joint whose servo was at `zero_pose` in the marked pose, with `half` counts from there to either end
    /// of its range, and `turn` counts in a turn.
    pub(super) fn new(zero_pose: f64, half: f64, turn: f64) -> Sweep {
        Sweep {
            turn,
            half,
            raw: Some(zero_pose),
            at: 0.0,
            stage: Stage::ToMiddle,
            start: 0.0,
            low: 0.0,
            high: 0.0,
            sign: 1.0,
            has_seam: false,
            rest_at: 0.0,
            // A joint that is still in the marked pose may begin at once.
            rest_s: BEGIN_REST_S,
        }
    }

    /// Its distance from the marked pose, counts, counting whole turns.
    pub(super) fn at(&self) -> f64 {
        self.at
    }

    /// Notes that the servo is at `count`, `dt_s` after the last look.
    pub(super) fn see(&mut self, count: f64, dt_s: f64) -> Stage {
        let step = count - self.raw.unwrap_or(count);
        // The shorter way round.
        let way = step - self.turn * (step / self.turn).round();
        self.raw = Some(count);
        self.at += way;
        if matches!(self.stage, Stage::Forward | Stage::Back) {
            self.has_seam |= (step - way).abs() > 0.5 * self.turn;
        }
        (self.low, self.high) = (self.low.min(self.at), self.high.max(self.at));
        if (self.at - self.rest_at).abs() > STILL_COUNTS.min(0.2 * self.half) {
            (self.rest_at, self.rest_s) = (self.at, 0.0);
        } else {
            self.rest_s += dt_s;
        }
        let enough = (TURN_SHARE * self.half).min(TURN_MOST);
        self.stage = match self.stage {
            Stage::ToMiddle if self.at.abs() <= 0.5 * self.half && self.rest_s >= BEGIN_REST_S => {
                (self.start, self.low, self.high) = (self.at, self.at, self.at);
                Stage::Forward
            }
            Stage::Forward if (self.at - self.start).abs() >= enough => {
                self.sign = (self.at - self.start).signum();
                Stage::Back
            }
            Stage::Back if (self.start - self.at) * self.sign >= enough && self.rest_s >= REST_S => {
                Stage::Done(SweepResult {
                    is_falling: self.sign < 0.0,
                    has_seam: self.has_seam,
                    travel: self.high - self.low,
                    end: self.at,
                })
            }
            unchanged => unchanged,
        };
        self.stage
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// The stages of a joint of 400 counts either way that moves along `ways` from the marked pose, at count `zero`
    /// there.
    fn stages(zero: f64, ways: &[f64]) -> Vec<Stage> {
        let mut sweep = Sweep::new(zero, 400.0, 4096.0);
        let mut at: f64 = 0.0;
        let mut stages = vec![sweep.see(zero.rem_euclid(4096.0).round(), 0.02)];
        for way in ways {
            while (way - at).abs() > 1e-9 {
                at += (way - at).clamp(-20.0, 20.0);
                stages.push(sweep.see((zero + at).rem_euclid(4096.0).round(), 0.02));
            }
            for _ in 0..30 {
                stages.push(sweep.see((zero + at).rem_euclid(4096.0).round(), 0.02));
            }
        }
        stages.dedup();
        stages
    }

    #[test]
    fn the_first_turn_shows_the_sign_and_the_second_stop_ends_the_sweep() {
        let done =
            |is_falling, has_seam, end| Stage::Done(SweepResult { is_falling, has_seam, travel: 800.0, end });
        assert_eq!(
            stages(2048.0, &[400.0, -400.0]),
            [Stage::Forward, Stage::Back, done(false, false, -400.0)]
        );
        assert_eq!(stages(2048.0, &[-400.0, 400.0]), [Stage::Forward, Stage::Back, done(true, false, 400.0)]);
        // The seam between 4095 and 0 lies on the way, in either half.
        assert_eq!(stages(4000.0, &[400.0, -400.0]).last(), Some(&done(false, true, -400.0)));
        assert_eq!(stages(100.0, &[400.0, -400.0]).last(), Some(&done(false, true, -400.0)));
    }

    #[test]
    fn a_joint_at_its_stop_is_moved_to_the_middle_first() {
        let mut sweep = Sweep::new(2048.0, 400.0, 4096.0);
        // From its high end past the middle, where it rests: the way there does not count as the turn forward.
        let mut count = 2448.0;
        while count > 1950.0 {
            assert_eq!(sweep.see(count, 0.02), Stage::ToMiddle, "{count}");
            count -= 20.0;
        }
        let stages: Vec<Stage> = (0..20).map(|_| sweep.see(1950.0, 0.02)).collect();
        assert_eq!((stages.first(), stages.last()), (Some(&Stage::ToMiddle), Some(&Stage::Forward)));
        assert_eq!(sweep.see(2200.0, 0.02), Stage::Back);
        assert_eq!(sweep.sign.to_bits(), 1.0_f64.to_bits());
    }

    #[test]
    fn half_a_sweep_does_not_count() {
        assert_eq!(stages(2048.0, &[400.0]), [Stage::Forward, Stage::Back]);
        assert_eq!(stages(2048.0, &[80.0, -60.0]), [Stage::Forward]);
    }

    proptest! {
        #[test]
        fn the_sign_is_found_wherever_the_horn_sits(zero in 0.0..4096.0_f64, is_falling in any::<bool>()) {
            let sign = if is_falling { -1.0 } else { 1.0 };
            let stages = stages(zero.round(), &[sign * 300.0, sign * -300.0]);
            let Some(Stage::Done(swept)) = stages.last() else { panic!("{stages:?}") };
            prop_assert_eq!(swept.is_falling, is_falling);
            let (low, high) = (zero.round() - 300.0, zero.round() + 300.0);
            prop_assert_eq!(swept.has_seam, low < 0.0 || high >= 4096.0);
        }
    }
}
