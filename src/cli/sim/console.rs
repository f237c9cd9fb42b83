//! Commands typed while the servos run. Each gets at least one line in answer, the last when it is done.

use std::ops::ControlFlow;
use std::time::Duration;

use crossbeam_channel::{Receiver, never, select};
use hw_sim::World;
use hw_sim::pty::PtyServer;

use super::rig::{Rig, Target};
use crate::cli::say::lines;

/// Time between looks at a turning joint.
const LOOK_EVERY: Duration = Duration::from_millis(5);

const HELP: &str = "  plug SERVO...              connect: it starts from its EEPROM, without torque
  unplug SERVO...            disconnect
  turn SERVO DEG [SERVO DEG...]  turn joints by hand to these angles, in degrees; motors with torque do not yield
  tilt ROLL PITCH YAW        turn the trunk by hand to these angles, in degrees: only its inertial measurement unit
                             feels it, and only without physics (--no-physics)
  list                       every servo: its joint, id, angle and torque
  quit                       end
SERVO is a joint (left_hind.hip), BUS:ID with the id of the robot file, or all; the name of a bus instead stands for its adapter.";

/// Standard input and the servos it controls.
pub(super) struct Console<'a> {
    pub(super) rig: &'a Rig,
    pub(super) server: &'a PtyServer,
    pub(super) lines: Receiver<String>,
    /// A message here ends the program.
    pub(super) stop: Receiver<()>,
}

