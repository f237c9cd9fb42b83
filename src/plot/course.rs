//! What a robot is to do over time, on joints that are always where they are told to be.

use glam::{DQuat, DVec3};

use crate::capability::{HorseCapability, Reach};
use crate::cycle::Controller;
use crate::ik::Method;
use crate::model::{HorseMotion, Motion, Robot};
use crate::motion::horse::Drive;
use crate::motion::{Activity, Command, Generator, Order, StrokeCommand};
use crate::signals::FootTarget;
use crate::telemetry::CycleRecord;

/// A robot that does not stand after so long never will, s.
const RISING_MAX_S: f64 = 120.0;

/// A robot, and what a picture says of it.
#[derive(Debug, Clone)]
pub struct Subject<'r> {
    /// The robot.
    pub robot: &'r Robot,
    /// Names of its gaits, by index.
    pub gait_names: Vec<String>,
    /// Where each foot may be; empty if that is not known.
    pub ranges: Vec<FootRange>,
}

/// What a robot does, from some time after it stood on.
#[derive(Debug, Clone)]
pub struct Course<'r> {
    /// The robot.
    pub subject: Subject<'r>,
    /// One a cycle; at least one.
    pub frames: Vec<Frame>,
}

/// Where the foot of a chain may be, fore and aft, when the trunk is level.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FootRange {
    /// Index into [`Robot::chains`].
    pub chain: usize,
    /// Neutral foot point, ahead of the body frame's origin, m.
    pub neutral_m: f64,
    /// How far from it, m.
    pub half_excursion_m: f64,
}

/// One cycle.
#[derive(Debug, Clone)]
pub struct Frame {
    /// Since the robot stood, s.
    pub time_s: f64,
    /// What was ordered.
    pub order: Order,
    /// The gait it goes, index into [`Subject::gait_names`]; none while it takes no steps.
    pub gait: Option<usize>,
    /// Name of the stroke its arms do; none for a horse, and at rest.
    pub stroke: Option<&'static str>,
    /// The pose a figure is in or on the way to, index into [`crate::model::FigureMotion::poses`].
    pub pose: Option<usize>,
    /// True on the way from one gait to another.
    pub is_changing: bool,
    /// Speed of the trunk, m/s.
    pub speed_m_s: f64,
    /// Place of the trunk over the ground, m.
    pub trunk_in_world: DVec3,
    /// Turn of the trunk, from the body frame to the world frame.
    pub trunk_turn: DQuat,
    /// Where the feet are planned to be.
    pub feet: Vec<FootTarget>,
    /// Where each joint is told to be, after safety, rad.
    pub goal_rad: Vec<f64>,
    /// Joints that were told something else than the motion asked for.
    pub interventions: u32,
}

/// A time in which a robot goes on in the same way.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Span {
    /// From, s.
    pub from_s: f64,
    /// To, s.
    pub to_s: f64,
    /// The gait, as in [`Frame::gait`].
    pub gait: Option<usize>,
    /// As in [`Frame::is_changing`].
    pub is_changing: bool,
}

/// A change from one gait to another.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Change {
    /// When it was ordered, s.
    pub ordered_s: f64,
    /// When the robot goes the new gait at a steady speed, or another order comes, s.
    pub settled_s: f64,
    /// The gaits before and after, indices into [`Subject::gait_names`].
    pub gaits: [usize; 2],
    /// The speeds before and after, m/s.
    pub speeds_m_s: [f64; 2],
}

/// There is nothing to draw.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum CourseError {
    /// It never came to its feet.
    #[error("the robot never stood: its motion ended before")]
    NeverStood,
    /// There is no cycle in the span asked for.
    #[error("nothing to show: the motion ended {ended_s} s after the robot stood")]
    NothingToShow {
        /// When it ended, s.
        ended_s: f64,
    },
}

