//! The faults of one episode: of every kind, several at once, at any time.

use hw_sim::faults::{FaultKind, KINDS, Kind, Scope, ScriptedFault, ScriptedPush, Target};

use crate::model::Robot;
use crate::random::RandomStream;

/// Most faults of an episode.
const MOST: usize = 9;
/// Shortest and longest duration of a temporary fault, s: from less than a cycle to longer than any hold.
const LENGTHS_S: (f64, f64) = (0.004, 8.0);
/// Largest time between faults that come together, s.
const TOGETHER_S: f64 = 0.4;

/// Faults that begin by `latest_s`, for a run that is ordered to end at `end_s`.
pub(super) fn draw(
    chance: &mut RandomStream,
    robot: &Robot,
    has_physics: bool,
    latest_s: f64,
    end_s: f64,
) -> Vec<ScriptedFault> {
    let mut faults: Vec<ScriptedFault> = Vec::new();
    while faults.len() < MOST && (faults.is_empty() || chance.is(0.75)) {
        let at_s = match faults.last() {
            Some(before) if chance.is(0.3) => (before.at_s + chance.between(0.0, TOGETHER_S)).min(latest_s),
            // Some at the very start and while the robot ends; most in between.
            _ if chance.is(0.06) => chance.between(0.0, 1.5),
            _ if chance.is(0.2) => chance.between((end_s - 2.0).max(0.0), latest_s),
            _ => chance.between(0.5, latest_s),
        };
        faults.push(one(chance, robot, has_physics, at_s));
    }
    faults
}

fn one(chance: &mut RandomStream, robot: &Robot, has_physics: bool, at_s: f64) -> ScriptedFault {
    let for_s = (!chance.is(0.08)).then(|| chance.log_between(LENGTHS_S.0, LENGTHS_S.1));
    let everywhere = Target::default();
    if robot.imu.is_some() && chance.is(0.06) {
        let kinds: Vec<&Kind> = KINDS.iter().filter(|kind| kind.scope == Scope::Imu).collect();
        let kind = (kinds[chance.below(kinds.len())].make)(0.0);
        return ScriptedFault { at_s, for_s, kind, target: everywhere };
    }
    if has_physics && chance.is(0.12) {
        return ScriptedFault { at_s, for_s: None, kind: push(chance, robot), target: everywhere };
    }
    let bus = chance.below(robot.buses.len());
    let kinds = kinds_on_buses();
    let kind = kinds[chance.below(kinds.len())];
    let own = own_value(chance, robot, bus, kind);
    let (kind, scope) = ((kind.make)(own), kind.scope);
    let mut target = Target::default();
    // For servos, most often one; otherwise all of a bus; seldom all of the robot.
    if scope != Scope::Host && !chance.is(0.1) {
        target.bus = robot.buses.get(bus).map(|bus| bus.name.clone());
        if scope != Scope::Buses && chance.is(0.75) {
            target.id = chance.one_of(&ids(robot, bus)).copied();
        }
    }
    let is_once = matches!(scope, Scope::ServosOnce | Scope::Host);
    ScriptedFault { at_s, for_s: for_s.filter(|_| !is_once), kind, target }
}

/// The kinds of fault of servos, buses and host; scrambled replies, which may pass for true ones, twice.
fn kinds_on_buses() -> Vec<&'static Kind> {
    let is_drawn = |kind: &&Kind| !matches!(kind.scope, Scope::Imu | Scope::Trunk);
    let mut kinds: Vec<&Kind> = KINDS
        .iter()
        .filter(is_drawn)
        .flat_map(|kind| std::iter::repeat_n(kind, if kind.word == "scrambled" { 2 } else { 1 }))
        .collect();
    // The last stands first, so that recorded seeds of campaigns give the same faults as ever.
    kinds.rotate_right(1);
    kinds
}

/// A value for the key that only this kind has; anywhere within its limits, for kinds that are not named here.
fn own_value(chance: &mut RandomStream, robot: &Robot, bus: usize, kind: &Kind) -> f64 {
    let Some((_, _, limits)) = &kind.own else { return 0.0 };
    match kind.word {
        "slow" => chance.log_between(0.05, 40.0),
        "scrambled" => chance.between(0.1, 1.0),
        "wrong-id" => f64::from(other_id(chance, robot, bus)),
        "late-host" => chance.log_between(1.0, 3500.0),
        "low-voltage" => volts(chance, robot, bus),
        "hot" => chance.between(20.0, 110.0),
        _ => chance.between(*limits.start(), *limits.end()),
    }
}

fn ids(robot: &Robot, bus: usize) -> Vec<u8> {
    let servos = robot.joints.iter().filter_map(|joint| joint.servo);
    servos.filter(|servo| servo.bus == bus).map(|servo| servo.id.0).collect()
}

/// The id of another servo on the bus, or an id without a servo.
fn other_id(chance: &mut RandomStream, robot: &Robot, bus: usize) -> u8 {
    let free = 200;
    if chance.is(0.3) { free } else { chance.one_of(&ids(robot, bus)).copied().unwrap_or(free) }
}

/// A voltage anywhere from too low for starting to too high.
fn volts(chance: &mut RandomStream, robot: &Robot, bus: usize) -> f64 {
    let servo = robot.joints.iter().filter_map(|joint| joint.servo).find(|servo| servo.bus == bus);
    let nominal_v = servo.map_or(12.0, |servo| servo.model.nominal_voltage_v);
    if chance.is(0.2) { chance.between(0.0, 3.0) } else { nominal_v * chance.between(0.4, 1.3) }
}

fn push(chance: &mut RandomStream, robot: &Robot) -> FaultKind {
    // A direction that does not change when it is written in degrees.
    let towards_rad = chance.between(-180.0, 180.0).round().to_radians();
    FaultKind::Push(ScriptedPush {
        impulse_n_s: robot.mass_kg() * chance.log_between(0.05, 1.2),
        for_s: 0.1,
        towards_rad: Some(towards_rad),
        place_m: [0.0; 3],
        every_s: None,
    })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test may panic")]

    use std::collections::BTreeSet;

    use hw_sim::FaultScript;

    use super::*;
    use crate::config;

    #[test]
    fn every_kind_is_drawn_and_can_be_written_and_read_again() {
        let text = include_str!("../../../config/horse.toml");
        let robot = config::parse(text, "horse.toml").unwrap().robot;
        let mut kinds = BTreeSet::new();
        for number in 0..400 {
            let faults = draw(&mut RandomStream::new(1, number), &robot, true, 26.0, 20.0);
            assert!(!faults.is_empty() && faults.len() <= MOST);
            assert!(faults.iter().all(|fault| (0.0..=26.0).contains(&fault.at_s)));
            kinds.extend(faults.iter().map(|fault| fault.kind.name()));
            let text = FaultScript::of(faults.clone()).to_toml();
            let again = crate::simulation::fault_script(&robot, &text, "drawn").unwrap();
            assert_eq!(FaultScript::of(again.faults).to_toml(), text);
        }
        let known: BTreeSet<&str> = hw_sim::faults::words().collect();
        assert_eq!(kinds, known);
    }
}
