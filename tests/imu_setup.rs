//! A unit is found, set up and its mounting measured, on a virtual clock, by a person who tilts the robot.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod common;

use std::cell::RefCell;
use std::io;
use std::rc::Rc;
use std::time::Duration;

use common::shipped;
use glam::{DQuat, DVec3, EulerRot};
use hippocamp::calibration::Person;
use hippocamp::calibration::{FoundImu, ImuSetupError, set_up_imu};
use hippocamp::config::Unit;
use hippocamp::imu::{ImuLine, ImuLineError};
use hippocamp::model::{ImuSettings, Robot};
use hw_sim::{FaultScript, ImuConfig, World};

/// A unit on its line.
#[derive(Clone)]
struct Line(Rc<RefCell<World>>);

impl ImuLine for Line {
    fn now(&mut self) -> Duration {
        Duration::from_nanos(self.0.borrow().now_ns())
    }

    fn set_baud(&mut self, baud: u32) -> Result<(), ImuLineError> {
        self.0.borrow_mut().set_imu_host_baud(baud);
        Ok(())
    }

    fn send(&mut self, bytes: &[u8]) -> Result<(), ImuLineError> {
        self.0.borrow_mut().imu_send(bytes).map_err(|error| ImuLineError(error.to_string()))
    }

    fn receive(&mut self, into: &mut [u8]) -> Result<usize, ImuLineError> {
        self.0.borrow_mut().imu_receive(into).map_err(|error| ImuLineError(error.to_string()))
    }

    fn wait(&mut self, time: Duration) {
        let mut world = self.0.borrow_mut();
        let until_ns = world.now_ns() + u64::try_from(time.as_nanos()).unwrap();
        world.advance_to(until_ns);
    }
}

/// A person who tilts the trunk as asked, but not exactly: the attitudes for level, nose down and left side down.
struct Hands {
    world: Rc<RefCell<World>>,
    nose_down: [f64; 3],
    left_down: [f64; 3],
    heard: Vec<String>,
    is_asked: bool,
}

impl Person for Hands {
    fn hear(&mut self, words: &str) {
        let to_deg = if words.contains("nose") {
            self.nose_down
        } else if words.contains("left side") {
            self.left_down
        } else {
            [0.0; 3]
        };
        if words.contains("press Enter") {
            assert!(!words.contains("moved"), "{words}");
            self.world.borrow_mut().tilt_by_hand(to_deg.map(f64::to_radians));
            self.is_asked = true;
        }
        self.heard.push(words.to_owned());
    }

    fn answer(&mut self) -> Option<String> {
        let is_there = self.is_asked && !self.world.borrow().is_tilting();
        self.is_asked &= !is_there;
        is_there.then(String::new)
    }

    fn wants_to_stop(&mut self) -> bool {
        self.heard.len() > 50
    }

    fn keep(&mut self, _unit: &Unit) -> io::Result<()> {
        Ok(())
    }
}

const NOSE_DOWN: [f64; 3] = [0.0, 30.0, 0.0];
const LEFT_DOWN: [f64; 3] = [-30.0, 0.0, 0.0];

/// A new unit mounted at `rpy_deg`, with the errors of the robot file; and its world.
fn built(robot: &Robot, rpy_deg: [f64; 3]) -> World {
    let [roll, pitch, yaw] = rpy_deg.map(f64::to_radians);
    let noise = robot.imu.as_ref().unwrap().noise;
    let config = ImuConfig {
        rotation: DQuat::from_euler(EulerRot::ZYX, yaw, pitch, roll).to_array(),
        acceleration_noise_m_s2: noise.acceleration_m_s2,
        acceleration_bias_m_s2: noise.acceleration_bias_m_s2,
        rate_noise_rad_s: noise.rate_rad_s,
        rate_bias_rad_s: noise.rate_bias_rad_s,
        angle_noise_rad: noise.angle_rad,
        angle_drift_rad: noise.angle_drift_rad,
        ..ImuConfig::perfect()
    };
    let mut world = World::new(&[], FaultScript::default(), 1).unwrap();
    world.fit_imu(&config, 3).unwrap();
    world.reset_imu_to_factory();
    world
}

fn set_up_by(
    world: World,
    settings: &ImuSettings,
    nose_down: [f64; 3],
    left_down: [f64; 3],
) -> (Result<FoundImu, ImuSetupError>, Rc<RefCell<World>>) {
    let world = Rc::new(RefCell::new(world));
    let mut person =
        Hands { world: Rc::clone(&world), nose_down, left_down, heard: Vec::new(), is_asked: false };
    (set_up_imu(&mut Line(Rc::clone(&world)), settings, &mut person), world)
}

/// How far two mountings are apart, degrees.
fn apart_deg(a: [f64; 3], b: [f64; 3]) -> f64 {
    let turn = |rpy_deg: [f64; 3]| {
        let [roll, pitch, yaw] = rpy_deg.map(f64::to_radians);
        DQuat::from_euler(EulerRot::ZYX, yaw, pitch, roll)
    };
    turn(a).angle_between(turn(b)).to_degrees()
}

