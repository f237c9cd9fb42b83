//! The inertial measurement unit: its output, the timing of it, and its commands. The decoder here is written from
//! the manual (WitMotion WT901 datasheet v20-0702, section 5).
#![allow(clippy::unwrap_used, clippy::cast_precision_loss, reason = "a test may panic")]

use hw_sim::body::{BodyConfig, Ground, JointMechanics, Push, Trunk};
use hw_sim::{FaultScript, ImuConfig, World};

const MS: u64 = 1_000_000;

fn world(config: &ImuConfig, faults: &str) -> World {
    let mut world = World::new(&[], FaultScript::from_toml(faults).unwrap(), 1).unwrap();
    world.fit_imu(config, 1).unwrap();
    world
}

fn received(world: &mut World) -> Vec<u8> {
    let mut bytes = vec![0; 5_000];
    let count = world.imu_receive(&mut bytes).unwrap();
    bytes.truncate(count);
    bytes
}

/// What comes in the time to come, ms.
fn received_in(world: &mut World, ms: u64) -> Vec<u8> {
    let mut bytes = Vec::new();
    for _ in 0..ms / 100 {
        world.advance_to(world.now_ns() + 100 * MS);
        bytes.extend(received(world));
    }
    bytes
}

/// Kind and numbers of every frame.
fn frames(bytes: &[u8]) -> Vec<(u8, [f64; 4])> {
    let (mut at, mut found) = (0, Vec::new());
    while let Some(frame) = bytes.get(at..at + 11) {
        let sum = frame[..10].iter().fold(0, |sum: u8, byte| sum.wrapping_add(*byte));
        if frame[0] != 0x55 || sum != frame[10] {
            at += 1;
            continue;
        }
        let number = |place: usize| f64::from(i16::from_le_bytes([frame[place], frame[place + 1]]));
        found.push((frame[1], [number(2), number(4), number(6), number(8)]));
        at += 11;
    }
    found
}

/// The numbers of all frames of a kind, `full` for 32768.
fn all_of(bytes: &[u8], kind: u8, full: f64) -> Vec<[f64; 3]> {
    let of_kind = frames(bytes).into_iter().filter(|(of, _)| *of == kind);
    of_kind.map(|(_, [x, y, z, _])| [x, y, z].map(|number| number * full / 32768.0)).collect()
}

fn tell(world: &mut World, register: u8, value: u16) {
    let [low, high] = value.to_le_bytes();
    world.imu_send(&[0xFF, 0xAA, register, low, high]).unwrap();
    world.advance_to(world.now_ns() + 10 * MS);
}

#[test]
fn a_level_unit_at_rest_measures_one_g_and_every_byte_takes_its_wire_time() {
    let mut world = world(&ImuConfig::perfect(), "");
    // The first output begins at 5 ms; 33 bytes of 10 bits take 2.865 ms at 115200 bit/s.
    world.advance_to(7_864_000);
    assert_eq!(received(&mut world).len(), 32);
    world.advance_to(7_866_000);
    assert_eq!(received(&mut world).len(), 1);
    world.advance_to(100 * MS - 1);
    received(&mut world);
    // 200 a second.
    assert_eq!(received_in(&mut world, 1_000).len(), 33 * 200);
    let bytes = received_in(&mut world, 100);
    let kinds: Vec<u8> = frames(&bytes).iter().take(4).map(|(kind, _)| *kind).collect();
    assert!(
        kinds.starts_with(&[0x52, 0x53, 0x51, 0x52]) || kinds.starts_with(&[0x51, 0x52, 0x53, 0x51]),
        "{kinds:x?}"
    );
    for [x, y, z] in all_of(&bytes, 0x51, 16.0) {
        assert!(x.abs() < 1e-9 && y.abs() < 1e-9 && (z - 9.81 / 9.80665).abs() < 5e-4, "{x} {y} {z} g");
    }
    assert!(all_of(&bytes, 0x53, 180.0).iter().flatten().all(|angle| angle.abs() < 1e-9));
}

