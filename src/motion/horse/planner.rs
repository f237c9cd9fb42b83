//! From a request to a plan that every foot can follow.
//!
//! A plan fixes in advance how speed, turn and gait will change. The planner takes one only if, checked to
//! its end, it leaves every foot within its reach; otherwise it tries the next, and the present plan
//! continues. Feet already down or in the air were placed for the old plan: a change that begins late enough,
//! and gently, finds all of them placed for it.
//!
//! To change the gait, the horse slows down to a speed that both gaits and the transition between them allow,
//! moves the stride clock to the new gait in one to four strides, and then goes to the new speed.
//!
//! To check a plan takes long, and there are many ways to fulfil a request: one cycle checks a limited number,
//! and the next continues from there.

use super::HorsePlan;
use super::clock::{largest_shift, longest_interval_s};
use super::profile::Velocity;
use super::reach_table::Reachable;
use super::walk::{Strides, Walk};
use crate::motion::curves::SMOOTH_STEP_SLOPE_MAX;

/// Lengths of a change of gait to try, strides.
const STRIDES: [f64; 5] = [1.0, 1.5, 2.0, 3.0, 4.0];
/// Share of the allowed speed at which a change of gait is first tried, and the factor from one try to the next.
const CHANGE_SPEED_SHARE: f64 = 0.98;
const SLOWER: f64 = 0.93;
/// Number of slower speeds to try before full speed is tried again, in another phase of the stride.
const TIMES_SLOWER: usize = 8;
/// Ways to change the gait that one cycle tries: two speeds or lengths, at each moment it may begin.
const TRIES: usize = 2 * STARTS.len();
/// Number of stances and swings that a cycle may check before it must not begin to check another plan.
pub(super) const LOOKS_MAX: u32 = 800;
/// Time after which a request that cannot be followed is tried again, s: the phase of the stride has changed by
/// then. This spares fast loops the work in every cycle.
const RETRY_S: f64 = 0.009;
/// When a change may begin: shares of the longest period from now on; the last adds one swing time.
const STARTS: [f64; 4] = [0.0, 0.3, 0.6, 1.0];
/// Factors by which a change of speed may take longer than the acceleration limit requires: feet that are in
/// the air while the trunk slows down, or before it is at full speed, swing faster relative to it.
const STRETCHES: [f64; 8] = [1.0, 1.5, 2.5, 4.0, 8.0, 16.0, 50.0, 150.0];

/// The request, within what the robot can do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Request {
    /// Index into the robot's gaits; `None` to stand.
    pub(super) gait: Option<usize>,
    pub(super) velocity: Velocity,
}

/// Follows requests.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Planner {
    /// The request that the walk's plan leads to, and the reach it was checked with.
    followed: Option<(Request, Reachable)>,
    /// Failed changes of gait for this request.
    tries: usize,
    requested: Option<Request>,
    /// Failed attempts, one entry for each of a cycle's two reaches.
    vain: [Option<FailedAttempts>; 2],
    /// Stances and swings checked in this cycle.
    pub(super) looked: u32,
}

/// The reach that the feet must keep to: that of the posture to go to, or that of the trunk's present way.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ReachLimit {
    Next,
    Present,
}

/// Failed attempts to follow a request.
#[derive(Debug, Clone, Copy, PartialEq)]
struct FailedAttempts {
    request: Request,
    /// Number of ways tried: the next cycle continues after them.
    ways: usize,
    /// Time when all had been tried, s, and the reach they were checked with.
    refused: Option<(Reachable, f64)>,
}

/// Result of an attempt to follow a request.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Found {
    /// A way was found and taken.
    Way,
    /// Some ways are untried; the next cycle tries them.
    NoneYet,
    /// All ways failed.
    None,
}

/// One cycle's part of the search for a way to follow a request.
struct Search {
    /// Number of ways tried so far.
    ways: usize,
    /// True if this cycle has tried no way yet.
    is_first: bool,
    /// True if all have been tried.
    is_over: bool,
    /// Stances and swings checked in this cycle.
    looked: u32,
}

