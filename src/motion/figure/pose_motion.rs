//! How a figure holds its trunk over its feet, and how it goes from one pose to the next.

use glam::{DQuat, DVec3};

use super::FigurePlan;
use super::quintic::QuinticMove;
use crate::model::Robot;
use crate::motion::legged::{LeggedMotion, STAND_S};
use crate::motion::{Activity, Order, pose_change};
use crate::signals::{FootTarget, State, Targets};

/// Posture of the trunk, relative to standing level at its standing height.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct TrunkPosture {
    /// Height above the standing height, m.
    pub rise_m: f64,
    /// Pitch, nose down, rad.
    pub pitch_rad: f64,
    /// Roll, left side up, rad.
    pub roll_rad: f64,
    /// Distance to the left of the middle between its feet, m.
    pub sway_m: f64,
    /// Distance forward of that middle, m.
    pub forward_m: f64,
}

impl TrunkPosture {
    /// Rotation of the trunk, from the body frame to the level one.
    pub fn trunk_orientation(&self) -> DQuat {
        DQuat::from_rotation_y(self.pitch_rad) * DQuat::from_rotation_x(self.roll_rad)
    }

    /// Writes the positions of the feet of `legs` (left, right), flat on the ground at `soles`, for a trunk
    /// in this posture, counted from the height `height_m`.
    pub fn write(&self, legs: [usize; 2], soles: [DVec3; 2], height_m: f64, targets: &mut Targets) {
        targets.trunk_in_world = DVec3::new(self.forward_m, self.sway_m, height_m + self.rise_m);
        targets.trunk_orientation = self.trunk_orientation();
        let to_body = targets.trunk_orientation.inverse();
        let trunk_in_world = targets.trunk_in_world;
        let on_feet = targets.set_soles();
        for (chain, in_world) in legs.into_iter().zip(soles) {
            on_feet.feet.push(FootTarget {
                chain,
                in_world,
                plane_distance_m: self.forward_m,
                load_share: 1.0,
                ..FootTarget::default()
            });
            if let (Some(tip), Some(turn)) =
                (on_feet.tips_in_body.get_mut(chain), on_feet.sole_orientations.get_mut(chain))
            {
                *tip = to_body * (in_world - trunk_in_world);
                *turn = to_body;
            }
        }
    }
}

/// A figure on its feet.
#[derive(Debug, Clone)]
pub struct PoseMotion {
    plan: FigurePlan,
    /// The present or next pose, index into the plan's.
    pose: usize,
    /// Rise, pitch, roll, sway and forward of [`TrunkPosture`].
    trunk: [QuinticMove; 5],
    /// Every joint; the legs' are not used.
    joints: Vec<QuinticMove>,
    /// Time since it left for its pose, and the duration of the way, s.
    time_s: f64,
    duration_s: f64,
    /// Largest speed of a joint on the way, rad/s.
    rate_rad_s: Vec<f64>,
}

/// Share of a joint's speed limit that the way to a pose uses: feet that stay in place demand more of the
/// legs than the straight way from pose to pose.
const RATE_SHARE: f64 = 0.7;

impl PoseMotion {
    /// A standing figure.
    pub fn standing(robot: &Robot, plan: FigurePlan) -> PoseMotion {
        let rate =
            |joint: &crate::model::Joint| RATE_SHARE * robot.safety.rate_share * joint.no_load_speed_rad_s();
        let mut pose_motion = PoseMotion {
            pose: 0,
            trunk: [QuinticMove::default(); 5],
            joints: vec![QuinticMove::default(); robot.joints.len()],
            time_s: 0.0,
            duration_s: 0.0,
            rate_rad_s: robot.joints.iter().map(rate).collect(),
            plan,
        };
        pose_motion.reset_to_stand();
        pose_motion
    }

    /// Its plan.
    pub fn plan(&self) -> &FigurePlan {
        &self.plan
    }

    /// True once it is in its pose.
    pub fn is_still(&self) -> bool {
        self.time_s >= self.duration_s
    }

