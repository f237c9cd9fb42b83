//! What a robot does when it falls, and when a limb is loaded beyond its limit: settings.

/// What a fall is met with.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ReflexMode {
    /// The key poses of its direction, then joints that give way.
    #[default]
    Reflex,
    /// No torque from the moment a fall is certain: the completely passive drop, to compare with.
    Passive,
    /// Nothing: a fall is noted, and the motion goes on.
    Off,
}

/// When a fall counts as certain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Detector {
    /// |roll + T p| or |pitch + T q| past its limit: where the trunk will be in a time T at its present rate.
    Lean {
        /// Limit of the first, rad.
        roll_rad: f64,
        /// Limit of the second, rad.
        pitch_rad: f64,
        /// T, s.
        ahead_s: f64,
    },
    /// The size of the trunk's roll and pitch rates together past this, rad/s.
    Rate(f64),
}

/// Which way it falls, by the largest component of the trunk's angular velocity.
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
    /// About the vertical more than about either.
    Twisting,
}

impl FallDirection {
    /// All of them, each at its place in [`ReflexSettings::falls`].
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

/// What is down when it lies.
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

    /// In words, for people.
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

/// A pose at a time of a motion.
#[derive(Debug, Clone, PartialEq)]
pub struct KeyPose {
    /// When it is to be reached, s since the motion began.
    pub at_s: f64,
    /// Angles of all joints, rad.
    pub angles_rad: Vec<f64>,
    /// Torque on the way there, share of what is permitted, 0 to 1; at 0 it is limp meanwhile.
    pub torque_share: f64,
}

/// How it gets up from one way of lying.
#[derive(Debug, Clone, PartialEq)]
pub struct GetUp {
    /// From there.
    pub lying: Lying,
    /// By way of these; then as from limp. May be empty.
    pub keys: Vec<KeyPose>,
}

/// What a robot does when it falls.
#[derive(Debug, Clone, PartialEq)]
pub struct ReflexSettings {
    /// With what a fall is met.
    pub mode: ReflexMode,
    /// When it is certain.
    pub detector: Detector,
    /// Key poses by direction, in the order of [`FallDirection::ALL`]; none: its joints give way at once.
    pub falls: [Vec<KeyPose>; 5],
    /// Torque with which joints give way, share of what is permitted, 0 < s <= 1.
    pub passive_torque_share: f64,
    /// The trunk rests while it turns slower than this, rad/s.
    pub rest_rate_rad_s: f64,
    /// And has for this long, s.
    pub rest_s: f64,
    /// From where it can get up, and how.
    pub get_ups: Vec<GetUp>,
    /// How often it gets up in one run.
    pub get_ups_max: u32,
}

/// What an arm does that is loaded beyond its limit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct YieldSettings {
    /// The largest load of any of its joints that is borne, share of stall torque, 0 < s < 1.
    pub load_share: f64,
    /// How long more is borne, s.
    pub after_s: f64,
    /// Torque with which its joints give way, share of what is permitted, 0 < s <= 1.
    pub torque_share: f64,
    /// How long it gives way at the least, s.
    pub for_s: f64,
    /// How long it takes to return, s.
    pub return_s: f64,
}