impl Search {
    /// True if this cycle may try another of `count` ways, and counts it. One try is always allowed: a cycle
    /// that has already checked many is no reason to stand still.
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
        Planner { followed: None, tries: 0, requested: None, vain: [None; 2], looked: 0 }
    }

    /// Begins a cycle with its full allowance of checks.
    pub(super) fn begin_cycle(&mut self) {
        self.looked = 0;
    }

    /// Makes `walk` follow `request` from time `now_s` on, with every foot within `reach`, if there is a way
    /// that can begin now.
    pub(super) fn follow(
        &mut self,
        plan: &HorsePlan,
        walk: &mut Walk,
        now_s: f64,
        request: Request,
        (within, reach): (ReachLimit, &Reachable),
    ) -> Found {
        if let Some((followed, with)) = &mut self.followed
            && *followed == request
        {
            if with == reach {
                return Found::Way;
            }
            if walk.stays_in_reach(now_s, reach, &mut self.looked) {
                *with = *reach;
                return Found::Way;
            }
        }
        // The plan does not lead to the request; it may have been a compromise.
        self.followed = None;
        if self.requested != Some(request) {
            (self.requested, self.tries) = (Some(request), 0);
        }
        let vain = self.vain[within as usize].filter(|vain| vain.request == request);
        let vain = vain.unwrap_or(FailedAttempts { request, ways: 0, refused: None });
        if vain.refused.is_some_and(|(with, at_s)| with == *reach && now_s - at_s < RETRY_S) {
            return Found::None;
        }
        let mut search = Search { ways: vain.ways, is_first: true, is_over: false, looked: self.looked };
        let is_followed = self.try_to_follow(plan, walk, now_s, request, reach, &mut search);
        self.looked = search.looked;
        if is_followed {
            self.vain[within as usize] = None;
            self.followed = Some((request, *reach));
            return Found::Way;
        }
        let (ways, refused) = if search.is_over { (0, Some((*reach, now_s))) } else { (search.ways, None) };
        self.vain[within as usize] = Some(FailedAttempts { request, ways, refused });
        if search.is_over { Found::None } else { Found::NoneYet }
    }

    /// True if the present plan of `walk` keeps to `reach`.
    pub(super) fn keeps(&mut self, walk: &Walk, now_s: f64, reach: &Reachable) -> bool {
        walk.stays_in_reach(now_s, reach, &mut self.looked)
    }

    /// True if the robot does what is requested.
    pub(super) fn has_settled(&self) -> bool {
        self.followed.is_some_and(|(request, _)| self.requested.is_none_or(|requested| requested == request))
    }

    /// True if the request can be followed; a way that is found is taken.
    #[allow(
        clippy::too_many_arguments,
        reason = "what is there, what is requested, and how far the search is"
    )]
    fn try_to_follow(
        &mut self,
        plan: &HorsePlan,
        walk: &mut Walk,
        now_s: f64,
        request: Request,
        reach: &Reachable,
        search: &mut Search,
    ) -> bool {
        match (request.gait, walk.strides) {
            (None, None) => true,
            (Some(gait), None) => {
                let mut begun = walk.clone();
                begun.begin(plan, gait, now_s);
                take(walk, change_speed(plan, &begun, now_s, request.velocity, reach, search))
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
                        self.try_to_change_gait(plan, walk, (&steady, now_s), request, reach, search)
                    }
                    Some(gait) if gait != present => {
                        // A change of gait is under way: the speed can follow within that gait's limits.
                        let velocity = plan.limited(present, request.velocity, reach.half_excursion_m);
                        let found = change_speed(plan, &steady, now_s, velocity, reach, search);
                        // The next cycle does not improve on a way that was found.
                        search.is_over |= take(walk, found);
                        false
                    }
                    _ => take(walk, change_speed(plan, &steady, now_s, request.velocity, reach, search)),
                }
            }
        }
    }

    fn try_to_change_gait(
        &mut self,
        plan: &HorsePlan,
        walk: &mut Walk,
        (steady, now_s): (&Walk, f64),
        request: Request,
        reach: &Reachable,
        search: &mut Search,
    ) -> bool {
        let (Some(gait), Some(from)) = (request.gait, steady.gait(now_s)) else { return false };
        while search.next_of(TRIES) {
            let (number, start) = (self.tries / STARTS.len(), self.tries % STARTS.len());
            self.tries = self.tries.wrapping_add(1);
            let change = change_of_gait(plan, steady.velocity(now_s), from, request, gait, reach, number);
            let start_s = starts(plan, steady, now_s)[start];
            let changed = change_gait(plan, steady, (now_s, start_s), &change, gait, request.velocity);
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

/// A possible change of gait.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Change {
    velocity: Velocity,
    strides: f64,
    /// Stretch of the ramps before and after the change.
    stretch: f64,
}

/// The change of gait to try as number `number`: the quickest first, then all of them slower.
fn change_of_gait(
    plan: &HorsePlan,
    now: Velocity,
    from: usize,
    request: Request,
    gait: usize,
    reach: &Reachable,
    number: usize,
) -> Change {
    let (settings, reach_m) = (&plan.settings, reach.half_excursion_m);
    let (a, b) = (&settings.gaits[from], &settings.gaits[gait]);
    let shift = largest_shift(a, b);
    let period_s = a.period_s(settings.swing_time_s).max(b.period_s(settings.swing_time_s));
    let slowest = plan.slowest(now, request.velocity);
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
        let velocity = plan.slowed_to(slowest, slower * by_legs_m_s.min(plan.fastest_plane_m_s(slowest)));
        let velocity = plan.limited(gait, plan.limited(from, velocity, reach_m), reach_m);
        let duration_s =
            plan.ramp_s(now, velocity) + strides * period_s + plan.ramp_s(velocity, request.velocity);
        let fits = SMOOTH_STEP_SLOPE_MAX * shift / strides < 0.5;
        (if fits { duration_s } else { f64::INFINITY }, Change { velocity, strides, stretch })
    });
    options.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
    options[option].1
}

