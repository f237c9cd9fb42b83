//! One arm that is kept clear of others: its last and its next pose, and how its joints move it.

use std::ops::Range;

use glam::DVec3;

use super::super::hinge_ranges::HingeRanges;
use crate::model::segments;
use crate::model::{ArmSettings, Chain, GROUPS, Joint, Pace, Robot, TendonDrive};

/// Step of the numerical derivative, rad.
const DERIVATIVE_STEP_RAD: f64 = 1e-6;
/// A joint that moves a point by less than this share of the arm's length per radian counts as not moving it.
const LEVER_MIN_SHARE: f64 = 0.02;
/// A deviation of an arm from its wanted angles below this, rad, counts as zero.
const NOTHING_RAD: f64 = 1e-9;
/// Share of its top speed at which a joint returns.
const RETURN_SHARE: f64 = 0.25;

/// An arm.
#[derive(Debug, Clone)]
pub(super) struct GuardedArm {
    chain: Chain,
    joints: Vec<Joint>,
    pub(super) radius_m: f64,
    length_m: f64,
    held: HingeRanges,
    /// Safety's limits for each joint: an arm that is asked for more would go where it was not checked.
    paces: Vec<Pace>,
    period_s: f64,
    /// Angles wanted and sent in the last cycle, and angles to send now, rad.
    wanted_rad: Vec<f64>,
    out_rad: Vec<f64>,
    speed_rad_s: Vec<f64>,
    now_rad: Vec<f64>,
    before: Places,
    now: Places,
    /// Largest distance that a point of each group moves in this cycle, m.
    moved_m: [f64; GROUPS],
    /// For derivatives.
    probe: Vec<DVec3>,
    lever_m: Vec<f64>,
}

/// Positions of the ends of an arm's links, its root first, body frame, m, and spheres round its groups.
#[derive(Debug, Clone)]
struct Places {
    ends: Vec<DVec3>,
    balls: [(DVec3, f64); GROUPS],
}

/// The nearest points of two groups.
#[derive(Debug, Clone, Copy)]
pub(super) struct Near {
    /// Link of each group, and the position along it as a share; the second does not count if `stands` is set.
    links: [usize; 2],
    shares: [f64; 2],
    stands: Option<DVec3>,
    /// Least distance of the groups in the last cycle, and now, m.
    pub(super) before_m: f64,
    pub(super) now_m: f64,
}

impl Places {
    fn new(chain: &Chain, joints: &[Joint]) -> Places {
        // The buffer also takes the positions of hinges that lie in one place.
        let links = chain.tendons.as_ref().map_or(0, TendonDrive::links);
        let ends = Vec::with_capacity(joints.len().max(links) + 1);
        let mut places = Places { ends, balls: [(DVec3::ZERO, 0.0); GROUPS] };
        chain.write_places_in_body(joints, joints.iter().map(|_| 0.0), &mut places.ends);
        places.ends.dedup();
        places
    }

    fn set(&mut self, chain: &Chain, joints: &[Joint], angles: &[f64]) {
        write_ends(chain, joints, angles, &mut self.ends);
        for group in 0..GROUPS {
            let places = &self.ends[group_places(self.ends.len(), group)];
            let center = places.iter().sum::<DVec3>() / places.len() as f64;
            let radius_m = places.iter().map(|place| place.distance_squared(center)).fold(0.0, f64::max);
            self.balls[group] = (center, radius_m.sqrt());
        }
    }

    /// The links of a group: for each its index, its start and its end.
    fn links(&self, group: usize) -> impl Iterator<Item = (usize, [DVec3; 2])> + Clone {
        let places = group_places(self.ends.len(), group);
        let first = places.start;
        self.ends[places].windows(2).enumerate().map(move |(index, pair)| (first + index, [pair[0], pair[1]]))
    }

    fn at(&self, link: usize, share: f64) -> DVec3 {
        self.ends[link].lerp(self.ends[link + 1], share)
    }
}

/// Writes the ends of links; hinges in one place count once.
fn write_ends(chain: &Chain, joints: &[Joint], angles: &[f64], ends: &mut Vec<DVec3>) {
    chain.write_places_in_body(joints, angles.iter().copied(), ends);
    ends.dedup();
}

/// Indices of a group's points on an arm with this many, including the root of the first group.
fn group_places(places: usize, group: usize) -> Range<usize> {
    let links = places - 1;
    group * links / GROUPS..(group + 1) * links / GROUPS + 1
}

