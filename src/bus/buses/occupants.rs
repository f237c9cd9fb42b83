//! Finds out whose servos are on a line that has come back.

use super::Buses;
use super::start::servos;
use crate::bus::TransactionError;
use crate::bus::port::Ports;
use crate::model::Robot;

/// Whose servos are on a line.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(in crate::bus) enum Occupants {
    /// The servos of its bus, as far as they answer.
    Own,
    /// No servo answers.
    Nobody,
    /// The servos of another bus or robot: which, in words.
    Foreign(String),
}

impl<P: Ports> Buses<P> {
    /// Whose servos are on the line of `bus`. Only reads, and asks each servo once: a lost reply does no harm,
    /// since one good reply is enough.
    pub(in crate::bus) fn occupants(&mut self, robot: &Robot, bus: usize) -> Occupants {
        self.tries = 1;
        let name = |bus: usize| &robot.buses[bus].name;
        let (mut own, mut missing) = (0, 0);
        for (joint, servo) in servos(robot).filter(|(_, servo)| servo.bus == bus) {
            match self.model_number(bus, joint, robot) {
                Ok(found) if found == i64::from(servo.model.model_number) => own += 1,
                Ok(found) => {
                    let twin = servos(robot).find(|(_, other)| {
                        other.bus != bus
                            && other.id == servo.id
                            && i64::from(other.model.model_number) == found
                    });
                    let of =
                        twin.map_or_else(String::new, |(_, twin)| format!(", as on bus {}", name(twin.bus)));
                    return Occupants::Foreign(format!(
                        "its servo {} is model number {found}{of}, not {} ({})",
                        servo.id, servo.model.model_number, servo.model.name
                    ));
                }
                Err(_) => missing += 1,
            }
        }
        if missing == 0 {
            return Occupants::Own;
        }
        // Some servos are silent. Check whether a servo of another bus answers with an id that this bus lacks.
        let is_own = |id| servos(robot).any(|(_, own)| own.bus == bus && own.id == id);
        let stranger = servos(robot).find(|(joint, servo)| {
            servo.bus != bus
                && servo.model.protocol == robot.buses[bus].protocol
                && !is_own(servo.id)
                && self.model_number(bus, *joint, robot) == Ok(i64::from(servo.model.model_number))
        });
        match stranger {
            Some((_, servo)) => {
                Occupants::Foreign(format!("servo {} of bus {} answers there", servo.id, name(servo.bus)))
            }
            None if own == 0 => Occupants::Nobody,
            None => Occupants::Own,
        }
    }

    /// The model number that the servo with the id of the servo of `joint` reports on the line of `bus`.
    fn model_number(&mut self, bus: usize, joint: usize, robot: &Robot) -> Result<i64, TransactionError> {
        let place = self.place(joint)?.servo.clone();
        let servo = robot.joints[joint].servo.ok_or(TransactionError::NoServo { joint })?;
        self.read_at(bus, place, servo.model.registers.model_number)
    }
}

#[cfg(test)]
mod tests {
    use hw_sim::FaultScript;

    use super::*;
    use crate::bus::SimPorts;
    use crate::config;
    use crate::model::{Joint, ServoModel};
    use crate::simulation;
    use crate::units::ServoId;

    fn horse() -> Robot {
        config::parse(include_str!("../../../config/horse-dynamixel.toml"), "horse").unwrap().robot
    }

    /// Whose servos are on the line of bus 0 of `robot`, which carries those of `built`.
    fn occupants(robot: &Robot, built: &Robot, faults: &str) -> Occupants {
        let pose: Vec<f64> = built.joints.iter().map(Joint::middle_rad).collect();
        let faults = FaultScript::from_toml(faults).unwrap();
        let world = simulation::world_from_pose(built, &pose, 1, &faults).unwrap();
        Buses::new(robot, SimPorts::on_virtual_clock(world)).occupants(robot, 0)
    }

    fn moved(robot: &Robot, bus_of: impl Fn(usize, ServoId) -> usize) -> Robot {
        let mut built = robot.clone();
        for servo in built.joints.iter_mut().filter_map(|joint| joint.servo.as_mut()) {
            servo.bus = bus_of(servo.bus, servo.id);
        }
        built
    }

    #[test]
    fn a_bus_is_recognised_as_the_right_one_though_a_servo_is_silent() {
        let robot = horse();
        assert_eq!(occupants(&robot, &robot, ""), Occupants::Own);
        let silent = "[[fault]]\nkind = 'silent'\nat_s = 0\nbus = 'left_hind'\nid = 2\n";
        assert_eq!(occupants(&robot, &robot, silent), Occupants::Own);
        let none = "[[fault]]\nkind = 'silent'\nat_s = 0\nbus = 'left_hind'\n";
        assert_eq!(occupants(&robot, &robot, none), Occupants::Nobody);
    }

    #[test]
    fn servos_of_another_bus_are_recognised_by_their_ids() {
        let robot = horse();
        let swapped = moved(&robot, |bus, _| if bus < 2 { 1 - bus } else { bus });
        let found = Occupants::Foreign("servo 5 of bus left_fore answers there".into());
        assert_eq!(occupants(&robot, &swapped, ""), found);
    }

    /// All ids but one are the same on both buses.
    #[test]
    fn one_id_or_one_model_is_enough_to_recognise_another_bus() {
        let mut robot = horse();
        for servo in robot.joints.iter_mut().filter_map(|joint| joint.servo.as_mut()) {
            servo.id = ServoId((servo.id.0 - 1) % 4 + 1);
        }
        let swap = |robot: &Robot| moved(robot, |bus, _| if bus < 2 { 1 - bus } else { bus });
        assert_eq!(occupants(&robot, &swap(&robot), ""), Occupants::Own, "nothing tells them");

        let mut other_id = robot.clone();
        other_id.joints[7].servo.as_mut().unwrap().id = ServoId(9);
        let found = Occupants::Foreign("servo 9 of bus left_fore answers there".into());
        assert_eq!(occupants(&other_id, &swap(&other_id), ""), found);

        robot.joints[6].servo.as_mut().unwrap().model = ServoModel::named("XM430-W350").unwrap();
        let found = "its servo 3 is model number 1020, as on bus left_fore, not 1030 (XM430-W210)";
        assert_eq!(occupants(&robot, &swap(&robot), ""), Occupants::Foreign(found.into()));
    }
}