#[test]
fn errors_have_the_configured_size_and_come_from_the_seed() {
    let config = ImuConfig {
        acceleration_noise_m_s2: 0.05,
        rate_noise_rad_s: 0.01,
        rate_bias_rad_s: 0.02,
        angle_noise_rad: 0.002,
        ..ImuConfig::perfect()
    };
    let bytes_of = |seed| {
        let mut world = World::new(&[], FaultScript::default(), 1).unwrap();
        world.fit_imu(&config, seed).unwrap();
        received_in(&mut world, 20_000)
    };
    let bytes = bytes_of(7);
    let spread = |kind, full: f64| {
        let values: Vec<f64> = all_of(&bytes, kind, full).iter().map(|[x, ..]| *x).collect();
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        let square: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
        (mean, (square / values.len() as f64).sqrt())
    };
    let (_, acceleration) = spread(0x51, 16.0 * 9.80665);
    assert!((acceleration / 0.05 - 1.0).abs() < 0.1, "{acceleration} m/s^2");
    let (bias, rate) = spread(0x52, 2000_f64.to_radians());
    assert!((rate / 0.01 - 1.0).abs() < 0.1 && (1e-4..0.08).contains(&bias.abs()), "{bias} {rate} rad/s");
    assert!((spread(0x53, std::f64::consts::PI).1 / 0.002 - 1.0).abs() < 0.1);
    assert_eq!(bytes, bytes_of(7), "one seed, the same bytes");
    assert_ne!(bytes, bytes_of(8));
}

#[test]
fn a_unit_obeys_commands_while_unlocked_and_keeps_saved_settings() {
    let mut world = world(&ImuConfig::perfect(), "");
    let per_second = |world: &mut World| {
        world.advance_to(world.now_ns() + 20 * MS);
        received(world);
        all_of(&received_in(world, 1_000), 0x53, 180.0).len()
    };
    tell(&mut world, 0x03, 0x08);
    assert_eq!(per_second(&mut world), 200, "it is locked");
    tell(&mut world, 0x69, 0xB588);
    tell(&mut world, 0x03, 0x08);
    assert_eq!(per_second(&mut world), 50);
    world.restart_imu();
    assert_eq!(per_second(&mut world), 200, "it was not saved");
    tell(&mut world, 0x69, 0xB588);
    tell(&mut world, 0x03, 0x09);
    tell(&mut world, 0x00, 0x0000);
    world.restart_imu();
    assert_eq!(per_second(&mut world), 100);
    // Registers: rate, baud, and the two behind.
    received(&mut world);
    tell(&mut world, 0x27, 0x03);
    let told: Vec<_> = frames(&received(&mut world)).into_iter().filter(|(kind, _)| *kind == 0x5F).collect();
    assert_eq!(told, [(0x5F, [9.0, 6.0, 0.0, 0.0])]);
    // Ten seconds later it is locked again.
    world.advance_to(world.now_ns() + 11_000 * MS);
    tell(&mut world, 0x03, 0x08);
    received(&mut world);
    assert_eq!(per_second(&mut world), 100);
    // Which frames.
    tell(&mut world, 0x69, 0xB588);
    tell(&mut world, 0x02, 0x08);
    received(&mut world);
    world.advance_to(world.now_ns() + 100 * MS);
    assert!(frames(&received(&mut world)).iter().skip(3).all(|(kind, _)| *kind == 0x53));
}

