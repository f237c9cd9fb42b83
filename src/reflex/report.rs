//! Falls of a run, for its report.

use std::fmt;

use serde::Serialize;

use crate::model::{FallDirection, Lying};

/// Outcome of the last fall.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum FallOutcome {
    /// There was no fall.
    #[default]
    None,
    /// A fall is under way.
    Falling,
    /// With the reflex off: the fall was certain, yet the robot kept its feet.
    KeptItsFeet,
    /// The robot got up by itself.
    GotUp,
    /// The robot lies where it fell, without torque.
    LiesLimp,
}

/// Falls of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct ReflexReport {
    /// Number of times a fall was certain.
    pub falls: u32,
    /// Number of times the robot got up by itself.
    pub got_up: u32,
    /// Direction of the last fall; `None` if there was none.
    #[serde(serialize_with = "direction_name")]
    pub direction: Option<FallDirection>,
    /// The side that was down when it lay; `None` before that, and if it is unknown.
    #[serde(serialize_with = "lying_name")]
    pub lying: Option<Lying>,
    /// Outcome of the last fall.
    pub outcome: FallOutcome,
}

fn direction_name<S: serde::Serializer>(of: &Option<FallDirection>, to: S) -> Result<S::Ok, S::Error> {
    of.map(FallDirection::name).serialize(to)
}

fn lying_name<S: serde::Serializer>(of: &Option<Lying>, to: S) -> Result<S::Ok, S::Error> {
    of.map(Lying::name).serialize(to)
}

impl fmt::Display for ReflexReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let direction = match self.direction {
            None => return f.write_str("no fall"),
            Some(FallDirection::Twisting) => "twisting",
            Some(FallDirection::Forward) => "forward",
            Some(FallDirection::Backward) => "backwards",
            Some(FallDirection::Left) => "to the left",
            Some(FallDirection::Right) => "to the right",
        };
        write!(f, "fell {direction}")?;
        match (self.outcome, self.lying) {
            (FallOutcome::LiesLimp, Some(lying)) => write!(f, " and stays limp, {}", lying.words())?,
            (FallOutcome::LiesLimp, None) => f.write_str(" and stays limp")?,
            (FallOutcome::GotUp, _) => f.write_str(" and got up")?,
            (FallOutcome::KeptItsFeet, _) => f.write_str(", or so it seemed: it kept its feet")?,
            (FallOutcome::Falling | FallOutcome::None, _) => {}
        }
        if self.falls > 1 { write!(f, ", the last of {} falls", self.falls) } else { Ok(()) }
    }
}
