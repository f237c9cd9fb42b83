//! An undisturbed walk on a virtual clock: the commands that a run over pseudo-terminals sends its servos, cycle by
//! cycle, as long as it too is undisturbed.

use hippocamp::ik::Method;
use hippocamp::model::Robot;
use hippocamp::motion::{Activity, Order};
use hippocamp::plan::RunPlan;
use hippocamp::run::run;

use super::built::world;
use super::frames::{Frame, frames};
use super::{SharedPorts, plan};

/// Length of the walk that is recorded, s.
const WALK_S: f64 = 5.0;

/// Most exchanges that may be lost in a row; more count as a hold.
const LOST_MAX: usize = 12;

pub(crate) struct Reference {
    /// The commands on bus 0 in each cycle.
    pub(crate) frames: Vec<Frame>,
    /// The activity of the robot in each cycle.
    activities: Vec<Activity>,
}

impl Reference {
    /// The reference for `hippocamp run` without further options.
    pub(crate) fn of(robot: &Robot) -> Reference {
        let mut world = world(robot);
        world.keep_requests();
        let ports = SharedPorts::new(world);
        let horse = plan(robot, "walk", 0.9);
        let plan =
            RunPlan { motion: horse.into(), method: Method::CcdThenFinish, move_for_s: 1e9, driver: None };
        let mut activities = Vec::new();
        let mut left = WALK_S * robot.rate_hz;
        run(robot, plan, ports.clone(), |status| {
            // The activity of the cycle before.
            activities.push(status.activity);
            left -= f64::from(u8::from(status.activity == Activity::Walking));
            if left > 0.0 { Order::Go } else { Order::StopAtOnce }
        })
        .unwrap();
        activities.remove(0);
        activities.truncate(activities.iter().rposition(|activity| *activity == Activity::Walking).unwrap());
        let mut frames = frames(robot, ports.borrow().world(), 0);
        frames.truncate(activities.len());
        Reference { frames, activities }
    }

    /// The first cycle of `activity`.
    pub(crate) fn first(&self, activity: Activity) -> usize {
        self.activities.iter().position(|of| *of == activity).unwrap()
    }

    /// Time when the first of `frames` after `from_ns` with goals other than those of the undisturbed walk had
    /// crossed, ns. A hold, in which goals stay the same, does not count, nor does a lost exchange.
    pub(crate) fn left_at_ns(&self, frames: &[Frame], from_ns: u64) -> Option<u64> {
        let count = self.frames.iter().map(|frame| frame.goals.len()).max();
        // Ignore exchanges of which a part was lost.
        let is_whole = |frame: &&Frame| Some(frame.goals.len()) == count;
        let undisturbed: Vec<&Frame> = self.frames.iter().filter(is_whole).collect();
        let (before, after): (Vec<&Frame>, Vec<&Frame>) =
            frames.iter().filter(is_whole).partition(|frame| frame.at_ns < from_ns);
        let same = |frame: &Frame| undisturbed.iter().position(|of| of.goals == frame.goals);
        let mut place = before.into_iter().rev().find_map(same).unwrap();
        for frame in after {
            let ahead = undisturbed[place..].iter().take(LOST_MAX);
            match ahead.map(|of| &of.goals).position(|goals| *goals == frame.goals) {
                Some(steps) => place += steps,
                None => return Some(frame.at_ns),
            }
        }
        None
    }
}
