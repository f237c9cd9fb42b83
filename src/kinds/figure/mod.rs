//! A human figure on two feet.

pub mod capability;
mod describe;
mod keys;

use super::{Falls, KeyDriver, Kind, MotionOptions, Picture, Refusal, Repertoire, TaskError, Words};
use crate::config::did_you_mean;
use crate::model::{FigureMotion, FigurePose, Robot};
use crate::motion::{Order, Plan};
use crate::random::RandomStream;
use crate::recording::Task;
use crate::signals::{Activity, Status};
pub use capability::{FigureCapability, PoseError};
pub use keys::PoseKeys;

/// Strengths of the pushes that are tried out, N s per kg of the figure's mass: it keeps its feet at the first, and
/// falls at the third.
pub const IMPULSES_NS_KG: [f64; 3] = [0.08, 0.25, 0.8];

/// A figure and its capability.
#[derive(Debug, Clone)]
pub struct Figure {
    /// Its settings.
    pub settings: FigureMotion,
    /// Its capability.
    pub capability: FigureCapability,
}

impl Figure {
    /// Computes the capability of `robot`, whose motion is that of `settings`.
    ///
    /// # Errors
    /// [`PoseError`] for the first pose it cannot take with its soles on the ground.
    pub fn of(robot: &Robot, settings: &FigureMotion) -> Result<Figure, PoseError> {
        Ok(Figure { settings: settings.clone(), capability: FigureCapability::of(robot, settings)? })
    }

    fn pose_called(&self, name: &str) -> Option<usize> {
        self.settings.poses.iter().position(|pose| pose.name == name)
    }

    fn pose_names(&self) -> Vec<String> {
        self.settings.poses.iter().map(|pose| pose.name.clone()).collect()
    }
}

impl Kind for Figure {
    fn name(&self) -> &'static str {
        "a figure"
    }

    fn order_to_rest(&self) -> Order {
        Order::Take(0)
    }

    fn motions(&self) -> Vec<MotionOptions<'_>> {
        let poses = self.settings.poses.iter();
        poses.map(|pose| MotionOptions { pose: Some(&pose.name), ..MotionOptions::default() }).collect()
    }

    fn plan_to_rest(&self, _robot: &Robot) -> Plan {
        self.capability.plan(0).into()
    }

    fn plan(&self, _robot: &Robot, asked: &MotionOptions<'_>) -> Result<(Plan, Option<String>), Refusal> {
        if asked.gait.is_some() || asked.speed_m_s.is_some() || asked.stroke.is_some() {
            let said =
                "--gait, --speed, --stroke: a figure takes poses, one of them by --pose, many by --script";
            return Err(Refusal(said.to_owned()));
        }
        let wanted = asked.pose.unwrap_or(FigurePose::STAND);
        let pose = self.pose_called(wanted).ok_or_else(|| {
            let names = self.pose_names();
            let advice = did_you_mean(wanted, names.iter().map(String::as_str));
            Refusal(format!("--pose {wanted}: expected one of {}{advice}", names.join(", ")))
        })?;
        Ok((self.capability.plan(pose).into(), None))
    }

    fn plan_of_task(&self, _robot: &Robot, task: &Task) -> Result<Plan, TaskError> {
        let Task::Figure { pose: name } = task else { return Err(TaskError::OtherKind) };
        let pose = self.pose_called(name).ok_or_else(|| TaskError::UnknownPose(name.clone()))?;
        Ok(self.capability.plan(pose).into())
    }

    fn keys(&self) -> Box<dyn KeyDriver> {
        Box::new(PoseKeys::new(&self.settings))
    }

    fn repertoire(&self) -> Result<Repertoire, Refusal> {
        Err(Refusal("--gamepad: a figure is driven by --keys or --script".to_owned()))
    }

    fn describe(&self, robot: &Robot) -> String {
        describe::poses_and_loads(self, robot)
    }

    fn words(&self) -> Box<dyn Words> {
        Box::new(FigureWords(self.pose_names()))
    }

    fn rest_name(&self, pose: Option<usize>) -> Option<&str> {
        let pose = pose.and_then(|pose| self.settings.poses.get(pose));
        Some(pose.map_or("", |pose| pose.name.as_str()))
    }

    fn pictures(&self) -> &'static [Picture] {
        &[Picture::Joints, Picture::Poses, Picture::Front]
    }

    fn falls(&self) -> Option<Falls> {
        Some(Falls::AllRound(&IMPULSES_NS_KG))
    }

    fn any_plan(&self, _robot: &Robot, chance: &mut RandomStream) -> Plan {
        self.capability.plan(chance.below(self.settings.poses.len())).into()
    }

    fn any_order(&self, _robot: &Robot, chance: &mut RandomStream) -> Order {
        Order::Take(chance.below(self.settings.poses.len()))
    }
}

/// Words of the status line for a figure: the names of its poses.
struct FigureWords(Vec<String>);

impl Words for FigureWords {
    fn doing(&self, status: &Status, order: Order) -> String {
        match (status.activity, order) {
            (Activity::Performing, Order::Take(pose)) => {
                format!("-> {}", self.0.get(pose).map_or("stand", String::as_str))
            }
            (Activity::Performing, _) => "moving".to_owned(),
            (_, Order::Take(pose)) => self.0.get(pose).cloned().unwrap_or_default(),
            _ => "standing".to_owned(),
        }
    }
}
