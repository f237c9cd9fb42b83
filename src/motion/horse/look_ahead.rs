//! Checks a plan to its end: does every foot stay in its reach, stand long enough, swing slowly enough?

use super::SHORTEST_STANCE;
use super::reach_table::Reachable;
use super::walk::{Foot, Leg, Strides, Walk};

/// Instants at which a swing is checked, in addition to its turning points.
const SWING_INSTANTS: u32 = 16;
/// A plan with more steps of one leg than this counts as too long to check.
const EVENTS: u32 = 400;
/// Most stances and swings of all legs that are checked in one plan.
#[cfg(test)]
pub(super) const PLAN_LOOKS_MAX: u32 = 4 * EVENTS;

impl Walk {
    /// True if, from `from_s` on, the plan keeps every foot within `reach`, and every foot that lands stands
    /// at least for the shortest stance. `looked` counts the stances and swings checked.
    pub(super) fn stays_in_reach(&self, from_s: f64, reach: &Reachable, looked: &mut u32) -> bool {
        let Some(strides) = self.strides else { return true };
        let clock = &strides.clock;
        let settled_s = self.profile.settled_s().max(clock.change_end_s());
        // A foot that lifts when all is settled lands in a steady stride; by then it has landed and lifts
        // once more.
        let until_s = settled_s.max(from_s) + 2.0 * clock.longest_period_s(from_s);
        (0..4).all(|index| self.leg_stays_in_reach(&strides, index, (from_s, until_s), reach, looked))
    }

    fn leg_stays_in_reach(
        &self,
        strides: &Strides,
        index: usize,
        (from_s, until_s): (f64, f64),
        reach: &Reachable,
        looked: &mut u32,
    ) -> bool {
        let mut leg = self.legs[index];
        let mut now_s = from_s;
        for _ in 0..EVENTS {
            let event = self.next_event(strides, index, &leg);
            let end_s = event.map_or(until_s, |(at_s, _)| at_s);
            *looked += 1;
            if !self.part_stays_in_reach(&leg, index, now_s, end_s, reach) {
                return false;
            }
            if let (Foot::Stance { since_s, .. }, Some((lifted_s, _))) = (leg.foot, event)
                && lifted_s - since_s < SHORTEST_STANCE * self.swing.time_s
            {
                return false;
            }
            match event {
                Some((at_s, after)) if at_s < until_s => (now_s, leg) = (at_s, after),
                _ => return true,
            }
        }
        false
    }

    /// True if the foot of `leg`, number `index`, stays in its reach from `from_s` to `to_s`, between two events.
    fn part_stays_in_reach(
        &self,
        leg: &Leg,
        index: usize,
        from_s: f64,
        to_s: f64,
        reach: &Reachable,
    ) -> bool {
        let is_in_reach = |s: f64| reach.holds(index, self.excursion_m(leg, s), self.up_m(leg, s));
        let mut all = is_in_reach(from_s) && is_in_reach(to_s);
        match leg.foot {
            Foot::Stance { .. } => {
                self.profile.for_turning_points(leg.side_m, from_s, to_s, |s| all = all && is_in_reach(s));
            }
            Foot::Swing { lifted_s, from_m, to_m } => {
                let instants = (1..SWING_INSTANTS).map(|instant| {
                    lifted_s + self.swing.time_s * f64::from(instant) / f64::from(SWING_INSTANTS)
                });
                all = all && self.swings_slowly_enough(leg, lifted_s, to_m - from_m, from_s);
                // The swing's furthest points: there the foot is as fast as its root.
                let landed_s = lifted_s + self.swing.time_s;
                let fast_s = |s: f64| {
                    self.swing.catch_up_s(to_m - from_m, self.profile.velocity_at(s).at_side_m_s(leg.side_m))
                };
                let furthest = [lifted_s + fast_s(lifted_s), landed_s - fast_s(landed_s)];
                all =
                    all && instants.chain(furthest).filter(|s| *s > from_s && *s < landed_s).all(is_in_reach);
            }
        }
        all
    }

    /// True if the foot of `leg` in its swing of `distance_m` is never too fast relative to the trunk from `from_s` on.
    fn swings_slowly_enough(&self, leg: &Leg, lifted_s: f64, distance_m: f64, from_s: f64) -> bool {
        let Some(Strides { swing_speed_max_m_s, .. }) = self.strides else { return true };
        let fastest_m_s = self.swing.fastest_m_s(distance_m);
        // It is fastest between the ramps; the trunk's speed is a straight line there, or nearly so.
        let (begins, ends) = (self.swing.ramp_share, 1.0 - self.swing.ramp_share);
        [begins, 0.5, ends].into_iter().map(|u| lifted_s + u * self.swing.time_s).filter(|s| *s > from_s).all(
            |s| {
                let trunk_m_s = self.profile.velocity_at(s).at_side_m_s(leg.side_m);
                (fastest_m_s - trunk_m_s).abs() <= swing_speed_max_m_s
            },
        )
    }
}
