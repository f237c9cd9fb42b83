//! A recording as a single page that plays it: no network, nothing to install.
//!
//! Takes the cycles of a recording, one after the other, into a [`Page`]. Returns the text of an HTML page, whose
//! data are thinned to about 50 frames a second, or fewer for a long run. The page draws the robot from the
//! measured joint angles with its own forward kinematics.

use serde::Serialize;

use crate::bus::ServoGoal;
use crate::model::{Chain, Robot};
use crate::observe::Observer;
use crate::recording::{Ending, Recording, RunHeader, Sample};
use crate::telemetry::Telemetry;

/// Approximate maximum of frames a second.
const FRAME_HZ: f64 = 50.0;
/// Most joint angles on a page: 20 minutes of a horse. In a longer run the frames are further apart.
const ANGLES_MAX: usize = 1_000_000;
/// Fewest and most frames of a page, whatever the robot.
const FRAMES: (usize, usize) = (100, 65_536);

/// The page, with a mark in place of the data.
const TEMPLATE: &str = include_str!("page.html");
const MARK: &str = "\"DATA\"";

/// Data for the page. Lengths in mm, angles in degrees, times in s.
#[derive(Debug, Serialize)]
struct Data<'a> {
    robot: &'a str,
    task: String,
    ended: String,
    chains: Vec<Limb<'a>>,
    trunk_low: [f64; 3],
    trunk_high: [f64; 3],
    activities: &'a [String],
    /// One entry per frame, as in all arrays below.
    time: Vec<f64>,
    activity: Vec<usize>,
    trunk: Vec<[f64; 3]>,
    /// Unit quaternion, x y z w.
    turn: Vec<[f64; 4]>,
    /// Angles of each joint, in the order of the chains.
    measured: Vec<Vec<f64>>,
    goal: Vec<Vec<Option<f64>>>,
    /// Roll and pitch of the trunk from the inertial measurement unit, in frames where the robot acted on them.
    /// `None` on a robot without a unit.
    attitude: Option<[Vec<Option<f64>>; 2]>,
    /// Contact of each chain, one letter a frame: `s` standing, `a` in the air, `-` neither.
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

/// The page that plays a `recording` in memory.
pub fn page(recording: &Recording) -> String {
    let mut page = Page::new(&recording.robot);
    recording.samples.iter().for_each(|sample| page.look(sample));
    page.end(&recording.header, &recording.ending)
}

/// A page under construction.
pub struct Page<'r> {
    robot: &'r Robot,
    telemetry: Telemetry<'r>,
    has_truth: bool,
    /// Cycles so far, and the number of cycles from one frame to the next.
    cycles: u64,
    every: u64,
    frames_max: usize,
    activities: Vec<String>,
    frames: Vec<Frame>,
}

/// One frame: the part of a cycle that a page shows.
struct Frame {
    time: f64,
    activity: usize,
    trunk: [f64; 3],
    turn: [f64; 4],
    /// Measured angle and goal of each joint.
    joints: Vec<(f64, Option<f64>)>,
    attitude: Option<[f64; 2]>,
    /// Contact of each chain.
    contact: Vec<char>,
}

