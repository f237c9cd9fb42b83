//! The rigid body against mechanics: pendulums, weight, friction, momentum, energy.
#![allow(clippy::unwrap_used, reason = "a test that fails should panic")]

use std::f64::consts::{FRAC_PI_2, TAU};

use hw_sim::body::{
    BallStop, Body, BodyConfig, Chain, Foot, Ground, JointMechanics, Link, Mass, Push, PushFrame, RigidBody,
    ShaftLink, ShaftState, Step, Trunk,
};

const G: f64 = 9.81;
const DT: f64 = 1e-3;

/// A box of 2 kg, 0.3 x 0.2 x 0.1 m, its frame in its middle.
fn trunk() -> Trunk {
    Trunk {
        is_fixed: false,
        mass_kg: 2.0,
        center_m: [0.0; 3],
        box_middle_m: [0.0; 3],
        box_size_m: [0.3, 0.2, 0.1],
    }
}

fn alone(ground: Ground) -> BodyConfig {
    BodyConfig {
        trunk: trunk(),
        chains: Vec::new(),
        ground,
        joints: JointMechanics::default(),
        motor_steps: 1,
    }
}

/// A link of 0.1 kg and 0.2 m that hangs down at angle 0 and turns about y.
fn link(shaft: usize) -> Link {
    Link {
        axis: [0.0, 1.0, 0.0],
        end_m: [0.0, 0.0, -0.2],
        mass: Mass::rod(0.1, [0.0, 0.0, -0.1], [0.0, 0.0, -0.2], 0.008),
        radius_m: 0.008,
        stops_rad: (-10.0, 10.0),
        servo: ShaftLink { shaft, zero_rad: 0.0, is_reversed: false, rotor_inertia_kg_m2: None },
    }
}

fn chain(root_m: [f64; 3], links: Vec<Link>, foot: Option<Foot>) -> Chain {
    Chain { root_m, root_rotation: [0.0, 0.0, 0.0, 1.0], carried_share: 0.0, links, balls: Vec::new(), foot }
}

/// Links in a row on a base in the air.
fn arm(joints: usize) -> BodyConfig {
    let arm = chain([0.0; 3], (0..joints).map(link).collect(), None);
    BodyConfig {
        trunk: Trunk { is_fixed: true, ..trunk() },
        chains: vec![arm],
        ground: Ground::default(),
        joints: JointMechanics::default(),
        motor_steps: 1,
    }
}

/// Four straight legs with round feet.
fn table(ground: Ground) -> BodyConfig {
    let foot = Foot::Round { radius_m: 0.01, width_m: 0.03 };
    let leg = |(shaft, (x, y))| chain([x, y, 0.0], vec![link(shaft)], Some(foot));
    let roots = [(-0.1, 0.08), (0.1, 0.08), (-0.1, -0.08), (0.1, -0.08)];
    BodyConfig {
        trunk: trunk(),
        chains: roots.into_iter().enumerate().map(leg).collect(),
        ground,
        joints: JointMechanics::default(),
        motor_steps: 1,
    }
}

fn shaft(inertia_kg_m2: f64, friction_nm: f64) -> ShaftState {
    ShaftState::at_rest(inertia_kg_m2, friction_nm)
}

/// Locks all shafts, as a strong servo would.
fn stiff(count: usize) -> Vec<ShaftState> {
    vec![ShaftState { is_stuck: true, ..shaft(0.027, 0.0) }; count]
}

fn run(body: &mut RigidBody, shafts: &mut [ShaftState], seconds: f64) {
    let torques = vec![0.0; shafts.len()];
    let mut time = 0.0;
    while time < seconds {
        body.step(DT, shafts, &torques);
        time += DT;
    }
}

fn speed(body: &RigidBody) -> f64 {
    body.state().unwrap().velocity_m_s.iter().map(|v| v * v).sum::<f64>().sqrt()
}

fn near(value: f64, expected: f64, tolerance: f64) {
    assert!((value - expected).abs() <= tolerance, "{value} is not {expected} within {tolerance}");
}

