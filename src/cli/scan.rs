//! `hippocamp scan`: lists the servos on a serial line.

use std::io::{IsTerminal, Write};
use std::path::PathBuf;
use std::str::FromStr;
use std::sync::atomic::Ordering;
use std::time::Duration;

use anyhow::Result;
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};

use super::{BadInput, COMPLETED, FAILED, interrupt};
use crate::model::Protocol;
use crate::service::{Found, ServiceError, ServicePort, pass_time, scan_bauds};
use crate::units::ServoId;

/// Width of the progress bar, characters.
const BAR: usize = 24;

/// Options of `scan`.
#[derive(Debug, clap::Args)]
pub(super) struct ScanArguments {
    /// The serial device, such as /dev/ttyUSB0 or a path in /dev/serial/by-id.
    port: PathBuf,
    /// Look at this rate only (bit/s); may be given several times [default: all that servos have].
    #[arg(long = "baud", value_name = "BAUD")]
    bauds: Vec<u32>,
    /// Look for servos with this protocol only.
    #[arg(long, value_parser = protocol_parser())]
    protocol: Option<Protocol>,
    /// Look at these ids only, such as 1-20,40.
    #[arg(long, value_name = "IDS", default_value = "0-252")]
    ids: Ids,
}

/// Reads a protocol as typed: its name.
pub(super) fn protocol_parser() -> impl TypedValueParser<Value = Protocol> {
    let all = Protocol::all().map(|of| PossibleValue::new(of.name()).help(of.title()));
    PossibleValuesParser::new(all)
        .try_map(|name| Protocol::all().find(|of| of.name() == name).ok_or("no protocol has this name"))
}

/// The protocol that the user means, or all.
pub(super) fn wanted_protocols(typed: Option<Protocol>) -> Vec<Protocol> {
    typed.map_or_else(|| Protocol::all().collect(), |protocol| vec![protocol])
}

/// Ids in the form the user types.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Ids(Vec<ServoId>);

impl FromStr for Ids {
    type Err = String;

    fn from_str(text: &str) -> Result<Ids, String> {
        let expected = || format!("expected ids of 0 to {}, such as 1-20,40", Protocol::ID_MAX);
        let id =
            |text: &str| text.trim().parse().ok().filter(|id| *id <= Protocol::ID_MAX).ok_or_else(expected);
        let mut ids: Vec<u8> = Vec::new();
        for part in text.split(',') {
            match part.split_once('-') {
                Some((first, last)) => ids.extend(id(first)?..=id(last)?),
                None => ids.push(id(part)?),
            }
        }
        ids.sort_unstable();
        ids.dedup();
        if ids.is_empty() { Err(expected()) } else { Ok(Ids(ids.into_iter().map(ServoId).collect())) }
    }
}

/// Scans as `options` say; returns the exit code.
pub(super) fn scan(options: &ScanArguments) -> Result<u8> {
    let passes = passes(options)?;
    let stop = interrupt::catch()?;
    let mut port = ServicePort::open(&options.port)?;
    let (mut found, mut notes) = (Vec::new(), Vec::new());
    let mut bar = Bar::new(&passes, options.ids.0.len());
    for &(protocol, baud) in &passes {
        bar.show(protocol, baud, found.len());
        let pass = match port.scan(protocol, baud, &options.ids.0, stop) {
            Err(error @ ServiceError::Baud { .. }) => {
                notes.push(error.to_string());
                continue;
            }
            result => result?,
        };
        for id in &pass.damaged {
            notes.push(format!(
                "only damaged answers from id {id} at {baud} baud ({}): two servos may have it (unplug all but one, and \
                 give each an id of its own), or a plug is loose",
                protocol.name()
            ));
        }
        found.extend(pass.found);
        bar.pass_done(protocol, baud);
        if pass.is_interrupted {
            break;
        }
    }
    bar.end();
    if port.is_echoing() {
        notes.push(
            "the adapter returns what it is sent (echo): hippocamp handles that; other programs may not"
                .into(),
        );
    }
    print(&mut port, &found, &notes)?;
    if stop.load(Ordering::Relaxed) {
        anyhow::bail!("interrupted before everything was checked");
    }
    Ok(if found.is_empty() { FAILED } else { COMPLETED })
}

/// Protocols and rates to try, likely ones first.
fn passes(options: &ScanArguments) -> Result<Vec<(Protocol, u32)>> {
    let protocols = wanted_protocols(options.protocol);
    for baud in &options.bauds {
        if !protocols.iter().any(|of| scan_bauds(*of).contains(baud)) {
            let mut known: Vec<u32> = protocols.iter().flat_map(|of| of.bauds()).collect();
            known.sort_unstable();
            known.dedup();
            let known: Vec<String> = known.iter().map(u32::to_string).collect();
            return Err(BadInput(format!("--baud {baud}: expected one of {}", known.join(", "))).into());
        }
    }
    let is_wanted = |baud: &u32| options.bauds.is_empty() || options.bauds.contains(baud);
    let mut passes: Vec<(Protocol, u32)> = Vec::new();
    let longest = Protocol::all().map(|of| scan_bauds(of).len()).max();
    for rank in 0..longest.unwrap_or_default() {
        let of_rank =
            |of: &Protocol| scan_bauds(*of).get(rank).filter(|baud| is_wanted(baud)).map(|baud| (*of, *baud));
        passes.extend(protocols.iter().filter_map(of_rank));
    }
    Ok(passes)
}

