//! The main job: both robots walk in every gait on simulated buses, and the report shows no fault.
//!
//! With `HIPPOCAMP_FULL` set, each robot walks for a minute in each gait; otherwise only the robot of 500 cycles a
//! second does, and only in the walk.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a test may panic; figures are for people")]

mod common;

use common::{ROBOTS, Scenario, capability, is_full, shipped};
use hippocamp::model::{Protocol, Robot};
use hippocamp::motion::{Command, GaitChoice, Order};
use hippocamp::telemetry::{BusReport, LoopReport, Outcome, Quantiles, Report};

/// Share of all goals that safety may change in a walk.
const CHANGED_SHARE: f64 = 1e-4;

/// The report of a walking robot contains only its walk.
fn assert_good(robot: &Robot, report: &Report, walk_for_s: f64) {
    let what = format!("{} {:?}", report.robot, report.gait);
    assert_eq!(report.outcome, Outcome::Completed, "{what}: {}", report.reason);
    assert!(report.duration_s > walk_for_s, "{what}: {} s", report.duration_s);
    let cycles = (report.duration_s * robot.rate_hz).round();
    assert!((report.cycles as f64 - cycles).abs() <= 1.0, "{what}: {} cycles", report.cycles);
    assert_eq!(report.late_cycles, 0, "{what}");
    // A joint that leaves the end of its range begins to turn at once, and safety may limit its acceleration for
    // some cycles; safety changes no other goal.
    let goals = report.cycles as f64 * robot.joints.len() as f64;
    let changed = report.safety_interventions as f64 / goals;
    assert!(changed < CHANGED_SHARE, "{what}: {} goals changed", report.safety_interventions);

    assert_eq!(report.joints.range_violations, 0, "{what}");
    assert_eq!(report.joints.rate_violations, 0, "{what}");
    assert!(report.joints.tracking_error_max_deg < 15.0, "{what}: {:?}", report.joints);

    let feet = &report.feet.unwrap();
    let half_excursion_m = capability(robot).half_excursion_m();
    assert!(feet.excursion_max_m <= half_excursion_m + 1e-9, "{what}: {feet:?}, E {half_excursion_m}");
    assert!(feet.excursion_max_m > 0.2 * half_excursion_m, "{what} walks: {feet:?}");
    assert!(feet.stance_slip_planned_max_m <= 1e-6, "{what}: {feet:?}");
    assert!(feet.ik_residual_max_m <= 1e-4, "{what}: {feet:?}");
    assert!(feet.swing_velocity_jump_max_m_s <= 0.0, "{what}: {feet:?}");

    assert_eq!(report.buses.len(), robot.buses.len());
    for (index, bus) in report.buses.iter().enumerate() {
        assert_good_bus(robot, index, bus, report);
    }
}

/// Limp exchanges of a run: two until all servos have answered and are believed, five at the end.
const LIMP_EXCHANGES: u64 = 7;
/// Plain exchanges a Dynamixel bus makes before it asks for fast replies.
const PLAIN_EXCHANGES: u64 = 50;

/// Every reply came, and the bytes are those of the packets in the protocols' manuals:
/// Feetech FT-SCS: sync write 8 + N (1 + L), sync read 8 + N, reply 6 + L.
/// Dynamixel 2.0: sync write 14 + N (1 + L), sync read 14 + N, reply 11 + L, fast reply 8 + N (4 + L).
fn assert_good_bus(robot: &Robot, index: usize, bus: &BusReport, report: &Report) {
    let what = format!("{} {:?} bus {}", report.robot, report.gait, bus.name);
    assert_eq!((bus.missing, bus.corrupt), (0, 0), "{what}");
    assert_eq!(bus.exchanges, report.cycles, "{what}");
    let of_bus = |joint: &&hippocamp::model::Joint| joint.servo.is_some_and(|servo| servo.bus == index);
    let servos = robot.joints.iter().filter(of_bus).count() as u64;
    let moving = bus.exchanges - LIMP_EXCHANGES;
    let (bytes_out, bytes_in) = match robot.buses[index].protocol {
        Protocol::Feetech => {
            let (torque_limit, goal, enable) = (8 + servos * 3, 8 + servos * 3, 8 + servos * 2);
            let every = enable + 8 + servos;
            (bus.exchanges * every + moving * (torque_limit + goal), bus.exchanges * servos * (6 + 8))
        }
        Protocol::Dynamixel => {
            let (torque_limit, goal, enable) = (14 + servos * 3, 14 + servos * 5, 14 + servos * 2);
            let every = enable + 14 + servos;
            let fast = bus.exchanges - PLAIN_EXCHANGES;
            (
                bus.exchanges * every + moving * (torque_limit + goal),
                PLAIN_EXCHANGES * servos * (11 + 21) + fast * (8 + servos * (4 + 21)),
            )
        }
    };
    assert_eq!((bus.bytes_out, bus.bytes_in), (bytes_out, bytes_in), "{what}");
    // 10 bits a byte.
    let busy_s = (bytes_out + bytes_in) as f64 * 10.0 / f64::from(robot.buses[index].baud);
    assert!((bus.wire_share - busy_s / report.duration_s).abs() < 1e-6, "{what}: {}", bus.wire_share);
    let period_us = 1e6 / robot.rate_hz;
    assert!((bus.exchange_us.max as f64) < period_us, "{what}: {:?}", bus.exchange_us);
}

