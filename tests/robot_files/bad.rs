//! Bad robot files: each is a small change to the good one, with the expected message.

use std::path::Path;

use hippocamp::config::{self, ConfigError, Fault};

use crate::GOOD;

/// What is replaced, by what, and the fault it makes. In the new text `@` (taken out again) marks the line
/// the fault must stand on.
struct Bad {
    old: &'static str,
    new: &'static str,
    key: &'static str,
    value: Option<&'static str>,
    said: &'static [&'static str],
}

const fn bad(
    old: &'static str,
    new: &'static str,
    key: &'static str,
    value: &'static str,
    said: &'static [&'static str],
) -> Bad {
    Bad { old, new, key, value: Some(value), said }
}

const fn missing(
    old: &'static str,
    new: &'static str,
    key: &'static str,
    said: &'static [&'static str],
) -> Bad {
    Bad { old, new, key, value: None, said }
}

const IMU: &[Bad] = &[
    bad("rate_hz = 100\n", "@rate_hz = 150\n", "imu.rate_hz", "150", &["20, 50, 100, 125, 200"]),
    bad(
        "baud = 38400\nrpy",
        "@baud = 19200\nrpy",
        "imu.baud",
        "19200",
        &["at least 33000", "100 measurements"],
    ),
    bad("baud = 38400\nrpy", "@baud = 1000000\nrpy", "imu.baud", "1000000", &["115200", "921600"]),
    bad("delay_ms = 4", "@delay_ms = -1", "imu.delay_ms", "-1", &["from 0 to 100"]),
    bad(
        "stale_s = 0.21",
        "@stale_s = 0.02",
        "imu.stale_s",
        "0.02",
        &["at least 0.032", "a cycle of the loop"],
    ),
    bad(
        "lost_speed_share = 0.35",
        "@lost_speed_share = 0",
        "imu.lost_speed_share",
        "0",
        &["above 0 and at most 1"],
    ),
    bad("rate_deg_s = 0\n", "@rate_deg_s = -1\n", "imu.noise.rate_deg_s", "-1", &["turn rate", "from 0"]),
    bad("rpy_deg = [180, 0, 90]", "@rpy_deg = [180, 0]", "imu.rpy_deg", "[180, 0]", &["3 numbers"]),
    bad("delay_ms = 4", "@delays_ms = 4", "imu.delays_ms", "4", &["did you mean delay_ms?"]),
];

const TOP: &[Bad] = &[
    missing("name = \"foal\"", "@", "name", &["robot's name", "text in quotes"]),
    bad("\"foal\"", "@\"  \"", "name", "\"  \"", &["text in quotes"]),
    bad("\"foal\"", "@7", "name", "7", &["text in quotes"]),
    bad("= 120", "= @0", "loop_rate_hz", "0", &["from 10 to 1000"]),
    bad("= 120", "= @-50", "loop_rate_hz", "-50", &["from 10 to 1000"]),
    bad("= 120", "= @1001", "loop_rate_hz", "1001", &["from 10 to 1000"]),
    bad("return_delay_us = 500", "@return_delay_us = 501", "bus[1].return_delay_us", "501", &["even"]),
    bad("return_delay_us = 500", "@return_delay_us = 510", "bus[1].return_delay_us", "510", &["508"]),
    bad("= 120", "= @nan", "loop_rate_hz", "nan", &["a number from 10", "finite"]),
    bad("= 120", "= @inf", "loop_rate_hz", "inf", &["finite"]),
    bad("= 120", "= @\"120\"", "loop_rate_hz", "\"120\"", &["a number"]),
    bad("\"hold\"", "@\"limp\"", "stop_action", "\"limp\"", &["\"hold\", \"sit-then-limp\""]),
    bad(
        "[trunk]",
        "@colour = \"bay\"\n[trunk]",
        "colour",
        "\"bay\"",
        &["known are", "loop_rate_hz", "trunk"],
    ),
    missing("[trunk]\nmass_kg = 1.1\ncenter_mm = [5, 0, 10]", "", "trunk", &["mass and centre of the trunk"]),
    missing("[trunk]\nmass_kg = 1.1", "@[trunk]", "trunk.mass_kg", &["mass in kg", "above 0"]),
    bad("mass_kg = 1.1", "@mass_kg = 0", "trunk.mass_kg", "0", &["above 0"]),
    bad("= [5, 0, 10]", "= @[5, 0]", "trunk.center_mm", "[5, 0]", &["a list of 3 numbers"]),
    bad("= [5, 0, 10]", "= [5,\n@inf, 10]", "trunk.center_mm[1]", "inf", &["finite"]),
    bad("= [5, 0, 10]", "= @[5, 0, true]", "trunk.center_mm[2]", "true", &["a number"]),
];

