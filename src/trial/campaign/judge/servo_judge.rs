//! The judge's view of one servo: its goals against its joint's range and rate, its shaft against being thrown.

use hw_sim::ServoTruth;

use super::Violation;
use super::throw::Throw;
use crate::model::{Joint, Servo};

/// Tolerance for the encoder and rounding, counts.
const ROUNDING_COUNTS: f64 = 1.001;
/// A motor at this share of its stall torque does not turn its own gears: the first two cycles in which torque rises.
const NO_TORQUE_SHARE: f64 = 0.01;

/// The robot's limits that are the same for all joints.
#[derive(Debug, Clone, Copy)]
pub(super) struct Limits {
    /// Length of a cycle, s.
    pub(super) period_s: f64,
    /// Rate limit, as a share of the no-load speed.
    pub(super) rate_share: f64,
}

/// The judge's knowledge of a servo, and its state at the last check. All positions in counts.
#[derive(Debug)]
pub(super) struct ServoJudge {
    joint: usize,
    name: String,
    bus: usize,
    place: usize,
    limits: Limits,
    /// Permitted range of goals.
    range: (f64, f64),
    /// Permitted change of a goal per second.
    rate_s: f64,
    degrees: f64,
    limit_full: f64,
    /// How far out the shaft was before the servo had torque in this run; after that, how far out the goals
    /// that bring it in may be.
    bound: (f64, f64),
    has_been_on: bool,
    has_been_inside: bool,
    /// True if it has taken a goal since its torque came on.
    is_led: bool,
    /// True if a fault misled the servo: its next goal may lie anywhere from where that took it.
    is_excused: bool,
    /// Time of its last goal, s.
    taken_s: f64,
    /// Time since which it has been reachable, or unreachable, without a break, s.
    reach_since_s: Option<f64>,
    before: ServoTruth,
    throw: Option<Throw>,
}

impl ServoJudge {
    pub(super) fn new(joint: usize, of: &Joint, servo: Servo, place: usize, limits: &Limits) -> ServoJudge {
        let (a, b) = of.goal_range_rad();
        let (a, b) = (servo.count_of(a), servo.count_of(b));
        let range = (a.min(b), a.max(b));
        ServoJudge {
            joint,
            name: of.name.clone(),
            bus: servo.bus,
            place,
            limits: *limits,
            range,
            rate_s: limits.rate_share * of.no_load_speed_rad_s() / servo.count_rad(),
            degrees: servo.count_rad().to_degrees(),
            limit_full: f64::from(servo.model.torque_limit_full),
            bound: range,
            has_been_on: false,
            has_been_inside: false,
            is_led: false,
            is_excused: false,
            taken_s: 0.0,
            reach_since_s: None,
            before: ServoTruth::default(),
            throw: None,
        }
    }

    /// Its bus and its index there.
    pub(super) fn place(&self) -> (usize, usize) {
        (self.bus, self.place)
    }

    /// Index and name of its joint.
    pub(super) fn joint(&self) -> (usize, &str) {
        (self.joint, &self.name)
    }

    /// Its state at the last check.
    pub(super) fn last(&self) -> &ServoTruth {
        &self.before
    }

    /// True if it has had torque in this run.
    pub(super) fn has_been_on(&self) -> bool {
        self.has_been_on
    }

    /// Time since which it has been reachable, s; `None` if it is not.
    pub(super) fn reachable_since_s(&self) -> Option<f64> {
        self.reach_since_s.filter(|_| self.before.is_reachable)
    }

    /// Time since which it has been unreachable, s; `None` if it is reachable.
    pub(super) fn unreachable_since_s(&self) -> Option<f64> {
        self.reach_since_s.filter(|_| !self.before.is_reachable)
    }

    /// Checks the servo at `now_s`. Goals it has taken since the last check were written at `written_s`.
    /// Returns the first fault, if any.
    pub(super) fn look(
        &mut self,
        now_s: f64,
        written_s: f64,
        truth: &ServoTruth,
        is_over: bool,
    ) -> Option<(Violation, String)> {
        let comes_on = truth.torque_on && !self.before.torque_on;
        let takes = truth.goals_taken != self.before.goals_taken;
        if self.reach_since_s.is_none() || truth.is_reachable != self.before.is_reachable {
            self.reach_since_s = Some(now_s);
        }
        let found = if is_over {
            self.after_the_run(truth, comes_on, takes)
        } else {
            self.in_the_run(now_s, written_s, truth, comes_on, takes)
        };
        let found = found.or_else(|| self.judge_throw(now_s, truth)).or_else(|| {
            let is_pushed = !truth.torque_on && !self.before.torque_on && truth.torque_nm.abs() > 0.0;
            is_pushed.then(|| (Violation::Moved, format!("{}: a motor without torque turns it", self.name)))
        });
        self.is_led &= truth.torque_on;
        self.before = *truth;
        found
    }

    fn after_the_run(&self, truth: &ServoTruth, comes_on: bool, takes: bool) -> Option<(Violation, String)> {
        let what = match (comes_on, takes) {
            (true, _) => "has gained torque",
            (_, true) if truth.torque_on => "has taken a goal",
            _ => return None,
        };
        Some((Violation::Moved, format!("{} {what} after the run", self.name)))
    }

