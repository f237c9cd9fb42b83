//! An order as recorded: flat fields, since readers of recordings have no unions.

use serde::{Deserialize, Serialize};

use super::strokes::StrokeFields;
use crate::model::Robot;
use crate::motion::{Command, GaitChoice, Order, Posture};

/// An [`Order`] in the fields of a message.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct OrderFields {
    order: OrderName,
    /// Set only with [`OrderName::Drive`].
    #[serde(skip_serializing_if = "Option::is_none", default)]
    command: Option<CommandFields>,
    /// Set only with [`OrderName::Perform`].
    #[serde(skip_serializing_if = "Option::is_none", default)]
    strokes: Option<StrokeFields>,
    /// Set only with [`OrderName::Take`]: index into the poses of the robot file.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pose: Option<usize>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum OrderName {
    Go,
    Drive,
    Perform,
    Take,
    Stop,
    StopAtOnce,
}

/// A [`Command`] in the fields of a message.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct CommandFields {
    choice: GaitChoiceName,
    /// Set only with [`GaitChoiceName::Gait`]: index into the gaits of the robot file.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    gait: Option<usize>,
    speed_m_s: f64,
    yaw_rate_rad_s: f64,
    rise_m: f64,
    pitch_rad: f64,
    roll_rad: f64,
    sway_m: f64,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum GaitChoiceName {
    Stand,
    Auto,
    Gait,
}

impl From<Order> for OrderFields {
    fn from(order: Order) -> OrderFields {
        let word = |order| OrderFields { order, command: None, strokes: None, pose: None };
        match order {
            Order::Go => word(OrderName::Go),
            Order::Drive(command) => OrderFields { command: Some(command.into()), ..word(OrderName::Drive) },
            Order::Perform(command) => {
                OrderFields { strokes: Some(command.into()), ..word(OrderName::Perform) }
            }
            Order::Take(pose) => OrderFields { pose: Some(pose), ..word(OrderName::Take) },
            Order::Stop => word(OrderName::Stop),
            Order::StopAtOnce => word(OrderName::StopAtOnce),
        }
    }
}

impl TryFrom<OrderFields> for Order {
    type Error = &'static str;

    fn try_from(fields: OrderFields) -> Result<Order, Self::Error> {
        Ok(match fields.order {
            OrderName::Go => Order::Go,
            OrderName::Drive => {
                Order::Drive(fields.command.ok_or("an order to drive without a command")?.try_into()?)
            }
            OrderName::Perform => {
                let strokes = fields.strokes.as_ref().ok_or("an order to perform without a stroke")?;
                Order::Perform(strokes.try_into()?)
            }
            OrderName::Take => Order::Take(fields.pose.ok_or("an order to take a pose without one")?),
            OrderName::Stop => Order::Stop,
            OrderName::StopAtOnce => Order::StopAtOnce,
        })
    }
}

/// True if `robot` has the gait or the pose that `order` names by its index in the robot file.
pub(super) fn is_of(order: Order, robot: &Robot) -> bool {
    match order {
        Order::Drive(command) => gait_is_of(command.gait, robot),
        Order::Take(pose) => robot.motion.figure().is_none_or(|figure| pose < figure.poses.len()),
        Order::Go | Order::Perform(_) | Order::Stop | Order::StopAtOnce => true,
    }
}

/// True if `robot` has this gait.
pub(crate) fn gait_is_of(choice: GaitChoice, robot: &Robot) -> bool {
    match (choice, robot.motion.horse()) {
        (GaitChoice::Gait(gait), Some(horse)) => gait < horse.gaits.len(),
        _ => true,
    }
}

impl From<Command> for CommandFields {
    fn from(command: Command) -> CommandFields {
        let (choice, gait) = match command.gait {
            GaitChoice::Stand => (GaitChoiceName::Stand, None),
            GaitChoice::Auto => (GaitChoiceName::Auto, None),
            GaitChoice::Gait(index) => (GaitChoiceName::Gait, Some(index)),
        };
        let Posture { rise_m, pitch_rad, roll_rad, sway_m } = command.posture;
        let Command { speed_m_s, yaw_rate_rad_s, .. } = command;
        CommandFields { choice, gait, speed_m_s, yaw_rate_rad_s, rise_m, pitch_rad, roll_rad, sway_m }
    }
}

