//! Packets for work outside the loop: any instruction to one servo, and whatever comes back.

use super::codec::Codec;
use super::packet::Event;
use crate::model::Protocol;
use crate::units::ServoId;

/// Appends a request to the servo `id`.
pub(crate) fn request(
    protocol: Protocol,
    out: &mut Vec<u8>,
    id: ServoId,
    instruction: u8,
    parameters: &[u8],
) {
    (protocol.spec().request)(out, id, instruction, parameters);
}

/// Bytes that a request and its answer take on the line, with these numbers of bytes of parameters and data.
pub(crate) fn exchange_bytes(protocol: Protocol, parameters: usize, data: usize) -> usize {
    parameters + protocol.spec().request_frame_bytes + status_bytes(protocol, data)
}

/// Bytes of a status packet with this many bytes of data, without stuffing.
pub(crate) fn status_bytes(protocol: Protocol, data: usize) -> usize {
    data + protocol.spec().status_frame_bytes
}

/// A packet that was heard.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Heard {
    /// A complete status packet.
    Status {
        /// The servo that sent it.
        id: ServoId,
        /// Alarm bits on Feetech; on Dynamixel the error number and, in bit 7, the alert.
        error: u8,
        /// The data.
        data: Vec<u8>,
    },
    /// A packet-shaped run of bytes with a wrong checksum: damaged on the way, or sent by two servos at once.
    Damaged(ServoId),
}

/// Finds status packets in received bytes.
#[derive(Debug)]
pub(crate) struct Listener(Codec);

impl Listener {
    /// A listener for packets of up to `data_max` bytes of data.
    pub(crate) fn new(protocol: Protocol, data_max: usize) -> Listener {
        Listener(Codec::with_room(protocol, data_max, 1))
    }

    /// A listener over a decoder that expects more than that.
    pub(super) fn over(codec: Codec) -> Listener {
        Listener(codec)
    }

    /// Hands every packet that `bytes` complete to `take`.
    pub(crate) fn hear(&mut self, mut bytes: &[u8], mut take: impl FnMut(Heard)) {
        loop {
            let taken = self.0.push(bytes);
            self.drain(&mut take);
            bytes = bytes.get(taken..).unwrap_or_default();
            if bytes.is_empty() || taken == 0 {
                return;
            }
        }
    }

    /// No more bytes will come: searches the bytes after the start of a packet that never ended.
    pub(crate) fn end(&mut self, mut take: impl FnMut(Heard)) {
        self.0.end_of_input();
        self.drain(&mut take);
        self.0.clear();
    }

    fn drain(&mut self, take: &mut impl FnMut(Heard)) {
        while let Some(event) = self.0.next_event() {
            take(match event {
                Event::Status(status) => {
                    Heard::Status { id: status.id, error: status.error, data: status.parameters.to_vec() }
                }
                Event::Corrupt(id) => Heard::Damaged(id),
            });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Test vectors from the makers' manuals: ping of servo 1, read of position, and the answers.
    #[test]
    fn requests_and_answers_match_the_manuals() {
        let asked = |protocol, instruction, parameters: &[u8]| {
            let mut out = Vec::new();
            request(protocol, &mut out, ServoId(1), instruction, parameters);
            out
        };
        let ping = [0xFF, 0xFF, 0xFD, 0x00, 0x01, 0x03, 0x00, 0x01, 0x19, 0x4E];
        assert_eq!(asked(Protocol::Dynamixel, 1, &[]), ping);
        assert_eq!(asked(Protocol::Feetech, 1, &[]), [0xFF, 0xFF, 0x01, 0x02, 0x01, 0xFB]);
        assert_eq!(asked(Protocol::Feetech, 2, &[56, 2]), [0xFF, 0xFF, 0x01, 0x04, 0x02, 0x38, 0x02, 0xBE]);

        let mut heard = Vec::new();
        let reply = [0xFF, 0xFF, 0xFD, 0x00, 0x01, 0x07, 0x00, 0x55, 0x00, 0x06, 0x04, 0x26, 0x65, 0x5D];
        let mut listener = Listener::new(Protocol::Dynamixel, 3);
        // The reply comes in two pieces, after noise.
        listener.hear(&[0x00, 0xFF], |packet| heard.push(packet));
        listener.hear(&reply, |packet| heard.push(packet));
        assert_eq!(heard, [Heard::Status { id: ServoId(1), error: 0, data: vec![0x06, 0x04, 0x26] }]);
    }

    #[test]
    fn a_false_header_does_not_hide_packets_for_ever() {
        let mut heard = Vec::new();
        let mut listener = Listener::new(Protocol::Feetech, 6);
        listener
            .hear(&[0xFF, 0xFF, 0x05, 0x08, 0xFF, 0xFF, 0x01, 0x02, 0x00, 0xFC], |packet| heard.push(packet));
        assert_eq!(heard, []);
        listener.end(|packet| heard.push(packet));
        assert_eq!(heard, [Heard::Status { id: ServoId(1), error: 0, data: vec![] }]);
    }
}