const BUSES: &[Bad] = &[
    bad("name = \"right\"", "@name = \"left\"", "bus[1].name", "\"left\"", &["line 10 has this name"]),
    bad("name = \"right\"", "@name = \"right.a\"", "bus[1].name", "\"right.a\"", &["letters a to z"]),
    bad("\"feetech\"", "@\"fetech\"", "bus[0].protocol", "\"fetech\"", &["did you mean \"feetech\""]),
    bad("= 500000", "= @2000000", "bus[0].baud", "2000000", &["feetech servos have", "1000000 is the most"]),
    bad("= 57600", "= @38400", "bus[1].baud", "38400", &["dynamixel servos have: 9600, 57600"]),
    bad("= 57600", "= @-1", "bus[1].baud", "-1", &["a whole number"]),
    bad("= 2000\n", "= @2.5\n", "bus[1].adapter_latency_us", "2.5", &["microseconds", "a whole number"]),
    bad(
        "return_delay_us",
        "@return_delay_ms",
        "bus[1].return_delay_ms",
        "500",
        &["did you mean return_delay_us"],
    ),
    bad(
        "[[chain]]\nname = \"lh\"",
        "[[bus]]\n@name = \"spare\"\nprotocol = \"feetech\"\nbaud = 500000\n[[chain]]\nname = \"lh\"",
        "bus[2].name",
        "\"spare\"",
        &["some servo names", "take the bus out"],
    ),
];

const CHAINS: &[Bad] = &[
    bad("name = \"rh\"", "@name = \"lh\"", "chain[2].name", "\"lh\"", &["line 22 has this name already"]),
    missing(
        "name = \"rf\"\nroot_mm = [85, -60, 0]",
        "name = \"rf\"",
        "chain[3].root_mm",
        &["first joint", "3 numbers"],
    ),
    bad(
        "root_mm = [85, -60, 0]",
        "@root_mm = [85, 60, 0.5]",
        "chain[3].root_mm",
        "[85, 60, 0.5]",
        &["a place of its own", "line 47 another chain"],
    ),
    bad("= [0, 0, 90]", "= @90", "chain[0].root_rpy_deg", "90", &["roll, pitch and yaw", "3 numbers"]),
    bad("\"hip\"\naxis", "@\"yaw\"\naxis", "chain[0].joint[1].name", "\"yaw\"", &["line 27 has this name"]),
    bad(
        "axis = [0, 0, 1]",
        "@axis = [0, 0, 0]",
        "chain[0].joint[0].axis",
        "[0, 0, 0]",
        &["unit vector", "[0, 1, 0]"],
    ),
    bad(
        "axis = [0, 0, 1]",
        "@axis = [0, 3, 4]",
        "chain[0].joint[0].axis",
        "[0, 3, 4]",
        &["length 1, not 5.0000", "[0.000000, 0.600000, 0.800000]"],
    ),
    bad("[0, 0, -150]", "@[0, 0, 0]", "chain[0].joint[1].link_mm", "[0, 0, 0]", &["above 0", "last link"]),
    bad(
        "range_deg = [-30, 30]",
        "@range_deg = [30, -30]",
        "chain[0].joint[0].range_deg",
        "[30, -30]",
        &["[min, max]"],
    ),
    bad("[-30, 30]", "@[-30, -30]", "chain[0].joint[0].range_deg", "[-30, -30]", &["lowest angle first"]),
    bad("[-30, 30]", "@[-200, 200]", "chain[0].joint[0].range_deg", "[-200, 200]", &["a turn, 360 degrees"]),
    bad(
        "[-30, 30]",
        "@[-180, 180]",
        "chain[0].joint[0].range_deg",
        "[-180, 180]",
        &["359.8 degrees", "STS3215-12V"],
    ),
    bad("[-30, 30]", "@[nan, 30]", "chain[0].joint[0].range_deg[0]", "nan", &["finite"]),
    bad("stiffness = 0.1", "@stiffness = 0", "chain[0].joint[0].stiffness", "0", &["above 0 and at most 1"]),
    bad("stiffness = 0.6", "@stiffness = 1.1", "chain[0].joint[1].stiffness", "1.1", &["at most 1"]),
    bad("mass_kg = 0.25", "@mass_kg = -0.25", "chain[0].joint[1].mass_kg", "-0.25", &["from 0 to"]),
    bad(
        "range_deg = [-30, 30]",
        "range_deg = [-30, 30]\n@range_rad = 1",
        "chain[0].joint[0].range_rad",
        "1",
        &["did you mean range_deg"],
    ),
    bad("[1, 2, -60]", "@[1, 2, 1e12]", "chain[0].joint[1].center_mm[2]", "1e12", &["at most 1e9 in size"]),
];

