//! Operating modes of Dynamixel servos. Facts: ROBOTIS e-manual, X-series, Operating Mode and the goals.
#![allow(clippy::unwrap_used, reason = "helpers of tests; a failed one should panic")]
#![allow(clippy::cast_possible_truncation, reason = "counts and PWM units are small")]

mod common;
use common::x_series::*;
use common::*;
use hw_sim::Model;

/// Models that control their current, and the unit of Goal Current, A.
fn with_current() -> impl Iterator<Item = (&'static Model, f64)> {
    let unit = |model: &Model| if model.name.starts_with("XL330") { 0.001 } else { 0.002_69 };
    dynamixels().filter(|model| !model.name.starts_with("XL430")).map(move |model| (model, unit(model)))
}

#[test]
fn in_current_mode_a_blocked_shaft_feels_the_current_times_the_torque_constant() {
    for (model, unit) in with_current() {
        for (drive_mode, share) in [(0, 0.5), (0, -0.3), (1, 0.4)] {
            let mut world = one_with(&model.name, 0.0, STUCK);
            set(&mut world, 10, 1, drive_mode);
            mode(&mut world, CURRENT);
            let units = (share * model.stall_current_a / unit).round();
            set(&mut world, 102, 2, units as i32);
            torque_on(&mut world);
            wait(&mut world, 100);
            let forward = if drive_mode == 0 { 1.0 } else { -1.0 };
            let wanted = forward * units * unit * model.stall_torque_nm / model.stall_current_a;
            let torque = shaft(&world).torque_nm;
            assert!((torque - wanted).abs() < 1e-9, "{} {share}: {torque}, not {wanted}", model.name);
            assert_eq!(get(&world, 126, 2), units as i32, "{}: Present Current", model.name);
        }
    }
}

#[test]
fn in_current_mode_a_free_shaft_feels_the_same_torque_at_any_speed_the_supply_allows() {
    let model = named("XM430-W350");
    let mut world = one_at(&model.name, 0.0);
    mode(&mut world, CURRENT);
    // Half of the stall current: friction does not hold that, nor does the shaft soon turn too fast for the supply.
    set(&mut world, 102, 2, 428);
    torque_on(&mut world);
    let wanted = 428.0 * 0.002_69 * model.stall_torque_nm / model.stall_current_a;
    // Through its backlash.
    wait(&mut world, 6);
    let mut last_speed = 0.0;
    for _ in 0..4 {
        wait(&mut world, 1);
        let now = shaft(&world);
        assert!((now.torque_nm - wanted).abs() < 1e-9, "{now:?}");
        assert!(now.speed_rad_s > last_speed, "{now:?}");
        last_speed = now.speed_rad_s;
    }
}

#[test]
fn current_based_position_mode_pushes_no_harder_than_its_goal_current() {
    for (model, unit) in with_current() {
        let mut world = one_with(&model.name, 2048.0, STUCK);
        mode(&mut world, CURRENT_POSITION);
        let units = (0.2 * model.stall_current_a / unit).round();
        set(&mut world, 102, 2, units as i32);
        torque_on(&mut world);
        goal(&mut world, -3000);
        wait(&mut world, 100);
        let most = units * unit * model.stall_torque_nm / model.stall_current_a;
        assert!((shaft(&world).torque_nm + most).abs() < 1e-9, "{}", model.name);
    }
    // Where nothing is in the way it gets there, over more than a turn.
    let mut world = one_at("XM430-W210", 2048.0);
    mode(&mut world, CURRENT_POSITION);
    torque_on(&mut world);
    goal(&mut world, -3000);
    wait(&mut world, 4000);
    assert!((shaft(&world).position_counts + 3000.0).abs() < 15.0);
}

#[test]
fn extended_position_mode_turns_past_a_turn_in_both_directions() {
    for model in dynamixels() {
        let mut world = one_at(&model.name, 100.0);
        mode(&mut world, EXTENDED);
        torque_on(&mut world);
        for counts in [9000, -5000] {
            goal(&mut world, counts);
            wait(&mut world, 8000);
            assert!((shaft(&world).position_counts - f64::from(counts)).abs() < 25.0, "{}", model.name);
            assert!((get(&world, 132, 4) - counts).abs() < 25);
        }
    }
}

/// The example of the e-manual, PWM Slope: at 5 V the factory's slope reaches full duty in 18.06 ms.
#[test]
fn the_xl330_ramps_its_duty() {
    let mut world = one_with("XL330-M288", 0.0, STUCK);
    mode(&mut world, PWM);
    world.advance_to(1_000 * MS);
    torque_on(&mut world);
    let per_ms = 140.0 * 1.977 / 5000.0 * 885.0;
    for ms in 1..=18 {
        world.advance_to((1_000 + ms) * MS);
        let pwm = f64::from(get(&world, 124, 2));
        assert!((pwm - per_ms * ms as f64).abs() <= 1.0, "{ms} ms: {pwm}");
    }
    world.advance_to(1_019 * MS);
    assert_eq!(get(&world, 124, 2), 885);
}

#[test]
fn torque_comes_with_a_goal_if_drive_mode_says_so() {
    for (drive_mode, torque) in [(0, false), (8, true)] {
        // Present Position and goals are of one turn, as ever at torque-on in position mode.
        let mut world = one_at("XM430-W210", 4096.0 + 1000.0);
        set(&mut world, 10, 1, drive_mode);
        goal(&mut world, 1500);
        wait(&mut world, 2000);
        assert_eq!((shaft(&world).torque_on, get(&world, 64, 1) == 1), (torque, torque));
        let there = (shaft(&world).position_counts - (4096.0 + 1500.0)).abs() < 15.0;
        assert_eq!(there, torque);
    }
    // In PWM mode the goal is another register.
    let mut world = one_at("XM430-W210", 0.0);
    set(&mut world, 10, 1, 8);
    mode(&mut world, PWM);
    goal(&mut world, 1500);
    assert!(!shaft(&world).torque_on);
    set(&mut world, 100, 2, 200);
    wait(&mut world, 200);
    assert!(shaft(&world).torque_on && shaft(&world).speed_rad_s > 0.5);
}

#[test]
fn homing_offset_shifts_the_count_and_past_a_quarter_turn_position_mode_ignores_it() {
    let mut world = one_at("XM430-W210", 300.0);
    for (drive_mode, actual) in [(0, 300), (1, 4096 - 300)] {
        set(&mut world, 10, 1, drive_mode);
        for (operating_mode, offset, counted) in
            [(3, 1024, 1024), (3, -1024, -1024), (3, 1025, 0), (4, 1025, 1025), (4, -5000, -5000)]
        {
            set(&mut world, 11, 1, operating_mode);
            set(&mut world, 20, 4, offset);
            // The sign of the offset does not change with the direction.
            assert_eq!(get(&world, 132, 4), actual + counted, "mode {operating_mode}, offset {offset}");
        }
        set(&mut world, 11, 1, 3);
    }
}
