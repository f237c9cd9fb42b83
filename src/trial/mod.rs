//! Trials of falls: the same robot gets the same push with its reflex, without it, and as a limp heap.
//!
//! Input: a robot with a body and a reflex, and a seed. Output: the outcome of each trial ([`Tried`]), and
//! figures with intervals over all ([`Summary`]). Every trial runs the whole program on a virtual clock; the
//! same seed and number give the same trial on any number of processors.

pub mod campaign;
mod observe;
mod scene;
pub mod stats;
mod summary;

use std::num::NonZero;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};

use serde::Serialize;

use crate::bus::StartError;
use crate::kinds::{self, Falls};
use crate::model::{FallDirection, ReflexMode, Robot};
use crate::motion::Plan;
pub use observe::{Observed, Snapshot, observe};
pub use scene::{FRICTION, IMPULSE_NS_KG, PUSH_S, Scene};
pub use summary::Summary;

/// Reasons why trials are impossible.
#[derive(Debug, thiserror::Error)]
pub enum TrialError {
    /// The robot lacks what a trial needs.
    #[error("{0}")]
    Unfit(String),
    /// The simulated robot did not start.
    #[error(transparent)]
    Start(#[from] StartError),
    /// The robot could not be simulated.
    #[error(transparent)]
    Build(#[from] hw_sim::BuildError),
    /// The robot started, but never stood.
    #[error("the simulated robot never stood, in trial {0}: 'hippocamp run' shows why")]
    NeverStood(u64),
}

/// One trial: the outcome with the reflex off and, if a fall was certain or happened, the outcomes with the
/// reflex and with the passive drop. Until a fall is certain all three are the same.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Tried {
    /// The push and its circumstances.
    pub scene: Scene,
    /// With the reflex off.
    pub off: Observed,
    /// With the reflex.
    pub reflex: Option<Observed>,
    /// Limp from the moment the fall is certain.
    pub passive: Option<Observed>,
}

/// Trials of one robot.
#[derive(Debug)]
pub struct Trials {
    robot: Robot,
    plan: Plan,
    falls: Falls,
}

impl Trials {
    /// Trials of `robot`, as its file describes it.
    ///
    /// # Errors
    /// If it does not stand on legs, has no body or no reflex, or its legs do not reach the ground.
    pub fn new(robot: &Robot) -> Result<Trials, TrialError> {
        let unfit = |what: &str| TrialError::Unfit(format!("{}: {what}", robot.name));
        if robot.physics.is_none() {
            return Err(unfit("nothing falls without a body: its file needs a section [physics]"));
        }
        if robot.reflex.is_none() {
            return Err(unfit("its file does not mention falls: it needs a section [reflex]"));
        }
        let kind = kinds::of(robot).map_err(|error| unfit(&error.to_string()))?;
        let falls = kind.falls().ok_or_else(|| unfit("only robots on legs can fall"))?;
        Ok(Trials { robot: robot.clone(), plan: kind.plan_to_rest(robot), falls })
    }

    /// The robot that falls.
    pub fn robot(&self) -> &Robot {
        &self.robot
    }

    /// How its falls are tried out.
    pub fn falls(&self) -> &Falls {
        &self.falls
    }

    /// Mass of the robot, kg.
    pub fn mass_kg(&self) -> f64 {
        self.robot.mass_kg()
    }

    /// The trial with this number in the series of `seed`.
    pub fn scene(&self, seed: u64, number: u64) -> Scene {
        Scene::draw(&self.falls, self.mass_kg(), seed, number)
    }

    /// Runs `scene` with a robot in this mode, and records its poses at intervals if `is_tracked`.
    ///
    /// # Errors
    /// If the simulated robot does not start or stand.
    pub fn observe(&self, scene: &Scene, mode: ReflexMode, is_tracked: bool) -> Result<Observed, TrialError> {
        observe(&self.robot, &self.plan, scene, mode, is_tracked)
    }

    /// Runs one scene in every mode that makes a difference.
    ///
    /// # Errors
    /// The same as for [`Trials::observe`].
    pub fn try_scene(&self, scene: Scene) -> Result<Tried, TrialError> {
        let off = self.observe(&scene, ReflexMode::Off, false)?;
        let is_worth_it = off.predicted_s.is_some();
        let in_mode = |mode| is_worth_it.then(|| self.observe(&scene, mode, false)).transpose();
        let reflex = in_mode(ReflexMode::Reflex)?;
        Ok(Tried { reflex, passive: in_mode(ReflexMode::Passive)?, scene, off })
    }

    /// Runs the first `runs` trials of `seed` on all processors; calls `tell` after each with the number done.
    ///
    /// # Errors
    /// The first error that occurred.
    pub fn try_all(&self, runs: u64, seed: u64, tell: impl Fn(u64) + Sync) -> Result<Vec<Tried>, TrialError> {
        let (next, done) = (AtomicU64::new(0), AtomicU64::new(0));
        let results = Mutex::new(Vec::new());
        let work = || {
            loop {
                let number = next.fetch_add(1, Ordering::Relaxed);
                if number >= runs {
                    return;
                }
                let tried = self.try_scene(self.scene(seed, number));
                if tried.is_err() {
                    next.store(runs, Ordering::Relaxed);
                }
                if let Ok(mut results) = results.lock() {
                    results.push((number, tried));
                }
                tell(1 + done.fetch_add(1, Ordering::Relaxed));
            }
        };
        std::thread::scope(|scope| {
            let workers = std::thread::available_parallelism().map_or(1, NonZero::get);
            (0..workers).for_each(|_| drop(scope.spawn(work)));
        });
        let mut results = results.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner);
        results.sort_by_key(|(number, _)| *number);
        results.into_iter().map(|(_, tried)| tried).collect()
    }
}

impl Tried {
    /// Time from when the fall was certain until the trunk hit the ground, s; `None` if either did not happen.
    pub fn lead_s(&self) -> Option<f64> {
        Some(self.off.fallen_s? - self.off.predicted_s?)
    }

    /// True if the fall was predicted before the trunk hit the ground; `None` if there was no fall.
    pub fn is_predicted(&self) -> Option<bool> {
        self.off.fallen_s?;
        Some(self.lead_s().is_some_and(|lead_s| lead_s > 0.0))
    }

    /// True if a fall was predicted that never came.
    pub fn is_false_alarm(&self) -> bool {
        self.off.predicted_s.is_some() && self.off.fallen_s.is_none()
    }

    /// The predicted direction, if there was a fall, and whether it matches the push.
    pub fn direction(&self) -> Option<(FallDirection, bool)> {
        let direction = self.off.direction.filter(|_| self.off.fallen_s.is_some())?;
        Some((direction, self.scene.is_towards(direction)))
    }
}
