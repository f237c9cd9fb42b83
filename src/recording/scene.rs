//! The robot as Foxglove's scene primitives: links as lines, feet as spheres, the ground as a slab.

use glam::{DQuat, DVec3};
use serde::Serialize;

use super::messages::{FrameTransform, FrameTransforms, Pose, Stamp, Vector3};
use super::sample::Sample;
use crate::model::Robot;

/// Names of the frames in the recording.
pub(super) const WORLD: &str = "world";
pub(super) const BODY: &str = "body";

/// Sizes as shares of the longest limb.
const LINK_SHARE: f64 = 0.05;
const FOOT_SHARE: f64 = 0.09;
const GROUND_SHARE: f64 = 20.0;
const GROUND_DEPTH_SHARE: f64 = 0.02;

/// `foxglove.SceneUpdate`.
#[derive(Debug, Serialize)]
pub(super) struct SceneUpdate {
    deletions: [(); 0],
    entities: [Entity; 2],
}

#[derive(Debug, Serialize)]
struct Entity {
    timestamp: Stamp,
    frame_id: &'static str,
    id: &'static str,
    /// Zero means: until it is replaced.
    lifetime: Stamp,
    frame_locked: bool,
    metadata: [(); 0],
    arrows: [(); 0],
    cubes: Vec<Solid>,
    spheres: Vec<Solid>,
    cylinders: [(); 0],
    lines: Vec<Line>,
    triangles: [(); 0],
    texts: [(); 0],
    models: [(); 0],
}

#[derive(Debug, Serialize)]
struct Solid {
    pose: Pose,
    size: Vector3,
    color: Color,
}

#[derive(Debug, Serialize)]
struct Line {
    #[serde(rename = "type")]
    kind: u8,
    pose: Pose,
    thickness: f64,
    scale_invariant: bool,
    points: Vec<Vector3>,
    color: Color,
    colors: [Color; 0],
    indices: [u32; 0],
}

#[derive(Debug, Clone, Copy, Serialize)]
struct Color {
    r: f64,
    g: f64,
    b: f64,
    a: f64,
}

const LINK: Color = Color { r: 0.25, g: 0.35, b: 0.55, a: 1.0 };
const TRUNK: Color = Color { r: 0.55, g: 0.4, b: 0.25, a: 0.8 };
const STANCE: Color = Color { r: 0.2, g: 0.6, b: 0.3, a: 1.0 };
const SWING: Color = Color { r: 0.95, g: 0.6, b: 0.1, a: 1.0 };
const TARGET: Color = Color { r: 0.8, g: 0.1, b: 0.5, a: 0.5 };
const GROUND: Color = Color { r: 0.8, g: 0.8, b: 0.78, a: 1.0 };
/// Foxglove's number for a strip of lines.
const LINE_STRIP: u8 = 0;

pub(super) fn transforms(trunk_in_world: DVec3, turn: DQuat, timestamp: Stamp) -> FrameTransforms<'static> {
    let pose = Pose::turned(trunk_in_world, turn);
    FrameTransforms {
        transforms: vec![FrameTransform {
            timestamp,
            parent_frame_id: WORLD.into(),
            child_frame_id: BODY.into(),
            translation: pose.position,
            rotation: pose.orientation,
        }],
    }
}

pub(super) fn scene(robot: &Robot, sample: &Sample, timestamp: Stamp) -> SceneUpdate {
    let size_m = robot.chains.iter().map(|chain| chain.length_m(robot.joints_of(chain))).fold(0.0, f64::max);
    let limbs = sample.limbs_in_body(robot);
    let sphere = |place: DVec3, share: f64, color| Solid {
        pose: Pose::at(place),
        size: DVec3::splat(share * size_m).into(),
        color,
    };
    let mut spheres: Vec<Solid> = limbs
        .iter()
        .enumerate()
        .filter_map(|(chain, places)| {
            let is_swing = sample.targets.feet().iter().any(|foot| foot.chain == chain && foot.is_swing);
            Some(sphere(*places.last()?, FOOT_SHARE, if is_swing { SWING } else { STANCE }))
        })
        .collect();
    spheres.extend(
        sample
            .targets
            .feet()
            .iter()
            .filter_map(|foot| sample.targets.tip_in_body(foot.chain))
            .map(|tip| sphere(tip, 0.6 * FOOT_SHARE, TARGET)),
    );
    let lines = limbs
        .iter()
        .map(|places| Line {
            kind: LINE_STRIP,
            pose: Pose::at(DVec3::ZERO),
            thickness: LINK_SHARE * size_m,
            scale_invariant: false,
            points: places.iter().map(|place| (*place).into()).collect(),
            color: LINK,
            colors: [],
            indices: [],
        })
        .collect();
    let robot_entity = entity(BODY, "robot", timestamp, vec![trunk_box(robot, size_m)], spheres, lines);
    let slab = Solid {
        pose: Pose::at(DVec3::new(0.0, 0.0, -0.5 * GROUND_DEPTH_SHARE * size_m)),
        size: DVec3::new(GROUND_SHARE * size_m, GROUND_SHARE * size_m, GROUND_DEPTH_SHARE * size_m).into(),
        color: GROUND,
    };
    let ground = entity(WORLD, "ground", timestamp, vec![slab], vec![], vec![]);
    SceneUpdate { deletions: [], entities: [robot_entity, ground] }
}

/// The box around the roots of the limbs, at least as thick as a link.
fn trunk_box(robot: &Robot, size_m: f64) -> Solid {
    let (low, high) = robot.root_extent();
    Solid {
        pose: Pose::at(0.5 * (low + high)),
        size: (high - low).max(DVec3::splat(LINK_SHARE * size_m)).into(),
        color: TRUNK,
    }
}

fn entity(
    frame_id: &'static str,
    id: &'static str,
    timestamp: Stamp,
    cubes: Vec<Solid>,
    spheres: Vec<Solid>,
    lines: Vec<Line>,
) -> Entity {
    Entity {
        timestamp,
        frame_id,
        id,
        lifetime: Stamp::default(),
        frame_locked: true,
        metadata: [],
        arrows: [],
        cubes,
        spheres,
        cylinders: [],
        lines,
        triangles: [],
        texts: [],
        models: [],
    }
}