impl<'r> Subject<'r> {
    /// A horse: `robot`, whose motion is `horse` and which can do what `capability` says.
    pub fn horse(robot: &'r Robot, horse: &HorseMotion, capability: &HorseCapability) -> Subject<'r> {
        let range = |(chain, reach): (&usize, &Reach)| FootRange {
            chain: *chain,
            neutral_m: reach.neutral_in_body.x,
            half_excursion_m: capability.half_excursion_m(),
        };
        Subject {
            robot,
            gait_names: horse.gaits.iter().map(|gait| gait.name.clone()).collect(),
            ranges: horse.legs.iter().zip(&capability.reaches).map(range).collect(),
        }
    }
}

impl<'r> Subject<'r> {
    /// A rig without gaits: arms, a figure.
    pub fn without_gaits(robot: &'r Robot) -> Subject<'r> {
        Subject { robot, gait_names: Vec::new(), ranges: Vec::new() }
    }
}

impl<'r> Course<'r> {
    /// What the robot does, moved by `generator`, when ordered so, in the times of `span_s` (from and to, s since it
    /// stood). `orders` is asked once a cycle with the time since then, in s. Ends early at an order to stop.
    ///
    /// # Errors
    /// When the robot does not get up, and when there is not one cycle in that span.
    pub fn follow(
        subject: Subject<'r>,
        generator: Generator,
        span_s: (f64, f64),
        mut orders: impl FnMut(f64) -> Order,
    ) -> Result<Course<'r>, CourseError> {
        let dt_s = subject.robot.period_s();
        let mut controller = Controller::with_generator(subject.robot, generator, Method::CcdThenFinish);
        let mut frames: Vec<Frame> = Vec::new();
        let rest = match &subject.robot.motion {
            Motion::Horse(_) => Order::Drive(Command::default()),
            Motion::Tentacle(_) => Order::Perform(StrokeCommand::default()),
            Motion::Figure(_) => Order::Take(0),
        };
        if !rises(&mut controller, rest, dt_s) {
            return Err(CourseError::NeverStood);
        }
        let (mut time_s, mut cycle) = (0.0, 0_u32);
        while time_s < span_s.1 {
            let order = orders(time_s);
            if order.is_stop() {
                break;
            }
            controller.decide(dt_s, order);
            controller.learn_from_goals();
            let record = controller.record(&[]);
            if record.activity == Activity::Done {
                break;
            }
            if time_s >= span_s.0 {
                frames.push(Frame::of(time_s, &record, controller.generator()));
            }
            cycle += 1;
            time_s = f64::from(cycle) * dt_s;
        }
        if frames.is_empty() {
            return Err(CourseError::NothingToShow { ended_s: time_s });
        }
        Ok(Course { subject, frames })
    }

    /// From when to when, s.
    pub fn times_s(&self) -> (f64, f64) {
        let time = |frame: Option<&Frame>| frame.map_or(0.0, |frame| frame.time_s);
        (time(self.frames.first()), time(self.frames.last()) + self.subject.robot.period_s())
    }

    /// What it does, one after the other.
    pub fn spans(&self) -> Vec<Span> {
        let mut spans: Vec<Span> = Vec::new();
        for frame in &self.frames {
            let to_s = frame.time_s + self.subject.robot.period_s();
            match spans.last_mut() {
                Some(span) if (span.gait, span.is_changing) == (frame.gait, frame.is_changing) => {
                    span.to_s = to_s
                }
                _ => spans.push(Span {
                    from_s: frame.time_s,
                    to_s,
                    gait: frame.gait,
                    is_changing: frame.is_changing,
                }),
            }
        }
        spans
    }

    /// What goes on in a frame or span with these, in a word.
    pub fn name_of(&self, gait: Option<usize>, is_changing: bool) -> &str {
        match gait {
            None => "stand",
            Some(_) if is_changing => "change",
            Some(gait) => self.subject.gait_names.get(gait).map_or("walk", String::as_str),
        }
    }

    /// What goes on in a frame, in a word.
    pub fn name_of_frame<'a>(&'a self, frame: &'a Frame) -> &'a str {
        match (&self.subject.robot.motion, frame.stroke) {
            (_, Some(stroke)) => stroke,
            (Motion::Tentacle(_), None) => "rest",
            (Motion::Horse(_), None) => self.name_of(frame.gait, frame.is_changing),
            (Motion::Figure(figure), None) => {
                let pose = frame.pose.and_then(|pose| figure.poses.get(pose));
                pose.map_or("", |pose| pose.name.as_str())
            }
        }
    }

