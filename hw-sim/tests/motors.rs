//! The motion of a shaft: facts of the data sheets and of mechanics.
#![allow(clippy::unwrap_used, reason = "helpers of tests; a failed one should panic")]

mod common;
use common::*;
use hw_sim::{BusConfig, Model, Protocol, Shaft, World};

fn bus_for(model: &Model, position_counts: f64) -> BusConfig {
    let mut config = servo(&model.name, 1);
    config.position_counts = position_counts;
    let bus = match model.protocol {
        Protocol::Dynamixel => dynamixel_bus(vec![config]),
        Protocol::Feetech => feetech_bus(vec![config]),
    };
    BusConfig { supply_v: model.nominal_voltage_v, ..bus }
}

fn is_scs(model: &Model) -> bool {
    model.name == "SCS0009"
}

/// A position of servos with 4096 counts a turn, for all.
fn counts(model: &Model, position: i32) -> i32 {
    if is_scs(model) { position / 4 } else { position }
}

fn write(world: &mut World, model: &Model, feetech_at: u8, dynamixel_at: u8, value: i32) {
    let bytes = value.to_le_bytes();
    match model.protocol {
        Protocol::Feetech if is_scs(model) => feetech_write(world, 1, feetech_at, &[bytes[1], bytes[0]]),
        Protocol::Feetech => feetech_write(world, 1, feetech_at, &bytes[..2]),
        Protocol::Dynamixel => {
            let size = if dynamixel_at == 100 { 2 } else { 4 };
            dynamixel_write(world, 1, dynamixel_at, &bytes[..size])
        }
    };
}

fn torque_on(world: &mut World, model: &Model) {
    match model.protocol {
        Protocol::Feetech => feetech_write(world, 1, 40, &[1]),
        Protocol::Dynamixel => dynamixel_write(world, 1, 64, &[1]),
    };
}

/// Full duty in PWM mode, to larger counts. The STS series turns that way at a negative value, whose sign is bit 10.
fn full_duty(world: &mut World, model: &Model) {
    match model.protocol {
        Protocol::Feetech if is_scs(model) => {
            feetech_write(world, 1, 9, &[0; 4]);
            feetech_write(world, 1, 44, &1000u16.to_be_bytes());
        }
        Protocol::Feetech => {
            feetech_write(world, 1, 33, &[2]);
            feetech_write(world, 1, 44, &(0x400 | 1000u16).to_le_bytes());
        }
        Protocol::Dynamixel => {
            dynamixel_write(world, 1, 11, &[16]);
        }
    }
    torque_on(world, model);
}

fn shaft(world: &World) -> Shaft {
    world.shaft(0, 1).unwrap()
}

fn after(world: &mut World, ns: u64) -> Shaft {
    world.advance_to(world.now_ns() + ns);
    shaft(world)
}

#[test]
fn full_duty_reaches_no_load_speed_less_friction() {
    for model in Model::all() {
        let mut world = world(bus_for(model, 0.0));
        full_duty(&mut world, model);
        let speed = after(&mut world, 3 * S).speed_rad_s;
        let share = speed / model.no_load_speed_rad_s;
        // Friction takes the share of the speed that it is of the stall torque.
        let expected = 1.0 - model.friction_nm / model.stall_torque_nm;
        assert!((share - expected).abs() < 0.002, "{}: {share}, not {expected}", model.name);
    }
}

#[test]
fn a_blocked_shaft_feels_stall_torque_in_proportion_to_the_supply() {
    for model in Model::all() {
        let stuck = "[[fault]]\nat_s = 0\nkind = 'stuck'";
        let mut world = world_with_faults(bus_for(model, 0.0), stuck);
        full_duty(&mut world, model);
        let blocked = after(&mut world, S / 10);
        assert!((blocked.torque_nm / model.stall_torque_nm - 1.0).abs() < 1e-9, "{}", model.name);
        assert!(blocked.position_counts.abs() < 1e-9);
    }
    let model = Model::named("STS3215-12V").unwrap();
    let script = "[[fault]]\nat_s = 0\nkind = 'stuck'\n[[fault]]\nat_s = 0\nkind = 'low-voltage'\nvolts = 6";
    let mut world = world_with_faults(bus_for(model, 0.0), script);
    full_duty(&mut world, model);
    assert!((after(&mut world, S / 10).torque_nm - model.stall_torque_nm / 2.0).abs() < 1e-9);
}

