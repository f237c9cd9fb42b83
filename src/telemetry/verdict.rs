//! Whether a run was good: what was asked against what was reached, and the margins on the way.

use serde::Serialize;

use super::report::Report;
use super::way::{Followed, WalkTotals};
use crate::model::{Joint, Robot};
use crate::observe::Outcome;

/// Least time of walking, s, least way, m, and least turn, degrees, that can be judged: less is starting and stopping.
const LEAST_S: f64 = 2.0;
const LEAST_M: f64 = 0.1;
const LEAST_DEG: f64 = 20.0;
/// Share of the way or turn asked for that must be reached, and that must not be passed.
const SHARES: (f64, f64) = (0.7, 1.3);
/// Most that a robot may turn without being asked, degrees, and go aside as a share of its way.
const STRAY_DEG: f64 = 30.0;
const STRAY_SHARE: f64 = 0.3;
/// Steepest roll or pitch of a trunk that walks well, degrees.
const LEAN_DEG: f64 = 30.0;
/// Largest share of joint goals that safety changed, of replies lost or damaged, and of cycles that began late.
const CHANGED_SHARE: f64 = 0.05;
const LOST_SHARE: f64 = 0.01;
const LATE_SHARE: f64 = 0.01;
/// Longest that safety may hold a robot, s: it waits that long for joints to catch up when a motion begins.
const HELD_S: f64 = 0.1;
/// A gait flies that has all feet off the ground for more than this share of its time.
const FLIGHT_SHARE: f64 = 0.01;

/// The finding that repeats why a run ended.
pub const INCOMPLETE: &str = "the run did not complete";

/// What a run was worth.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// It did what was asked.
    Good,
    /// It ended as it should, and did not do what was asked, or not well.
    Poor,
    /// It fell, was stopped by safety, or broke off.
    Failed,
}

impl Verdict {
    /// The word used in reports.
    pub fn name(self) -> &'static str {
        match self {
            Verdict::Good => "good",
            Verdict::Poor => "poor",
            Verdict::Failed => "failed",
        }
    }
}

/// One thing that was not as it should be.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct VerdictFinding {
    /// How much that is worth: a run is as bad as its worst finding.
    pub verdict: Verdict,
    /// What.
    pub what: &'static str,
    /// How much, with units, beside what was expected.
    pub how_much: String,
    /// Where: a bus, a joint; empty where it is the whole robot.
    #[serde(rename = "where")]
    pub place: String,
    /// What is likely to be the cause.
    pub likely_cause: String,
    /// What to do.
    pub cure: &'static str,
}

/// Everything that was not as it should be in the run of `report` on `robot`, in which it `walked` so.
pub fn findings(report: &Report, robot: &Robot, walked: Option<WalkTotals>) -> Vec<VerdictFinding> {
    let mut found = Vec::new();
    let mut add = |verdict, what, how_much: String, place: &str, likely_cause: String, cure| {
        found.push(VerdictFinding { verdict, what, how_much, place: place.to_owned(), likely_cause, cure });
    };
    if report.outcome != Outcome::Completed {
        add(
            Verdict::Failed,
            INCOMPLETE,
            report.outcome.name().to_owned(),
            "",
            report.reason.clone(),
            "do what the reason says, and run it again",
        );
    }
    if report.outcome == Outcome::Completed && report.body.is_some_and(|body| body.fell) {
        let slope = report.body.map_or(0.0, |body| body.roll_max_deg.max(body.pitch_max_deg));
        add(
            Verdict::Failed,
            "it fell",
            format!("{slope:.0} degrees from upright at most on its feet"),
            "",
            "it lost its balance".to_owned(),
            "ask for less speed, another gait, or more grip",
        );
    }
    if let Some(walked) = walked.filter(|walked| walked.time_s >= LEAST_S) {
        judge_way(report, &walked, &mut add);
    }
    let goals = report.cycles.saturating_mul(robot.joints.len() as u64);
    let changed = share(report.safety_interventions, goals);
    // A stop changes goals by itself.
    let is_whole = report.outcome == Outcome::Completed;
    if is_whole && changed > CHANGED_SHARE {
        add(
            Verdict::Poor,
            "safety changed goals",
            format!("{:.1} % of all joint goals", changed * 100.0),
            "",
            "the motion asks joints for more than their range, rate or acceleration".to_owned(),
            "ask for less speed, or a smaller posture",
        );
    }
    let held_s = report.held_cycles as f64 * robot.period_s();
    if is_whole && held_s > HELD_S {
        add(
            Verdict::Poor,
            "safety held the robot",
            format!("for {held_s:.2} s"),
            "",
            "a fault that passed".to_owned(),
            "see losses and outages below",
        );
    }
    for outage in &report.outages {
        add(
            Verdict::Poor,
            "a joint was left without torque",
            format!("at {:.1} s", outage.time_s),
            &outage.joint,
            outage.reason.clone(),
            "check its servo",
        );
    }
    for (index, bus) in report.buses.iter().enumerate() {
        let is_on_it = |joint: &&Joint| joint.servo.is_some_and(|servo| servo.bus == index);
        let servos = robot.joints.iter().filter(is_on_it).count() as u64;
        let lost = share(bus.missing + bus.corrupt, bus.exchanges.saturating_mul(servos));
        if lost > LOST_SHARE {
            add(
                Verdict::Poor,
                "replies were lost",
                format!(
                    "{:.1} % of them: {} missing and {} damaged in {} exchanges with {servos} servos",
                    lost * 100.0,
                    bus.missing,
                    bus.corrupt,
                    bus.exchanges
                ),
                &bus.name,
                "a loose plug, a long cable, a servo without power, or noise".to_owned(),
                "run hippocamp doctor",
            );
        }
    }
    let late = share(report.late_cycles, report.cycles);
    if late > LATE_SHARE {
        add(
            Verdict::Poor,
            "cycles began late",
            format!("{:.1} % of them, {} us late at most", late * 100.0, report.loop_times.late_us.max),
            "",
            "other programs, or no permission for real-time priority".to_owned(),
            "see docs/hardware.md: real-time priority, a processor of its own",
        );
    }
    if let Some(recording) = report.recording.as_ref().filter(|of| of.dropped > 0 || of.error.is_some()) {
        add(
            Verdict::Poor,
            "the recording is not complete",
            format!("{} cycles missing", recording.dropped),
            &recording.file,
            recording.error.clone().unwrap_or_else(|| "the disk is slow".to_owned()),
            "record to a faster disk with more room",
        );
    }
    found
}

