//! `[[bus]]`: the serial buses.

use super::number::Limits;
use super::reader::Section;
use super::unique::Unique;
use crate::model::{Bus, Protocol};

/// Longest allowed latency of an adapter, microseconds: a second.
const LATENCY_LARGEST_US: u32 = 1_000_000;
/// Longest return delay a servo can be set to, microseconds: 254 steps of 2 (ROBOTIS e-manual, register 9).
const RETURN_DELAY_LARGEST_US: u32 = 508;

/// Largest allowed resistance of a simulated supply, milliohms.
const SUPPLY_LARGEST_MOHM: u32 = 10_000;
/// Resistance of a small battery pack, a metre of 18 AWG copper there and back (21 milliohms a metre), and two
/// plugs.
const SUPPLY_MOHM: u32 = 100;

/// Most buses: more than a computer has ports for.
pub(super) const BUSES_MAX: usize = 64;

/// A bus as far as it could be read; `bus` is set only if all of it was good.
pub(super) struct BusEntry<'a> {
    pub(super) name: Option<&'a str>,
    pub(super) protocol: Option<Protocol>,
    pub(super) bus: Option<Bus>,
    /// The lowest supply voltage that its table sets, V.
    pub(super) voltage_min_v: Option<f64>,
}

/// Reads all buses, in file order.
pub(super) fn read<'a>(file: &Section<'a>) -> Vec<BusEntry<'a>> {
    let mut names = Unique::default();
    let faulty = BusEntry { name: None, protocol: None, bus: None, voltage_min_v: None };
    let buses = file.list("bus", "the buses", BUSES_MAX, |section| Some(read_bus(section, &mut names)));
    if buses.iter().any(Option::is_none) {
        // The value is not a list: references to its entries cannot be checked.
        return vec![faulty];
    }
    buses.into_iter().flatten().collect()
}

fn read_bus<'a>(section: &Section<'a>, names: &mut Unique<'a>) -> BusEntry<'a> {
    let name = names.name(section, "the bus's name");
    let protocols: Vec<_> = Protocol::all().map(|protocol| (protocol.name(), protocol)).collect();
    let protocol = section.choice("protocol", "the protocol of the bus's servos", &protocols);
    let baud = read_baud(section, protocol);
    let adapter_latency_us = section.integer_or(
        "adapter_latency_us",
        "the adapter's latency in microseconds",
        0..=LATENCY_LARGEST_US,
        1000,
    );
    let return_delay_us = section.integer_or(
        "return_delay_us",
        "the servos' return delay in microseconds",
        0..=RETURN_DELAY_LARGEST_US,
        0,
    );
    if return_delay_us.is_some_and(|delay_us| delay_us % 2 != 0) {
        section.fault("return_delay_us", "an even number: the servos count it in steps of 2 microseconds");
    }
    let supply_mohm = section.integer_or(
        "supply_mohm",
        "the resistance of the simulated supply with its wires and plugs in milliohms",
        0..=SUPPLY_LARGEST_MOHM,
        SUPPLY_MOHM,
    );
    section.describe_default(
        "voltage_min_v",
        "the lowest supply voltage of the bus's servos in V, within what they allow",
        "that of [safety], or the highest of its servo models' own",
    );
    let is_set = section.has("voltage_min_v");
    let meaning = "the lowest supply voltage in V, within what the servos allow";
    let voltage_min_v =
        if is_set { section.number("voltage_min_v", meaning, Limits::FromTo(0.0, 1000.0)) } else { None };
    let bus = || {
        if is_set && voltage_min_v.is_none() {
            return None;
        }
        Some(Bus {
            name: name?.to_owned(),
            protocol: protocol?,
            baud: baud?,
            adapter_latency_us: adapter_latency_us?,
            return_delay_us: return_delay_us?,
            voltage_min_v: 0.0,
            supply_ohm: f64::from(supply_mohm?) / 1000.0,
        })
    };
    BusEntry { name, protocol, bus: bus(), voltage_min_v }
}

fn read_baud(section: &Section<'_>, protocol: Option<Protocol>) -> Option<u32> {
    let baud = section.integer("baud", "the bus's bits per second", 1..=u32::MAX)?;
    let protocol = protocol?;
    let bauds = protocol.bauds();
    if bauds.contains(&baud) {
        return Some(baud);
    }
    let highest = bauds.iter().max().filter(|highest| baud > **highest);
    let advice = highest.map(|highest| format!("; {highest} is the most they can")).unwrap_or_default();
    let bauds: Vec<String> = bauds.iter().map(u32::to_string).collect();
    let name = protocol.name();
    section.fault("baud", format!("a rate that {name} servos have: {}{advice}", bauds.join(", ")));
    None
}
