//! The reach of the feet in postures other than standing level.

use super::Reach;
use super::follower::Follower;
use super::reach::{reachable, strides_of};
use crate::model::{HorseMotion, Robot};
use crate::motion::horse::{LegReach, ReachTable, Reachable, TrunkPose};

/// Number of heights and pitches at which a leg's reach is computed, and the steepest pitch and roll, rad.
const HEIGHTS: u32 = 5;
const HEIGHTS_ABOVE: u32 = 3;
const PITCHES: u32 = 9;
const PITCH_MAX_RAD: f64 = 0.2;
const ROLL_MAX_RAD: f64 = 0.12;
/// The highest posture, and the largest sway that is tried, as shares of the standing height.
const HIGHEST: f64 = 1.05;
const SWAY_MAX: f64 = 0.15;
/// How far a reach is followed, as a share of E.
const LIMIT: f64 = 1.2;
/// Share of E that a sway must leave.
const SWAYING_SHARE: f64 = 0.75;
/// Halvings in the search for the largest sway.
const HALVINGS: u32 = 6;

/// Reach of the feet by the trunk's height and pitch, about the neutral points of `reaches`.
pub(super) fn table(robot: &Robot, horse: &HorseMotion, reaches: &[Reach; 4]) -> ReachTable {
    let level_m = reaches.iter().map(|reach| reach.half_excursion_m).fold(f64::INFINITY, f64::min);
    // The level stand is one of the heights: most postures are near it.
    let stand_m = horse.stand_height_m;
    let mut heights_m = between(horse.sit_height_m, stand_m, HEIGHTS);
    heights_m.extend(between(stand_m, HIGHEST * stand_m, HEIGHTS_ABOVE).into_iter().skip(1));
    let pitches_rad = between(-PITCH_MAX_RAD, PITCH_MAX_RAD, PITCHES);
    let strides = strides_of(horse);
    let mut legs: [Vec<LegReach>; 4] = Default::default();
    let mut level = [LegReach::UNLIMITED; 4];
    let mut levels_m = (0.0, 0.0);
    let mut sway_max_m = SWAY_MAX * horse.stand_height_m;
    for (leg, (column, reach)) in legs.iter_mut().zip(reaches).enumerate() {
        let neutral_m = reach.neutral_in_body.x;
        let mut follower = Follower::standing_at(robot, horse, leg, neutral_m);
        levels_m = follower.heights_m();
        let stand = TrunkPose { height_m: horse.stand_height_m, pitch_rad: 0.0, roll_rad: 0.0 };
        level[leg] = follower.finely().reach_at(stand, neutral_m, LIMIT * level_m);
        let mut at = |height_m: f64, pitch_rad: f64| {
            let trunk = TrunkPose { height_m, pitch_rad, roll_rad: 0.0 };
            follower.reach_at(trunk, neutral_m, LIMIT * level_m)
        };
        for height_m in &heights_m {
            for pitch_rad in &pitches_rad {
                column.push(at(*height_m, *pitch_rad));
            }
        }
        sway_max_m = furthest_sway_m(&mut follower, neutral_m, level_m, sway_max_m);
    }
    ReachTable {
        // The legs' own reach, found about the same points.
        level: Reachable {
            half_excursion_m: level_m,
            ..reachable(level, levels_m, horse, &strides, level_m)
        },
        stand_height_m: horse.stand_height_m,
        cells: (0..legs[0].len()).map(|place| legs.each_ref().map(|leg| leg[place])).collect(),
        heights_m,
        pitches_rad,
        strides,
        sides_m: reaches.map(|reach| reach.neutral_in_body.y),
        roll_max_rad: ROLL_MAX_RAD,
        sway_max_m,
    }
}

/// `count` numbers from `low` to `high`.
fn between(low: f64, high: f64, count: u32) -> Vec<f64> {
    (0..count).map(|index| low + (high - low) * f64::from(index) / f64::from(count - 1)).collect()
}

/// How far, up to `limit_m`, the trunk can sway over a foot to either side and leave it enough of its
/// half-excursion `level_m`; 0 without a joint that turns sideways.
fn furthest_sway_m(follower: &mut Follower, neutral_m: f64, level_m: f64, limit_m: f64) -> f64 {
    let needed_m = SWAYING_SHARE * level_m;
    let mut sways = |sway_m: f64| {
        [-sway_m, sway_m].into_iter().all(|sway_m| {
            let LegReach { aft_m, fore_m } = follower.reach_swaying(sway_m, neutral_m, needed_m);
            aft_m.iter().chain(&fore_m).all(|reach_m| *reach_m >= needed_m)
        })
    };
    if !sways(limit_m / f64::from(1 << HALVINGS)) {
        return 0.0;
    }
    let (mut good_m, mut bad_m) = (0.0, limit_m);
    for _ in 0..HALVINGS {
        let middle_m = 0.5 * (good_m + bad_m);
        if sways(middle_m) { good_m = middle_m } else { bad_m = middle_m }
    }
    good_m
}
