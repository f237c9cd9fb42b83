//! From what is wanted to a plan that every foot can follow.
//!
//! A plan says ahead how speed, turn and gait will change. One is taken only if, looked through to its end, it
//! leaves every foot in its reach; else the next one is tried, and what is under way goes on. Feet already
//! down or in the air were placed for the old plan: a change that begins late enough, and goes gently, finds them all
//! placed for it.
//!
//! A change of gait: slow down to a speed both gaits and the legs between them can do, move the stride clock to
//! the new gait in one to four strides, go on to the new speed.

use super::HorsePlan;
use super::clock::{largest_shift, longest_interval_s};
use super::profile::Rates;
use super::reach_table::Reachable;
use super::walk::{Strides, Walk};
use crate::motion::curves::SMOOTH_STEP_SLOPE_MAX;

/// Lengths of a change of gait that are tried, strides.
const STRIDES: [f64; 5] = [1.0, 1.5, 2.0, 3.0, 4.0];
/// Share of the speed a change of gait could be made at by rule, and the factor from one try to the next.
const CHANGE_SPEED_SHARE: f64 = 0.98;
const SLOWER: f64 = 0.93;
/// How often it is slowed down before it is tried at full speed again, in another phase of the stride.
const TIMES_SLOWER: usize = 8;
/// Tries a cycle.
const TRIES: u32 = 2;
/// A wish that cannot be followed now is looked at again after this time: the phase of the stride is another one then.
/// Fast loops are spared the work of every cycle.
const RETRY_S: f64 = 0.009;
/// When a change may begin, shares of the longest period from now on; the last is a swing time more.
const STARTS: [f64; 4] = [0.0, 0.3, 0.6, 1.0];
/// How much longer than the acceleration limit asks for a change of speed may take: feet in the air when the trunk
/// slows down, or not yet as fast as it will be, swing faster against it.
const STRETCHES: [f64; 8] = [1.0, 1.5, 2.5, 4.0, 8.0, 16.0, 50.0, 150.0];

/// What is wanted, within what the robot can do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Wish {
    /// Index into the robot's gaits; none to stand.
    pub(super) gait: Option<usize>,
    pub(super) rates: Rates,
}

/// Follows wishes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Planner {
    /// The wish the walk's plan leads to, and the reach it was looked through with.
    followed: Option<(Wish, Reachable)>,
    /// Changes of gait tried in vain for this wish.
    tries: usize,
    wished: Option<Wish>,
    /// What could not be followed when last tried, and when that was, s.
    refused: Option<(Wish, Reachable, f64)>,
}

impl Planner {
    pub(super) fn new() -> Planner {
        Planner { followed: None, tries: 0, wished: None, refused: None }
    }

    /// Makes `walk` follow `wish` from time `now_s` on, every foot within `reach`, if it can be begun now.
    /// True if what the walk does now keeps to that reach.
    pub(super) fn follow(
        &mut self,
        plan: &HorsePlan,
        walk: &mut Walk,
        now_s: f64,
        wish: Wish,
        reach: &Reachable,
    ) -> bool {
        if let Some((followed, with)) = &mut self.followed
            && *followed == wish
        {
            if with == reach {
                return true;
            }
            if walk.stays_in_reach(now_s, reach) {
                *with = *reach;
                return true;
            }
        }
        if self.wished != Some(wish) {
            (self.wished, self.tries) = (Some(wish), 0);
        }
        let is_just_refused = self
            .refused
            .is_some_and(|(refused, with, at_s)| refused == wish && with == *reach && now_s - at_s < RETRY_S);
        if !is_just_refused {
            if self.try_to_follow(plan, walk, now_s, wish, reach) {
                self.followed = Some((wish, *reach));
                return true;
            }
            self.refused = Some((wish, *reach, now_s));
        }
        // The plan does not lead where it should; it may have been a compromise.
        self.followed = None;
        walk.stays_in_reach(now_s, reach)
    }