const SERVOS: &[Bad] = &[
    bad(
        "\"STS3250\"",
        "@\"STS3520\"",
        "chain[1].joint[0].servo.model",
        "\"STS3520\"",
        &["XM430-W210", "did you mean \"STS3250\""],
    ),
    bad(
        "\"STS3250\"",
        "@\"XL430-W250\"",
        "chain[1].joint[0].servo.model",
        "\"XL430-W250\"",
        &["speaks feetech, as its bus does", "XL430-W250 speaks dynamixel"],
    ),
    bad(
        "bus = \"left\", id = 3",
        "@bus = \"lift\", id = 3",
        "chain[1].joint[0].servo.bus",
        "\"lift\"",
        &["\"left\", \"right\"", "did you mean \"left\""],
    ),
    bad(
        "id = 2 }",
        "@id = 1 }",
        "chain[0].joint[1].servo.id",
        "1",
        &["the joint in line 33 has it", "an id of its own"],
    ),
    bad("id = 252", "@id = 253", "chain[3].joint[0].servo.id", "253", &["from 0 to 252", "253 and 255"]),
    bad("id = 252", "@id = 254", "chain[3].joint[0].servo.id", "254", &["254 is the broadcast address"]),
    bad("id = 252", "@id = -1", "chain[3].joint[0].servo.id", "-1", &["from 0 to 252"]),
    bad("reversed = true", "@reversed = 1", "chain[2].joint[0].servo.reversed", "1", &["true or false"]),
    missing(
        "\nservo = { model = \"STS3215-12V\", bus = \"left\", id = 2 }",
        "",
        "chain[0].joint[1].servo",
        &["the servo that turns this joint", "model, bus, id"],
    ),
    missing(", id = 3", "@", "chain[1].joint[0].servo.id", &["from 0 to 252"]),
];

