//! A path through waypoints: a [`Route`] from each to the next; adjacent routes meet in one direction.

use glam::DVec3;

use super::route::Route;
use crate::model::WAYPOINTS_MAX;

/// Distance of a route's control points from its ends, as a share of the distance between the ends.
const CONTROL_SHARE: f64 = 1.0 / 3.0;

/// Waypoints nearer than this count as one, m.
const APART_M: f64 = 1e-6;

/// Consecutive routes.
#[derive(Debug, Clone, PartialEq)]
pub struct Tour {
    start: DVec3,
    routes: [Option<Route>; WAYPOINTS_MAX - 1],
    length_m: f64,
}

impl Tour {
    /// The path through `waypoints`, m, at most [`WAYPOINTS_MAX`] of them. At each inner one its direction is
    /// from the one before towards the one after.
    pub fn new(waypoints: &[DVec3]) -> Tour {
        // A waypoint that is given twice has no way to the next, and no direction.
        let (mut places, mut count) = ([DVec3::ZERO; WAYPOINTS_MAX], 0);
        for waypoint in waypoints {
            if count < WAYPOINTS_MAX && (count == 0 || places[count - 1].distance(*waypoint) > APART_M) {
                places[count] = *waypoint;
                count += 1;
            }
        }
        let last = count.saturating_sub(1);
        let mut tour = Tour { start: places[0], routes: Default::default(), length_m: 0.0 };
        let at = |index: usize| places[index.min(last)];
        let ahead = |index: usize| (at(index + 1) - at(index.saturating_sub(1))).normalize_or_zero();
        for (index, route) in tour.routes.iter_mut().enumerate() {
            let (from, to) = (at(index), at(index + 1));
            let off_m = CONTROL_SHARE * from.distance(to);
            *route = Route::new([from, from + off_m * ahead(index), to - off_m * ahead(index + 1), to]);
            tour.length_m += route.as_ref().map_or(0.0, Route::length_m);
        }
        tour
    }

    /// Its length, m.
    pub fn length_m(&self) -> f64 {
        self.length_m
    }

    /// The point at the distance `distance_m` along it; beyond an end, that end.
    pub fn place(&self, distance_m: f64) -> DVec3 {
        let mut begin_m = 0.0;
        let mut place = self.start;
        for route in self.routes.iter().flatten() {
            place = route.place(route.parameter_at(distance_m - begin_m));
            begin_m += route.length_m();
            if distance_m <= begin_m {
                break;
            }
        }
        place
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn corners() -> [DVec3; 5] {
        [
            DVec3::new(0.1, 0.0, 0.3),
            DVec3::new(0.2, 0.1, 0.25),
            DVec3::new(0.2, 0.1, 0.25),
            DVec3::new(0.1, 0.2, 0.3),
            DVec3::new(-0.1, 0.1, 0.2),
        ]
    }

    #[test]
    fn a_tour_passes_all_waypoints_at_one_speed_and_rounds_its_corners() {
        let tour = Tour::new(&corners());
        let steps = 2000;
        let places: Vec<DVec3> = (0..=steps)
            .map(|step| tour.place(tour.length_m() * f64::from(step) / f64::from(steps)))
            .collect();
        let step_m = tour.length_m() / f64::from(steps);
        for pair in places.windows(2) {
            assert!((pair[0].distance(pair[1]) / step_m - 1.0).abs() < 1e-3, "{pair:?}");
        }
        for three in places.windows(3) {
            let turn = (three[1] - three[0]).angle_between(three[2] - three[1]);
            assert!(turn < 0.02, "{turn} rad within {step_m} m");
        }
        for corner in corners() {
            let near_m = places.iter().map(|place| place.distance(corner)).fold(f64::INFINITY, f64::min);
            assert!(near_m < step_m, "{corner} is missed by {near_m} m");
        }
        assert!(tour.place(-1.0).distance(corners()[0]) < 1e-12);
        assert!(tour.place(1e9).distance(corners()[4]) < 1e-12);
    }

    #[test]
    fn a_tour_without_length_stays_in_place() {
        let tour = Tour::new(&[DVec3::ONE; 3]);
        assert!(tour.length_m().abs() < 1e-15 && tour.place(1.0) == DVec3::ONE);
        assert_eq!(Tour::new(&[]).place(0.5), DVec3::ZERO);
    }
}
