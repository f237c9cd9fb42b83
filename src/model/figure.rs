//! A human figure that stands on two feet: what a robot file says of it beyond its joints.

/// Settings of a figure.
#[derive(Debug, Clone, PartialEq)]
pub struct FigureMotion {
    /// Chains that are the legs: left, right.
    pub legs: [usize; 2],
    /// The chain that is its head, which a fall is to spare; none of a figure without.
    pub head: Option<usize>,
    /// Height of the body frame's origin above the ground when standing, m.
    pub stand_height_m: f64,
    /// The same when sitting, from which it stands up, m.
    pub sit_height_m: f64,
    /// How far before the end of its range a joint begins to be slowed down, rad; of a ball joint, the turn of its
    /// swing.
    pub soft_stop_rad: f64,
    /// How long it stands still once it has risen, s: it has done so in somebody's hands, and is to be set down and let go.
    pub set_down_s: f64,
    /// The poses it knows by name; the first is [`FigurePose::STAND`].
    pub poses: Vec<FigurePose>,
}

/// A pose: how the trunk is carried over both feet, and where the joints are that are not the legs'.
#[derive(Debug, Clone, PartialEq)]
pub struct FigurePose {
    /// Name used in files and options.
    pub name: String,
    /// Time to get there, s; joints that are too slow for it take longer.
    pub time_s: f64,
    /// Height of the body frame's origin above the ground, m.
    pub height_m: f64,
    /// Nose down, rad.
    pub pitch_rad: f64,
    /// Left side up, rad.
    pub roll_rad: f64,
    /// To the left of the middle between its feet, m.
    pub sway_m: f64,
    /// Angles of all joints, rad; those of the legs mean nothing.
    pub angles_rad: Vec<f64>,
}

impl FigurePose {
    /// Name of the pose it stands in, which every figure has.
    pub const STAND: &str = "stand";
}
