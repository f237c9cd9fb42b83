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
mod shared;
mod stall;
#[cfg(test)]
mod tests;
mod trip;
mod watch;

use std::ops::Range;

use crate::model::{OnTrip, Robot, SafetySettings, SharedRange};
use crate::signals::{JointState, JointTargets, Permission, State};
use limiter::Limiter;
use trip::Trip;
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
#[derive(Debug)]
pub struct Command {
    joints: Vec<JointCommand>,
    interventions: u32,
    restart: Option<usize>,
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

    /// The joint whose servo is to restart in this cycle, if one is; it has no torque.
    pub fn restart(&self) -> Option<usize> {
        self.restart
    }
}

/// Holds every joint inside its limits and watches over the robot.
#[derive(Debug)]
pub struct Safety {
    settings: SafetySettings,
    joints: Vec<JointSafety>,
    /// Joints that share a range, and which.
    shared: Vec<(Range<usize>, SharedRange)>,
    watch: Watch,
    command: Command,
    /// Servos restarted so far.
    restarts: u64,
}

/// What safety remembers of a joint.
#[derive(Debug)]
struct JointSafety {
    limiter: Limiter,
    /// Time since its torque came on, s; none while limp.
    torque_on_s: Option<f64>,
    /// The last goal its servo is known to have heard, rad.
    heard_goal_rad: f64,
    /// True while its servo has been silent for too long to be where it was told to be.
    is_lost: bool,
    /// What became of its servo, where a joint may be left without.
    trip: Trip,
}

impl Safety {
    /// Safety for `robot`; everything limp.
    pub fn new(robot: &Robot) -> Safety {
        let of_joint = |joint| JointSafety {
            limiter: Limiter::new(joint, &robot.safety),
            torque_on_s: None,
            heard_goal_rad: 0.0,
            is_lost: false,
            trip: Trip::NONE,
        };
        Safety {
            settings: robot.safety.clone(),
            joints: robot.joints.iter().map(of_joint).collect(),
            shared: SharedRange::of_robot(robot),
            watch: Watch::new(robot),
            command: Command {
                joints: vec![JointCommand::Limp; robot.joints.len()],
                interventions: 0,
                restart: None,
            },
            restarts: 0,
        }
    }

    /// How many servos that had tripped were restarted.
    pub fn restarts(&self) -> u64 {
        self.restarts
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
        self.command.restart = None;
        if targets.is_limp || !state.is_known() {
            for index in 0..self.joints.len() {
                self.let_go(index, state);
            }
            state.permission = self.watch.judge_limp(&state.joints);
            return &self.command;
        }
        self.look_for_trips(dt_s, targets, state);
        if let Some(finding) = self.out_of_counts(targets, state) {
            self.watch.stop(finding);
        }
        for (index, joint) in self.joints.iter_mut().enumerate() {
            joint.take_over(gap_s - dt_s, &self.settings, &state.joints[index]);
        }
        let goals = self.joints.iter().map(|joint| joint.limiter.goal_rad());
        let excused = self.joints.iter().map(|joint| (joint.trip.is_out(), joint.trip.is_restarting()));
        state.permission =
            self.watch.judge(dt_s, gap_s, &state.joints, goals.zip(excused), targets.not_finite);

        for (index, joint) in
            self.joints.iter_mut().enumerate().filter(|(index, _)| self.watch.is_jammed(*index))
        {
            joint.trip.jam();
            state.is_out[index] = true;
        }

        for index in 0..self.joints.len() {
            let is_left_alone = targets.only.is_some_and(|only| only != index) || state.is_out[index];
            if is_left_alone || self.is_out_of_counts(index, state) {
                self.let_go(index, state);
                continue;
            }
            let joint = &mut self.joints[index];
            let wanted_rad = targets.angles_rad[index] + targets.sag_rad[index];
            let (angle_rad, differs) = if state.permission == Permission::Hold {
                joint.limiter.hold(wanted_rad, dt_s)
            } else {
                joint.limiter.next(wanted_rad, dt_s)
            };
            self.command.interventions += u32::from(differs);
            state.goal_rad[index] = angle_rad;
            let on_s = joint.torque_on_s.map_or(0.0, |on_s| on_s + dt_s);
            joint.torque_on_s = Some(on_s);
            let rise = (on_s / self.settings.torque_ramp_s).min(1.0);
            let torque_share = self.settings.torque_share * rise.min(targets.torque_shares[index]);
            self.command.joints[index] = JointCommand::Goal { angle_rad, torque_share };
        }
        self.keep_shared_ranges(dt_s, state);
        let is_catching_up =
            |joint: &JointSafety| joint.torque_on_s.is_some() && joint.limiter.is_catching_up();
        if state.permission == Permission::Move && self.joints.iter().any(is_catching_up) {
            // Nobody walks on while a leg is still on its way back.
            state.permission = Permission::Hold;
        }
        &self.command
    }

