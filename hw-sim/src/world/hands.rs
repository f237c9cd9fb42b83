//! A person's hands on single servos: plug them in, pull them out, turn their shafts, replace them with new ones.
//!
//! Functions name a servo by its bus and its index among the bus's servos, both in the order of configuration,
//! since ids change and new servos all have the same id. They do nothing if there is no such servo.

use std::f64::consts::PI;

use super::{STEP_S, World};
use crate::servo::Servo;

/// How fast a hand turns a shaft, rad/s.
const HAND_SPEED_RAD_S: f64 = PI;

impl World {
    /// Makes a servo as new: every register as shipped, id and line rate too. Its shaft stays where it is.
    pub fn make_new(&mut self, bus: usize, place: usize) {
        if let Some(servo) = self.servo_mut(bus, place) {
            servo.make_new();
        }
    }

    /// Before time begins, gives registers of a servo's EEPROM, by address, other values than those of a new servo. Does
    /// nothing to a register that the model lacks.
    pub fn configure(&mut self, bus: usize, place: usize, settings: &[(u16, i64)]) {
        if let Some(servo) = self.servo_mut(bus, place) {
            servo.configure(settings);
            self.observe(self.now_ns, 0.0);
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

    /// Disconnects a servo: it has no power, hears nothing, and loses everything outside its EEPROM.
    pub fn pull_servo_out(&mut self, bus: usize, place: usize) {
        if let Some(bus) = self.buses.get_mut(bus) {
            bus.pull_servo_out(place);
        }
    }

    /// From now on the servo sets this register of RAM to `value` at every start: for firmware whose start values
    /// differ from the tables.
    pub fn starts_with(&mut self, bus: usize, place: usize, address: u16, value: i64) {
        if let Some(servo) = self.servo_mut(bus, place) {
            servo.starts_with.push((address, value));
        }
    }

    /// True if a servo exists and is connected.
    pub fn is_servo_plugged_in(&self, bus: usize, place: usize) -> bool {
        self.servo(bus, place).is_some_and(|servo| servo.is_plugged_in)
    }

    /// The id a servo has now.
    pub fn id_at(&self, bus: usize, place: usize) -> Option<u8> {
        self.servo(bus, place).map(Servo::id)
    }

    /// From now on a hand turns a shaft to an angle in encoder counts, half a turn a second. A hand is no match for
    /// a motor: it lets go of a shaft that has torque or is stuck.
    pub fn turn(&mut self, bus: usize, place: usize, to_counts: f64) {
        let Some(index) = self.index_of(bus, place).filter(|_| to_counts.is_finite()) else { return };
        let Some(servo) = self.servo(bus, place) else { return };
        let to_rad = to_counts / servo.model.counts_per_rad();
        self.turning.retain(|(turned, _)| *turned != index);
        self.turning.push((index, to_rad));
    }

    /// True while a hand is turning a shaft.
    pub fn is_turning(&self, bus: usize, place: usize) -> bool {
        self.index_of(bus, place).is_some_and(|index| self.turning.iter().any(|(turned, _)| *turned == index))
    }

    /// Hands let go of shafts that a motor or a jam holds, and grip the others: the body must not move those.
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

    /// Index of a servo's shaft among all shafts.
    pub(super) fn index_of(&self, bus: usize, place: usize) -> Option<usize> {
        let own = self.buses.get(bus)?.servos.len();
        let before: usize = self.buses[..bus].iter().map(|bus| bus.servos.len()).sum();
        (place < own).then_some(before + place)
    }
}