    /// True if what is wished is being done.
    pub(super) fn has_settled(&self) -> bool {
        self.followed.is_some_and(|(wish, _)| self.wished.is_none_or(|wished| wished == wish))
    }

    fn try_to_follow(
        &mut self,
        plan: &HorsePlan,
        walk: &mut Walk,
        now_s: f64,
        wish: Wish,
        reach: &Reachable,
    ) -> bool {
        match (wish.gait, walk.strides) {
            (None, None) => true,
            (Some(gait), None) => {
                let mut begun = walk.clone();
                begun.begin(plan, gait, now_s);
                take(walk, change_speed(plan, &begun, now_s, wish.rates, reach))
            }
            (gait, Some(strides)) => {
                let present = strides.gait_at(now_s);
                let from = if now_s >= strides.clock.change_start_s() { strides.from } else { present };
                let clock = strides.clock.without_later_change(now_s);
                let kept = Strides::new(plan, clock, from, present, gait.is_none());
                let mut steady = walk.clone();
                steady.strides = Some(kept);
                steady.recount_lift_offs(now_s);
                match gait {
                    Some(gait) if gait != present && !strides.is_changing(now_s) => {
                        self.try_to_change_gait(plan, walk, &steady, now_s, wish, reach)
                    }
                    Some(gait) if gait != present => {
                        // Another gait is just being taken: the speed can follow, within what that one can do.
                        let rates = plan.limited(present, wish.rates, reach.half_excursion_m);
                        take(walk, change_speed(plan, &steady, now_s, rates, reach));
                        false
                    }
                    _ => take(walk, change_speed(plan, &steady, now_s, wish.rates, reach)),
                }
            }
        }
    }

    fn try_to_change_gait(
        &mut self,
        plan: &HorsePlan,
        walk: &mut Walk,
        steady: &Walk,
        now_s: f64,
        wish: Wish,
        reach: &Reachable,
    ) -> bool {
        let (Some(gait), Some(from)) = (wish.gait, steady.gait(now_s)) else { return false };
        for _ in 0..TRIES {
            let candidate = change_of_gait(plan, steady.rates(now_s), from, wish, gait, reach, self.tries);
            self.tries = self.tries.wrapping_add(1);
            if take(walk, change_gait(plan, steady, now_s, &candidate, gait, wish.rates, reach)) {
                return true;
            }
        }
        false
    }
}

fn take(walk: &mut Walk, found: Option<Walk>) -> bool {
    match found {
        Some(found) => {
            *walk = found;
            true
        }
        None => false,
    }
}

/// A change of gait that might do.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Change {
    rates: Rates,
    strides: f64,
    /// Of the ramps before and after it.
    stretch: f64,
}

/// The change of gait to try as number `number`: those that take least time first, then all of them slower.
fn change_of_gait(
    plan: &HorsePlan,
    now: Rates,
    from: usize,
    wish: Wish,
    gait: usize,
    reach: &Reachable,
    number: usize,
) -> Change {
    let (settings, reach_m) = (&plan.settings, reach.half_excursion_m);
    let (a, b) = (&settings.gaits[from], &settings.gaits[gait]);
    let shift = largest_shift(a, b);
    let period_s = a.period_s(settings.swing_time_s).max(b.period_s(settings.swing_time_s));
    let slowest = plan.slowest(now, wish.rates);
    let (slower, option) = (number / STRIDES.len() % TIMES_SLOWER, number % STRIDES.len());
    #[allow(clippy::cast_precision_loss, reason = "a small number")]
    let slower = SLOWER.powf(slower as f64);
    let stretch = STRETCHES[number / STRIDES.len() % STRETCHES.len()];
    let mut options = STRIDES.map(|strides| {
        let interval_s = longest_interval_s(period_s, shift, strides);
        let stance_s = interval_s - settings.swing_time_s;
        let by_reach_m_s = plan.speed_by_reach_m_s(stance_s, period_s, reach_m);
        let by_legs_m_s =
            CHANGE_SPEED_SHARE * by_reach_m_s.min(plan.speed_by_swing_m_s(from, gait, interval_s));
        let rates = plan.slowed_to(slowest, slower * by_legs_m_s.min(plan.fastest_plane_m_s(slowest)));
        let rates = plan.limited(gait, plan.limited(from, rates, reach_m), reach_m);
        let duration_s = plan.ramp_s(now, rates) + strides * period_s + plan.ramp_s(rates, wish.rates);
        let fits = SMOOTH_STEP_SLOPE_MAX * shift / strides < 0.5;
        (if fits { duration_s } else { f64::INFINITY }, Change { rates, strides, stretch })
    });
    options.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
    options[option].1
}