#[test]
fn at_another_line_rate_neither_side_understands_the_other() {
    let mut world = world(&ImuConfig::perfect(), "");
    world.reset_imu_to_factory();
    world.advance_to(world.now_ns() + 1_000 * MS);
    let at_wrong_rate = received(&mut world);
    assert!(!at_wrong_rate.is_empty() && frames(&at_wrong_rate).len() < 2);
    world.set_imu_host_baud(9_600);
    world.advance_to(world.now_ns() + 200 * MS);
    received(&mut world);
    world.advance_to(world.now_ns() + 1_000 * MS);
    assert_eq!(
        all_of(&received(&mut world), 0x53, 180.0).len(),
        10,
        "10 Hz at 9600, as it leaves the factory"
    );
    tell(&mut world, 0x69, 0xB588);
    tell(&mut world, 0x04, 0x06);
    world.set_imu_host_baud(115_200);
    world.advance_to(world.now_ns() + 200 * MS);
    received(&mut world);
    world.advance_to(world.now_ns() + 1_000 * MS);
    assert_eq!(all_of(&received(&mut world), 0x53, 180.0).len(), 10);
    // 200 outputs a second do not fit through 9600 bit/s: 29 do.
    tell(&mut world, 0x03, 0x0B);
    tell(&mut world, 0x04, 0x02);
    world.set_imu_host_baud(9_600);
    world.advance_to(world.now_ns() + 500 * MS);
    received(&mut world);
    world.advance_to(world.now_ns() + 1_000 * MS);
    let count = all_of(&received(&mut world), 0x53, 180.0).len();
    assert!((28..=30).contains(&count), "{count}");
}

#[test]
fn scripted_faults_affect_the_unit() {
    let script = "
        [[fault]]
        kind = 'imu-silent'
        at_s = 1.0
        for_s = 0.5
        [[fault]]
        kind = 'imu-frozen'
        at_s = 2.0
        for_s = 0.5
        [[fault]]
        kind = 'imu-garbled'
        at_s = 3.0
        for_s = 0.5
        [[fault]]
        kind = 'imu-unplugged'
        at_s = 4.0
        for_s = 0.5
    ";
    let config = ImuConfig { acceleration_noise_m_s2: 0.05, ..ImuConfig::perfect() };
    let mut world = world(&config, script);
    let mut between = |from_ms: u64, to_ms: u64| {
        world.advance_to(from_ms * MS);
        let mut bytes = vec![0; 10_000];
        let _ = world.imu_receive(&mut bytes);
        world.advance_to(to_ms * MS);
        world.imu_receive(&mut bytes).map(|count| {
            bytes.truncate(count);
            let all: Vec<_> = all_of(&bytes, 0x51, 16.0);
            let mut different = all.clone();
            different.dedup();
            (all.len(), different.len())
        })
    };
    let (all, different) = between(500, 900).unwrap();
    assert!(all >= 79 && different > 70, "{all} {different}");
    assert_eq!(between(1010, 1490).unwrap().0, 0);
    let (all, different) = between(2010, 2490).unwrap();
    assert!(all >= 94 && different == 1, "{all} {different}");
    assert!(between(3010, 3490).unwrap().0 <= 3);
    assert!(between(4010, 4490).is_err());
    assert!(between(4600, 4900).unwrap().0 >= 58);
}

#[test]
fn faults_of_the_unit_take_neither_bus_nor_id() {
    let error = FaultScript::from_toml("[[fault]]\nat_s = 0\nkind = 'imu-frozen'\nbus = 'a'").unwrap_err();
    assert!(error.to_string().contains("kind \"imu-frozen\" has none; leave it out"), "{error}");
}

#[test]
fn numbers_that_no_unit_has_are_refused() {
    let mut world = World::new(&[], FaultScript::default(), 1).unwrap();
    let perfect = ImuConfig::perfect;
    for (config, said) in [
        (ImuConfig { rate_hz: 150.0, ..perfect() }, "rate_hz is 150; expected one of 1, 2, 5"),
        (ImuConfig { baud: 100, ..perfect() }, "baud is 100; expected one of 4800, 9600"),
        (ImuConfig { delay_s: -0.1, ..perfect() }, "delay_s is -0.1; expected 0 to 1 s"),
        (ImuConfig { rotation: [0.0; 4], ..perfect() }, "rotation is 0; expected a quaternion of length 1"),
        (ImuConfig { angle_noise_rad: f64::NAN, ..perfect() }, "angle_noise_rad is NaN; expected 0 to 1000"),
    ] {
        let error = world.fit_imu(&config, 1).unwrap_err().to_string();
        assert!(error.contains(said), "{error}");
    }
    assert!(!world.has_imu());
}