#[test]
fn a_step_settles_at_the_goal_within_the_friction_dead_zone() {
    for model in Model::all() {
        let (start, goal) = (counts(model, 2048), counts(model, 3072));
        let mut world = world(bus_for(model, start.into()));
        write(&mut world, model, 42, 116, start);
        torque_on(&mut world, model);
        write(&mut world, model, 42, 116, goal);
        let settled = after(&mut world, 3 * S);
        // Friction holds against what the gain makes of this many counts; one more for rounding.
        let gain = match model.protocol {
            // P over four tenths of a percent a count; without the quarter on SCS.
            Protocol::Feetech if is_scs(model) => model.stall_torque_nm * 0.015,
            Protocol::Feetech => model.stall_torque_nm * 0.008,
            Protocol::Dynamixel => {
                let p: f64 = match model.name.as_str() {
                    "XL330-M288" => 400.0,
                    "XL430-W250" => 640.0,
                    _ => 800.0,
                };
                model.stall_torque_nm * p / 128.0 / 885.0
            }
        };
        let dead_zone = model.friction_nm / gain + 1.0;
        let error = (settled.position_counts - f64::from(goal)).abs();
        assert!(error <= dead_zone, "{}: {error} counts, dead zone {dead_zone}", model.name);
        assert!(settled.speed_rad_s.abs() < 1e-9, "{}", model.name);
    }
}

#[test]
fn the_torque_limit_register_limits_torque() {
    for model in Model::all() {
        let stuck = "[[fault]]\nat_s = 0\nkind = 'stuck'";
        let mut world = world_with_faults(bus_for(model, counts(model, 2048).into()), stuck);
        torque_on(&mut world, model);
        write(&mut world, model, 42, 116, 100);
        let (limit, share) = if model.protocol == Protocol::Feetech { (250, 0.25) } else { (177, 0.2) };
        // SCS has no limit beside the largest torque.
        write(&mut world, model, if is_scs(model) { 16 } else { 48 }, 100, limit);
        let torque = after(&mut world, S / 10).torque_nm;
        assert!((torque / model.stall_torque_nm + share).abs() < 1e-9, "{}: {torque}", model.name);
    }
}

#[test]
fn a_limp_shaft_does_not_move_by_itself() {
    for model in Model::all() {
        let mut world = world(bus_for(model, 1000.25));
        // A goal would wake a Feetech servo.
        if model.protocol == Protocol::Dynamixel {
            dynamixel_write(&mut world, 1, 116, &3000i32.to_le_bytes());
        }
        let limp = after(&mut world, 2 * S);
        assert!(!limp.torque_on);
        assert!((limp.position_counts - 1000.25).abs() < 1e-9, "{}", model.name);
    }
}

#[test]
fn a_released_spinning_shaft_is_stopped_by_friction_and_sooner_by_shorted_windings() {
    let model = Model::named("STS3215-12V").unwrap();
    let coast = |switch: u8| {
        let mut world = world(bus_for(model, 0.0));
        full_duty(&mut world, model);
        after(&mut world, S);
        world.host_send(0, &feetech(1, 3, &[40, switch])).unwrap();
        let before = after(&mut world, MS).speed_rad_s;
        let later = after(&mut world, 10 * MS).speed_rad_s;
        (before - later) / 0.010
    };
    let friction = model.friction_nm / model.reflected_inertia_kg_m2;
    assert!((coast(0) - friction).abs() < 1e-6);
    assert!(coast(2) > 5.0 * friction);
}

#[test]
fn dynamixel_torque_on_keeps_the_shaft_where_it_is() {
    let model = Model::named("XM430-W350").unwrap();
    let mut world = world(bus_for(model, -700.0));
    torque_on(&mut world, model);
    assert!((after(&mut world, S).position_counts + 700.0).abs() < 1.0);
    // Position mode sees one turn: 4096 - 700 = 3396; a goal of 3000 is 396 counts back.
    write(&mut world, model, 42, 116, 3000);
    assert!((after(&mut world, 2 * S).position_counts + 1096.0).abs() < 4.0);
}

