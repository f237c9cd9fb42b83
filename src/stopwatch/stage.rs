//! The stages of a cycle, in order, and a value for each.

use serde::ser::SerializeMap;
use serde::{Serialize, Serializer};

/// A stage of the loop's cycle. The variants are in the order in which the stages run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stage {
    /// From the deadline until the loop runs.
    Wake,
    /// Orders of the driver and the signals, the sign of life to the guard, the status line.
    Orders,
    /// Detects and handles falls.
    Reflex,
    /// Gaits, strokes and poses, with their plans.
    Generator,
    /// Feedback from the trunk.
    Balance,
    /// Inverse kinematics.
    Kinematics,
    /// Corrects the sag of loaded joints.
    Sag,
    /// Lets overloaded arms yield.
    Yielding,
    /// Checks limits and watches for faults.
    Safety,
    /// Converts radians to counts.
    Counts,
    /// Exchanges all buses.
    Exchange,
    /// Reads the inertial measurement unit.
    Imu,
    /// Estimates the state from replies.
    Estimate,
    /// Runs the observers that have no stage of their own.
    Telemetry,
    /// Hands the cycle to the recording.
    Recording,
}

const COUNT: usize = 15;

impl Stage {
    /// All stages, in order.
    pub const ALL: [Stage; COUNT] = [
        Stage::Wake,
        Stage::Orders,
        Stage::Reflex,
        Stage::Generator,
        Stage::Balance,
        Stage::Kinematics,
        Stage::Sag,
        Stage::Yielding,
        Stage::Safety,
        Stage::Counts,
        Stage::Exchange,
        Stage::Imu,
        Stage::Estimate,
        Stage::Telemetry,
        Stage::Recording,
    ];

    /// The word used in reports.
    pub fn name(self) -> &'static str {
        match self {
            Stage::Wake => "wake",
            Stage::Orders => "orders",
            Stage::Reflex => "reflex",
            Stage::Generator => "generator",
            Stage::Balance => "balance",
            Stage::Kinematics => "kinematics",
            Stage::Sag => "sag",
            Stage::Yielding => "yielding",
            Stage::Safety => "safety",
            Stage::Counts => "counts",
            Stage::Exchange => "exchange",
            Stage::Imu => "imu",
            Stage::Estimate => "estimate",
            Stage::Telemetry => "telemetry",
            Stage::Recording => "recording",
        }
    }

    /// True if its time counts as computing time of the cycle: neither waits nor what the driver and the recording
    /// take.
    pub(super) fn is_work(self) -> bool {
        !matches!(self, Stage::Wake | Stage::Orders | Stage::Exchange | Stage::Recording)
    }
}

/// A value for each stage; in a report an object with a key for each stage.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Stages<T>(pub(super) [T; COUNT]);

impl<T> Stages<T> {
    /// The value of `stage`.
    pub fn of(&self, stage: Stage) -> &T {
        &self.0[stage as usize]
    }

    /// Each stage and its value, in order.
    pub fn iter(&self) -> impl Iterator<Item = (Stage, &T)> {
        Stage::ALL.into_iter().zip(&self.0)
    }
}

impl<T: Serialize> Serialize for Stages<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(Some(COUNT))?;
        for (stage, value) in self.iter() {
            map.serialize_entry(stage.name(), value)?;
        }
        map.end()
    }
}
