//! A horse: four legs that walk by gaits.

pub mod capability;
mod cruise;
mod describe;
mod follower;
mod gamepad;
mod keys;
pub mod load;
mod options;
mod postures;
mod random_orders;
pub mod reach;
mod repertoire;
mod script;
pub mod top_speed;
mod words;

use super::{Falls, FootRange, KeyDriver, Kind, MotionOptions, Picture, Refusal, TaskError, Words};
use crate::model::{HorseMotion, Robot};
use crate::motion::horse::HorsePlan;
use crate::motion::{Command, GaitChoice, Order, Plan};
use crate::operator::Script;
use crate::random::RandomStream;
use crate::recording::{Task, gait_is_of};
pub use capability::HorseCapability;
pub use gamepad::{Axis, Button, Gamepad, PadEvent};
pub use keys::Keys;
pub use reach::{Reach, ReachError};
pub use repertoire::{GaitOffer, Repertoire};
pub use top_speed::TopSpeed;

/// Gaits whose falls are tried out, where the robot can do them.
const TRIED_GAITS: [&str; 3] = ["stand", "walk-steady", "trot"];

/// A horse and its capability.
#[derive(Debug, Clone)]
pub struct Horse {
    /// Its settings.
    pub settings: HorseMotion,
    /// Its capability.
    pub capability: HorseCapability,
}

impl Horse {
    /// Computes the capability of `robot`, whose motion is that of `settings`.
    ///
    /// # Errors
    /// If a leg cannot stand or sit as the file says.
    pub fn of(robot: &Robot, settings: &HorseMotion) -> Result<Horse, ReachError> {
        Ok(Horse { settings: settings.clone(), capability: HorseCapability::of(robot, settings)? })
    }

    /// The plan to carry out `command`.
    fn plan_to(&self, command: Command) -> HorsePlan {
        self.capability.plan(&self.settings, command)
    }

    /// The plan to stand.
    fn standing(&self) -> HorsePlan {
        self.plan_to(Command::default())
    }
}

impl Kind for Horse {
    fn name(&self) -> &'static str {
        "a horse"
    }

    fn order_to_rest(&self) -> Order {
        Order::Drive(Command::default())
    }

    fn plan_to_rest(&self, _robot: &Robot) -> Plan {
        self.standing().into()
    }

    fn plan(&self, robot: &Robot, asked: &MotionOptions<'_>) -> Result<(Plan, Option<String>), Refusal> {
        let (plan, remark) = options::plan(self, robot, asked)?;
        Ok((plan.into(), remark))
    }

    fn plan_of_task(&self, robot: &Robot, task: &Task) -> Result<Plan, TaskError> {
        let Task::Horse { command, gait } = task else { return Err(TaskError::OtherKind) };
        if !gait_is_of(command.gait, robot) {
            return Err(TaskError::UnknownGait(gait.clone()));
        }
        Ok(self.plan_to(*command).into())
    }

    fn check_script(&self, script: &Script, file_name: &str) -> Result<Vec<String>, Refusal> {
        script::check(script, file_name, &Repertoire::of(&self.standing()))
    }

    fn keys(&self) -> Box<dyn KeyDriver> {
        Box::new(Keys::new(Repertoire::of(&self.standing())))
    }

    fn repertoire(&self) -> Result<Repertoire, Refusal> {
        Ok(Repertoire::of(&self.standing()))
    }

    fn describe(&self, robot: &Robot) -> String {
        describe::legs_and_gaits(self, robot)
    }

    fn words(&self) -> Box<dyn Words> {
        Box::new(words::HorseWords::new(self.gait_names()))
    }

    fn motions(&self) -> Vec<MotionOptions<'_>> {
        let gaits = self.settings.gaits.iter();
        gaits.map(|gait| MotionOptions { gait: Some(&gait.name), ..MotionOptions::default() }).collect()
    }

    fn gait_names(&self) -> Vec<String> {
        self.settings.gaits.iter().map(|gait| gait.name.clone()).collect()
    }

    fn foot_ranges(&self) -> Vec<FootRange> {
        let range = |(chain, reach): (&usize, &Reach)| FootRange {
            chain: *chain,
            neutral_m: reach.neutral_in_body.x,
            half_excursion_m: self.capability.half_excursion_m(),
        };
        self.settings.legs.iter().zip(&self.capability.reaches).map(range).collect()
    }

    fn pictures(&self) -> &'static [Picture] {
        &[Picture::Feet, Picture::Footfalls, Picture::Joints, Picture::Poses]
    }

    fn falls(&self) -> Option<Falls> {
        let plan = self.standing();
        let gaits = TRIED_GAITS.iter().filter_map(|name| plan.gait_choice(name));
        let doable = |choice: &GaitChoice| *choice == GaitChoice::Stand || plan.top_speed_m_s(*choice) > 0.0;
        Some(Falls::AtRandom(gaits.filter(doable).collect()))
    }

    fn any_plan(&self, _robot: &Robot, chance: &mut RandomStream) -> Plan {
        let plan = self.standing();
        let command = random_orders::command(chance, &plan);
        HorsePlan { command, ..plan }.into()
    }

    fn any_order(&self, _robot: &Robot, chance: &mut RandomStream) -> Order {
        Order::Drive(random_orders::command(chance, &self.standing()))
    }
}
