//! An octopus arm as the motions and inverse kinematics see it: a chain of ball joints with links between, in
//! three groups.
//!
//! The chain's own frame is the arm's: at zero angles the arm lies along x, y is to its left, z up. A ball joint is
//! one to three hinges in one place, the last of which carries the link. On the arm of the thesis (Ishizuka 2008,
//! 3.1.1) the spheres' diameters shrink from joint to joint, and a link is half as long as its sphere is wide.

use std::ops::Range;

use glam::DVec3;
use thiserror::Error;

use super::{BallJoint, Chain, Joint};

/// Number of groups of joints in an arm; each has a pseudo-target.
pub const GROUPS: usize = 3;

/// Most hinges of one ball joint: `lift`, `sweep` and `twist`.
const HINGES_MAX: usize = 3;

/// A link may be this far off the arm's straight line, as a share of its length.
const STRAIGHT_SHARE: f64 = 1e-6;

/// Diameter of the sphere round joint `index`, counted from 0 at the root, in the unit of `root`. Each joint's
/// sphere is smaller than the one before by the share `taper` of the root's (3.1; the thesis has 0.01).
pub fn diameter(root: f64, taper: f64, index: usize) -> f64 {
    root * (1.0 - taper * index as f64)
}

/// Length of the link after that joint (3.2).
pub fn link_length(root: f64, taper: f64, index: usize) -> f64 {
    0.5 * diameter(root, taper, index)
}

/// The joints and links of an arm.
#[derive(Debug, Clone)]
pub struct ArmGeometry {
    /// Its joints, root first; their number is a multiple of [`GROUPS`].
    pub joints: Vec<ArmJoint>,
}

/// A joint of an arm.
#[derive(Debug, Clone)]
pub struct ArmJoint {
    /// Its hinges, or its section's winches, counted from the chain's root.
    pub hinges: Range<usize>,
    /// Length of the link after it, m.
    pub link_m: f64,
    /// Its range of swing and twist; `None` if only the hinges' own ranges apply.
    pub range: Option<BallJoint>,
}

/// Rule by which an arm bends to bring the ends of its groups to their targets.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Bending {
    /// The thesis' cyclic coordinate descent, group by group, in which each joint turns by its ratio (3.1.2, 3.2).
    Ccd,
    /// The least sum of squared bends.
    #[default]
    Smooth,
}

/// Reasons why a chain is not an arm.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum ArmError {
    /// The joints do not divide into groups.
    #[error(
        "an arm has as many joints as a multiple of {GROUPS}, not {0} (hinges in one place are one joint)"
    )]
    Count(usize),
    /// Too many hinges in one place.
    #[error("{0}: at most {HINGES_MAX} hinges are in one place")]
    Hinges(String),
    /// A hinge that turns about none of its frame's axes, twists before the link, or repeats the one before it.
    #[error(
        "{0}: the hinges of an arm's joint turn about y and z, or z and y, and a third, if any, about x: lift is \
         [0, -1, 0], sweep [0, 0, 1], twist [1, 0, 0]"
    )]
    Axis(String),
    /// A link that is not in line with the arm.
    #[error("{0}: a link of an arm points along x, [length, 0, 0]")]
    Bent(String),
}

impl ArmGeometry {
    /// The arm that consists of `chain` and its `joints`.
    pub fn of(chain: &Chain, joints: &[Joint]) -> Result<ArmGeometry, ArmError> {
        let mut arm = ArmGeometry { joints: Vec::new() };
        if let Some(drive) = &chain.tendons {
            for (index, section) in drive.sections().iter().enumerate() {
                let joint =
                    ArmJoint { hinges: 2 * index..2 * index + 2, link_m: section.link_m, range: None };
                arm.joints.extend(std::iter::repeat_n(joint, section.joints));
            }
            return Ok(arm);
        }
        let mut first = 0;
        for (index, joint) in joints.iter().enumerate() {
            let length_m = joint.link_m.length();
            if length_m <= 0.0 {
                continue;
            }
            if joint.link_m.x < (1.0 - STRAIGHT_SHARE) * length_m {
                return Err(ArmError::Bent(joint.name.clone()));
            }
            if index + 1 - first > HINGES_MAX {
                return Err(ArmError::Hinges(joint.name.clone()));
            }
            if !is_ball_joint(&joints[first..=index]) {
                return Err(ArmError::Axis(joint.name.clone()));
            }
            arm.joints.push(ArmJoint {
                hinges: first..index + 1,
                link_m: length_m,
                range: joint.ball.clone(),
            });
            first = index + 1;
        }
        let count = arm.joints.len();
        debug_assert_eq!(chain.joints.len(), joints.len());
        if count == 0 || !count.is_multiple_of(GROUPS) { Err(ArmError::Count(count)) } else { Ok(arm) }
    }

    /// Number of joints from the root to the end of group `group`, counted from 0: the group ends after as
    /// many links.
    pub fn joints_to_end(&self, group: usize) -> usize {
        (group + 1) * self.joints.len() / GROUPS
    }

    /// Length of each group, m (3.4 to 3.6). The sums as printed miss the links by one, so that a straight
    /// arm would not end on its pseudo-targets.
    pub fn group_lengths_m(&self) -> [f64; GROUPS] {
        std::array::from_fn(|group| {
            let end = self.joints_to_end(group);
            let begin = end - self.joints.len() / GROUPS;
            self.joints[begin..end].iter().map(|joint| joint.link_m).sum()
        })
    }

    /// Length of the whole arm, m.
    pub fn length_m(&self) -> f64 {
        self.joints.iter().map(|joint| joint.link_m).sum()
    }
}

/// The hinges among `joints` that share one place, of which `last` is the last.
pub fn hinges_in_place(joints: &[Joint], last: usize) -> Range<usize> {
    let before = joints[..last].iter().rposition(|joint| joint.link_m.length() > 0.0);
    before.map_or(0, |before| before + 1)..last + 1
}

/// True if hinges in one place are a ball joint of a limb along x: the first ones turn across it, each about
/// a different axis; one about x may follow.
pub fn is_ball_joint(hinges: &[Joint]) -> bool {
    let is_axis = |axis: DVec3| axis.abs().max_element() >= 1.0 - STRAIGHT_SHARE;
    let is_twist = |joint: &Joint| joint.axis.x.abs() > 0.5;
    let Some((last, before)) = hinges.split_last() else { return false };
    let across = if is_twist(last) { before } else { hinges };
    let are_across = (1..=2).contains(&across.len()) && !across.iter().any(is_twist);
    let are_apart = across.windows(2).all(|pair| pair[0].axis.dot(pair[1].axis).abs() < 0.5);
    hinges.iter().all(|joint| is_axis(joint.axis)) && are_across && are_apart
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn group_lengths_match_the_specification() {
        let joints = (0..12)
            .map(|index| ArmJoint {
                hinges: 2 * index..2 * index + 2,
                link_m: link_length(1.0, 0.01, index),
                range: None,
            })
            .collect();
        let lengths = ArmGeometry { joints }.group_lengths_m();
        for (length, wanted) in lengths.iter().zip([1.97, 1.89, 1.81]) {
            assert!((length - wanted).abs() < 1e-12, "{lengths:?}");
        }
    }
}
