//! First guesses: each stretch of an arm is an arc, a polygon of equal bends.
//!
//! A stretch begins at the end of the one before and should end at a target. In the plane of the way to that
//! target and of the link before the stretch, one bend, the same at each of its joints, makes it exactly as
//! long as the way, to one side or the other.

use std::f64::consts::TAU;
use std::ops::Range;

use glam::{DQuat, DVec3};

use super::pose::Pose;
use super::smooth::{ENDS_MAX, Ends};

/// Halvings of the interval in which the bend of a stretch is sought.
const HALVINGS: u32 = 40;
/// Number of choices of sides for the arcs, one bit each.
pub(super) const SIDES: usize = 1 << ENDS_MAX;

impl Pose {
    /// Writes the positions of an arm of arcs, the k-th to the side given by the k-th bit of `sides`; returns
    /// its sum of squared bends, rad^2.
    pub(super) fn lay_arcs(&self, ends: &Ends, sides: usize, places: &mut [DVec3]) -> f64 {
        let (mut place, root) = self.root();
        let (mut ahead, mut across) = (root.x_axis, root.y_axis);
        let mut cost = 0.0;
        let mut begin = 0;
        for end in 0..ends.count {
            let links = begin..ends.links[end];
            let way = ends.places[end] - place;
            let toward = way.try_normalize().unwrap_or(ahead);
            across = ahead.cross(toward).try_normalize().unwrap_or(across);
            let axis = if sides >> end & 1 == 0 { across } else { -across };
            let bend = self.bend_of(links.clone(), way.length());
            // The way is the chord; the first link deviates from it by this angle.
            let (x, y) = self.chord(links.clone(), bend);
            let mut link = turned(toward, axis, -y.atan2(x));
            let first_bend = ahead.angle_between(link);
            cost += first_bend * first_bend + bend * bend * (links.len() - 1) as f64;
            for index in links.clone() {
                if index > links.start {
                    link = turned(link, axis, bend);
                }
                place += link * self.link_m(index);
                places[index] = place;
            }
            ahead = link;
            begin = links.end;
        }
        for (index, free) in places.iter_mut().enumerate().skip(begin) {
            place += ahead * self.link_m(index);
            *free = place;
        }
        cost
    }

    /// The end of a stretch of `links` that begins along x and bends towards y, equally at each joint.
    fn chord(&self, links: Range<usize>, bend: f64) -> (f64, f64) {
        links.enumerate().fold((0.0, 0.0), |(x, y), (index, link)| {
            let (sine, cosine) = (bend * index as f64).sin_cos();
            (x + self.link_m(link) * cosine, y + self.link_m(link) * sine)
        })
    }

    /// The bend at which the stretch of `links` is `way_m` from end to end; 0 if it is too short.
    fn bend_of(&self, links: Range<usize>, way_m: f64) -> f64 {
        // At the highest bend the ends of equal links meet.
        let (mut low, mut high) = (0.0, TAU / links.len() as f64);
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            let (x, y) = self.chord(links.clone(), middle);
            if x.hypot(y) > way_m { low = middle } else { high = middle }
        }
        low
    }
}

/// `vector` rotated about the unit vector `axis`, right-handed.
fn turned(vector: DVec3, axis: DVec3, angle: f64) -> DVec3 {
    DQuat::from_axis_angle(axis, angle) * vector
}
