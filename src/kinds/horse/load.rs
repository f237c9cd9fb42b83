//! The torque that the weight asks of each joint of a horse: standing, rising and walking.
//!
//! Statics only: the ground carries the weight by friction, and acceleration and the gears' friction come on top.
//! `tests/check_against_physics.rs` holds it against the simulated body.

use std::fmt::{self, Write};

use glam::DVec3;

use super::cruise::cruise;
use super::reach::{Legs, PULL};
use crate::ik::Method;
use crate::kinds::loads::LASTING_SHARE;
use crate::model::Robot;
use crate::motion::horse::HorsePlan;
use crate::standing::{Sole, Standing, TrunkMotion};

/// Share of stall torque above which a joint fails to move the robot: the rest is for the friction of its gears, for
/// acceleration, and for turning, which takes torque from a motor. In physics a twelve-joint dog walks and trots where this
/// share is .53, and no longer gets up where it is .73.
pub const MOVING_SHARE: f64 = 0.6;
/// Friction of the ground for a robot whose file does not say.
const FRICTION: f64 = 0.8;
/// Heights between sitting and standing, moments of a stride, and strides that let the pose settle before.
const HEIGHTS: u32 = 12;
const MOMENTS: u32 = 120;
const SETTLING: u32 = 2;
/// Gaits in which the load is computed: those that a heavy robot can do at all.
const GAITS: [&str; 3] = ["walk", "walk-steady", "trot"];

/// The torques on one joint, N m, 0 or more, and the stall torque of its servo.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct LegLoad {
    /// The joint, index into [`Robot::joints`].
    pub joint: usize,
    /// Standing on four feet.
    pub standing_nm: f64,
    /// The most on the way from sitting to standing.
    pub rising_nm: f64,
    /// The most in a walk or a trot at nine tenths of its top speed.
    pub walking_nm: f64,
    /// Stall torque of its servo; 0 without one.
    pub stall_nm: f64,
}

impl LegLoad {
    /// `torque_nm` as a share of stall torque; 0 without a servo.
    fn share(&self, torque_nm: f64) -> f64 {
        if self.stall_nm > 0.0 { torque_nm / self.stall_nm } else { 0.0 }
    }

    /// The largest of its torques, as a share of stall torque.
    pub fn most(&self) -> f64 {
        self.share(self.standing_nm.max(self.rising_nm).max(self.walking_nm))
    }

    fn warning(&self) -> &'static str {
        if self.most() > MOVING_SHARE {
            "  TOO HEAVY: it will not move the robot"
        } else if self.share(self.standing_nm) > LASTING_SHARE {
            "  MORE THAN IT CAN HOLD FOR LONG"
        } else {
            ""
        }
    }
}

/// The load of every joint, in the robot's order.
pub fn of_joints(robot: &Robot, plan: &HorsePlan) -> Vec<LegLoad> {
    let soles: Vec<Sole> = soles(robot, plan);
    let friction = robot.balance.map_or(FRICTION, |balance| balance.friction);
    let mut standing = Standing::new(robot, &soles, friction);
    let mut loads: Vec<LegLoad> = robot
        .joints
        .iter()
        .enumerate()
        .map(|(joint, of)| LegLoad {
            joint,
            stall_nm: of.servo.map_or(0.0, |servo| servo.model.stall_torque_nm),
            ..LegLoad::default()
        })
        .collect();
    let on_all: Vec<f64> = vec![1.0; robot.chains.len()];
    let mut hold = |angles_rad: &[f64], shares: &[f64], note: &mut dyn FnMut(&mut LegLoad, f64)| {
        standing.solve(angles_rad, &TrunkMotion::default(), shares);
        for (load, torque_nm) in loads.iter_mut().zip(standing.torques_nm()) {
            note(load, torque_nm.abs());
        }
    };
    rise(robot, plan, |angles_rad| {
        hold(angles_rad, &on_all, &mut |load, torque_nm| {
            load.rising_nm = load.rising_nm.max(torque_nm);
            load.standing_nm = torque_nm;
        });
    });
    for gait in GAITS {
        walk(robot, plan, gait, |angles_rad, shares| {
            hold(angles_rad, shares, &mut |load, torque_nm| load.walking_nm = load.walking_nm.max(torque_nm));
        });
    }
    loads
}

/// The feet of the legs; a leg without a foot stands on its tip.
fn soles(robot: &Robot, plan: &HorsePlan) -> Vec<Sole> {
    let known = Sole::all_of(robot);
    let of_leg = |leg: usize| {
        let of_file = known.iter().find(|sole| sole.chain == leg).cloned();
        of_file.unwrap_or(Sole { chain: leg, points_m: vec![DVec3::ZERO], radius_m: 0.0 })
    };
    plan.settings.legs.into_iter().map(of_leg).collect()
}

/// Calls `see` with the joint angles at each height from sitting to standing.
fn rise(robot: &Robot, plan: &HorsePlan, mut see: impl FnMut(&[f64])) {
    let (sit_m, stand_m) = (plan.settings.sit_height_m, plan.settings.stand_height_m);
    let mut angles = plan.sit_pose_rad.clone();
    let mut legs = Legs::new(robot, &plan.settings, plan.neutral_in_body);
    for step in 0..=HEIGHTS {
        let height_m = sit_m + (stand_m - sit_m) * f64::from(step) / f64::from(HEIGHTS);
        legs.put(height_m, &mut angles, |leg, target, angles| {
            leg.solve(Method::CcdThenFinish, target, PULL, angles).residual_m
        });
        see(&angles);
    }
}

/// Calls `see` with the joint angles, and the share of the weight on each chain, over a stride of the gait of this name.
fn walk(robot: &Robot, plan: &HorsePlan, gait: &str, mut see: impl FnMut(&[f64], &[f64])) {
    let Some(gait) = plan.settings.gaits.iter().position(|of| of.name == gait) else { return };
    let speed_m_s = 0.9 * plan.paces.get(gait).map_or(0.0, |pace| pace.forward_m_s);
    if speed_m_s <= 0.0 {
        return;
    }
    let period_s = plan.settings.gaits[gait].period_s(plan.settings.swing_time_s);
    let dt_s = period_s / f64::from(MOMENTS);
    let times = (0..(SETTLING + 1) * MOMENTS).map(|moment| f64::from(moment) * dt_s);
    let mut shares = vec![0.0; robot.chains.len()];
    cruise(robot, plan, (gait, speed_m_s), dt_s, times, |s, targets, angles_rad| {
        if s >= f64::from(SETTLING * MOMENTS) * dt_s {
            shares.fill(0.0);
            for foot in targets.feet() {
                shares[foot.chain] = foot.load_share;
            }
            see(angles_rad, &shares);
        }
    });
}

/// Lines of the load of each joint with a servo, for people.
pub(super) fn write(text: &mut String, robot: &Robot, loads: &[LegLoad]) -> fmt::Result {
    if loads.iter().all(|load| load.stall_nm <= 0.0) {
        return Ok(());
    }
    writeln!(
        text,
        "\n{:<24} {:>8} {:>8} {:>8}  of its stall torque, to carry the weight",
        "load of", "standing", "rising", "walking"
    )?;
    for load in loads.iter().filter(|load| load.stall_nm > 0.0) {
        let percent = |torque_nm: f64| format!("{:.0} %", 100.0 * load.share(torque_nm));
        writeln!(
            text,
            "{:<24} {:>8} {:>8} {:>8}{}",
            robot.joints[load.joint].name,
            percent(load.standing_nm),
            percent(load.rising_nm),
            percent(load.walking_nm),
            load.warning()
        )?;
    }
    Ok(())
}