#[test]
fn a_limp_arm_swings_with_its_pendulums_period() {
    for armature in [0.0, 0.027] {
        let mut shafts = vec![ShaftState { position_rad: 0.05, ..shaft(armature, 0.0) }];
        let mut body = RigidBody::new(&arm(1), &shafts).unwrap();
        // Times at which it passes the lowest point, falling.
        let mut crossings = Vec::new();
        for step in 1..8000 {
            let before = shafts[0].position_rad;
            body.step(DT, &mut shafts, &[0.0]);
            let after = shafts[0].position_rad;
            if before > 0.0 && after <= 0.0 {
                crossings.push(f64::from(step) * DT - DT * after / (after - before));
            }
        }
        let periods = f64::from(u32::try_from(crossings.len() - 1).unwrap());
        let period = (crossings.last().unwrap() - crossings[0]) / periods;
        // Physical pendulum; the rod's own inertia is m (L^2 / 12 + r^2 / 4) about its middle.
        let own = 0.1 * (0.2 * 0.2 / 12.0 + 0.008 * 0.008 / 4.0);
        let inertia = own + 0.1 * 0.1 * 0.1 + armature;
        near(period, TAU * (inertia / (0.1 * G * 0.1)).sqrt(), 0.003 * period);
    }
}

#[test]
fn energy_of_a_swinging_arm_does_not_grow() {
    let mut shafts = vec![ShaftState { position_rad: 1.0, ..shaft(0.001, 0.0) }; 3];
    let mut body = RigidBody::new(&arm(3), &shafts).unwrap();
    run(&mut body, &mut shafts, DT);
    let begin = body.energy_j();
    // Links turned by 1, 2 and 3 rad from hanging: heights of their middles.
    let down = [1.0_f64, 2.0, 3.0].map(f64::cos);
    let sum = -(0.1 * down[0] + 0.2 * down[0] + 0.1 * down[1] + 0.2 * (down[0] + down[1]) + 0.1 * down[2]);
    near(begin, 0.1 * G * sum, 1e-3);
    let lowest = -0.1 * G * (0.1 + 0.3 + 0.5);
    let mut most = begin;
    for _ in 0..10 {
        run(&mut body, &mut shafts, 0.5);
        most = most.max(body.energy_j());
    }
    let room = begin - lowest;
    assert!(most - begin < 0.01 * room, "{begin} J grew to {most} J, of {room} J");
    assert!(
        body.energy_j() > begin - 0.1 * room,
        "the joints have no friction: {begin} J, {} J",
        body.energy_j()
    );
    let mut shafts = vec![ShaftState { position_rad: 1.0, ..shaft(0.001, 0.05) }; 3];
    let mut body = RigidBody::new(&arm(3), &shafts).unwrap();
    run(&mut body, &mut shafts, DT);
    let mut before = body.energy_j();
    for _ in 0..8000 {
        body.step(DT, &mut shafts, &[0.0; 3]);
        let now = body.energy_j();
        assert!(now < before + 1e-3 * room, "friction gave energy: {before} J, {now} J");
        before = now;
    }
    let fastest = shafts.iter().map(|shaft| shaft.speed_rad_s.abs()).fold(0.0, f64::max);
    assert!(fastest < 0.01, "it has come to rest, but for {fastest} rad/s");
}

/// The torque of a joint on its link is that of its motor less that of its rotor's acceleration.
#[test]
fn impulses_through_joints_are_the_motors_and_the_rotors() {
    // Held straight out by just the torque of its weight.
    let hold_nm = 0.1 * G * 0.1;
    let mut shafts = vec![ShaftState { position_rad: FRAC_PI_2, ..shaft(0.027, 0.0) }];
    let mut body = RigidBody::new(&arm(1), &shafts).unwrap();
    (0..100).for_each(|_| body.step(DT, &mut shafts, &[hold_nm]));
    let held = body.state().unwrap().joint_impulses_nms[0];
    near(shafts[0].speed_rad_s, 0.0, 1e-3);
    near(held, hold_nm * 0.1, 1e-5);
    // Let go, only its rotor holds it back.
    let mut shafts = vec![ShaftState { position_rad: FRAC_PI_2, ..shaft(0.027, 0.0) }];
    let mut body = RigidBody::new(&arm(1), &shafts).unwrap();
    run(&mut body, &mut shafts, 0.1);
    assert!(shafts[0].speed_rad_s.abs() > 0.1);
    near(body.state().unwrap().joint_impulses_nms[0], -0.027 * shafts[0].speed_rad_s, 1e-9);
}

