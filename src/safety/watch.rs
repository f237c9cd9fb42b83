//! The faults of the robot, how long they have lasted, and what they permit.
//!
//! ```text
//!          fault outlasts its delay            hold outlasts hold_s
//!   Move ----------------------------> Hold ------------------------> Stop (stays)
//!    ^                                  |
//!    +----------------------------------+
//!               fault has passed
//! ```

use super::stall::{self, Stall};
use super::waiting::Waiting;
use crate::model::{Robot, SafetySettings, Servo, TrippedServoPolicy};
use crate::signals::{JointState, Permission};

/// A fault of a joint or of the loop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Fault {
    /// A servo was not heard for this long, s.
    Unheard {
        /// Time since its last valid reply, s.
        age_s: f64,
        /// True if no servo of its bus is heard: then the bus is at fault, not the servo.
        is_whole_bus: bool,
        /// True if it answered, but only with damaged replies.
        is_damaged: bool,
    },
    /// A joint is further from its goal than allowed, rad.
    OffGoal {
        /// Goal minus measured angle, rad.
        error_rad: f64,
        /// Load that its servo reports, as a share of stall torque.
        load_share: f64,
    },
    /// A joint does not turn although its goal does.
    Stalled {
        /// How far the goal has turned since the joint last turned, rad.
        goal_turn_rad: f64,
        /// Load that its servo reports, as a share of stall torque.
        load_share: f64,
    },
    /// A servo is too hot, degrees Celsius.
    Hot {
        /// Its temperature.
        temperature_c: f64,
    },
    /// The supply is too low, V.
    LowVoltage {
        /// Voltage that the servo reports.
        voltage_v: f64,
    },
    /// The supply is higher than the servo tolerates, V.
    HighVoltage {
        /// Voltage that the servo reports.
        voltage_v: f64,
    },
    /// The joint is at an angle for which its servo has no counts, so no goal can start there, rad.
    OutOfCounts {
        /// Measured angle.
        position_rad: f64,
    },
    /// The joint lost its torque and reads beyond its mechanical stops, where it cannot be, rad.
    BeyondStops {
        /// Measured angle.
        position_rad: f64,
    },
    /// The goal of a returning joint has not reached the wanted angle.
    NotBack {
        /// Time since it began to return, s.
        waited_s: f64,
    },
    /// The servo raises alarm bits.
    Alarm {
        /// The bits, as the protocol defines them.
        bits: u8,
    },
    /// The motion asked for an angle that is not finite.
    NotFinite,
    /// The loop itself stood still for this long, s.
    LoopStalled {
        /// Time between two cycles, s.
        gap_s: f64,
    },
}

/// A fault and its joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Finding {
    /// Index of the joint; `None` for the loop itself.
    pub joint: Option<usize>,
    /// Its fault.
    pub fault: Fault,
}

/// Watches every joint over time.
#[derive(Debug, Clone)]
pub(super) struct Watch {
    settings: SafetySettings,
    /// Time that each joint's present fault other than silence has lasted, s.
    wrong_s: Vec<f64>,
    stalls: Vec<Stall>,
    /// Joints that did not follow their goals at the last judgement, where that does not cause a hold.
    jammed: Vec<bool>,
    permission: Permission,
    held_s: f64,
    cause: Option<Finding>,
    /// Each joint's servo; `None` on a robot that exists only on paper.
    servos: Vec<Option<Servo>>,
    /// Lowest supply voltage of each joint's servo, V.
    voltage_min_v: Vec<f64>,
    /// Error that friction and load explain on each joint, rad.
    explained_rad: Vec<f64>,
}

/// Rate at which fault-free time makes up for held time: the time of a recurring fault adds up.
const FORGIVING_SHARE: f64 = 0.2;

impl Watch {
    pub(super) fn new(robot: &Robot) -> Watch {
        let joints = robot.joints.len();
        Watch {
            settings: robot.safety.clone(),
            servos: robot.joints.iter().map(|joint| joint.servo).collect(),
            voltage_min_v: robot.joints.iter().map(|joint| robot.voltage_min_v(joint)).collect(),
            explained_rad: robot
                .joints
                .iter()
                .map(|joint| joint.servo.map_or(0.0, |servo| stall::explained_rad(servo.model)))
                .collect(),
            wrong_s: vec![0.0; joints],
            stalls: vec![Stall::default(); joints],
            jammed: vec![false; joints],
            permission: Permission::Move,
            held_s: 0.0,
            cause: None,
        }
    }

    pub(super) fn permission(&self) -> Permission {
        self.permission
    }

    /// The cause of the last hold or stop.
    pub(super) fn cause(&self) -> Option<Finding> {
        self.cause
    }

    /// True if the joint did not follow its goal at the last judgement and should lose its torque for that.
    pub(super) fn is_jammed(&self, joint: usize) -> bool {
        self.jammed.get(joint).is_some_and(|jammed| *jammed)
    }