    /// The name of a foot, by its place in [`Frame::feet`], for people: its chain's.
    pub fn foot_name(&self, foot: usize) -> String {
        let target = self.frames.first().and_then(|frame| frame.feet.get(foot));
        target
            .map_or_else(String::new, |target| self.subject.robot.chains[target.chain].name.replace('_', " "))
    }

    /// When each foot of the robot's feet is on the ground: for each, intervals from and to, s, as near as a cycle.
    pub fn stances(&self) -> Vec<Vec<(f64, f64)>> {
        let feet = self.frames.iter().map(|frame| frame.feet.len()).max().unwrap_or(0);
        let stances_of = |foot: usize| {
            let mut stances: Vec<(f64, f64)> = Vec::new();
            let mut was_standing = false;
            for frame in &self.frames {
                let is_standing = frame.feet.get(foot).is_some_and(|foot| !foot.is_swing);
                let to_s = frame.time_s + self.subject.robot.period_s();
                match stances.last_mut() {
                    Some(stance) if is_standing && was_standing => stance.1 = to_s,
                    _ if is_standing => stances.push((frame.time_s, to_s)),
                    _ => {}
                }
                was_standing = is_standing;
            }
            stances
        };
        (0..feet).map(stances_of).collect()
    }

    /// The first change from one gait to another.
    pub fn first_change(&self) -> Option<Change> {
        let ordered = |frame: &Frame| match frame.order {
            Order::Drive(command) => Some(command),
            _ => None,
        };
        let mut last_order = 0;
        for (index, pair) in self.frames.windows(2).enumerate() {
            if ordered(&pair[0]) != ordered(&pair[1]) {
                last_order = index + 1;
            }
            let (Some(from), Some(to)) = (pair[0].gait, pair[1].gait) else { continue };
            if from == to {
                continue;
            }
            // Ordered before it began; over when no order and no speed changes any more.
            let begun = &self.frames[last_order];
            let same = self.frames[last_order..].iter().take_while(|frame| ordered(frame) == ordered(begun));
            let under_way: Vec<&Frame> = same.collect();
            let last = under_way.last()?;
            let is_on_its_way = |frame: &&&Frame| {
                frame.is_changing || frame.gait != Some(to) || (frame.speed_m_s - last.speed_m_s).abs() > 1e-6
            };
            let settled = under_way.iter().rev().find(is_on_its_way).unwrap_or(last);
            return Some(Change {
                ordered_s: begun.time_s,
                settled_s: settled.time_s,
                gaits: [from, to],
                speeds_m_s: [self.frames[last_order.saturating_sub(1)].speed_m_s, last.speed_m_s],
            });
        }
        None
    }

    /// The mean time a foot is in the air, s; none if none swings from lift-off to landing.
    pub fn mean_swing_s(&self) -> Option<f64> {
        let stances = self.stances();
        let swings = stances.iter().flat_map(|stances| stances.windows(2).map(|pair| pair[1].0 - pair[0].1));
        let (count, sum) = swings.fold((0_u32, 0.0), |(count, sum), swing| (count + 1, sum + swing));
        (count > 0).then(|| sum / f64::from(count))
    }
}

/// Lets a limp robot get up; whether it does.
fn rises(controller: &mut Controller<'_>, order: Order, dt_s: f64) -> bool {
    let mut rising_s = 0.0;
    while rising_s < RISING_MAX_S {
        controller.decide(dt_s, order);
        controller.learn_from_goals();
        match controller.record(&[]).activity {
            Activity::Standing => return true,
            Activity::Done => return false,
            _ => rising_s += dt_s,
        }
    }
    false
}

impl Frame {
    fn of(time_s: f64, record: &CycleRecord<'_>, generator: &Generator) -> Frame {
        let drive = generator.drive();
        Frame {
            time_s,
            order: record.order,
            gait: drive.and_then(Drive::gait),
            stroke: generator.stroke(),
            pose: generator.pose(),
            is_changing: drive.is_some_and(Drive::is_changing_gait),
            speed_m_s: record.speed_m_s,
            trunk_in_world: record.targets.trunk_in_world,
            trunk_turn: record.targets.trunk_turn,
            feet: record.targets.feet.clone(),
            goal_rad: record.state.goal_rad.clone(),
            interventions: record.interventions,
        }
    }
}
