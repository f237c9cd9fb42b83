//! Feet: how far they move, and whether they slip or jump; as planned, and as measured.

use glam::{DQuat, DVec3, EulerRot};

use super::report::FeetReport;
use crate::model::Robot;
use crate::observe::CycleRecord;

/// One foot over the last cycles. Positions are in the plane in which its leg works: distance along the ground,
/// sideways out of the plane, and height, m.
#[derive(Debug, Clone, Copy, Default)]
struct Seen {
    place: Option<DVec3>,
    velocity: Option<DVec3>,
    /// Acceleration bounds of the last two cycles, newest first, m/s^2.
    swing_accelerations: [f64; 2],
    /// Start of the present stance, planned and measured.
    stance: Option<Stance>,
}

/// Position of a foot when its stance began.
#[derive(Debug, Clone, Copy)]
struct Stance {
    planned: DVec3,
    measured: DVec3,
    /// Position on the ground, m.
    in_world: DVec3,
}

#[derive(Debug)]
pub(super) struct FootObserver {
    seen: Vec<Seen>,
    report: FeetReport,
    /// True if feedback moves tips off their planned positions.
    has_feedback: bool,
}

impl FootObserver {
    pub(super) fn new(robot: &Robot) -> FootObserver {
        FootObserver {
            seen: vec![Seen::default(); robot.chains.len()],
            report: FeetReport::default(),
            has_feedback: robot.balance.is_some() && robot.bears_weight,
        }
    }

    pub(super) fn report(&self) -> FeetReport {
        self.report
    }

    pub(super) fn note_gap(&mut self) {
        self.seen.fill(Seen::default());
    }

    pub(super) fn observe(&mut self, robot: &Robot, record: &CycleRecord<'_>) {
        if record.targets.feet().is_empty() || record.facts.is_held {
            self.note_gap();
            return;
        }
        let targets = record.targets;
        let (heading_rad, pitch_rad, roll_rad) = targets.trunk_orientation.to_euler(EulerRot::ZYX);
        let heading = DQuat::from_rotation_z(heading_rad);
        let tilt = DQuat::from_euler(EulerRot::ZYX, 0.0, pitch_rad, roll_rad);
        let height = DVec3::Z * targets.trunk_in_world.z;
        for foot in targets.feet() {
            // The input of inverse kinematics counts, not what the plan reports; feedback is not part of the plan.
            let planned = targets.trunk_orientation.inverse() * (foot.in_world - targets.trunk_in_world);
            let tip =
                if self.has_feedback { planned } else { targets.tip_in_body(foot.chain).unwrap_or(planned) };
            let way = DVec3::X * foot.plane_distance_m + height;
            let place = tilt * tip + way;
            let in_world = targets.trunk_in_world + targets.trunk_orientation * tip;
            // A turning plane takes its foot sideways with it; along the plane the foot must not slip.
            let place_along = place.with_y(0.0);
            let seen = &mut self.seen[foot.chain];
            self.report.excursion_max_m = self.report.excursion_max_m.max(foot.excursion_m.abs());

            let velocity = seen.place.map(|before| (place_along - before) / record.facts.dt_s);
            if let (Some(velocity), Some(before)) = (velocity, seen.velocity) {
                // The two velocities span three positions; the outer ones may be on the ground.
                let [a, b] = seen.swing_accelerations;
                let allowed = foot.swing_acceleration_m_s2.max(a).max(b) * record.facts.dt_s;
                let jump = velocity.distance(before) - allowed;
                // A difference of positions carries their rounding over one cycle.
                let rounding = 8.0 * f64::EPSILON * (1e3 + foot.plane_distance_m.abs()) / record.facts.dt_s;
                self.report.swing_velocity_jump_max_m_s =
                    self.report.swing_velocity_jump_max_m_s.max(if jump > rounding { jump } else { 0.0 });
            }
            if foot.is_swing {
                seen.stance = None;
            } else {
                let chain = &robot.chains[foot.chain];
                let measured = (tilt * measured_tip(robot, chain, record) + way).with_z(0.0);
                match seen.stance {
                    None => seen.stance = Some(Stance { planned: place_along, measured, in_world }),
                    Some(start) => {
                        let across = heading * DVec3::Y;
                        let report = &mut self.report;
                        report.stance_slip_planned_max_m =
                            report.stance_slip_planned_max_m.max(place_along.distance(start.planned));
                        report.stance_slip_measured_max_m =
                            report.stance_slip_measured_max_m.max(measured.distance(start.measured));
                        report.lateral_slip_max_m =
                            report.lateral_slip_max_m.max((in_world - start.in_world).dot(across).abs());
                    }
                }
            }
            seen.swing_accelerations = [foot.swing_acceleration_m_s2, seen.swing_accelerations[0]];
            seen.velocity = velocity;
            seen.place = Some(place_along);
        }
    }
}

fn measured_tip(robot: &Robot, chain: &crate::model::Chain, record: &CycleRecord<'_>) -> DVec3 {
    robot.tip_in_body(chain, record.state.joints[chain.joints.clone()].iter().map(|joint| joint.position_rad))
}