fn walks(file: &str, gait: &str, walk_for_s: f64) {
    let robot = shipped(file);
    let report = Scenario::new(&robot, gait, walk_for_s).run();
    assert_eq!((report.robot.as_str(), report.gait.as_deref()), (robot.name.as_str(), Some(gait)));
    assert_good(&robot, &report, walk_for_s);
}

#[test]
fn horse_walks_for_a_minute() {
    walks("horse.toml", "walk", 60.0);
}

#[test]
fn horse_walks_steadily_for_a_minute() {
    walks("horse.toml", "walk-steady", 60.0);
}

#[test]
fn horse_trots_for_a_minute() {
    walks("horse.toml", "trot", 60.0);
}

#[test]
fn dynamixel_horse_walks_for_a_minute() {
    walks("horse-dynamixel.toml", "walk", 60.0);
}

#[test]
fn dynamixel_horse_walks_steadily() {
    walks("horse-dynamixel.toml", "walk-steady", if is_full() { 60.0 } else { 10.0 });
}

#[test]
fn dynamixel_horse_trots() {
    walks("horse-dynamixel.toml", "trot", if is_full() { 60.0 } else { 10.0 });
}

#[test]
fn both_horses_canter_and_gallop_on_either_lead() {
    for file in ROBOTS {
        for (number, gait) in ["canter", "gallop", "rotary-gallop"].into_iter().enumerate() {
            let walk_for_s = if is_full() { 10.0 } else { 4.0 };
            // Alternates the leads for the robot of 500 cycles a second, unless both are tested.
            let is_wanted = |lead: usize| is_full() || file == "horse.toml" || number % 2 == lead;
            if is_wanted(0) {
                walks(file, gait, walk_for_s);
            }
            if is_wanted(1) {
                walks(file, &format!("{gait}-left"), walk_for_s);
            }
        }
    }
}

/// Each gait follows every second one of the others, for five seconds at nine tenths of its top speed.
#[test]
fn both_horses_change_gaits_on_their_servos() {
    for file in ROBOTS {
        let robot = shipped(file);
        let mut scenario = Scenario::from_sitting(&robot, "walk", 60.0);
        let plan = scenario.plan.clone();
        let gaits = plan.settings.gaits.len();
        let order = |time_s: f64| {
            #[allow(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "a small whole number"
            )]
            let turn = (time_s / 5.0) as usize;
            // Steps of two through an odd number of gaits reach all of them, and none twice in two rounds.
            let gait = 2 * turn % gaits;
            match turn {
                0..18 => Order::Drive(Command::ahead(gait, 0.9 * plan.top_speed_m_s(GaitChoice::Gait(gait)))),
                _ => Order::Stop,
            }
        };
        scenario.order = &order;
        let report = scenario.run();
        let (joints, feet) = (&report.joints, &report.feet.unwrap());
        println!("{file}: {joints:?}, {} goals changed by safety", report.safety_interventions);
        assert_eq!(report.outcome, Outcome::Completed, "{file}: {}", report.reason);
        assert_eq!((joints.range_violations, joints.rate_violations), (0, 0), "{file}");
        assert!(joints.tracking_error_max_deg < 15.0, "{file}: {joints:?}");
        assert!(feet.excursion_max_m <= capability(&robot).half_excursion_m() + 1e-9, "{file}: {feet:?}");
        assert!(feet.stance_slip_planned_max_m <= 1e-9 && feet.ik_residual_max_m <= 1e-4, "{file}: {feet:?}");
        assert!(feet.swing_velocity_jump_max_m_s <= 0.0, "{file}: {feet:?}");
    }
}

#[test]
fn one_seed_gives_one_report_and_another_seed_another() {
    let robot = shipped("horse.toml");
    let run = |seed| {
        let mut report = Scenario { seed, ..Scenario::new(&robot, "walk", 5.0) }.run();
        let none = Quantiles { p50: 0, p99: 0, p999: 0, max: 0 };
        report.loop_times =
            LoopReport { work_us: None, late_us: none, stages_us: None, slowest: None, first: None };
        report
    };
    let report = run(7);
    assert_eq!(report, run(7));
    assert_ne!(report, run(8));
}
