//! Plays one episode: the whole program on a virtual clock, with the judge watching its servos.

use std::cell::RefCell;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::time::Duration;

use super::draw::{Episode, PATIENCE_S};
use super::judge::{Ended, Finding, Judge, Violation};
use super::subject::{Subject, any_pose_rad};
use crate::bus::{PortError, Ports, SimPorts};
use crate::ik::Method;
use crate::model::Robot;
use crate::motion::Order;
use crate::plan::RunPlan;
use crate::run::{Operator, run_observed};
use crate::signals::Status;
use crate::signals::TrueBody;
use crate::simulation;
use crate::telemetry::Outcome;
use crate::trial::TrialError;
use crate::units::Time;

/// Time for which the servos are watched after a run, s, and number of checks: longer than any servo's restart.
const AFTER_S: f64 = 2.5;
const AFTER_STEPS: u32 = 25;

/// Time for which bytes are collected before the program sees them: the delay of a high-speed USB adapter.
const HANDOVER: Duration = Duration::from_micros(125);

/// Outcome of an episode.
#[derive(Debug, Clone, PartialEq)]
pub struct Played {
    /// The faults found.
    pub findings: Vec<Finding>,
    /// Virtual time of the run, s, without the time after it.
    pub virtual_s: f64,
    /// The run's outcome; `None` if it never began.
    pub outcome: Option<Outcome>,
    /// The reason, in words.
    pub reason: String,
}

/// The simulated robot and its judge.
struct Scene {
    ports: SimPorts,
    judge: Judge,
    is_given_up: bool,
    /// The run ends once this kind of fault is found.
    wanted: Option<Violation>,
}

/// Ports that let the judge check the world at the beginning of each cycle.
struct Watched<'s>(&'s RefCell<Scene>);

impl Ports for Watched<'_> {
    fn now(&mut self) -> Time {
        self.0.borrow_mut().ports.now()
    }

    fn discard_input(&mut self, bus: usize) -> Result<(), PortError> {
        self.0.borrow_mut().ports.discard_input(bus)
    }

    fn send(&mut self, bus: usize, bytes: &[u8]) -> Result<(), PortError> {
        self.0.borrow_mut().ports.send(bus, bytes)
    }

    fn receive(&mut self, bus: usize, into: &mut [u8]) -> Result<usize, PortError> {
        self.0.borrow_mut().ports.receive(bus, into)
    }

    fn receive_imu(&mut self, into: &mut [u8]) -> Result<usize, PortError> {
        self.0.borrow_mut().ports.receive_imu(into)
    }

    fn wait_for_input(&mut self, deadline: Time) {
        let ports = &mut self.0.borrow_mut().ports;
        ports.wait_for_input(deadline);
        // An adapter hands over several bytes at a time; checking at each byte would take most of the time.
        let until = (ports.now() + HANDOVER).min(deadline);
        ports.world_mut().advance_to(until.0);
    }

    fn wait_until(&mut self, deadline: Time) {
        let scene = &mut *self.0.borrow_mut();
        scene.ports.wait_until(deadline);
        scene.judge.look(scene.ports.world());
    }

    fn true_body(&self) -> Option<TrueBody> {
        self.0.borrow().ports.true_body()
    }
}

/// An operator that gives the episode's orders, and gives up a run that does not end.
struct Driver<'s> {
    scene: &'s RefCell<Scene>,
    episode: &'s Episode,
}

/// Payload with which a run that is given up unwinds: nothing else ends a loop that does not end.
struct GivenUp;

impl Operator for Driver<'_> {
    fn order(&mut self, status: &Status) -> Order {
        let scene = &mut *self.scene.borrow_mut();
        let is_enough = scene.wanted.is_some_and(|wanted| scene.judge.has(wanted));
        if scene.judge.note(status) || is_enough {
            scene.is_given_up = true;
            // Prints nothing, unlike a panic.
            resume_unwind(Box::new(GivenUp));
        }
        self.episode.order_at(status.time_s)
    }
}

