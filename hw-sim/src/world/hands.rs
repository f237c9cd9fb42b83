//! What a person does with single servos: plug them in, pull them out, turn their shafts, take new ones.
//!
//! A servo is meant by its bus and its place among the bus's servos, both in the order of configuration, since ids
//! change and new servos all have the same. Where there is no such servo, nothing is done.

use std::f64::consts::PI;

use super::{STEP_S, World};
use crate::servo::Servo;

/// How fast a hand turns a shaft, rad/s.
const HAND_SPEED_RAD_S: f64 = PI;

impl World {
    /// Makes a servo one that comes out of the box: every register as shipped, id and line rate too. Its shaft stays
    /// where it is.
    pub fn make_new(&mut self, bus: usize, place: usize) {
        if let Some(servo) = self.servo_mut(bus, place) {
            servo.make_new();
        }
    }

    /// Connects a servo: it starts from its EEPROM, without torque. Does nothing to one that is connected.
    pub fn plug_servo_in(&mut self, bus: usize, place: usize) {
        if let Some(servo) = self.servo_mut(bus, place)
            && !servo.is_plugged_in
        {
            servo.plug_in();
        }
    }

    /// Disconnects a servo: it has no power, hears nothing, and what was not in its EEPROM is lost.
    pub fn pull_servo_out(&mut self, bus: usize, place: usize) {
        if let Some(bus) = self.buses.get_mut(bus) {
            bus.pull_servo_out(place);
        }
    }

    /// Has a servo hold `value` in a register of RAM whenever it starts from now on: firmware that starts otherwise than
    /// the tables say.
    pub fn starts_with(&mut self, bus: usize, place: usize, address: u16, value: i64) {
        if let Some(servo) = self.servo_mut(bus, place) {
            servo.starts_with.push((address, value));
        }
    }

    /// Whether a servo is there and connected.
    pub fn is_servo_plugged_in(&self, bus: usize, place: usize) -> bool {
        self.servo(bus, place).is_some_and(|servo| servo.is_plugged_in)
    }

    /// The id a servo has now.
    pub fn id_at(&self, bus: usize, place: usize) -> Option<u8> {
        self.servo(bus, place).map(Servo::id)
    }

    /// Has a hand turn a shaft to an angle in encoder counts, half a turn a second, from now on. A hand is no match
    /// for a motor: it lets go of a shaft that has torque or is stuck.
    pub fn turn(&mut self, bus: usize, place: usize, to_counts: f64) {
        let Some(index) = self.index_of(bus, place).filter(|_| to_counts.is_finite()) else { return };
        let Some(servo) = self.servo(bus, place) else { return };
        let to_rad = to_counts / servo.model.counts_per_rad();
        self.turning.retain(|(turned, _)| *turned != index);
        self.turning.push((index, to_rad));
    }

    /// Whether a hand is still turning a shaft.
    pub fn is_turning(&self, bus: usize, place: usize) -> bool {
        self.index_of(bus, place).is_some_and(|index| self.turning.iter().any(|(turned, _)| *turned == index))
    }

    /// Lets go of what a motor or a jam holds, and takes hold of the rest: the body must not move that.
    pub(super) fn grip(&mut self) {
        if self.turning.is_empty() {
            return;
        }
        let has_torque: Vec<bool> =
            self.buses.iter().flat_map(|bus| &bus.servos).map(Servo::is_torque_on).collect();
        let shafts = &mut self.shafts;
        self.turning.retain(|&(index, _)| {
            let is_free = !has_torque[index] && !shafts[index].is_stuck;
            shafts[index].is_stuck |= is_free;
            is_free
        });
    }

    /// One motor step of every hand.
    pub(super) fn turn_by_hand(&mut self) {
        let shafts = &mut self.shafts;
        self.turning.retain(|&(index, goal_rad)| {
            let shaft = &mut shafts[index];
            let (left, step) = (goal_rad - shaft.position_rad, HAND_SPEED_RAD_S * STEP_S);
            let is_there = left.abs() <= step;
            shaft.position_rad += left.clamp(-step, step);
            shaft.speed_rad_s = if is_there { 0.0 } else { HAND_SPEED_RAD_S.copysign(left) };
            !is_there
        });
    }

    fn servo(&self, bus: usize, place: usize) -> Option<&Servo> {
        self.buses.get(bus)?.servos.get(place)
    }

    fn servo_mut(&mut self, bus: usize, place: usize) -> Option<&mut Servo> {
        self.buses.get_mut(bus)?.servos.get_mut(place)
    }

    /// Where the shaft of a servo stands among all.
    pub(super) fn index_of(&self, bus: usize, place: usize) -> Option<usize> {
        let own = self.buses.get(bus)?.servos.len();
        let before: usize = self.buses[..bus].iter().map(|bus| bus.servos.len()).sum();
        (place < own).then_some(before + place)
    }
}