impl<'r> Page<'r> {
    /// An empty page for a run of `robot`.
    pub fn new(robot: &'r Robot) -> Page<'r> {
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "1 to 20: at most 1000 Hz"
        )]
        let every = (robot.rate_hz / FRAME_HZ).round().max(1.0) as u64;
        Page {
            robot,
            telemetry: Telemetry::new(robot),
            has_truth: false,
            cycles: 0,
            every,
            frames_max: (ANGLES_MAX / robot.joints.len().max(1)).clamp(FRAMES.0, FRAMES.1),
            activities: Vec::new(),
            frames: Vec::new(),
        }
    }

    /// Adds the next cycle.
    pub fn look(&mut self, sample: &Sample) {
        self.has_truth |= sample.facts.truth.is_some();
        self.telemetry.observe(&sample.record());
        if self.cycles.is_multiple_of(self.every) {
            if self.frames.len() >= self.frames_max {
                self.thin_out();
            }
            let activity = index_of(&mut self.activities, format!("{:?}", sample.facts.activity));
            self.frames.push(frame(self.robot, sample, activity));
        }
        self.cycles += 1;
    }

    /// Keeps every second frame.
    fn thin_out(&mut self) {
        let mut is_kept = false;
        self.frames.retain(|_| {
            is_kept = !is_kept;
            is_kept
        });
        self.every *= 2;
    }

    /// The complete page of a run with this `header` and this `ending`.
    pub fn end(self, header: &RunHeader, ending: &Ending) -> String {
        // A number that is not finite becomes null; nothing else can fail.
        let json = serde_json::to_string(&self.data(header, ending)).unwrap_or_else(|_| "null".to_owned());
        // Only '<' could end a script element.
        TEMPLATE.replacen(MARK, &json.replace('<', "\\u003c"), 1)
    }

    fn data(&self, header: &RunHeader, ending: &Ending) -> Data<'_> {
        let (robot, frames) = (self.robot, &self.frames);
        let (low, high) = robot.root_extent();
        let joints = 0..robot.joints.len();
        Data {
            robot: &robot.name,
            task: header.words(),
            ended: self.ended(ending),
            chains: robot.chains.iter().map(|chain| limb(robot, chain)).collect(),
            trunk_low: (low * 1e3).to_array(),
            trunk_high: (high * 1e3).to_array(),
            activities: &self.activities,
            time: frames.iter().map(|frame| frame.time).collect(),
            activity: frames.iter().map(|frame| frame.activity).collect(),
            trunk: frames.iter().map(|frame| frame.trunk).collect(),
            turn: frames.iter().map(|frame| frame.turn).collect(),
            measured: joints
                .clone()
                .map(|joint| frames.iter().map(|frame| frame.joints[joint].0).collect())
                .collect(),
            goal: joints.map(|joint| frames.iter().map(|frame| frame.joints[joint].1).collect()).collect(),
            attitude: robot.imu.as_ref().map(|_| {
                let angles = |of: usize| frames.iter().map(|frame| Some(frame.attitude?[of])).collect();
                [angles(0), angles(1)]
            }),
            contact: (0..robot.chains.len())
                .map(|chain| frames.iter().map(|frame| frame.contact[chain]).collect())
                .collect(),
        }
    }

    /// How the run ended, and the motion of the trunk if it is known.
    fn ended(&self, ending: &Ending) -> String {
        let ended = match ending {
            Ending::Outcome(outcome) => {
                let entry = |key: &str| outcome.get(key).map_or("", String::as_str);
                format!("{}: {}", entry("outcome"), entry("reason"))
            }
            Ending::CutShort { .. } => "the recording was cut short".to_owned(),
        };
        let body = self.telemetry.body_report().filter(|_| self.has_truth);
        body.map_or(ended.clone(), |body| format!("{ended}; {body}"))
    }
}

fn frame(robot: &Robot, sample: &Sample, activity: usize) -> Frame {
    let (place, turn) = sample.trunk_in_world(robot);
    let joint = |joint: usize| {
        let goal = sample.goals[joint] != ServoGoal::Limp;
        (
            degrees(sample.state.joints[joint].position_rad),
            goal.then(|| degrees(sample.state.goal_rad[joint])),
        )
    };
    let contact = |chain: usize| match sample.targets.feet().iter().find(|foot| foot.chain == chain) {
        None => '-',
        Some(foot) if foot.is_swing => 'a',
        Some(_) => 's',
    };
    Frame {
        time: rounded(sample.facts.times.began.as_secs_f64(), 1e3),
        activity,
        trunk: (place * 1e3).to_array().map(|coordinate| rounded(coordinate, 10.0)),
        turn: turn.to_array().map(|part| rounded(part, 1e5)),
        joints: (0..robot.joints.len()).map(joint).collect(),
        attitude: sample
            .state
            .body
            .is_known
            .then(|| [sample.facts.imu.roll_rad, sample.facts.imu.pitch_rad].map(degrees)),
        contact: (0..robot.chains.len()).map(contact).collect(),
    }
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

fn index_of(names: &mut Vec<String>, name: String) -> usize {
    names.iter().position(|known| *known == name).unwrap_or_else(|| {
        names.push(name);
        names.len() - 1
    })
}

fn degrees(rad: f64) -> f64 {
    rounded(rad.to_degrees(), 100.0)
}

/// Rounds to 1/`parts`: digits that cannot be seen only make the page large.
fn rounded(value: f64, parts: f64) -> f64 {
    (value * parts).round() / parts
}

#[cfg(test)]
mod tests {
    use std::path::Path;
    use std::time::Duration;

    use super::*;
    use crate::units::Time;

    #[test]
    fn the_longer_a_run_the_further_apart_are_the_frames_of_its_page() {
        let robot = crate::config::load(Path::new("config/figure.toml")).unwrap().robot;
        let period = Duration::from_secs_f64(robot.period_s());
        let mut page = Page { frames_max: 10, ..Page::new(&robot) };
        let first = page.every;
        let mut sample = Sample::new(&robot);
        for cycle in 0..20 * first + 1 {
            sample.facts.times.began = Time(0) + period * u32::try_from(cycle).unwrap();
            page.look(&sample);
        }
        // Every second frame was removed twice, before the eleventh and before the twentieth.
        let times: Vec<f64> = page.frames.iter().map(|frame| frame.time).collect();
        let apart_s = 4.0 * robot.period_s() * f64::from(u32::try_from(first).unwrap());
        let expected: Vec<f64> = (0..6).map(|frame| rounded(f64::from(frame) * apart_s, 1e3)).collect();
        assert_eq!(times, expected);
    }
}
