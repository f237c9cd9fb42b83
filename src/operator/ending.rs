//! The end a person has asked for, the same for every rig.

use super::{Instruction, Key};
use crate::motion::Order;

/// Which end was asked for, if any. It stays; only an emergency stop can take its place.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Ending(Option<Instruction>);

impl Ending {
    /// Stops in good order.
    pub(super) fn stop(&mut self) {
        self.0.get_or_insert(Order::Stop.into());
    }

    /// The stop action at once.
    pub(super) fn stop_at_once(&mut self) {
        self.0 = Some(Order::StopAtOnce.into());
    }

    /// Whether `key` asks for an end, which it then is.
    pub(super) fn takes(&mut self, key: Key) -> bool {
        match key {
            Key::Escape | Key::Character('x') => self.stop_at_once(),
            // Ctrl-D, the end of the input.
            Key::Character('q' | '\x04') => self.stop(),
            Key::Gone => {
                let reason = "the keyboard's terminal is gone";
                self.0.get_or_insert(Instruction { order: Order::Stop, reason });
            }
            _ => return false,
        }
        true
    }

    /// The end, or as long as there is none, `order`.
    pub(super) fn or(&self, order: Order) -> Instruction {
        self.0.unwrap_or(order.into())
    }
}
