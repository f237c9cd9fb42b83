//! Settings for a robot's reaction to a fall, and to a load on a limb beyond its limit.

/// How the robot reacts to a fall.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ReflexMode {
    /// The key poses for its direction, then compliant joints.
    #[default]
    Reflex,
    /// No torque from the moment a fall is certain: a completely passive drop, for comparison.
    Passive,
    /// No reaction: the fall is recorded and the motion continues.
    Off,
}

/// The condition under which a fall counts as certain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Detector {
    /// |roll + T p| or |pitch + T q| beyond its limit: the trunk's attitude after a time T at its present
    /// rate.
    Lean {
        /// Limit on roll, rad.
        roll_rad: f64,
        /// Limit on pitch, rad.
        pitch_rad: f64,
        /// T, s.
        ahead_s: f64,
    },
    /// The magnitude of the trunk's roll and pitch rates together is above this, rad/s.
    Rate(f64),
}

/// Direction of a fall, by the largest component of the trunk's angular velocity.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FallDirection {
    /// Nose first: positive pitch rate.
    Forward,
    /// Negative pitch rate.
    Backward,
    /// Negative roll rate.
    Left,
    /// Positive roll rate.
    Right,
    /// More about the vertical than about either horizontal axis.
    Twisting,
}

impl FallDirection {
    /// All directions, in the order of [`ReflexSettings::falls`].
    pub const ALL: [FallDirection; 5] = [
        FallDirection::Forward,
        FallDirection::Backward,
        FallDirection::Left,
        FallDirection::Right,
        FallDirection::Twisting,
    ];

    /// Its name in files and reports.
    pub fn name(self) -> &'static str {
        match self {
            FallDirection::Forward => "forward",
            FallDirection::Backward => "backward",
            FallDirection::Left => "left",
            FallDirection::Right => "right",
            FallDirection::Twisting => "twisting",
        }
    }
}

/// The side of the robot that is down when it lies.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Lying {
    /// The underside: a horse on its belly, a figure that sits.
    Upright,
    /// The front: a figure on its face.
    Front,
    /// The back end: a figure on its back.
    Back,
    /// The left side.
    Left,
    /// The right side.
    Right,
    /// The top: turned over.
    Over,
}

impl Lying {
    /// All of them.
    pub const ALL: [Lying; 6] =
        [Lying::Upright, Lying::Front, Lying::Back, Lying::Left, Lying::Right, Lying::Over];

    /// Its name in files.
    pub fn name(self) -> &'static str {
        match self {
            Lying::Upright => "upright",
            Lying::Front => "front",
            Lying::Back => "back",
            Lying::Left => "left",
            Lying::Right => "right",
            Lying::Over => "over",
        }
    }

    /// Its description in words.
    pub fn words(self) -> &'static str {
        match self {
            Lying::Upright => "upright",
            Lying::Front => "on its front",
            Lying::Back => "on its back",
            Lying::Left => "on its left side",
            Lying::Right => "on its right side",
            Lying::Over => "upside down",
        }
    }
}

/// A pose and its time in a motion.
#[derive(Debug, Clone, PartialEq)]
pub struct KeyPose {
    /// Time at which it should be reached, s since the motion began.
    pub at_s: f64,
    /// Angles of all joints, rad.
    pub angles_rad: Vec<f64>,
    /// Torque on the way there, share of what is permitted, 0 to 1; at 0 the robot is limp on the way.
    pub torque_share: f64,
}

/// How the robot gets up from one lying position.
#[derive(Debug, Clone, PartialEq)]
pub struct GetUp {
    /// The lying position.
    pub lying: Lying,
    /// Key poses to go through; then it gets up as from limp. May be empty.
    pub keys: Vec<KeyPose>,
}

/// Settings of the reaction to a fall.
#[derive(Debug, Clone, PartialEq)]
pub struct ReflexSettings {
    /// Kind of reaction.
    pub mode: ReflexMode,
    /// Condition for a certain fall.
    pub detector: Detector,
    /// Key poses by direction, in the order of [`FallDirection::ALL`]; if empty, the joints give way at once.
    pub falls: [Vec<KeyPose>; 5],
    /// Torque while joints give way, share of what is permitted, 0 < s <= 1.
    pub passive_torque_share: f64,
    /// The trunk is at rest while it turns slower than this, rad/s.
    pub rest_rate_rad_s: f64,
    /// Time for which it must be at rest, s.
    pub rest_s: f64,
    /// Lying positions from which it can get up, and how.
    pub get_ups: Vec<GetUp>,
    /// Largest number of attempts to get up in one run.
    pub get_ups_max: u32,
}

/// How an arm reacts to a load beyond its limit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct YieldSettings {
    /// Largest permitted load of any of its joints, share of stall torque, 0 < s < 1.
    pub load_share: f64,
    /// Time for which more is tolerated, s.
    pub after_s: f64,
    /// Torque while its joints give way, share of what is permitted, 0 < s <= 1.
    pub torque_share: f64,
    /// Shortest time for which it gives way, s.
    pub for_s: f64,
    /// Time it takes to return, s.
    pub return_s: f64,
}