    /// Present posture of the trunk.
    pub fn stance(&self) -> TrunkPosture {
        let [rise_m, pitch_rad, roll_rad, sway_m, forward_m] =
            self.trunk.map(|glide| glide.place(self.time_s));
        TrunkPosture { rise_m, pitch_rad, roll_rad, sway_m, forward_m }
    }

    /// Starts the way to another pose.
    fn set_out(&mut self, pose: usize, state: &State) {
        let (Some(to), Some(to_rad)) = (self.plan.settings.poses.get(pose), self.plan.pose_rad.get(pose))
        else {
            return;
        };
        let slowest = state.goal_rad.iter().zip(to_rad).zip(&self.rate_rad_s);
        let least_s = slowest
            .map(|((from, to), rate)| pose_change::duration_s(&[*from], &[*to], *rate))
            .fold(0.0, f64::max);
        let duration_s = to.time_s.max(least_s);
        for (glide, end) in self.trunk.iter_mut().zip(numbers(self.plan.stance(pose))) {
            glide.turn_to(self.time_s, end, duration_s);
        }
        for (glide, end) in self.joints.iter_mut().zip(&to.angles_rad) {
            glide.turn_to(self.time_s, *end, duration_s);
        }
        (self.pose, self.time_s, self.duration_s) = (pose, 0.0, duration_s);
    }
}

/// The numbers of a stance, in the order of [`PoseMotion::trunk`].
fn numbers(stance: TrunkPosture) -> [f64; 5] {
    [stance.rise_m, stance.pitch_rad, stance.roll_rad, stance.sway_m, stance.forward_m]
}

impl LeggedMotion for PoseMotion {
    /// Index of a pose.
    type Command = usize;

    fn command(&self, order: Order, since_s: f64, move_for_s: f64) -> Option<usize> {
        match order {
            Order::Stop | Order::StopAtOnce => None,
            Order::Take(pose) => Some(pose),
            // A figure does not walk and has no strokes.
            Order::Drive(_) | Order::Perform(_) => Some(0),
            Order::Go if since_s < STAND_S => Some(0),
            Order::Go if since_s < STAND_S + move_for_s => Some(self.plan.pose),
            Order::Go => None,
        }
    }

    fn step(&mut self, dt_s: f64, state: &State, command: Option<usize>) {
        self.time_s += dt_s;
        let wanted = command.unwrap_or(0);
        if wanted != self.pose {
            self.set_out(wanted, state);
        }
    }

    fn reset_to_stand(&mut self) {
        (self.pose, self.time_s, self.duration_s) = (0, 0.0, 0.0);
        self.trunk = numbers(self.plan.stance(0)).map(QuinticMove::at);
        let angles = self.plan.settings.poses.first().map_or(&[][..], |stand| &stand.angles_rad);
        for (glide, angle) in self.joints.iter_mut().zip(angles) {
            *glide = QuinticMove::at(*angle);
        }
    }

    fn is_standing(&self) -> bool {
        self.pose == 0 && self.is_still()
    }

    fn activity(&self) -> Activity {
        if self.is_still() { Activity::Standing } else { Activity::Performing }
    }

    fn set_down_s(&self) -> f64 {
        self.plan.settings.set_down_s
    }

    fn sit_pose_rad(&self) -> &[f64] {
        &self.plan.sit_pose_rad
    }

    fn heights_m(&self) -> (f64, f64) {
        (self.plan.settings.sit_height_m, self.plan.settings.stand_height_m)
    }

    fn pose(&self) -> Option<usize> {
        Some(self.pose)
    }

    fn write(&self, height_m: f64, targets: &mut Targets) {
        for (angle, glide) in targets.set_soles().pose_rad.iter_mut().zip(&self.joints) {
            *angle = glide.place(self.time_s);
        }
        let mut stance = self.stance();
        let (sit_m, stand_m) = self.heights_m();
        // On the way up from sitting its middle moves from above the sitting feet to above the standing feet.
        if let Some(stand_forward_m) = self.plan.forward_m.first().filter(|_| stand_m > sit_m) {
            let share = (stand_m - height_m) / (stand_m - sit_m);
            stance.forward_m += share * (self.plan.sit_forward_m - stand_forward_m);
        }
        stance.write(self.plan.settings.legs, self.plan.soles, height_m, targets);
    }
}