/// Plays an episode of `subject`, and judges it.
///
/// # Errors
/// If the robot cannot be simulated.
pub fn play(subject: &Subject, episode: &Episode) -> Result<Played, TrialError> {
    play_until(subject, episode, None)
}

/// The same; the run ends once the `wanted` fault is found.
pub(super) fn play_until(
    subject: &Subject,
    episode: &Episode,
    wanted: Option<Violation>,
) -> Result<Played, TrialError> {
    let robot = episode.robot(subject);
    let (scene, ended) = run(&robot, episode, wanted)?;
    Ok(judge_after(&robot, episode, scene, ended))
}

fn run(robot: &Robot, episode: &Episode, wanted: Option<Violation>) -> Result<(Scene, Ended), TrialError> {
    let seed = episode.world_seed;
    let pose_rad = match episode.sits {
        true => episode.plan.resting_pose_rad().to_vec(),
        false => any_pose_rad(robot, seed),
    };
    let world = simulation::world_from_pose(robot, &pose_rad, seed, &episode.script())?;
    let ports = SimPorts::on_virtual_clock(world);
    let judge = Judge::new(robot, episode.end_s + PATIENCE_S);
    let scene = RefCell::new(Scene { ports, judge, is_given_up: false, wanted });
    let plan = RunPlan {
        motion: episode.plan.clone(),
        method: Method::CcdThenFinish,
        move_for_s: episode.move_for_s,
        driver: None,
    };
    let operator = Driver { scene: &scene, episode };
    let run = || run_observed(robot, &plan, Watched(&scene), &mut [], operator);
    let ended = match catch_unwind(AssertUnwindSafe(run)) {
        Ok(Ok(report)) => Ended::Reported(Box::new(report)),
        Ok(Err(error)) => Ended::NotStarted(error),
        Err(panic) => Ended::Panicked(words_of(&*panic)),
    };
    let scene = scene.into_inner();
    let ended = if scene.is_given_up { Ended::GivenUp } else { ended };
    Ok((scene, ended))
}

/// The report of an episode's run; `None` if it did not begin.
#[cfg(test)]
pub(super) fn report_of(subject: &Subject, episode: &Episode) -> Option<crate::telemetry::Report> {
    match run(&episode.robot(subject), episode, None).ok()?.1 {
        Ended::Reported(report) => Some(*report),
        _ => None,
    }
}

/// Watches for a while after the run: no servo may move again.
fn judge_after(robot: &Robot, episode: &Episode, scene: Scene, ended: Ended) -> Played {
    let Scene { mut ports, mut judge, is_given_up, .. } = scene;
    judge.look(ports.world());
    let virtual_s = ports.now().as_secs_f64();
    judge.judge_end(robot, episode, &ended);
    if !is_given_up {
        for _ in 0..AFTER_STEPS {
            let until = ports.now() + Duration::from_secs_f64(AFTER_S / f64::from(AFTER_STEPS));
            ports.wait_until(until);
            judge.look(ports.world());
        }
    }
    let (outcome, reason) = match ended {
        Ended::Reported(report) => (Some(report.outcome), report.reason),
        Ended::NotStarted(error) => (None, error.to_string()),
        Ended::Panicked(said) => (Some(Outcome::Failed), said),
        Ended::GivenUp => (Some(Outcome::Failed), "given up: it did not end".to_owned()),
    };
    Played { findings: judge.findings().to_vec(), virtual_s, outcome, reason }
}

fn words_of(panic: &(dyn std::any::Any + Send)) -> String {
    let said = panic.downcast_ref::<&str>().map(|said| (*said).to_owned());
    let said = said.or_else(|| panic.downcast_ref::<String>().cloned());
    format!("a panic outside of the loop: {}", said.unwrap_or_else(|| "it said nothing".to_owned()))
}
