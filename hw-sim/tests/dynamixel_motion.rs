//! How Dynamixel servos move: profiles, modes, gains, limits, protection. Facts: ROBOTIS e-manual, X-series.
#![allow(clippy::unwrap_used, reason = "helpers of tests; a failed one should panic")]
#![allow(clippy::cast_possible_truncation, reason = "counts and PWM units are small")]

mod common;
use common::*;
use hw_sim::{BusConfig, MODELS, Model, Protocol, Shaft, World};

const CURRENT: u8 = 0;
const VELOCITY: u8 = 1;
const EXTENDED: u8 = 4;
const CURRENT_POSITION: u8 = 5;
const PWM: u8 = 16;

/// 0.229 rpm, count/s.
const VELOCITY_UNIT: f64 = 0.229 / 60.0 * 4096.0;
/// 214.577 rev/min², count/s².
const ACCELERATION_UNIT: f64 = 214.577 / 3600.0 * 4096.0;

const STUCK: &str = "[[fault]]\nat_s = 0\nkind = 'stuck'";

fn dynamixels() -> impl Iterator<Item = &'static Model> {
    MODELS.iter().filter(|model| model.protocol == Protocol::Dynamixel)
}

fn with_current() -> impl Iterator<Item = (&'static Model, f64)> {
    // Unit of Goal Current, A.
    let unit = |model: &Model| if model.name.starts_with("XL330") { 0.001 } else { 0.002_69 };
    dynamixels().filter(|model| !model.name.starts_with("XL430")).map(move |model| (model, unit(model)))
}

fn named(name: &str) -> &'static Model {
    MODELS.iter().find(|model| model.name == name).unwrap()
}

fn bus_of(model: &Model, position_counts: f64) -> BusConfig {
    let servo = hw_sim::ServoConfig { position_counts, ..servo(model.name, 1) };
    BusConfig { supply_v: model.nominal_voltage_v, ..dynamixel_bus(vec![servo]) }
}

fn servo_at(model: &str, position_counts: f64) -> World {
    world(bus_of(named(model), position_counts))
}

/// Writes, and waits 0.3 ms: the write takes effect when the request of 16 bytes at most has crossed, and the answer
/// has 11.
fn set(world: &mut World, address: u8, size: usize, value: i32) {
    world.host_send(0, &dynamixel(1, &[&[3, address, 0], &value.to_le_bytes()[..size]].concat())).unwrap();
    world.advance_to(world.now_ns() + 3 * MS / 10);
    received(world, 0);
}

fn mode(world: &mut World, mode: u8) {
    set(world, 11, 1, mode.into());
}

fn torque_on(world: &mut World) {
    set(world, 64, 1, 1);
}

fn goal(world: &mut World, counts: i32) {
    set(world, 116, 4, counts);
}

/// A register, with its sign.
fn get(world: &World, address: u16, size: u16) -> i32 {
    let bytes = (0..size).map(|n| u32::from(world.register(0, 1, address + n).unwrap()) << (8 * n));
    let shift = 32 - 8 * u32::from(size);
    (bytes.sum::<u32>() << shift).cast_signed() >> shift
}

fn shaft(world: &World) -> Shaft {
    world.shaft(0, 1).unwrap()
}

fn wait(world: &mut World, ms: u64) {
    world.advance_to(world.now_ns() + ms * MS);
}

fn trajectory(world: &World) -> (f64, f64) {
    (get(world, 140, 4).into(), get(world, 136, 4).into())
}

fn moving_status(world: &World) -> i32 {
    get(world, 123, 1)
}

/// When a goal of 4 bytes that has just been set took effect, s: 14 of the 30 bytes' times it took to set it ago.
fn goal_s(world: &World) -> f64 {
    world.now_ns() as f64 * 1e-9 - 0.000_14
}

/// Time of what the registers hold: they are written every whole millisecond.
fn registers_s(world: &World) -> f64 {
    (world.now_ns() / MS) as f64 * 1e-3
}

/// Asserts for `ms` that the trajectory registers follow `expected`, s since `start_s` to (counts, units of velocity).
fn follows(world: &mut World, start_s: f64, ms: u64, expected: impl Fn(f64) -> (f64, f64)) {
    for _ in 0..ms {
        wait(world, 1);
        let at_s = registers_s(world) - start_s;
        let (position, velocity) = trajectory(world);
        let (p, v) = expected(at_s);
        let is_near = (position - p).abs() <= 0.51 && (velocity - v).abs() <= 0.51;
        assert!(is_near, "{at_s} s: {position} {velocity}, not {p} {v}");
    }
}

