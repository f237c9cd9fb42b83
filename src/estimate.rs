//! From replies to what is known of the robot. A lost reply leaves the last one standing, and ageing.

use crate::counts;
use crate::model::Robot;
use crate::signals::{Slot, State};

/// Updates `state` with the replies of a cycle that began `gap_s` after the one before; one slot a joint.
pub fn update(robot: &Robot, gap_s: f64, slots: &[Slot], state: &mut State) {
    for ((known, joint), slot) in state.joints.iter_mut().zip(&robot.joints).zip(slots) {
        match (slot, &joint.servo) {
            (Slot::Fresh(reply), Some(servo)) => *known = counts::measured(servo, reply),
            _ => {
                known.age_s += gap_s;
                known.is_damaged |= *slot == Slot::Corrupt;
            }
        }
    }
}
