//! The cost of a pseudo-terminal by itself: sends and awaits the raw bytes of an exchange, without a controller.
//!
//! Runs under the conditions of the run beside it: the same bytes at the same rate on as many lines, through
//! [`SerialPorts`]. The thread has the loop's priority and runs on the loop's processor; the servos are like the
//! run's, and the same thread serves both.

use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use hdrhistogram::Histogram;
use hippocamp::bus::serial::Device;
use hippocamp::bus::timing::{CycleCost, GroupRead, cycle_cost};
use hippocamp::bus::{PortError, Ports, SerialPorts, SimPorts};
use hippocamp::model::{Bus, Protocol, Robot};
use hippocamp::motion::{Activity, Order};
use hippocamp::plan::RunPlan;
use hippocamp::platform::{monotonic, request_real_time};
use hippocamp::run::run;
use hippocamp::telemetry::Quantiles;
use hippocamp::units::Time;
use hw_sim::World;

use super::built::world;

/// The measurements.
pub(crate) struct Bare {
    /// Duration of the exchanges of each bus, us, timed as the loop times its own.
    pub(crate) exchange_us: Vec<Quantiles>,
    /// Time from each deadline to the end of the sleep, us.
    pub(crate) late_us: Quantiles,
    /// The real-time settings that the system granted.
    pub(crate) granted: Vec<String>,
}

/// Cost of one exchange of bus `index` on the wire alone.
pub(crate) fn wire_cost(robot: &Robot, index: usize) -> CycleCost {
    let bus = Bus { adapter_latency_us: 0, ..robot.buses[index].clone() };
    let read = match bus.protocol {
        Protocol::Dynamixel => GroupRead::Fast,
        Protocol::Feetech => GroupRead::Plain,
    };
    let servos = || robot.joints.iter().filter_map(|joint| joint.servo).filter(|servo| servo.bus == index);
    cycle_cost(&bus, servos().next().unwrap().model.registers, servos().count(), read)
}

/// The servos of `robot`, and of its twin, whose lines come after its own.
pub(crate) fn world_of_twins(robot: &Robot) -> World {
    let mut both = robot.clone();
    for bus in &robot.buses {
        both.buses.push(Bus { name: format!("{}.bare", bus.name), ..bus.clone() });
    }
    for joint in &robot.joints {
        let mut joint = joint.clone();
        joint.servo.iter_mut().for_each(|servo| servo.bus += robot.buses.len());
        both.joints.push(joint);
    }
    world(&both)
}

/// Measures on the lines of the twin, served at `paths`: from `first` on (on the clock of [`monotonic`]), once a
/// period, until `is_done`, with the requests of a robot that stands, as in `plan`. Stays on `processor`.
pub(crate) fn measure(
    robot: &Robot,
    paths: &[PathBuf],
    plan: RunPlan,
    first: Duration,
    processor: usize,
    is_done: &AtomicBool,
) -> Bare {
    let requests = requests(robot, plan);
    let replies: Vec<usize> = (0..robot.buses.len()).map(|bus| wire_cost(robot, bus).bytes_in).collect();
    let devices: Vec<Device> =
        robot.buses.iter().zip(paths).map(|(bus, path)| Device::of(bus, path.clone())).collect();
    let mut ports = SerialPorts::open(&devices).unwrap();
    let granted = request_real_time(Some(processor));
    let period = Duration::from_secs_f64(robot.period_s());
    let (exchange_us, late_us) = exchange(&mut ports, &requests, &replies, first, period, is_done);
    Bare { exchange_us, late_us, granted }
}

fn exchange(
    ports: &mut SerialPorts,
    requests: &[Vec<u8>],
    replies: &[usize],
    first: Duration,
    period: Duration,
    is_done: &AtomicBool,
) -> (Vec<Quantiles>, Quantiles) {
    let mut took_us = vec![Histogram::<u64>::new(3).unwrap(); requests.len()];
    let mut late_us = Histogram::<u64>::new(3).unwrap();
    let mut piece = [0; 512];
    // The ports' clock started when they were opened.
    let offset = monotonic().saturating_sub(Duration::from_nanos(ports.now().0));
    let mut deadline = Time(u64::try_from(first.saturating_sub(offset).as_nanos()).unwrap());
    while !is_done.load(Ordering::Relaxed) {
        ports.wait_until(deadline);
        late_us.record(micros(ports.now().since(deadline))).unwrap();
        let mut sent = vec![Time::default(); requests.len()];
        for (bus, request) in requests.iter().enumerate() {
            ports.discard_input(bus).unwrap();
            ports.send(bus, request).unwrap();
            sent[bus] = ports.now();
        }
        let mut left = replies.to_vec();
        // An answer that takes longer than a period counts as lost.
        let latest = sent[0] + period;
        while left.iter().any(|left| *left > 0) && ports.now() < latest {
            for bus in 0..left.len() {
                while left[bus] > 0 {
                    let count = ports.receive(bus, &mut piece).unwrap();
                    left[bus] = left[bus].saturating_sub(count);
                    if count == 0 {
                        break;
                    }
                    if left[bus] == 0 {
                        took_us[bus].record(micros(ports.now().since(sent[bus]))).unwrap();
                    }
                }
            }
            if left.iter().any(|left| *left > 0) {
                ports.wait_for_input(latest);
            }
        }
        while deadline <= ports.now() {
            deadline = deadline + period;
        }
    }
    (took_us.iter().map(Quantiles::of).collect(), Quantiles::of(&late_us))
}

fn micros(duration: Duration) -> u64 {
    u64::try_from(duration.as_micros()).unwrap()
}

/// The bytes sent on each bus in the last cycle before the robot walks.
fn requests(robot: &Robot, plan: RunPlan) -> Vec<Vec<u8>> {
    let sent = std::cell::RefCell::new(vec![Vec::new(); robot.buses.len()]);
    let ports = Listening { ports: SimPorts::on_virtual_clock(world(robot)), sent: &sent };
    let mut standing = Vec::new();
    run(robot, plan, ports, |status| {
        if status.activity == Activity::Standing {
            standing.clone_from(&sent.borrow());
        }
        if standing.is_empty() { Order::Go } else { Order::StopAtOnce }
    })
    .unwrap();
    standing
}

/// Simulated ports that remember the last bytes sent on each bus.
struct Listening<'s> {
    ports: SimPorts,
    sent: &'s std::cell::RefCell<Vec<Vec<u8>>>,
}

impl Ports for Listening<'_> {
    fn now(&mut self) -> Time {
        self.ports.now()
    }

    fn discard_input(&mut self, bus: usize) -> Result<(), PortError> {
        self.ports.discard_input(bus)
    }

    fn send(&mut self, bus: usize, bytes: &[u8]) -> Result<(), PortError> {
        self.sent.borrow_mut()[bus] = bytes.to_vec();
        self.ports.send(bus, bytes)
    }

    fn receive(&mut self, bus: usize, into: &mut [u8]) -> Result<usize, PortError> {
        self.ports.receive(bus, into)
    }

    fn receive_imu(&mut self, into: &mut [u8]) -> Result<usize, PortError> {
        self.ports.receive_imu(into)
    }

    fn wait_for_input(&mut self, deadline: Time) {
        self.ports.wait_for_input(deadline);
    }

    fn wait_until(&mut self, deadline: Time) {
        self.ports.wait_until(deadline);
    }
}
