//! The circumstances of one trial: drawn from a seed and the trial's number alone.

use std::f64::consts::TAU;

use serde::Serialize;

use crate::kinds::Falls;
use crate::model::FallDirection;
use crate::motion::GaitChoice;
use crate::random::RandomStream;

/// Friction of the ground: polished wood to rubber.
pub const FRICTION: (f64, f64) = (0.5, 1.0);
/// Impulse of a push per kg of the robot, N s. No robot falls at the first value; every robot does at the second.
pub const IMPULSE_NS_KG: (f64, f64) = (0.2, 1.2);
/// Number of directions in which a figure is pushed.
const SIDES: u64 = 8;
/// Duration of a push, s.
pub const PUSH_S: f64 = 0.1;
/// Time of the push, s since the robot first stood: two strides or more.
const PUSH_AT_S: (f64, f64) = (1.0, 2.5);
/// Speeds, shares of the gait's top speed.
const SPEED_SHARE: (f64, f64) = (0.3, 0.9);
/// Half the angle in which a push counts as along one axis: eight sides of 45 degrees.
const SIDE_RAD: f64 = TAU / 16.0;

/// The circumstances of one trial.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Scene {
    /// Its number in the series of its seed.
    pub number: u64,
    /// The robot's gait.
    #[serde(skip)]
    pub gait: GaitChoice,
    /// Speed, as a share of that gait's top speed.
    pub speed_share: f64,
    /// Coulomb friction of the ground.
    pub friction: f64,
    /// Time of the push, s since the robot first stood.
    pub push_at_s: f64,
    /// Direction of the push, rad from ahead to the left.
    pub towards_rad: f64,
    /// Impulse of the push, N s.
    pub impulse_ns: f64,
    /// Random seed of the sensors' errors.
    #[serde(skip)]
    pub world_seed: u64,
}

impl Scene {
    /// Trial `number` in the series of `seed`, for a robot of `mass_kg` whose falls are tried out in this way.
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_precision_loss,
        clippy::cast_sign_loss,
        reason = "sides, strengths and gaits are few"
    )]
    pub fn draw(falls: &Falls, mass_kg: f64, seed: u64, number: u64) -> Scene {
        let mut chance = RandomStream::new(seed, number);
        let world_seed = chance.clone().whole();
        let mut between = |(low, high): (f64, f64)| chance.between(low, high);
        match falls {
            Falls::AllRound(strengths_ns_kg) => {
                // Go through all sides at every strength, again and again.
                let side = number % SIDES;
                let strength = (number / SIDES) as usize % strengths_ns_kg.len();
                Scene {
                    number,
                    gait: GaitChoice::Stand,
                    speed_share: 0.0,
                    friction: between(FRICTION),
                    push_at_s: between(PUSH_AT_S),
                    towards_rad: side as f64 * TAU / SIDES as f64,
                    impulse_ns: mass_kg * strengths_ns_kg[strength],
                    world_seed,
                }
            }
            Falls::AtRandom(gaits) => {
                let gait = gaits.get(between((0.0, gaits.len() as f64)) as usize);
                Scene {
                    number,
                    gait: gait.copied().unwrap_or_default(),
                    speed_share: between(SPEED_SHARE),
                    friction: between(FRICTION),
                    push_at_s: between(PUSH_AT_S),
                    towards_rad: between((0.0, TAU)),
                    impulse_ns: mass_kg * between(IMPULSE_NS_KG),
                    world_seed,
                }
            }
        }
    }

    /// Force of its push, in the trunk's frame, N.
    pub fn force_n(&self) -> [f64; 3] {
        let (across, along) = self.towards_rad.sin_cos();
        [along, across, 0.0].map(|part| part * self.impulse_ns / PUSH_S)
    }

    /// True if a fall in this direction matches the push. Of eight sides, those along an axis permit only
    /// that axis; those on a diagonal permit either neighbour.
    pub fn is_towards(&self, direction: FallDirection) -> bool {
        let axis_rad = match direction {
            FallDirection::Forward => 0.0,
            FallDirection::Left => 0.25 * TAU,
            FallDirection::Backward => 0.5 * TAU,
            FallDirection::Right => 0.75 * TAU,
            FallDirection::Twisting => return false,
        };
        // The angle between the two, 0 to half a turn.
        let off_rad = (self.towards_rad - axis_rad + 0.5 * TAU).rem_euclid(TAU) - 0.5 * TAU;
        off_rad.abs() <= 3.0 * SIDE_RAD
    }
}
