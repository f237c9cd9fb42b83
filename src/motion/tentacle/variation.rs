//! Random variation between arms: R(j, k), added to each key angle (Ishizuka 2008, 3.4). The same seed gives
//! the same arms.

use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::{Rng, SeedableRng};

use super::key_angles::KeyAngles;

/// A stream of uniform random numbers for one arm.
#[derive(Debug, Clone)]
pub struct Variation {
    source: Pcg64Mcg,
    size_rad: f64,
}

impl Variation {
    /// The stream for arm number `arm` of a robot with this `seed`; key angles vary by at most `size_rad`
    /// either way.
    pub fn new(seed: u64, arm: usize, size_rad: f64) -> Variation {
        // Golden-ratio steps keep the seeds of neighbouring arms and robots apart.
        let seed = seed ^ (arm as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        Variation { source: Pcg64Mcg::seed_from_u64(seed), size_rad }
    }

    /// The same stream, `count` numbers further on. Each stroke has numbers of its own, so that a further stroke
    /// changes none of the others.
    pub fn after(mut self, count: u64) -> Variation {
        self.source.advance(u128::from(count));
        self
    }

    /// The next number r of R(j, k): j <= r < k.
    pub fn uniform(&mut self, j: f64, k: f64) -> f64 {
        let share = (self.source.next_u64() >> 11) as f64 / (1_u64 << 53) as f64;
        j + (k - j) * share
    }

    /// `keys` with each angle varied.
    pub fn varied(&mut self, keys: KeyAngles) -> KeyAngles {
        KeyAngles(keys.0.map(|turns| turns.map(|turn| turn + self.uniform(-self.size_rad, self.size_rad))))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::motion::tentacle::strokes::walk::WALK;

    #[test]
    fn arms_differ_within_the_size_and_repeat_with_the_seed() {
        let arm = |seed, arm| Variation::new(seed, arm, 0.1).varied(WALK);
        assert_eq!(arm(5, 0), arm(5, 0));
        assert_ne!(arm(5, 0), arm(5, 1));
        assert_ne!(arm(5, 0), arm(6, 0));
        for (varied, keys) in arm(5, 3).0.iter().flatten().zip(WALK.0.iter().flatten()) {
            assert!((varied - keys).abs() <= 0.1);
        }
    }

    #[test]
    fn numbers_of_a_later_stroke_are_those_of_the_stream() {
        let mut all = Variation::new(3, 1, 0.1);
        let mut later = all.clone().after(5);
        let numbers: Vec<f64> = (0..7).map(|_| all.uniform(0.0, 1.0)).collect();
        let same = [(); 2]
            .map(|()| later.uniform(0.0, 1.0))
            .iter()
            .zip(&numbers[5..])
            .all(|(a, b)| a.total_cmp(b).is_eq());
        assert!(same);
    }

    #[test]
    fn random_numbers_are_uniform() {
        let mut variation = Variation::new(1, 2, 0.0);
        let mut counts = [0; 10];
        for _ in 0..100_000 {
            let r = variation.uniform(-2.0, 3.0);
            assert!((-2.0..3.0).contains(&r));
            let bin = (0..10).rev().find(|bin| r >= -2.0 + 0.5 * f64::from(*bin)).unwrap();
            counts[bin as usize] += 1;
        }
        assert!(counts.iter().all(|count| (9600..10_400).contains(count)), "{counts:?}");
    }
}