const SAFETY: &[Bad] = &[
    bad("rate_share = 0.5", "@coast_s = 0.01", "safety.coast_s", "0.01", &["2 cycles of the loop", "120 Hz"]),
    bad("rate_share = 0.5", "@hold_s = 0.01", "safety.hold_s", "0.01", &["2 cycles of the loop"]),
    bad(
        "rate_share = 0.5",
        "@tripped_servo = \"freeze\"",
        "safety.tripped_servo",
        "\"freeze\"",
        &["a robot on legs falls", "\"stop\""],
    ),
    bad("rate_share = 0.5", "@rate_share = 1.5", "safety.rate_share", "1.5", &["above 0 and at most 1"]),
    bad(
        "temperature_max_c = 65",
        "@temperature_max_c = 75",
        "safety.temperature_max_c",
        "75",
        &["servos' own limit", "at most 70"],
    ),
    bad(
        "temperature_max_c = 65",
        "@voltage_min_v = 9",
        "safety.voltage_min_v",
        "9",
        &["from 10 to below", "servos of bus", "voltage_min_v of its own"],
    ),
    bad("rate_share = 0.5", "@hold_s = -1", "safety.hold_s", "-1", &["above 0"]),
    bad("rate_share = 0.5", "@hold_s = 1000", "safety.hold_s", "1000", &["heat up", "at most 30"]),
    bad("rate_share = 0.5", "@coast_s = 1000", "safety.coast_s", "1000", &["a whole step", "at most 0.5"]),
    bad(
        "rate_share = 0.5",
        "@fault_delay_s = 60",
        "safety.fault_delay_s",
        "60",
        &["stall current", "0 to 2"],
    ),
    bad(
        "rate_share = 0.5",
        "@tracking_error_max_deg = 1000",
        "safety.tracking_error_max_deg",
        "1000",
        &["does not follow", "at most 45"],
    ),
    bad(
        "rate_share = 0.5",
        "@slow_rate_deg_s = 5000",
        "safety.slow_rate_deg_s",
        "5000",
        &["hand", "1 to 90"],
    ),
    bad(
        "rate_share = 0.5",
        "@slow_rate_deg_s = 1e-6",
        "safety.slow_rate_deg_s",
        "1e-6",
        &["get up", "1 to 90"],
    ),
    bad("rate_share = 0.5", "@torque_ramp_s = 0", "safety.torque_ramp_s", "0", &["jerks", "0.2 to 10"]),
    bad(
        "rate_share = 0.5",
        "@torque_ramp_s = 1e6",
        "safety.torque_ramp_s",
        "1e6",
        &["half held", "0.2 to 10"],
    ),
    bad(
        "rate_share = 0.5",
        "@acceleration_max_deg_s2 = 1e9",
        "safety.acceleration_max_deg_s2",
        "1e9",
        &["limit nothing", "at most 100000"],
    ),
    bad(
        "temperature_max_c = 65",
        "@acceleration_max_deg_s2 = 0",
        "safety.acceleration_max_deg_s2",
        "0",
        &["above 0"],
    ),
    bad(
        "temperature_max_c = 65",
        "@temperature_max_f = 65",
        "safety.temperature_max_f",
        "65",
        &["did you mean temperature_max_c"],
    ),
];

const MOTION: &[Bad] = &[
    bad(
        "kind = \"horse\"",
        "@kind = \"octopus\"",
        "motion.kind",
        "\"octopus\"",
        &["a kind of motion", "\"horse\""],
    ),
    missing(
        ", right_fore = \"rf\"",
        "",
        "motion.legs.right_fore",
        &["this leg's chain", "\"lh\", \"lf\", \"rh\", \"rf\""],
    ),
    bad("right_fore = \"rf\"", "@right_fore = \"tail\"", "motion.legs.right_fore", "\"tail\"", &["\"rf\""]),
    bad(
        "left_hind = \"lh\"",
        "left_hind = \"lh\", @middle = \"lh\"",
        "motion.legs.middle",
        "\"lh\"",
        &["known are left_hind"],
    ),
    bad("= 140", "= @0", "motion.stand_height_mm", "0", &["above 0"]),
    bad("= 90\n", "= @141\n", "motion.sit_height_mm", "141", &["at most the standing height, 140"]),
    bad("= 0.4\n", "= @0\n", "motion.swing_time_s", "0", &["above 0"]),
    bad("= 0.4\n", "= @1e9\n", "motion.swing_time_s", "1e9", &["above 0 and at most 10"]),
    bad("= 0.4\n", "= @0.08\n", "motion.swing_time_s", "0.08", &["10 cycles of the loop", "120 Hz"]),
    bad("swing_lift_mm = 12", "@swing_lift_mm = -12", "motion.swing_lift_mm", "-12", &["above 0"]),
    bad("= 0.2\n", "= @0.5\n", "motion.swing_ramp_share", "0.5", &["above 0 and below 0.5"]),
    bad(
        "name = \"rotary\"",
        "@name = \"amble\"",
        "motion.gait[1].name",
        "\"amble\"",
        &["has this name already"],
    ),
    bad("duty_factor = 0.6", "@duty_factor = 1", "motion.gait[0].duty_factor", "1", &["from 0.05 to 0.95"]),
    bad(
        "fore_hind_phase_offset = 0.3",
        "@fore_hind_phase_offset = 1",
        "motion.gait[0].fore_hind_phase_offset",
        "1",
        &["at least 0 and below 1"],
    ),
    bad(
        "0.7, 0.1, 0.6]",
        "@-0.3, 0.1, 0.6]",
        "motion.gait[1].phase_offsets[1]",
        "-0.3",
        &["left hind, left fore", "at least 0"],
    ),
    bad(
        "[0, 0.7, 0.1, 0.6]",
        "@[0, 0.7, 0.1]",
        "motion.gait[1].phase_offsets",
        "[0, 0.7, 0.1]",
        &["a list of 4 numbers"],
    ),
    bad(
        "fore_hind_phase_offset = 0.3",
        "fore_hind_phase_offset = 0.3\n@phase_offsets = [0, 0, 0, 0]",
        "motion.gait[0].phase_offsets",
        "[0, 0, 0, 0]",
        &["either phase_offsets, or", "not both"],
    ),
    missing(
        "\nleft_right_phase_offset = 0.9",
        "",
        "motion.gait[0].left_right_phase_offset",
        &["right foot's lift-off"],
    ),
];