/// When a change may begin, from `now_s` on.
fn starts(plan: &HorsePlan, walk: &Walk, now_s: f64) -> [f64; STARTS.len()] {
    let period_s = walk.strides.map_or(0.0, |strides| strides.clock.longest_period_s(now_s));
    let mut starts = STARTS.map(|share| now_s + share * period_s);
    starts[STARTS.len() - 1] += plan.settings.swing_time_s;
    starts
}

/// Time of a change of speed, s. To a stand and from one it takes a stride at least, so that every leg has a part in it.
fn ramp_s(plan: &HorsePlan, walk: &Walk, from: Rates, to: Rates) -> f64 {
    let stride_s = walk.strides.map_or(0.0, |strides| strides.clock.settled_period_s());
    let is_start_or_stop = from.is_still() != to.is_still();
    plan.ramp_s(from, to).max(if is_start_or_stop { stride_s } else { 0.0 })
}

/// `walk` with its speed changed to `rates`, as soon as that can be done.
fn change_speed(plan: &HorsePlan, walk: &Walk, now_s: f64, rates: Rates, reach: &Reachable) -> Option<Walk> {
    // What is over first is tried first.
    let shortest_s = ramp_s(plan, walk, walk.rates(now_s), rates);
    let mut ways = [(0.0, 0.0); STARTS.len() * STRETCHES.len()];
    for (start, start_s) in starts(plan, walk, now_s).into_iter().enumerate() {
        for (place, stretch) in STRETCHES.into_iter().enumerate() {
            ways[start * STRETCHES.len() + place] = (start_s, stretch);
        }
    }
    ways.sort_unstable_by(|a, b| (a.0 + a.1 * shortest_s).total_cmp(&(b.0 + b.1 * shortest_s)));
    ways.into_iter().find_map(|(start_s, stretch)| {
        let mut changed = walk.clone();
        changed.profile = walk.profile.until(now_s, start_s);
        let ramp_s = stretch * ramp_s(plan, walk, changed.profile.settled(), rates);
        (changed.profile.ramp_to(rates, ramp_s) && changed.stays_in_reach(now_s, reach)).then_some(changed)
    })
}

/// `walk` with its gait changed as `change` says, and then its speed to `rates`, as soon as that can be done.
fn change_gait(
    plan: &HorsePlan,
    walk: &Walk,
    now_s: f64,
    change: &Change,
    gait: usize,
    rates: Rates,
    reach: &Reachable,
) -> Option<Walk> {
    let Strides { clock, to: from, .. } = walk.strides?;
    let settings = &plan.settings;
    starts(plan, walk, now_s).into_iter().find_map(|start_s| {
        let mut changed = walk.clone();
        let profile = &mut changed.profile;
        *profile = profile.until(now_s, start_s);
        let is_whole =
            profile.ramp_to(change.rates, change.stretch * plan.ramp_s(profile.settled(), change.rates));
        let change_s = profile.settled_s().max(now_s);
        let clock = clock.change_to(&settings.gaits[gait], settings.swing_time_s, change_s, change.strides);
        let is_whole = is_whole
            && profile.wait_until(clock.change_end_s())
            && profile.ramp_to(rates, change.stretch * plan.ramp_s(change.rates, rates));
        changed.strides = Some(Strides::new(plan, clock, from, gait, false));
        (is_whole && changed.stays_in_reach(now_s, reach)).then_some(changed)
    })
}