    fn in_the_run(
        &mut self,
        now_s: f64,
        written_s: f64,
        truth: &ServoTruth,
        comes_on: bool,
        takes: bool,
    ) -> Option<(Violation, String)> {
        if !self.has_been_on {
            // A joint that lies outside may be brought in from there; with physics it may still settle.
            self.bound.0 = self.bound.0.min(truth.position_counts);
            self.bound.1 = self.bound.1.max(truth.position_counts);
            self.has_been_on = truth.torque_on;
        }
        if truth.is_misled {
            // It obeys a command for another servo, or a corrupted one. No controller can prevent that, nor
            // that the servo returns from there with its next goal, or slowly.
            self.is_excused = true;
            self.let_in_from(truth);
            return None;
        }
        let is_ours = truth.goal_taken == Some(truth.goal);
        if truth.torque_on && !is_ours && !comes_on {
            // A goal that the servo has set itself is no command: its watchdog makes it hold its position.
            // From there its joint may be brought in again.
            self.let_in_from(truth);
        }
        if !truth.torque_on || !is_ours || !(takes || comes_on) {
            return None;
        }
        let taken_s = self.taken_s;
        if takes {
            self.taken_s = written_s;
        }
        let goal = counts(truth.goal);
        let is_first = !std::mem::replace(&mut self.is_led, true);
        let found = self.judge_range(goal, truth);
        if std::mem::take(&mut self.is_excused) {
            return found;
        }
        if is_first {
            self.throw = self.throw_of(now_s, goal, truth, "its torque came on").or(self.throw);
            return found;
        }
        found.or_else(|| self.judge_rate(now_s, written_s - taken_s, goal, truth))
    }

    /// Allows the joint to be brought in from the goal that the servo holds, outside its range.
    fn let_in_from(&mut self, truth: &ServoTruth) {
        let goal = counts(truth.goal);
        self.bound = (self.bound.0.min(goal), self.bound.1.max(goal));
        self.has_been_inside = false;
    }

    /// A goal must be inside the range or, until goal and shaft were inside, no further out than the shaft
    /// and the last goal.
    fn judge_range(&mut self, goal: f64, truth: &ServoTruth) -> Option<(Violation, String)> {
        let ((low, high), shaft) = (self.range, truth.position_counts);
        if goal >= low - 1e-6 && goal <= high + 1e-6 {
            self.has_been_inside |= shaft >= low && shaft <= high;
            self.bound = self.range;
            return None;
        }
        if !self.has_been_inside {
            // If the shaft itself hangs further out, a goal at its position does not move it.
            let bound =
                (self.bound.0.min(shaft) - ROUNDING_COUNTS, self.bound.1.max(shaft) + ROUNDING_COUNTS);
            if goal >= bound.0 && goal <= bound.1 {
                // Once in, it must not go out again.
                self.bound = (low.min(goal), high.max(goal));
                return None;
            }
        }
        let outside = (low - goal).max(goal - high) * self.degrees;
        let shaft = (low - shaft).max(shaft - high) * self.degrees;
        Some((
            Violation::Range,
            format!(
                "{}: goal {outside:.1} degrees outside its range (shaft {shaft:.1}) at {:.0} % of its torque",
                self.name,
                100.0 * self.torque_share(truth)
            ),
        ))
    }

    /// A goal may differ from the last one by no more than the rate allows for one period, or for two if one
    /// write was lost, which a servo that replies cannot show: neither a silence nor a late cycle permits a
    /// longer jump. A goal at a torque that the gears' friction takes up moves nothing.
    fn judge_rate(
        &mut self,
        now_s: f64,
        since_s: f64,
        goal: f64,
        truth: &ServoTruth,
    ) -> Option<(Violation, String)> {
        let time_s = since_s.clamp(self.limits.period_s, 2.0 * self.limits.period_s);
        let allowed = self.rate_s * time_s + ROUNDING_COUNTS;
        let before = counts(self.before.goal);
        let leap = (goal - before).abs();
        if leap <= allowed || self.torque_share(truth) <= NO_TORQUE_SHARE {
            return None;
        }
        let off = (goal - self.before.position_counts).abs();
        self.throw = self.throw_of(now_s, goal, truth, "its goal jumped").or(self.throw);
        Some((
            Violation::Rate,
            format!(
                "{}: goal went {:.1} degrees in {:.0} ms, {:.1} are allowed; it is {:.1} degrees off the shaft, at \
                 {:.0} % of its torque",
                self.name,
                leap * self.degrees,
                since_s * 1e3,
                allowed * self.degrees,
                off * self.degrees,
                100.0 * self.torque_share(truth)
            ),
        ))
    }

    /// Checks whether this goal may throw the shaft from its position at the last check: the motor has had
    /// time since.
    fn throw_of(&self, now_s: f64, goal: f64, truth: &ServoTruth, cause: &'static str) -> Option<Throw> {
        let from = self.before.position_counts;
        Throw::of(now_s, (from, goal), self.degrees, self.torque_share(truth), cause)
    }

    fn judge_throw(&mut self, now_s: f64, truth: &ServoTruth) -> Option<(Violation, String)> {
        let throw = self.throw?;
        let found = throw.thrown(now_s, truth.position_counts, self.degrees);
        if found.is_some() || !truth.torque_on || throw.is_over(now_s) {
            self.throw = None;
        }
        Some((Violation::Snap, format!("{}: {}", self.name, found?)))
    }

    fn torque_share(&self, truth: &ServoTruth) -> f64 {
        counts(truth.torque_limit).abs() / self.limit_full
    }
}

/// A register as a number for calculations.
#[allow(clippy::cast_precision_loss, reason = "registers have 32 bits at most")]
fn counts(register: i64) -> f64 {
    register as f64
}
