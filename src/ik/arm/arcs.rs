//! First guesses: each stretch of an arm an arc, a polygon of equal bends.
//!
//! A stretch begins where the one before ended and is to end at a place. In the plane of its way there and of the link
//! before it, one bend, the same at each of its joints, makes it as short as the way is, to one side or to the other.

use std::f64::consts::TAU;
use std::ops::Range;

use glam::{DQuat, DVec3};

use super::pose::Pose;
use super::smooth::{ENDS_MAX, Ends};

/// Halvings of the interval in which a stretch's bend is sought.
const HALVINGS: u32 = 40;
/// Sides the arcs may be bent to, each a bit.
pub(super) const SIDES: usize = 1 << ENDS_MAX;

impl Pose {
    /// Writes the places of an arm of arcs, the k-th to the side the k-th bit of `sides` says; returns its sum of
    /// squared bends, rad^2.
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
            // The way is the chord, which the first link runs ahead of.
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

    /// Where a stretch of `links` ends that begins along x and bends to y, the same at each joint.
    fn chord(&self, links: Range<usize>, bend: f64) -> (f64, f64) {
        links.enumerate().fold((0.0, 0.0), |(x, y), (index, link)| {
            let (sine, cosine) = (bend * index as f64).sin_cos();
            (x + self.link_m(link) * cosine, y + self.link_m(link) * sine)
        })
    }

    /// The bend at which the stretch of `links` is `way_m` from end to end; 0 where it is too short.
    fn bend_of(&self, links: Range<usize>, way_m: f64) -> f64 {
        // Bent by the highest, the ends of equal links meet.
        let (mut low, mut high) = (0.0, TAU / links.len() as f64);
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            let (x, y) = self.chord(links.clone(), middle);
            if x.hypot(y) > way_m { low = middle } else { high = middle }
        }
        low
    }
}

/// `vector` turned about the unit vector `axis`, right-handed.
fn turned(vector: DVec3, axis: DVec3, angle: f64) -> DVec3 {
    DQuat::from_axis_angle(axis, angle) * vector
}
