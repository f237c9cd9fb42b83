//! A recording as one page that plays it: no network, nothing to install.
//!
//! Comes in: a [`Recording`]. Goes out: the text of an HTML page, the data inside it thinned to about 50
//! frames a second. The page draws the robot by its own forward kinematics from the measured joint angles.

use serde::Serialize;

use crate::bus::ServoGoal;
use crate::model::{Chain, Robot};
use crate::recording::{Ending, Recording, Sample};
use crate::signals::ImuReading;
use crate::telemetry::Telemetry;

/// Frames a second, about.
const FRAME_HZ: f64 = 50.0;

/// The page, with a mark where the data go.
const PAGE: &str = include_str!("page.html");
const MARK: &str = "\"DATA\"";

/// What the page is given. Lengths in mm, angles in degrees, times in s.
#[derive(Debug, Serialize)]
struct Data<'a> {
    robot: &'a str,
    task: String,
    ended: String,
    chains: Vec<Limb<'a>>,
    trunk_low: [f64; 3],
    trunk_high: [f64; 3],
    activities: Vec<String>,
    /// One a frame, as are all arrays below.
    time: Vec<f64>,
    activity: Vec<usize>,
    trunk: Vec<[f64; 3]>,
    /// Unit quaternion, x y z w.
    turn: Vec<[f64; 4]>,
    /// Of each joint, in the order of the chains.
    measured: Vec<Vec<f64>>,
    goal: Vec<Vec<Option<f64>>>,
    /// What the inertial measurement unit said of the trunk, where that was acted on: roll and pitch. None on a robot that
    /// has none.
    attitude: Option<[Vec<Option<f64>>; 2]>,
    /// Of each chain: `s` standing, `a` in the air, `-` neither; one letter a frame.
    contact: Vec<String>,
}

#[derive(Debug, Serialize)]
struct Limb<'a> {
    name: &'a str,
    root: [f64; 3],
    /// Rotation to the body frame, a unit quaternion x, y, z, w.
    rotation: [f64; 4],
    joints: Vec<Hinge<'a>>,
}

#[derive(Debug, Serialize)]
struct Hinge<'a> {
    name: &'a str,
    axis: [f64; 3],
    link: [f64; 3],
    range: [f64; 2],
}

/// The page that plays `recording`.
pub fn page(recording: &Recording) -> String {
    // A number that is none becomes null; nothing else can fail.
    let json = serde_json::to_string(&data(recording)).unwrap_or_else(|_| "null".to_owned());
    // Inside a script element only '<' could end it.
    PAGE.replacen(MARK, &json.replace('<', "\\u003c"), 1)
}

fn data(recording: &Recording) -> Data<'_> {
    let robot = &recording.robot;
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "1 to 20: at most 1000 Hz")]
    let every = (robot.rate_hz / FRAME_HZ).round().max(1.0) as usize;
    let frames: Vec<&Sample> = recording.samples.iter().step_by(every).collect();
    let mut activities: Vec<String> = Vec::new();
    let activity = frames.iter().map(|sample| index_of(&mut activities, format!("{:?}", sample.activity)));
    let activity = activity.collect();
    let (low, high) = robot.root_extent();
    Data {
        robot: &robot.name,
        task: recording.header.words(),
        ended: ended(recording),
        chains: robot.chains.iter().map(|chain| limb(robot, chain)).collect(),
        trunk_low: (low * 1e3).to_array(),
        trunk_high: (high * 1e3).to_array(),
        activities,
        time: frames.iter().map(|sample| rounded(sample.times.began.as_secs_f64(), 1e3)).collect(),
        activity,
        trunk: frames
            .iter()
            .map(|sample| {
                (sample.trunk_in_world(robot).0 * 1e3).to_array().map(|coordinate| rounded(coordinate, 10.0))
            })
            .collect(),
        turn: frames
            .iter()
            .map(|sample| sample.trunk_in_world(robot).1.to_array().map(|part| rounded(part, 1e5)))
            .collect(),
        measured: (0..robot.joints.len())
            .map(|joint| {
                let angle = |sample: &&Sample| degrees(sample.state.joints[joint].position_rad);
                frames.iter().map(angle).collect()
            })
            .collect(),
        goal: (0..robot.joints.len()).map(|joint| goals(&frames, joint)).collect(),
        attitude: robot.imu.as_ref().map(|_| {
            let angles = |of: fn(&ImuReading) -> f64| {
                let angle = |sample: &&Sample| sample.state.body.is_known.then(|| degrees(of(&sample.imu)));
                frames.iter().map(angle).collect()
            };
            [angles(|imu| imu.roll_rad), angles(|imu| imu.pitch_rad)]
        }),
        contact: (0..robot.chains.len()).map(|chain| contact(&frames, chain)).collect(),
    }
}

/// How the run ended, and what the trunk did where that is known.
fn ended(recording: &Recording) -> String {
    let ended = match &recording.ending {
        Ending::Outcome(outcome) => {
            let entry = |key: &str| outcome.get(key).map_or("", String::as_str);
            format!("{}: {}", entry("outcome"), entry("reason"))
        }
        Ending::CutShort { .. } => "the recording was cut short".to_owned(),
    };
    let mut telemetry = Telemetry::new(&recording.robot);
    recording.samples.iter().for_each(|sample| telemetry.observe(&recording.robot, &sample.record()));
    let body = telemetry.body_report().filter(|_| recording.has_truth());
    body.map_or(ended.clone(), |body| format!("{ended}; {body}"))
}

fn limb<'a>(robot: &'a Robot, chain: &'a Chain) -> Limb<'a> {
    let joints = robot.joints_of(chain).iter().map(|joint| Hinge {
        name: &joint.name,
        axis: joint.axis.to_array(),
        link: (joint.link_m * 1e3).to_array(),
        range: [joint.range_rad.0.to_degrees(), joint.range_rad.1.to_degrees()],
    });
    Limb {
        name: &chain.name,
        root: (chain.root_m * 1e3).to_array(),
        rotation: chain.root_rotation.to_array(),
        joints: joints.collect(),
    }
}

fn goals(frames: &[&Sample], joint: usize) -> Vec<Option<f64>> {
    let goal = |sample: &&Sample| {
        (sample.goals[joint] != ServoGoal::Limp).then(|| degrees(sample.state.goal_rad[joint]))
    };
    frames.iter().map(goal).collect()
}

fn contact(frames: &[&Sample], chain: usize) -> String {
    let letter = |sample: &&Sample| match sample.targets.feet.iter().find(|foot| foot.chain == chain) {
        None => '-',
        Some(foot) if foot.is_swing => 'a',
        Some(_) => 's',
    };
    frames.iter().map(letter).collect()
}

fn index_of(names: &mut Vec<String>, name: String) -> usize {
    names.iter().position(|known| *known == name).unwrap_or_else(|| {
        names.push(name);
        names.len() - 1
    })
}

fn degrees(rad: f64) -> f64 {
    rounded(rad.to_degrees(), 100.0)
}

/// To this many parts of one: digits that cannot be seen only make the page large.
fn rounded(value: f64, parts: f64) -> f64 {
    (value * parts).round() / parts
}
