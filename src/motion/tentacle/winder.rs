//! Checks whether a robot has an arm that can wind round a pole, when the pole is named, long before the winding.

use glam::DVec3;

use super::winding::{Winding, WindingError, least_radius_m};
use crate::model::{ArmGeometry, Pole, Robot, TentacleMotion};

/// Checks that an arm of `robot` can wind round `pole`.
///
/// # Errors
/// The reason why no arm can, for the arm whose root is nearest to the pole's point. [`WindingError::NoPole`]
/// if there are no arms.
pub fn check(robot: &Robot, settings: &TentacleMotion, pole: Pole) -> Result<(), WindingError> {
    let mut nearest = (f64::INFINITY, WindingError::NoPole);
    for arm in &settings.arms {
        let chain = &robot.chains[arm.chain];
        let Ok(geometry) = ArmGeometry::of(chain, robot.joints_of(chain)) else { continue };
        let links_m = geometry.joints.iter().map(|joint| joint.link_m);
        let ahead = chain.root_rotation * DVec3::X;
        let least_m = least_radius_m(chain.tendons.as_ref(), &geometry.joints, robot.joints_of(chain));
        match Winding::new(chain.root_m, ahead, links_m, arm.radius_m, pole, 0.0)
            .and_then(|winding| winding.not_tighter_than(least_m))
        {
            Ok(_) => return Ok(()),
            Err(error) => {
                let off_m = chain.root_m.distance(pole.point_in_body);
                if off_m < nearest.0 {
                    nearest = (off_m, error);
                }
            }
        }
    }
    Err(nearest.1)
}
