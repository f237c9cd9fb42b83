//! Calibration on simulated servos and a virtual clock, by a simulated person.
#![allow(clippy::unwrap_used, reason = "helpers of tests; a failed one should panic")]

mod common;

use std::cell::RefCell;
use std::io;
use std::path::Path;
use std::rc::Rc;

use common::{ROBOTS, config_file, servo, shipped};
use hippocamp::bus::{PortError, Ports, SimPorts};
use hippocamp::calibration::{CalibrateError, CalibrationEnd, Person, calibrate, marked_pose_rad};
use hippocamp::config::{Unit, UnitFile, load_unit, write_unit};
use hippocamp::model::{Joint, Robot};
use hippocamp::motion::Order;
use hippocamp::signals::Status;
use hippocamp::simulation;
use hippocamp::units::Time;
use hw_sim::FaultScript;
use tempfile::TempDir;
use toml::value::Date;

const DAY: Date = Date { year: 2026, month: 11, day: 25 };

/// Simulated servos that several owners share, and that note the torque at each wait.
#[derive(Clone)]
struct Servos {
    ports: Rc<RefCell<SimPorts>>,
    /// Bus, place on it, id, and register of the torque limit, a joint.
    places: Rc<Vec<(usize, usize, u8, u16)>>,
    /// Most joints that had torque at the same time, and the most torque any was permitted.
    most: Rc<RefCell<(usize, u16)>>,
}

impl Servos {
    /// Those of the robot as `built`, its joints at `pose`.
    fn new(built: &Robot, pose: &[f64], faults: &str) -> Servos {
        let faults = FaultScript::from_toml(faults).unwrap();
        let world = simulation::world_from_pose(built, pose, 1, &faults).unwrap();
        let mut counts = vec![0; built.buses.len()];
        let places = built.joints.iter().map(|joint| {
            let servo = servo(joint);
            counts[servo.bus] += 1;
            let limit = servo.model.registers.torque_limit.address;
            (servo.bus, counts[servo.bus] - 1, servo.id.0, limit)
        });
        let places = Rc::new(places.collect());
        Servos {
            ports: Rc::new(RefCell::new(SimPorts::on_virtual_clock(world))),
            places,
            most: Rc::default(),
        }
    }

    fn turn(&self, built: &Robot, joint: usize, angle_rad: f64) {
        let (bus, place, ..) = self.places[joint];
        let count = servo(&built.joints[joint]).count_of(angle_rad);
        self.ports.borrow_mut().world_mut().turn(bus, place, count);
    }

    fn is_turning(&self) -> bool {
        let ports = self.ports.borrow();
        self.places.iter().any(|&(bus, place, ..)| ports.world().is_turning(bus, place))
    }

    fn look(&self) {
        let ports = self.ports.borrow();
        let world = ports.world();
        let mut most = self.most.borrow_mut();
        let mut count = 0;
        for &(bus, _, id, limit) in self.places.iter() {
            if world.shaft(bus, id).is_some_and(|shaft| shaft.torque_on) {
                let byte = |address| world.register(bus, id, address).unwrap();
                count += 1;
                most.1 = most.1.max(u16::from_le_bytes([byte(limit), byte(limit + 1)]));
            }
        }
        most.0 = most.0.max(count);
    }
}

impl Ports for Servos {
    fn now(&mut self) -> Time {
        self.ports.borrow_mut().now()
    }

    fn discard_input(&mut self, bus: usize) -> Result<(), PortError> {
        self.ports.borrow_mut().discard_input(bus)
    }

    fn send(&mut self, bus: usize, bytes: &[u8]) -> Result<(), PortError> {
        self.ports.borrow_mut().send(bus, bytes)
    }

    fn receive(&mut self, bus: usize, into: &mut [u8]) -> Result<usize, PortError> {
        self.ports.borrow_mut().receive(bus, into)
    }

    fn wait_for_input(&mut self, deadline: Time) {
        self.ports.borrow_mut().wait_for_input(deadline);
    }

    fn wait_until(&mut self, deadline: Time) {
        self.ports.borrow_mut().wait_until(deadline);
        self.look();
    }
}