impl TryFrom<CommandFields> for Command {
    type Error = &'static str;

    fn try_from(fields: CommandFields) -> Result<Command, Self::Error> {
        let CommandFields { speed_m_s, yaw_rate_rad_s, rise_m, pitch_rad, roll_rad, sway_m, .. } = fields;
        let gait = match fields.choice {
            GaitChoiceName::Stand => GaitChoice::Stand,
            GaitChoiceName::Auto => GaitChoice::Auto,
            GaitChoiceName::Gait => {
                GaitChoice::Gait(fields.gait.ok_or("a command for a gait that names none")?)
            }
        };
        Ok(Command {
            gait,
            speed_m_s,
            yaw_rate_rad_s,
            posture: Posture { rise_m, pitch_rad, roll_rad, sway_m },
        })
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::model::Pole;
    use crate::motion::{Place, Stroke, StrokeCommand};

    #[test]
    fn orders_round_trip_to_the_last_bit() {
        let command = |gait| Command {
            gait,
            speed_m_s: 0.1 + 0.2,
            yaw_rate_rad_s: -1.0 / 3.0,
            posture: Posture { rise_m: 1e-9, pitch_rad: -0.1, roll_rad: 0.7, sway_m: -0.02 },
        };
        let drives =
            [GaitChoice::Stand, GaitChoice::Auto, GaitChoice::Gait(4)].map(command).map(Order::Drive);
        let pole = Pole { point_in_body: DVec3::new(0.1, -0.2, 1.0 / 3.0), axis: DVec3::Y, radius_m: 0.03 };
        let placed = [
            ("reach", Place::Point { in_body: DVec3::new(0.1 + 0.2, 0.0, -1e-9), direction: None }),
            ("reach", Place::Point { in_body: DVec3::Z, direction: Some(DVec3::new(0.6, 0.0, 0.8)) }),
            ("wind", Place::Pole(pole)),
        ]
        .map(|(name, place)| Stroke { name, place });
        let performs = [Stroke::REST, Stroke::of("walk"), Stroke::LET_GO]
            .into_iter()
            .chain(placed)
            .map(|stroke| StrokeCommand { stroke, tempo: 1.0 / 3.0, turn_rad: -0.1 })
            .map(Order::Perform);
        let plain = [Order::Go, Order::Stop, Order::StopAtOnce];
        for order in plain.into_iter().chain(drives).chain(performs) {
            let text = serde_json::to_string(&OrderFields::from(order)).unwrap();
            let fields: OrderFields = serde_json::from_str(&text).unwrap();
            assert_eq!(Order::try_from(fields), Ok(order), "{text}");
        }
    }

    #[test]
    fn orders_that_lack_something_are_refused() {
        for text in [
            r#"{"order": "drive"}"#,
            r#"{"order": "drive", "command": {"choice": "gait", "speed_m_s": 0, "yaw_rate_rad_s": 0, "rise_m": 0,
               "pitch_rad": 0, "roll_rad": 0, "sway_m": 0}}"#,
            r#"{"order": "perform"}"#,
            r#"{"order": "perform", "strokes": {"stroke": "dance", "tempo": 1, "turn_rad": 0}}"#,
            r#"{"order": "perform", "strokes": {"stroke": "reach", "tempo": 1, "turn_rad": 0}}"#,
            r#"{"order": "perform", "strokes": {"stroke": "wind", "tempo": 1, "turn_rad": 0,
               "point": {"x": 0, "y": 0, "z": 0}, "radius_m": 0.1}}"#,
        ] {
            let fields: OrderFields = serde_json::from_str(text).unwrap();
            assert!(Order::try_from(fields).is_err(), "{text}");
        }
    }
}