#[test]
fn the_grounds_impulse_on_a_trunk_at_rest_is_weight_times_time() {
    let mut body = RigidBody::new(&alone(Ground::default()), &[]).unwrap();
    run(&mut body, &mut [], 0.5);
    let before = body.state().unwrap().trunk_impulse_ns;
    run(&mut body, &mut [], 1.0);
    let gain = body.state().unwrap().trunk_impulse_ns - before;
    near(gain, 2.0 * G, 0.01 * 2.0 * G);
}

#[test]
fn the_ground_carries_the_weight() {
    let mut body = RigidBody::new(&alone(Ground::default()), &[]).unwrap();
    run(&mut body, &mut [], 0.5);
    let state = body.state().unwrap();
    near(state.trunk_contact_n, 2.0 * G, 0.01 * 2.0 * G);
    near(state.position_m[2], 0.05, 5e-4);
    near(state.specific_force_m_s2[2], G, 0.02);
    assert!(state.is_fallen());

    let mut shafts = stiff(4);
    let mut body = RigidBody::new(&table(Ground::default()), &shafts).unwrap();
    run(&mut body, &mut shafts, 1.0);
    let state = body.state().unwrap();
    let total: f64 = state.feet.iter().map(|foot| foot.force_n).sum();
    near(total, 2.4 * G, 0.01 * 2.4 * G);
    state.feet.iter().for_each(|foot| near(foot.force_n, 0.6 * G, 0.05 * 2.4 * G));
    near(state.position_m[2], 0.21, 1e-3);
    near(state.trunk_contact_n + state.links_contact_n, 0.0, 0.0);
    assert!(!state.is_fallen());
}

#[test]
fn friction_has_the_set_coefficient() {
    for friction in [0.2_f64, 0.5, 0.8] {
        let on = |slope_rad| Ground { friction, slope_rad, ..Ground::default() };
        let mut body = RigidBody::new(&alone(on(0.9 * friction.atan())), &[]).unwrap();
        run(&mut body, &mut [], 1.0);
        assert!(speed(&body) < 2e-3, "friction {friction}: it creeps at {} m/s", speed(&body));
        let slope = 1.2 * friction.atan();
        let mut body = RigidBody::new(&alone(on(slope)), &[]).unwrap();
        run(&mut body, &mut [], 0.2);
        let before = speed(&body);
        run(&mut body, &mut [], 0.2);
        let gained = (speed(&body) - before) / 0.2;
        near(gained, G * (slope.sin() - friction * slope.cos()), 0.03 * G * slope.sin());
        // Uphill is forward: it slides back.
        assert!(body.state().unwrap().velocity_m_s[0] < 0.0);
        // Sliding over the level.
        let mut body = RigidBody::new(&alone(on(0.0)), &[]).unwrap();
        run(&mut body, &mut [], 0.1);
        body.set_trunk_velocity([0.0, 1.0, 0.0]);
        run(&mut body, &mut [], 0.1);
        near(1.0 - speed(&body), 0.1 * friction * G, 0.05 * 0.1 * friction * G + 0.005);
    }
}

#[test]
fn a_push_gives_its_momentum_where_it_points() {
    let ground = Ground { friction: 0.0, ..Ground::default() };
    let push = |frame, force_n| Push { force_n, frame, place_m: [0.0; 3] };
    for (frame, force_n) in [(PushFrame::World, [4.0, 0.0, 0.0]), (PushFrame::Trunk, [0.0, -4.0, 0.0])] {
        let mut shafts = stiff(4);
        let mut body = RigidBody::new(&table(ground.clone()), &shafts).unwrap();
        run(&mut body, &mut shafts, 0.2);
        for _ in 0..50 {
            body.push(&push(frame, force_n));
            body.step(DT, &mut shafts, &[0.0; 4]);
        }
        run(&mut body, &mut shafts, 0.3);
        // 0.2 N s; the centre of mass of trunk and legs may turn a little about the trunk's middle.
        let velocity = body.state().unwrap().velocity_m_s;
        for axis in 0..2 {
            near(velocity[axis], force_n[axis] * 0.05 / 2.4, 0.006);
        }
    }
}

