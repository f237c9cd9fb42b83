//! The kinds of robots, a folder each: what a robot of that kind can do, how a person orders it about, and the words
//! for what it does.
//!
//! The part of a kind that runs in the loop, its plan and generator, is in the folder of the same name in
//! [`crate::motion`]. Commands, trials, pictures and the replay use the trait [`Kind`]. They name a kind only where it alone has the thing: a
//! gamepad drives horses, a show is of arms, `plot --thesis` is of gaits, and a trial looks at a figure's head.

pub mod figure;
pub mod horse;
pub mod loads;
pub mod tentacle;

use std::fmt;

use crate::model::{Motion, Robot};
use crate::motion::{GaitChoice, Order, Plan};
use crate::operator::{Instruction, Key, Script};
use crate::random::RandomStream;
use crate::recording::Task;
use crate::signals::Status;
use figure::{Figure, PoseError};
use horse::{Horse, ReachError, Repertoire};
use tentacle::Tentacle;

/// Largest request at random, as a multiple of what the robot can do.
const TOO_MUCH: f64 = 1.2;

/// The kind of `robot`, with what it can do.
///
/// # Errors
/// If it cannot do what its file says.
pub fn of(robot: &Robot) -> Result<Box<dyn Kind>, CapabilityError> {
    Ok(match &robot.motion {
        Motion::Horse(horse) => Box::new(Horse::of(robot, horse)?),
        Motion::Tentacle(tentacle) => Box::new(Tentacle::of(robot, tentacle)),
        Motion::Figure(figure) => Box::new(Figure::of(robot, figure)?),
    })
}

/// One kind of robot: its settings from the robot file, and what it can do. The robot is an argument where its
/// joints or chains matter.
pub trait Kind: fmt::Debug + Send + Sync {
    /// Name of the kind, with its article: "a horse".
    fn name(&self) -> &'static str;

    /// The order at which it stands, or its arms rest.
    fn order_to_rest(&self) -> Order;

    /// The plan to stand, or to rest.
    fn plan_to_rest(&self, robot: &Robot) -> Plan;

    /// The plan to do what the user asked for, and a remark if that is less than what was asked.
    ///
    /// # Errors
    /// If the robot has no such gait, stroke or pose, or cannot do it.
    fn plan(&self, robot: &Robot, asked: &MotionOptions<'_>) -> Result<(Plan, Option<String>), Refusal>;

    /// The plan of a recorded task.
    ///
    /// # Errors
    /// If the task is that of another kind, or names a gait or pose that the robot does not have.
    fn plan_of_task(&self, robot: &Robot, task: &Task) -> Result<Plan, TaskError>;

    /// A script of everything it can show, on repeat, for `for_s`: it plays if the user asks for no single motion.
    ///
    /// # Errors
    /// If this kind gives no shows.
    fn show(&self, robot: &Robot, _for_s: f64) -> Result<Script, Refusal> {
        Err(Refusal(format!("show: expected arms; {} is {}: use run --script", robot.name, self.name())))
    }

    /// True if it performs a show where the user names neither a motion nor a driver.
    fn shows_by_itself(&self) -> bool {
        false
    }

    /// Remarks on the parts of a script that the robot's limits will hold back, each with its line.
    ///
    /// # Errors
    /// If the script asks for what the robot cannot do at all; the message has the line, too.
    fn check_script(&self, _script: &Script, _file_name: &str) -> Result<Vec<String>, Refusal> {
        Ok(Vec::new())
    }

    /// The keys that drive it.
    fn keys(&self) -> Box<dyn KeyDriver>;

    /// The gaits, speeds and turns that a gamepad can ask of it.
    ///
    /// # Errors
    /// If a gamepad does not drive this kind.
    fn repertoire(&self) -> Result<Repertoire, Refusal>;

    /// Faults of the robot beyond those of its file's syntax: the key at fault, and what was expected.
    fn faults(&self, _robot: &Robot) -> Vec<(String, String)> {
        Vec::new()
    }

    /// The capability of the robot for people, as lines of tables.
    fn describe(&self, robot: &Robot) -> String;

    /// The words of the status line.
    fn words(&self) -> Box<dyn Words>;

    /// Names of its gaits, in the order of the robot file; empty for a kind without.
    fn gait_names(&self) -> Vec<String> {
        Vec::new()
    }

    /// A request for each motion that it has by name.
    fn motions(&self) -> Vec<MotionOptions<'_>>;

    /// Name of what it does while it performs no stroke and goes in no gait, in this pose (index in the robot file);
    /// `None` for a kind that goes by gaits, whose names say it.
    fn rest_name(&self, _pose: Option<usize>) -> Option<&str> {
        None
    }

    /// Fore-and-aft range of each foot that walks, with the trunk level; empty for a kind without.
    fn foot_ranges(&self) -> Vec<FootRange> {
        Vec::new()
    }

    /// The pictures that show its motion.
    fn pictures(&self) -> &'static [Picture];

    /// How its falls are tried out; `None` if it cannot fall.
    fn falls(&self) -> Option<Falls>;

    /// Any plan of this kind, at random; some ask for more than the robot can do.
    fn any_plan(&self, robot: &Robot, chance: &mut RandomStream) -> Plan;

    /// Any order, at random; some ask for more than the robot can do.
    fn any_order(&self, robot: &Robot, chance: &mut RandomStream) -> Order;
}

/// The wishes of a user, from options; each kind takes some of them.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct MotionOptions<'a> {
    /// Name of a gait.
    pub gait: Option<&'a str>,
    /// Speed, m/s, negative to go backwards.
    pub speed_m_s: Option<f64>,
    /// Name of a stroke.
    pub stroke: Option<&'a str>,
    /// Tempo of strokes, as a multiple of the robot file's.
    pub tempo: Option<f64>,
    /// Name of a pose.
    pub pose: Option<&'a str>,
}

