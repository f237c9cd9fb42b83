//! The reach of the feet in each posture: computed when the robot loads, looked up while it walks.

use super::posture::TrunkPose;
use crate::motion::Posture;

/// Number of foot heights at which the reach is known, from the lowest to the highest in a stride.
pub const LEVELS: usize = 9;

/// Share of the reach that is used between the postures it was computed for.
const BETWEEN_SHARE: f64 = 0.97;
/// How far off their middle the first and last strides of a walk may be, shares of E: every posture must
/// allow this.
const SPARE: f64 = 0.6;
/// Share of the standing posture's half-excursion that every posture must leave.
const LEAST_SHARE: f64 = 0.25;
/// Number of postures checked on the way to another.
const WAY_STEPS: u32 = 5;
/// Number of halvings of the way to a posture that leaves too little reach.
const HALVINGS: u32 = 8;
/// Share of the reach that must be left when the trunk sways.
const SWAYING_SHARE: f64 = 0.7;

/// How far a foot can go from its neutral point, by height: distances, 0 or more, m.
///
/// At the top of a swing a leg may reach less far than on the ground, or have a gap where a joint's range ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LegReach {
    /// Backwards.
    pub aft_m: [f64; LEVELS],
    /// Forward.
    pub fore_m: [f64; LEVELS],
}

impl LegReach {
    /// A foot without limits.
    pub const UNLIMITED: LegReach =
        LegReach { aft_m: [f64::INFINITY; LEVELS], fore_m: [f64::INFINITY; LEVELS] };

    fn zip(&self, other: &LegReach, f: impl Fn(f64, f64) -> f64) -> LegReach {
        LegReach {
            aft_m: std::array::from_fn(|level| f(self.aft_m[level], other.aft_m[level])),
            fore_m: std::array::from_fn(|level| f(self.fore_m[level], other.fore_m[level])),
        }
    }
}

/// Reach of the feet in a posture, and on the way to it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reachable {
    /// Half-excursion E of steady strides, all legs, m; no foot goes further.
    pub half_excursion_m: f64,
    /// Reach of each leg by height.
    pub legs: [LegReach; 4],
    /// Heights of the lowest and the highest level above the ground from which the trunk's mean height
    /// is measured, m.
    pub levels_m: (f64, f64),
    /// How far the trunk rises and falls about its mean height, m.
    pub half_oscillation_m: f64,
}

impl Reachable {
    /// True if the foot of `leg` can be `excursion_m` forward of its neutral point and `up_m` above the ground.
    pub(super) fn holds(&self, leg: usize, excursion_m: f64, up_m: f64) -> bool {
        if excursion_m.abs() > self.half_excursion_m {
            return false;
        }
        let reach = &self.legs[leg];
        let limits_m = if excursion_m < 0.0 { &reach.aft_m } else { &reach.fore_m };
        let (low, high) = self.levels_round(up_m);
        limits_m[low..=high].iter().all(|limit_m| excursion_m.abs() <= *limit_m)
    }

    /// The two levels on either side of a foot that is `up_m` above the ground.
    fn levels_round(&self, up_m: f64) -> (usize, usize) {
        let (low_m, high_m) = self.levels_m;
        #[allow(clippy::cast_precision_loss, reason = "a small number")]
        let level = |up_m: f64| {
            let share = (up_m - low_m) / (high_m - low_m);
            share.clamp(0.0, 1.0) * (LEVELS - 1) as f64
        };
        let whole = |level: f64| {
            #[allow(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "from 0 to LEVELS - 1"
            )]
            let level = level as usize;
            level
        };
        (
            whole(level(up_m - self.half_oscillation_m).floor()),
            whole(level(up_m + self.half_oscillation_m).ceil()),
        )
    }

    /// Reach of the feet that both this posture and `other` allow.
    pub(super) fn and(&self, other: &Reachable) -> Reachable {
        Reachable {
            half_excursion_m: self.half_excursion_m.min(other.half_excursion_m),
            legs: std::array::from_fn(|leg| self.legs[leg].zip(&other.legs[leg], f64::min)),
            ..*self
        }
    }

    /// The reach with the largest E up to `limit_m` at which steady `strides` stay within it, as do strides
    /// that are off their middle by up to `spare` of E.
    #[must_use]
    pub fn with_half_excursion_of(mut self, strides: &[StridePoint], limit_m: f64, spare: f64) -> Reachable {
        let mut half_excursion_m = limit_m;
        for point in strides {
            let (low, high) = self.levels_round(point.up_m);
            for reach in &self.legs {
                let limits_m = if point.forward < 0.0 { &reach.aft_m } else { &reach.fore_m };
                let limit_m = limits_m[low..=high].iter().fold(f64::INFINITY, |least, m| least.min(*m));
                half_excursion_m = half_excursion_m.min(limit_m / point.forward.abs().max(spare));
            }
        }
        self.half_excursion_m = half_excursion_m;
        self
    }
}

/// A point on a steady stride's path about the neutral point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StridePoint {
    /// Distance forward, as a share of E; -1 to 1.
    pub forward: f64,
    /// Height above the ground, m.
    pub up_m: f64,
}

