//! Servos in a body, over the bus: what carries a load, and what its registers say of it.
#![allow(clippy::unwrap_used, reason = "a test that fails should panic")]

mod common;
use std::f64::consts::{FRAC_PI_2, TAU};

use common::*;
use hw_sim::body::{BodyConfig, Chain, Ground, Link, Push, ShaftLink, Trunk};
use hw_sim::{FaultScript, World};

/// An arm of one link on a base, level at count 2048 and up from there; its weight at its tip.
fn arm(mass_kg: f64, length_m: f64) -> BodyConfig {
    let link = Link {
        axis: [0.0, -1.0, 0.0],
        end_m: [length_m, 0.0, 0.0],
        mass_kg,
        center_m: [length_m, 0.0, 0.0],
        radius_m: 0.005,
        stops_rad: (-3.0, 3.0),
        servo: ShaftLink { shaft: 0, zero_counts: 2048.0, is_reversed: false, rotor_inertia_kg_m2: None },
    };
    let chain = Chain {
        root_m: [0.0; 3],
        root_rotation: [0.0, 0.0, 0.0, 1.0],
        carried_share: 0.0,
        links: vec![link],
        foot: None,
    };
    let trunk = Trunk {
        is_fixed: true,
        mass_kg: 1.0,
        center_m: [0.0; 3],
        box_middle_m: [0.0; 3],
        box_size_m: [0.1; 3],
    };
    BodyConfig { trunk, chains: vec![chain], ground: Ground::default(), motor_steps: 1 }
}

fn world_with(model: &str, body: &BodyConfig) -> World {
    let mut bus = feetech_bus(vec![servo(model, 1)]);
    if model.starts_with('X') {
        bus = dynamixel_bus(bus.servos);
    }
    World::with_body(&[bus], FaultScript::default(), 1, body).unwrap()
}

fn angle(world: &World) -> f64 {
    (world.shaft_at(0, 0).unwrap().position_counts - 2048.0) * TAU / 4096.0
}

#[test]
fn sixty_degrees_take_a_servo_what_its_maker_says() {
    // Feetech, ST-3215-C018 at 12 V: 0.222 s for 60 degrees, at full speed; from rest it takes a little longer.
    let mut world = world_with("STS3215-12V", &arm(0.02, 0.05));
    exchange(&mut world, &feetech(1, 3, &[42, 0, 8])); // goal 2048
    exchange(&mut world, &feetech(1, 3, &[40, 1]));
    let (from, begin_ns) = (angle(&world), world.now_ns());
    world.host_send(0, &feetech(1, 3, &[42, 0, 12])).unwrap(); // goal 3072: a quarter turn further
    while angle(&world) - from < TAU / 6.0 {
        world.advance_to(world.now_ns() + MS);
        assert!(world.now_ns() - begin_ns < S, "it never gets there: {}", angle(&world));
    }
    let took_ms = (world.now_ns() - begin_ns) / MS;
    assert!((222..330).contains(&took_ms), "{took_ms} ms");
    // And it settles without ringing.
    let mut most: f64 = 0.0;
    for _ in 0..1000 {
        world.advance_to(world.now_ns() + MS);
        most = most.max(angle(&world));
    }
    assert!(most < FRAC_PI_2 * 1.05, "{most} rad");
    assert!((angle(&world) - FRAC_PI_2).abs() < 0.03, "{} rad", angle(&world));
}

#[test]
fn a_load_sags_by_torque_over_stiffness_and_is_read_as_load() {
    let mut world = world_with("STS3215-12V", &arm(0.5, 0.15));
    exchange(&mut world, &feetech(1, 3, &[42, 0, 8]));
    exchange(&mut world, &feetech(1, 3, &[40, 1]));
    world.advance_to(world.now_ns() + 2 * S);
    // 15 N m/rad; friction of 0.06 N m may hold it a little off, and the dead band and a count.
    let torque = 0.5 * 9.81 * 0.15;
    let (sag, slack) = (-angle(&world), (0.06 + 0.05) / 15.0);
    assert!((sag - torque / 15.0).abs() < slack, "{sag} rad under {torque} N m");
    // Present load, 0.1 % of stall torque, sign in bit 10: upwards is positive.
    let reply = exchange(&mut world, &feetech(1, 2, &[60, 2]));
    let load = f64::from(u16::from_le_bytes([reply[5], reply[6]]));
    assert!((load / 1000.0 * 2.94 - torque).abs() < 0.15, "{load}");
}

#[test]
fn a_limp_arm_falls_and_its_register_sees_it() {
    let mut world = world_with("STS3215-12V", &arm(0.5, 0.15));
    // Gear friction takes 0.16 rad of each swing of 0.7 s.
    world.advance_to(10 * S);
    assert!((angle(&world) + FRAC_PI_2).abs() < 0.15, "it hangs: {} rad", angle(&world));
    let reply = exchange(&mut world, &feetech(1, 2, &[56, 2]));
    let counts = f64::from(u16::from_le_bytes([reply[5], reply[6]]));
    assert!((counts - 1024.0).abs() < 0.15 * 4096.0 / TAU, "{counts}");
    assert!(world.body().unwrap().feet.is_empty());
}

#[test]
fn a_push_lasts_as_long_as_it_is_told() {
    let standing = || {
        let trunk = Trunk { is_fixed: false, ..arm(0.1, 0.1).trunk };
        let ground = Ground { friction: 0.0, ..Ground::default() };
        let body = BodyConfig { trunk, chains: Vec::new(), ground, motor_steps: 1 };
        World::with_body(&[feetech_bus(Vec::new())], FaultScript::default(), 1, &body).unwrap()
    };
    let mut world = standing();
    world.advance_to(100 * MS);
    world.push(Push { force_n: [2.0, 0.0, 0.0], ..Push::default() }, 0.05);
    world.advance_to(300 * MS);
    let speed = world.body().unwrap().velocity_m_s[0];
    assert!((speed - 0.1).abs() < 0.002, "0.1 N s on 1 kg: {speed} m/s");
}
