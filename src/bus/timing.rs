//! The number of bytes in one exchange, and its time on the wire.
//!
//! Takes a bus, its registers and the number of servos. Returns bytes and times. Pure functions, so that
//! `check` can print what the loop will do.

use std::time::Duration;

use crate::model::servo_model::Register;
use crate::model::{Bus, Protocol, Registers};

/// The kind of read that asks all servos for replies.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum GroupRead {
    /// Sync read: each servo answers with a separate packet, after its own return delay.
    Plain,
    /// Fast sync read (Dynamixel): all servos answer with one packet, after one return delay.
    Fast,
}

/// Cost of one exchange when every servo moves and every reply comes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct CycleCost {
    /// Bytes sent.
    pub bytes_out: usize,
    /// Bytes received, without an echo.
    pub bytes_in: usize,
    /// Time from sending to the last byte of the last reply: wire, return delays and adapter.
    pub time: Duration,
}

/// Cost of one exchange with `servos` servos on `bus`. The highest loop rate is one over its time.
///
/// Each of the three sync writes takes `servos` x (1 + width) bytes and a frame; the read takes a frame and
/// `servos` bytes. Stuffing is left out: goals and limits in their ranges need none.
pub fn cycle_cost(bus: &Bus, registers: &Registers, servos: usize, read: GroupRead) -> CycleCost {
    if servos == 0 {
        return CycleCost::default();
    }
    let spec = bus.protocol.spec();
    let data = usize::from(registers.feedback_bytes);
    let bytes_out =
        write_bytes(bus.protocol, registers, servos) + read_bytes(bus.protocol, registers, servos);
    let (bytes_in, return_delays) = match (read, &spec.fast_read) {
        (GroupRead::Fast, Some(fast)) => (fast.head_bytes + servos * (fast.block_frame_bytes + data), 1),
        _ => (servos * (spec.status_frame_bytes + data), servos),
    };
    let return_delay = u64::from(bus.return_delay_us) * u64::try_from(return_delays).unwrap_or(u64::MAX);
    let time = wire_time(bytes_out + bytes_in, bus.baud)
        + Duration::from_micros(return_delay)
        + adapter_time(bus, registers, servos);
    CycleCost { bytes_out, bytes_in, time }
}

/// Time that the goals of one exchange with `servos` servos take on the wire, before the read.
pub fn write_time(bus: &Bus, registers: &Registers, servos: usize) -> Duration {
    wire_time(write_bytes(bus.protocol, registers, servos), bus.baud)
}

fn write_bytes(protocol: Protocol, registers: &Registers, servos: usize) -> usize {
    let writes = [registers.torque_limit, registers.goal_position, registers.torque_enable];
    writes.into_iter().map(|register| sync_write_bytes(protocol, servos, register)).sum()
}

pub(super) fn sync_write_bytes(protocol: Protocol, servos: usize, register: Register) -> usize {
    let spec = protocol.spec();
    let item_bytes = 1 + usize::from(register.bytes);
    // Address and width come first.
    let frame_bytes = spec.request_frame_bytes + 2 * spec.word_bytes;
    let per_packet = (spec.packet_bytes_max - frame_bytes) / item_bytes;
    servos.div_ceil(per_packet.max(1)) * frame_bytes + servos * item_bytes
}

/// Latency that the adapter adds to an exchange: once if all servos are asked at once, else for each.
pub fn adapter_time(bus: &Bus, registers: &Registers, servos: usize) -> Duration {
    let rounds = if registers.has_sync_read { 1 } else { servos };
    Duration::from_micros(u64::from(bus.adapter_latency_us)) * u32::try_from(rounds).unwrap_or(u32::MAX)
}

/// Time from sending a request of `request_bytes` that ends in one servo's read to the last byte of its reply.
pub(super) fn single_read_time(bus: &Bus, registers: &Registers, request_bytes: usize) -> Duration {
    let data = usize::from(registers.feedback_bytes);
    let bytes = request_bytes + bus.protocol.spec().status_frame_bytes + data;
    wire_time(bytes, bus.baud)
        + Duration::from_micros(u64::from(bus.return_delay_us) + u64::from(bus.adapter_latency_us))
}

fn read_bytes(protocol: Protocol, registers: &Registers, servos: usize) -> usize {
    let spec = protocol.spec();
    // Address and count.
    let frame_bytes = spec.request_frame_bytes + 2 * spec.word_bytes;
    if registers.has_sync_read { frame_bytes + servos } else { frame_bytes * servos }
}