impl Console<'_> {
    /// Carries out typed commands until a signal or `quit`.
    pub(super) fn run(mut self) {
        loop {
            let line = select! {
                recv(self.stop) -> _ => return,
                recv(self.lines) -> line => line,
            };
            match line.as_deref().map(str::trim) {
                Ok("quit") => return,
                Ok(line) => match self.obey(line) {
                    Ok(ControlFlow::Continue(())) => {}
                    Ok(ControlFlow::Break(())) => return,
                    Err(error) => say!("{error}"),
                },
                // When standard input ends, the servos keep running.
                Err(_) => self.lines = never(),
            }
        }
    }

    /// Carries out the command in a line; breaks if a signal came meanwhile.
    fn obey(&self, line: &str) -> Result<ControlFlow<()>, String> {
        let words: Vec<&str> = line.split_whitespace().collect();
        match words.as_slice() {
            [] => {}
            ["help"] => lines(HELP),
            ["list"] => self.joints(&["all"])?.into_iter().for_each(|joint| self.show(joint)),
            ["plug", of @ ..] if !of.is_empty() => self.plug(of, true)?,
            ["unplug", of @ ..] if !of.is_empty() => self.plug(of, false)?,
            ["turn", pairs @ ..] if !pairs.is_empty() && pairs.len() % 2 == 0 => return self.turn(pairs),
            ["tilt", roll, pitch, yaw] => return self.tilt([roll, pitch, yaw]),
            _ => {
                say!("{line}: expected one of these:");
                lines(HELP);
            }
        }
        Ok(ControlFlow::Continue(()))
    }

    fn plug(&self, of: &[&str], is_in: bool) -> Result<(), String> {
        let done = if is_in { "plugged in" } else { "unplugged" };
        for target in self.targets(of)? {
            let name = match target {
                Target::Joint(joint) => {
                    let change = if is_in { World::plug_servo_in } else { World::pull_servo_out };
                    if let Some((bus, place)) = self.rig.place(joint) {
                        self.server.with_world(|world| change(world, bus, place));
                    }
                    self.rig.joint_name(joint)
                }
                Target::Bus(bus) => {
                    self.server.with_world(|world| match is_in {
                        true => world.plug_in(bus),
                        false => world.unplug(bus, u64::MAX),
                    });
                    self.rig.bus_name(bus)
                }
            };
            say!("{name}: {done}");
        }
        Ok(())
    }

    /// Turns joints to angles, and returns when they are there or a motor resists.
    fn turn(&self, pairs: &[&str]) -> Result<ControlFlow<()>, String> {
        let mut turned = Vec::new();
        for pair in pairs.chunks_exact(2) {
            let (name, angle) = (pair[0], pair[1]);
            let angle_deg: f64 =
                angle.parse().ok().filter(|angle: &f64| angle.is_finite()).ok_or_else(|| {
                    format!("turn {name} {angle}: expected an angle in degrees, such as -12.5")
                })?;
            turned.extend(self.joints(&[name])?.into_iter().map(|joint| (joint, angle_deg.to_radians())));
        }
        for &(joint, angle_rad) in &turned {
            if let (Some((bus, place)), Some(counts)) =
                (self.rig.place(joint), self.rig.count_of(joint, angle_rad))
            {
                self.server.with_world(|world| world.turn(bus, place, counts));
            }
        }
        for (joint, _) in turned {
            let Some((bus, place)) = self.rig.place(joint) else { continue };
            while self.server.with_world(|world| world.is_turning(bus, place)) {
                if self.stop.recv_timeout(LOOK_EVERY).is_ok() {
                    return Ok(ControlFlow::Break(()));
                }
            }
            self.show(joint);
        }
        Ok(ControlFlow::Continue(()))
    }

    /// Tilts the trunk, and returns when it is there.
    fn tilt(&self, words: [&str; 3]) -> Result<ControlFlow<()>, String> {
        let mut angles_rad = [0.0; 3];
        for (angle_rad, word) in angles_rad.iter_mut().zip(words) {
            let angle_deg = word.parse().ok().filter(|angle: &f64| angle.is_finite());
            let expected = || format!("tilt {word}: expected three angles in degrees, such as tilt 0 30 0");
            *angle_rad = angle_deg.ok_or_else(expected)?.to_radians();
        }
        if self.server.with_world(|world| world.body().is_some() || !world.has_imu()) {
            return Err(
                "tilt: expected a robot with an inertial measurement unit, and --no-physics".to_owned()
            );
        }
        self.server.with_world(|world| world.tilt_by_hand(angles_rad));
        while self.server.with_world(|world| world.is_tilting()) {
            if self.stop.recv_timeout(LOOK_EVERY).is_ok() {
                return Ok(ControlFlow::Break(()));
            }
        }
        say!("trunk: at roll {}, pitch {}, yaw {} degrees", words[0], words[1], words[2]);
        Ok(ControlFlow::Continue(()))
    }

    fn show(&self, joint: usize) {
        let Some((bus, place)) = self.rig.place(joint) else { return };
        let (shaft, id, is_in) = self.server.with_world(|world| {
            (world.shaft_at(bus, place), world.id_at(bus, place), world.is_servo_plugged_in(bus, place))
        });
        let (Some(shaft), Some(id)) = (shaft, id) else { return };
        let angle_deg = self.rig.angle_of(joint, shaft.position_counts).unwrap_or_default().to_degrees();
        let state = match (is_in, shaft.torque_on) {
            (false, _) => "unplugged",
            (true, false) => "limp",
            (true, true) => "holds with torque",
        };
        let (joint, bus) = (self.rig.joint_name(joint), self.rig.bus_name(bus));
        say!("{joint}: at {angle_deg:.1} degrees, {state}, id {id} on {bus}");
    }

    /// The joints named in `words`; `all` means all.
    fn joints(&self, words: &[&str]) -> Result<Vec<usize>, String> {
        self.targets(words)?
            .into_iter()
            .map(|target| match target {
                Target::Joint(joint) => Ok(joint),
                Target::Bus(bus) => {
                    Err(format!("{}: expected a servo; this is a bus", self.rig.bus_name(bus)))
                }
            })
            .collect()
    }

    fn targets(&self, words: &[&str]) -> Result<Vec<Target>, String> {
        let mut targets = Vec::new();
        for &word in words {
            match word {
                "all" => targets.extend(self.rig.joints().map(Target::Joint)),
                word => targets.push(self.rig.target(word)?),
            }
        }
        Ok(targets)
    }
}
