//! Describes a finding for people: which servo, what is wrong, what to do.

use super::{Fault, Finding};
use crate::model::{OVERLOAD_ALARM, Robot};
use crate::signals::{Outage, OutageCause};

/// A servo that reports this share of its stall torque or more pushes against something.
const PUSHING_SHARE: f64 = 0.3;

impl Outage {
    /// Names the joint without torque, the cause, and what becomes of it.
    pub fn describe(&self, robot: &Robot) -> String {
        let Some(joint) = robot.joints.get(self.joint) else { return "no such joint".to_owned() };
        let (servo, names) = joint.servo.map_or_else(Default::default, |servo| {
            let bus = &robot.buses[servo.bus].name;
            (format!(" (servo {} on bus {bus})", servo.id), Some(servo.model.registers))
        });
        let words = |causes| names.map_or_else(String::new, |registers| registers.alarm_words(causes));
        let why = match self.cause {
            OutageCause::Alarm(OVERLOAD_ALARM) => {
                "its servo has tripped: overload; it is restarted when the arms are parked".to_owned()
            }
            OutageCause::Alarm(0) => {
                "its servo raises an alarm and does not report the cause; it is restarted once when \
                 the arms are parked"
                    .to_owned()
            }
            OutageCause::Alarm(causes) => format!(
                "its servo raises an alarm: {}; it stays without torque until the alarm ends; check its load, heat \
                 and voltage",
                words(causes)
            ),
            OutageCause::Jam => {
                "it does not follow its goal; it tries again when the arms are parked; check that \
                                 nothing blocks it"
                    .to_owned()
            }
        };
        format!("joint {}{servo} is left without torque: {why}", joint.name)
    }
}

impl Finding {
    /// The meaning of the bits, in brackets. Empty for a servo whose reply says only that there is an alarm.
    fn alarm_words(&self, robot: &Robot, bits: u8) -> String {
        let joint = self.joint.and_then(|joint| robot.joints.get(joint));
        let servo = joint.and_then(|joint| joint.servo.as_ref());
        let registers = servo.map(|servo| servo.model.registers).filter(|registers| registers.tells_alarms);
        registers.map(|registers| format!(" ({})", registers.alarm_words(bits))).unwrap_or_default()
    }

    /// One sentence on the finding and one on what to do about it.
    pub fn describe(&self, robot: &Robot) -> String {
        let what = match self.fault {
            Fault::Unheard { age_s, is_damaged: true, .. } => {
                format!("sent only damaged replies for {age_s:.2} s")
            }
            Fault::Unheard { age_s, .. } => format!("was not heard for {age_s:.2} s"),
            Fault::OffGoal { error_rad, .. } => {
                format!("is {:.1} degrees off its goal", error_rad.to_degrees().abs())
            }
            Fault::Stalled { .. } => "does not turn though its goal does".to_owned(),
            Fault::Hot { temperature_c } => {
                format!("is at {temperature_c:.0} C, its limit is {:.0} C", robot.safety.temperature_c)
            }
            Fault::LowVoltage { voltage_v } => {
                let joint = self.joint.and_then(|joint| robot.joints.get(joint));
                let lowest_v = joint.map_or(0.0, |joint| robot.voltage_min_v(joint));
                format!("sees {voltage_v:.1} V, at least {lowest_v:.1} V are needed")
            }
            Fault::HighVoltage { voltage_v } => format!("sees {voltage_v:.1} V, more than it takes"),
            Fault::OutOfCounts { position_rad } => {
                format!("stands at {:.0} degrees, where it has no counts", position_rad.to_degrees())
            }
            Fault::BeyondStops { position_rad } => {
                format!(
                    "has lost its torque and stands at {:.0} degrees, beyond its range",
                    position_rad.to_degrees()
                )
            }
            Fault::NotBack { waited_s } => {
                format!("could not be brought back to its target within {waited_s:.1} s")
            }
            Fault::Alarm { bits } => {
                format!("raises alarm bits 0x{bits:02X}{}", self.alarm_words(robot, bits))
            }
            Fault::NotFinite => "has a target angle that is not a number".to_owned(),
            Fault::LoopStalled { gap_s } => {
                return format!(
                    "the loop stood still for {gap_s:.2} s: the machine is overloaded or was suspended; \
                     close other programs or lower loop_rate_hz"
                );
            }
        };
        let cure = match self.fault {
            Fault::Unheard { is_damaged: true, .. } => {
                "check the bus for loose plugs and long cables, and that no other servo has its id"
            }
            Fault::Unheard { .. } => "check its plug, its cable and the power of its bus",
            Fault::OffGoal { load_share, .. } | Fault::Stalled { load_share, .. }
                if load_share.abs() >= PUSHING_SHARE =>
            {
                "it pushes with much of its torque: check that nothing blocks the joint; if nothing does, the weight on \
                 it is too great ('hippocamp check' shows the load of each joint): lighten the robot, or take stronger \
                 servos"
            }
            Fault::OffGoal { .. } | Fault::Stalled { .. } => {
                "check that nothing blocks the joint and that its horn is tight"
            }
            Fault::Hot { .. } => "let it cool, then walk slower or lighten the robot",
            Fault::LowVoltage { .. } => "charge the battery or check the supply and its wires",
            Fault::HighVoltage { .. } => {
                "switch the power off; check the supply and that the servo is the right model"
            }
            Fault::OutOfCounts { .. } | Fault::BeyondStops { .. } => {
                "turn the limp joint by hand towards the middle of its range"
            }
            Fault::NotBack { .. } => "check its target: it is outside the joint's range",
            Fault::Alarm { .. } => {
                "switch its power off and on, and check its load ('hippocamp check' shows that of each joint), heat and \
                 voltage"
            }
            Fault::NotFinite => "this is a defect of the program: please report it with the robot file",
            Fault::LoopStalled { .. } => "",
        };
        let Some(joint) = self.joint.and_then(|joint| robot.joints.get(joint)) else {
            return format!("the loop {what}: {cure}");
        };
        let Some(servo) = &joint.servo else { return format!("joint {} {what}: {cure}", joint.name) };
        let bus = &robot.buses[servo.bus].name;
        match self.fault {
            Fault::Unheard { is_whole_bus: true, .. } => format!(
                "bus {bus}: none of its servos answers (servo {}, joint {}, {what}): check its adapter, its cable \
                 and its power; until it is back, its servos keep the last goal they received",
                servo.id, joint.name
            ),
            _ => format!("servo {} on bus {bus} (joint {}) {what}: {cure}", servo.id, joint.name),
        }
    }
}
