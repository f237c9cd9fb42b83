//! What a serial line costs beyond its wire: exchanges over a pseudo-terminal against wire time, and how
//! punctual the loop is beside a bare sleeping loop.
//!
//! `cargo bench --bench pty_exchange`. Every robot walks in real time twice, first as an ordinary thread, then
//! with what real-time promises the system makes. Nothing else should run on the machine.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a measurement for a person to read")]

use std::io::{Read, Write};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use hdrhistogram::Histogram;
use hippocamp::bus::serial::Device;
use hippocamp::bus::timing::{CycleCost, GroupRead, cycle_cost};
use hippocamp::bus::{Ports, SerialPorts};
use hippocamp::capability::HorseCapability;
use hippocamp::config;
use hippocamp::ik::Method;
use hippocamp::model::{Bus, Motion, Protocol, Robot};
use hippocamp::motion::{Command, Order};
use hippocamp::platform::{monotonic, request_real_time, sleep_until};
use hippocamp::run::{RunPlan, run};
use hippocamp::simulation;
use hippocamp::telemetry::{Quantiles, Report};
use hw_sim::FaultScript;
use hw_sim::pty::PtyServer;
use serialport::{SerialPort, TTYPort};

/// How long each robot walks: the first number given (`cargo bench --bench pty_exchange -- 60`), or ten seconds.
fn seconds() -> f64 {
    std::env::args().find_map(|argument| argument.parse().ok()).unwrap_or(10.0)
}

/// Exchanges of the terminal alone.
const ECHOES: u32 = 1000;

fn main() {
    for file in ["horse.toml", "horse-dynamixel.toml"] {
        for is_real_time in [false, true] {
            // A thread of its own takes its promises with it when it ends.
            std::thread::spawn(move || measure(file, is_real_time)).join().unwrap();
        }
    }
}

fn measure(file: &str, is_real_time: bool) {
    let robot = config::load(&Path::new("config").join(file)).unwrap().robot;
    let granted = if is_real_time { request_real_time(None) } else { vec!["ordinary thread".to_owned()] };
    println!("{file} at {} Hz, {}", robot.rate_hz, granted.join(", "));
    let wire = wire_cost(&robot, 0);
    let terminal = echoes(&robot, wire);
    print("terminal alone (an echo)", &terminal);
    let (report, bare) = walk(&robot);
    for bus in &report.buses {
        print(&format!("exchange on {}", bus.name), &bus.exchange_us);
        let (wire_us, own_us) = (wire.time.as_micros(), u128::from(terminal.p50));
        println!(
            "  {:<28} {wire_us} us wire + {own_us} us terminal = {} us; {} of {} replies missing",
            "",
            wire_us + own_us,
            bus.missing,
            bus.exchanges * 16 / u64::try_from(report.buses.len()).unwrap()
        );
    }
    print("lateness of the loop", &report.loop_times.late_us);
    print("lateness of a bare loop", &bare);
    println!("  {} of {} cycles late by more than a tenth of a period\n", report.late_cycles, report.cycles);
}

fn print(what: &str, us: &Quantiles) {
    println!("  {what:<28} us p50 {:>6} p99 {:>6} p99.9 {:>6} max {:>6}", us.p50, us.p99, us.p999, us.max);
}

/// One exchange of bus `index` on the wire alone.
fn wire_cost(robot: &Robot, index: usize) -> CycleCost {
    let bus = Bus { adapter_latency_us: 0, ..robot.buses[index].clone() };
    let read = match bus.protocol {
        Protocol::Dynamixel => GroupRead::Fast,
        Protocol::Feetech => GroupRead::Plain,
    };
    let servos = || robot.joints.iter().filter_map(|joint| joint.servo).filter(|servo| servo.bus == index);
    cycle_cost(&bus, servos().next().unwrap().model.registers, servos().count(), read)
}

