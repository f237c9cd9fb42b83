//! An arm's ranges, for angles that its solver did not produce.

use std::ops::Range;

use crate::model::{ArmGeometry, Chain, Joint, SharedRange};

/// The ranges of an arm's hinges, and the ranges they share.
#[derive(Debug, Clone)]
pub(super) struct HingeRanges {
    ranges_rad: Vec<(f64, f64)>,
    shared: Vec<(Range<usize>, SharedRange)>,
}

impl HingeRanges {
    /// The ranges of `chain`, which has these joints.
    pub(super) fn new(chain: &Chain, joints: &[Joint]) -> HingeRanges {
        let arm = ArmGeometry::of(chain, joints).map(|arm| arm.joints).unwrap_or_default();
        let shared = arm.into_iter().filter_map(|joint| {
            Some((joint.hinges.clone(), SharedRange::new(&joints[joint.hinges], joint.range?)))
        });
        HingeRanges {
            ranges_rad: joints.iter().map(Joint::goal_range_rad).collect(),
            shared: shared.collect(),
        }
    }

    /// Limits `angles` (rad) to the ranges; `last` are the angles sent before. Angles that are outside may
    /// come in, or stay, but go no further out: a limp arm begins where it hung.
    pub(super) fn hold(&self, last: &[f64], angles: &mut [f64]) {
        for ((angle, last), (low, high)) in angles.iter_mut().zip(last).zip(&self.ranges_rad) {
            *angle = angle.clamp(low.min(*last), high.max(*last));
        }
        for (hinges, range) in &self.shared {
            let (before, now) = (&last[hinges.clone()], &mut angles[hinges.clone()]);
            let outside = range.outside_by(now);
            if range.holds(now) || (!range.holds(before) && outside <= range.outside_by(before)) {
                continue;
            }
            // The nearest pose inside, if it is in the hinges' own ranges, too.
            let mut nearest = [0.0; 3];
            let nearest = &mut nearest[..now.len()];
            nearest.copy_from_slice(now);
            range.bring_in(nearest);
            for (angle, (low, high)) in nearest.iter_mut().zip(&self.ranges_rad[hinges.clone()]) {
                *angle = angle.clamp(*low, *high);
            }
            if range.holds(before) && !range.holds(nearest) {
                let share = range.share_inside(before, now);
                for (angle, before) in now.iter_mut().zip(before) {
                    *angle = before + share * (*angle - before);
                }
            } else {
                now.copy_from_slice(nearest);
            }
        }
    }
}