    /// Ends waiting: what is held is stopped for good. For an operator who will not wait.
    pub fn give_up_waiting(&mut self, state: &mut State) {
        if let (Permission::Hold, Some(cause)) = (state.permission, self.watch.cause()) {
            self.watch.stop(cause);
            state.permission = self.watch.permission();
        }
    }

    /// Takes servos that have tripped out of service, and restarts one of them where it may.
    fn look_for_trips(&mut self, dt_s: f64, targets: &JointTargets, state: &mut State) {
        if self.settings.on_trip == OnTrip::Stop {
            return;
        }
        for (joint, measured) in self.joints.iter_mut().zip(&state.joints) {
            joint.trip.look(dt_s, self.settings.fault_delay_s, targets.may_restart, measured);
        }
        if targets.may_restart
            && let Some(index) = self.joints.iter().position(|joint| joint.trip.can_restart())
        {
            self.joints[index].trip = Trip::Restarting { since_s: 0.0 };
            self.command.restart = Some(index);
            self.restarts += 1;
        }
        for (is_out, joint) in state.is_out.iter_mut().zip(&self.joints) {
            *is_out = joint.trip.is_out();
        }
    }

    /// Without torque a joint is where it is, and would start from there.
    fn let_go(&mut self, index: usize, state: &mut State) {
        let joint = &mut self.joints[index];
        joint.torque_on_s = None;
        joint.limiter.start_from(state.joints[index].position_rad);
        state.goal_rad[index] = joint.limiter.goal_rad();
        self.command.joints[index] = JointCommand::Limp;
    }

    /// The first joint that is to have torque now, and is where its servo has no counts.
    fn out_of_counts(&self, targets: &JointTargets, state: &State) -> Option<Finding> {
        let joint = (0..self.joints.len())
            .filter(|index| targets.only.is_none_or(|only| only == *index))
            .filter(|index| !state.is_out[*index])
            .find(|index| self.is_out_of_counts(*index, state))?;
        let position_rad = state.joints[joint].position_rad;
        Some(Finding { joint: Some(joint), fault: Fault::OutOfCounts { position_rad } })
    }

    /// A goal cannot start where a limp joint is if its servo has no counts there.
    fn is_out_of_counts(&self, index: usize, state: &State) -> bool {
        let joint = &self.joints[index];
        joint.torque_on_s.is_none() && !joint.limiter.can_start_from(state.joints[index].position_rad)
    }
}

/// A joint this far off its goal, as a share of the tracking error allowed, did not hold it.
const FALLEN_SHARE: f64 = 0.5;

impl JointSafety {
    /// Whether its servo was silent and has not held its goal meanwhile: it had no power.
    fn has_fallen(&self, settings: &SafetySettings, measured: &JointState) -> bool {
        let error_rad = measured.position_rad - self.heard_goal_rad;
        self.is_lost && error_rad.abs() > FALLEN_SHARE * settings.tracking_error_rad
    }

    /// Starts from where the joint is measured, where the last goal says nothing of that: when its torque comes on,
    /// and when its servo is heard again and was without power meanwhile. After a stall
    /// of the loop by `stall_s` it starts from its goal, at rest: its servo has long arrived there.
    fn take_over(&mut self, stall_s: f64, settings: &SafetySettings, measured: &JointState) {
        if measured.age_s > settings.coast_s {
            self.is_lost = true;
        } else if self.torque_on_s.is_none() || self.has_fallen(settings, measured) {
            self.limiter.start_from(measured.position_rad);
            self.torque_on_s = None;
            self.is_lost = false;
        } else if self.is_lost {
            // It has held the last goal it heard; the goals it did not hear have gone on without it.
            self.limiter.start_from(measured.position_rad);
            self.is_lost = false;
        } else if stall_s > settings.coast_s {
            self.limiter.rest_at_goal();
        }
        if measured.age_s <= 0.0 {
            self.heard_goal_rad = self.limiter.goal_rad();
        }
    }
}
