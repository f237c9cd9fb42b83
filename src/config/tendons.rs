//! `[arm.tendons]`: an arm in three sections, each bent as a whole by two winches.
//!
//! The arm `NAME` has the joints `NAME.lift_1`, `NAME.sweep_1` to `NAME.sweep_3`: the winches of each section from
//! root to tip. The joint angles are the winches' turns.

use glam::DVec3;

use super::limb::ArmJoints;
use super::number::Limits;
use super::reader::Section as Table;
use super::servos::ServoPlaces;
use crate::model::tendon::Section;
use crate::model::{GROUPS, Joint, TendonDrive};

/// How far cords may hang loose if the file does not set it, mm.
const SLACK_MAX_MM: f64 = 1.0;
/// A winch's range relative to what the largest bends need, so that rounding stays inside.
const RANGE_MARGIN: f64 = 1.02;

/// Reads the tendons of an arm with links of these lengths.
pub(super) fn read(
    arm: &Table<'_>,
    name: Option<&str>,
    links_m: Option<&[f64]>,
    mass_kg: Option<f64>,
    servos: &mut ServoPlaces<'_>,
) -> Option<ArmJoints> {
    let meaning = "the cords that bend the arm's three sections";
    let drive = arm.section("tendons", meaning, |tendons| read_drive(tendons, links_m?));
    let ranges: Option<Vec<(f64, f64)>> = drive.as_ref().map(winch_ranges);
    let widest = ranges.as_ref().and_then(|ranges| ranges.last().copied());
    let rows = servos.read_rows(arm, Some(GROUPS), Some(2), widest)?;
    let mut servos = rows.iter().flat_map(|row| (0..row.count).map(move |place| (row, place)));
    let (name, mass_kg, drive, ranges) = (name?, mass_kg?, drive?, ranges?);
    let mut joints = Vec::new();
    for (index, (section, range_rad)) in drive.sections().iter().zip(ranges).enumerate() {
        for (kind, axis) in [("lift", DVec3::NEG_Y), ("sweep", DVec3::Z)] {
            joints.push(Joint {
                name: format!("{name}.{kind}_{}", index + 1),
                axis,
                link_m: DVec3::ZERO,
                range_rad,
                stiffness: 1.0,
                // Each of the two winches carries half of the section's mass, so that the sum is right.
                mass_kg: 0.5 * mass_kg * section.joints as f64,
                center_m: DVec3::ZERO,
                ball: None,
                servo: servos.next().map(|(row, place)| row.servo(place, range_rad)),
            });
        }
    }
    Some((joints, Some(drive)))
}

fn read_drive(tendons: &Table<'_>, links_m: &[f64]) -> Option<TendonDrive> {
    let positive = |key, meaning: &str| tendons.number(key, meaning, Limits::LENGTH).map(|mm| mm / 1000.0);
    let cord_m = positive("cord_radius_mm", "how far the cords run from the middle of the arm, in mm");
    let gap_m = positive("gap_mm", "the distance between the plates on either side of a joint in mm");
    let spool_m = positive("spool_radius_mm", "the radius of the winches' spools in mm");
    let meaning = "the largest bend of a section in degrees";
    let bend_max = tendons.number("bend_max_deg", meaning, Limits::AboveToMost(0.0, 180.0));
    let meaning = "the turn of each section's cords against those of the one before in degrees";
    let turn = tendons.number_or("cord_turn_deg", meaning, Limits::FromTo(-45.0, 45.0), 0.0);
    let meaning = "how far the cords are stretched when the arm is straight, in mm";
    let pretension = tendons.number("pretension_mm", meaning, Limits::LENGTH_OR_NONE);
    let meaning = "how far cords may hang loose at the largest bend, in mm";
    let slack_max = tendons.number_or("slack_max_mm", meaning, Limits::LENGTH_OR_NONE, SLACK_MAX_MM);
    let (cord_radius_m, gap_m, spool_radius_m) = (cord_m?, gap_m?, spool_m?);
    let (bend_max_rad, turn_rad) = (bend_max?.to_radians(), turn?.to_radians());
    let joints = links_m.len() / GROUPS;
    let section = |(index, links): (usize, &[f64])| Section {
        joints,
        // All links of a section have the same length.
        link_m: links.iter().sum::<f64>() / joints as f64,
        cord_radius_m,
        cord_turn_rad: index as f64 * turn_rad,
        gap_m,
        spool_radius_m,
        bend_max_rad,
    };
    let sections = links_m.chunks_exact(joints).enumerate().map(section).collect();
    let drive = TendonDrive::new(sections, pretension? / 1000.0, slack_max? / 1000.0);
    drive.map_err(|error| tendons.fault("bend_max_deg", format!("tendons that work: {error}"))).ok()
}

/// Range of each section's winches: their turns for its own bend, and for those of nearer sections, which its cords
/// pass.
fn winch_ranges(drive: &TendonDrive) -> Vec<(f64, f64)> {
    let mut bend_rad = 0.0;
    let range = |section: &Section| {
        bend_rad += section.bend_max_rad;
        let turn_rad = RANGE_MARGIN * bend_rad * section.cord_radius_m / section.spool_radius_m;
        (-turn_rad, turn_rad)
    };
    drive.sections().iter().map(range).collect()
}
