//! The trunk while the robot is on its feet: whether it falls, how far it goes, how it tilts, and whether it keeps
//! its planned height.

use glam::{DQuat, DVec3, EulerRot};

use super::report::BodyReport;
use super::way::{WalkTotals, Ways};
use crate::model::Robot;
use crate::motion::Activity;
use crate::observe::CycleRecord;
use crate::signals::Aim;

/// State of the trunk in one cycle.
struct Seen {
    roll_rad: f64,
    pitch_rad: f64,
    /// Distance forward since the cycle before, m.
    forward_m: f64,
    height_m: Option<f64>,
    is_fallen: bool,
}

#[derive(Debug)]
pub(super) struct BodyObserver {
    /// Distance of the sole below the tip, m.
    sole_m: f64,
    has_stood: bool,
    /// True once any source has reported the trunk's motion.
    is_known: bool,
    /// True position in the cycle before.
    last_m: Option<DVec3>,
    walked_m: f64,
    walked_s: f64,
    ways: Ways,
    /// True if it lay fallen when it was last to be on its feet.
    lies_fallen: bool,
    report: BodyReport,
}

impl BodyObserver {
    pub(super) fn new(robot: &Robot) -> BodyObserver {
        let soles = robot.chains.iter().filter_map(|chain| chain.foot);
        BodyObserver {
            sole_m: soles.map(|foot| foot.below_tip_m()).fold(0.0, f64::max),
            has_stood: false,
            is_known: false,
            last_m: None,
            walked_m: 0.0,
            walked_s: 0.0,
            ways: Ways::default(),
            lies_fallen: false,
            report: BodyReport::default(),
        }
    }

    /// `None` while no source has reported the trunk's motion.
    pub(super) fn report(&self) -> Option<BodyReport> {
        let mean_speed_m_s = if self.walked_s > 0.0 { self.walked_m / self.walked_s } else { 0.0 };
        self.is_known.then_some(BodyReport { mean_speed_m_s, ..self.report })
    }

    /// Its walking; `None` if it did not walk, or if nothing told what the trunk did.
    pub(super) fn walked(&self) -> Option<WalkTotals> {
        self.ways.report().filter(|_| self.is_known)
    }

    /// Whether it lay fallen when it was last to be on its feet.
    pub(super) fn lies_fallen(&self) -> bool {
        self.lies_fallen
    }

    pub(super) fn note_gap(&mut self) {
        self.last_m = None;
        self.ways.pause();
    }

    pub(super) fn observe(&mut self, record: &CycleRecord<'_>) {
        let seen = self.look(record);
        self.last_m = record.facts.truth.map(|truth| truth.position_m);
        let Some(seen) = seen else { return self.ways.pause() };
        self.is_known = true;
        self.has_stood |= matches!(record.facts.activity, Activity::Standing | Activity::Walking);
        // A robot that reacts to a fall goes down, ideally on its knees and hands.
        let is_falling = matches!(record.facts.activity, Activity::Falling | Activity::Lying);
        let is_on_feet = matches!(record.targets.aim(), Aim::Tips | Aim::Soles);
        let report = &mut self.report;
        report.fell |= self.has_stood && (is_falling || is_on_feet && seen.is_fallen);
        if !self.has_stood || !is_on_feet {
            return self.ways.pause();
        }
        self.lies_fallen = seen.is_fallen;
        report.distance_m += seen.forward_m;
        if record.facts.activity == Activity::Walking && !record.facts.is_held {
            self.ways.observe(record);
        } else {
            self.ways.pause();
        }
        if record.facts.activity == Activity::Walking {
            self.walked_m += seen.forward_m;
            self.walked_s += record.facts.dt_s;
        }
        report.roll_max_deg = report.roll_max_deg.max(seen.roll_rad.to_degrees().abs());
        report.pitch_max_deg = report.pitch_max_deg.max(seen.pitch_rad.to_degrees().abs());
        if let Some(height_m) = seen.height_m {
            let error_m = (height_m - record.targets.trunk_in_world.z - self.sole_m).abs();
            report.height_error_max_m = Some(report.height_error_max_m.unwrap_or(0.0).max(error_m));
        }
    }

    fn look(&self, record: &CycleRecord<'_>) -> Option<Seen> {
        if let Some(truth) = &record.facts.truth {
            let (yaw, pitch_rad, roll_rad) = truth.orientation.to_euler(EulerRot::ZYX);
            let ahead = DQuat::from_rotation_z(yaw) * DVec3::X;
            let way = self.last_m.map_or(DVec3::ZERO, |last_m| truth.position_m - last_m);
            return Some(Seen {
                roll_rad,
                pitch_rad,
                forward_m: way.dot(ahead),
                height_m: Some(truth.height_m),
                is_fallen: truth.is_fallen,
            });
        }
        let body = &record.state.body;
        body.is_known.then(|| Seen {
            roll_rad: body.roll_rad,
            pitch_rad: body.pitch_rad,
            forward_m: body.velocity_m_s.x * record.facts.dt_s,
            height_m: None,
            is_fallen: body.tilt_rad() > FALLEN_RAD,
        })
    }
}

/// A trunk further from upright has fallen, rad: 60 degrees.
const FALLEN_RAD: f64 = std::f64::consts::FRAC_PI_3;
