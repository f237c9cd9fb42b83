//! Everything that differs from protocol to protocol, as one table of data and functions for each.
//!
//! `dynamixel` and `feetech` each fill a [`ProtocolSpec`]; the list here is the only place that names them all. A further
//! protocol adds its folder, its variant of [`Protocol`], and its line in the list.

use serialport::TTYPort;

use super::ask::Library;
use super::packet::Decode;
use super::table::{Identity, Series};
use crate::model::{Protocol, ServoModel};
use crate::units::ServoId;

/// The protocols, in the order of the variants of [`Protocol`].
pub(crate) static PROTOCOLS: &[&ProtocolSpec] = &[
    &super::dynamixel::SPEC, //
    &super::feetech::SPEC,
];

const _: () = {
    let mut index = 0;
    while index < PROTOCOLS.len() {
        assert!(PROTOCOLS[index].protocol as usize == index, "the list follows the order of the variants");
        index += 1;
    }
};

/// A number for each servo, of which a packet takes the lowest bytes.
pub(super) type Values<'v> = &'v mut dyn Iterator<Item = (ServoId, u64)>;

/// Opens a library on a copy of a line; the error is the system's.
pub(crate) type OpenLibrary = fn(&TTYPort) -> Result<Box<dyn Library>, String>;

/// A protocol: its packets, what its answers mean, and its servos.
#[derive(Debug)]
pub(crate) struct ProtocolSpec {
    /// The protocol itself.
    pub(crate) protocol: Protocol,
    /// Name in files and commands.
    pub(crate) name: &'static str,
    /// Name in full.
    pub(crate) title: &'static str,

    /// Models that a robot file may name.
    pub(crate) models: &'static [ServoModel],
    /// Numbers and names of other models, for people.
    pub(crate) other_models: &'static [(u16, &'static str)],
    /// Control tables; the first is that of a bus without servos.
    pub(crate) series: &'static [&'static Series],
    /// Line rates that servos can be set to, bit/s; the place in the list is the code in the servo's register.
    pub(crate) rates: &'static [u32],
    /// The same, likely ones first.
    pub(crate) likely_rates: &'static [u32],
    /// Line rate of a servo out of the box, bit/s.
    pub(crate) factory_rate: u32,

    /// Bytes of a request around its parameters.
    pub(super) request_frame_bytes: usize,
    /// Bytes of a status packet around its data.
    pub(super) status_frame_bytes: usize,
    /// Width of an address or a count in the parameters of a request, bytes: 1 or 2, low byte first.
    pub(crate) word_bytes: usize,
    /// Longest packet sent to servos, bytes.
    pub(super) packet_bytes_max: usize,
    /// Appends any instruction to one servo: id, instruction, parameters.
    pub(super) request: fn(&mut Vec<u8>, ServoId, u8, &[u8]),
    /// Appends a read: id, address, bytes.
    pub(super) read: fn(&mut Vec<u8>, ServoId, u16, u16),
    /// Appends a write of the lowest bytes of a number, lowest first: id, address, bytes, number.
    pub(super) write: fn(&mut Vec<u8>, ServoId, u16, u8, u64),
    /// Appends a write of a number for each servo to one register: address, bytes, numbers. Without servos it
    /// appends nothing.
    pub(super) sync_write: fn(&mut Vec<u8>, u16, u8, Values<'_>),
    /// Appends a read that each servo answers with a packet of its own: address, bytes, servos.
    pub(super) sync_read: fn(&mut Vec<u8>, u16, u16, &[ServoId]),
    /// The read that all servos answer with one packet, if there is one.
    pub(crate) fast_read: Option<FastRead>,
    /// A decoder for status packets of up to this many data bytes, and fast replies of this many servos.
    pub(super) decoder: fn(usize, usize) -> Box<dyn Decode>,

    /// Data bytes in the reply to a ping.
    pub(crate) ping_bytes: u16,
    /// How many bytes to ask for in order to read this many.
    pub(crate) asked_bytes: fn(u16) -> u16,
    /// True if a status packet with this error byte and these data could be the echo of a ping.
    pub(super) may_be_echoed_ping: fn(u8, &[u8]) -> bool,
    /// Splits the error byte of a status packet into alarm bits and the number of a refusal, 0 for none.
    pub(crate) alarms_and_refusal: fn(u8) -> (u8, u8),
    /// Meaning and cure of the number of a refusal.
    pub(crate) refusal: fn(u8) -> &'static str,

    /// The request for a servo's identity.
    pub(crate) identify: IdentifyRequest,
    /// The identity in the answer to that; `None` if the data are no such answer.
    pub(crate) identity: fn(&[u8]) -> Option<Identity>,
    /// Parameters of a reset that keeps the id, and if possible the rate.
    pub(crate) reset_parameters: &'static [u8],
    /// Opens a library that carries out requests to single servos, if there is a good one.
    pub(crate) library: Option<OpenLibrary>,
}

