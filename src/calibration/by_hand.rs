//! Sweeps: a person turns each joint by hand from end to end, which shows its sign and its seam.

use super::bench::Bench;
use super::sweep::{Stage, Sweep, SweepResult};
use super::zero::{centre_one, zero_count};
use super::{CalibrateError, Person, ways};
use crate::bus::Ports;
use crate::config::Unit;
use crate::model::Servo;

/// A sweep over less than this share of the joint's range gets a note.
const SHORT_SHARE: f64 = 0.7;

/// Has the person sweep every joint in `unit` whose mounting direction is still unknown.
pub(super) fn sweep_all<P: Ports, H: Person>(
    bench: &mut Bench<'_, P, H>,
    unit: &mut Unit,
    is_unattended: bool,
) -> Result<(), CalibrateError> {
    let left: Vec<usize> =
        (0..unit.joints.len()).filter(|place| unit.joints[*place].reversed.is_none()).collect();
    if left.is_empty() {
        return Ok(());
    }
    bench.person.hear("");
    bench.person.hear("Now turn each joint by hand, one after the other; all are limp.");
    let mut to_mount = Vec::new();
    for place in left {
        if !sweep_one(bench, unit, place, is_unattended)? {
            to_mount.push(unit.joints[place].name.clone());
        }
    }
    if to_mount.is_empty() {
        return Ok(());
    }
    // After remounting, their count in the marked pose will differ.
    unit.joints.retain(|entry| !to_mount.contains(&entry.name));
    bench.person.keep(unit)?;
    Err(CalibrateError::Mount { joints: to_mount })
}

/// Sweeps the joint at this index of `unit` and saves the result; false if its servo must be remounted.
fn sweep_one<P: Ports, H: Person>(
    bench: &mut Bench<'_, P, H>,
    unit: &mut Unit,
    place: usize,
    is_unattended: bool,
) -> Result<bool, CalibrateError> {
    let robot = bench.robot;
    let name = unit.joints[place].name.clone();
    let Some(index) = robot.joints.iter().position(|joint| joint.name == name) else { return Ok(true) };
    let (joint, servo) = (&robot.joints[index], bench.servo(index)?);
    let half = 0.5 * (joint.range_rad.1 - joint.range_rad.0) / servo.count_rad();
    let mut is_centred = false;
    loop {
        let marked = unit.joints[place].of(&servo).count_of(joint.middle_rad());
        let (swept, sweep) = watch(bench, index, Sweep::new(marked, half, servo.model.counts_per_turn))?;
        if !swept.has_seam {
            let as_built = Servo { reversed: swept.is_falling, ..servo };
            unit.joints[place].reversed = Some(swept.is_falling);
            unit.joints[place].zero_count = zero_count(joint, &as_built, marked);
            bench.person.keep(unit)?;
            tell(bench, index, &servo, &swept, half);
            return Ok(true);
        }
        bench.person.hear(&format!(
            "{name}: the seam of its encoder (where its highest count becomes 0) lies in its travel."
        ));
        if servo.model.registers.set_middle.is_empty() || is_centred {
            return Ok(false);
        }
        bench.person.hear(
            "The cure is written into the servo permanently: its present position becomes its middle count. The \
             middle of its travel is best.",
        );
        if !is_unattended && !bench.ask_whether("Bring it there and hold it. Write it?")? {
            return Ok(false);
        }
        // A hand may have moved the joint since.
        let mut sweep = sweep;
        let count = bench.count(index)?;
        sweep.see(count, 0.0);
        let from_marked = sweep.at();
        // If an interruption comes between servo and file, the file must not hold a zero in counts that no longer
        // apply.
        let mut entry = unit.joints.remove(place);
        bench.person.keep(unit)?;
        let middle = centre_one(bench, index)?;
        entry.zero_count = zero_count(joint, &entry.of(&servo), middle - from_marked);
        unit.joints.insert(place, entry);
        bench.person.keep(unit)?;
        is_centred = true;
    }
}

/// Watches a joint until it has been turned from end to end.
fn watch<P: Ports, H: Person>(
    bench: &mut Bench<'_, P, H>,
    joint: usize,
    mut sweep: Sweep,
) -> Result<(SweepResult, Sweep), CalibrateError> {
    let name = &bench.robot.joints[joint].name;
    let [forward, back] = ways(bench.robot, joint);
    let mut told = None;
    loop {
        let dt_s = bench.look()?;
        let Some(count) = bench.last_count(joint) else { continue };
        let stage = sweep.see(count, dt_s);
        if told == Some(stage) {
            continue;
        }
        told = Some(stage);
        match stage {
            Stage::ToMiddle => bench.person.hear(&format!("{name}: bring it to the middle of its range.")),
            Stage::Forward => bench.person.hear(&format!(
                "{name}: turn it so that the end of its limb goes {forward}, as far as it goes."
            )),
            Stage::Back => {
                bench.person.hear(&format!("{name}: now {back}, as far as it goes, and hold it there."));
            }
            Stage::Done(swept) => return Ok((swept, sweep)),
        }
    }
}

fn tell<P: Ports, H: Person>(
    bench: &mut Bench<'_, P, H>,
    index: usize,
    servo: &Servo,
    swept: &SweepResult,
    half: f64,
) {
    let name = &bench.robot.joints[index].name;
    let travel_deg = (swept.travel * servo.count_rad()).to_degrees();
    let counts = if swept.is_falling { "fall" } else { "rise" };
    let mounted = match swept.is_falling == servo.reversed {
        true => "as the robot file says",
        false => "the other way round than in the robot file, which is recorded",
    };
    bench
        .person
        .hear(&format!("{name}: counts {counts}, mounted {mounted}; {travel_deg:.0} degrees of travel."));
    if swept.travel < SHORT_SHARE * 2.0 * half {
        let range_deg = (2.0 * half * servo.count_rad()).to_degrees();
        bench.person.hear(&format!(
            "{name}: its range in the robot file is {range_deg:.0} degrees; if it cannot go there, make range_deg smaller."
        ));
    }
}
