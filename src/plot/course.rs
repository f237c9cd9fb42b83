//! A robot's planned motion over time, on joints that are always exactly at their goals.

use glam::{DQuat, DVec3};

use crate::cycle::Controller;
use crate::ik::Method;
use crate::kinds::{FootRange, Kind};
use crate::model::Robot;
use crate::motion::{Activity, Generator, Order};
use crate::observe::CycleRecord;
use crate::signals::FootTarget;

/// A robot that does not stand after this time never will, s.
const RISING_MAX_S: f64 = 120.0;

/// A robot and the labels for its pictures.
#[derive(Debug, Clone)]
pub struct Subject<'r> {
    /// The robot.
    pub robot: &'r Robot,
    /// Its kind.
    pub kind: &'r dyn Kind,
    /// Names of its gaits, by index.
    pub gait_names: Vec<String>,
    /// Range of each foot; empty if it is not known.
    pub ranges: Vec<FootRange>,
}

/// A robot's motion over a span of time, counted from when it stood.
#[derive(Debug, Clone)]
pub struct Course<'r> {
    /// The robot.
    pub subject: Subject<'r>,
    /// One frame per cycle; at least one.
    pub frames: Vec<Frame>,
}

/// One cycle.
#[derive(Debug, Clone)]
pub struct Frame {
    /// Time since the robot stood, s.
    pub time_s: f64,
    /// The operator's order.
    pub order: Order,
    /// Its gait, index into [`Subject::gait_names`]; `None` while it takes no steps.
    pub gait: Option<usize>,
    /// Name of the arms' stroke; `None` for a horse, and at rest.
    pub stroke: Option<&'static str>,
    /// A figure's present or next pose, index into [`crate::model::FigureMotion::poses`].
    pub pose: Option<usize>,
    /// True during a change of gait.
    pub is_changing: bool,
    /// Speed of the trunk, m/s.
    pub speed_m_s: f64,
    /// Position of the trunk over the ground, m.
    pub trunk_in_world: DVec3,
    /// Rotation of the trunk, from the body frame to the world frame.
    pub trunk_orientation: DQuat,
    /// Planned state of the feet.
    pub feet: Vec<FootTarget>,
    /// Goal of each joint, after safety, rad.
    pub goal_rad: Vec<f64>,
    /// Number of joints whose goal differs from what the motion asked for.
    pub interventions: u32,
}

/// A time in which a robot's motion stays of one kind.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Span {
    /// Start, s.
    pub from_s: f64,
    /// End, s.
    pub to_s: f64,
    /// The gait, as in [`Frame::gait`].
    pub gait: Option<usize>,
    /// The same as [`Frame::is_changing`].
    pub is_changing: bool,
}

/// A change from one gait to another.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Change {
    /// Time of the order, s.
    pub ordered_s: f64,
    /// Time when the robot walks steadily in the new gait, or another order comes, s.
    pub settled_s: f64,
    /// The gaits before and after, indices into [`Subject::gait_names`].
    pub gaits: [usize; 2],
    /// The speeds before and after, m/s.
    pub speeds_m_s: [f64; 2],
}

/// Reasons why there is nothing to draw.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum CourseError {
    /// The robot never stood.
    #[error("the robot never stood: its motion ended before")]
    NeverStood,
    /// The requested span contains no cycle.
    #[error("nothing to show: the motion ended {ended_s} s after the robot stood")]
    NothingToShow {
        /// End of the motion, s.
        ended_s: f64,
    },
}

impl<'r> Subject<'r> {
    /// `robot`, which is of this `kind`.
    pub fn of(robot: &'r Robot, kind: &'r dyn Kind) -> Subject<'r> {
        Subject { robot, kind, gait_names: kind.gait_names(), ranges: kind.foot_ranges() }
    }
}

