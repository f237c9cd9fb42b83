//! The thesis' own change of gait (Takizawa 2005, 3.1 and 3.3), kept for comparison with ours: it drives no robot.
//!
//! The trunk's speed steps at once. Each leg lengthens or shortens one stance so that it lifts when the new
//! gait requires, and compensates that, and the step of speed, in the stride that follows. No foot slips and
//! none jumps, but nothing keeps a foot near its root, and a long stance may require a negative time.
//!
//! The thesis changes once a stride, and a stride begins with the left hind's lift-off. Here the change may
//! begin anywhere in it: phase offsets count from the left hind's next lift-off, so a leg that lifts before it has a
//! negative phase offset, and all four end up in the new gait together. If the change begins at the lift-off itself,
//! this is exactly the thesis' rule.

use crate::model::Gait;
use crate::motion::curves::SwingCurve;

/// Lift-offs closer together than this share of a period count as one.
const SAME_MOMENT: f64 = 1e-9;

/// A gait and its speed (thesis: alpha, D1, D2 and V).
#[derive(Debug, Clone, Copy)]
pub struct SteadyGait<'a> {
    /// The gait.
    pub gait: &'a Gait,
    /// Speed of the trunk, m/s.
    pub speed_m_s: f64,
}

/// A change from one gait and speed to another. Times are s since it began, negative before.
#[derive(Debug, Clone)]
pub struct ThesisRule {
    swing: SwingCurve,
    old: Stride,
    new: Stride,
    legs: [LegChange; 4],
}

/// Strides of a steady gait.
#[derive(Debug, Clone, Copy)]
struct Stride {
    speed_m_s: f64,
    period_s: f64,
}

/// Effect of the change on one leg.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LegChange {
    /// Time of its next lift-off without the change, s (thesis: C).
    pub scheduled_s: f64,
    /// Time added to the stance before that, s (thesis: t).
    pub added_s: f64,
    /// Length of the stride that follows, m (thesis 3.6: S).
    pub stride_m: f64,
    /// Position of its lift-off, forward of where the root was when the change began, m.
    at_m: f64,
    /// Time of its landing before that, s.
    landing_s: f64,
}

/// Position of a foot at one moment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Foot {
    /// Distance forward of its root, m.
    pub forward_m: f64,
    /// Height above the ground, m.
    pub up_m: f64,
    /// True in swing.
    pub is_swing: bool,
}

impl LegChange {
    /// Time of the lift-off into the new gait, s.
    pub fn lift_off_s(&self) -> f64 {
        self.scheduled_s + self.added_s
    }

    /// True if the leg would have to lift before it has landed, or before the change began.
    pub fn lifts_too_early(&self) -> bool {
        self.lift_off_s() < self.landing_s.max(0.0) - SAME_MOMENT
    }
}

impl ThesisRule {
    /// A change that begins `start_share` of a stride after the left hind's lift-off, 0 <= share < 1; feet
    /// swing by `swing`. Before the change every stance is centred under its root.
    pub fn new(swing: SwingCurve, from: SteadyGait, to: SteadyGait, start_share: f64) -> ThesisRule {
        let stride = |pace: SteadyGait| Stride {
            speed_m_s: pace.speed_m_s,
            period_s: pace.gait.period_s(swing.time_s),
        };
        let (old, new) = (stride(from), stride(to));
        let share = start_share.rem_euclid(1.0);
        let until_left_hind = if share < SAME_MOMENT { 0.0 } else { 1.0 - share };
        let (phase_offsets, new_offsets) = (unreduced_offsets(from.gait), unreduced_offsets(to.gait));
        let legs = std::array::from_fn(|leg| {
            // The first lift-off that has not already begun at the change.
            let mut strides = 0.0;
            while until_left_hind + phase_offsets[leg] + strides - 1.0 > SAME_MOMENT {
                strides -= 1.0;
            }
            let scheduled_s = (until_left_hind + phase_offsets[leg] + strides) * old.period_s;
            let added_s =
                new.period_s * (new_offsets[leg] + strides) - old.period_s * (phase_offsets[leg] + strides);
            // 3.6; the first term is V' P / (1 - alpha').
            let stride_m = new.speed_m_s * new.period_s
                + (new.speed_m_s - old.speed_m_s) * scheduled_s
                + new.speed_m_s * added_s;
            LegChange {
                scheduled_s,
                added_s,
                stride_m,
                at_m: old.speed_m_s * (scheduled_s - 0.5 * from.gait.duty_factor * old.period_s),
                landing_s: scheduled_s - old.period_s + swing.time_s,
            }
        });
        ThesisRule { swing, old, new, legs }
    }

    /// Effect of the change on each leg, in the order of [`crate::model::LEG_NAMES`].
    pub fn legs(&self) -> &[LegChange; 4] {
        &self.legs
    }

    /// Position of every leg's root at time `s`, forward of where it was when the change began, m.
    pub fn root_m(&self, s: f64) -> f64 {
        let stride = if s < 0.0 { self.old } else { self.new };
        stride.speed_m_s * s
    }

    /// Position of the foot of `leg` at time `s`. A leg that lifts too early leaves from where it would have
    /// landed.
    pub fn foot(&self, leg: usize, s: f64) -> Foot {
        let change = &self.legs[leg];
        let (lifted_s, from_m, stride_m) = if s < change.lift_off_s() {
            // Count whole strides back from the one that lands before the change; the stance may take longer.
            let strides = ((s - change.scheduled_s) / self.old.period_s).floor().min(-1.0);
            let stride_m = self.old.speed_m_s * self.old.period_s;
            let lifted_s = change.scheduled_s + strides * self.old.period_s;
            (lifted_s, change.at_m + strides * stride_m, stride_m)
        } else {
            let strides = ((s - change.lift_off_s()) / self.new.period_s).floor();
            let lifted_s = change.lift_off_s() + strides * self.new.period_s;
            let stride_m = self.new.speed_m_s * self.new.period_s;
            if strides < 1.0 {
                (lifted_s, change.at_m, change.stride_m)
            } else {
                (lifted_s, change.at_m + change.stride_m + (strides - 1.0) * stride_m, stride_m)
            }
        };
        let u = (s - lifted_s) / self.swing.time_s;
        Foot {
            forward_m: from_m + stride_m * self.swing.way(u) - self.root_m(s),
            up_m: self.swing.height_m(u),
            is_swing: u < 1.0,
        }
    }

    /// Distance of the foot of `leg` forward of its root at its lift-off into the new gait, m.
    pub fn lift_off_m(&self, leg: usize) -> f64 {
        self.legs[leg].at_m - self.root_m(self.legs[leg].lift_off_s())
    }
}

/// Lift-offs as shares of the period after the left hind's; the right fore's is the sum D1 + D2 that the
/// thesis uses: in trot it is a whole period, not 0.
fn unreduced_offsets(gait: &Gait) -> [f64; 4] {
    let [left_hind, left_fore, right_hind, right_fore] = gait.phase_offsets;
    let sum = left_fore + right_hind;
    let is_sum = (sum - 1.0 - right_fore).abs() < SAME_MOMENT;
    [left_hind, left_fore, right_hind, if is_sum { sum } else { right_fore }]
}
