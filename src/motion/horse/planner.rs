//! From what is wanted to a plan that every foot can follow.
//!
//! A plan says ahead how speed, turn and gait will change. One is taken only if, looked through to its end, it
//! leaves every foot in its reach; else the next one is tried, and what is under way goes on. Feet already
//! down or in the air were placed for the old plan: a change that begins late enough, and goes gently, finds them all
//! placed for it.
//!
//! A change of gait: slow down to a speed both gaits and the legs between them can do, move the stride clock to
//! the new gait in one to four strides, go on to the new speed.
//!
//! To look a plan through takes long, and there are many ways to do what is wished: a cycle looks at so many, and the
//! next one goes on from there.

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
/// Ways to change the gait that are tried in a cycle: two speeds or lengths, at each moment it may begin.
const TRIES: usize = 2 * STARTS.len();
/// Stances and swings that may be looked at in a cycle before another plan is begun to be looked through.
pub(super) const LOOKS_MAX: u32 = 800;
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
    /// What was tried in vain, by which of a cycle's two reaches it was for.
    vain: [Option<Vain>; 2],
    /// Stances and swings looked at in this cycle.
    pub(super) looked: u32,
}

/// Which reach the feet are to keep to: that of the posture to go to, or that of the way the trunk is on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Within {
    Next,
    Present,
}

/// What was tried in vain to follow a wish.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Vain {
    wish: Wish,
    /// Ways tried: the next cycle goes on with the one after them.
    ways: usize,
    /// When all had been tried, s, and the reach they were looked through with.
    refused: Option<(Reachable, f64)>,
}

/// What came of trying to follow a wish.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Found {
    /// It is followed.
    Way,
    /// There are ways left, which the next cycle tries.
    NoneYet,
    /// All ways have been tried in vain.
    None,
}

/// A cycle's part of trying the ways to follow a wish.
struct Search {
    /// Ways tried so far.
    ways: usize,
    /// None of them in this cycle.
    is_first: bool,
    /// All have been tried.
    is_over: bool,
    /// Stances and swings looked at in this cycle.
    looked: u32,
}

impl Search {
    /// True if another of `count` ways may be tried in this cycle, which it then counts as. One always may: a cycle that
    /// has looked at much before is no reason to stand still.
    fn next_of(&mut self, count: usize) -> bool {
        self.is_over = self.ways >= count;
        let goes_on = !self.is_over && (self.is_first || self.looked < LOOKS_MAX);
        self.is_first = false;
        self.ways += usize::from(goes_on);
        goes_on
    }
}

impl Planner {
    pub(super) fn new() -> Planner {
        Planner { followed: None, tries: 0, wished: None, vain: [None; 2], looked: 0 }
    }

    /// A cycle begins, in which so much is looked at as one may.
    pub(super) fn begin_cycle(&mut self) {
        self.looked = 0;
    }

    /// Makes `walk` follow `wish` from time `now_s` on, every foot within `reach`, if a way to begin that now is found.
    pub(super) fn follow(
        &mut self,
        plan: &HorsePlan,
        walk: &mut Walk,
        now_s: f64,
        wish: Wish,
        (within, reach): (Within, &Reachable),
    ) -> Found {
        if let Some((followed, with)) = &mut self.followed
            && *followed == wish
        {
            if with == reach {
                return Found::Way;
            }
            if walk.stays_in_reach(now_s, reach, &mut self.looked) {
                *with = *reach;
                return Found::Way;
            }
        }
        // The plan does not lead where it should; it may have been a compromise.
        self.followed = None;
        if self.wished != Some(wish) {
            (self.wished, self.tries) = (Some(wish), 0);
        }
        let vain = self.vain[within as usize].filter(|vain| vain.wish == wish);
        let vain = vain.unwrap_or(Vain { wish, ways: 0, refused: None });
        if vain.refused.is_some_and(|(with, at_s)| with == *reach && now_s - at_s < RETRY_S) {
            return Found::None;
        }
        let mut search = Search { ways: vain.ways, is_first: true, is_over: false, looked: self.looked };
        let is_followed = self.try_to_follow(plan, walk, now_s, wish, reach, &mut search);
        self.looked = search.looked;
        if is_followed {
            self.vain[within as usize] = None;
            self.followed = Some((wish, *reach));
            return Found::Way;
        }
        let (ways, refused) = if search.is_over { (0, Some((*reach, now_s))) } else { (search.ways, None) };
        self.vain[within as usize] = Some(Vain { wish, ways, refused });
        if search.is_over { Found::None } else { Found::NoneYet }
    }

