//! What a run was asked to do: enough, with the robot file, to run its controller again.

use serde::{Deserialize, Serialize};

use super::task::Task;
use crate::ik::Method;
use crate::model::Robot;
use crate::plan::RunPlan;

/// The attachment `run.json`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RunHeader {
    /// Version of this layout and of the messages.
    pub version: u32,
    /// Version of the program that recorded.
    pub program: String,
    /// Path of the robot file, as given.
    pub robot_file: String,
    /// Time of day at the run's time zero, nanoseconds since 1970; 0 on a virtual clock.
    pub started_unix_ns: u64,
    /// Who drove, for people: "the keyboard"; none for a run by its own plan.
    #[serde(default)]
    pub driver: Option<String>,
    /// What it was to do while the operator said no more than to go.
    #[serde(flatten)]
    pub task: Task,
    /// How long to do that, s.
    pub walk_for_s: f64,
    /// How targets are solved.
    pub ik: Method,
    /// False where the robot file's body was left out (`--no-physics`), and what is worked out from it with it.
    #[serde(default = "yes")]
    pub has_body: bool,
    /// Each joint's servo as it is mounted; none for a joint without.
    pub servos: Vec<Option<ServoHeader>>,
}

/// Recordings that do not say so are of robots with all their file has.
fn yes() -> bool {
    true
}

/// What is known of a mounted servo beyond the robot file.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ServoHeader {
    /// Count at joint angle zero.
    pub zero_count: f64,
    /// True where a positive joint turn is a falling count.
    pub reversed: bool,
}

/// More sweeps of inverse kinematics than any run has; each takes its time.
const SWEEPS_MAX: u32 = 100;

impl RunHeader {
    /// Version of the recordings this program writes and reads.
    pub const VERSION: u32 = 2;

    /// Whether this program can run a controller by it.
    ///
    /// # Errors
    /// Why not.
    pub(super) fn check(&self) -> Result<(), String> {
        if self.version != RunHeader::VERSION {
            let (found, known) = (self.version, RunHeader::VERSION);
            return Err(format!("its layout is version {found}, this program reads version {known}"));
        }
        match self.ik {
            Method::Ccd { sweeps } if sweeps > SWEEPS_MAX => {
                Err(format!("{sweeps} sweeps of inverse kinematics: expected {SWEEPS_MAX} at most"))
            }
            Method::Ccd { .. } | Method::CcdThenFinish => Ok(()),
        }
    }

    /// For a run of `robot` as `plan` says.
    pub fn new(robot: &Robot, plan: &RunPlan, robot_file: &str, started_unix_ns: u64) -> RunHeader {
        let servo = |joint: &crate::model::Joint| {
            joint.servo.map(|servo| ServoHeader { zero_count: servo.zero_count, reversed: servo.reversed })
        };
        RunHeader {
            version: RunHeader::VERSION,
            program: env!("CARGO_PKG_VERSION").to_owned(),
            robot_file: robot_file.to_owned(),
            started_unix_ns,
            driver: plan.driver.clone(),
            task: Task::of(&plan.motion),
            walk_for_s: plan.move_for_s,
            ik: plan.method,
            has_body: robot.bears_weight,
            servos: robot.joints.iter().map(servo).collect(),
        }
    }

    /// What the run was, for people: "walk at 0.062 m/s", "driven by the keyboard".
    pub fn words(&self) -> String {
        match &self.driver {
            Some(driver) => format!("driven by {driver}"),
            None => self.task.to_string(),
        }
    }

    /// Makes `robot`, fresh from its file, the one that ran.
    pub fn apply_to(&self, robot: &mut Robot) {
        if !self.has_body {
            (robot.physics, robot.bears_weight) = (None, false);
        }
        for (joint, header) in robot.joints.iter_mut().zip(&self.servos) {
            if let (Some(servo), Some(header)) = (&mut joint.servo, header) {
                servo.zero_count = header.zero_count;
                servo.reversed = header.reversed;
            }
        }
    }
}