#[test]
fn a_body_in_the_air_falls_freely() {
    let mut shafts = stiff(4);
    let mut body = RigidBody::new(&table(Ground::default()), &shafts).unwrap();
    let begin = body.state().unwrap().position_m[2];
    near(begin, 0.21, 1e-9);
    body.set_trunk_velocity([0.5, 0.0, 2.0]);
    run(&mut body, &mut shafts, 0.3);
    let state = body.state().unwrap();
    near(state.position_m[2] - begin, 2.0 * 0.3 - 0.5 * G * 0.09, 5e-3);
    near(state.position_m[0], 0.15, 3e-3);
    assert!(state.specific_force_m_s2.iter().all(|force| force.abs() < 0.05), "{state:?}");
    assert!(state.feet.iter().all(|foot| foot.force_n <= 0.0));
}

#[test]
fn an_accelerometer_on_a_slope_feels_where_down_is() {
    let slope_rad = 0.2;
    for (uphill_rad, axis) in [(0.0, 0), (FRAC_PI_2, 1)] {
        let ground = Ground { slope_rad, uphill_rad, ..Ground::default() };
        let mut body = RigidBody::new(&alone(ground), &[]).unwrap();
        run(&mut body, &mut [], 0.5);
        let state = body.state().unwrap();
        near(state.specific_force_m_s2[axis], G * slope_rad.sin(), 0.03);
        near(state.specific_force_m_s2[2], G * slope_rad.cos(), 0.03);
        let (roll, pitch, _) = state.roll_pitch_yaw();
        // Uphill ahead the nose is up: pitch is negative. Uphill to the left rolls it to the right.
        let expected = if axis == 0 { (0.0, -slope_rad) } else { (slope_rad, 0.0) };
        near(roll, expected.0, 0.01);
        near(pitch, expected.1, 0.01);
    }
}

#[test]
fn a_block_stops_what_slides_into_it() {
    let step = Step { at_m: 0.25, length_m: 0.5, height_m: 0.02 };
    let ground = Ground { friction: 0.0, steps: vec![step], ..Ground::default() };
    let mut shafts = stiff(4);
    let mut body = RigidBody::new(&table(ground), &shafts).unwrap();
    body.set_trunk_velocity([0.3, 0.0, 0.0]);
    run(&mut body, &mut shafts, 1.5);
    let front = body.state().unwrap().feet[1].position_m[0];
    assert!(front < 0.245, "a foot of radius 10 mm went to {front} m");
}

#[test]
fn motors_turn_joints_and_stops_hold_them() {
    // Weightless: a carried arm. Torque over inertia is the acceleration; a reversed servo goes the other way.
    let mut config = arm(1);
    config.chains[0].carried_share = 1.0;
    config.chains[0].links[0].stops_rad = (-0.5, 0.5);
    config.chains[0].links[0].servo.is_reversed = true;
    let mut shafts = vec![shaft(0.027, 0.0)];
    let mut body = RigidBody::new(&config, &shafts).unwrap();
    for _ in 0..100 {
        body.step(DT, &mut shafts, &[0.1]);
    }
    let inertia = 0.1 * (0.2 * 0.2 / 3.0 + 0.008 * 0.008 / 4.0) + 0.027;
    near(shafts[0].speed_rad_s, 0.1 * 0.1 / inertia, 0.01 * 0.1 * 0.1 / inertia);
    assert!(shafts[0].position_rad > 0.0, "torque and angle are the shaft's own");
    for _ in 0..3000 {
        body.step(DT, &mut shafts, &[1.0]);
    }
    assert!((0.5..0.55).contains(&shafts[0].position_rad), "{}", shafts[0].position_rad);
    near(shafts[0].speed_rad_s, 0.0, 0.01);
    // A hand turns it: the body takes it from there.
    shafts[0].position_rad = 0.1;
    shafts[0].is_stuck = true;
    shafts[0].speed_rad_s = 0.0;
    for _ in 0..200 {
        body.step(DT, &mut shafts, &[1.0]);
    }
    near(shafts[0].position_rad, 0.1, 0.01);
}

#[test]
fn gear_friction_brakes_and_sticks() {
    let mut config = arm(1);
    config.chains[0].carried_share = 1.0;
    let inertia = 0.1 * (0.2 * 0.2 / 3.0 + 0.008 * 0.008 / 4.0) + 0.027;
    let mut shafts = vec![shaft(0.027, 0.04)];
    let mut body = RigidBody::new(&config, &shafts).unwrap();
    let mut turn = |steps: u32, torque: f64| {
        (0..steps).for_each(|_| body.step(DT, &mut shafts, &[torque]));
        shafts[0]
    };
    let stuck = turn(200, 0.03);
    near(stuck.speed_rad_s, 0.0, 1e-3);
    near(stuck.position_rad, 0.0, 1e-3);
    let pushed = turn(100, 0.1);
    near(pushed.speed_rad_s, 0.1 * 0.06 / inertia, 0.02 * 0.1 * 0.06 / inertia);
    let braked = turn(100, 0.0);
    near(pushed.speed_rad_s - braked.speed_rad_s, 0.1 * 0.04 / inertia, 0.02 * 0.1 * 0.04 / inertia);
    near(turn(200, 0.0).speed_rad_s, 0.0, 1e-6);
}

