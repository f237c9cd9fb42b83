//! Reads numbers, vectors, and lists of them.

use std::ops::RangeInclusive;

use glam::DVec3;
use toml::Spanned;
use toml::de::DeValue;

use super::Section;
use crate::config::number::{LARGEST, Limits, real, whole};
use crate::config::source::element;

impl Section<'_> {
    /// A whole number.
    pub(in crate::config) fn integer(
        &self,
        key: &'static str,
        meaning: &str,
        range: RangeInclusive<u32>,
    ) -> Option<u32> {
        let expected = format!("{meaning}, a whole number from {} to {}", range.start(), range.end());
        self.describe(key, &expected, None);
        let value = whole(self.required(key, &expected)?).filter(|value| range.contains(value));
        if value.is_none() {
            self.fault(key, expected);
        }
        value
    }

    /// A whole number; `default` if it is not set.
    pub(in crate::config) fn integer_or(
        &self,
        key: &'static str,
        meaning: &str,
        range: RangeInclusive<u32>,
        default: u32,
    ) -> Option<u32> {
        let expected = format!("{meaning}, a whole number from {} to {}", range.start(), range.end());
        self.describe(key, &expected, Some(default.to_string()));
        if self.has(key) { self.integer(key, meaning, range) } else { Some(default) }
    }

    /// A finite number within limits.
    pub(in crate::config) fn number(&self, key: &'static str, meaning: &str, limits: Limits) -> Option<f64> {
        let expected = format!("{meaning}, {}", limits.words());
        self.describe(key, &expected, None);
        let value = self.required(key, &expected)?;
        self.limited(&self.path(key), value, meaning, limits)
    }

    /// A finite number within limits; `default` if it is not set.
    pub(in crate::config) fn number_or(
        &self,
        key: &'static str,
        meaning: &str,
        limits: Limits,
        default: f64,
    ) -> Option<f64> {
        self.describe(key, &format!("{meaning}, {}", limits.words()), Some(default.to_string()));
        if self.has(key) { self.number(key, meaning, limits) } else { Some(default) }
    }

    /// A list of exactly `N` numbers, each within limits.
    pub(in crate::config) fn numbers<const N: usize>(
        &self,
        key: &'static str,
        meaning: &str,
        limits: Limits,
    ) -> Option<[f64; N]> {
        let expected = format!("{meaning}, a list of {N} numbers");
        self.describe(key, &expected, None);
        let value = self.required(key, &expected)?;
        self.row(&self.path(key), value, meaning, limits)
    }

    /// The list of exactly `N` numbers at `path`.
    fn row<const N: usize>(
        &self,
        path: &str,
        value: &DeValue<'_>,
        meaning: &str,
        limits: Limits,
    ) -> Option<[f64; N]> {
        let Some(items) = value.as_array().filter(|items| items.len() == N) else {
            self.note(path, format!("{meaning}, a list of {N} numbers"));
            return None;
        };
        let mut values = [None; N];
        for (index, (value, item)) in values.iter_mut().zip(items.iter()).enumerate() {
            *value = self.limited(&element(path, index), item.get_ref(), meaning, limits);
        }
        let good = values.iter().all(Option::is_some);
        good.then(|| values.map(Option::unwrap_or_default))
    }

    /// A list of `count` finite numbers; of any length if the count is unknown.
    pub(in crate::config) fn number_list(
        &self,
        key: &'static str,
        meaning: &str,
        count: Option<usize>,
    ) -> Option<Vec<f64>> {
        let words = count.map_or_else(|| "numbers".to_owned(), |count| format!("{count} numbers"));
        let expected = format!("{meaning}, a list of {words}");
        self.describe(key, &format!("{meaning}, a list of numbers"), None);
        let items = self.required(key, &expected)?.as_array();
        let Some(items) = items.filter(|items| count.is_none_or(|count| items.len() == count)) else {
            self.fault(key, expected);
            return None;
        };
        let path = self.path(key);
        let values = items.iter().enumerate().map(|(place, item)| {
            self.limited(&element(&path, place), item.get_ref(), meaning, Limits::ANGLE)
        });
        let values: Vec<Option<f64>> = values.collect();
        values.into_iter().collect()
    }

    /// Three numbers along x, y, z.
    pub(in crate::config) fn vector(&self, key: &'static str, meaning: &str) -> Option<DVec3> {
        self.numbers(key, &format!("{meaning} along x, y, z"), Limits::PLACE).map(DVec3::from_array)
    }

    /// Three numbers; `default` if they are not set.
    pub(in crate::config) fn vector_or(
        &self,
        key: &'static str,
        meaning: &str,
        default: DVec3,
    ) -> Option<DVec3> {
        let expected = format!("{meaning} along x, y, z, a list of 3 numbers");
        self.describe(key, &expected, Some(format!("{:?}", default.to_array())));
        if self.has(key) { self.vector(key, meaning) } else { Some(default) }
    }

    /// A list of vectors (three numbers along x, y, z each); its length must lie in `range`.
    pub(in crate::config) fn vectors(
        &self,
        key: &'static str,
        meaning: &str,
        range: RangeInclusive<usize>,
    ) -> Option<Vec<DVec3>> {
        let (least, most) = (range.start(), range.end());
        let expected = format!("{meaning} along x, y, z, a list of {least} to {most} lists of 3 numbers");
        self.describe(key, &expected, None);
        let value = self.required(key, &expected)?;
        let Some(items) = value.as_array().filter(|items| range.contains(&items.len())) else {
            self.fault(key, expected);
            return None;
        };
        let path = self.path(key);
        let row = |(index, item): (usize, &Spanned<DeValue<'_>>)| {
            self.row(&element(&path, index), item.get_ref(), meaning, Limits::PLACE).map(DVec3::from_array)
        };
        // Reads all of them, so that all faults are reported.
        let rows: Vec<Option<DVec3>> = items.iter().enumerate().map(row).collect();
        rows.into_iter().collect()
    }

    fn limited(&self, path: &str, value: &DeValue<'_>, meaning: &str, limits: Limits) -> Option<f64> {
        let number = real(value);
        let good = number.filter(|number| number.abs() <= LARGEST && limits.contains(*number));
        if good.is_none() {
            let finite = match number {
                Some(number) if number.is_nan() || number.abs() > LARGEST => {
                    format!(", finite and at most {LARGEST:e} in size")
                }
                _ => String::new(),
            };
            self.note(path, format!("{meaning}, {}{finite}", limits.words()));
        }
        good
    }
}