/// The request to which a servo answers with its identity.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum IdentifyRequest {
    /// A ping.
    Ping,
    /// A read from address 0.
    Read {
        /// As many bytes as identify it.
        brief: u8,
        /// As many bytes as identify it and give the units of its registers.
        whole: u8,
    },
}

/// A read that all servos answer with one packet, which they write in turn.
#[derive(Debug)]
pub(crate) struct FastRead {
    /// Appends it: address, bytes, servos.
    pub(super) request: fn(&mut Vec<u8>, u16, u16, &[ServoId]),
    /// Bytes of the reply before the first servo's part.
    pub(super) head_bytes: usize,
    /// Bytes of each servo's part around its data.
    pub(super) block_frame_bytes: usize,
    /// Models and firmware that know it, for people.
    pub(crate) since: &'static str,
}

impl Protocol {
    /// The description of this protocol.
    pub(crate) fn spec(self) -> &'static ProtocolSpec {
        PROTOCOLS[self as usize]
    }

    /// All protocols.
    pub fn all() -> impl Iterator<Item = Protocol> {
        PROTOCOLS.iter().map(|spec| spec.protocol)
    }

    /// The name used in files and commands.
    pub fn name(self) -> &'static str {
        self.spec().name
    }

    /// Its name in full.
    pub(crate) fn title(self) -> &'static str {
        self.spec().title
    }

    /// Baud rates that servos of this protocol can be set to, bits per second, in ascending order.
    pub fn bauds(self) -> Vec<u32> {
        let mut bauds = self.spec().rates.to_vec();
        bauds.sort_unstable();
        bauds
    }

    /// The line rate of a code in a servo's register, bit/s.
    pub(crate) fn baud_of_code(self, code: i64) -> Option<u32> {
        self.spec().rates.get(usize::try_from(code).ok()?).copied()
    }
}

impl ServoModel {
    /// Every model that a robot file may name.
    pub fn all() -> impl Iterator<Item = &'static ServoModel> {
        PROTOCOLS.iter().flat_map(|spec| spec.models)
    }

    /// The model of this name, if there is one.
    pub fn named(name: &str) -> Option<&'static ServoModel> {
        ServoModel::all().find(|model| model.name == name)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_scan_covers_every_rate_and_the_factory_rate() {
        for spec in PROTOCOLS {
            let mut likely = spec.likely_rates.to_vec();
            likely.sort_unstable();
            assert_eq!(likely, spec.protocol.bauds(), "{}", spec.name);
            assert!(likely.contains(&spec.factory_rate), "{}", spec.name);
        }
    }

    #[test]
    fn models_and_series_belong_to_their_protocol_and_have_different_names() {
        for spec in PROTOCOLS {
            assert!(spec.series.iter().all(|of| of.protocol == spec.protocol), "{}", spec.name);
            assert!(spec.models.iter().all(|of| of.protocol == spec.protocol), "{}", spec.name);
        }
        let mut names: Vec<_> = ServoModel::all().map(|model| model.name).collect();
        let count = names.len();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), count);
    }
}
