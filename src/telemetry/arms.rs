//! Arms: how close they come to their targets, how far they bend, and how far apart they stay.

use glam::DVec3;

use super::report::ArmsReport;
use crate::model::{GROUPS, Robot, TentacleMotion, segments};
use crate::observe::CycleRecord;
use crate::signals::Aim;

/// Distances between arms are checked once in this many cycles: nothing comes close in so few.
const EVERY: u64 = 5;
/// Links shorter than this have no direction, m.
const LINK_SHORTEST_M: f64 = 1e-6;

#[derive(Debug)]
pub(super) struct ArmObserver {
    settings: TentacleMotion,
    /// Link ends of each arm, its root first, body frame, m.
    places: Vec<Vec<DVec3>>,
    cycle: u64,
    report: ArmsReport,
}

impl ArmObserver {
    pub(super) fn new(robot: &Robot, settings: &TentacleMotion) -> ArmObserver {
        let at_rest = |arm: &crate::model::ArmSettings| {
            let chain = &robot.chains[arm.chain];
            robot.places_in_body(chain, chain.joints.clone().map(|_| 0.0))
        };
        ArmObserver {
            settings: settings.clone(),
            places: settings.arms.iter().map(at_rest).collect(),
            cycle: 0,
            report: ArmsReport::default(),
        }
    }

    pub(super) fn report(&self) -> ArmsReport {
        self.report
    }

    pub(super) fn observe(&mut self, robot: &Robot, record: &CycleRecord<'_>) {
        if record.targets.aim() != Aim::Arms {
            return;
        }
        self.cycle += 1;
        let report = &mut self.report;
        for (arm, places) in self.settings.arms.iter().zip(&mut self.places) {
            let chain = &robot.chains[arm.chain];
            report.tip_residual_max_m = report.tip_residual_max_m.max(record.joints.residual_m[arm.chain]);
            let residual_m = record.joints.group_residual_m[arm.chain];
            report.group_residual_max_m = report.group_residual_max_m.max(residual_m);
            let goals = record.state.goal_rad[chain.joints.clone()].iter().copied();
            robot.write_places_in_body(chain, goals, places);
            let bend_deg = largest_bend_rad(chain.root_rotation * DVec3::X, places).to_degrees();
            report.bend_max_deg = report.bend_max_deg.max(bend_deg);
        }
        if self.cycle % EVERY == 1 {
            self.observe_clearance(robot);
        }
    }

    fn observe_clearance(&mut self, robot: &Robot) {
        let mut least_m = self.report.clearance_min_m.unwrap_or(f64::INFINITY);
        for (index, (arm, places)) in self.settings.arms.iter().zip(&self.places).enumerate() {
            for (other, others) in self.settings.arms.iter().zip(&self.places).skip(index + 1) {
                let skins_m = arm.radius_m + other.radius_m;
                // Their root groups are side by side however they bend.
                let apart_m = distance_m(outer(places), others).min(distance_m(places, outer(others)));
                least_m = least_m.min(apart_m - skins_m);
            }
            if let Some(radius_m) = self.settings.base_radius_m {
                let nearest_m = distance_m(outer(places), &[robot.trunk_center_m; 2]);
                least_m = least_m.min(nearest_m - radius_m - arm.radius_m);
            }
        }
        self.report.clearance_min_m = least_m.is_finite().then_some(least_m);
    }
}

/// An arm without its first group.
fn outer(places: &[DVec3]) -> &[DVec3] {
    &places[(places.len() - 1) / GROUPS..]
}

/// The largest angle between one link and the next, with the root's direction before the first link, rad.
fn largest_bend_rad(ahead: DVec3, places: &[DVec3]) -> f64 {
    let (mut before, mut largest) = (ahead, 0.0_f64);
    for pair in places.windows(2) {
        let link = pair[1] - pair[0];
        if link.length() > LINK_SHORTEST_M {
            largest = largest.max(before.angle_between(link));
            before = link;
        }
    }
    largest
}

/// Smallest distance between two lines through points, m.
fn distance_m(a: &[DVec3], b: &[DVec3]) -> f64 {
    let pairs = a.windows(2).flat_map(|a| b.windows(2).map(move |b| ([a[0], a[1]], [b[0], b[1]])));
    pairs.map(|(a, b)| segments::distance_m(a, b)).fold(f64::INFINITY, f64::min)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bends_and_distances_match_those_of_the_centre_lines() {
        let line =
            |points: &[[f64; 3]]| points.iter().map(|point| DVec3::from_array(*point)).collect::<Vec<_>>();
        // Zero-length links between the hinges of a joint do not count.
        let bent =
            line(&[[0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0]]);
        assert!((largest_bend_rad(DVec3::X, &bent).to_degrees() - 90.0).abs() < 1e-9);
        assert!((largest_bend_rad(DVec3::NEG_X, &bent).to_degrees() - 180.0).abs() < 1e-9);
        let beside = line(&[[2.0, -1.0, 0.0], [2.0, 3.0, 0.0]]);
        assert!((distance_m(&bent, &beside) - 1.0).abs() < 1e-12);
        let across = line(&[[0.5, -1.0, 0.2], [0.5, 1.0, 0.2]]);
        assert!((distance_m(&bent, &across) - 0.2).abs() < 1e-12, "between the ends of links, too");
    }
}