/// The way, turn and lean of a robot that walked.
fn judge_way(
    report: &Report,
    walked: &WalkTotals,
    add: &mut impl FnMut(Verdict, &'static str, String, &str, String, &'static str),
) {
    let WalkTotals { asked, reached, forward_m, turn_rad, flight_share, .. } = *walked;
    let is_off = |of: Followed| !(SHARES.0..=SHARES.1).contains(&(of.reached / of.asked));
    let (lag, cure) = if flight_share > FLIGHT_SHARE {
        let share = flight_share * 100.0;
        (
            format!(
                "its gait leaves the ground for {share:.0} % of the time, and position goals cannot throw the \
                 trunk up: feet drag"
            ),
            "use a gait that keeps feet on the ground: walk, walk-steady or trot",
        )
    } else {
        (
            format!(
                "feet slip, or joints lag behind their goals ({:.1} degrees at most)",
                report.joints.tracking_error_max_deg
            ),
            "ask for less speed or another gait; check friction, supply and [balance]",
        )
    };
    if forward_m.asked >= LEAST_M && is_off(forward_m) {
        add(
            Verdict::Poor,
            "speed not as asked",
            format!(
                "{:.2} m of {:.2} m asked, at {:.3} m/s",
                forward_m.reached, forward_m.asked, reached.speed_m_s
            ),
            "",
            lag.clone(),
            cure,
        );
    }
    // A turn that was not asked for, and one that was.
    let off_deg = (reached.turn_deg - asked.turn_deg).abs();
    let (asked_deg, followed_deg) = (turn_rad.asked.to_degrees(), turn_rad.reached.to_degrees());
    let is_asked = asked_deg >= LEAST_DEG;
    let is_turn_off = match is_asked {
        true => (followed_deg - asked_deg).abs() > STRAY_DEG.max((1.0 - SHARES.0) * asked_deg),
        false => off_deg > STRAY_DEG,
    };
    if is_turn_off {
        add(
            Verdict::Poor,
            "turn not as asked",
            match is_asked {
                true => format!("{followed_deg:.0} degrees of {asked_deg:.0} degrees asked"),
                false => format!("{:.0} degrees, and {:.0} asked", reached.turn_deg, asked.turn_deg),
            },
            "",
            match is_asked {
                true => "legs without a sideways joint scrub their feet over the ground".to_owned(),
                false => lag.clone(),
            },
            match is_asked {
                true => "turn in wider curves while it walks, or ask for less",
                false => cure,
            },
        );
    }
    let aside_m = (reached.side_m - asked.side_m).abs();
    if off_deg <= STRAY_DEG && aside_m > LEAST_M + STRAY_SHARE * forward_m.asked {
        add(
            Verdict::Poor,
            "it drifted sideways",
            format!("{aside_m:.2} m"),
            "",
            lag,
            "check the feet, the slope and the zeros of the joints",
        );
    }
    if let Some(body) = report.body.filter(|body| !body.fell) {
        let lean_deg = body.roll_max_deg.max(body.pitch_max_deg);
        if lean_deg > LEAN_DEG {
            add(
                Verdict::Poor,
                "the trunk leant",
                format!("{lean_deg:.0} degrees at most"),
                "",
                "it was about to fall".to_owned(),
                "ask for less speed or another gait",
            );
        }
    }
}

#[expect(clippy::cast_precision_loss, reason = "a share of counts")]
fn share(of: u64, all: u64) -> f64 {
    if all == 0 { 0.0 } else { of as f64 / all as f64 }
}
