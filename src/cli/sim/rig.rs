//! The robot as assembled, and the look-up of servos by typed name.

use anyhow::Result;
use hw_sim::pty::PtyServer;
use hw_sim::{FaultScript, World};
use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::{Rng, SeedableRng};

use super::super::{BadInput, SimArguments};
use crate::config::nearest;
use crate::model::{Robot, Servo};
use crate::simulation;

/// Counts in a turn, for the random angle of a horn.
const COUNTS_PER_TURN: f64 = 4096.0;

/// The part of the robot that a typed word names.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Target {
    /// A joint, by its index in the robot, and its servo.
    Joint(usize),
    /// A bus's adapter, by its index in the robot.
    Bus(usize),
}

/// A robot as built: with its horns as mounted, and some servos the other way round.
#[derive(Debug)]
pub(super) struct Rig {
    robot: Robot,
    /// Index of each joint's servo among those of its bus.
    places: Vec<usize>,
    is_factory_new: bool,
}

impl Rig {
    /// Assembles the robot as `options` say.
    ///
    /// # Errors
    /// Bad input: `--reversed` names an unknown joint.
    pub(super) fn new(mut robot: Robot, options: &SimArguments) -> Result<Rig> {
        // The terminal takes the place of the adapter.
        robot.buses.iter_mut().for_each(|bus| bus.adapter_latency_us = 0);
        let mut counted = vec![0; robot.buses.len()];
        let mut place = |servo: &Option<Servo>| {
            let count = servo.and_then(|servo| counted.get_mut(servo.bus));
            count.map_or(0, |count| {
                *count += 1;
                *count - 1
            })
        };
        let places = robot.joints.iter().map(|joint| place(&joint.servo)).collect();
        let mut rig = Rig { robot, places, is_factory_new: options.factory_new };
        if options.factory_new {
            let mut chance = Pcg64Mcg::seed_from_u64(options.seed);
            for servo in rig.robot.joints.iter_mut().filter_map(|joint| joint.servo.as_mut()) {
                let share = f64::from(chance.next_u32()) / 2f64.powi(32);
                servo.zero_count = match options.horns_within_deg {
                    Some(degrees) => {
                        servo.zero_count + (2.0 * share - 1.0) * f64::from(degrees) / 360.0 * COUNTS_PER_TURN
                    }
                    None => share * COUNTS_PER_TURN,
                };
            }
        }
        for name in &options.reversed {
            match rig.target(name) {
                Ok(Target::Joint(joint)) => {
                    if let Some(servo) = &mut rig.robot.joints[joint].servo {
                        servo.reversed = !servo.reversed;
                        if options.horns_within_deg.is_some() {
                            // The middle of the range stays where it was put.
                            servo.zero_count = COUNTS_PER_TURN - servo.zero_count;
                        }
                    }
                }
                Ok(Target::Bus(_)) => {
                    return Err(
                        BadInput(format!("--reversed {name}: expected a joint; this is a bus")).into()
                    );
                }
                Err(error) => return Err(BadInput(format!("--reversed {error}")).into()),
            }
        }
        Ok(rig)
    }

    /// A world with the robot limp in it, at random angles. Servos out of the box lie beside it, none plugged in.
    pub(super) fn world(&self, options: &SimArguments, faults: &FaultScript) -> Result<World> {
        let mut world = simulation::world(&self.robot, options.seed, faults)?;
        if self.is_factory_new {
            for (bus, place) in self.joints().filter_map(|joint| self.place(joint)) {
                world.make_new(bus, place);
                world.pull_servo_out(bus, place);
            }
        }
        Ok(world)
    }

    /// All joints that have a servo.
    pub(super) fn joints(&self) -> impl Iterator<Item = usize> {
        (0..self.robot.joints.len()).filter(|joint| self.robot.joints[*joint].servo.is_some())
    }

    /// Bus of a joint's servo, and its index there.
    pub(super) fn place(&self, joint: usize) -> Option<(usize, usize)> {
        Some((self.robot.joints.get(joint)?.servo?.bus, self.places[joint]))
    }

    /// A joint's name.
    pub(super) fn joint_name(&self, joint: usize) -> &str {
        &self.robot.joints[joint].name
    }

    /// A bus's name.
    pub(super) fn bus_name(&self, bus: usize) -> &str {
        &self.robot.buses[bus].name
    }

    /// Encoder count of a joint's servo when the joint is at `angle_rad`.
    pub(super) fn count_of(&self, joint: usize, angle_rad: f64) -> Option<f64> {
        Some(self.robot.joints.get(joint)?.servo?.count_of(angle_rad))
    }

    /// The angle of a joint (rad) when its servo's encoder is at `counts`.
    pub(super) fn angle_of(&self, joint: usize, counts: f64) -> Option<f64> {
        let (zero, one) = (self.count_of(joint, 0.0)?, self.count_of(joint, 1.0)?);
        Some((counts - zero) / (one - zero))
    }

    /// The part that `word` names: a joint, BUS:ID with the id of the robot file, or a bus.
    ///
    /// # Errors
    /// If it names none; the message lists the valid ones.
    pub(super) fn target(&self, word: &str) -> Result<Target, String> {
        let (joints, buses) = (&self.robot.joints, &self.robot.buses);
        if let Some(joint) = joints.iter().position(|joint| joint.name == word && joint.servo.is_some()) {
            return Ok(Target::Joint(joint));
        }
        if let Some(bus) = buses.iter().position(|bus| bus.name == word) {
            return Ok(Target::Bus(bus));
        }
        let is_meant = |servo: &Servo| {
            let (bus, id) = word.rsplit_once(':').unwrap_or_default();
            buses[servo.bus].name == bus && id.parse() == Ok(servo.id.0)
        };
        if let Some(joint) = joints.iter().position(|joint| joint.servo.as_ref().is_some_and(is_meant)) {
            return Ok(Target::Joint(joint));
        }
        let names = || joints.iter().map(|joint| &joint.name).chain(buses.iter().map(|bus| &bus.name));
        let near = nearest(word, names().map(String::as_str));
        let near = near.map(|near| format!("; did you mean {near}?")).unwrap_or_default();
        let example = joints.first().map_or("", |joint| joint.name.as_str());
        Err(format!(
            "{word}: there is no such servo; expected a joint such as {example}, BUS:ID with the id in the robot \
             file, or a bus{near}"
        ))
    }

    /// Prints the links and the servos there.
    pub(super) fn announce(&self, server: &PtyServer) {
        let count = self.joints().count();
        let state = match self.is_factory_new {
            true => "new out of the box, none plugged in",
            false => "set up as its file says",
        };
        say!("{}: {count} servos in real time, {state}", self.robot.name);
        for (bus, path) in self.robot.buses.iter().zip(server.paths()) {
            let terminal = std::fs::read_link(path).unwrap_or_default();
            let (name, protocol) = (&bus.name, bus.protocol.name());
            say!("  {name}: {} -> {} ({protocol}, {} baud)", path.display(), terminal.display(), bus.baud);
        }
        if let Some(path) = server.imu_path() {
            let terminal = std::fs::read_link(path).unwrap_or_default();
            let baud = self.robot.imu.as_ref().map_or(0, |imu| imu.baud);
            say!("  imu: {} -> {} (WitMotion, {baud} baud)", path.display(), terminal.display());
        }
        say!("Type help for a list of commands; Ctrl-C ends.");
    }
}