/// Replaces what stands in the good file exactly once.
fn spoil(text: &str, old: &str, new: &str) -> String {
    assert_eq!(text.matches(old).count(), 1, "{old:?} must stand in the file once");
    text.replace(old, new)
}

fn refused(text: &str) -> ConfigError {
    match config::parse(text, "bad.toml") {
        Ok(_) => panic!("this file was taken for good:\n{text}"),
        Err(error) => error,
    }
}

fn check(case: &Bad) {
    let marked = spoil(GOOD, case.old, case.new);
    let error = refused(&marked.replace('@', ""));
    let [fault] = error.faults.as_slice() else { panic!("one fault expected, not\n{error}") };
    let Fault { file, line, column, key, value, expected } = fault;
    assert_eq!((file.as_str(), column), ("bad.toml", &None), "{fault}");
    assert_eq!((key.as_str(), value.as_deref()), (case.key, case.value), "{fault}");
    if let Some(mark) = marked.find('@') {
        assert_eq!(*line, marked[..mark].matches('\n').count() + 1, "{fault}");
    }
    for words in case.said {
        assert!(expected.contains(words), "{words:?} is not in: {fault}");
    }
}

#[test]
fn top_and_trunk() {
    TOP.iter().chain(IMU).for_each(check);
}

#[test]
fn buses() {
    BUSES.iter().for_each(check);
}

#[test]
fn chains_and_joints() {
    CHAINS.iter().for_each(check);
}

#[test]
fn servos() {
    SERVOS.iter().for_each(check);
}

#[test]
fn safety() {
    SAFETY.iter().for_each(check);
}

const REFLEX: &[Bad] = &[
    bad("mode = \"reflex\"", "@mode = \"bold\"", "reflex.mode", "\"bold\"", &["\"passive\", \"off\""]),
    bad("roll_max_deg = 40", "@roll_max_deg = 90", "reflex.roll_max_deg", "90", &["from 5 to 89"]),
    bad(
        "roll_max_deg = 40",
        "@rate_max_deg_s = 90",
        "reflex.rate_max_deg_s",
        "90",
        &["belongs to detector = \"rate\""],
    ),
    bad("[0, 60, 10, 90, 60]", "@[0, 60, 10]", "reflex.pose[0].angles_deg", "[0, 60, 10]", &["5 numbers"]),
    bad(
        "[0, 60, 10, 90",
        "@[0, 60, 50, 90",
        "reflex.pose[0].angles_deg[2]",
        "50",
        &["lf.hip", "-45.0 to 45.0"],
    ),
    bad(
        "\"forward\"",
        "@\"down\"",
        "reflex.fall[0].direction",
        "\"down\"",
        &["which way it falls", "\"twisting\""],
    ),
    bad(
        "at_s = 0.25",
        "at_s = @0.05",
        "reflex.fall[0].key[1].at_s",
        "0.05",
        &["after that of the key before it, 0.1"],
    ),
    bad(
        "pose = \"spread\"",
        "pose = @\"spred\"",
        "reflex.fall[0].key[1].pose",
        "\"spred\"",
        &["did you mean \"spread\""],
    ),
    bad(
        "direction = \"forward\"\n",
        "direction = \"left\"\nkey = [{ pose = \"crouch\", at_s = 1 }]\n[[reflex.fall]]\n@direction = \"left\"\n",
        "reflex.fall[1].direction",
        "\"left\"",
        &["a direction of its own"],
    ),
    missing(
        "[[reflex.get_up]]",
        "@[[reflex.fall]]\ndirection = \"left\"\n[[reflex.get_up]]",
        "reflex.fall[1].key",
        &["at least one key pose"],
    ),
    bad(
        "lying = \"upright\"",
        "@lying = \"up\"",
        "reflex.get_up[0].lying",
        "\"up\"",
        &["the side that the robot \
         lies on"],
    ),
    bad(
        "torque_share = 0.7",
        "torque_share = @7",
        "reflex.fall[0].key[0].torque_share",
        "7",
        &["from 0 to 1"],
    ),
    bad(
        "[reflex]\n",
        "@[yield]\nload_share = 0.5\n[reflex]\n",
        "yield",
        "[yield]",
        &["a horse stands on its legs"],
    ),
];

