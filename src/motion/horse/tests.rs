//! Walks from standing to standing, looked at through the tips they ask for.

use glam::DVec3;
use proptest::prelude::*;

use super::{HorsePlan, Walk};
use crate::model::{Gait, HorseMotion};
use crate::signals::{Aim, Targets};

const DT_S: f64 = 0.002;
const HEIGHT_M: f64 = 0.19;

fn plan(gait: Gait, speed_m_s: f64) -> HorsePlan {
    HorsePlan {
        settings: HorseMotion {
            legs: [0, 1, 2, 3],
            stand_height_m: HEIGHT_M,
            sit_height_m: 0.17,
            swing_time_s: 0.45,
            swing_lift_m: 0.013,
            swing_ramp_share: 0.2,
            acceleration_m_s2: 0.5,
            gaits: vec![],
        },
        neutral_in_body: [
            DVec3::new(-0.11, 0.06, -HEIGHT_M),
            DVec3::new(0.09, 0.06, -HEIGHT_M),
            DVec3::new(-0.11, -0.06, -HEIGHT_M),
            DVec3::new(0.09, -0.06, -HEIGHT_M),
        ],
        half_excursion_m: 0.089,
        sit_pose_rad: vec![],
        gait,
        speed_m_s,
    }
}

fn gaits() -> Vec<Gait> {
    Gait::built_in()
}

struct Walked {
    /// Lift-offs: (time, leg).
    lift_offs: Vec<(f64, usize)>,
    /// World places of the feet at the end, less the trunk's.
    at_end: [DVec3; 4],
    speed_at_stop: f64,
}

/// Walks, asks to stop at `stop_s`, and checks every instant on the way.
fn walk(plan: &HorsePlan, stop_s: f64) -> Walked {
    let mut walk = Walk::begin(plan, 0.0, Walk::find_start_ramp_s(plan));
    let mut targets = Targets {
        aim: Aim::Tips,
        pose_rad: vec![],
        tips_in_body: vec![DVec3::ZERO; 4],
        torque_share: 1.0,
        trunk_in_world: DVec3::ZERO,
        feet: Vec::new(),
        posture_pull: 0.0,
    };
    let (mut lift_offs, mut landed): (Vec<(f64, usize)>, [Option<DVec3>; 4]) = (Vec::new(), [None; 4]);
    let (mut places, mut velocities) = ([None::<DVec3>; 4], [None::<DVec3>; 4]);
    let mut was_swing = [false; 4];
    let mut bounds = [[0.0; 2]; 4];
    let (mut step, mut is_stopping, mut speed_at_stop) = (0_u32, false, 0.0);
    loop {
        let s = f64::from(step) * DT_S;
        if s >= stop_s && !is_stopping {
            speed_at_stop = walk.speed_m_s(s);
            is_stopping = walk.try_stop(plan, s, false);
        }
        walk.advance(s);
        walk.write(plan, s, HEIGHT_M, &mut targets);
        for (leg, foot) in targets.feet.iter().enumerate() {
            let place = targets.tips_in_body[leg] + targets.trunk_in_world;
            let from_neutral = targets.tips_in_body[leg].x - plan.neutral_in_body[leg].x;
            assert!(
                from_neutral.abs() <= plan.half_excursion_m * (1.0 + 1e-9),
                "{leg} at {from_neutral} m, {s} s"
            );
            assert!(place.z >= -1e-12 && place.z <= 0.013 + 1e-12);
            if foot.is_swing {
                if !was_swing[leg] {
                    lift_offs.push((s, leg));
                }
                landed[leg] = None;
            } else {
                let start = *landed[leg].get_or_insert(place);
                assert!(
                    place.distance(start) <= 1e-12,
                    "leg {leg} slips {} m at {s} s",
                    place.distance(start)
                );
            }
            was_swing[leg] = foot.is_swing;
            let velocity = places[leg].map(|before| (place - before) / DT_S);
            if let (Some(now), Some(before)) = (velocity, velocities[leg]) {
                let bound = foot.swing_acceleration_m_s2.max(bounds[leg][0]).max(bounds[leg][1]);
                assert!(now.distance(before) <= bound * DT_S + 1e-9, "leg {leg} jumps at {s} s");
            }
            bounds[leg] = [foot.swing_acceleration_m_s2, bounds[leg][0]];
            places[leg] = Some(place);
            velocities[leg] = velocity;
        }
        if is_stopping && walk.is_standing(s) {
            let at_end = std::array::from_fn(|leg| targets.tips_in_body[leg]);
            return Walked { lift_offs, at_end, speed_at_stop };
        }
        assert!(s < stop_s + 20.0, "never came to a stand");
        step += 1;
    }
}

#[test]
fn every_gait_starts_walks_and_stops_inside_its_reach_without_slip_or_jump() {
    for gait in gaits() {
        let mut plan = plan(gait, 0.0);
        plan.speed_m_s = plan.top_speed_by_reach_m_s();
        let walked = walk(&plan, 20.0);
        assert!((walked.speed_at_stop - plan.speed_m_s).abs() < 1e-9, "{} reached its speed", plan.gait.name);
        for (leg, end) in walked.at_end.iter().enumerate() {
            assert!(
                end.distance(plan.neutral_in_body[leg]) < 1e-8,
                "{} leg {leg} ends off neutral",
                plan.gait.name
            );
        }
    }
}

#[test]
fn feet_lift_by_the_gaits_lags() {
    for gait in gaits() {
        let mut plan = plan(gait, 0.0);
        plan.speed_m_s = 0.5 * plan.top_speed_by_reach_m_s();
        let period_s = plan.gait.period_s(0.45);
        let walked = walk(&plan, 20.0);
        for leg in 0..4 {
            let times: Vec<f64> =
                walked.lift_offs.iter().filter(|lift| lift.1 == leg).map(|lift| lift.0).collect();
            for (stride, time) in times.iter().take(8).enumerate() {
                let expected = (stride as f64 + plan.gait.lags[leg]) * period_s;
                // Seen in the first step after it happened.
                assert!(
                    *time >= expected - 1e-9 && *time <= expected + 2.0 * DT_S,
                    "{} {leg}",
                    plan.gait.name
                );
            }
            assert!(times.len() >= 8);
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn a_stop_at_any_moment_keeps_every_foot_in_reach(
        gait in 0..gaits().len(), share in 0.05..1.0, stop_s in 0.0..6.0,
    ) {
        let mut plan = plan(gaits()[gait].clone(), 0.0);
        plan.speed_m_s = share * plan.top_speed_by_reach_m_s();
        let walked = walk(&plan, stop_s);
        for (leg, end) in walked.at_end.iter().enumerate() {
            prop_assert!(end.distance(plan.neutral_in_body[leg]) < 1e-8);
        }
    }
}
