//! Intervals of 95 %: Wilson's for shares, by resampling for means and medians.

use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::{Rng, SeedableRng};
use serde::Serialize;

/// The normal distribution's 97.5 % point.
const Z: f64 = 1.959_964;
/// Number of resamples.
const RESAMPLES: usize = 2000;
/// Random seed of the resampling: the same numbers give the same interval.
const SEED: u64 = 1;

/// A count out of a total, and the interval of the share (Wilson 1927), shares of 1.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Share {
    /// The count.
    pub count: u32,
    /// The total.
    pub of: u32,
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

/// A figure and its interval; `None` if there are no values.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Figure {
    /// The mean or median.
    pub value: f64,
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

impl Share {
    /// The share of the values that are true.
    pub fn of(values: impl IntoIterator<Item = bool>) -> Share {
        let (mut count, mut of) = (0, 0);
        for value in values {
            count += u32::from(value);
            of += 1;
        }
        if of == 0 {
            return Share::default();
        }
        let n = f64::from(of);
        let share = f64::from(count) / n;
        let middle = (share + Z * Z / (2.0 * n)) / (1.0 + Z * Z / n);
        let half = Z / (1.0 + Z * Z / n) * (share * (1.0 - share) / n + Z * Z / (4.0 * n * n)).sqrt();
        Share { count, of, low: (middle - half).max(0.0), high: (middle + half).min(1.0) }
    }

    /// The share itself; 0 if the total is 0.
    pub fn value(&self) -> f64 {
        f64::from(self.count) / f64::from(self.of.max(1))
    }
}

/// The mean of `values`, and its interval by resampling (the percentile bootstrap, Efron 1979).
pub fn mean(values: &[f64]) -> Option<Figure> {
    figure(values, |sample| sample.iter().sum::<f64>() / sample.len() as f64)
}

/// The median of `values`, with its interval by the same method.
pub fn median(values: &[f64]) -> Option<Figure> {
    figure(values, |sample| {
        sample.sort_by(f64::total_cmp);
        let half = sample.len() / 2;
        if sample.len() % 2 == 1 { sample[half] } else { 0.5 * (sample[half - 1] + sample[half]) }
    })
}

fn figure(values: &[f64], of: impl Fn(&mut [f64]) -> f64) -> Option<Figure> {
    if values.is_empty() {
        return None;
    }
    let mut chance = Pcg64Mcg::seed_from_u64(SEED);
    let mut sample = values.to_vec();
    let value = of(&mut sample);
    let mut again = Vec::with_capacity(RESAMPLES);
    for _ in 0..RESAMPLES {
        for drawn in &mut sample {
            *drawn = values[usize::try_from(chance.next_u64() % values.len() as u64).unwrap_or(0)];
        }
        again.push(of(&mut sample));
    }
    again.sort_by(f64::total_cmp);
    Some(Figure { value, low: again[RESAMPLES / 40], high: again[RESAMPLES - 1 - RESAMPLES / 40] })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Brown, Cai and DasGupta 2001, and the score interval for 0 of n: 0 to z^2 / (n + z^2).
    #[test]
    fn wilson_intervals_match_published_values() {
        let none = Share::of(std::iter::repeat_n(false, 10));
        assert!(none.low.abs() < 1e-12 && (none.high - 0.277_53).abs() < 1e-4, "{none:?}");
        let half = Share::of((0..20).map(|number| number % 2 == 0));
        assert!((half.low - 0.299_3).abs() < 1e-4 && (half.high - 0.700_7).abs() < 1e-4, "{half:?}");
    }

    /// For normal values, the interval of the mean is the mean and 1.96 standard errors either way.
    #[test]
    fn resampling_gives_the_standard_error_of_a_mean() {
        let mut chance = Pcg64Mcg::seed_from_u64(5);
        let mut draw = || (0..12).map(|_| chance.next_u64() as f64 / u64::MAX as f64).sum::<f64>() - 6.0;
        let values: Vec<f64> = (0..400).map(|_| 3.0 + 2.0 * draw()).collect();
        let Some(Figure { value, low, high }) = mean(&values) else { panic!("values there are") };
        assert!((value - 3.0).abs() < 0.3);
        let expected = 1.96 * 2.0 / 20.0;
        assert!(((high - low) / 2.0 / expected - 1.0).abs() < 0.15, "{low} {high}");
        let Some(middle) = median(&[3.0, 1.0, 2.0]) else { panic!("values there are") };
        assert!((middle.value - 2.0).abs() < 1e-12);
        assert!(mean(&[]).is_none());
    }
}