    /// True if what `walk` does now keeps to `reach`.
    pub(super) fn keeps(&mut self, walk: &Walk, now_s: f64, reach: &Reachable) -> bool {
        walk.stays_in_reach(now_s, reach, &mut self.looked)
    }

    /// True if what is wished is being done.
    pub(super) fn has_settled(&self) -> bool {
        self.followed.is_some_and(|(wish, _)| self.wished.is_none_or(|wished| wished == wish))
    }

    /// True if it can be followed; what is found is taken.
    #[allow(clippy::too_many_arguments, reason = "what is there, what is wished, and how far the search is")]
    fn try_to_follow(
        &mut self,
        plan: &HorsePlan,
        walk: &mut Walk,
        now_s: f64,
        wish: Wish,
        reach: &Reachable,
        search: &mut Search,
    ) -> bool {
        match (wish.gait, walk.strides) {
            (None, None) => true,
            (Some(gait), None) => {
                let mut begun = walk.clone();
                begun.begin(plan, gait, now_s);
                take(walk, change_speed(plan, &begun, now_s, wish.rates, reach, search))
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
                        self.try_to_change_gait(plan, walk, (&steady, now_s), wish, reach, search)
                    }
                    Some(gait) if gait != present => {
                        // Another gait is just being taken: the speed can follow, within what that one can do.
                        let rates = plan.limited(present, wish.rates, reach.half_excursion_m);
                        let found = change_speed(plan, &steady, now_s, rates, reach, search);
                        // One that was found is not improved on in the next cycle.
                        search.is_over |= take(walk, found);
                        false
                    }
                    _ => take(walk, change_speed(plan, &steady, now_s, wish.rates, reach, search)),
                }
            }
        }
    }

    fn try_to_change_gait(
        &mut self,
        plan: &HorsePlan,
        walk: &mut Walk,
        (steady, now_s): (&Walk, f64),
        wish: Wish,
        reach: &Reachable,
        search: &mut Search,
    ) -> bool {
        let (Some(gait), Some(from)) = (wish.gait, steady.gait(now_s)) else { return false };
        while search.next_of(TRIES) {
            let (number, start) = (self.tries / STARTS.len(), self.tries % STARTS.len());
            self.tries = self.tries.wrapping_add(1);
            let change = change_of_gait(plan, steady.rates(now_s), from, wish, gait, reach, number);
            let start_s = starts(plan, steady, now_s)[start];
            let changed = change_gait(plan, steady, (now_s, start_s), &change, gait, wish.rates);
            let stays = |changed: &Walk| changed.stays_in_reach(now_s, reach, &mut search.looked);
            if take(walk, changed.filter(stays)) {
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

/// `walk` with its speed changed to `rates`, as soon as that can be done, by one of the ways that are tried in this cycle.
fn change_speed(
    plan: &HorsePlan,
    walk: &Walk,
    now_s: f64,
    rates: Rates,
    reach: &Reachable,
    search: &mut Search,
) -> Option<Walk> {
    // What is over first is tried first.
    let shortest_s = ramp_s(plan, walk, walk.rates(now_s), rates);
    let mut ways = [(0.0, 0.0); STARTS.len() * STRETCHES.len()];
    for (start, start_s) in starts(plan, walk, now_s).into_iter().enumerate() {
        for (place, stretch) in STRETCHES.into_iter().enumerate() {
            ways[start * STRETCHES.len() + place] = (start_s, stretch);
        }
    }
    ways.sort_unstable_by(|a, b| (a.0 + a.1 * shortest_s).total_cmp(&(b.0 + b.1 * shortest_s)));
    while search.next_of(ways.len()) {
        let (start_s, stretch) = ways[search.ways - 1];
        let mut changed = walk.clone();
        changed.profile = walk.profile.until(now_s, start_s);
        let ramp_s = stretch * ramp_s(plan, walk, changed.profile.settled(), rates);
        if changed.profile.ramp_to(rates, ramp_s) && changed.stays_in_reach(now_s, reach, &mut search.looked)
        {
            return Some(changed);
        }
    }
    None
}

/// `walk` with its gait changed as `change` says from `start_s` on, and then its speed to `rates`; none if there is no room
/// for that in its profile.
fn change_gait(
    plan: &HorsePlan,
    walk: &Walk,
    (now_s, start_s): (f64, f64),
    change: &Change,
    gait: usize,
    rates: Rates,
) -> Option<Walk> {
    let Strides { clock, to: from, .. } = walk.strides?;
    let settings = &plan.settings;
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
    is_whole.then_some(changed)
}
