//! Draws from one stream of random numbers.

use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::{Rng, SeedableRng};

/// A stream of random numbers: the same for the same seed and number.
#[derive(Debug, Clone)]
pub struct RandomStream(Pcg64Mcg);

impl RandomStream {
    /// Stream `number` of `seed`. Two streams never coincide: the multiplier only spreads neighbouring numbers.
    pub fn new(seed: u64, number: u64) -> RandomStream {
        RandomStream(Pcg64Mcg::seed_from_u64(seed ^ number.wrapping_mul(0x9E37_79B9_7F4A_7C15)))
    }

    /// Any whole number.
    pub fn whole(&mut self) -> u64 {
        self.0.next_u64()
    }

    /// A number from 0 up to 1.
    pub fn share(&mut self) -> f64 {
        #[allow(clippy::cast_precision_loss, reason = "53 bits fit")]
        let share = (self.0.next_u64() >> 11) as f64 / (1_u64 << 53) as f64;
        share
    }

    /// A number between two.
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.share()
    }

    /// A number between two above 0, equally often in each decade.
    pub fn log_between(&mut self, low: f64, high: f64) -> f64 {
        (self.between(low.ln(), high.ln())).exp()
    }

    /// A whole number below `count`; 0 if `count` is 0.
    pub fn below(&mut self, count: usize) -> usize {
        let count = u64::try_from(count.max(1)).unwrap_or(1);
        usize::try_from(self.0.next_u64() % count).unwrap_or(0)
    }

    /// True in this share of all draws.
    pub fn is(&mut self, share: f64) -> bool {
        self.share() < share
    }

    /// One of these; `None` if there are none.
    pub fn one_of<'a, T>(&mut self, of: &'a [T]) -> Option<&'a T> {
        of.get(self.below(of.len()))
    }
}
