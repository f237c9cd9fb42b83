//! The exchange with all servos: measures its duration and losses, and whether the fast read works.

use std::time::Duration;

use super::lines::Lines;
use crate::bus::serial::Device;
use crate::bus::timing::{GroupRead, write_time};
use crate::bus::{BusStatistics, Buses, Ports, SerialPorts, Slot};
use crate::model::Robot;
use crate::platform;

/// Number of exchanges measured. The fast read is tried after 50 complete ones.
const EXCHANGES: u32 = 120;
/// Share of lost replies above which there is a fault.
const LOST_SHARE: f64 = 0.01;
/// Share of a period that an exchange may take: the loop needs the rest to compute.
const EXCHANGE_SHARE: f64 = 0.9;

/// Reads all servos repeatedly at the loop's rate.
pub(super) fn examine(robot: &Robot, devices: &[Device], lines: &mut Lines<'_>) {
    let ports = match SerialPorts::open(devices) {
        Ok(ports) => ports,
        Err(error) => return lines.fault("the loop", error.to_string(), "see above"),
    };
    for note in ports.notes() {
        let (found, cure) = note.rsplit_once(": ").unwrap_or((note, ""));
        lines.warning("the adapters", found, cure);
    }
    // With the priority of a run, if permitted; nothing this thread does later needs it.
    let _ = platform::request_real_time(None);
    let mut buses = Buses::new(robot, ports);
    let mut slots = vec![Slot::Missing; robot.joints.len()];
    let period = Duration::from_secs_f64(robot.period_s());
    let mut took = vec![Vec::new(); robot.buses.len()];
    let mut deadline = buses.ports_mut().now();
    for _ in 0..EXCHANGES {
        buses.ports_mut().wait_until(deadline);
        deadline = buses.ports_mut().now() + period;
        buses.look(&mut slots);
        for (times, bus) in took.iter_mut().zip(buses.statistics()) {
            times.push(bus.times.last);
        }
    }
    platform::end_real_time();
    for ((index, bus), times) in buses.statistics().enumerate().zip(took) {
        one_bus(robot, index, &bus, times, lines);
    }
}

fn one_bus(
    robot: &Robot,
    index: usize,
    found: &BusStatistics<'_>,
    mut times: Vec<Duration>,
    lines: &mut Lines<'_>,
) {
    let bus = &robot.buses[index];
    let about = format!("bus {}", bus.name);
    let mut servos = robot.joints.iter().filter_map(|joint| joint.servo).filter(|servo| servo.bus == index);
    let Some(first) = servos.next() else { return };
    let count = 1 + servos.count();

    let counters = found.counters;
    let replies = counters.exchanges * u64::try_from(count).unwrap_or(u64::MAX);
    let lost = counters.missing + counters.corrupt;
    #[allow(clippy::cast_precision_loss, reason = "some thousands")]
    let share = lost as f64 / replies.max(1) as f64;
    let words = format!("{lost} of {replies} replies lost, {} of them damaged", counters.corrupt);
    let cure = "check plugs, cable lengths and the common minus; let no power line run beside the data line";
    if lost == 0 {
        lines.ok(&about, format!("{replies} replies, none lost"));
    } else if share <= LOST_SHARE {
        lines.warning(&about, words, cure);
    } else {
        lines.fault(&about, words, cure);
    }
    if found.unknown_replies > 0 {
        lines.fault(
            &about,
            format!("{} replies came from ids that were not asked", found.unknown_replies),
            "another program or a servo with a wrong id talks on this bus: 'hippocamp scan' shows which",
        );
    }
    // While replies are lost, the loop does not try the fast read.
    if let Some(fast) = &bus.protocol.spec().fast_read
        && lost == 0
    {
        match found.group_read {
            GroupRead::Fast => lines.ok(&about, "fast sync read works"),
            GroupRead::Plain => lines.warning(
                &about,
                "not all servos know the fast sync read: the loop falls back to plain reads by itself",
                format!(
                    "update the servos' firmware with the maker's tool ({}), or leave it as it is",
                    fast.since
                ),
            ),
        }
    }

    // A run also writes, in addition to these reads.
    times.sort_unstable();
    let (Some(median), Some(longest)) = (times.get(times.len() / 2).copied(), times.last().copied()) else {
        return;
    };
    let writes = write_time(bus, first.model.registers, count);
    let whole = median + writes;
    let period = Duration::from_secs_f64(robot.period_s());
    let milliseconds = |time: Duration| 1e3 * time.as_secs_f64();
    let words = format!(
        "an exchange takes {:.2} ms ({:.2} ms measured, longest {:.2} ms, and {:.2} ms for the goals of a run); a cycle at {} Hz has \
         {:.2} ms",
        milliseconds(whole),
        milliseconds(median),
        milliseconds(longest),
        milliseconds(writes),
        robot.rate_hz,
        milliseconds(period)
    );
    let cure = format!(
        "lower loop_rate_hz (to {:.0} or less), raise the baud, use more buses, or an adapter with less latency",
        (EXCHANGE_SHARE / whole.as_secs_f64()).floor()
    );
    if whole > period.mul_f64(EXCHANGE_SHARE) {
        lines.fault(&about, words, cure);
    } else if longest + writes > period {
        lines.warning(&about, words, cure);
    } else {
        lines.ok(&about, words);
    }
}