#[test]
fn a_unit_out_of_its_box_is_set_up_however_it_is_built_in() {
    let robot = shipped("horse.toml");
    let settings = robot.imu.clone().unwrap();
    for rpy_deg in [[0.0, 0.0, -90.0], [180.0, 0.0, 35.0], [-90.0, 0.0, 90.0], [10.0, -20.0, 160.0]] {
        let (found, world) = set_up_by(built(&robot, rpy_deg), &settings, NOSE_DOWN, LEFT_DOWN);
        let found = found.unwrap_or_else(|error| panic!("{rpy_deg:?}: {error}"));
        // 0.1 m/s^2 of offset is 0.6 degrees.
        let off_deg = apart_deg(found.rpy_deg, rpy_deg);
        assert!(off_deg < 2.0, "{rpy_deg:?}: {:?}, {off_deg} degrees off", found.rpy_deg);
        assert_eq!((found.baud, found.rates_reversed), (115_200, false));
        // It keeps its settings.
        let mut world = world.borrow_mut();
        world.restart_imu();
        let mut bytes = [0; 4096];
        let _ = world.imu_receive(&mut bytes);
        let later_ns = world.now_ns() + 500_000_000;
        world.advance_to(later_ns);
        assert!(world.imu_receive(&mut bytes).unwrap() >= 99 * 33, "200 a second at 115200 bit/s");
    }
}

#[test]
fn missing_or_contradictory_tilts_are_reported() {
    let robot = shipped("horse.toml");
    let settings = robot.imu.clone().unwrap();
    let upright = [0.0, 0.0, -90.0];
    let refused = |nose_down, left_down| {
        set_up_by(built(&robot, upright), &settings, nose_down, left_down).0.unwrap_err().to_string()
    };
    let said = refused([0.0, 3.0, 0.0], LEFT_DOWN);
    assert!(said.contains("nose down: it was tilted by") && said.contains("10 to 80"), "{said}");
    let said = refused(NOSE_DOWN, [30.0, 0.0, 0.0]);
    assert!(said.contains("the other way round"), "{said}");
    let said = refused(NOSE_DOWN, [-20.0, 20.0, 0.0]);
    assert!(said.contains("do not match"), "{said}");
}

#[test]
fn a_missing_or_silent_unit_is_reported() {
    let robot = shipped("horse.toml");
    let settings = robot.imu.clone().unwrap();
    let fault = |kind: &str, at_s: f64| {
        let script = format!("[[fault]]\nkind = '{kind}'\nat_s = {at_s}");
        let mut world = World::new(&[], FaultScript::from_toml(&script).unwrap(), 1).unwrap();
        world.fit_imu(&ImuConfig::perfect(), 1).unwrap();
        set_up_by(world, &settings, NOSE_DOWN, LEFT_DOWN).0.unwrap_err()
    };
    assert_eq!(fault("imu-silent", 0.0), ImuSetupError::Silent);
    assert_eq!(fault("imu-garbled", 0.0), ImuSetupError::Silent);
    assert_eq!(fault("imu-silent", 2.5), ImuSetupError::Lost);
    assert!(matches!(fault("imu-unplugged", 2.5), ImuSetupError::Line(_)));
}

#[test]
fn a_calibrated_mounting_gives_the_right_vertical() {
    // The purpose of the setup: the body's attitude from a unit mounted upside down, turned by 35 degrees.
    let robot = shipped("horse.toml");
    let mut settings = robot.imu.clone().unwrap();
    let rpy_deg = [180.0, 0.0, 35.0];
    let (found, world) = set_up_by(built(&robot, rpy_deg), &settings, NOSE_DOWN, LEFT_DOWN);
    let [roll, pitch, yaw] = found.unwrap().rpy_deg.map(f64::to_radians);
    settings.rotation = DQuat::from_euler(EulerRot::ZYX, yaw, pitch, roll);
    let mut sampler = hippocamp::imu::Sampler::default();
    let mut world = world.borrow_mut();
    world.tilt_by_hand([0.2, 0.1, 0.0]);
    let until_ns = world.now_ns() + 2_000_000_000;
    let (mut last, mut bytes) = (None, [0; 4096]);
    while world.now_ns() < until_ns {
        let next_ns = world.now_ns() + 100_000_000;
        world.advance_to(next_ns);
        let count = world.imu_receive(&mut bytes).unwrap();
        last = bytes[..count].iter().filter_map(|byte| sampler.push(*byte)).last().or(last);
    }
    let reading = hippocamp::imu::in_body(&last.unwrap(), &settings);
    let off = DVec3::new(reading.roll_rad - 0.2, reading.pitch_rad - 0.1, 0.0);
    assert!(off.length().to_degrees() < 2.0, "{reading:?}");
}
