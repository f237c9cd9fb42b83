//! Servos in a body, over the bus: servos under load, and their registers.
#![allow(clippy::unwrap_used, reason = "a test that fails should panic")]

mod common;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

use common::x_series::{CURRENT, mode, named, set, torque_on};
use common::*;
use hw_sim::body::{BodyConfig, Chain, Foot, Ground, JointMechanics, Link, Mass, Push, ShaftLink, Trunk};
use hw_sim::{FaultScript, World};

/// An arm of one link on a base, level at count 2048 and up from there; its weight at its tip.
fn arm(mass_kg: f64, length_m: f64) -> BodyConfig {
    let link = Link {
        axis: [0.0, -1.0, 0.0],
        end_m: [length_m, 0.0, 0.0],
        mass: Mass::rod(mass_kg, [length_m, 0.0, 0.0], [length_m, 0.0, 0.0], 0.005),
        radius_m: 0.005,
        stops_rad: (-3.0, 3.0),
        servo: ShaftLink { shaft: 0, zero_rad: PI, is_reversed: false, rotor_inertia_kg_m2: None },
    };
    let chain = Chain {
        root_m: [0.0; 3],
        root_rotation: [0.0, 0.0, 0.0, 1.0],
        carried_share: 0.0,
        links: vec![link],
        balls: Vec::new(),
        foot: None,
    };
    let trunk = Trunk {
        is_fixed: true,
        mass_kg: 1.0,
        center_m: [0.0; 3],
        box_middle_m: [0.0; 3],
        box_size_m: [0.1; 3],
    };
    BodyConfig {
        trunk,
        chains: vec![chain],
        ground: Ground::default(),
        joints: JointMechanics::default(),
        motor_steps: 1,
    }
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
fn a_loaded_joint_sags_by_torque_over_stiffness_and_reports_the_load() {
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
fn a_limp_arm_falls_and_its_register_shows_it() {
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
fn a_push_lasts_for_its_set_time() {
    let standing = || {
        let trunk = Trunk { is_fixed: false, ..arm(0.1, 0.1).trunk };
        let ground = Ground { friction: 0.0, ..Ground::default() };
        let body = BodyConfig {
            trunk,
            chains: Vec::new(),
            ground,
            joints: JointMechanics::default(),
            motor_steps: 1,
        };
        World::with_body(&[feetech_bus(Vec::new())], FaultScript::default(), 1, &body).unwrap()
    };
    let mut world = standing();
    world.advance_to(100 * MS);
    world.push(Push { force_n: [2.0, 0.0, 0.0], ..Push::default() }, 0.05);
    world.advance_to(300 * MS);
    let speed = world.body().unwrap().velocity_m_s[0];
    assert!((speed - 0.1).abs() < 0.002, "0.1 N s on 1 kg: {speed} m/s");
}

fn box_alone() -> BodyConfig {
    let trunk = Trunk { is_fixed: false, ..arm(0.1, 0.1).trunk };
    let ground = Ground { friction: 0.0, ..Ground::default() };
    BodyConfig { trunk, chains: Vec::new(), ground, joints: JointMechanics::default(), motor_steps: 1 }
}

fn scripted(text: &str, seed: u64, motor_steps: u32) -> World {
    let script = FaultScript::from_toml(text).unwrap();
    let body = BodyConfig { motor_steps, ..box_alone() };
    World::with_body(&[feetech_bus(Vec::new())], script, seed, &body).unwrap()
}

#[test]
fn a_scripted_push_gives_its_momentum_where_it_points() {
    for (strength, motor_steps) in
        [("impulse_n_s = 0.2", 1), ("force_n = 4\nfor_s = 0.05", 1), ("force_n = 2", 2)]
    {
        let text = format!("[[fault]]\nkind = 'push'\nat_s = 0.1\ndirection_deg = 90\n{strength}");
        let mut world = scripted(&text, 1, motor_steps);
        world.advance_to(99 * MS);
        assert!(world.body().unwrap().velocity_m_s[1].abs() < 1e-9, "not yet");
        world.advance_to(300 * MS);
        let velocity = world.body().unwrap().velocity_m_s;
        assert!(
            (velocity[1] - 0.2).abs() < 0.004 && velocity[0].abs() < 0.004,
            "0.2 N s on 1 kg: {velocity:?}"
        );
    }
}

#[test]
fn repeated_pushes_have_directions_that_depend_on_the_seed() {
    let text = "[[fault]]\nkind = 'push'\nat_s = 0\nevery_s = 0.5\nfor_s = 0.1\nimpulse_n_s = 0.1";
    // The change of velocity in each half second.
    let pushed = |seed| {
        let mut world = scripted(text, seed, 1);
        let mut before = [0.0; 2];
        let mut changes = Vec::new();
        for push in 1..=6 {
            world.advance_to(push * S / 2);
            let [x, y, _] = world.body().unwrap().velocity_m_s;
            changes.push([x - before[0], y - before[1]]);
            before = [x, y];
        }
        changes
    };
    let (one, again, other) = (pushed(1), pushed(1), pushed(2));
    assert_eq!(one, again);
    assert!(
        one.iter().zip(&other).all(|(a, b)| (a[0] - b[0]).hypot(a[1] - b[1]) > 1e-3),
        "{one:?} {other:?}"
    );
    for [x, y] in one {
        assert!((x.hypot(y) - 0.1).abs() < 0.003, "0.1 N s on 1 kg: {x} {y}");
    }
}

#[test]
fn a_script_can_set_the_ground() {
    // On this slope a box slides: its own ground has no friction, the script's has.
    let sliding = |text: &str| {
        let mut world = scripted(text, 1, 1);
        world.advance_to(S);
        world.body().unwrap().velocity_m_s[0]
    };
    let slid = sliding("[ground]\nslope_deg = 10");
    assert!((slid + 9.81 * 10_f64.to_radians().sin() * 10_f64.to_radians().cos()).abs() < 0.05, "{slid} m/s");
    assert!(sliding("[ground]\nslope_deg = 10\nfriction = 0.5").abs() < 2e-3);
    // A block ahead; the box comes down the slope against it.
    let text = "[ground]\nslope_deg = -10\n[[ground.step]]\nat_mm = 100\nlength_mm = 50\nheight_mm = 20";
    let mut world = scripted(text, 1, 1);
    world.advance_to(3 * S);
    let front = world.body().unwrap().position_m[0] + 0.05;
    assert!((front - 0.1).abs() < 0.012, "its front is at {front} m");
}

#[test]
fn mistakes_in_pushes_and_ground_are_reported_by_line() {
    for (text, said) in [
        (
            "[[fault]]\nkind = 'push'\nat_s = 0",
            "script:1: fault[0].impulse_n_s is not set: expected force times time",
        ),
        (
            "[[fault]]\nkind = 'push'\nat_s = 0\nforce_n = 1\nimpulse_n_s = 1",
            ":4: fault[0].force_n = 1: expected no such",
        ),
        (
            "[[fault]]\nkind = 'push'\nat_s = 0\nimpulse_n_s = 1\nplace_mm = [1, 2]",
            ":5: fault[0].place_mm = [1, 2]",
        ),
        (
            "[[fault]]\nkind = 'push'\nat_s = 0\nimpulse_n_s = 1\nbus = 'a'",
            ":5: fault[0].bus = 'a': expected no such key",
        ),
        ("[[fault]]\nkind = 'echo'\nat_s = 0\nevery_s = 1", ":4: fault[0].every_s = 1: expected no such key"),
        ("[ground]\nfriction = -1", ":2: ground.friction = -1: expected the friction of the ground, 0 to 5"),
        ("[ground]\ngrip = 1", ":2: ground.grip = 1: expected a known key; known are friction"),
        ("[ground]\n[[ground.step]]\nat_mm = 1\nlength_mm = 1", "ground.step[0].height_mm is not set"),
        ("ground = 3", ":1: ground = 3: expected another ground: write [ground]"),
    ] {
        let error = FaultScript::from_toml(text).unwrap_err().to_string();
        assert!(error.contains(said), "{text}: {error}");
    }
    let script = "[ground]\nfriction = 1\n[[fault]]\nkind = 'push'\nat_s = 0\nimpulse_n_s = 1";
    let error = FaultScript::from_toml(script).unwrap().without_body().unwrap_err().to_string();
    assert!(error.contains(":1: ground") && error.contains(":3: fault[0].kind = \"push\""), "{error}");
    assert!(error.contains("[physics]"), "{error}");
}

#[test]
fn a_box_on_a_flat_foot_stands_over_its_edge_or_falls() {
    // A post of 0.2 m on a plate 60 x 40 mm, its weight at its top `ahead` of the plate's middle.
    let fallen = |ahead: f64| {
        let link = Link {
            axis: [0.0, 1.0, 0.0],
            end_m: [0.0, 0.0, -0.2],
            mass: Mass::rod(0.1, [0.0, 0.0, -0.2], [0.0, 0.0, -0.2], 0.005),
            radius_m: 0.005,
            stops_rad: (-1.0, 1.0),
            servo: ShaftLink { shaft: 0, zero_rad: PI, is_reversed: false, rotor_inertia_kg_m2: None },
        };
        let foot = Foot::Plate { size_m: [0.06, 0.04, 0.005], middle_m: [0.0, 0.0, -0.0025] };
        let chain = Chain {
            root_m: [0.0; 3],
            root_rotation: [0.0, 0.0, 0.0, 1.0],
            carried_share: 0.0,
            links: vec![link],
            balls: Vec::new(),
            foot: Some(foot),
        };
        let trunk = Trunk {
            is_fixed: false,
            mass_kg: 1.0,
            center_m: [ahead, 0.0, 0.0],
            box_middle_m: [0.0; 3],
            box_size_m: [0.05; 3],
        };
        let body = BodyConfig {
            trunk,
            chains: vec![chain],
            ground: Ground::default(),
            joints: JointMechanics::default(),
            motor_steps: 1,
        };
        let mut world = world_with("STS3250", &body);
        exchange(&mut world, &feetech(1, 3, &[42, 0, 8]));
        exchange(&mut world, &feetech(1, 3, &[40, 1]));
        world.advance_to(world.now_ns() + 2 * S);
        let state = world.body().unwrap();
        assert!(state.is_fallen() || (state.feet[0].force_n - 1.1 * 9.81).abs() < 0.3, "{state:?}");
        state.is_fallen()
    };
    // 1 kg of 1.1 kg is `ahead`: the edge is 30 mm ahead of the middle.
    assert!(!fallen(0.028) && !fallen(-0.028));
    assert!(fallen(0.045) && fallen(-0.045));
}

#[test]
fn a_goal_current_gives_its_torque_to_the_body() {
    // A weightless arm: torque less gear friction over the inertia of rod and rotor.
    let mut body = arm(0.1, 0.1);
    body.chains[0].carried_share = 1.0;
    let model = named("XM430-W350");
    for share in [0.2, -0.1] {
        let mut world = world_with(&model.name, &body);
        mode(&mut world, CURRENT);
        #[expect(clippy::cast_possible_truncation, reason = "some hundred units")]
        let units = (share * model.stall_current_a / 0.002_69).round() as i32;
        set(&mut world, 102, 2, units);
        torque_on(&mut world);
        let speed = |world: &mut World, ms: u64| {
            world.advance_to(world.now_ns() + ms * MS);
            world.shaft_at(0, 0).unwrap().speed_rad_s
        };
        let begin = speed(&mut world, 5);
        let gained = speed(&mut world, 10) - begin;
        let torque = f64::from(units) * 0.002_69 / model.stall_current_a * model.stall_torque_nm;
        let rod = 0.1 * (0.1 * 0.1 * (1.0 + 1.0 / 12.0) + 0.005 * 0.005 / 4.0);
        let inertia = rod + model.reflected_inertia_kg_m2;
        let expected = 0.01 * (torque - torque.signum() * model.friction_nm) / inertia;
        assert!((gained - expected).abs() < 0.03 * expected.abs(), "{share}: {gained}, not {expected} rad/s");
    }
}
