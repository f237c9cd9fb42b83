//! The current that the servos of a bus draw, against what its plugs carry.

use super::lines::Lines;
use crate::model::Robot;

/// Current that a pin of the makers' three-pin plugs carries, A (JST EH of the X series, Molex 5264 of the STS:
/// both 3 A with AWG 22).
const PLUG_A: f64 = 3.0;
/// Load of a walking robot, share of stall (ROBOTIS e-manual: plan for a fifth of the stall torque).
const WALKING_SHARE: f64 = 0.2;

/// Checks the current budget of a bus against its connector.
pub(super) fn examine(robot: &Robot, bus: usize, lines: &mut Lines<'_>) {
    let about = format!("bus {}", robot.buses[bus].name);
    let servos = robot.joints.iter().filter_map(|joint| joint.servo).filter(|servo| servo.bus == bus);
    let (mut count, mut stalled_a) = (0, 0.0);
    for servo in servos {
        count += 1;
        stalled_a += servo.model.stall_current_a * robot.safety.torque_share;
    }
    let walking_a = WALKING_SHARE * stalled_a;
    let found = format!(
        "{count} servos draw {stalled_a:.1} A stalled at the torque they are permitted, some {walking_a:.1} A walking; a \
         plug carries {PLUG_A:.0} A"
    );
    if walking_a <= PLUG_A {
        return lines.ok(&about, found);
    }
    let places = (walking_a / PLUG_A).ceil();
    lines.warning(
        &about,
        found,
        format!(
            "feed power in at {places:.0} places of the chain or more, from a supply of {:.0} A at least, with a fuse \
             (docs/wiring.md); if it is wired like this, all is well",
            0.5 * stalled_a
        ),
    );
}