impl GuardedArm {
    pub(super) fn new(robot: &Robot, arm: &ArmSettings) -> GuardedArm {
        let chain = robot.chains[arm.chain].clone();
        let joints = robot.joints_of(&chain).to_vec();
        let pace = |joint: &Joint| Pace {
            rate_rad_s: robot.safety.rate_share * joint.no_load_speed_rad_s(),
            acceleration_rad_s2: robot.safety.acceleration_rad_s2,
        };
        let none = vec![0.0; joints.len()];
        GuardedArm {
            radius_m: arm.radius_m,
            length_m: chain.length_m(&joints),
            held: HingeRanges::new(&chain, &joints),
            paces: joints.iter().map(pace).collect(),
            period_s: robot.period_s(),
            wanted_rad: none.clone(),
            out_rad: none.clone(),
            speed_rad_s: none.clone(),
            now_rad: none.clone(),
            // A clone would lose its capacity.
            before: Places::new(&chain, &joints),
            now: Places::new(&chain, &joints),
            moved_m: [0.0; GROUPS],
            probe: Places::new(&chain, &joints).ends,
            lever_m: none,
            chain,
            joints,
        }
    }

    /// Begins at the `angles` of all joints.
    pub(super) fn begin(&mut self, angles: &[f64]) {
        let angles = &angles[self.chain.joints.clone()];
        self.wanted_rad.copy_from_slice(angles);
        self.out_rad.copy_from_slice(angles);
        self.speed_rad_s.fill(0.0);
        self.now_rad.copy_from_slice(angles);
        self.now.set(&self.chain, &self.joints, angles);
    }

    /// Moves on to the wanted angles, and reduces the deviation by this `share`; the motion `goes_on` or
    /// begins at rest.
    pub(super) fn advance(&mut self, angles: &[f64], goes_on: bool, share: f64) {
        let angles = &angles[self.chain.joints.clone()];
        for (index, (now, wanted)) in self.now_rad.iter_mut().zip(angles).enumerate() {
            let wanted_before = if goes_on { self.wanted_rad[index] } else { *wanted };
            let aside = self.out_rad[index] - wanted_before;
            let most = RETURN_SHARE * self.paces[index].rate_rad_s * self.period_s;
            let left = aside - (share * aside).clamp(-most, most);
            let to = if left.abs() < NOTHING_RAD { *wanted } else { wanted + left };
            // `place` holds this to the joint's pace. It does not plan to stop there: the target moves on.
            *now = to;
        }
        self.wanted_rad.copy_from_slice(angles);
        self.place();
    }

    /// Writes the result to `angles`.
    pub(super) fn commit(&mut self, angles: &mut [f64]) {
        angles[self.chain.joints.clone()].copy_from_slice(&self.now_rad);
        for ((speed, now), out) in self.speed_rad_s.iter_mut().zip(&self.now_rad).zip(&self.out_rad) {
            *speed = (now - out) / self.period_s;
        }
        self.out_rad.copy_from_slice(&self.now_rad);
        std::mem::swap(&mut self.before, &mut self.now);
    }

    /// Keeps the arm where it was in the last cycle.
    pub(super) fn stay(&mut self) {
        self.now_rad.copy_from_slice(&self.out_rad);
        self.place();
    }

    fn place(&mut self) {
        for (index, now) in self.now_rad.iter_mut().enumerate() {
            let (out, pace, speed_rad_s) = (self.out_rad[index], self.paces[index], self.speed_rad_s[index]);
            let wanted_rad_s = (*now - out) / self.period_s;
            if !pace.permits(wanted_rad_s, speed_rad_s, self.period_s) {
                *now = out + self.period_s * pace.speed_near(wanted_rad_s, speed_rad_s, self.period_s);
            }
        }
        self.held.hold(&self.out_rad, &mut self.now_rad);
        self.now.set(&self.chain, &self.joints, &self.now_rad);
        for (group, moved_m) in self.moved_m.iter_mut().enumerate() {
            let places = group_places(self.now.ends.len(), group);
            let pairs = self.now.ends[places.clone()].iter().zip(&self.before.ends[places]);
            *moved_m = pairs.map(|(now, before)| now.distance_squared(*before)).fold(0.0, f64::max).sqrt();
        }
    }

    /// True if a group may come nearer to one of `other` than permitted, judged by the spheres round them:
    /// their distance may fall by this `share` of its excess over the least.
    pub(super) fn comes_near(
        &self,
        group: usize,
        other: &GuardedArm,
        others: usize,
        least_m: f64,
        share: f64,
    ) -> bool {
        let (ball, others_ball) = (self.before.balls[group], other.before.balls[others]);
        let before_m = ball.0.distance(others_ball.0) - ball.1 - others_ball.1;
        share * (before_m - least_m) < self.moved_m[group] + other.moved_m[others]
    }

