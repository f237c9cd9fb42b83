//! How reliably the inertial measurement unit was heard.

use std::fmt;

use serde::Serialize;

use crate::model::Robot;
use crate::observe::CycleRecord;

/// The inertial measurement unit over a run.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct ImuReport {
    /// True if it was heard at all.
    pub is_heard: bool,
    /// How often it was lost after it had been heard: silent, frozen, damaged or gone for longer than the robot
    /// file allows.
    pub losses: u64,
    /// How long the robot went without it after it had been heard, s.
    pub lost_s: f64,
    /// Greatest age of a measurement that was acted on, s.
    pub age_max_s: f64,
    /// Measurements with good checksums that were dropped, since no trunk can have moved so.
    pub implausible: u64,
}

impl fmt::Display for ImuReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if !self.is_heard {
            return f.write_str("imu: not heard; the robot went slower, without feedback");
        }
        write!(f, "imu: measurements were at most {:.1} ms old when used", self.age_max_s * 1e3)?;
        match self.losses {
            0 => Ok(()),
            1 => write!(f, "; lost once, for {:.1} s: the robot went slower, without feedback", self.lost_s),
            times => write!(
                f,
                "; lost {times} times, for {:.1} s: the robot went slower, without feedback",
                self.lost_s
            ),
        }
    }
}

/// Observes every cycle.
#[derive(Debug)]
pub(super) struct ImuObserver {
    report: ImuReport,
    was_known: bool,
}

impl ImuObserver {
    /// `None` for a robot without a unit.
    pub(super) fn new(robot: &Robot) -> Option<ImuObserver> {
        robot.imu.as_ref().map(|_| ImuObserver { report: ImuReport::default(), was_known: false })
    }

    pub(super) fn observe(&mut self, record: &CycleRecord<'_>) {
        let is_known = record.state.body.is_known;
        let report = &mut self.report;
        report.implausible = record.facts.imu.implausible;
        if is_known {
            report.is_heard = true;
            report.age_max_s = report.age_max_s.max(record.facts.imu.age_s);
        } else if report.is_heard {
            report.losses += u64::from(self.was_known);
            report.lost_s += record.facts.dt_s;
        }
        self.was_known = is_known;
    }

    pub(super) fn report(&self) -> ImuReport {
        self.report
    }
}