impl MotionOptions<'_> {
    /// True if one motion was asked for.
    pub fn is_some(&self) -> bool {
        self.gait.is_some() || self.speed_m_s.is_some() || self.stroke.is_some() || self.pose.is_some()
    }
}

/// Drives by keys in a terminal.
pub trait KeyDriver: Send {
    /// Descriptions of the keys for people, a line each.
    fn help(&self) -> Vec<String>;

    /// Carries out `key`; returns a message for the person who pressed it, if any.
    fn press(&mut self, key: Key) -> Option<&'static str>;

    /// The present instruction.
    fn instruction(&self) -> Instruction;
}

/// Words for what a robot does.
pub trait Words: Send {
    /// Words for a robot that stands, walks or performs, and for the order it follows.
    fn doing(&self, status: &Status, order: Order) -> String;
}

/// A picture of a motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Picture {
    /// The feet's excursions over time.
    Feet,
    /// Which feet stand, over time.
    Footfalls,
    /// The joints' angles over time.
    Joints,
    /// The robot from the side, at several moments.
    Poses,
    /// The same from the front.
    Front,
}

/// Fore-and-aft range of a chain's foot when the trunk is level.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FootRange {
    /// Index into [`Robot::chains`].
    pub chain: usize,
    /// Neutral foot point, forward of the body frame's origin, m.
    pub neutral_m: f64,
    /// Largest distance from that point, m.
    pub half_excursion_m: f64,
}

/// How the falls of a kind are tried out.
#[derive(Debug, Clone, PartialEq)]
pub enum Falls {
    /// By pushes at random while it stands or goes in one of these gaits.
    AtRandom(Vec<GaitChoice>),
    /// By pushes from all sides in turn while it stands, at each of these strengths, N s per kg of its mass.
    AllRound(&'static [f64]),
}

/// The reason why the user's wish is not carried out, for people.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct Refusal(pub String);

/// Reasons why a recorded task cannot be planned again.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum TaskError {
    /// The task is that of another kind of robot.
    #[error("it is not that of its robot.toml: they are of different kinds of motion")]
    OtherKind,
    /// The robot has no such gait.
    #[error("a gait that its robot.toml does not have, {0}")]
    UnknownGait(String),
    /// The strokes are not complete.
    #[error("{0}")]
    Strokes(&'static str),
    /// The robot has no such pose.
    #[error("a pose of an unknown name, {0}")]
    UnknownPose(String),
}

/// Reasons why a robot cannot do what its file says.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CapabilityError {
    /// A fault of a horse's legs.
    #[error(transparent)]
    Reach(#[from] ReachError),
    /// A fault of a figure's poses.
    #[error(transparent)]
    Pose(#[from] PoseError),
}

impl CapabilityError {
    /// The key of the robot file at fault, and what was expected there.
    pub fn fault(&self) -> (String, String) {
        match self {
            CapabilityError::Reach(error) => error.fault(),
            CapabilityError::Pose(error) => error.fault(),
        }
    }
}