#[test]
fn equal_bodies_move_equally_bit_for_bit() {
    let end = || {
        let mut shafts = vec![ShaftState { position_rad: 0.3, ..shaft(0.01, 0.02) }; 4];
        let mut body = RigidBody::new(&table(Ground::default()), &shafts).unwrap();
        run(&mut body, &mut shafts, 1.0);
        let state = body.state().unwrap();
        (state.position_m.map(f64::to_bits), state.rotation.map(f64::to_bits))
    };
    assert_eq!(end(), end());
}

#[test]
fn a_number_that_is_not_finite_stops_the_body_without_a_panic() {
    let mut shafts = stiff(4);
    let mut body = RigidBody::new(&table(Ground::default()), &shafts).unwrap();
    body.push(&Push { force_n: [f64::NAN; 3], ..Push::default() });
    run(&mut body, &mut shafts, 0.1);
    assert!(!body.state().unwrap().is_finite);
    assert!(body.state().unwrap().position_m.iter().all(|place| place.is_finite()));
    assert!(shafts.iter().all(|shaft| shaft.position_rad.is_finite()));
}

#[test]
fn an_impossible_body_is_refused_by_name() {
    let error = |config: &BodyConfig| RigidBody::new(config, &stiff(4)).unwrap_err().to_string();
    let mut light = table(Ground::default());
    light.trunk.mass_kg = 0.0;
    assert_eq!(error(&light), "body: mass of the trunk 0: expected a number above 0");
    let mut slippery = table(Ground::default());
    slippery.ground.friction = -0.1;
    assert_eq!(error(&slippery), "body: friction -0.1: expected a number, 0 or more");
    let mut loose = table(Ground::default());
    loose.chains[2].links[0].servo.shaft = 9;
    assert_eq!(error(&loose), "body: servo 9 of link 0 of chain 2: expected one of the buses' servos");
}

/// A ball joint of three hinges on a base in the air, without weight: a rod of 0.1 kg and 0.1 m along x.
fn shoulder(joints: JointMechanics) -> BodyConfig {
    let hinge = |shaft: usize, axis: [f64; 3], end_m: [f64; 3], mass_kg: f64| Link {
        axis,
        end_m,
        mass: Mass::rod(mass_kg, [0.5 * end_m[0], 0.0, 0.0], end_m, 0.008),
        radius_m: 0.008,
        stops_rad: (-10.0, 10.0),
        servo: ShaftLink { shaft, zero_rad: 0.0, is_reversed: false, rotor_inertia_kg_m2: None },
    };
    let links = vec![
        hinge(0, [0.0, -1.0, 0.0], [0.0; 3], 0.01),
        hinge(1, [0.0, 0.0, 1.0], [0.0; 3], 0.01),
        hinge(2, [1.0, 0.0, 0.0], [0.1, 0.0, 0.0], 0.1),
    ];
    // 40 degrees to every side; twists by 0.5 rad.
    let sine = 20_f64.to_radians().sin();
    let corners = [(sine, sine), (-sine, sine), (-sine, -sine), (sine, -sine)];
    let corners = corners.map(|(y, z)| ([y, z], (-0.5, 0.5))).to_vec();
    let balls = vec![BallStop { last: 2, hinges: 3, corners }];
    let chain = Chain { carried_share: 1.0, balls, ..chain([0.0; 3], links, None) };
    BodyConfig {
        trunk: Trunk { is_fixed: true, ..trunk() },
        chains: vec![chain],
        ground: Ground::default(),
        joints,
        motor_steps: 1,
    }
}

