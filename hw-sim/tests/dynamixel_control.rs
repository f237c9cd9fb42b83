//! Gains, limits and protection of Dynamixel servos. Facts: ROBOTIS e-manual, X-series.
#![allow(clippy::unwrap_used, reason = "helpers of tests; a failed one should panic")]
#![allow(clippy::cast_possible_truncation, reason = "counts and PWM units are small")]

mod common;
use common::x_series::*;
use common::*;
use hw_sim::World;

#[test]
fn a_change_of_mode_resets_gains_profile_and_limits() {
    let mut world = one_at("XL330-M288", 0.0);
    for (address, value) in [(76, 1), (78, 2), (80, 3), (82, 4), (84, 5), (88, 6), (90, 7)] {
        set(&mut world, address, 2, value);
    }
    set(&mut world, 108, 4, 8);
    set(&mut world, 112, 4, 9);
    set(&mut world, 100, 2, 10);
    set(&mut world, 102, 2, 11);
    // The same mode once more is no change.
    mode(&mut world, 3);
    assert_eq!(get(&world, 84, 2), 5);
    mode(&mut world, CURRENT_POSITION);
    let gains = [76, 78, 80, 82, 84, 88, 90].map(|address| get(&world, address, 2));
    assert_eq!(gains, [1600, 180, 0, 0, 400, 0, 0]);
    assert_eq!((get(&world, 108, 4), get(&world, 112, 4)), (0, 0));
    assert_eq!((get(&world, 100, 2), get(&world, 102, 2)), (885, 1750));
}

#[test]
fn the_integral_gain_removes_the_error_that_friction_leaves() {
    let error = |integral: i32| {
        let mut world = one_at("XM430-W210", 1000.0);
        set(&mut world, 84, 2, 100);
        set(&mut world, 82, 2, integral);
        torque_on(&mut world);
        goal(&mut world, 1400);
        wait(&mut world, 6000);
        (shaft(&world).position_counts - 1400.0).abs()
    };
    assert!(error(0) > 5.0, "{}", error(0));
    assert!(error(300) < 3.0, "{}", error(300));
}

#[test]
fn feedforward_of_the_back_emf_removes_the_lag() {
    let model = named("XM430-W210");
    let lag = |feedforward: i32| {
        let mut world = one_at(&model.name, 500.0);
        set(&mut world, 90, 2, feedforward);
        torque_on(&mut world);
        set(&mut world, 112, 4, 100);
        goal(&mut world, 3500);
        wait(&mut world, 1000);
        trajectory(&world).0 - shaft(&world).position_counts
    };
    // Duty in PWM units for each count in a millisecond, without load.
    let counts_per_ms = model.no_load_speed_rad_s * 4096.0 / std::f64::consts::TAU / 1000.0;
    let right = (4.0 * 885.0 / counts_per_ms) as i32;
    assert!(lag(0) > 20.0, "{}", lag(0));
    assert!(lag(right).abs() < lag(0) / 5.0, "{} of {}", lag(right), lag(0));
}

#[test]
fn the_derivative_gain_damps() {
    // Speed with which the shaft comes through its goal after a step, gains so high that it overshoots.
    let overshoot = |derivative: i32| {
        let mut world = one_at("XM430-W350", 1000.0);
        set(&mut world, 84, 2, 6000);
        set(&mut world, 80, 2, derivative);
        torque_on(&mut world);
        goal(&mut world, 2000);
        let mut highest = 0.0f64;
        for _ in 0..1500 {
            wait(&mut world, 1);
            highest = highest.max(shaft(&world).position_counts - 2000.0);
        }
        highest
    };
    assert!(overshoot(0) > 5.0, "{}", overshoot(0));
    assert!(overshoot(8000) < overshoot(0) / 3.0, "{} of {}", overshoot(8000), overshoot(0));
}

#[test]
fn a_motor_that_pushes_in_vain_shuts_down_and_one_that_turns_does_not() {
    for model in dynamixels() {
        let mut world = one_with(&model.name, 2048.0, STUCK);
        torque_on(&mut world);
        goal(&mut world, 4000);
        wait(&mut world, 1000);
        assert!(shaft(&world).torque_on, "{}", model.name);
        wait(&mut world, 5000);
        assert!(!shaft(&world).torque_on, "{}", model.name);
        assert_eq!((get(&world, 70, 1), get(&world, 64, 1)), (32, 0), "{}", model.name);
    }
    // With the bit cleared in Shutdown it is only reported.
    let mut world = one_with("XM430-W210", 2048.0, STUCK);
    set(&mut world, 63, 1, 4);
    torque_on(&mut world);
    goal(&mut world, 4000);
    wait(&mut world, 6000);
    assert!(shaft(&world).torque_on);
    assert_eq!(get(&world, 70, 1), 32);
    assert_eq!(exchange(&mut world, &dynamixel(1, &[1]))[8], 0x80, "alert");
    // At full duty, but turning.
    let mut world = one_at("XM430-W210", 0.0);
    mode(&mut world, PWM);
    torque_on(&mut world);
    wait(&mut world, 6000);
    assert!(shaft(&world).torque_on);
    // Blocked, but with no torque allowed.
    let mut world = one_with("XM430-W210", 2048.0, STUCK);
    set(&mut world, 100, 2, 0);
    torque_on(&mut world);
    goal(&mut world, 4000);
    wait(&mut world, 6000);
    assert_eq!((shaft(&world).torque_on, get(&world, 70, 1)), (true, 0));
}

#[test]
fn the_moving_register_follows_the_speed_threshold() {
    let mut world = one_at("XM430-W210", 0.0);
    mode(&mut world, VELOCITY);
    set(&mut world, 24, 4, 50);
    torque_on(&mut world);
    for (velocity, moving) in [(40, 0), (60, 1), (-60, 1), (-40, 0)] {
        set(&mut world, 104, 4, velocity);
        wait(&mut world, 3000);
        assert_eq!(get(&world, 122, 1), moving, "{velocity}");
    }
}

/// The example of the e-manual, Bus Watchdog.
#[test]
fn the_bus_watchdog_stops_a_turning_shaft_until_it_is_cleared_and_a_goal_comes() {
    let mut world = one_at("XM430-W210", 0.0);
    mode(&mut world, VELOCITY);
    torque_on(&mut world);
    set(&mut world, 104, 4, 50);
    set(&mut world, 98, 1, 100);
    wait(&mut world, 1990);
    let speed = |world: &World| shaft(world).speed_rad_s / VELOCITY_UNIT_RAD_S;
    assert!((speed(&world) - 50.0).abs() < 1.0);
    wait(&mut world, 500);
    assert!(speed(&world).abs() < 1.0, "{}", speed(&world));
    assert_eq!(get(&world, 98, 1), -1);
    assert_eq!(dynamixel_write(&mut world, 1, 104, &150i32.to_le_bytes())[8], 4);
    set(&mut world, 98, 1, 0);
    wait(&mut world, 500);
    assert!(speed(&world).abs() < 1.0, "cleared, it stays");
    assert_eq!(dynamixel_write(&mut world, 1, 104, &150i32.to_le_bytes())[8], 0);
    wait(&mut world, 2000);
    assert!((speed(&world) - 150.0).abs() < 1.0);
}