#[test]
fn drive_mode_reverse_turns_the_other_way() {
    let model = Model::named("XM430-W210").unwrap();
    let mut world = world(bus_for(model, 2000.0));
    dynamixel_write(&mut world, 1, 10, &[1]);
    torque_on(&mut world, model);
    let goal = 4096 - 2000 + 300;
    write(&mut world, model, 42, 116, goal);
    assert!((after(&mut world, 2 * S).position_counts - 1700.0).abs() < 5.0);
    let read = dynamixel_read(&mut world, 1, 132, 4);
    let present = i32::from_le_bytes(read[9..13].try_into().unwrap());
    assert!((present - goal).abs() < 5);
}

#[test]
fn feedback_registers_agree_with_the_shaft_in_each_model_s_units() {
    for model in Model::all() {
        let mut world = world(bus_for(model, 0.0));
        full_duty(&mut world, model);
        world.advance_to(world.now_ns() + 1500 * MS);
        let truth = shaft(&world);
        let word = |address: u16, size: u16| {
            let place = |n| if is_scs(model) { size - 1 - n } else { n };
            let bytes =
                (0..size).map(|n| u32::from(world.register(0, 1, address + place(n)).unwrap()) << (8 * n));
            f64::from(bytes.sum::<u32>())
        };
        let (speed, unit) = match model.protocol {
            Protocol::Feetech => (word(58, 2), std::f64::consts::TAU / model.counts_per_turn),
            Protocol::Dynamixel => (word(128, 4), 0.229 * std::f64::consts::TAU / 60.0),
        };
        assert!((speed * unit - truth.speed_rad_s).abs() <= unit / 2.0 + 1e-9, "{}", model.name);
        let (volts, celsius, duty) = match model.protocol {
            Protocol::Feetech => (word(62, 1), word(63, 1), word(60, 2) / 1000.0),
            Protocol::Dynamixel => (word(144, 2), word(146, 1), word(124, 2) / 885.0),
        };
        assert!((volts / 10.0 - model.nominal_voltage_v).abs() < 0.051, "{}", model.name);
        assert!((celsius - 30.0).abs() <= 1.0);
        assert!((duty - 1.0).abs() < 1e-9);
    }
}

#[test]
fn load_warms_the_servo_slowly() {
    let model = Model::named("STS3215-12V").unwrap();
    let mut world = world_with_faults(bus_for(model, 0.0), "[[fault]]\nat_s = 0\nkind = 'stuck'");
    // No overload protection.
    feetech_write(&mut world, 1, 19, &[0x0C]);
    full_duty(&mut world, model);
    let after_10_s = after(&mut world, 10 * S).temperature_c;
    assert!(after_10_s > 32.0 && after_10_s < 40.0, "{after_10_s}");
    // In the end the servo protects itself: 70 °C is its limit, and overheating unloads it.
    let in_the_end = after(&mut world, 600 * S);
    assert!(!in_the_end.torque_on);
    assert!(in_the_end.temperature_c < 71.0);
}

fn named(name: &str) -> &'static Model {
    Model::named(name).unwrap()
}

/// TheRobotStudio/SO-ARM100#134: about 1 degree by hand on an STS3215. ROBOTIS: 0.25 degrees on XM430.
#[test]
fn a_limp_shaft_has_its_free_play() {
    for (name, degrees) in [("STS3215-12V", 1.0), ("XM430-W210", 0.25)] {
        let mut world = world(bus_for(named(name), 1000.0));
        // Far less than the gears' friction.
        world.load(0, 0, 0.01);
        let one_end = after(&mut world, S).position_counts;
        world.load(0, 0, -0.01);
        let other_end = after(&mut world, S).position_counts;
        let play = (one_end - other_end) * 360.0 / 4096.0;
        assert!((play - degrees).abs() < 1e-6, "{name}: {play}");
        world.load(0, 0, 0.0);
        assert!((after(&mut world, S).position_counts - other_end).abs() < 1e-9);
    }
}