/// Reach of the feet, by posture.
#[derive(Debug, Clone, PartialEq)]
pub struct ReachTable {
    /// Reach when standing level.
    pub level: Reachable,
    /// Standing height, m.
    pub stand_height_m: f64,
    /// Heights of the trunk's middle, ascending, m.
    pub heights_m: Vec<f64>,
    /// Pitches, ascending, rad.
    pub pitches_rad: Vec<f64>,
    /// Reach of the legs at height h and pitch p: number `h * pitches + p`.
    pub cells: Vec<[LegReach; 4]>,
    /// Paths of the slowest and the fastest strides.
    pub strides: Vec<StridePoint>,
    /// Positions of the legs' planes to the left, m.
    pub sides_m: [f64; 4],
    /// Steepest roll, rad.
    pub roll_max_rad: f64,
    /// Largest sway, m; 0 if no joint turns sideways.
    pub sway_max_m: f64,
}

impl ReachTable {
    /// Reach of the feet at `posture`; zero if it is not in the table.
    pub fn at(&self, posture: Posture) -> Reachable {
        if posture == Posture::default() {
            return self.level;
        }
        let sway = if posture.sway_m.abs() > 0.0 { SWAYING_SHARE } else { 1.0 };
        let trunk = TrunkPose {
            height_m: self.stand_height_m + posture.rise_m,
            pitch_rad: posture.pitch_rad,
            roll_rad: posture.roll_rad,
        };
        let legs = std::array::from_fn(|leg| self.of_leg(leg, &trunk, BETWEEN_SHARE * sway));
        Reachable { legs, ..self.level }.with_half_excursion_of(
            &self.strides,
            self.level.half_excursion_m,
            SPARE,
        )
    }

    /// Reach of the feet in every posture on the straight way between two.
    pub(super) fn between(&self, from: Posture, to: Posture) -> Reachable {
        (0..WAY_STEPS)
            .map(|step| self.at(from.towards(to, f64::from(step) / f64::from(WAY_STEPS))))
            .fold(self.at(to), |all, posture| all.and(&posture))
    }

    /// True if the feet keep enough reach.
    pub(super) fn is_enough(&self, reach: &Reachable) -> bool {
        reach.half_excursion_m >= LEAST_SHARE * self.level.half_excursion_m
    }

    /// The reach of `leg`. A roll lifts its plane on one side and lowers it on the other, like a change of
    /// the trunk's height.
    fn of_leg(&self, leg: usize, trunk: &TrunkPose, share: f64) -> LegReach {
        let (sine, cosine) = trunk.roll_rad.sin_cos();
        let height_m = (trunk.height_m + self.sides_m[leg] * sine / trunk.pitch_rad.cos()) / cosine;
        let (row, column) = (place(&self.heights_m, height_m), place(&self.pitches_rad, trunk.pitch_rad));
        let (Some(row), Some(column)) = (row, column) else {
            return LegReach { aft_m: [0.0; LEVELS], fore_m: [0.0; LEVELS] };
        };
        // Take the smallest of the corners: a reach ends abruptly.
        let at = |row: usize, column: usize| &self.cells[row * self.pitches_rad.len() + column][leg];
        let least = |a: &LegReach, b: &LegReach| a.zip(b, f64::min);
        let corners = least(
            &least(at(row, column), at(row, column + 1)),
            &least(at(row + 1, column), at(row + 1, column + 1)),
        );
        corners.zip(&corners, |reach_m, _| share * reach_m)
    }

    /// The posture nearest to `wanted`, on the straight way from standing level, that leaves the feet enough reach.
    pub fn limited(&self, wanted: Posture) -> Posture {
        let ends = |values: &[f64]| (values.first().copied(), values.last().copied());
        let (Some(low), Some(high)) = ends(&self.heights_m) else { return Posture::default() };
        let (Some(back), Some(ahead)) = ends(&self.pitches_rad) else { return Posture::default() };
        let inside = Posture {
            rise_m: wanted.rise_m.clamp(low - self.stand_height_m, high - self.stand_height_m),
            pitch_rad: wanted.pitch_rad.clamp(back, ahead),
            roll_rad: wanted.roll_rad.clamp(-self.roll_max_rad, self.roll_max_rad),
            sway_m: wanted.sway_m.clamp(-self.sway_max_m, self.sway_max_m),
        };
        let level = Posture::default();
        let share_of = |share: f64| level.towards(inside, share);
        let is_enough = |posture| self.is_enough(&self.between(level, posture));
        if is_enough(inside) {
            return inside;
        }
        let (mut good, mut bad) = (0.0, 1.0);
        for _ in 0..HALVINGS {
            let middle = 0.5 * (good + bad);
            if is_enough(share_of(middle)) { good = middle } else { bad = middle }
        }
        share_of(good)
    }
}

/// Index of the interval of `values` that contains `value`; `None` outside.
fn place(values: &[f64], value: f64) -> Option<usize> {
    let last = values.len().checked_sub(2)?;
    if value < values[0] - 1e-9 || value > values[last + 1] + 1e-9 {
        return None;
    }
    Some(values.iter().rposition(|start| *start <= value).unwrap_or(0).min(last))
}
