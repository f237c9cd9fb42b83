//! The true motion of a robot, and the forces that push it.

/// The true state of a body after a step. World frame: origin on the ground under the start, x forward, y
/// left, z up.
#[derive(Debug, Clone, PartialEq)]
pub struct BodyState {
    /// Origin of the trunk's frame, world frame, m.
    pub position_m: [f64; 3],
    /// Height of that origin above the ground's plane, ignoring steps, m.
    pub height_m: f64,
    /// Rotation from the trunk's frame to the world's: unit quaternion x, y, z, w.
    pub rotation: [f64; 4],
    /// Velocity of the trunk frame's origin, world frame, m/s.
    pub velocity_m_s: [f64; 3],
    /// Angular rate of the trunk in its own frame, rad/s: as a gyroscope in it would measure.
    pub rate_rad_s: [f64; 3],
    /// Acceleration less gravity of the trunk frame's origin, in the trunk's frame, mean of the step, m/s^2:
    /// as an accelerometer there would measure; (0, 0, 9.81) at rest.
    pub specific_force_m_s2: [f64; 3],
    /// Each foot, in the order of the chains that have one.
    pub feet: Vec<FootState>,
    /// Force of the ground on the trunk along the ground's normals, N; 0 off the ground.
    pub trunk_contact_n: f64,
    /// Force of the ground on links other than feet, along the ground's normals, N.
    pub links_contact_n: f64,
    /// Impulse of the ground on the trunk along the ground's normals, since the start, N s.
    pub trunk_impulse_ns: f64,
    /// Impulse of the ground on the links of each chain other than its foot, along the ground's normals, since the
    /// start, N s.
    pub chain_impulses_ns: Vec<f64>,
    /// True while hands hold the trunk.
    pub is_held: bool,
    /// Angular impulse of motor and rotor that passed through each joint's gears since the start, N m s, in
    /// the order of the configuration. Excludes gear friction and mechanical stops.
    pub joint_impulses_nms: Vec<f64>,
    /// False once a number is no longer finite; the body stands still from then on.
    pub is_finite: bool,
}

/// One foot.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct FootState {
    /// Index of its chain in the configuration.
    pub chain: usize,
    /// Middle of the sole, world frame, m.
    pub position_m: [f64; 3],
    /// Force of the ground on it along the ground's normals, mean of the step, N; 0 in the air.
    pub force_n: f64,
}

/// The axes in which a push's force is given.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum PushFrame {
    /// The trunk's.
    #[default]
    Trunk,
    /// The world's.
    World,
}

/// A force on the trunk.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Push {
    /// N, in the axes of `frame`.
    pub force_n: [f64; 3],
    /// Axes of the force.
    pub frame: PushFrame,
    /// Where on the trunk it acts, trunk's frame, m.
    pub place_m: [f64; 3],
}

impl BodyState {
    /// Roll, pitch and yaw of the trunk, rad (REP-103: about x, then y, then z, all fixed): positive roll lowers the
    /// right side, positive pitch the nose.
    pub fn roll_pitch_yaw(&self) -> (f64, f64, f64) {
        let [x, y, z, w] = self.rotation;
        let roll = (2.0 * (w * x + y * z)).atan2(1.0 - 2.0 * (x * x + y * y));
        let pitch = (2.0 * (w * y - z * x)).clamp(-1.0, 1.0).asin();
        let yaw = (2.0 * (w * z + x * y)).atan2(1.0 - 2.0 * (y * y + z * z));
        (roll, pitch, yaw)
    }

    /// True if the trunk lies on the ground or is turned over.
    pub fn is_fallen(&self) -> bool {
        let [x, y, ..] = self.rotation;
        // The trunk's z axis more than 60 degrees from upright.
        self.trunk_contact_n > 0.0 || 1.0 - 2.0 * (x * x + y * y) < 0.5
    }
}