/// Round trips of as many bytes as an exchange has, once a period on all lines of the robot at the same time, to
/// a thread that answers at once.
fn echoes(robot: &Robot, cost: CycleCost) -> Quantiles {
    let mut far_ends = Vec::new();
    let mut devices = Vec::new();
    for bus in &robot.buses {
        let (mut far, near) = TTYPort::pair().unwrap();
        far.set_timeout(Duration::from_secs(60)).unwrap();
        devices.push(Device::of(bus, near.name().unwrap().into()));
        far_ends.push(far);
    }
    let mut ports = SerialPorts::open(&devices).unwrap();
    let echo = std::thread::spawn(move || {
        let (mut request, reply) = (vec![0; cost.bytes_out], vec![0; cost.bytes_in]);
        while far_ends.iter_mut().all(|far| far.read_exact(&mut request).is_ok()) {
            for far in &mut far_ends {
                far.write_all(&reply).unwrap();
            }
        }
    });
    let mut times = Histogram::<u64>::new(3).unwrap();
    let (request, mut reply) = (vec![0; cost.bytes_out], vec![0; cost.bytes_in]);
    let mut next = ports.now();
    for _ in 0..ECHOES {
        next = next + Duration::from_secs_f64(robot.period_s());
        ports.wait_until(next);
        let sent = ports.now();
        for bus in 0..devices.len() {
            ports.send(bus, &request).unwrap();
        }
        let mut left = vec![cost.bytes_in; devices.len()];
        while left.iter().any(|left| *left > 0) {
            ports.wait_for_input(sent + Duration::from_secs(1));
            for (bus, left) in left.iter_mut().enumerate().filter(|(_, left)| **left > 0) {
                *left -= ports.receive(bus, &mut reply[..*left]).unwrap();
                if *left == 0 {
                    times.record(u64::try_from(ports.now().since(sent).as_micros()).unwrap()).unwrap();
                }
            }
        }
    }
    // Closing the lines ends the echo.
    drop(ports);
    echo.join().unwrap();
    Quantiles::of(&times)
}

/// Walks over pseudo-terminals; a bare loop of the same rate, half a period out of step, runs at the same time.
fn walk(robot: &Robot) -> (Report, Quantiles) {
    let Motion::Horse(horse) = &robot.motion;
    let capability = HorseCapability::of(robot, horse).unwrap();
    let horse = capability.plan(horse, Command::ahead(0, 0.05));
    let plan = RunPlan { horse, method: Method::CcdThenFinish, walk_for_s: seconds() };
    let folder = tempfile::tempdir().unwrap();
    // The terminal takes the adapter's place.
    let mut without_adapters = robot.clone();
    for bus in &mut without_adapters.buses {
        bus.adapter_latency_us = 0;
    }
    let world = simulation::world(&without_adapters, 1, &FaultScript::default()).unwrap();
    let server = PtyServer::start(world, folder.path()).unwrap();
    let devices: Vec<Device> =
        robot.buses.iter().zip(server.paths()).map(|(bus, path)| Device::of(bus, path.clone())).collect();
    let ports = SerialPorts::open(&devices).unwrap();
    let is_done = AtomicBool::new(false);
    std::thread::scope(|scope| {
        let bare = scope.spawn(|| bare_loop(robot.period_s(), &is_done));
        let report = run(robot, plan, ports, |_| Order::Go).unwrap();
        is_done.store(true, Ordering::Relaxed);
        (report, bare.join().unwrap())
    })
}

fn bare_loop(period_s: f64, is_done: &AtomicBool) -> Quantiles {
    let period = Duration::from_secs_f64(period_s);
    let mut late_us = Histogram::<u64>::new(3).unwrap();
    let mut next = monotonic() + period / 2;
    while !is_done.load(Ordering::Relaxed) {
        sleep_until(next);
        let late = monotonic().saturating_sub(next);
        late_us.record(u64::try_from(late.as_micros()).unwrap()).unwrap();
        next += period.mul_f64(1.0 + (late.as_secs_f64() / period_s).floor());
    }
    Quantiles::of(&late_us)
}
