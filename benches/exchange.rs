//! A walk of the real program over pseudo-terminals in real time: the exchange takes no longer than its wire and
//! the terminal.
//!
//! It needs a quiet machine. With `HIPPOCAMP_FULL` set each robot walks for a minute, which the figures of
//! docs/hardware.md need; else for three seconds: medians need no more.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a test may panic; figures are for people")]

#[path = "../tests/common/mod.rs"]
mod common;

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use hippocamp::bus::timing::wire_time;
use hippocamp::ik::Method;
use hippocamp::plan::RunPlan;
use hippocamp::platform::{monotonic, request_real_time};
use hw_sim::World;
use serde_json::Value;

use common::bare::{self, Bare, wire_cost};
use common::built::Built;
use common::frames::frames;
use common::{ROBOTS, is_full, plan};

/// How long each robot walks, s.
fn walk_s() -> &'static str {
    if is_full() { "60" } else { "3" }
}

/// How far the exchange may be from wire time and terminal together.
const SHARE: f64 = 0.05;
/// The same on a machine too busy to tell: the bytes of a terminal go through an ordinary thread of the system's,
/// which other programs delay, and not for both exchanges alike.
const BUSY_SHARE: f64 = 0.25;
/// The machine is that busy if the terminal loses more of the replies than this, by handing them over too late: on a
/// quiet one it loses none.
const LOST_SHARE: f64 = 0.0005;
/// Exchanges looked at to find out when they begin.
const CYCLES: usize = 51;

/// An exchange takes the time of its wire and the terminal.
fn main() {
    for file in ROBOTS {
        let first = walk(file);
        let Some(why) = first.fault(SHARE) else { continue };
        println!("{file}: once more, because {why}");
        let second = walk(file);
        let Some(again) = second.fault(SHARE) else { continue };
        let is_busy = first.lost_share.max(second.lost_share) > LOST_SHARE;
        assert!(is_busy, "{file}: {again}, after {why}");
        println!("{file}: {again}; the machine is too busy to tell to {SHARE}, {BUSY_SHARE} must do");
        let fault = second.fault(BUSY_SHARE);
        assert!(fault.is_none(), "{file}: {again}, after {why}");
    }
}

/// The result of a walk.
struct WalkTotals {
    /// Anything but a proper end.
    bad_end: Option<String>,
    /// Exchange of each bus, as a share of wire time and terminal together; medians.
    ratios: Vec<f64>,
    /// Share of all replies that came too late or not at all.
    lost_share: f64,
}

impl WalkTotals {
    /// The errors of a walk whose exchange times may be off by `share`.
    fn fault(&self, share: f64) -> Option<String> {
        let is_off = |ratio: &&f64| (**ratio - 1.0).abs() > share;
        let off = || self.ratios.iter().find(is_off);
        self.bad_end
            .clone()
            .or_else(|| off().map(|ratio| format!("an exchange took {ratio:.3} of wire and terminal")))
    }
}

/// Walks, and measures beside it.
fn walk(file: &str) -> WalkTotals {
    let (near, far) = (0, std::thread::available_parallelism().map_or(0, |count| count.get() - 1));
    let built = Built::served(file, bare::world_of_twins, move || drop(request_real_time(Some(far))));
    let robot = &built.robot;
    let report_file = built.folder.path().join("report.json");
    let mut command = built.run();
    command.args(["--for", walk_s(), "--processor", &near.to_string(), "--report"]).arg(&report_file);
    let mut child = command.spawn().unwrap();
    let first = half_a_period_after_the_loop(&built);
    let plan = RunPlan {
        motion: plan(robot, "walk", 0.9).into(),
        method: Method::CcdThenFinish,
        move_for_s: 0.0,
        driver: None,
    };
    let spare = &built.server.as_ref().unwrap().paths()[robot.buses.len()..];
    let is_done = AtomicBool::new(false);
    let bare = std::thread::scope(|scope| {
        // A thread of its own takes its priority with it.
        let bare = scope.spawn(|| bare::measure(robot, spare, plan, first, near, &is_done));
        child.wait().unwrap();
        is_done.store(true, Ordering::Relaxed);
        bare.join().unwrap()
    });
    let report: Value = serde_json::from_str(&std::fs::read_to_string(&report_file).unwrap()).unwrap();
    print(file, &built, &report, &bare);
    let buses = || report["buses"].as_array().unwrap().iter();
    let number = |value: &Value| value.as_f64().unwrap();
    #[allow(clippy::cast_precision_loss, reason = "microseconds, and a few servos")]
    let (ratios, servos) = (
        buses()
            .zip(&bare.exchange_us)
            .map(|(bus, bare)| number(&bus["exchange_us"]["p50"]) / bare.p50 as f64),
        robot.joints.len() as f64,
    );
    WalkTotals {
        bad_end: (report["outcome"] != "completed").then(|| format!("it ended so: {}", report["reason"])),
        ratios: ratios.collect(),
        lost_share: buses().map(|bus| number(&bus["missing"])).sum::<f64>()
            / (number(&report["cycles"]) * servos),
    }
}