/// Times at which a change may begin, from `now_s` on.
fn starts(plan: &HorsePlan, walk: &Walk, now_s: f64) -> [f64; STARTS.len()] {
    let period_s = walk.strides.map_or(0.0, |strides| strides.clock.longest_period_s(now_s));
    let mut starts = STARTS.map(|share| now_s + share * period_s);
    starts[STARTS.len() - 1] += plan.settings.swing_time_s;
    starts
}

/// Duration of a change of speed, s. To or from a stand it takes at least a stride, so that every leg takes part.
fn ramp_s(plan: &HorsePlan, walk: &Walk, from: Velocity, to: Velocity) -> f64 {
    let stride_s = walk.strides.map_or(0.0, |strides| strides.clock.settled_period_s());
    let is_start_or_stop = from.is_still() != to.is_still();
    plan.ramp_s(from, to).max(if is_start_or_stop { stride_s } else { 0.0 })
}

/// `walk` with its speed changed to `velocity` as soon as possible, by one of the ways that this cycle tries.
fn change_speed(
    plan: &HorsePlan,
    walk: &Walk,
    now_s: f64,
    velocity: Velocity,
    reach: &Reachable,
    search: &mut Search,
) -> Option<Walk> {
    // The way that ends first is tried first.
    let shortest_s = ramp_s(plan, walk, walk.velocity(now_s), velocity);
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
        let ramp_s = stretch * ramp_s(plan, walk, changed.profile.settled(), velocity);
        if changed.profile.ramp_to(velocity, ramp_s)
            && changed.stays_in_reach(now_s, reach, &mut search.looked)
        {
            return Some(changed);
        }
    }
    None
}

/// `walk` with its gait changed as `change` says from `start_s` on, and then its speed to `velocity`; `None` if
/// its profile has no room.
fn change_gait(
    plan: &HorsePlan,
    walk: &Walk,
    (now_s, start_s): (f64, f64),
    change: &Change,
    gait: usize,
    velocity: Velocity,
) -> Option<Walk> {
    let Strides { clock, to: from, .. } = walk.strides?;
    let settings = &plan.settings;
    let mut changed = walk.clone();
    let profile = &mut changed.profile;
    *profile = profile.until(now_s, start_s);
    let is_whole =
        profile.ramp_to(change.velocity, change.stretch * plan.ramp_s(profile.settled(), change.velocity));
    let change_s = profile.settled_s().max(now_s);
    let clock = clock.change_to(&settings.gaits[gait], settings.swing_time_s, change_s, change.strides);
    let is_whole = is_whole
        && profile.wait_until(clock.change_end_s())
        && profile.ramp_to(velocity, change.stretch * plan.ramp_s(change.velocity, velocity));
    changed.strides = Some(Strides::new(plan, clock, from, gait, false));
    is_whole.then_some(changed)
}
