//! A robot's new servos behind pseudo-terminals, and a person who plugs them in as asked.

use std::fs;
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use hippocamp::config;
use hippocamp::model::Robot;
use hippocamp::platform::request_real_time;
use hippocamp::simulation;
use hw_sim::FaultScript;
use hw_sim::pty::PtyServer;
use tempfile::TempDir;

pub(crate) struct Boxed {
    pub(crate) robot: Robot,
    pub(crate) server: PtyServer,
    pub(crate) folder: TempDir,
    robot_file: PathBuf,
}

impl Boxed {
    /// The servos of the shipped robot `file`, new and unplugged.
    pub(crate) fn new(file: &str) -> Boxed {
        let folder = tempfile::tempdir().unwrap();
        let robot_file = folder.path().join(file);
        fs::copy(Path::new("config").join(file), &robot_file).unwrap();
        let robot = config::load(&robot_file).unwrap().robot;
        let mut without_adapters = Robot { physics: None, ..robot.clone() };
        without_adapters.buses.iter_mut().for_each(|bus| bus.adapter_latency_us = 0);
        let mut world = simulation::world(&without_adapters, 1, &FaultScript::default()).unwrap();
        for joint in &robot.joints {
            let (bus, place) = place(&robot, &joint.name);
            world.make_new(bus, place);
            world.pull_servo_out(bus, place);
        }
        // Servos of a real line do not wait for a processor.
        let server =
            PtyServer::start_prepared(world, folder.path(), || drop(request_real_time(None))).unwrap();
        Boxed { robot, server, folder, robot_file }
    }

    pub(crate) fn place(&self, joint: &str) -> (usize, usize) {
        place(&self.robot, joint)
    }

    pub(crate) fn plug_in(&self, joint: &str) {
        let (bus, place) = self.place(joint);
        self.server.with_world(|world| world.plug_servo_in(bus, place));
    }

    pub(crate) fn pull_out(&self, joint: &str) {
        let (bus, place) = self.place(joint);
        self.server.with_world(|world| world.pull_servo_out(bus, place));
    }

    pub(crate) fn id_of(&self, joint: &str) -> u8 {
        let (bus, place) = self.place(joint);
        self.server.with_world(|world| world.id_at(bus, place)).unwrap()
    }

    /// Bytes of the control table of the servo of `joint`, once it has its id.
    pub(crate) fn bytes(&self, joint: &str, addresses: std::ops::Range<u16>) -> Vec<Option<u8>> {
        let (bus, _) = self.place(joint);
        let id = self.id_of(joint);
        self.server.with_world(|world| addresses.map(|address| world.register(bus, id, address)).collect())
    }

    pub(crate) fn device(&self, joint: &str) -> &Path {
        &self.server.paths()[self.place(joint).0]
    }

    pub(crate) fn unit_file(&self) -> PathBuf {
        self.robot_file.with_extension("unit.toml")
    }

    /// The backup of the servo of `joint`.
    pub(crate) fn backup(&self, joint: &str) -> PathBuf {
        self.robot_file.with_extension("servos").join(format!("{joint}.toml"))
    }

    /// Runs `setup --yes`, plugs in each servo it asks for, and shows `look` every line it says. Its exit code, none
    /// if it was killed, and all it said.
    pub(crate) fn set_up(&self, mut look: impl FnMut(&str, &mut Child)) -> (Option<i32>, String) {
        let mut command = self.setup_command();
        command.arg("--yes");
        let mut child =
            command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        let mut text = String::new();
        for line in BufReader::new(child.stdout.take().unwrap()).lines() {
            let line = line.unwrap();
            text.push_str(&line);
            text.push('\n');
            if let Some((joint, _)) = line.split_once(": plug in its new ") {
                self.plug_in(joint);
            }
            look(&line, &mut child);
        }
        child.stderr.take().unwrap().read_to_string(&mut text).unwrap();
        (child.wait().unwrap().code(), text)
    }

    /// `setup`, as a person types it.
    pub(crate) fn setup_command(&self) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_hippocamp"));
        command.arg("setup").arg(&self.robot_file);
        if !self.unit_file().exists() {
            for (bus, path) in self.robot.buses.iter().zip(self.server.paths()) {
                command.arg("--port").arg(format!("{}={}", bus.name, path.display()));
            }
        }
        command
    }

    /// Every servo answers as the robot file says.
    pub(crate) fn assert_all_set_up(&self) {
        for joint in &self.robot.joints {
            assert_eq!(self.id_of(&joint.name), joint.servo.unwrap().id.0, "{}", joint.name);
        }
    }
}

/// Bus, and place among the servos of it.
fn place(robot: &Robot, joint: &str) -> (usize, usize) {
    let index = robot.joints.iter().position(|of| of.name == joint).unwrap();
    let bus = robot.joints[index].servo.unwrap().bus;
    (bus, robot.joints[..index].iter().filter(|of| of.servo.unwrap().bus == bus).count())
}
