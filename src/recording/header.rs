//! The task of a run: with the robot file, enough to run its controller again.

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
    /// The driver, for people: "the keyboard"; `None` for a run by its own plan.
    #[serde(default)]
    pub driver: Option<String>,
    /// Task of the run while the operator only orders it to go.
    #[serde(flatten)]
    pub task: Task,
    /// How long the task lasts, s.
    pub walk_for_s: f64,
    /// Method of inverse kinematics.
    pub ik: Method,
    /// False if `--no-physics` left out the robot file's body and everything computed from it.
    #[serde(default = "yes")]
    pub has_body: bool,
    /// Each joint's servo as mounted; `None` for a joint without a servo.
    pub servos: Vec<Option<ServoHeader>>,
}

/// Recordings without this field are of robots with everything that their file has.
fn yes() -> bool {
    true
}

/// Data of a mounted servo beyond the robot file.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ServoHeader {
    /// Count at joint angle zero.
    pub zero_count: f64,
    /// True if a positive joint turn lowers the count.
    pub reversed: bool,
}

/// More sweeps of inverse kinematics than any run has; each sweep takes time.
const SWEEPS_MAX: u32 = 100;

impl RunHeader {
    /// Version of the recordings this program writes and reads.
    pub const VERSION: u32 = 2;

    /// Checks whether this program can run a controller from it.
    ///
    /// # Errors
    /// Why it cannot.
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

    /// The header of a run of `robot` by `plan`.
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

    /// The run in words, for people: "walk at 0.062 m/s", "driven by the keyboard".
    pub fn words(&self) -> String {
        match &self.driver {
            Some(driver) => format!("driven by {driver}"),
            None => self.task.to_string(),
        }
    }

    /// Changes `robot`, fresh from its file, into the robot that ran.
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