/// The motor crosses the play before the shaft turns back.
#[test]
fn a_shaft_that_reverses_stands_still_first() {
    let model = named("STS3215-12V");
    let mut world = world(bus_for(model, 0.0));
    full_duty(&mut world, model);
    after(&mut world, S);
    world.host_send(0, &feetech(1, 3, &[44, 0xE8, 0x03])).unwrap();
    let mut still_ms = 0;
    loop {
        let speed = after(&mut world, MS).speed_rad_s;
        still_ms += u32::from(speed.abs() < 1e-9);
        if speed < 0.0 {
            break;
        }
    }
    // 0.0175 rad from rest at (2.94 + 0) / 0.027 rad/s².
    let expected_ms = (2.0 * 1f64.to_radians() * 0.027 / 2.94).sqrt() * 1e3;
    assert!((f64::from(still_ms) - expected_ms).abs() < 4.0, "{still_ms} ms, not {expected_ms}");
}

/// TheRobotStudio/SO-ARM100#134: 20 to 30 counts (1.8 to 2.6 degrees) under 1.5 kg on a lever of 10 cm at 45 degrees.
#[test]
fn an_sts3215_gives_way_under_load_as_measured() {
    let mut world = world(bus_for(named("STS3215-12V"), 2048.0));
    feetech_write(&mut world, 1, 42, &[0, 8]);
    feetech_write(&mut world, 1, 40, &[1]);
    let full = 1.5 * 9.81 * 0.1 * std::f64::consts::FRAC_1_SQRT_2;
    for share in 1..=100 {
        world.load(0, 0, full * f64::from(share) / 100.0);
        after(&mut world, 20 * MS);
    }
    let error = after(&mut world, S).position_counts - 2048.0;
    assert!((20.0..30.0).contains(&error), "{error} counts");
    // Without torque it falls.
    feetech_write(&mut world, 1, 40, &[0]);
    assert!(shaft(&world).speed_rad_s > 0.5);
}

#[test]
fn the_supply_of_a_bus_sags_with_the_current_of_all_its_servos() {
    let stuck = "[[fault]]\nat_s = 0\nkind = 'stuck'";
    let servos = vec![servo("STS3215-12V", 1), servo("STS3215-12V", 2)];
    let bus = BusConfig { supply_ohm: 0.5, ..feetech_bus(servos) };
    let mut world = world_with_faults(bus, stuck);
    let volts = |world: &World| world.shaft(0, 1).unwrap().supply_v;
    assert!((volts(&world) - 12.0).abs() < 1e-9);
    for (id, stalled) in [(1, 1.0), (2, 2.0)] {
        feetech_write(&mut world, id, 33, &[2]);
        feetech_write(&mut world, id, 44, &(0x400 | 1000u16).to_le_bytes());
        feetech_write(&mut world, id, 40, &[1]);
        // Ohm's law: 2.7 A at 12 V are 4.44 ohm each.
        let expected = 12.0 / (1.0 + stalled * 0.5 * 2.7 / 12.0);
        assert!((volts(&world) - expected).abs() < 1e-4, "{} of {expected}", volts(&world));
        let torque = world.shaft(0, 1).unwrap().torque_nm;
        assert!((torque - 2.94 * expected / 12.0).abs() < 1e-4, "{torque}");
    }
    assert_eq!(world.register(0, 2, 62), Some(98), "and the servos tell");
}

#[test]
fn a_custom_model_has_the_torque_it_was_given() {
    let stuck = "[[fault]]\nat_s = 0\nkind = 'stuck'";
    let known = Model::named("STS3215-12V").unwrap();
    let mut own = known.clone();
    (own.name, own.stall_torque_nm) = ("stronger".into(), 3.0 * known.stall_torque_nm);
    let mut bus = bus_for(known, 0.0);
    bus.servos[0].model = own.clone();
    let mut world = world_with_faults(bus, stuck);
    full_duty(&mut world, &own);
    assert!((after(&mut world, S / 10).torque_nm - own.stall_torque_nm).abs() < 1e-9);
}