/// A moment half a period after an exchange begins, once the robot has torque: the two exchanges do not meet.
fn half_a_period_after_the_loop(built: &Built) -> Duration {
    built.wait_for("torque", || built.with_torque() == built.robot.joints.len());
    built.with_world(World::keep_requests);
    let frames = || built.with_world(|world| frames(&built.robot, world, 0));
    built.wait_for("cycles", || frames().len() >= CYCLES);
    let frames = frames();
    built.with_world(World::forget_requests);
    // An exchange begins with its first byte; a frame tells when its last had crossed.
    let out = wire_time(wire_cost(&built.robot, 0).bytes_out, built.robot.buses[0].baud);
    let out_ns = u64::try_from(out.as_nanos()).unwrap();
    let period_ns = u64::try_from(built.period().as_nanos()).unwrap();
    let period = built.period();
    let mut phases_ns: Vec<u64> = frames.iter().map(|frame| (frame.at_ns - out_ns) % period_ns).collect();
    phases_ns.sort_unstable();
    let phase = Duration::from_nanos(phases_ns[phases_ns.len() / 2]);
    // The world's clock is not the system's; asked several times, for once without an interruption.
    let since = (0..100).map(|_| {
        let before = monotonic();
        (built.with_world(|world| Duration::from_nanos(world.now_ns())), before)
    });
    let world_start = since.map(|(world, before)| before.saturating_sub(world)).max().unwrap();
    let soon = built.with_world(|world| world.now_ns()) + 10 * period_ns;
    world_start + Duration::from_nanos(soon - soon % period_ns) + phase + period / 2
}

fn print(file: &str, built: &Built, report: &Value, bare: &Bare) {
    println!("{file} at {} Hz; {}", built.robot.rate_hz, bare.granted.join("; "));
    let quantiles = |us: &Value| {
        format!("p50 {:>5} p99 {:>5} p99.9 {:>5} max {:>6}", us["p50"], us["p99"], us["p999"], us["max"])
    };
    for (index, bus) in report["buses"].as_array().unwrap().iter().enumerate() {
        let (wire, alone) = (wire_cost(&built.robot, index).time, &bare.exchange_us[index]);
        let wire_us = u64::try_from(wire.as_micros()).unwrap();
        assert!(alone.p50 >= wire_us, "bare bytes took {} us, less than their wire", alone.p50);
        let took = bus["exchange_us"]["p50"].as_u64().unwrap();
        #[allow(clippy::cast_precision_loss, reason = "microseconds")]
        let off = 100.0 * (took as f64 / alone.p50 as f64 - 1.0);
        println!("  exchange on {:<12} us {}", bus["name"], quantiles(&bus["exchange_us"]));
        println!(
            "    {wire_us} us wire + {} us terminal = {} us: {off:+.1} %; {} replies missing of {} exchanges",
            i64::try_from(alone.p50).unwrap() - i64::try_from(wire_us).unwrap(),
            alone.p50,
            bus["missing"],
            bus["exchanges"]
        );
    }
    println!("  lateness of the loop       us {}", quantiles(&report["loop"]["late_us"]));
    println!("  lateness of a bare loop    us {}", quantiles(&serde_json::to_value(bare.late_us).unwrap()));
}