#[test]
fn a_joint_driven_past_its_ball_joints_range_comes_back_with_at_most_one_overshoot() {
    // As config/figure.toml has them.
    let joints = JointMechanics { viscosity_nm_s: 0.01, stop: (60.0, 0.5) };
    // Lift, sweep, twist, and a bit of all.
    for way in [[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.6, -0.5, 0.3]] {
        let mut shafts = vec![shaft(0.003, 0.0); 3];
        let mut body = RigidBody::new(&shoulder(joints), &shafts).unwrap();
        let angles = |shafts: &[ShaftState]| [0, 1, 2].map(|shaft| shafts[shaft].position_rad);
        // A motor at its stall torque for 0.3 s, against the stop.
        for _ in 0..300 {
            body.step(DT, &mut shafts, &way.map(|share| 1.4 * share));
        }
        let driven = beyond(angles(&shafts));
        let (swing, twist) = driven;
        assert!(swing > 0.005 || twist > 0.01, "{way:?}: driven out by {driven:?} only");
        // Motion, and what the springs of the stops hold: a swing counts as twice its length.
        let energy = |body: &RigidBody, (swing, twist): (f64, f64)| {
            body.energy_j() + 0.5 * 60.0 * (4.0 * swing * swing + twist * twist)
        };
        let begin = energy(&body, driven);
        // Of swing and of twist.
        let (mut before, mut crossings, mut was_out) = (begin, [0, 0], [true, true]);
        for step in 0..4000 {
            body.step(DT, &mut shafts, &[0.0; 3]);
            let past = beyond(angles(&shafts));
            let now = energy(&body, past);
            assert!(now <= before + 5e-3 * begin, "{way:?}: {before} J grew to {now} J at {step} ms");
            before = before.min(now);
            let is_out = [past.0 > 1e-3, past.1 > 2e-3];
            for ((count, is_out), was_out) in crossings.iter_mut().zip(is_out).zip(was_out) {
                *count += u32::from(is_out && !was_out);
            }
            was_out = is_out;
        }
        assert!(
            crossings.iter().all(|count| *count <= 1),
            "{way:?}: past the range {crossings:?} times more"
        );
        assert!(
            was_out == [false; 2] && before < 0.01 * begin,
            "{way:?}: still out, or moving with {before} of {begin} J"
        );
    }
}

/// How far lift, sweep and twist take a joint past swings of 40 degrees to every side, and past twists of 0.5 rad.
fn beyond([lift, sweep, twist]: [f64; 3]) -> (f64, f64) {
    // The turn about -y, then z, then x, as a quaternion (w, x, y, z).
    let product = |a: [f64; 4], b: [f64; 4]| {
        [
            a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
            a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
            a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
            a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
        ]
    };
    let half = |angle: f64| ((0.5 * angle).cos(), (0.5 * angle).sin());
    let ((a, b), (c, d), (e, f)) = (half(lift), half(sweep), half(twist));
    let [w, x, y, z] = product(product([a, 0.0, -b, 0.0], [c, 0.0, 0.0, d]), [e, f, 0.0, 0.0]);
    // Without its twist, which comes first.
    let length = w.hypot(x);
    let (y, z) = ((y * w - z * x) / length, (z * w + y * x) / length);
    let edge = 20_f64.to_radians().sin();
    let out = (y.abs() - edge).max(0.0).hypot((z.abs() - edge).max(0.0));
    (out, ((2.0 * x.atan2(w)).abs() - 0.5).max(0.0))
}

#[test]
fn viscosity_reduces_speed_at_its_rate() {
    let joints = JointMechanics { viscosity_nm_s: 0.01, ..JointMechanics::default() };
    let config = BodyConfig { joints, ..arm(1) };
    let config =
        BodyConfig { chains: vec![Chain { carried_share: 1.0, ..config.chains[0].clone() }], ..config };
    let mut shafts = vec![shaft(0.02, 0.0)];
    let mut body = RigidBody::new(&config, &shafts).unwrap();
    for _ in 0..100 {
        body.step(DT, &mut shafts, &[0.5]);
    }
    let begin = shafts[0].speed_rad_s;
    run(&mut body, &mut shafts, 1.0);
    // The rod's own inertia about its end, m (L^2 / 3 + r^2 / 4), and the rotor's.
    let inertia = 0.1 * (0.2 * 0.2 / 3.0 + 0.008 * 0.008 / 4.0) + 0.02;
    let expected = begin * f64::exp(-0.01 * 1.0 / inertia);
    near(shafts[0].speed_rad_s, expected, 0.01 * begin);
}
