//! Motions of octopus arms: where the ends of an arm's groups, its tip or all its joints are to be.
//!
//! Everything here is a function of phase or time and settings; what an arm's joints do about it is inverse
//! kinematics' matter. Frames: `in_arm` is the arm's own at its root, x along the straight arm, y left, z up.

pub mod key_angles;
pub mod pseudo_targets;
