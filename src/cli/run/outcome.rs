//! The results of a run: its report, its summary, its exit code.

use anyhow::{Context, Result};

use super::super::record::RecordingFile;
use super::super::{COMPLETED, FAILED, FALLEN, POOR, STOPPED_BY_SAFETY, write_whole};
use crate::model::Robot;
use crate::observe::Outcome;
use crate::output::Place;
use crate::run::LATE_SHARE;
use crate::telemetry::{INCOMPLETE, Report, Verdict};

/// Exit code of a run with this outcome.
pub(in crate::cli) fn exit_code(outcome: Outcome) -> u8 {
    match outcome {
        Outcome::Completed => COMPLETED,
        Outcome::StoppedBySafety => STOPPED_BY_SAFETY,
        Outcome::Fallen => FALLEN,
        Outcome::Failed => FAILED,
    }
}

/// An outcome as it is printed.
pub(in crate::cli) fn outcome_words(outcome: Outcome) -> &'static str {
    match outcome {
        Outcome::Completed => "completed",
        Outcome::StoppedBySafety => "STOPPED BY SAFETY",
        Outcome::Fallen => "FALLEN",
        Outcome::Failed => "FAILED",
    }
}

/// Exit code of a run with this `report`; with `is_strict`, a poor one has a code of its own.
pub(super) fn exit_code_of(report: &Report, is_strict: bool) -> u8 {
    match (report.outcome, report.verdict) {
        (Outcome::Completed, Verdict::Poor) if is_strict => POOR,
        // It fell on the way, and got up.
        (Outcome::Completed, Verdict::Failed) if is_strict => FALLEN,
        (outcome, _) => exit_code(outcome),
    }
}

/// Moves a complete recording to its final place, and notes the place in the report.
pub(super) fn keep(recording: &mut RecordingFile, report: &mut Report) {
    if let Some(of) = &mut report.recording
        && of.error.is_none()
    {
        match recording.keep() {
            Ok(()) => recording.name().clone_into(&mut of.file),
            Err(error) => of.error = Some(format!("it could not be put in its place: {error}")),
        }
    }
}

pub(super) fn write_report(place: &Place, report: &Report) -> Result<()> {
    let text = serde_json::to_string_pretty(report).context("the report could not be converted to JSON")?;
    write_whole(place, &(text + "\n"))
}

pub(super) fn print_summary(robot: &Robot, report: &Report) {
    say!("{}: {}: {}", report.verdict.name(), outcome_words(report.outcome), report.reason);
    if let (Some(asked), Some(reached)) = (report.asked, report.reached) {
        say!(
            "  asked for {:.3} m/s, {:.2} m and {:.0} degrees of turn; reached {:.3} m/s, {:.2} m and {:.0} degrees",
            asked.speed_m_s,
            asked.distance_m,
            asked.turn_deg,
            reached.speed_m_s,
            reached.distance_m,
            reached.turn_deg
        );
    }
    // The first line says why a run did not complete.
    for finding in report.findings.iter().filter(|finding| finding.what != INCOMPLETE) {
        let place = if finding.place.is_empty() { String::new() } else { format!(" ({})", finding.place) };
        say!(
            "  {}: {}{place}: {}; likely cause: {}; cure: {}",
            finding.verdict.name(),
            finding.what,
            finding.how_much,
            finding.likely_cause,
            finding.cure
        );
    }
    let computing = report.loop_times.work_us.map_or_else(String::new, |work_us| {
        format!("; computing a cycle {} us at most, {} us half of the time", work_us.max, work_us.p50)
    });
    say!(
        "  {:.1} s, {} cycles, {} late by more than {} ms{computing}",
        report.duration_s,
        report.cycles,
        report.late_cycles,
        LATE_SHARE * robot.period_s() * 1e3
    );
    if let Some(slowest) = &report.loop_times.slowest {
        say!("  {slowest}");
    }
    say!(
        "  joints: {} goals outside their range, {} too fast, {} changed by safety, held for {} cycles; off their goal by {:.1} degrees at most",
        report.joints.range_violations,
        report.joints.rate_violations,
        report.safety_interventions,
        report.held_cycles,
        report.joints.tracking_error_max_deg
    );
    if let Some(feet) = &report.feet {
        say!("  {feet}");
    }
    if let Some(body) = &report.body {
        say!("  {body}");
    }
    if let Some(arms) = &report.arms {
        say!("  {arms}");
    }
    if let Some(imu) = &report.imu {
        say!("  {imu}");
    }
    if let Some(falls) = report.falls.filter(|falls| falls.falls > 0) {
        say!("  {falls}");
    }
    if let Some(times) = report.arm_yields.filter(|times| *times > 0) {
        say!("  arms gave way to a load {times} times");
    }
    for outage in &report.outages {
        say!("  at {:.1} s {}", outage.time_s, outage.reason);
    }
    if report.servo_restarts > 0 {
        say!("  servos that tripped: {} restarts", report.servo_restarts);
    }
    for (bus, described) in report.buses.iter().zip(&robot.buses) {
        say!(
            "  bus {} ({}, {} baud): {} exchanges of {} us, wire busy {:.0} %, {} replies missing, {} damaged",
            bus.name,
            described.protocol.name(),
            described.baud,
            bus.exchanges,
            bus.exchange_us.p50,
            bus.wire_share * 100.0,
            bus.missing,
            bus.corrupt
        );
    }
    if let Some(recording) = &report.recording {
        let error =
            recording.error.as_ref().map_or_else(String::new, |error| format!(", then ended: {error}"));
        say!(
            "  recording {}: {} cycles, {} dropped{error}",
            recording.file,
            recording.records,
            recording.dropped
        );
    }
}