fn print(port: &mut ServicePort, found: &[Found], notes: &[String]) -> Result<()> {
    if found.is_empty() {
        say!("no servo answered: check the servos' power and cable, and that no other program uses them");
    } else {
        say!(
            "{:<10} {:>8} {:>4}  {:<26} {:>8}  {:>7} {:>5}  notes",
            "protocol",
            "baud",
            "id",
            "model",
            "firmware",
            "volts",
            "C"
        );
    }
    for servo in found {
        let (address, identity) = (servo.address, servo.identity);
        let number = identity.model_number;
        let model = identity
            .model_names()
            .map_or_else(|| format!("unknown ({number})"), |name| format!("{name} ({number})"));
        let mut remarks = Vec::new();
        if servo.is_twin {
            remarks.push("two servos have this id: unplug one and give the other another id".to_owned());
        }
        let mut read = |name: &str| -> Result<Option<String>> {
            match port.known_servo(address, identity).read(name) {
                Ok(value) => Ok(Some(value.to_string())),
                Err(error @ ServiceError::Gone { .. }) => Err(error.into()),
                Err(_) => Ok(None),
            }
        };
        let volts = read("present_input_voltage")?;
        let celsius = read("present_temperature")?;
        let errors = read("hardware_error_status")?;
        let torque = read("torque_enable")?;
        if [&volts, &celsius, &errors].iter().any(|value| value.is_none()) && !servo.is_twin {
            remarks
                .push("some answers are damaged: two servos may have this id, or a plug is loose".to_owned());
        }
        if let Some(errors) = errors.filter(|errors| errors != "0") {
            remarks.push(format!("hardware_error_status {errors}"));
        }
        if torque.is_some_and(|torque| torque != "0") {
            remarks.push("torque on".to_owned());
        }
        let or_dash = |value: Option<String>| {
            value.as_deref().and_then(|value| value.split(' ').next()).unwrap_or("-").to_owned()
        };
        say!(
            "{:<10} {:>8} {:>4}  {model:<26} {:>8}  {:>7} {:>5}  {}",
            address.protocol.name(),
            address.baud,
            address.id.0,
            identity.firmware.to_string(),
            or_dash(volts),
            or_dash(celsius),
            remarks.join("; ")
        );
    }
    notes.iter().for_each(|note| say!("note: {note}"));
    Ok(())
}

/// A progress bar on standard error, if that is a terminal.
struct Bar {
    all: Duration,
    done: Duration,
    ids: usize,
    is_shown: bool,
}

#[allow(clippy::disallowed_methods, reason = "draws over itself, and only its own words")]
impl Bar {
    fn new(passes: &[(Protocol, u32)], ids: usize) -> Bar {
        let all = passes.iter().map(|(protocol, baud)| pass_time(*protocol, *baud, ids)).sum();
        Bar { all, done: Duration::ZERO, ids, is_shown: std::io::stderr().is_terminal() }
    }

    fn show(&self, protocol: Protocol, baud: u32, found: usize) {
        if !self.is_shown {
            return;
        }
        let share = self.done.as_secs_f64() / self.all.as_secs_f64().max(1e-9);
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            clippy::cast_precision_loss,
            reason = "0 to 24"
        )]
        let full = ((share * BAR as f64) as usize).min(BAR);
        let left_s = self.all.saturating_sub(self.done).as_secs_f64();
        let _ = write!(
            std::io::stderr(),
            "\r\x1b[K[{}{}] {} at {baud} baud, {found} found, {left_s:.0} s left",
            "#".repeat(full),
            ".".repeat(BAR - full),
            protocol.name()
        );
    }

    fn pass_done(&mut self, protocol: Protocol, baud: u32) {
        self.done += pass_time(protocol, baud, self.ids);
    }

    fn end(&self) {
        if self.is_shown {
            let _ = write!(std::io::stderr(), "\r\x1b[K");
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_of_ids_are_parsed() {
        let ids = |text: &str| text.parse::<Ids>().map(|ids| ids.0.iter().map(|id| id.0).collect::<Vec<_>>());
        assert_eq!(ids("1-3,40").unwrap(), [1, 2, 3, 40]);
        assert_eq!(ids("7").unwrap(), [7]);
        assert_eq!(ids("5,1-5").unwrap(), [1, 2, 3, 4, 5]);
        for text in ["", "253", "a", "1-", "3-1", "1-300", "-1"] {
            assert!(ids(text).is_err(), "{text}");
        }
    }
}
