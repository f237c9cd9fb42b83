//! The URDF of every robot that comes with the program, in five tools that read URDF.
//!
//! The program says what it exports: masses, tips and centres of mass at poses within the joints' ranges, and each
//! link as its own physics simulates it. `tests/python/check_urdf.py` compares.

use std::path::{Path, PathBuf};
use std::process::Command;

use glam::DVec3;
use hippocamp::model::Robot;
use hippocamp::{config, simulation};
use hw_sim::Model;
use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::{Rng, SeedableRng};
use serde_json::{Value, json};

use super::{folder, hippocamp, run, tool};

/// Every robot but the octopus, whose arms are on cords.
const ROBOTS: [&str; 5] = ["horse", "horse-dynamixel", "figure", "tentacle", "thoroughbred"];
const POSES: usize = 5;

/// Exports every robot and opens it in `name`.
fn open_in(name: &str) {
    let Some(python) = tool("HIPPOCAMP_PYTHON") else { return };
    let folder = folder(&format!("urdf_{name}"));
    let robots: Vec<Value> = ROBOTS.iter().map(|robot| expected(robot, &folder)).collect();
    let file = folder.join("expected.json");
    std::fs::write(&file, serde_json::to_string(&robots).unwrap()).unwrap();
    let said = run(Command::new(python).arg("tests/python/check_urdf.py").arg(name).arg(file));
    let opened = said.lines().filter(|line| ROBOTS.iter().any(|robot| line.starts_with(robot)));
    assert_eq!(opened.count(), ROBOTS.len(), "{said}");
}

/// Exports a robot; what the program says about it.
fn expected(name: &str, folder: &Path) -> Value {
    let (file, urdf) = (format!("config/{name}.toml"), folder.join(format!("{name}.urdf")));
    run(hippocamp().args(["check", &file, "--urdf"]).arg(&urdf));
    let robot = config::load(&PathBuf::from(&file)).unwrap().robot;
    let mut chance = Pcg64Mcg::seed_from_u64(1);
    json!({
        "name": name,
        "urdf": urdf,
        "mass_kg": robot.mass_kg(),
        "chains": robot.chains.iter().map(|chain| &chain.name).collect::<Vec<_>>(),
        "joints": robot.joints.iter().map(|joint| joint_facts(&robot, joint)).collect::<Vec<_>>(),
        "poses": (0..POSES).map(|_| pose(&robot, &mut chance)).collect::<Vec<_>>(),
        "simulated": simulated(&robot),
    })
}

fn joint_facts(robot: &Robot, joint: &hippocamp::model::Joint) -> Value {
    let servo = joint.servo.map(|servo| servo.model);
    let simulated = servo.map(|servo| Model::named(servo.name).unwrap());
    json!({
        "name": joint.name,
        "low_rad": joint.range_rad.0,
        "high_rad": joint.range_rad.1,
        "effort_nm": servo.map_or(0.0, |servo| servo.stall_torque_nm),
        "speed_rad_s": servo.map_or(0.0, |servo| servo.no_load_speed_rad_s),
        "damping_nm_s": robot.physics.as_ref().map_or(0.0, |physics| physics.viscosity_nm_s),
        "friction_nm": simulated.map_or(0.0, |model| model.friction_nm),
        "length_m": joint.link_m.length(),
    })
}

/// A pose within the joints' ranges, and where it puts tips and the centre of mass.
fn pose(robot: &Robot, chance: &mut Pcg64Mcg) -> Value {
    let angle = |joint: &hippocamp::model::Joint| {
        let share = f64::from(chance.next_u32()) / f64::from(u32::MAX);
        joint.range_rad.0 + share * (joint.range_rad.1 - joint.range_rad.0)
    };
    let angles: Vec<f64> = robot.joints.iter().map(angle).collect();
    let tip = |chain: &hippocamp::model::Chain| {
        let place = robot.tip_in_body(chain, angles[chain.joints.clone()].iter().copied());
        (chain.name.clone(), json!(place.to_array()))
    };
    json!({
        "angles_rad": angles,
        "tips_m": robot.chains.iter().map(tip).collect::<serde_json::Map<_, _>>(),
        "center_of_mass_m": DVec3::to_array(&robot.center_of_mass_in_body(&angles)),
    })
}

/// The mass of every link, and of the trunk, as the physics of this program has it.
fn simulated(robot: &Robot) -> serde_json::Map<String, Value> {
    let Some(physics) = &robot.physics else { return serde_json::Map::new() };
    let body = simulation::body(robot, physics);
    let links = body.chains.iter().flat_map(|chain| &chain.links).map(|link| link.mass);
    let names = robot.joints.iter().map(|joint| format!("{}.link", joint.name));
    let fact = |mass: hw_sim::body::Mass| {
        json!({
            "mass_kg": mass.mass_kg, "center_m": mass.center_m, "inertia_kg_m2": mass.inertia_kg_m2(),
        })
    };
    let all = names.zip(links).chain([("body".to_owned(), body.trunk.mass())]);
    let all: serde_json::Map<_, _> = all.map(|(name, mass)| (name, fact(mass))).collect();
    assert_eq!(all.len(), robot.joints.len() + 1);
    all
}

#[test]
fn mujoco_opens_the_urdf_and_has_pinocchios_mass_matrix() {
    open_in("mujoco");
}

#[test]
fn pybullet_opens_the_urdf_and_weighs_what_check_says() {
    open_in("pybullet");
}

#[test]
fn drake_opens_the_urdf_and_gravity_pulls_as_in_pinocchio() {
    open_in("drake");
}

#[test]
fn pinocchio_opens_the_urdf_and_its_mass_matrix_is_regular() {
    open_in("pinocchio");
}

#[test]
fn yourdfpy_opens_the_urdf_and_finds_each_link_as_it_is_simulated() {
    open_in("yourdfpy");
}