/// Time that `bytes` take on a line of `baud` bits per second: each byte has 8 bits, a start bit and a stop bit.
pub fn wire_time(bytes: usize, baud: u32) -> Duration {
    let bits = u64::try_from(bytes).unwrap_or(u64::MAX).saturating_mul(10);
    Duration::from_nanos(bits.saturating_mul(1_000_000_000) / u64::from(baud.max(1)))
}

/// How long after sending to wait for replies that should take `expected`.
///
/// A quarter more covers what grows with the exchange: UART clocks off by some percent at both ends,
/// servos that take longer than their return delay, an adapter slower than its latency says. 200 us
/// cover the fixed part: the system hands over bytes late. A longer deadline would let one silent servo slow
/// the loop, because a silent servo makes every exchange last until the deadline.
pub(super) fn reply_deadline(expected: Duration) -> Duration {
    expected + expected / 4 + Duration::from_micros(200)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bus::dynamixel::DYNAMIXEL_X;
    use crate::bus::feetech::{FEETECH_SCS, FEETECH_STS};

    fn bus(protocol: Protocol, baud: u32, return_delay_us: u32) -> Bus {
        Bus {
            name: "bus".into(),
            protocol,
            baud,
            adapter_latency_us: 1000,
            return_delay_us,
            voltage_min_v: 0.0,
            supply_ohm: 0.0,
        }
    }

    /// 16 servos: sync write 8 + N(1 + L), sync read 8 + N, replies N(6 + L).
    #[test]
    fn cycle_cost_of_sixteen_feetech_servos() {
        let cost = cycle_cost(&bus(Protocol::Feetech, 1_000_000, 0), &FEETECH_STS, 16, GroupRead::Plain);
        assert_eq!(cost.bytes_out, (8 + 16 * 3) + (8 + 16 * 3) + (8 + 16 * 2) + (8 + 16));
        assert_eq!(cost.bytes_in, 16 * 14);
        assert_eq!(cost.time, Duration::from_micros((176 + 224) * 10 + 1000));
    }

    /// 4 servos: sync write 14 + N(1 + L), sync read 14 + N, replies N(11 + L) or 8 + N(4 + L).
    #[test]
    fn cycle_cost_of_four_dynamixel_servos() {
        let bus = bus(Protocol::Dynamixel, 4_000_000, 250);
        let plain = cycle_cost(&bus, &DYNAMIXEL_X, 4, GroupRead::Plain);
        assert_eq!(plain.bytes_out, (14 + 4 * 3) + (14 + 4 * 5) + (14 + 4 * 2) + (14 + 4));
        assert_eq!(plain.bytes_in, 4 * (11 + 21));
        assert_eq!(plain.time, Duration::from_nanos((100 + 128) * 2500 + 4 * 250_000 + 1_000_000));
        let fast = cycle_cost(&bus, &DYNAMIXEL_X, 4, GroupRead::Fast);
        assert_eq!(fast.bytes_in, 8 + 4 * (4 + 21));
        assert_eq!(fast.time, Duration::from_nanos((100 + 108) * 2500 + 250_000 + 1_000_000));
    }

    /// Servos asked one by one: for each, a read of 8 bytes, a reply of 6 + 8 bytes, and the adapter.
    #[test]
    fn cycle_cost_of_four_scs_servos() {
        let cost = cycle_cost(&bus(Protocol::Feetech, 1_000_000, 0), &FEETECH_SCS, 4, GroupRead::Plain);
        assert_eq!(
            (cost.bytes_out, cost.bytes_in),
            ((8 + 4 * 3) + (8 + 4 * 3) + (8 + 4 * 2) + 4 * 8, 4 * 14)
        );
        assert_eq!(cost.time, Duration::from_micros((88 + 56) * 10 + 4 * 1000));
    }

    #[test]
    fn a_bus_without_servos_costs_no_time() {
        let cost = cycle_cost(&bus(Protocol::Feetech, 0, 9), &FEETECH_STS, 0, GroupRead::Plain);
        assert_eq!(cost, CycleCost::default());
    }

    #[test]
    fn a_byte_takes_ten_bits_on_the_line() {
        assert_eq!(wire_time(100, 1_000_000), Duration::from_millis(1));
        assert_eq!(wire_time(1, 57_600), Duration::from_nanos(173_611));
        wire_time(usize::MAX, 0);
    }
}
