//! The report of a run, as written to a file.

use std::fmt;

use serde::Serialize;

use super::imu::ImuReport;
use super::verdict::{Verdict, VerdictFinding, findings};
use super::way::{GroundPath, WalkTotals};
use crate::model::Robot;
use crate::observe::{Outcome, RecordingReport};
use crate::reflex::ReflexReport;
use crate::stopwatch::{LoopReport, Quantiles};

/// The report of a run. Lengths in m, speeds in m/s, angles in degrees (for people), times as named.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Report {
    /// Name of the robot.
    pub robot: String,
    /// The driver: a script, the keyboard or a gamepad. `None` for a run by its own plan.
    pub driver: Option<String>,
    /// Name of the gait that a horse was planned for; `stand` in a driven run.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gait: Option<String>,
    /// Speed that a horse was planned for, after limits, m/s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub speed_m_s: Option<f64>,
    /// Duration of the whole run, s.
    pub duration_s: f64,
    /// Cycles completed.
    pub cycles: u64,
    /// Cycles that began more than a tenth of a period after their deadline.
    pub late_cycles: u64,
    /// How the run ended.
    pub outcome: Outcome,
    /// Reason for that outcome.
    pub reason: String,
    /// Whether it was good: as bad as the worst of the findings.
    pub verdict: Verdict,
    /// What was not as it should be.
    pub findings: Vec<VerdictFinding>,
    /// How long it walked, s; none for a robot that did not.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub walked_s: Option<f64>,
    /// The way it was asked to go while it walked.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub asked: Option<GroundPath>,
    /// The way it went meanwhile: by the truth of a simulated body, on hardware by what the robot knows of itself.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reached: Option<GroundPath>,
    /// True if every servo has heard the end of the run: then no servo has torque that it should not have.
    pub is_end_heard: bool,
    /// Joint goals that safety changed, summed over all cycles.
    pub safety_interventions: u64,
    /// Cycles in which safety held the robot still.
    pub held_cycles: u64,
    /// Timing of the loop.
    #[serde(rename = "loop")]
    pub loop_times: LoopReport,
    /// Joints against their limits.
    pub joints: JointsReport,
    /// Feet; `None` on a rig of arms.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub feet: Option<FeetReport>,
    /// The trunk; `None` on a rig of arms, and if nothing measures its motion.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub body: Option<BodyReport>,
    /// Arms; `None` on a rig without arms.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub arms: Option<ArmsReport>,
    /// The inertial measurement unit; `None` on a robot without one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub imu: Option<ImuReport>,
    /// Falls, as the robot noticed them; `None` if its file does not mention them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub falls: Option<ReflexReport>,
    /// How often an arm yielded to a load; `None` if the robot file does not mention that.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub arm_yields: Option<u32>,
    /// Joints that were taken out of service, the first 256; empty if the fault of one joint stops the robot.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub outages: Vec<OutageReport>,
    /// How often a servo that had tripped was restarted.
    pub servo_restarts: u64,
    /// Each bus.
    pub buses: Vec<BusReport>,
    /// The recording, if there was one.
    pub recording: Option<RecordingReport>,
}

/// A joint that was left without torque while the others continued.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct OutageReport {
    /// Time of the outage, s of the run, without the lateness of cycles.
    pub time_s: f64,
    /// Name of the joint.
    pub joint: String,
    /// Which servo it is, the cause, and what will become of it, in words.
    pub reason: String,
}

/// Joints against their limits.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct JointsReport {
    /// Goal registers outside their joint's range, except on the way in from a start outside it.
    pub range_violations: u64,
    /// Furthest that a joint was measured outside its range after it had been inside.
    pub range_overshoot_max_deg: f64,
    /// Goal registers further from the previous one than the rate limit and one count of rounding allow.
    pub rate_violations: u64,
    /// Largest difference between goal and measured angle in one exchange.
    pub tracking_error_max_deg: f64,
}

