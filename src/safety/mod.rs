//! The only way to a servo: turns what the motion wants into a [`Command`] that may be obeyed.
//!
//! Order of the checks: the state of the robot ([`Permission`]: move, hold, or stop), then for each joint
//! finite, range, rate, acceleration, and the torque limit. Only this module can make a [`Command`], and
//! only a command gives servo counts, so a goal that skipped safety does not compile:
//!
//! ```compile_fail,E0451
//! use hippocamp::safety::Command;
//! let forged = Command { joints: vec![] };
//! ```

mod describe;
mod joint;
mod limiter;
mod listening;
mod servo_outage;
mod shared;
mod stall;
mod state_query;
#[cfg(test)]
mod tests;
mod waiting;
mod watch;

use std::ops::Range;

use crate::model::{Robot, SafetySettings, SharedRange, TrippedServoPolicy};
use crate::signals::{JointState, JointTargets, Outage, Permission, Question, State};
use joint::JointSafety;
use listening::Listening;
use waiting::Waiting;
use watch::Watch;
pub use watch::{Fault, Finding};

/// The command to one joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum JointCommand {
    /// No torque.
    Limp,
    /// Move to, or stay at, an angle.
    Goal {
        /// Angle, rad; inside the joint's range, or on the way back into it.
        angle_rad: f64,
        /// Torque limit as a share of stall torque, 0 to 1.
        torque_share: f64,
    },
    /// Keep the last command. The servo is silent: it may have restarted and be limp, and must not find a goal
    /// when it wakes.
    Keep,
}

/// The commands to all joints: the proof that they passed safety.
#[derive(Debug)]
pub struct Command {
    joints: Vec<JointCommand>,
    interventions: u32,
    restart: Option<usize>,
    question: Option<(usize, Question)>,
}

impl Command {
    /// The command to each joint, in the robot's order.
    pub fn joints(&self) -> &[JointCommand] {
        &self.joints
    }

    /// Number of joints whose goal safety changed in this cycle.
    pub fn interventions(&self) -> u32 {
        self.interventions
    }

    /// The joint whose servo should restart in this cycle, if any; it has no torque.
    pub fn restart(&self) -> Option<usize> {
        self.restart
    }

    /// The question to ask in this cycle, if any, and a joint on the bus to ask.
    pub fn question(&self) -> Option<(usize, Question)> {
        self.question
    }
}

/// Keeps every joint within its limits and watches the robot.
#[derive(Debug)]
pub struct Safety {
    settings: SafetySettings,
    joints: Vec<JointSafety>,
    /// Groups of joints that share a range, and the range of each.
    shared: Vec<(Range<usize>, SharedRange)>,
    listening: Listening,
    watch: Watch,
    waiting: Waiting,
    command: Command,
    /// Number of servos restarted so far.
    restarts: u64,
}

impl Safety {
    /// Safety for `robot`; all joints start limp.
    pub fn new(robot: &Robot) -> Safety {
        let of_joint = |joint| JointSafety::new(joint, &robot.safety);
        Safety {
            settings: robot.safety.clone(),
            joints: robot.joints.iter().map(of_joint).collect(),
            listening: Listening::new(robot),
            waiting: Waiting::default(),
            shared: SharedRange::of_robot(robot),
            watch: Watch::new(robot),
            command: Command {
                joints: vec![JointCommand::Limp; robot.joints.len()],
                interventions: 0,
                restart: None,
                question: None,
            },
            restarts: 0,
        }
    }

    /// Number of restarts of tripped servos.
    pub fn restarts(&self) -> u64 {
        self.restarts
    }

    /// The cause of the last hold or stop, if there was one.
    pub fn cause(&self) -> Option<Finding> {
        self.watch.cause()
    }