#[test]
fn falls() {
    REFLEX.iter().for_each(check);
}

#[test]
fn arms_have_no_reflex_but_may_yield() {
    let text = include_str!("../../config/tentacle.toml");
    let said = |text: String| config::parse(&text, "arms.toml").unwrap_err().to_string();
    assert!(said(format!("{text}\n[reflex]\n")).contains("arms on a base do not fall"));
    let bare = text.split("[yield]").next().unwrap_or(text);
    assert!(said(format!("{bare}\n[yield]\nload_share = 1")).contains("above 0 and below 1"));
    assert!(said(format!("{bare}\n[yield]\nload_share = 0.5\nreturn_s = 0.1")).contains("from 0.5 to 60"));
}

#[test]
fn motion_and_gaits() {
    MOTION.iter().for_each(check);
}

/// Keys and lines of all faults, in the order of the messages.
fn places(error: &ConfigError) -> Vec<(usize, &str)> {
    error.faults.iter().map(|fault| (fault.line, fault.key.as_str())).collect()
}

#[test]
fn all_faults_are_reported_at_once_in_file_order() {
    let mut text = GOOD.to_owned();
    for (old, new) in [
        ("swing_time_s = 0.4", "swing_time = 0.4"),
        ("id = 252", "id = 254"),
        ("[-30, 30]", "[30, -30]"),
        ("= 57600", "= 57601"),
        ("mass_kg = 1.1", "mass_kg = -1.1"),
        ("stop_action = \"hold\"\n", "\n"),
    ] {
        text = spoil(&text, old, new);
    }
    let error = refused(&text);
    assert_eq!(
        places(&error),
        [
            (1, "stop_action"),
            (6, "trunk.mass_kg"),
            (17, "bus[1].baud"),
            (30, "chain[0].joint[0].range_deg"),
            (63, "chain[3].joint[0].servo.id"),
            (70, "motion.swing_time_s"),
            (75, "motion.swing_time"),
        ]
    );
    let said = error.to_string();
    assert_eq!(said.lines().count(), 8);
    assert!(said.ends_with("7 faults; nothing was started"), "{said}");
    assert!(said.contains("bad.toml:6: trunk.mass_kg = -1.1: expected the trunk's mass in kg"), "{said}");
}

#[test]
fn a_chain_used_as_two_legs_and_a_leg_without_a_role_are_faults() {
    let error = refused(&spoil(GOOD, "right_hind = \"rh\"", "right_hind = \"lf\""));
    assert_eq!(places(&error), [(53, "chain[2].name"), (72, "motion.legs.right_hind")]);
    assert!(error.faults[1].expected.contains("left_fore is this chain already"), "{error}");
}

#[test]
fn each_servo_without_a_bus_is_reported() {
    let start = GOOD.find("[[bus]]").expect("a bus");
    let end = GOOD.find("[[chain]]").expect("a chain");
    let error = refused(&format!("{}{}", &GOOD[..start], &GOOD[end..]));
    assert_eq!(error.faults.len(), 5);
    for fault in &error.faults {
        assert!(
            fault.key.ends_with(".servo") && fault.expected.contains("the file has no [[bus]]"),
            "{fault}"
        );
    }
}

#[test]
fn a_bad_bus_name_is_reported_once_and_not_once_per_servo() {
    let error = refused(&spoil(GOOD, "name = \"left\"\n", ""));
    assert_eq!(places(&error), [(9, "bus[0].name")]);
}