/// Feet, in the planned world.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct FeetReport {
    /// Furthest planned position fore or aft of the neutral foot point.
    pub excursion_max_m: f64,
    /// Furthest planned position of a stance foot from its touch-down, in the plane in which its leg works, before
    /// inverse kinematics.
    pub stance_slip_planned_max_m: f64,
    /// How far a stance foot must slide sideways out of that plane: legs without a sideways joint do so in a
    /// turn, and when the trunk rolls.
    pub lateral_slip_max_m: f64,
    /// The same slip along the ground, from measured joints; it includes the servo lag at touch-down.
    pub stance_slip_measured_max_m: f64,
    /// Change of planned foot velocity in one cycle beyond the swing curve's acceleration times the cycle.
    pub swing_velocity_jump_max_m_s: f64,
    /// Largest residual of inverse kinematics, before rounding to counts.
    pub ik_residual_max_m: f64,
}

/// The trunk, from when the robot first stands until it begins to sit down. In simulation from the true state of
/// the body; on hardware from the robot's own estimate.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct BodyReport {
    /// True if the robot lay on its trunk, or was more than 60 degrees from upright.
    pub fell: bool,
    /// Distance that the trunk went forward, along its heading at each moment; going backwards subtracts.
    pub distance_m: f64,
    /// That distance divided by the time spent walking.
    pub mean_speed_m_s: f64,
    /// Largest roll, to either side.
    pub roll_max_deg: f64,
    /// Largest pitch, up or down.
    pub pitch_max_deg: f64,
    /// Largest error of its height above the ground's plane against the plan; `None` on hardware.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub height_error_max_m: Option<f64>,
}

impl fmt::Display for BodyReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let fell = if self.fell { "FELL; it" } else { "did not fall;" };
        write!(
            f,
            "body: {fell} went {:.2} m, {:.3} m/s on the way; roll {:.1} and pitch {:.1} degrees at most",
            self.distance_m, self.mean_speed_m_s, self.roll_max_deg, self.pitch_max_deg
        )?;
        let height = |metres: f64| format!("; {:.1} mm off its height at most", metres * 1e3);
        f.write_str(&self.height_error_max_m.map_or_else(String::new, height))
    }
}

/// Arms, while they perform.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct ArmsReport {
    /// Largest distance that inverse kinematics left between a tip and its target.
    pub tip_residual_max_m: f64,
    /// The same for the end of a group.
    pub group_residual_max_m: f64,
    /// Largest angle between one link and the next, from the goals.
    pub bend_max_deg: f64,
    /// Smallest distance between the skins of two arms, or of an arm and the base, without their first groups, from
    /// the goals; `None` for a single arm whose base has no radius.
    pub clearance_min_m: Option<f64>,
}

impl fmt::Display for ArmsReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "arms: inverse kinematics left tips {:.1} mm and ends of groups {:.1} mm at most; bent by {:.0} degrees at \
             most",
            self.tip_residual_max_m * 1e3,
            self.group_residual_max_m * 1e3,
            self.bend_max_deg
        )?;
        let clearance =
            |metres: f64| format!("; {:.0} mm off each other and the base at least", metres * 1e3);
        f.write_str(&self.clearance_min_m.map_or_else(String::new, clearance))
    }
}

impl fmt::Display for FeetReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "feet: {:.1} mm from neutral at most; slip {:.4} mm planned, {:.1} mm measured; IK left {:.4} mm at most",
            self.excursion_max_m * 1e3,
            self.stance_slip_planned_max_m * 1e3,
            self.stance_slip_measured_max_m * 1e3,
            self.ik_residual_max_m * 1e3
        )
    }
}

/// One bus.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BusReport {
    /// Name of the bus.
    pub name: String,
    /// Exchanges begun.
    pub exchanges: u64,
    /// Bytes sent.
    pub bytes_out: u64,
    /// Bytes received.
    pub bytes_in: u64,
    /// Servo replies that did not arrive.
    pub missing: u64,
    /// Servo replies that were damaged.
    pub corrupt: u64,
    /// Servo replies with a good checksum that were dropped, since no servo can have measured their values.
    pub implausible: u64,
    /// Good replies from ids that were not asked: perhaps a second servo with a wrong id.
    pub unknown: u64,
    /// Share of the time the wire was busy.
    pub wire_share: f64,
    /// Duration of one exchange.
    pub exchange_us: Quantiles,
}

impl Report {
    /// The same report with its verdict and findings; `walked` is the walking of `robot` in this run.
    #[must_use]
    pub fn judged(self, robot: &Robot, walked: Option<WalkTotals>) -> Report {
        let findings = findings(&self, robot, walked);
        let verdict = findings.iter().map(|finding| finding.verdict).max().unwrap_or(Verdict::Good);
        Report { verdict, findings, ..self }
    }
}
