//! The marked pose: the count of each servo in it, and whether that keeps the joint's range clear of the seam.

use std::time::Duration;

use super::bench::Bench;
use super::{CalibrateError, Person, figure, marked_pose_rad};
use crate::bus::Ports;
use crate::config::{Unit, UnitJoint};
use crate::model::{Joint, Robot, Servo};

/// Number of looks over which a pose is measured: a fifth of a second.
const LOOKS: usize = 10;
/// A joint that moves by more than this during the measurement is not held still: about a degree, counts.
const STILL_COUNTS: f64 = 12.0;
/// Unattended, the robot counts as in the pose once it has been still this many times in a row.
const STILL_TIMES: usize = 5;
/// Margin beside the joint's range: a hand may push the joint this far past its ends without crossing the seam,
/// rad.
const MARGIN_RAD: f64 = 10.0 * std::f64::consts::PI / 180.0;
/// Time within which a servo measures again.
const SETTLE: Duration = Duration::from_millis(100);
/// A centred servo is this close to its middle count: a hand is never quite still.
const CENTRED_COUNTS: f64 = 20.0;

/// The position of a servo encoder's seam.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Seam {
    /// In the joint's range: the joint cannot be used like this.
    Inside,
    /// Beside it: a hand could push the joint there.
    Near,
    /// Well away.
    Away,
}

/// The position of the seam if the middle of the joint's range is at `count`.
pub(super) fn seam(joint: &Joint, servo: &Servo, count: f64) -> Seam {
    let half = 0.5 * (joint.range_rad.1 - joint.range_rad.0) / servo.count_rad();
    let (first, last) = (f64::from(servo.model.count_range.0), f64::from(servo.model.count_range.1));
    let has_room = |half: f64| count - half >= first && count + half <= last;
    match (has_room(half), has_room(half + MARGIN_RAD / servo.count_rad())) {
        (false, _) => Seam::Inside,
        (true, false) => Seam::Near,
        (true, true) => Seam::Away,
    }
}

/// The zero count of a joint whose servo, mounted as in `servo`, is at `count` in the marked pose; to a tenth.
pub(super) fn zero_count(joint: &Joint, servo: &Servo, count: f64) -> f64 {
    let at_zero = Servo { zero_count: 0.0, ..*servo };
    (10.0 * (count - at_zero.count_of(joint.middle_rad()))).round() / 10.0
}

/// Measures the zero counts of all joints that are not in `unit` yet. The error names joints whose servos must be
/// remounted; the others are saved.
pub(super) fn measure<P: Ports, H: Person>(
    bench: &mut Bench<'_, P, H>,
    unit: &mut Unit,
    is_unattended: bool,
) -> Result<(), CalibrateError> {
    let robot = bench.robot;
    let is_measured = |name: &str| unit.joints.iter().any(|entry| entry.name == name);
    let missing: Vec<usize> = (0..robot.joints.len())
        .filter(|index| robot.joints[*index].servo.is_some() && !is_measured(&robot.joints[*index].name))
        .collect();
    if missing.is_empty() {
        return Ok(());
    }
    show_pose(bench, &missing);
    if is_unattended {
        bench.person.hear("Measured as soon as the robot is still.");
    } else {
        bench.ask("Bring the robot into this pose, hold it still, and press Enter.")?;
    }
    let mut counts = still_counts(bench, &missing, is_unattended)?;
    if centre(bench, &missing, &counts, is_unattended)? {
        counts = still_counts(bench, &missing, false)?;
    }

    let mut to_mount = Vec::new();
    for (&index, &count) in missing.iter().zip(&counts) {
        let (joint, servo) = (&robot.joints[index], bench.servo(index)?);
        match seam(joint, &servo, count) {
            Seam::Inside => to_mount.push(joint.name.clone()),
            Seam::Near | Seam::Away => unit.joints.push(UnitJoint {
                name: joint.name.clone(),
                zero_count: zero_count(joint, &servo, count),
                reversed: None,
                direction_checked: false,
                firmware: Some(bench.buses.firmware(index, &servo)?),
            }),
        }
    }
    // In the robot's order, whatever the order of measurement.
    unit.joints.sort_by_key(|entry| robot.joints.iter().position(|joint| joint.name == entry.name));
    bench.person.keep(unit)?;
    if to_mount.is_empty() {
        bench.person.hear(&format!("Zeros of {} joints measured and kept.", missing.len()));
        Ok(())
    } else {
        Err(CalibrateError::Mount { joints: to_mount })
    }
}