#[test]
fn an_empty_file_gets_a_fault_for_every_required_key() {
    let error = refused("");
    let keys: Vec<_> = error.faults.iter().map(|fault| fault.key.as_str()).collect();
    assert_eq!(keys, ["name", "loop_rate_hz", "stop_action", "trunk", "chain", "motion"]);
}

#[test]
fn empty_lists_and_wrong_shapes() {
    let head = &GOOD[..GOOD.find("[trunk]").expect("a trunk")];
    let said = |section: &str| refused(&format!("{head}{section}")).to_string();
    assert!(said("chain = []").contains("chain = []: expected at least one limb, [[chain]]"));
    assert!(said("chain = 3").contains("chain = 3: expected the limbs, a list of tables: write [[chain]]"));
    assert!(said("chain = [3]").contains("chain[0] = 3: expected the limbs, a table"));
    assert!(said("bus = { name = \"a\" }").contains("a list of tables: write [[bus]]"));
    assert!(said("trunk = 4").contains("trunk = 4: expected mass and centre of the trunk, a table"));
    assert!(said("[[trunk]]").contains("trunk = [[trunk]]: expected mass and centre of the trunk, a table"));
    assert!(said("[[chain]]\njoint = []").contains("chain[0].joint = []: expected at least one joint"));
    assert!(said("[[chain]]\n[chain.joint]").contains("a list of tables: write [[chain.joint]]"));
}

#[test]
fn text_that_is_not_toml_is_reported_by_line_and_column() {
    let error = refused(&spoil(GOOD, "mass_kg = 1.1", "mass_kg = 1.1.1"));
    let said = error.to_string();
    assert!(said.starts_with("bad.toml:6:14: expected TOML; invalid float\n"), "{said}");

    // Both mistakes are reported; faults that they hide are not guessed.
    let two = spoil(&spoil(GOOD, "mass_kg = 1.1", "mass_kg = "), "baud = 57600", "baud 57600");
    let lines: Vec<_> = refused(&two).faults.iter().map(|fault| fault.line).collect();
    assert_eq!(lines, [6, 17]);

    let twice = refused(&spoil(GOOD, "= 120", "= 120\nloop_rate_hz = 100"));
    assert!(twice.to_string().starts_with("bad.toml:3:1: expected TOML; duplicate key"), "{twice}");
}

#[test]
fn files_that_cannot_be_read() {
    let said = |path: &Path| match config::load(path) {
        Ok(_) => panic!("{} was taken for a robot", path.display()),
        Err(error) => error.to_string(),
    };
    let absent = said(Path::new("config/hrose.toml"));
    assert!(absent.starts_with("config/hrose.toml: expected a robot file that can be read"), "{absent}");
    let folder = said(Path::new(env!("CARGO_MANIFEST_DIR")));
    assert!(folder.contains("not a plain file"), "{folder}");

    let latin = Path::new(env!("CARGO_TARGET_TMPDIR")).join("latin1.toml");
    std::fs::write(&latin, b"# ok\nname = \"f\xfcllen\"\n").expect("a file in the test's own folder");
    let latin = said(&latin);
    assert!(latin.contains("latin1.toml:2: expected text in UTF-8"), "{latin}");
}

#[test]
fn servos_of_the_wrong_protocol_are_reported_once_per_bus_and_model() {
    let text = include_str!("../../config/horse.toml").replace("STS3215-12V", "XM430-W210");
    let said = config::parse(&text, "horse.toml").unwrap_err().to_string();
    assert_eq!(
        said,
        "horse.toml:50: chain[0].joint[0].servo.model = \"XM430-W210\": expected a model that speaks feetech, as its \
         bus does; XM430-W210 speaks dynamixel (reported once for all of them on this bus)\n1 fault; nothing was \
         started"
    );
}

#[test]
fn balance_needs_legs_with_feet() {
    let with_balance = GOOD.to_owned() + "\n[balance]\nroll_rate_gain_s = 1\n";
    let error = refused(&with_balance);
    let told: Vec<&str> = error.faults.iter().map(|fault| fault.key.as_str()).collect();
    let feet = [0, 1, 2, 3].map(|chain| format!("chain[{chain}].foot"));
    assert_eq!(told, [&feet[0], &feet[1], &feet[2], &feet[3], "balance.roll_rate_gain_s"]);
}
