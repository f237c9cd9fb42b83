//! How Dynamixel servos move to their goals. Facts: ROBOTIS e-manual, X-series, "What is the Profile".
#![allow(clippy::unwrap_used, reason = "helpers of tests; a failed one should panic")]
#![allow(clippy::cast_precision_loss, reason = "times are short")]

mod common;
use common::x_series::*;
use common::*;
use hw_sim::World;

/// 214.577 rev/min², count/s².
const ACCELERATION_UNIT: f64 = 214.577 / 3600.0 * 4096.0;

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
        let mut world = one_at(&model.name, 1000.0);
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
        let mut world = one_at(model, 1000.0);
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
            let mut world = one_at("XM430-W210", 2048.0);
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
fn a_new_goal_during_a_move_keeps_the_trajectory_continuous() {
    let mut world = one_at("XM430-W210", 500.0);
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
            let mut world = one_at(&model.name, 0.0);
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
            let speed = |world: &World| forward * shaft(world).speed_rad_s / VELOCITY_UNIT_RAD_S;
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