/// A box of 2 kg on the ground.
fn on_ground(ground: Ground, config: &ImuConfig) -> World {
    let trunk = Trunk {
        is_fixed: false,
        mass_kg: 2.0,
        center_m: [0.0; 3],
        box_middle_m: [0.0; 3],
        box_size_m: [0.3, 0.2, 0.1],
    };
    let body =
        BodyConfig { trunk, chains: Vec::new(), ground, joints: JointMechanics::default(), motor_steps: 1 };
    let mut world = World::with_body(&[], FaultScript::default(), 1, &body).unwrap();
    world.fit_imu(config, 1).unwrap();
    world
}

/// Flat, its y axis forward: turned by -90 degrees about z.
const Y_FORWARD: [f64; 4] = [0.0, 0.0, -std::f64::consts::FRAC_1_SQRT_2, std::f64::consts::FRAC_1_SQRT_2];

#[test]
fn on_a_slope_a_unit_measures_gravity_in_its_own_axes() {
    let slope_rad = 10_f64.to_radians();
    let ground = Ground { slope_rad, ..Ground::default() };
    let last = |rotation| {
        let mut world = on_ground(ground.clone(), &ImuConfig { rotation, ..ImuConfig::perfect() });
        world.advance_to(2_000 * MS);
        let bytes = received(&mut world);
        (*all_of(&bytes, 0x51, 16.0).last().unwrap(), *all_of(&bytes, 0x53, 180.0).last().unwrap())
    };
    let (sin, cos) = (slope_rad.sin() * 9.81 / 9.80665, slope_rad.cos() * 9.81 / 9.80665);
    let near = |a: [f64; 3], b: [f64; 3]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 0.02);
    // Uphill is forward: the nose is up, which is a negative pitch, and gravity pulls backwards.
    let (force, angles) = last([0.0, 0.0, 0.0, 1.0]);
    assert!(near(force, [sin, 0.0, cos]) && near(angles, [0.0, -10.0, 0.0]), "{force:?} {angles:?}");
    // The unit's y is forward, its x to the right: the nose-up turn is one about its x.
    let (force, angles) = last(Y_FORWARD);
    assert!(near(force, [0.0, sin, cos]) && near(angles, [10.0, 0.0, -90.0]), "{force:?} {angles:?}");
}

#[test]
fn a_unit_reports_the_state_of_one_delay_ago() {
    let config = ImuConfig { delay_s: 0.02, rotation: Y_FORWARD, ..ImuConfig::perfect() };
    let mut world = on_ground(Ground { friction: 0.0, ..Ground::default() }, &config);
    world.advance_to(500 * MS);
    received(&mut world);
    // A push sideways on the front edge turns it about z.
    world.push(Push { force_n: [0.0, 2.0, 0.0], place_m: [0.15, 0.0, 0.0], ..Push::default() }, 0.3);
    let mut truth = Vec::new();
    for ms in 500..700 {
        truth.push(world.body().unwrap().rate_rad_s[2]);
        world.advance_to((ms + 1) * MS);
    }
    let told = all_of(&received(&mut world), 0x52, 2000_f64.to_radians());
    let fastest = truth.last().unwrap();
    assert!(*fastest > 1.0, "{fastest} rad/s");
    // An output begins at each 5 ms, from 500 ms on, and the one of 500 ms was told first.
    for (index, [.., z]) in told.iter().enumerate() {
        let begun_ms = 5 * (index + usize::from(told.len() < 40));
        let then = begun_ms.checked_sub(20).map_or(0.0, |ms| truth[ms]);
        assert!((z - then).abs() < 0.002, "at {begun_ms} ms: {z}, was {then} rad/s");
    }
}