    /// Judges all joints `dt_s` after the last judgement. `goals` holds for each joint the last goal, rad, and
    /// whether the joint is out of service, and whether its servo restarts; `gap_s` is the real time between this
    /// cycle and the one before; `not_finite` is a joint whose wanted angle was not finite; `waiting` is what the
    /// robot waited for in the cycle before.
    pub(super) fn judge(
        &mut self,
        dt_s: f64,
        gap_s: f64,
        joints: &[JointState],
        goals: impl Iterator<Item = (f64, (bool, bool))>,
        not_finite: Option<usize>,
        waiting: &Waiting,
    ) -> Permission {
        let mut found = not_finite.map(|joint| Finding { joint: Some(joint), fault: Fault::NotFinite });
        if gap_s - dt_s > self.settings.hold_s {
            self.stop(Finding { joint: None, fault: Fault::LoopStalled { gap_s } });
        }
        self.jammed.fill(false);
        for (index, (joint, (goal, (is_out, is_restarting)))) in joints.iter().zip(goals).enumerate() {
            if is_out {
                self.stalls[index] = Stall::default();
            }
            if is_restarting {
                continue;
            }
            if joint.age_s > self.settings.coast_s {
                found = found.or_else(|| Some(self.unheard(index, joints)));
                continue;
            }
            // A joint out of service follows no goal.
            let goal = if is_out { joint.position_rad } else { goal };
            match self.fault_of(index, joint, goal) {
                None => self.wrong_s[index] = 0.0,
                Some(fault) => {
                    self.wrong_s[index] += dt_s;
                    if self.wrong_s[index] > self.settings.fault_delay_s {
                        let finding = self.finding(index, fault);
                        found = found.or(finding);
                    }
                }
            }
            if is_out {
                continue;
            }
            // This check comes last, since a servo that is hot or in alarm may well have switched its torque off.
            let explained_rad = self.explained_rad[index];
            if let Some(fault) = self.stalls[index].judge(dt_s, joint, goal, explained_rad, &self.settings) {
                let finding = self.finding(index, fault);
                found = found.or(finding);
            }
        }
        self.permission = match (self.permission, found.or_else(|| waiting.overdue())) {
            (Permission::Stop, _) => Permission::Stop,
            (_, None) => {
                // A waiting robot stands still like a held one: only motion makes up for held time.
                if !waiting.is_on() {
                    self.held_s = (self.held_s - FORGIVING_SHARE * dt_s).max(0.0);
                }
                Permission::Move
            }
            (_, Some(finding)) => {
                self.held_s += dt_s;
                self.cause = Some(finding);
                if self.held_s > self.settings.hold_s { Permission::Stop } else { Permission::Hold }
            }
        };
        self.permission
    }

    /// Judges a robot without torque: it cannot fall, but it can never start if a servo stays silent.
    pub(super) fn judge_limp(&mut self, joints: &[JointState]) -> Permission {
        let patience_s = self.settings.coast_s + self.settings.hold_s;
        if let Some(index) = joints.iter().position(|joint| joint.age_s > patience_s) {
            self.stop(self.unheard(index, joints));
        }
        self.permission
    }

    /// Permits nothing but the stop action from now on, because of `cause` (or an earlier cause).
    pub(super) fn stop(&mut self, cause: Finding) {
        if self.permission != Permission::Stop {
            self.permission = Permission::Stop;
            self.cause = Some(cause);
        }
    }

    /// A lasting fault of a joint causes a hold, unless the robot continues without joints that do not follow: a
    /// blocked servo trips sooner or later.
    fn finding(&mut self, index: usize, fault: Fault) -> Option<Finding> {
        let is_jam = matches!(fault, Fault::OffGoal { .. } | Fault::Stalled { .. });
        if is_jam && self.settings.tripped_servo == TrippedServoPolicy::Freeze {
            self.jammed[index] = true;
            self.wrong_s[index] = 0.0;
            return None;
        }
        Some(Finding { joint: Some(index), fault })
    }

    /// The finding that no reply came from a joint.
    fn unheard(&self, index: usize, joints: &[JointState]) -> Finding {
        let bus_of = |servo: &Option<Servo>| servo.map(|servo| servo.bus);
        let bus = bus_of(&self.servos[index]);
        let mut on_bus = self.servos.iter().zip(joints).filter(|(servo, _)| bus_of(servo) == bus);
        let is_whole_bus = on_bus.all(|(_, joint)| joint.age_s > self.settings.coast_s);
        let JointState { age_s, is_damaged, .. } = joints[index];
        Finding { joint: Some(index), fault: Fault::Unheard { age_s, is_whole_bus, is_damaged } }
    }

    fn fault_of(&self, index: usize, joint: &JointState, goal_rad: f64) -> Option<Fault> {
        let error_rad = goal_rad - joint.position_rad;
        // Heat and voltage come first: they name the fault in plain words, which the alarm bits with them do not.
        if joint.temperature_c > self.settings.temperature_c {
            Some(Fault::Hot { temperature_c: joint.temperature_c })
        } else if joint.voltage_v < self.voltage_min_v[index] {
            Some(Fault::LowVoltage { voltage_v: joint.voltage_v })
        } else if self.servos[index].is_some_and(|servo| servo.model.is_too_much(joint.voltage_v)) {
            Some(Fault::HighVoltage { voltage_v: joint.voltage_v })
        } else if joint.alarms != 0 && self.settings.tripped_servo == TrippedServoPolicy::Stop {
            Some(Fault::Alarm { bits: joint.alarms })
        } else if error_rad.abs() > self.settings.tracking_error_rad {
            Some(Fault::OffGoal { error_rad, load_share: joint.load_share })
        } else {
            None
        }
    }
}
