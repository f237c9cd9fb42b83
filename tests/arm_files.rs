//! Robot files with arms: the joints that `[[arm]]` expands to, and the load of arms on their servos.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod common;

use std::path::Path;
use std::process::Command;

use common::{config_file, servo, shipped};
use glam::{DQuat, DVec3};
use hippocamp::config;
use hippocamp::kinds::loads;
use hippocamp::model::Robot;
use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::{Rng, SeedableRng};

const GRAVITY_M_S2: f64 = 9.806_65;

fn chance(source: &mut Pcg64Mcg) -> f64 {
    (source.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
}

/// `config/tentacle.toml` with some of its text replaced.
fn tentacle_with(changes: &[(&str, &str)]) -> String {
    let mut text = std::fs::read_to_string(config_file("tentacle.toml")).unwrap();
    for (from, to) in changes {
        assert!(text.contains(from), "{from}");
        text = text.replace(from, to);
    }
    text
}

#[test]
fn an_arm_expands_to_a_row_of_hinges_with_consecutive_ids() {
    let robot = shipped("tentacle.toml");
    assert_eq!(robot.joints.len(), 24);
    let names: Vec<&str> = robot.joints.iter().map(|joint| joint.name.as_str()).collect();
    assert_eq!(&names[..4], ["arm.lift_1", "arm.sweep_1", "arm.lift_2", "arm.sweep_2"]);
    for (joint, id) in robot.joints.iter().zip(1_u8..) {
        let servo = servo(joint);
        assert_eq!((servo.id.0, servo.bus), (id, usize::from(id > 12)), "ids are distinct across buses");
    }
    // w_i = w_0 (1 - 0.01 i), l_i = w_i / 2 (Ishizuka 2008, 3.1, 3.2).
    for (index, joint) in robot.joints.iter().skip(1).step_by(2).enumerate() {
        let wanted_m = 0.034 * (1.0 - 0.01 * index as f64);
        assert!((joint.link_m - DVec3::X * wanted_m).length() < 1e-12);
    }
    // Standing on its base the stretched arm points up; lifting its root bends it backwards over its base.
    let chain = &robot.chains[0];
    let tip = robot.tip_in_body(chain, [0.0; 24]);
    assert!(tip.distance(DVec3::Z * chain.length_m(robot.joints_of(chain))) < 1e-12, "{tip}");
    let mut lifted = [0.0; 24];
    lifted[0] = 0.5;
    assert!(robot.tip_in_body(chain, lifted).x < -0.1);
    let mut swept = [0.0; 24];
    swept[1] = 0.5;
    assert!(robot.tip_in_body(chain, swept).y > 0.1, "left is positive");
}

#[test]
fn mistakes_in_an_arm_are_reported_by_line() {
    for (changes, key, words) in [
        (vec![("joints = 12", "joints = 10")], "arm[0].joints", "three groups"),
        (vec![("first_id = 13", "first_id = 250")], "arm[0].servos[1].first_id", "252"),
        (
            vec![("first_id = 13", "first_id = 1"), ("bus = \"tip\"", "bus = \"root\"")],
            "arm[0].servos[1].first_id",
            "free",
        ),
        (vec![("joints = 6\nfirst_id = 13", "joints = 5\nfirst_id = 13")], "arm[0].servos", "12 joints"),
        (vec![("kind = \"tentacle\"", "kind = \"tentacle\"\nlegs = 4")], "motion.legs", "a known key here"),
        (
            vec![("carried_by = \"water\"", "carried_by = \"servos\"")],
            "motion.carried_share",
            "servos carry all",
        ),
    ] {
        let text = tentacle_with(&changes);
        let faults = config::parse(&text, "arm.toml").unwrap_err().faults;
        let found = faults.iter().find(|fault| fault.key == key);
        let found = found.unwrap_or_else(|| panic!("{key}: {faults:?}"));
        assert!(found.to_string().contains(words), "{found}");
        assert!(found.line > 0);
    }
}

/// Torque about each hinge of the arm of `robot` in this pose of arm and body, by separate forward kinematics, N m.
fn torques_nm(robot: &Robot, angles: &[f64], stands: DQuat) -> Vec<f64> {
    let chain = &robot.chains[0];
    let (mut place, mut rotation) = (chain.root_m, chain.root_rotation);
    let (mut hinges, mut masses) = (Vec::new(), Vec::new());
    for (joint, angle) in robot.joints.iter().zip(angles) {
        hinges.push((place, rotation * joint.axis));
        rotation *= DQuat::from_axis_angle(joint.axis, *angle);
        masses.push((place + rotation * joint.center_m, joint.mass_kg));
        place += rotation * joint.link_m;
    }
    let down = stands.inverse() * DVec3::NEG_Z * GRAVITY_M_S2;
    let torque = |(index, (place, axis)): (usize, &(DVec3, DVec3))| {
        let moment: DVec3 =
            masses[index..].iter().map(|(center, kg)| (*center - place).cross(down * *kg)).sum();
        moment.dot(*axis).abs()
    };
    hinges.iter().enumerate().map(torque).collect()
}

#[test]
fn the_load_of_a_joint_is_the_maximum_over_all_poses() {
    let text = tentacle_with(&[
        ("carried_by = \"water\"", "carried_by = \"servos\""),
        ("carried_share = 0.95\n", ""),
    ]);
    let robot = config::parse(&text, "arm.toml").unwrap().robot;
    let loads = loads::of_joints(&robot, robot.motion.tentacle().unwrap());
    // The upright arm tipped over forwards is level, and weighs on every lift with all its length.
    let level = torques_nm(&robot, &[0.0; 24], DQuat::from_rotation_y(std::f64::consts::FRAC_PI_2));
    for (load, torque) in loads.iter().zip(&level).step_by(2) {
        assert!((load.torque_nm - torque).abs() < 1e-9, "{load:?}: {torque}");
    }
    let mut source = Pcg64Mcg::seed_from_u64(4);
    for _ in 0..2000 {
        let angles: Vec<f64> = (0..24).map(|_| 1.2 * (2.0 * chance(&mut source) - 1.0)).collect();
        let axis =
            DVec3::new(chance(&mut source) - 0.5, chance(&mut source) - 0.5, chance(&mut source) - 0.5);
        let stands = DQuat::from_axis_angle(axis.normalize(), 6.0 * chance(&mut source));
        for (load, torque) in loads.iter().zip(torques_nm(&robot, &angles, stands)) {
            assert!(torque <= load.torque_nm + 1e-9, "{load:?}: {torque}");
        }
    }
}

/// Output of `hippocamp check` for the arm with these changes, and its exit code.
fn checked(name: &str, changes: &[(&str, &str)]) -> (String, Option<i32>) {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    std::fs::write(&path, tentacle_with(changes)).unwrap();
    let output = Command::new(env!("CARGO_BIN_EXE_hippocamp")).arg("check").arg(&path).output().unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (text(&output.stdout) + &text(&output.stderr), output.status.code())
}

#[test]
fn check_prints_the_loads_of_arms_and_refuses_loads_that_servos_cannot_hold() {
    let (said, code) = checked("arm-in-water.toml", &[]);
    assert_eq!(code, Some(0), "{said}");
    assert!(said.contains("Weight carried by water, 95 %") && !said.contains("WARNING"), "{said}");
    let counterweight = ("carried_by = \"water\"", "carried_by = \"counterweight\"");
    let (said, code) =
        checked("arm-heavy.toml", &[counterweight, ("carried_share = 0.95", "carried_share = 0.8")]);
    assert_eq!(code, Some(0), "{said}");
    assert!(said.contains("WARNING") && said.contains("MORE THAN IT CAN HOLD FOR LONG"), "{said}");
    let (said, code) =
        checked("arm-too-heavy.toml", &[counterweight, ("carried_share = 0.95", "carried_share = 0")]);
    assert_eq!(code, Some(2), "{said}");
    assert!(said.contains("motion.carried_share") && said.contains("_1 would need"), "{said}");
    // The word "water" alone does not make it float: it also needs a share.
    let (said, code) = checked("arm-sinks.toml", &[("carried_share = 0.95", "carried_share = 0")]);
    assert_eq!(code, Some(2), "{said}");
    assert!(said.contains("motion.carried_share") && said.contains("water carries 0 %"), "{said}");
    let heavy = ("mass_kg = 0.045", "mass_kg = 4.5");
    let (said, code) = checked("arm-floats.toml", &[heavy, ("carried_share = 0.95", "carried_share = 1")]);
    assert_eq!(code, Some(0), "{said}");
    assert!(!said.contains("WARNING"), "{said}");
    let by_servos = ("carried_by = \"water\"\ncarried_share = 0.95", "carried_by = \"servos\"");
    let (said, code) = checked("arm-by-servos.toml", &[by_servos]);
    assert_eq!(code, Some(2), "{said}");
    assert!(said.contains("motion.carried_by"), "{said}");
}

/// The shares carried at which a joint's load is a fifth of its servo's stall torque, and all of it: `check` warns
/// above the first load and refuses above the second.
#[test]
fn the_warning_begins_at_a_fifth_of_stall_torque_and_the_refusal_above_stall_torque() {
    let by_servos =
        tentacle_with(&[("carried_by = \"water\"\ncarried_share = 0.95", "carried_by = \"servos\"")]);
    let robot = config::parse(&by_servos, "arm.toml").unwrap().robot;
    let loads = loads::of_joints(&robot, robot.motion.tentacle().unwrap());
    let uncarried = loads.iter().filter_map(|load| load.share_of_stall).fold(0.0, f64::max);
    for (limit, code, words) in [(0.2, [0, 0], "WARNING"), (1.0, [0, 2], "would need")] {
        for (above, code) in [false, true].into_iter().zip(code) {
            let share = 1.0 - limit * if above { 1.001 } else { 0.999 } / uncarried;
            let carried = format!("carried_share = {share}");
            let name = format!("arm-at-{limit}-{above}.toml");
            let (said, exit) = checked(&name, &[("carried_share = 0.95", &carried)]);
            assert_eq!((exit, said.contains(words)), (Some(code), above), "{share}: {said}");
        }
    }
}

/// The refusals of a robot file, of a script and of the option for a stroke name the key and the reason.
#[test]
fn a_pole_that_no_arm_can_wind_round_is_a_fault_at_its_key() {
    let pole = "pole = { point_mm = [50, 0, 150], axis = [0, 1, 0], radius_mm = 30 }";
    let root = "pole = { point_mm = [0, 0, 0], axis = [0, 1, 0], radius_mm = 30 }";
    let far = "pole = { point_mm = [900, 0, 150], axis = [0, 1, 0], radius_mm = 30 }";
    for (pole_there, words) in
        [(root, "the arm's root is 0.000 m from the pole's axis"), (far, "would touch")]
    {
        let faults = config::parse(&tentacle_with(&[(pole, pole_there)]), "arm.toml").unwrap_err().faults;
        let [fault] = &faults[..] else { panic!("{faults:?}") };
        assert_eq!(fault.key, "motion.pole");
        assert!(fault.to_string().contains(words) && fault.line > 0, "{fault}");
    }
    let robot = shipped("tentacle.toml");
    let script = |pole: &str| {
        let text = format!("[[at]]\ntime_s = 0\nstroke = 'wind'\n{pole}");
        config::parse_script(&text, "script.toml", &robot)
    };
    assert!(script("").is_ok(), "the robot's own");
    assert!(script("point_mm = [50, 0, 150]\naxis = [0, 1, 0]\nradius_mm = 20").is_ok());
    let faults = script("point_mm = [900, 0, 150]\naxis = [0, 1, 0]\nradius_mm = 20").unwrap_err().faults;
    let [fault] = &faults[..] else { panic!("{faults:?}") };
    assert_eq!((fault.key.as_str(), fault.line), ("at[0].point_mm", 4));
    assert!(fault.to_string().contains("would touch the pole only after"), "{fault}");
}

#[test]
fn an_octopus_has_eight_arms_on_tendons() {
    let robot = shipped("octopus.toml");
    assert_eq!((robot.chains.len(), robot.joints.len(), robot.buses.len()), (8, 48, 8));
    for (index, chain) in robot.chains.iter().enumerate() {
        let straight = robot.tip_in_body(chain, [0.0; 6]) - chain.root_m;
        let azimuth_deg = straight.y.atan2(straight.x).to_degrees();
        let turned = (azimuth_deg - 22.5).rem_euclid(45.0);
        assert!(turned.min(45.0 - turned) < 1e-9, "arm {index} at {azimuth_deg} degrees");
        // Pulling the root section's upper cords in lifts the arm.
        assert!(robot.tip_in_body(chain, [0.5, 0.0, 0.0, 0.0, 0.0, 0.0]).z > 0.02);
    }
}

#[test]
fn a_pole_too_thin_for_the_hinges_is_refused() {
    let refused = |from: &str, to: &str| {
        let text = tentacle_with(&[(from, to)]);
        let error = config::parse(&text, "tentacle.toml").unwrap_err().to_string();
        assert!(error.contains("bend to a radius") && error.contains("pole"), "{error}");
    };
    // On a radius of 16 mm and a hair links of 30 mm turn by more than 70 degrees each.
    refused("radius_mm = 30", "radius_mm = 2");
    refused("range_deg = [-70, 70]", "range_deg = [-30, 30]");
}
