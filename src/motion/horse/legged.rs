//! A horse as a robot that stands up, acts on its feet, and stops.

use super::Drive;
use crate::motion::legged::{LeggedMotion, STAND_S};
use crate::motion::{Activity, Command, Order};
use crate::signals::{State, Targets};

impl LeggedMotion for Drive {
    type Command = Command;

    fn command(&self, order: Order, since_s: f64, move_for_s: f64) -> Option<Command> {
        match order {
            Order::Stop | Order::StopAtOnce => None,
            Order::Drive(command) => Some(command),
            // A horse has no strokes and no poses.
            Order::Perform(_) | Order::Take(_) => Some(Command::default()),
            Order::Go if since_s < STAND_S => Some(Command::default()),
            Order::Go if since_s < STAND_S + move_for_s => Some(self.plan().command),
            Order::Go => None,
        }
    }

    fn step(&mut self, dt_s: f64, _state: &State, command: Option<Command>) {
        Drive::step(self, dt_s, command);
    }

    fn reset_to_stand(&mut self) {
        Drive::reset_to_stand(self);
    }

    fn is_standing(&self) -> bool {
        Drive::is_standing(self)
    }

    fn activity(&self) -> Activity {
        if self.is_walking() { Activity::Walking } else { Activity::Standing }
    }

    fn sit_pose_rad(&self) -> &[f64] {
        &self.plan().sit_pose_rad
    }

    fn crouch(&self) -> Option<(f64, &[f64])> {
        let (height_m, pose_rad) = &self.plan().crouch;
        Some((*height_m, pose_rad))
    }

    fn heights_m(&self) -> (f64, f64) {
        (self.plan().settings.sit_height_m, self.plan().settings.stand_height_m)
    }

    fn limit_speed(&mut self, share: f64) {
        Drive::limit_speed(self, share);
    }

    fn speed_m_s(&self) -> f64 {
        self.velocity().speed_m_s
    }

    fn drive(&self) -> Option<&Drive> {
        Some(self)
    }

    fn write(&self, height_m: f64, targets: &mut Targets) {
        Drive::write(self, height_m, targets);
    }
}
