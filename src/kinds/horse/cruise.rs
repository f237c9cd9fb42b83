//! A steady stride of a gait, as the legs follow it without safety, servos or a body.

use crate::ik::{Limbs, Method};
use crate::model::Robot;
use crate::motion::horse::{HorsePlan, Velocity, Walk};
use crate::motion::posture_pull;
use crate::signals::{JointTargets, Targets};

/// Goes straight ahead in the gait with index `gait` at `speed_m_s`, negative to go backwards, on a level trunk, and calls
/// `see` with each of the `times` (s, `dt_s` apart, from 0), the targets and the joint angles. Every leg begins in the
/// sitting pose: it needs some strides to settle.
pub(super) fn cruise(
    robot: &Robot,
    plan: &HorsePlan,
    (gait, speed_m_s): (usize, f64),
    dt_s: f64,
    times: impl Iterator<Item = f64>,
    mut see: impl FnMut(f64, &Targets, &[f64]),
) {
    let mut walk = Walk::cruising(plan, gait, Velocity { speed_m_s, yaw_rate_rad_s: 0.0 });
    let mut limbs = Limbs::new(robot, Method::CcdThenFinish);
    let (mut targets, mut joints) = (Targets::new(robot), JointTargets::new(robot));
    targets.posture_pull = posture_pull(dt_s);
    joints.angles_rad.copy_from_slice(&plan.sit_pose_rad);
    for s in times {
        walk.advance(s);
        walk.write_level(plan, s, &mut targets);
        limbs.solve(&targets, &mut joints);
        see(s, &targets, &joints.angles_rad);
    }
}