/// A person who follows instructions.
struct Somebody<'t> {
    built: &'t Robot,
    servos: Servos,
    file: &'t Path,
    /// The next answer of the person, once their hands are at rest.
    next: Option<&'static str>,
    heard: Vec<String>,
    /// Number of saves that still succeed, and whether the next one fails; then the person leaves.
    keeps: usize,
    is_last_lost: bool,
    is_called_away: bool,
    /// The joint they turn the wrong way first.
    wrong_way: Option<&'static str>,
    /// The joint whose plug the person pulls out when asked to turn it.
    pulls: Option<&'static str>,
    /// The answer of the person after the first powered turn of the joint.
    says: &'static str,
}

impl<'t> Somebody<'t> {
    fn new(built: &'t Robot, servos: &Servos, file: &'t Path) -> Somebody<'t> {
        Somebody {
            built,
            servos: servos.clone(),
            file,
            next: None,
            heard: Vec::new(),
            keeps: usize::MAX,
            is_last_lost: false,
            is_called_away: false,
            wrong_way: None,
            pulls: None,
            says: "y",
        }
    }
}

impl Person for Somebody<'_> {
    fn hear(&mut self, words: &str) {
        self.heard.push(words.to_owned());
        let (name, rest) = words.split_once(": ").unwrap_or(("", words));
        let joint = self.built.joints.iter().position(|joint| joint.name == name);
        if words.starts_with("Measured as soon") || words.starts_with("Bring the robot") {
            for (joint, angle_rad) in marked_pose_rad(self.built).into_iter().enumerate() {
                self.servos.turn(self.built, joint, angle_rad);
            }
            self.next = Some("");
        } else if let Some(joint) = joint {
            let (low, high) = self.built.joints[joint].range_rad;
            let is_wrong = self.wrong_way == Some(&*self.built.joints[joint].name);
            let (first, second) = if is_wrong { (low, high) } else { (high, low) };
            if rest.starts_with("turn it") {
                if self.pulls == Some(&*self.built.joints[joint].name) {
                    let (bus, place, ..) = self.servos.places[joint];
                    self.servos.ports.borrow_mut().world_mut().pull_servo_out(bus, place);
                }
                self.servos.turn(self.built, joint, first);
            } else if rest.starts_with("now ") {
                self.servos.turn(self.built, joint, second);
            } else if rest.starts_with("bring it") {
                self.servos.turn(self.built, joint, self.built.joints[joint].middle_rad());
            } else if rest.starts_with("did the end") {
                self.next = Some(self.says);
                if is_wrong {
                    // The joint turned the wrong way, and the person says so once.
                    (self.next, self.wrong_way) = (Some("n"), None);
                }
            }
        } else if words.ends_with("[y/n]") || words.starts_with("Press Enter") {
            self.next = Some("y");
        }
    }

    fn answer(&mut self) -> Option<String> {
        if self.servos.is_turning() { None } else { self.next.take().map(str::to_owned) }
    }

    fn wants_to_stop(&mut self) -> bool {
        self.is_called_away
    }

    fn keep(&mut self, unit: &Unit) -> io::Result<()> {
        if self.keeps == 0 {
            self.is_called_away = true;
            if self.is_last_lost {
                return Err(io::Error::from(io::ErrorKind::StorageFull));
            }
        }
        self.keeps = self.keeps.saturating_sub(1);
        write_unit(self.file, unit)?;
        Ok(())
    }
}

fn somewhere() -> (TempDir, std::path::PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("built.unit.toml");
    (folder, file)
}

/// The robot of the file `name`, and the robot as built: each horn within `most` counts of its position in the
/// file, and these servos reversed.
fn built(name: &str, most: f64, reversed: &[usize]) -> (Robot, Robot) {
    let robot = shipped(name);
    let mut built = robot.clone();
    for (index, joint) in built.joints.iter_mut().enumerate() {
        let (low, high) = joint.range_rad;
        let servo = joint.servo.as_mut().unwrap();
        servo.reversed ^= reversed.contains(&index);
        // The middle of the range at a count that a golden-ratio walk draws.
        let share = (index as f64 * 0.618_033_988_75).fract() * 2.0 - 1.0;
        servo.zero_count = 0.0;
        servo.zero_count = 2048.0 + most * share - servo.count_of(0.5 * (low + high));
    }
    (robot, built)
}