    /// Judges the robot and lets through what it may do in this cycle.
    ///
    /// `dt_s` is the length of a cycle, `gap_s` the real time since the cycle before. The permission
    /// and the goals let through are written into `state` for the generator's next step.
    pub fn check(&mut self, dt_s: f64, gap_s: f64, targets: &JointTargets, state: &mut State) -> &Command {
        self.command.interventions = 0;
        self.command.restart = None;
        self.command.question = None;
        state.outage = None;
        if targets.is_limp || !state.is_known() {
            for index in 0..self.joints.len() {
                self.let_go(index, state);
            }
            state.permission = self.watch.judge_limp(&state.joints);
            return &self.command;
        }
        self.look_for_trips(dt_s, targets, state);
        if let Some(finding) = self.no_start(targets, state) {
            self.watch.stop(finding);
        }
        self.listening.note(&state.joints, &state.is_out);
        for (index, joint) in self.joints.iter_mut().enumerate() {
            let is_bus_heard = self.listening.is_bus_heard(index);
            joint.take_over(gap_s - dt_s, &self.settings, &state.joints[index], is_bus_heard);
        }
        let goals = self.joints.iter().map(|joint| joint.limiter.goal_rad());
        let excused = self.joints.iter().map(|joint| (joint.outage.is_out(), joint.outage.is_restarting()));
        state.permission = self.watch.judge(
            dt_s,
            gap_s,
            &state.joints,
            goals.zip(excused),
            targets.not_finite,
            &self.waiting,
        );

        for (index, joint) in
            self.joints.iter_mut().enumerate().filter(|(index, _)| self.watch.is_jammed(*index))
        {
            joint.outage.jam();
            state.is_out[index] = true;
        }
        self.tell_outage(state);
        self.ask(state);

        for index in 0..self.joints.len() {
            let is_left_alone = targets.only.is_some_and(|only| only != index) || state.is_out[index];
            if is_left_alone || !self.joints[index].can_start_from(&state.joints[index]) {
                self.let_go(index, state);
                continue;
            }
            let joint = &mut self.joints[index];
            if joint.is_lost && joint.torque_on_s.is_none() {
                // The joint was limp when last heard, and stays limp.
                self.let_go(index, state);
                continue;
            }
            let wanted_rad = targets.angles_rad[index] + targets.offset_rad[index];
            let (angle_rad, differs) = if state.permission == Permission::Hold {
                joint.limiter.hold(wanted_rad, joint.held_rad, dt_s)
            } else {
                joint.limiter.next(wanted_rad, joint.held_rad, dt_s)
            };
            self.command.interventions += u32::from(differs);
            state.goal_rad[index] = angle_rad;
            let on_s = joint.hold_torque(dt_s);
            let rise = (on_s / self.settings.torque_ramp_s).min(1.0);
            let torque_share = self.settings.torque_share * rise.min(targets.torque_shares[index]);
            self.command.joints[index] = match joint.is_lost {
                true => JointCommand::Keep,
                false => JointCommand::Goal { angle_rad, torque_share },
            };
        }
        self.keep_shared_ranges(dt_s, state);
        let waited_for =
            self.joints.iter().zip(&state.joints).position(|(joint, measured)| joint.is_waited_for(measured));
        let way_s = || self.joints.iter().map(|joint| joint.limiter.longest_way_s()).fold(0.0, f64::max);
        self.waiting.note(dt_s, waited_for, state.permission, way_s);
        if state.permission == Permission::Move && waited_for.is_some() {
            // The robot stays still while a leg is on its way back, or while its torque is unknown.
            state.permission = Permission::Hold;
        }
        &self.command
    }

    /// Ends the waiting: a held robot stops for good. Used when the operator will not wait.
    pub fn give_up_waiting(&mut self, state: &mut State) {
        if let (Permission::Hold, Some(cause)) = (state.permission, self.watch.cause()) {
            self.watch.stop(cause);
            state.permission = self.watch.permission();
        }
    }

    /// Takes tripped servos out of service, and restarts one of them if allowed.
    fn look_for_trips(&mut self, dt_s: f64, targets: &JointTargets, state: &mut State) {
        if self.settings.tripped_servo == TrippedServoPolicy::Stop {
            return;
        }
        for (joint, measured) in self.joints.iter_mut().zip(&state.joints) {
            joint.outage.look(dt_s, self.settings.fault_delay_s, targets.may_restart, measured);
        }
        let is_ready = |(joint, measured): (&JointSafety, &JointState)| joint.outage.can_restart(measured);
        if targets.may_restart
            && let Some(index) = self.joints.iter().zip(&state.joints).position(is_ready)
        {
            self.joints[index].outage.restart(&state.joints[index]);
            self.command.restart = Some(index);
            self.restarts += 1;
        }
        for (is_out, joint) in state.is_out.iter_mut().zip(&self.joints) {
            *is_out = joint.outage.is_out();
        }
    }

    /// Writes into `state` which joint has just gone out of service, and why.
    fn tell_outage(&mut self, state: &mut State) {
        let mut news = self.joints.iter_mut().zip(&state.joints).enumerate();
        state.outage = news.find_map(|(joint, (of, measured))| {
            let cause = of.outage.take_cause(measured)?;
            Some(Outage { joint, cause })
        });
    }

    /// Chooses a question for one servo whose replies do not tell enough. All servos on its bus send no feedback in
    /// that cycle; the next question waits until all have sent feedback again.
    fn ask(&mut self, state: &State) {
        let is_heard = |measured: &JointState| measured.age_s <= 0.0;
        let joints = || self.joints.iter().zip(&state.joints);
        let lost = joints()
            .position(|(joint, measured)| joint.is_lost && joint.torque_on_s.is_some() && is_heard(measured));
        let tripped = || joints().position(|(joint, measured)| joint.outage.needs_question(measured));
        if self.command.restart.is_some() {
            return;
        }
        if let Some(index) = lost {
            self.command.question = Some((index, self.joints[index].state_query.question()));
            self.joints[index].state_query.note_asked();
        } else if let Some(index) = tripped() {
            self.joints[index].outage.ask();
            self.command.question = Some((index, Question::Alarms));
        } else {
            self.command.question = self.listening.question();
        }
    }

    fn let_go(&mut self, index: usize, state: &mut State) {
        let joint = &mut self.joints[index];
        joint.let_go(&state.joints[index]);
        state.goal_rad[index] = joint.limiter.goal_rad();
        self.command.joints[index] = JointCommand::Limp;
    }

    /// The first joint that should now have torque but stands where no goal can start.
    fn no_start(&self, targets: &JointTargets, state: &State) -> Option<Finding> {
        let joint = (0..self.joints.len())
            .filter(|index| targets.only.is_none_or(|only| only == *index))
            .filter(|index| !state.is_out[*index])
            .find(|index| !self.joints[*index].can_start_from(&state.joints[*index]))?;
        let position_rad = state.joints[joint].position_rad;
        let has_counts = self.joints[joint].limiter.has_counts_at(position_rad);
        let fault = match has_counts {
            true => Fault::BeyondStops { position_rad },
            false => Fault::OutOfCounts { position_rad },
        };
        Some(Finding { joint: Some(joint), fault })
    }
}
