//! Arms that move like those of an octopus.

pub mod capability;
mod describe;
mod keys;
mod options;
mod random_orders;
mod show;
mod tempo;

use super::{Falls, KeyDriver, Kind, MotionOptions, Picture, Refusal, Repertoire, TaskError, Words};
use crate::model::{Robot, TentacleMotion};
use crate::motion::tentacle::strokes::STROKES;
use crate::motion::{Order, Plan, StrokeCommand};
use crate::operator::Script;
use crate::random::RandomStream;
use crate::recording::Task;
use crate::signals::{Activity, Status};
pub use capability::TentacleCapability;
pub use keys::StrokeKeys;
pub use show::Show;

/// A robot with arms and its capability.
#[derive(Debug, Clone)]
pub struct Tentacle {
    /// Its settings.
    pub settings: TentacleMotion,
    /// Its capability.
    pub capability: TentacleCapability,
}

impl Tentacle {
    /// Computes the capability of `robot`, whose motion is that of `settings`.
    pub fn of(robot: &Robot, settings: &TentacleMotion) -> Tentacle {
        Tentacle { settings: settings.clone(), capability: TentacleCapability::of(robot, settings) }
    }

    /// A remark on a tempo that is too fast for its stroke, if it is.
    fn too_fast(&self, command: &StrokeCommand) -> Option<String> {
        let StrokeCommand { tempo, stroke, .. } = command;
        let mut tempos = STROKES.iter().zip(&self.capability.tempo_max);
        let (stroke, most) = tempos.find(|(known, _)| known.name == stroke.name)?;
        (tempo > most).then(|| format!("tempo {tempo} is too fast for {}: held at {most:.2}", stroke.name))
    }

    fn plan_to(&self, robot: &Robot, command: StrokeCommand) -> Plan {
        self.capability.plan(robot, &self.settings, command).into()
    }
}

impl Kind for Tentacle {
    fn name(&self) -> &'static str {
        "a robot with arms"
    }

    fn order_to_rest(&self) -> Order {
        Order::Perform(StrokeCommand::default())
    }

    fn plan_to_rest(&self, robot: &Robot) -> Plan {
        self.plan_to(robot, StrokeCommand::default())
    }

    fn plan(&self, robot: &Robot, asked: &MotionOptions<'_>) -> Result<(Plan, Option<String>), Refusal> {
        let command = options::command(&self.settings, asked)?.unwrap_or_default();
        Ok((self.plan_to(robot, command), self.too_fast(&command)))
    }

    fn motions(&self) -> Vec<MotionOptions<'_>> {
        let known = STROKES.iter().filter(|kind| kind.in_file(&self.settings).is_some());
        known.map(|kind| MotionOptions { stroke: Some(kind.name), ..MotionOptions::default() }).collect()
    }

    fn plan_of_task(&self, robot: &Robot, task: &Task) -> Result<Plan, TaskError> {
        let Task::Tentacle { strokes } = task else { return Err(TaskError::OtherKind) };
        Ok(self.plan_to(robot, strokes.try_into().map_err(TaskError::Strokes)?))
    }

    fn show(&self, _robot: &Robot, for_s: f64) -> Result<Script, Refusal> {
        Ok(Show::of_all_strokes(&self.settings, for_s))
    }

    fn shows_by_itself(&self) -> bool {
        true
    }

    fn check_script(&self, script: &Script, file_name: &str) -> Result<Vec<String>, Refusal> {
        let mut remarks = Vec::new();
        for entry in &script.entries {
            let Order::Perform(command) = entry.order else { continue };
            remarks
                .extend(self.too_fast(&command).map(|words| format!("{file_name}:{}: {words}", entry.line)));
        }
        Ok(remarks)
    }

    fn keys(&self) -> Box<dyn KeyDriver> {
        Box::new(StrokeKeys::new(&self.settings))
    }

    fn repertoire(&self) -> Result<Repertoire, Refusal> {
        Err(Refusal("--gamepad: arms are driven by --keys or --script".to_owned()))
    }

    fn faults(&self, robot: &Robot) -> Vec<(String, String)> {
        describe::too_heavy(self, robot).into_iter().collect()
    }

    fn describe(&self, robot: &Robot) -> String {
        describe::arms_and_strokes(self, robot)
    }

    fn words(&self) -> Box<dyn Words> {
        Box::new(TentacleWords)
    }

    fn rest_name(&self, _pose: Option<usize>) -> Option<&str> {
        Some("rest")
    }

    fn pictures(&self) -> &'static [Picture] {
        &[Picture::Joints, Picture::Poses]
    }

    fn falls(&self) -> Option<Falls> {
        None
    }

    fn any_plan(&self, robot: &Robot, chance: &mut RandomStream) -> Plan {
        self.plan_to(robot, random_orders::command(chance, &self.settings))
    }

    fn any_order(&self, _robot: &Robot, chance: &mut RandomStream) -> Order {
        Order::Perform(random_orders::command(chance, &self.settings))
    }
}

/// Words of the status line for arms.
struct TentacleWords;

impl Words for TentacleWords {
    fn doing(&self, status: &Status, order: Order) -> String {
        match (status.activity, order) {
            (Activity::Performing, _) => status.stroke.unwrap_or("moving").to_owned(),
            (_, Order::Perform(_)) => "at rest".to_owned(),
            _ => "standing".to_owned(),
        }
    }
}