    /// The point of a group nearest to one of `other`.
    pub(super) fn nearest(&self, group: usize, other: &GuardedArm, others: usize) -> Near {
        let mut near = Near::far(None);
        for (link, piece) in self.now.links(group) {
            for (of_other, others_piece) in other.now.links(others) {
                let shares = segments::nearest(piece, others_piece);
                let places =
                    [piece[0].lerp(piece[1], shares[0]), others_piece[0].lerp(others_piece[1], shares[1])];
                let distance_m = places[0].distance(places[1]);
                if distance_m < near.now_m {
                    near = Near { links: [link, of_other], shares, now_m: distance_m, ..near };
                }
            }
        }
        let before = self.before.links(group).flat_map(|(_, piece)| {
            other.before.links(others).map(move |(_, others)| segments::distance_m(piece, others))
        });
        Near { before_m: before.fold(f64::INFINITY, f64::min), ..near }
    }

    /// The point of a group nearest to a fixed point.
    pub(super) fn nearest_to(&self, group: usize, place: DVec3) -> Near {
        let mut near = Near::far(Some(place));
        for (link, piece) in self.now.links(group) {
            let [share, _] = segments::nearest(piece, [place; 2]);
            let distance_m = piece[0].lerp(piece[1], share).distance(place);
            if distance_m < near.now_m {
                near = Near { links: [link, 0], shares: [share, 0.0], now_m: distance_m, ..near };
            }
        }
        let before = self.before.links(group).map(|(_, piece)| segments::distance_m(piece, [place; 2]));
        Near { before_m: before.fold(f64::INFINITY, f64::min), ..near }
    }

    /// Distance that the point has moved along `way` since the last cycle, m.
    fn gone_m(&self, link: usize, share: f64, way: DVec3) -> f64 {
        (self.now.at(link, share) - self.before.at(link, share)).dot(way)
    }

    /// Turns the joints by the least amount that moves the point by `by_m` along `way`.
    fn push(&mut self, link: usize, share: f64, way: DVec3, by_m: f64) {
        let from_m = self.now.at(link, share).dot(way);
        let mut square = 0.0;
        for index in 0..self.now_rad.len() {
            let angle = self.now_rad[index];
            self.now_rad[index] = angle + DERIVATIVE_STEP_RAD;
            write_ends(&self.chain, &self.joints, &self.now_rad, &mut self.probe);
            self.now_rad[index] = angle;
            let to_m = self.probe[link].lerp(self.probe[link + 1], share).dot(way);
            self.lever_m[index] = (to_m - from_m) / DERIVATIVE_STEP_RAD;
            square += self.lever_m[index] * self.lever_m[index];
        }
        let least_m = LEVER_MIN_SHARE * self.length_m;
        let scale = by_m / square.max(least_m * least_m);
        for (angle, lever_m) in self.now_rad.iter_mut().zip(&self.lever_m) {
            *angle += scale * lever_m;
        }
        self.place();
    }
}

impl Near {
    fn far(stands: Option<DVec3>) -> Near {
        Near { links: [0; 2], shares: [0.0; 2], stands, before_m: f64::INFINITY, now_m: f64::INFINITY }
    }

    /// Moves the two apart by `short_m`, each in proportion to its part in the approach.
    pub(super) fn part(self, a: &mut GuardedArm, b: Option<&mut GuardedArm>, short_m: f64) {
        let place = a.now.at(self.links[0], self.shares[0]);
        let other = b.as_ref().map(|b| b.now.at(self.links[1], self.shares[1])).or(self.stands);
        let Some(way) = other.and_then(|other| (place - other).try_normalize()) else { return };
        let Some(b) = b else { return a.push(self.links[0], self.shares[0], way, short_m) };
        let a_m = (-a.gone_m(self.links[0], self.shares[0], way)).max(0.0);
        let b_m = b.gone_m(self.links[1], self.shares[1], way).max(0.0);
        let share = if a_m + b_m > 0.0 { a_m / (a_m + b_m) } else { 0.5 };
        if share > 0.0 {
            a.push(self.links[0], self.shares[0], way, share * short_m);
        }
        if share < 1.0 {
            b.push(self.links[1], self.shares[1], -way, (1.0 - share) * short_m);
        }
    }
}
