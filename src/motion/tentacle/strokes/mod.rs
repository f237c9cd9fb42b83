//! The strokes of arms, a file each, in one table. Scripts, options, keys, shows, recordings and `docs/tentacle.md`
//! take them from here.
//!
//! To add a stroke, write its file with its `KIND`, and name it here: its `mod`, and its line at the end of
//! [`STROKES`].

pub mod let_go;
pub mod park;
pub mod path;
pub mod reach;
pub mod rest;
pub mod sway;
pub mod swim;
pub mod walk;
pub mod wind;

use super::perform::{Perform, Rig};
use crate::model::TentacleMotion;
use crate::motion::{Place, Stroke};

/// Every stroke. Their order is that of tables and of shows; random orders depend on it, too.
pub const STROKES: &[StrokeKind] = &[
    park::KIND,
    rest::KIND,
    sway::KIND,
    walk::KIND,
    swim::KIND,
    let_go::KIND,
    reach::KIND,
    path::KIND,
    wind::KIND,
];

/// One stroke of the table.
#[derive(Debug, Clone, Copy)]
pub struct StrokeKind {
    /// Its name in files and options.
    pub name: &'static str,
    /// Words for what the arms do in it.
    pub meaning: &'static str,
    /// The key that asks for it, beside those of [`crate::kinds::tentacle::StrokeKeys`] itself.
    pub key: Option<char>,
    /// The place that it needs.
    pub needs: Needs,
    /// True if it repeats by phase at a tempo, which the joints limit.
    pub is_rhythmic: bool,
    /// How long a show has it; `None` if a show leaves it out.
    pub shown: Option<Shown>,
    /// Makes the part that runs in the loop.
    pub(super) make: fn(&Rig<'_>) -> Box<dyn Perform>,
}

/// The place that a stroke needs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Needs {
    /// None.
    Nothing,
    /// A point.
    Point,
    /// A path.
    Path,
    /// A pole.
    Pole,
}

/// Time of a stroke in a show.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shown {
    /// Multiples of the robot file's `stroke_time_s`.
    pub strokes: f64,
    /// Time beyond that, s.
    pub hold_s: f64,
}

impl StrokeKind {
    /// This stroke, to its place in the robot file; `None` if the file does not name the place.
    pub fn in_file(&self, tentacle: &TentacleMotion) -> Option<Stroke> {
        let place = match self.needs {
            Needs::Nothing => Place::Nowhere,
            Needs::Point => Place::Point { in_body: tentacle.reach_in_body?, direction: None },
            Needs::Path => Place::Path(*tentacle.path.as_deref()?),
            Needs::Pole => Place::Pole(tentacle.pole?),
        };
        Some(Stroke { name: self.name, place })
    }
}

/// The stroke of this name; `None` if there is none.
pub fn find(name: &str) -> Option<&'static StrokeKind> {
    STROKES.iter().find(|kind| kind.name == name)
}

/// The stroke of this name, to its place in the robot file; `None` if there is no such stroke or place.
pub fn named(name: &str, tentacle: &TentacleMotion) -> Option<Stroke> {
    find(name)?.in_file(tentacle)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_and_keys_are_unique_and_arms_can_rest_park_and_let_go() {
        for (index, kind) in STROKES.iter().enumerate() {
            for other in &STROKES[..index] {
                assert_ne!(kind.name, other.name);
                assert!(kind.key.is_none() || kind.key != other.key, "{} and {}", kind.name, other.name);
            }
        }
        for stroke in [Stroke::REST, Stroke::PARK, Stroke::LET_GO] {
            assert!(find(stroke.name).is_some_and(|kind| kind.needs == Needs::Nothing), "{stroke:?}");
        }
    }
}