fn new_unit(name: &str) -> Unit {
    Unit { robot_file: name.to_owned(), ..Unit::default() }
}

fn run(robot: &Robot, unit: &mut Unit, person: &mut Somebody<'_>, is_unattended: bool) -> CalibrationEnd {
    let servos = person.servos.clone();
    calibrate(robot, unit, servos, person, &mut |_: &Status| Order::Go, is_unattended, DAY)
}

/// The unit file is true of the servos: every angle that it gives is the true one.
fn assert_true(robot: &Robot, built: &Robot, servos: &Servos, name: &str, file: &Path) {
    let UnitFile { unit, .. } = load_unit(file).unwrap();
    let mut applied = robot.clone();
    load_unit(file).unwrap().apply(&mut applied).unwrap();
    load_unit(file).unwrap().check_calibrated(&applied, &config_file(name)).unwrap();
    assert_eq!(unit.calibrated_on, Some(DAY));
    let ports = servos.ports.borrow();
    for (joint, (applied, built)) in applied.joints.iter().zip(&built.joints).enumerate() {
        let (bus, _, id, _) = servos.places[joint];
        let register = servo(applied).model.registers.present_position;
        let bytes = (0..4).map(|byte| {
            let is_in = byte < u16::from(register.bytes);
            if is_in { ports.world().register(bus, id, register.address + byte).unwrap() } else { 0 }
        });
        let bytes: Vec<u8> = bytes.collect();
        let count = i32::from_le_bytes(bytes.try_into().unwrap());
        let said = servo(applied).angle_of(f64::from(count));
        let shaft = ports.world().shaft(bus, id).unwrap();
        let truly = servo(built).angle_of(shaft.position_counts);
        let error_deg = (said - truly).to_degrees();
        assert!(error_deg.abs() < 0.2, "{}: off by {error_deg} degrees", built.name);
        assert_eq!(servo(applied).reversed, servo(built).reversed, "{}", built.name);
    }
}

const THREE: [usize; 3] = [2, 7, 13];

#[test]
fn calibration_finds_horn_positions_and_three_reversed_servos() {
    let (robot, built) = built("horse.toml", 2048.0, &THREE);
    let (_folder, file) = somewhere();
    let servos = Servos::new(&built, &[-0.7; 16], "");
    let mut person = Somebody::new(&built, &servos, &file);
    let ended = run(&robot, &mut new_unit("horse.toml"), &mut person, true);
    let heard = person.heard.join("\n");
    ended.result.unwrap_or_else(|error| panic!("{error}\n{heard}"));
    assert!(ended.is_end_heard);
    assert_eq!(heard.matches("the other way round than in the robot file").count(), 3, "{heard}");
    assert!(heard.contains("The cure is written into these servos permanently"), "{heard}");
    assert_true(&robot, &built, &servos, "horse.toml", &file);
    let (at_once, limit) = *servos.most.borrow();
    assert_eq!(at_once, 1, "one joint at a time has torque");
    assert!((1..=200).contains(&limit), "a fifth of its torque at most: {limit} of 1000");
}

/// The program dies right after it saves each step, or right before.
#[test]
fn a_calibration_ended_after_any_step_resumes_there() {
    let (robot, built) = built("horse.toml", 2048.0, &THREE);
    let (_folder, file) = somewhere();
    let servos = Servos::new(&built, &[-0.7; 16], "");
    for round in 0..200 {
        let known = if file.exists() { load_unit(&file).unwrap().unit } else { new_unit("horse.toml") };
        let mut person = Somebody::new(&built, &servos, &file);
        (person.keeps, person.is_last_lost) = (round % 3, true);
        let ended = run(&robot, &mut known.clone(), &mut person, true);
        match ended.result {
            Ok(()) => {
                assert!(round > 25, "{round}");
                return assert_true(&robot, &built, &servos, "horse.toml", &file);
            }
            Err(CalibrateError::Keep(_) | CalibrateError::Left) => {}
            Err(error) => panic!("round {round}: {error}"),
        }
    }
    panic!("it never ends");
}

