//! Units mixed up: a file whose lengths are in metres, or whose angles are in radians.

use super::limb::ChainEntry;
use super::reader::Section;

/// A robot all of whose links and roots are shorter than this is none, m.
const LENGTH_LEAST_M: f64 = 0.002;
/// A robot all of whose ranges end this near to zero cannot move, rad: they were meant in radians, at most a turn.
const ANGLE_LEAST_RAD: f64 = 0.11;

/// Refuses such files, and names the likely mistake.
pub(super) fn refuse(file: &Section<'_>, chains: &[ChainEntry<'_>]) {
    let limbs = || chains.iter().filter_map(|chain| Some((chain, chain.limb.as_ref()?)));
    let Some((first, _)) = limbs().next() else { return };
    let joints = || limbs().flat_map(|(_, limb)| limb.joints());
    if first.arm.is_some() || joints().count() < 2 {
        return;
    }
    let longest_m = joints().map(|joint| joint.link_m.length()).fold(0.0, f64::max);
    if longest_m < LENGTH_LEAST_M {
        file.fault(
            &format!("{}.joint[0].link_mm", first.key),
            format!(
                "lengths in mm: the longest link of this file is {:.3} mm long, so its lengths are probably in metres",
                longest_m * 1e3
            ),
        );
    }
    let widest_rad =
        joints().map(|joint| joint.range_rad.0.abs().max(joint.range_rad.1.abs())).fold(0.0, f64::max);
    if widest_rad < ANGLE_LEAST_RAD {
        file.fault(
            &format!("{}.joint[0].range_deg", first.key),
            format!(
                "angles in degrees: no range of this file goes further than {:.2} degrees, so its angles are probably in \
                 radians (1 rad is 57.3 degrees)",
                widest_rad.to_degrees()
            ),
        );
    }
}
