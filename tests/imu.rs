//! A robot with an inertial measurement unit: the state of the trunk in the loop, and the motion without it.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod common;

use std::time::Duration;

use common::{in_physics, plan, shipped};
use hippocamp::bus::{Buses, Ports, SimPorts};
use hippocamp::ik::Method;
use hippocamp::model::Robot;
use hippocamp::motion::{Activity, Order};
use hippocamp::observe::CycleRecord;
use hippocamp::run::Cycle;
use hippocamp::simulation;
use hw_sim::FaultScript;

/// The values of one cycle that these tests use.
#[derive(Debug, Clone, Copy)]
struct Seen {
    time_s: f64,
    is_known: bool,
    age_s: f64,
    speed_m_s: f64,
    is_walking: bool,
}

/// A horse that rises from sitting and walks at nine tenths of its top speed, `seconds` long, under `faults`.
fn drive(robot: &Robot, seconds: f64, faults: &str) -> Vec<Seen> {
    let mut seen = Vec::new();
    drive_and_look(robot, seconds, faults, |time_s, record| {
        seen.push(Seen {
            time_s,
            is_known: record.state.body.is_known,
            age_s: record.facts.imu.age_s,
            speed_m_s: record.facts.speed_m_s,
            is_walking: record.facts.activity == Activity::Walking,
        });
    });
    seen
}

/// The same; `look` gets each cycle with its start time.
fn drive_and_look(robot: &Robot, seconds: f64, faults: &str, mut look: impl FnMut(f64, &CycleRecord<'_>)) {
    let plan = plan(robot, "walk", 0.9);
    let faults = FaultScript::from_toml(faults).unwrap();
    let world = simulation::world_from_pose(robot, &plan.sit_pose_rad, 1, &faults).unwrap();
    let mut buses = Buses::new(robot, SimPorts::on_virtual_clock(world));
    buses.prepare(robot).unwrap();
    let mut deadline = buses.ports_mut().now();
    let mut cycle = Cycle::new(robot, plan, Method::CcdThenFinish, 1e9, buses);
    while deadline.as_secs_f64() < seconds {
        cycle.begin(deadline);
        cycle.step(Order::Go);
        look(deadline.as_secs_f64(), &cycle.record());
        deadline = deadline + Duration::from_secs_f64(robot.period_s());
    }
}

/// The cycles from `from_s` until `to_s`.
fn between(seen: &[Seen], from_s: f64, to_s: f64) -> impl Iterator<Item = &Seen> {
    seen.iter().filter(move |seen| (from_s..to_s).contains(&seen.time_s))
}

#[test]
fn every_cycle_has_the_trunk_attitude_and_its_age() {
    for name in common::ROBOTS {
        let robot = shipped(name);
        let imu = robot.imu.clone().unwrap();
        let seen = drive(&robot, 3.0, "");
        let (least_s, most_s) = (imu.delay_s + imu.wire_s(), imu.delay_s + imu.wire_s() + 1.0 / imu.rate_hz);
        for cycle in between(&seen, 0.2, 3.0) {
            assert!(cycle.is_known, "{name}: {cycle:?}");
            // A measurement read at the end of the exchange was complete at most a period ago. Plus a byte of
            // rounding.
            assert!((least_s - 1e-4..most_s + 1e-3).contains(&cycle.age_s), "{name}: {cycle:?}");
        }
    }
}

/// A walk on the ground that safety holds for a moment: the feet stay at their targets, with feedback added once.
#[test]
fn balance_feedback_does_not_accumulate_while_the_walk_is_held() {
    let robot = in_physics("horse.toml");
    // Long enough to hold, too short to stop.
    let faults = "[[fault]]\nkind = 'unplugged'\nat_s = 9.0\nfor_s = 0.4\nbus = 'main'\n";
    let mut held = 0;
    let mut before = None;
    drive_and_look(&robot, 12.0, faults, |_, record| {
        let tips: Vec<_> = (0..4).map(|leg| record.targets.tip_in_body(leg)).collect();
        let has_feet = !record.targets.feet().is_empty();
        if let Some(before) = before.take().filter(|_| record.facts.is_held && has_feet) {
            held += 1;
            assert_eq!(tips, before, "cycle {held} of the hold");
        }
        before = Some(tips);
    });
    assert!(held > 10, "it was held for {held} cycles");
}

#[test]
fn a_horse_whose_unit_is_lost_walks_slower_and_as_before_once_it_is_back() {
    let robot = shipped("horse.toml");
    let imu = robot.imu.clone().unwrap();
    let full_m_s = drive(&robot, 8.0, "").last().unwrap().speed_m_s;
    // Nine tenths of the top speed were asked for.
    let slow_m_s = imu.lost_speed_share * full_m_s / 0.9;
    let is_slow = |seen: &Seen| seen.is_walking && (seen.speed_m_s - slow_m_s).abs() < 1e-6;
    let acceleration_m_s2 = robot.motion.horse().unwrap().acceleration_m_s2;
    for kind in ["imu-silent", "imu-frozen", "imu-garbled", "imu-unplugged"] {
        let faults = format!("[[fault]]\nkind = '{kind}'\nat_s = 7.0\nfor_s = 3.0");
        let seen = drive(&robot, 13.0, &faults);
        assert!(between(&seen, 6.5, 6.98).all(|seen| seen.is_walking && seen.is_known), "{kind}");
        let lost_s = between(&seen, 6.5, 13.0).find(|seen| !seen.is_known).unwrap().time_s;
        assert!((lost_s - 7.0 - imu.stale_s).abs() < 0.03, "{kind}: lost at {lost_s} s");
        assert!(between(&seen, lost_s, 9.98).all(|seen| !seen.is_known), "{kind}");
        // It walks on, slower; and at its former speed once the unit has answered for a second.
        assert!(between(&seen, 9.5, 10.9).all(is_slow), "{kind}: {slow_m_s} m/s");
        assert!(between(&seen, 10.05, 13.0).all(|seen| seen.is_known), "{kind}");
        let last_m_s = seen.last().unwrap().speed_m_s;
        assert!((last_m_s - full_m_s).abs() < 1e-6, "{kind}: {last_m_s} m/s in the end");
        let steepest_m_s2 = seen
            .windows(2)
            .map(|pair| (pair[1].speed_m_s - pair[0].speed_m_s).abs() / robot.period_s())
            .fold(0.0, f64::max);
        assert!(steepest_m_s2 <= acceleration_m_s2 * (1.0 + 1e-6), "{kind}: {steepest_m_s2} m/s^2");
    }
    // A unit that never answered also limits the speed.
    let unheard = drive(&robot, 8.0, "[[fault]]\nkind = 'imu-silent'\nat_s = 0.0");
    assert!(is_slow(unheard.last().unwrap()), "{:?}", unheard.last());
}
