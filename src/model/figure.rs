//! A human figure that stands on two feet: its settings in a robot file beyond its joints.

/// Settings of a figure.
#[derive(Debug, Clone, PartialEq)]
pub struct FigureMotion {
    /// Chains that are the legs: left, right.
    pub legs: [usize; 2],
    /// The chain of its head, which should be spared in a fall; `None` for a figure without one.
    pub head: Option<usize>,
    /// Height of the body frame's origin above the ground when standing, m.
    pub stand_height_m: f64,
    /// Height of that origin when sitting, from which the figure stands up, m.
    pub sit_height_m: f64,
    /// Distance from the end of its range at which a joint begins to slow down, rad; for a ball joint, the
    /// angle of its swing.
    pub soft_stop_rad: f64,
    /// Time for which it stands still once it has risen, s: a person holds it while it rises, and must set it
    /// down and let go.
    pub set_down_s: f64,
    /// Its named poses; the first is [`FigurePose::STAND`].
    pub poses: Vec<FigurePose>,
}

/// A pose: posture of the trunk over both feet, and angles of the joints outside the legs.
#[derive(Debug, Clone, PartialEq)]
pub struct FigurePose {
    /// Name used in files and options.
    pub name: String,
    /// Time to get there, s; longer if joints are too slow for it.
    pub time_s: f64,
    /// Height of the body frame's origin above the ground, m.
    pub height_m: f64,
    /// Pitch, nose down, rad.
    pub pitch_rad: f64,
    /// Roll, left side up, rad.
    pub roll_rad: f64,
    /// Distance to the left of the middle between its feet, m.
    pub sway_m: f64,
    /// Angles of all joints, rad; those of the legs have no effect.
    pub angles_rad: Vec<f64>,
}

impl FigurePose {
    /// Name of the standing pose, which every figure has.
    pub const STAND: &str = "stand";
}
