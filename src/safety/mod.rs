//! The only way to a servo: what the motion wants comes in, a [`Command`] that may be obeyed goes out.
//!
//! Order of the checks: the state of the robot ([`Permission`]: move, hold, or stop), then per joint
//! finite, range, rate, acceleration, and the torque limit. A [`Command`] can be made nowhere else, and
//! servo counts only from a command, so a goal that skipped safety does not compile:
//!
//! ```compile_fail,E0451
//! use hippocamp::safety::Command;
//! let forged = Command { joints: vec![] };
//! ```

mod describe;
mod limiter;
mod stall;
#[cfg(test)]
mod tests;
mod watch;

use crate::model::{Robot, SafetySettings};
use crate::signals::{JointTargets, Permission, State};
use limiter::Limiter;
use watch::Watch;
pub use watch::{Fault, Finding};

/// What one joint is told.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum JointCommand {
    /// No torque.
    Limp,
    /// Go to, or stay at, an angle.
    Goal {
        /// Angle, rad; inside the joint's range, or on the way in.
        angle_rad: f64,
        /// Torque limit as a share of stall torque, 0 to 1.
        torque_share: f64,
    },
}

/// What all joints are told: the proof that safety looked.
#[derive(Debug, Clone)]
pub struct Command {
    joints: Vec<JointCommand>,
    interventions: u32,
}

impl Command {
    /// What each joint is told, in the robot's order.
    pub fn joints(&self) -> &[JointCommand] {
        &self.joints
    }

    /// How many joints were told something else than the motion asked for, this cycle.
    pub fn interventions(&self) -> u32 {
        self.interventions
    }
}

/// Holds every joint inside its limits and watches over the robot.
#[derive(Debug, Clone)]
pub struct Safety {
    settings: SafetySettings,
    limiters: Vec<Limiter>,
    watch: Watch,
    command: Command,
    /// Time since torque came on, s; none while limp.
    torque_on_s: Option<f64>,
}

impl Safety {
    /// Safety for `robot`; everything limp.
    pub fn new(robot: &Robot) -> Safety {
        let count = robot.joints.len();
        Safety {
            settings: robot.safety.clone(),
            limiters: robot.joints.iter().map(|joint| Limiter::new(joint, &robot.safety)).collect(),
            watch: Watch::new(robot),
            command: Command { joints: vec![JointCommand::Limp; count], interventions: 0 },
            torque_on_s: None,
        }
    }

    /// What led to the last hold or stop, if there was one.
    pub fn cause(&self) -> Option<Finding> {
        self.watch.cause()
    }

    /// Judges the robot and lets through what it may do in this cycle.
    ///
    /// `dt_s` is the length of a cycle, `gap_s` the real time since the cycle before. What safety permits,
    /// and the goals it let through, are written into `state` for the generator's next step.
    pub fn check(&mut self, dt_s: f64, gap_s: f64, targets: &JointTargets, state: &mut State) -> &Command {
        self.command.interventions = 0;
        if targets.is_limp || !state.is_known() {
            self.torque_on_s = None;
            self.command.joints.fill(JointCommand::Limp);
            state.permission = self.watch.judge_limp(&state.joints);
            return &self.command;
        }
        if self.torque_on_s.is_none() {
            for (limiter, joint) in self.limiters.iter_mut().zip(&state.joints) {
                limiter.start_from(joint.position_rad);
            }
        } else if gap_s > self.settings.coast_s {
            // The servos have long arrived and stand: start again from rest, not at full speed.
            for limiter in &mut self.limiters {
                let goal = limiter.goal_rad();
                limiter.start_from(goal);
            }
        }
        let on_s = self.torque_on_s.map_or(0.0, |on_s| on_s + dt_s);
        self.torque_on_s = Some(on_s);

        let not_finite = targets.angles_rad.iter().position(|angle| !angle.is_finite());
        let goals = self.limiters.iter().map(Limiter::goal_rad);
        state.permission = self.watch.judge(dt_s, gap_s, &state.joints, goals, not_finite);

        let torque_share = self.settings.torque_share * (on_s / self.settings.torque_ramp_s).min(1.0);
        for (index, limiter) in self.limiters.iter_mut().enumerate() {
            if targets.only.is_some_and(|only| only != index) {
                // Without torque a joint is where it is, and would start from there.
                limiter.start_from(state.joints[index].position_rad);
                state.goal_rad[index] = limiter.goal_rad();
                self.command.joints[index] = JointCommand::Limp;
                continue;
            }
            let wanted_rad = targets.angles_rad[index];
            let (angle_rad, differs) = if self.watch.permission() == Permission::Hold {
                limiter.hold(wanted_rad, dt_s)
            } else {
                limiter.next(wanted_rad, dt_s)
            };
            self.command.interventions += u32::from(differs);
            state.goal_rad[index] = angle_rad;
            self.command.joints[index] = JointCommand::Goal { angle_rad, torque_share };
        }
        &self.command
    }
}
