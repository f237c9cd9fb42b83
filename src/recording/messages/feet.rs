//! `/feet`: target and measured place of each tip.

use std::borrow::Cow;

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::super::sample::Sample;
use super::{Stamp, Vector3};
use crate::model::{Chain, Robot};
use crate::signals::FootTarget;

/// `hippocamp.Feet`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Feet<'a> {
    /// Time of the message.
    pub timestamp: Stamp,
    /// The tip of each chain.
    pub feet: Vec<Foot<'a>>,
}

/// One chain's tip.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Foot<'a> {
    /// Name of the chain.
    pub chain: Cow<'a, str>,
    /// Target of inverse kinematics; left out if the generator asked for joint angles, or for nothing.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub target_in_body: Option<Vector3>,
    /// The same target in the world; left out while nothing walks.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub target_in_world: Option<Vector3>,
    /// Position from the measured joints; left out until all joints of the chain have been heard.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub measured_in_body: Option<Vector3>,
    /// The same in the world, with the trunk at its planned place; left out while nothing walks.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub measured_in_world: Option<Vector3>,
    /// Residual of inverse kinematics, m; left out if it is infinite.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub residual_m: Option<f64>,
    /// The walker's plan for the foot; left out while nothing walks.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub plan: Option<FootPlan>,
}

/// A foot's plan: see [`crate::signals::FootTarget`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct FootPlan {
    /// Planned position in the world.
    pub in_world: Vector3,
    /// Distance ahead of the neutral foot point.
    pub excursion_m: f64,
    /// Distance that the plane of its leg has covered since the walk began.
    #[serde(rename = "plane_way_m")]
    pub plane_distance_m: f64,
    /// True in swing.
    pub is_swing: bool,
    /// Largest acceleration of the swing.
    pub swing_acceleration_m_s2: f64,
}

impl<'a> Feet<'a> {
    /// The message of `sample` at `timestamp`.
    pub(in crate::recording) fn of(robot: &'a Robot, sample: &Sample, timestamp: Stamp) -> Feet<'a> {
        let targets = &sample.targets;
        let in_world = |place: DVec3| targets.trunk_in_world + targets.trunk_orientation * place;
        let is_placed = !targets.feet().is_empty();
        let foot = |(index, chain): (usize, &'a Chain)| {
            let target = targets.tip_in_body(index);
            let joints = &sample.state.joints[chain.joints.clone()];
            let measured = joints
                .iter()
                .all(|joint| joint.is_known)
                .then(|| robot.tip_in_body(chain, joints.iter().map(|joint| joint.position_rad)));
            let in_world = |place: Option<DVec3>| finite(place.filter(|_| is_placed).map(in_world));
            let residual_m = sample.joints.residual_m[index];
            Foot {
                chain: chain.name.as_str().into(),
                target_in_body: finite(target),
                target_in_world: in_world(target),
                measured_in_body: finite(measured),
                measured_in_world: in_world(measured),
                residual_m: residual_m.is_finite().then_some(residual_m),
                plan: sample.targets.feet().iter().find(|foot| foot.chain == index).map(|foot| FootPlan {
                    in_world: foot.in_world.into(),
                    excursion_m: foot.excursion_m,
                    plane_distance_m: foot.plane_distance_m,
                    is_swing: foot.is_swing,
                    swing_acceleration_m_s2: foot.swing_acceleration_m_s2,
                }),
            }
        };
        Feet { timestamp, feet: robot.chains.iter().enumerate().map(foot).collect() }
    }

    /// Puts what the message holds into `sample`.
    pub(in crate::recording) fn read_into(&self, robot: &Robot, sample: &mut Sample) -> Result<(), String> {
        for foot in &self.feet {
            let index = robot
                .chains
                .iter()
                .position(|chain| chain.name == foot.chain)
                .ok_or_else(|| format!("the robot has no chain {}", foot.chain))?;
            sample.joints.residual_m[index] = foot.residual_m.unwrap_or(f64::INFINITY);
            if let Some(target) = foot.target_in_body {
                sample.targets.recorded_mut().1.tips_in_body[index] = target.into();
            }
            if let Some(plan) = foot.plan {
                sample.targets.recorded_mut().1.feet.push(FootTarget {
                    chain: index,
                    in_world: plan.in_world.into(),
                    excursion_m: plan.excursion_m,
                    plane_distance_m: plan.plane_distance_m,
                    is_swing: plan.is_swing,
                    load_share: f64::from(u8::from(!plan.is_swing)),
                    swing_acceleration_m_s2: plan.swing_acceleration_m_s2,
                });
            }
        }
        Ok(())
    }
}

/// JSON has no infinity.
fn finite(place: Option<DVec3>) -> Option<Vector3> {
    place.filter(|place| place.is_finite()).map(Vector3::from)
}
