//! What a finding means, for people: which servo, what is wrong, what to do.

use super::{Fault, Finding};
use crate::model::Robot;

impl Finding {
    /// One sentence on what was found and one on what to do about it.
    pub fn describe(&self, robot: &Robot) -> String {
        let what = match self.fault {
            Fault::Unheard { age_s } => format!("was not heard for {age_s:.2} s"),
            Fault::OffGoal { error_rad } => {
                format!("is {:.1} degrees off its goal", error_rad.to_degrees().abs())
            }
            Fault::Stalled { .. } => "does not turn though its goal does".to_owned(),
            Fault::Hot { temperature_c } => {
                format!("is at {temperature_c:.0} C, its limit is {:.0} C", robot.safety.temperature_c)
            }
            Fault::LowVoltage { voltage_v } => {
                format!("sees {voltage_v:.1} V, at least {:.1} V are needed", robot.safety.voltage_v)
            }
            Fault::Alarm { bits } => format!("raises alarm bits 0x{bits:02X}"),
            Fault::NotFinite => "was asked for an angle that is not a number".to_owned(),
            Fault::LoopStalled { gap_s } => {
                return format!(
                    "the loop stood still for {gap_s:.2} s: the machine is overloaded or was suspended; \
                     close other programs or lower loop_rate_hz"
                );
            }
        };
        let cure = match self.fault {
            Fault::Unheard { .. } => "check its plug, its cable and the power of its bus",
            Fault::OffGoal { .. } | Fault::Stalled { .. } => {
                "check that nothing blocks the joint and that its horn is tight"
            }
            Fault::Hot { .. } => "let it cool, then walk slower or lighten the robot",
            Fault::LowVoltage { .. } => "charge the battery or check the supply and its wires",
            Fault::Alarm { .. } => "switch its power off and on, and check its load, heat and voltage",
            Fault::NotFinite => "this is a defect of the program: please report it with the robot file",
            Fault::LoopStalled { .. } => "",
        };
        let joint = &robot.joints[self.joint];
        match &joint.servo {
            Some(servo) => {
                let bus = &robot.buses[servo.bus].name;
                format!("servo {} on bus {bus} (joint {}) {what}: {cure}", servo.id, joint.name)
            }
            None => format!("joint {} {what}: {cure}", joint.name),
        }
    }
}