/// A trapezoid from rest: distance counts, cruise count/s, ramp s; counts and count/s at `t`.
fn trapezoid(distance: f64, cruise: f64, ramp: f64, t: f64) -> (f64, f64) {
    let total = distance / cruise + ramp;
    let a = cruise / ramp;
    if t <= 0.0 {
        (0.0, 0.0)
    } else if t < ramp {
        (a * t * t / 2.0, a * t)
    } else if t < total - ramp {
        (cruise * (t - ramp / 2.0), cruise)
    } else if t < total {
        (distance - a * (total - t).powi(2) / 2.0, a * (total - t))
    } else {
        (distance, 0.0)
    }
}

#[test]
fn a_trapezoid_is_as_fast_and_as_steep_as_the_profile_registers_say() {
    for model in dynamixels() {
        let mut world = world(bus_of(model, 1000.0));
        torque_on(&mut world);
        // The manual: the ramp takes 64 V / A milliseconds.
        let (velocity, acceleration) = (100, 50);
        set(&mut world, 112, 4, velocity);
        set(&mut world, 108, 4, acceleration);
        goal(&mut world, 3000);
        let cruise = f64::from(velocity) * VELOCITY_UNIT;
        let ramp = cruise / (f64::from(acceleration) * ACCELERATION_UNIT);
        assert!((ramp / (64.0 * 100.0 / 50.0 * 1e-3) - 1.0).abs() < 0.001);
        let start_s = goal_s(&world);
        let expected = |t| {
            let (p, v) = trapezoid(2000.0, cruise, ramp, t);
            (1000.0 + p, v / VELOCITY_UNIT)
        };
        follows(&mut world, start_s, 700, expected);
        assert_eq!(moving_status(&world) & 0x32, 0x32, "{}: trapezoid, under way", model.name);
        assert_eq!(get(&world, 122, 1), 1);
        // The shaft keeps up: it lags by no more than its gains let it, and arrives with the trajectory.
        let behind = trajectory(&world).0 - shaft(&world).position_counts;
        assert!(behind > 0.0 && behind < 300.0, "{}: {behind}", model.name);
        follows(&mut world, start_s, 900, expected);
        assert_eq!(trajectory(&world), (3000.0, 0.0));
        wait(&mut world, 1000);
        assert_eq!(moving_status(&world) & 0x0B, 1, "{}: arrived, following, no more under way", model.name);
        assert_eq!(get(&world, 122, 1), 0);
        assert!((shaft(&world).position_counts - 3000.0).abs() < 20.0);
    }
}

#[test]
fn the_four_kinds_of_profile_by_the_registers() {
    let model = "XM430-W210";
    // Velocity, acceleration, distance, the kind in Moving Status.
    for (velocity, acceleration, distance, kind) in
        [(0, 0, 1000, 0), (0, 50, 1000, 0), (100, 0, 1000, 1), (100, 50, 100, 2), (100, 50, 1000, 3)]
    {
        let mut world = servo_at(model, 1000.0);
        torque_on(&mut world);
        set(&mut world, 112, 4, velocity);
        set(&mut world, 108, 4, acceleration);
        goal(&mut world, 1000 + distance);
        wait(&mut world, 1);
        assert_eq!(moving_status(&world) >> 4 & 3, kind, "{velocity} {acceleration} {distance}");
        match kind {
            0 => assert_eq!(trajectory(&world), (f64::from(1000 + distance), 0.0)),
            1 => assert!((trajectory(&world).1 - 100.0).abs() < 1.0),
            2 => {
                // The highest velocity is that of a triangle over the distance: the root of a d.
                let peak = (50.0 * ACCELERATION_UNIT * 100.0).sqrt();
                let mut highest = 0.0f64;
                for _ in 0..250 {
                    wait(&mut world, 1);
                    highest = highest.max(trajectory(&world).1 * VELOCITY_UNIT);
                }
                assert!((highest / peak - 1.0).abs() < 0.02, "{highest} {peak}");
                assert_eq!(trajectory(&world), (1100.0, 0.0));
            }
            _ => {}
        }
    }
}

