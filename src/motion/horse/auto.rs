//! The gait that fits the speed.
//!
//! A horse goes faster in its present gait up to the Froude number V^2 / (g h) of that gait, or nine tenths
//! of its top speed in it, whichever is lower; there it takes the next gait. It returns to the slower one
//! well below, so that a speed near the border does not make it change to and fro.

use super::HorsePlan;
use super::planner::Request;
use super::profile::Velocity;

/// Standard gravity, m/s^2.
const GRAVITY_M_S2: f64 = 9.80665;
/// Share of a gait's top speed at which the horse leaves it for a faster one.
const TOP_SHARE: f64 = 0.9;
/// Share of that border below which the horse takes the slower gait again.
const BACK_SHARE: f64 = 0.8;
/// Share of the border that counts as having reached it.
const REACHED_SHARE: f64 = 0.99;

/// The request of a horse that goes at `velocity`, in the gait with index `present` or standing, and should go at
/// `wanted`, with the gait chosen by speed.
pub(super) fn request(
    plan: &HorsePlan,
    present: Option<usize>,
    velocity: Velocity,
    wanted: Velocity,
    reach_m: f64,
) -> Request {
    if wanted.is_still() {
        return Request { gait: None, velocity: Velocity::STILL };
    }
    let ladder = |rung: usize| plan.ladder().nth(rung);
    let Some(first) = ladder(0) else { return Request { gait: None, velocity: Velocity::STILL } };
    // From a stand, or a gait outside the ladder, start at the bottom of the ladder.
    let rung = plan.ladder().position(|gait| Some(gait) == present).unwrap_or(0);
    let gait = ladder(rung).unwrap_or(first);
    let border_m_s = |gait: usize| border_m_s(plan, gait, wanted, reach_m);
    let (now_m_s, wanted_m_s) = (plan.fastest_plane_m_s(velocity), plan.fastest_plane_m_s(wanted));

    let slower = rung.checked_sub(1).and_then(ladder);
    if let Some(slower) = slower
        && wanted_m_s < BACK_SHARE * border_m_s(slower)
    {
        let border_m_s = BACK_SHARE * border_m_s(slower);
        return if now_m_s <= border_m_s {
            limited(plan, slower, wanted, reach_m)
        } else {
            limited(plan, gait, wanted, reach_m)
        };
    }
    match ladder(rung + 1) {
        Some(faster) if wanted_m_s > border_m_s(gait) => {
            if present.is_some() && now_m_s >= REACHED_SHARE * border_m_s(gait) {
                limited(plan, faster, wanted, reach_m)
            } else {
                limited(plan, gait, plan.slowed_to(wanted, border_m_s(gait)), reach_m)
            }
        }
        _ => limited(plan, gait, wanted, reach_m),
    }
}

fn limited(plan: &HorsePlan, gait: usize, wanted: Velocity, reach_m: f64) -> Request {
    Request { gait: Some(gait), velocity: plan.limited(gait, wanted, reach_m) }
}

/// Speed above which the horse leaves the gait with index `gait` for the next faster one, m/s.
fn border_m_s(plan: &HorsePlan, gait: usize, wanted: Velocity, reach_m: f64) -> f64 {
    let settings = &plan.settings;
    let froude = settings.gaits[gait].auto_froude_max.unwrap_or(f64::INFINITY);
    let by_froude_m_s = (froude * GRAVITY_M_S2 * settings.stand_height_m).sqrt();
    by_froude_m_s.min(TOP_SHARE * plan.top_m_s(gait, wanted.speed_m_s, reach_m))
}
