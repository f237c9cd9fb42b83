//! How far the feet reach in each posture: a table worked out when the robot loads.

use super::posture::Lean;
use crate::model::Bob;
use crate::motion::Posture;

/// Share of the interpolated half-excursion that is counted on away from the standing posture.
const INTERPOLATED_SHARE: f64 = 0.95;
/// Share of the standing posture's half-excursion that every posture must leave.
const LEAST_SHARE: f64 = 0.25;
/// Halvings of the way to a posture that leaves too little.
const HALVINGS: u32 = 8;
/// Share of the half-excursion that is left when the trunk sways.
const SWAYING_SHARE: f64 = 0.7;

/// Half-excursion of each leg over its root's trunk height and pitch.
#[derive(Debug, Clone, PartialEq)]
pub struct ReachTable {
    /// The standing posture's, least of all legs, m.
    pub level_m: f64,
    /// Standing height, m.
    pub stand_height_m: f64,
    /// Heights of the trunk's middle, rising, m.
    pub heights_m: Vec<f64>,
    /// Pitches, rising, rad.
    pub pitches_rad: Vec<f64>,
    /// Half-excursions of the legs, m: at height h and pitch p number `h * pitches + p`.
    pub half_excursions_m: Vec<[f64; 4]>,
    /// Places of the legs' planes to the left, m.
    pub sides_m: [f64; 4],
    /// Steepest roll, rad.
    pub roll_max_rad: f64,
    /// Furthest sway, m; 0 where no joint turns sideways.
    pub sway_max_m: f64,
}

impl ReachTable {
    /// Half-excursion that every foot has at `posture`, m; with the trunk up to `bob` above and below it.
    pub fn half_excursion_m(&self, posture: Posture, bob: Bob) -> f64 {
        if posture == Posture::default() {
            return self.level_m;
        }
        let sway = if posture.sway_m.abs() > 0.0 { SWAYING_SHARE } else { 1.0 };
        let half_bob_m = 0.5 * bob.rise_m;
        [-half_bob_m, half_bob_m]
            .into_iter()
            .flat_map(|bob_m| (0..4).map(move |leg| (leg, bob_m)))
            .map(|(leg, bob_m)| {
                let lean = Lean {
                    height_m: self.stand_height_m + posture.rise_m + bob_m,
                    pitch_rad: posture.pitch_rad,
                    roll_rad: posture.roll_rad,
                };
                self.of_leg_m(leg, &lean)
            })
            .fold(self.level_m, |least, leg_m| least.min(INTERPOLATED_SHARE * sway * leg_m))
    }

    /// A roll lifts a leg's plane on one side and lowers it on the other, like another height of the trunk.
    fn of_leg_m(&self, leg: usize, lean: &Lean) -> f64 {
        let (sine, cosine) = lean.roll_rad.sin_cos();
        let height_m = (lean.height_m + self.sides_m[leg] * sine / lean.pitch_rad.cos()) / cosine;
        let Some((row, down)) = place(&self.heights_m, height_m) else { return 0.0 };
        let Some((column, right)) = place(&self.pitches_rad, lean.pitch_rad) else { return 0.0 };
        let at =
            |row: usize, column: usize| self.half_excursions_m[row * self.pitches_rad.len() + column][leg];
        let blend = |row: usize| at(row, column) * (1.0 - right) + at(row, column + 1) * right;
        blend(row) * (1.0 - down) + blend(row + 1) * down
    }

    /// The posture nearest to `wanted`, on the straight way from standing, that leaves the feet enough reach.
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
        let share_of = |share: f64| Posture {
            rise_m: inside.rise_m * share,
            pitch_rad: inside.pitch_rad * share,
            roll_rad: inside.roll_rad * share,
            sway_m: inside.sway_m * share,
        };
        let is_enough = |posture| self.half_excursion_m(posture, Bob::NONE) >= LEAST_SHARE * self.level_m;
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

/// The interval of `values` that `value` is in, and how far into it, 0 to 1; none outside.
fn place(values: &[f64], value: f64) -> Option<(usize, f64)> {
    let last = values.len().checked_sub(2)?;
    if value < values[0] - 1e-9 || value > values[last + 1] + 1e-9 {
        return None;
    }
    let index = values.iter().rposition(|start| *start <= value).unwrap_or(0).min(last);
    Some((index, ((value - values[index]) / (values[index + 1] - values[index])).clamp(0.0, 1.0)))
}