impl<'r> Course<'r> {
    /// The robot's motion by `generator` under these orders, within `span_s` (from and to, s since it stood).
    /// `orders` is called once per cycle with the time since then, s. Ends early at an order to stop.
    ///
    /// # Errors
    /// If the robot does not get up, or if that span contains no cycle.
    pub fn follow(
        subject: Subject<'r>,
        generator: Generator,
        span_s: (f64, f64),
        mut orders: impl FnMut(f64) -> Order,
    ) -> Result<Course<'r>, CourseError> {
        let dt_s = subject.robot.period_s();
        let mut controller = Controller::with_generator(subject.robot, generator, Method::CcdThenFinish);
        let mut frames: Vec<Frame> = Vec::new();
        if !rises(&mut controller, subject.kind.order_to_rest(), dt_s) {
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
            if record.facts.activity == Activity::Done {
                break;
            }
            if time_s >= span_s.0 {
                frames.push(Frame::of(time_s, &record));
            }
            cycle += 1;
            time_s = f64::from(cycle) * dt_s;
        }
        if frames.is_empty() {
            return Err(CourseError::NothingToShow { ended_s: time_s });
        }
        Ok(Course { subject, frames })
    }

    /// Start and end, s.
    pub fn times_s(&self) -> (f64, f64) {
        let time = |frame: Option<&Frame>| frame.map_or(0.0, |frame| frame.time_s);
        (time(self.frames.first()), time(self.frames.last()) + self.subject.robot.period_s())
    }

    /// Its spans, in order of time.
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

    /// Name of the activity in a frame or span with these values.
    pub fn name_of(&self, gait: Option<usize>, is_changing: bool) -> &str {
        match gait {
            None => "stand",
            Some(_) if is_changing => "change",
            Some(gait) => self.subject.gait_names.get(gait).map_or("walk", String::as_str),
        }
    }

    /// Name of the activity in a frame.
    pub fn name_of_frame<'a>(&'a self, frame: &'a Frame) -> &'a str {
        if let Some(stroke) = frame.stroke {
            return stroke;
        }
        match self.subject.kind.rest_name(frame.pose) {
            Some(name) => name,
            None => self.name_of(frame.gait, frame.is_changing),
        }
    }

    /// Readable name of a foot, by its index in [`Frame::feet`]: the name of its chain.
    pub fn foot_name(&self, foot: usize) -> String {
        let target = self.frames.first().and_then(|frame| frame.feet.get(foot));
        target
            .map_or_else(String::new, |target| self.subject.robot.chains[target.chain].name.replace('_', " "))
    }

    /// Stances of each foot: intervals from and to, s, accurate to one cycle.
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
            // The order came before the change began; the change is over when neither order nor speed changes
            // any more.
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

    /// Mean duration of a swing, s; `None` if there is no swing from lift-off to landing.
    pub fn mean_swing_s(&self) -> Option<f64> {
        let stances = self.stances();
        let swings = stances.iter().flat_map(|stances| stances.windows(2).map(|pair| pair[1].0 - pair[0].1));
        let (count, sum) = swings.fold((0_u32, 0.0), |(count, sum), swing| (count + 1, sum + swing));
        (count > 0).then(|| sum / f64::from(count))
    }
}

/// Lets a limp robot get up; returns true if it does.
fn rises(controller: &mut Controller<'_>, order: Order, dt_s: f64) -> bool {
    let mut rising_s = 0.0;
    while rising_s < RISING_MAX_S {
        controller.decide(dt_s, order);
        controller.learn_from_goals();
        match controller.record(&[]).facts.activity {
            Activity::Standing => return true,
            Activity::Done => return false,
            _ => rising_s += dt_s,
        }
    }
    false
}

impl Frame {
    fn of(time_s: f64, record: &CycleRecord<'_>) -> Frame {
        let facts = &record.facts;
        Frame {
            time_s,
            order: facts.order,
            gait: facts.gait,
            stroke: facts.stroke,
            pose: facts.pose,
            is_changing: facts.is_changing_gait,
            speed_m_s: facts.speed_m_s,
            trunk_in_world: record.targets.trunk_in_world,
            trunk_orientation: record.targets.trunk_orientation,
            feet: record.targets.feet().to_vec(),
            goal_rad: record.state.goal_rad.clone(),
            interventions: facts.interventions,
        }
    }
}