#[test]
fn a_time_based_profile_takes_the_time_it_is_given() {
    // Total and ramp, ms, distance; the ramp takes half the total at most.
    for (total, ramp, counted_ramp) in [(1000, 300, 0.3), (1000, 900, 0.5), (400, 0, 0.0)] {
        for distance in [1500, -700] {
            let mut world = servo_at("XM430-W210", 2048.0);
            set(&mut world, 10, 1, 4);
            torque_on(&mut world);
            set(&mut world, 112, 4, total);
            set(&mut world, 108, 4, ramp);
            goal(&mut world, 2048 + distance);
            let cruise = f64::from(distance) / (f64::from(total) * 1e-3 - counted_ramp);
            let sign = f64::from(distance.signum());
            let start_s = goal_s(&world);
            follows(&mut world, start_s, total.unsigned_abs().into(), |t| {
                let (p, v) = trapezoid(sign * f64::from(distance), sign * cruise, counted_ramp.max(1e-9), t);
                (2048.0 + sign * p, sign * v / VELOCITY_UNIT)
            });
            wait(&mut world, 1);
            assert_eq!(trajectory(&world), (f64::from(2048 + distance), 0.0));
            assert_eq!(moving_status(&world) & 2, 0);
        }
    }
}

#[test]
fn a_goal_given_under_way_bends_the_trajectory_and_never_breaks_it() {
    let mut world = servo_at("XM430-W210", 500.0);
    torque_on(&mut world);
    set(&mut world, 112, 4, 150);
    set(&mut world, 108, 4, 30);
    let mut last = (500.0, 0.0);
    for (step, counts) in [3500, 600, 3000, 3000, 700, 2000].into_iter().enumerate() {
        goal(&mut world, counts);
        // Long enough at the end to arrive.
        for _ in 0..if step == 5 { 3000 } else { 170 + 90 * step } {
            wait(&mut world, 1);
            let now = trajectory(&world);
            // In a millisecond, and one more for the goal between two: the acceleration's share, and rounding.
            let most = 30.0 * ACCELERATION_UNIT / VELOCITY_UNIT * 0.002 + 1.0;
            assert!((now.1 - last.1).abs() <= most, "velocity leaps from {} to {}", last.1, now.1);
            assert!((now.0 - last.0).abs() <= 150.0 * VELOCITY_UNIT * 0.002 + 1.0);
            assert!(now.1.abs() <= 150.0);
            last = now;
        }
    }
    assert_eq!(last, (2000.0, 0.0));
    assert!((shaft(&world).position_counts - 2000.0).abs() < 15.0);
}

#[test]
fn velocity_mode_ramps_to_its_goal_and_keeps_it() {
    for model in dynamixels() {
        for reverse in [0, 1] {
            let mut world = world(bus_of(model, 0.0));
            set(&mut world, 10, 1, reverse);
            mode(&mut world, VELOCITY);
            torque_on(&mut world);
            wait(&mut world, 100);
            assert!(shaft(&world).speed_rad_s.abs() < 1e-9, "torque alone starts nothing");
            set(&mut world, 108, 4, 20);
            set(&mut world, 104, 4, 100);
            // 64 V / A: 320 ms.
            let start_s = goal_s(&world);
            for _ in 0..400 {
                wait(&mut world, 1);
                let at_s = registers_s(&world) - start_s;
                let velocity = f64::from(get(&world, 136, 4));
                let expected = (at_s / 0.32).min(1.0) * 100.0;
                assert!((velocity - expected).abs() < 0.6, "{at_s} s: {velocity}, not {expected}");
            }
            wait(&mut world, 3000);
            let forward = if reverse == 0 { 1.0 } else { -1.0 };
            let speed =
                |world: &World| forward * shaft(world).speed_rad_s / (0.229 * std::f64::consts::TAU / 60.0);
            assert!((speed(&world) - 100.0).abs() < 1.0, "{}: {}", model.name, speed(&world));
            assert!((get(&world, 128, 4) - 100).abs() <= 1, "{}", model.name);
            set(&mut world, 104, 4, -60);
            wait(&mut world, 4000);
            assert!((speed(&world) + 60.0).abs() < 1.0, "{}: {}", model.name, speed(&world));
            set(&mut world, 104, 4, 0);
            wait(&mut world, 4000);
            assert!(speed(&world).abs() < 0.5, "{}: {}", model.name, speed(&world));
        }
    }
}

