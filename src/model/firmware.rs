//! The firmware version of a servo.

use std::fmt;
use std::str::FromStr;

use serde::{Serialize, Serializer};

/// A firmware version as the makers write it: Dynamixel `46`, Feetech `3.10`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Firmware {
    /// The number before the point.
    pub major: u8,
    /// The number after the point; `None` if there is only one.
    pub minor: Option<u8>,
}

impl fmt::Display for Firmware {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.major)?;
        self.minor.iter().try_for_each(|minor| write!(f, ".{minor}"))
    }
}

impl FromStr for Firmware {
    type Err = std::num::ParseIntError;

    fn from_str(text: &str) -> Result<Firmware, Self::Err> {
        let (major, minor) = match text.split_once('.') {
            Some((major, minor)) => (major, Some(minor.parse()?)),
            None => (text, None),
        };
        Ok(Firmware { major: major.parse()?, minor })
    }
}

impl Serialize for Firmware {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn versions_parse_as_they_are_printed() {
        for text in ["46", "3.10", "0.0", "255.255"] {
            assert_eq!(text.parse::<Firmware>().unwrap().to_string(), text);
        }
        for text in ["", "46b", "3.", ".1", "3.1.2", "256", "-1"] {
            assert!(text.parse::<Firmware>().is_err(), "{text}");
        }
    }
}
