//! The thesis' rule: cyclic coordinate descent, group by group (Ishizuka 2008, 3.1.2, 3.1.3 and 3.2).

use std::ops::Range;

use glam::{DQuat, DVec3};

use super::super::pose::Angle;
use super::pose::Pose;
use super::smooth::Ends;

/// Most sweeps over a group in one solution.
const SWEEPS_MAX: u32 = 20;
/// Levers shorter than this, m, have no useful direction.
const LEVER_MIN_M: f64 = 1e-9;

impl Pose {
    /// Brings the end of each group to its pseudo-target with the group's own hinges, root first, until it is
    /// within `near_m`.
    pub(super) fn sweep_groups(&mut self, ends: &Ends, near_m: f64) {
        let mut begin = 0;
        for group in 0..ends.count {
            let end = self.balls[ends.links[group] - 1].end;
            for _ in 0..SWEEPS_MAX {
                if self.end(ends.links[group]).distance(ends.places[group]) <= near_m {
                    break;
                }
                self.sweep(begin..end, ends.links[group], ends.places[group]);
            }
            begin = end;
        }
    }

    /// From the last of `hinges` to the first, turns each by its ratio times the angle that points the end of
    /// that many `links` at `target` (3.7).
    fn sweep(&mut self, hinges: Range<usize>, links: usize, target: DVec3) {
        // This sweep does not use the part between a turned hinge and the end again.
        let mut end = self.end(links);
        for hinge in self.hinges[hinges].iter_mut().rev() {
            let axis = hinge.direction;
            let (from, to) = (end - hinge.place, target - hinge.place);
            let sine = axis.dot(from.cross(to));
            let cosine = from.dot(to) - axis.dot(from) * axis.dot(to);
            if sine.abs() + cosine.abs() < LEVER_MIN_M * LEVER_MIN_M {
                continue;
            }
            let wanted_rad = hinge.held(hinge.angle.rad + hinge.stiffness * sine.atan2(cosine));
            end = hinge.place + DQuat::from_axis_angle(axis, wanted_rad - hinge.angle.rad) * from;
            hinge.angle = Angle::of(wanted_rad);
        }
        let from = self.root();
        self.tip = (0..self.balls.len()).fold(from, |from, ball| self.hold_ball(ball, from)).0;
    }
}