#[test]
fn the_check_by_the_person_corrects_a_careless_sweep() {
    for name in ROBOTS {
        // Horns roughly where the robot file has them.
        let (robot, built) = built(name, 100.0, &[]);
        let (_folder, file) = somewhere();
        let servos = Servos::new(&built, &marked_pose_rad(&built), "");
        let mut person = Somebody::new(&built, &servos, &file);
        person.wrong_way = Some("left_fore.elbow");
        let ended = run(&robot, &mut new_unit(name), &mut person, false);
        let heard = person.heard.join("\n");
        ended.result.unwrap_or_else(|error| panic!("{name}: {error}\n{heard}"));
        assert_eq!(heard.matches("which is recorded. Once more").count(), 1, "{heard}");
        assert!(!heard.contains("The cure"), "{name}: {heard}");
        assert_true(&robot, &built, &servos, name, &file);
    }
}

#[test]
fn a_dynamixel_with_its_seam_in_range_must_be_remounted_and_the_others_are_kept() {
    let name = "horse-dynamixel.toml";
    let (robot, mut built) = built(name, 100.0, &[]);
    let elbow = built.joints.iter().position(|joint| joint.name == "left_fore.elbow").unwrap();
    built.joints[elbow].servo.as_mut().unwrap().zero_count += 1900.0;
    let (_folder, file) = somewhere();
    let servos = Servos::new(&built, &marked_pose_rad(&built), "");
    let mut person = Somebody::new(&built, &servos, &file);
    let error = run(&robot, &mut new_unit(name), &mut person, true).result.unwrap_err();
    assert!(matches!(&error, CalibrateError::Mount { joints } if joints == &["left_fore.elbow"]), "{error}");
    assert!(error.to_string().contains("take the horn off"), "{error}");
    let kept = load_unit(&file).unwrap().unit;
    assert_eq!(kept.joints.len(), 15);
    assert!(kept.joints.iter().all(|entry| entry.name != "left_fore.elbow"));
}

#[test]
fn a_servo_pulled_out_is_named_and_nothing_is_lost() {
    let (robot, built) = built("horse.toml", 100.0, &THREE);
    let (_folder, file) = somewhere();
    let servos = Servos::new(&built, &marked_pose_rad(&built), "");
    let mut person = Somebody::new(&built, &servos, &file);
    person.pulls = Some("left_fore.scapula");
    let error = run(&robot, &mut new_unit("horse.toml"), &mut person, true).result.unwrap_err();
    let said = "servo 5 of joint left_fore.scapula on bus main is not heard any more: ";
    assert!(error.to_string().starts_with(said), "{error}");
    let mut known = load_unit(&file).unwrap().unit;
    assert_eq!(known.joints.iter().filter(|entry| entry.reversed.is_some()).count(), 4);

    // Without the servo, the start reports it; with it, the calibration continues.
    let mut person = Somebody::new(&built, &servos, &file);
    let error = run(&robot, &mut known, &mut person, true).result.unwrap_err();
    assert!(error.to_string().contains("did not answer a ping"), "{error}");
    servos.ports.borrow_mut().world_mut().plug_servo_in(0, 4);
    let mut person = Somebody::new(&built, &servos, &file);
    run(&robot, &mut known, &mut person, true).result.unwrap();
    assert_true(&robot, &built, &servos, "horse.toml", &file);
}

#[test]
fn a_jammed_joint_is_reported_and_the_others_are_checked() {
    let (robot, built) = built("horse.toml", 100.0, &[]);
    let (_folder, file) = somewhere();
    let servos = Servos::new(&built, &marked_pose_rad(&built), "");
    run(&robot, &mut new_unit("horse.toml"), &mut Somebody::new(&built, &servos, &file), true)
        .result
        .unwrap();
    let mut known = load_unit(&file).unwrap().unit;
    known.joints[2..4].iter_mut().for_each(|entry| entry.direction_checked = false);
    // These servos cannot be centred: nothing was written into them.
    let jam = "[[fault]]\nkind = 'stuck'\nat_s = 0\nid = 3\n";
    let servos = Servos::new(&built, &built.joints.iter().map(Joint::middle_rad).collect::<Vec<_>>(), jam);
    let error = run(&robot, &mut known, &mut Somebody::new(&built, &servos, &file), true).result.unwrap_err();
    assert!(matches!(&error, CalibrateError::Stuck { joints } if joints == &["left_hind.stifle"]), "{error}");
    assert!(!known.joints[2].direction_checked && known.joints[3].direction_checked);
}
