//! Ranges that the hinges of one joint share: hinges within their own limits may still take the joint outside.

use super::{JointCommand, Safety};
use crate::signals::State;

impl Safety {
    /// Shortens the last step, `dt_s` long, of hinges that would leave a range they share, all by the same share,
    /// so that they stay inside. This range outranks acceleration too. Limp hinges, and hinges outside the range
    /// that are on their way in, are left alone.
    pub(super) fn keep_shared_ranges(&mut self, dt_s: f64, state: &mut State) {
        for (joints, range) in &self.shared {
            let (mut before, mut after) = ([0.0; 3], [0.0; 3]);
            let count = joints.len().min(before.len());
            for (place, index) in joints.clone().enumerate().take(count) {
                let limiter = &self.joints[index].limiter;
                before[place] = limiter.goal_before_rad(dt_s);
                after[place] = limiter.goal_rad();
            }
            let share = range.share_inside(&before[..count], &after[..count]);
            if share >= 1.0 {
                continue;
            }
            for index in joints.clone() {
                if let JointCommand::Goal { angle_rad, .. } = &mut self.command.joints[index] {
                    *angle_rad = self.joints[index].limiter.shorten(share, dt_s);
                    state.goal_rad[index] = *angle_rad;
                    self.command.interventions += 1;
                }
            }
        }
    }
}
