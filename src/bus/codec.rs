//! Packets of one bus: its protocol's encoders, and a decoder of its own.

use super::ask::{PING, REBOOT};
use super::packet::{Decode, Event};
use super::protocols::ProtocolSpec;
use crate::model::servo_model::Register;
use crate::model::{Protocol, Registers};
use crate::units::ServoId;

/// Encoders and decoder of a bus's protocol.
#[derive(Debug)]
pub(super) struct Codec {
    spec: &'static ProtocolSpec,
    decoder: Box<dyn Decode>,
}

impl Codec {
    /// A codec for a bus with `servos` servos of these registers.
    pub(super) fn new(protocol: Protocol, registers: &Registers, servos: usize) -> Codec {
        // Single reads have up to 4 bytes.
        Codec::with_room(protocol, usize::from(registers.feedback_bytes).max(4), servos)
    }

    /// A codec for status packets of up to `parameters_max` data bytes, and fast replies of `servos` servos.
    pub(super) fn with_room(protocol: Protocol, parameters_max: usize, servos: usize) -> Codec {
        let spec = protocol.spec();
        Codec { spec, decoder: (spec.decoder)(parameters_max, servos) }
    }

    pub(super) fn ping(&self, out: &mut Vec<u8>, id: ServoId) {
        (self.spec.request)(out, id, PING, &[]);
    }

    /// Appends a restart, which returns the servo to its state at power-on.
    pub(super) fn restart(&self, out: &mut Vec<u8>, id: ServoId) {
        (self.spec.request)(out, id, REBOOT, &[]);
    }

    /// Appends a read of `register`. The reply has [`ProtocolSpec::asked_bytes`] of its width.
    pub(super) fn read(&self, out: &mut Vec<u8>, id: ServoId, register: Register) {
        let bytes = (self.spec.asked_bytes)(u16::from(register.bytes));
        (self.spec.read)(out, id, register.address, bytes);
    }

    /// Appends a read of a block of registers.
    pub(super) fn read_block(&self, out: &mut Vec<u8>, id: ServoId, address: u16, bytes: u16) {
        (self.spec.read)(out, id, address, bytes);
    }

    pub(super) fn write(&self, out: &mut Vec<u8>, id: ServoId, register: Register, raw: u64) {
        (self.spec.write)(out, id, register.address, register.bytes, raw);
    }

    pub(super) fn sync_write(
        &self,
        out: &mut Vec<u8>,
        register: Register,
        mut values: impl Iterator<Item = (ServoId, u64)>,
    ) {
        (self.spec.sync_write)(out, register.address, register.bytes, &mut values);
    }

    pub(super) fn sync_read(&self, out: &mut Vec<u8>, address: u16, bytes: u16, ids: &[ServoId]) {
        (self.spec.sync_read)(out, address, bytes, ids);
    }

    /// Appends a fast sync read and prepares for the reply; a plain one in a protocol without it.
    pub(super) fn fast_sync_read(&mut self, out: &mut Vec<u8>, address: u16, bytes: u16, ids: &[ServoId]) {
        match &self.spec.fast_read {
            None => self.sync_read(out, address, bytes, ids),
            Some(fast) => {
                (fast.request)(out, address, bytes, ids);
                self.decoder.expect_fast_reply(ids.len(), usize::from(bytes));
            }
        }
    }

    pub(super) fn clear(&mut self) {
        self.decoder.clear();
    }

    pub(super) fn push(&mut self, bytes: &[u8]) -> usize {
        self.decoder.push(bytes)
    }

    pub(super) fn end_of_input(&mut self) {
        self.decoder.end_of_input();
    }

    pub(super) fn next_event(&mut self) -> Option<Event<'_>> {
        self.decoder.next_event()
    }
}