fn show_pose<P: Ports, H: Person>(bench: &mut Bench<'_, P, H>, missing: &[usize]) {
    let robot = bench.robot;
    let pose = marked_pose_rad(robot);
    let person = &mut *bench.person;
    person.hear("The marked pose: every joint in the middle of its range. Seen from the right side, front to the right:");
    person.hear("");
    figure(robot, &pose).iter().for_each(|line| person.hear(line));
    person.hear("");
    for &index in missing {
        let joint = &robot.joints[index];
        let [low, high] = [joint.range_rad.0, joint.range_rad.1].map(f64::to_degrees);
        let middle = pose[index].to_degrees();
        person
            .hear(&format!("  {:<24} {middle:7.1} degrees, halfway from {low:.1} to {high:.1}", joint.name));
    }
}

/// Positions of the servos of `joints`, once all of them are held still.
fn still_counts<P: Ports, H: Person>(
    bench: &mut Bench<'_, P, H>,
    joints: &[usize],
    is_unattended: bool,
) -> Result<Vec<f64>, CalibrateError> {
    let mut times = 0;
    let mut told = None;
    loop {
        match counts_if_still(bench, joints)? {
            Ok(counts) => {
                times += 1;
                if !is_unattended || times == STILL_TIMES {
                    return Ok(counts);
                }
            }
            Err(moving) => {
                times = 0;
                if told != Some(moving) && !is_unattended {
                    let name = &bench.robot.joints[moving].name;
                    bench.person.hear(&format!("{name} moves: hold the robot still."));
                    told = Some(moving);
                }
            }
        }
    }
}

/// Mean positions over some looks; or the joint that moves.
fn counts_if_still<P: Ports, H: Person>(
    bench: &mut Bench<'_, P, H>,
    joints: &[usize],
) -> Result<Result<Vec<f64>, usize>, CalibrateError> {
    let mut seen: Vec<Vec<f64>> = vec![Vec::new(); joints.len()];
    for _ in 0..LOOKS {
        bench.look()?;
        for (seen, joint) in seen.iter_mut().zip(joints) {
            seen.extend(bench.last_count(*joint));
        }
    }
    let mut means = Vec::new();
    for (seen, &joint) in seen.iter().zip(joints) {
        let turn = bench.servo(joint)?.model.counts_per_turn;
        let Some(&first) = seen.first() else { return Ok(Err(joint)) };
        // A shaft that trembles at the seam alternates between 4095 and 0.
        let ways: Vec<f64> =
            seen.iter().map(|count| count - first).map(|way| way - turn * (way / turn).round()).collect();
        let (low, high) =
            ways.iter().fold((0.0_f64, 0.0_f64), |(low, high), way| (low.min(*way), high.max(*way)));
        if high - low > STILL_COUNTS {
            return Ok(Err(joint));
        }
        means.push(first + ways.iter().sum::<f64>() / ways.len() as f64);
    }
    Ok(Ok(means))
}

/// Offers to centre the servos whose seam is in the way and that can be centred; true if that was done.
fn centre<P: Ports, H: Person>(
    bench: &mut Bench<'_, P, H>,
    joints: &[usize],
    counts: &[f64],
    is_unattended: bool,
) -> Result<bool, CalibrateError> {
    let robot: &Robot = bench.robot;
    let mut wrong = Vec::new();
    for (&index, &count) in joints.iter().zip(counts) {
        let servo = bench.servo(index)?;
        let can_be_centred = !servo.model.registers.set_middle.is_empty();
        if seam(&robot.joints[index], &servo, count) != Seam::Away && can_be_centred {
            wrong.push(index);
        }
    }
    if wrong.is_empty() {
        return Ok(false);
    }
    let names: Vec<&str> = wrong.iter().map(|index| robot.joints[*index].name.as_str()).collect();
    bench.person.hear(&format!(
        "The seam of the encoder (where its highest count becomes 0) lies in or beside the range of {}. The cure \
         is written into these servos permanently: their present positions become their middle counts.",
        names.join(", ")
    ));
    if !is_unattended && !bench.ask_whether("Hold the pose. Write it?")? {
        return Ok(false);
    }
    for index in wrong {
        centre_one(bench, index)?;
    }
    Ok(true)
}

/// Makes the present position of `joint`'s servo its middle count, and checks it; returns the middle count.
pub(super) fn centre_one<P: Ports, H: Person>(
    bench: &mut Bench<'_, P, H>,
    joint: usize,
) -> Result<f64, CalibrateError> {
    let servo = bench.servo(joint)?;
    bench.buses.set_middle(joint, &servo)?;
    bench.pause(SETTLE);
    let middle = servo.model.middle_count();
    let found = bench.count(joint)?;
    if (found - middle).abs() > CENTRED_COUNTS {
        let name = bench.robot.joints[joint].name.clone();
        return Err(CalibrateError::NotCentred { joint: name, found, middle });
    }
    Ok(middle)
}