#[test]
fn in_current_mode_a_blocked_shaft_feels_the_current_times_the_torque_constant() {
    for (model, unit) in with_current() {
        for (drive_mode, share) in [(0, 0.5), (0, -0.3), (1, 0.4)] {
            let mut world = world_with_faults(bus_of(model, 0.0), STUCK);
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
    let mut world = world(bus_of(model, 0.0));
    mode(&mut world, CURRENT);
    set(&mut world, 102, 2, 100);
    torque_on(&mut world);
    let wanted = 100.0 * 0.002_69 * model.stall_torque_nm / model.stall_current_a;
    // Through its backlash.
    wait(&mut world, 10);
    let mut last_speed = 0.0;
    for _ in 0..15 {
        wait(&mut world, 2);
        let now = shaft(&world);
        assert!((now.torque_nm - wanted).abs() < 1e-9, "{now:?}");
        assert!(now.speed_rad_s > last_speed);
        last_speed = now.speed_rad_s;
    }
}

#[test]
fn current_based_position_mode_pushes_no_harder_than_its_goal_current() {
    for (model, unit) in with_current() {
        let mut world = world_with_faults(bus_of(model, 2048.0), STUCK);
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
    let mut world = servo_at("XM430-W210", 2048.0);
    mode(&mut world, CURRENT_POSITION);
    torque_on(&mut world);
    goal(&mut world, -3000);
    wait(&mut world, 4000);
    assert!((shaft(&world).position_counts + 3000.0).abs() < 15.0);
}

#[test]
fn extended_position_mode_turns_past_a_turn_in_both_directions() {
    for model in dynamixels() {
        let mut world = world(bus_of(model, 100.0));
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
    let mut world = world_with_faults(bus_of(named("XL330-M288"), 0.0), STUCK);
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
        let mut world = servo_at("XM430-W210", 4096.0 + 1000.0);
        set(&mut world, 10, 1, drive_mode);
        goal(&mut world, 1500);
        wait(&mut world, 2000);
        assert_eq!((shaft(&world).torque_on, get(&world, 64, 1) == 1), (torque, torque));
        let there = (shaft(&world).position_counts - (4096.0 + 1500.0)).abs() < 15.0;
        assert_eq!(there, torque);
    }
    // In PWM mode the goal is another register.
    let mut world = servo_at("XM430-W210", 0.0);
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
    let mut world = servo_at("XM430-W210", 300.0);
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

#[test]
fn a_change_of_mode_resets_gains_profile_and_limits() {
    let mut world = servo_at("XL330-M288", 0.0);
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
fn the_integral_gain_takes_away_what_friction_leaves() {
    let error = |integral: i32| {
        let mut world = servo_at("XM430-W210", 1000.0);
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
fn feedforward_of_the_back_emf_takes_the_lag_away() {
    let model = named("XM430-W210");
    let lag = |feedforward: i32| {
        let mut world = world(bus_of(model, 500.0));
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
        let mut world = servo_at("XM430-W350", 1000.0);
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
        let mut world = world_with_faults(bus_of(model, 2048.0), STUCK);
        torque_on(&mut world);
        goal(&mut world, 4000);
        wait(&mut world, 1000);
        assert!(shaft(&world).torque_on, "{}", model.name);
        wait(&mut world, 5000);
        assert!(!shaft(&world).torque_on, "{}", model.name);
        assert_eq!((get(&world, 70, 1), get(&world, 64, 1)), (32, 0), "{}", model.name);
    }
    // With the bit out of Shutdown it is only told.
    let mut world = world_with_faults(bus_of(named("XM430-W210"), 2048.0), STUCK);
    set(&mut world, 63, 1, 4);
    torque_on(&mut world);
    goal(&mut world, 4000);
    wait(&mut world, 6000);
    assert!(shaft(&world).torque_on);
    assert_eq!(get(&world, 70, 1), 32);
    assert_eq!(exchange(&mut world, &dynamixel(1, &[1]))[8], 0x80, "alert");
    // At full duty, but turning.
    let mut world = servo_at("XM430-W210", 0.0);
    mode(&mut world, PWM);
    torque_on(&mut world);
    wait(&mut world, 6000);
    assert!(shaft(&world).torque_on);
    // Blocked, but with no torque allowed.
    let mut world = world_with_faults(bus_of(named("XM430-W210"), 2048.0), STUCK);
    set(&mut world, 100, 2, 0);
    torque_on(&mut world);
    goal(&mut world, 4000);
    wait(&mut world, 6000);
    assert_eq!((shaft(&world).torque_on, get(&world, 70, 1)), (true, 0));
}

#[test]
fn moving_is_what_is_faster_than_the_threshold() {
    let mut world = servo_at("XM430-W210", 0.0);
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
fn the_bus_watchdog_stops_a_turning_shaft_until_it_is_cleared_and_told_anew() {
    let mut world = servo_at("XM430-W210", 0.0);
    mode(&mut world, VELOCITY);
    torque_on(&mut world);
    set(&mut world, 104, 4, 50);
    set(&mut world, 98, 1, 100);
    wait(&mut world, 1990);
    let speed = |world: &World| shaft(world).speed_rad_s / (0.229 * std::f64::consts::TAU / 60.0);
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
