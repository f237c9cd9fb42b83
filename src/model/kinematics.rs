//! Positions of a chain's joints and tip for given joint angles, and the meaning of a joint's count.

use glam::{DQuat, DVec3};

use super::tendon::SectionBend;
use super::{Chain, GROUPS, Joint, Robot, Servo, TendonDrive};

impl Robot {
    /// The joints of `chain`, root first.
    pub fn joints_of(&self, chain: &Chain) -> &[Joint] {
        &self.joints[chain.joints.clone()]
    }

    /// Tip of `chain` in the body frame, m, for the chain's joint `angles` (rad, root first).
    ///
    /// A joint turns its link right-handed about its axis: with the axis on +y and the link pointing
    /// down, a bone at the cumulative angle PHI points to (-sin PHI, 0, -cos PHI), as the horse thesis
    /// draws it (Takizawa 2005, 3.2).
    pub fn tip_in_body(&self, chain: &Chain, angles: impl IntoIterator<Item = f64>) -> DVec3 {
        if let Some(drive) = &chain.tendons {
            return drive.walk(chain.root_m, chain.root_rotation, &bends_at(drive, angles), |_| {});
        }
        let (mut position, mut rotation) = (chain.root_m, chain.root_rotation);
        for (joint, angle) in self.joints_of(chain).iter().zip(angles) {
            rotation *= DQuat::from_axis_angle(joint.axis, angle);
            position += rotation * joint.link_m;
        }
        position
    }

    /// Positions of the joints of `chain` and, last, of its tip, body frame, m, for the same `angles`.
    pub fn places_in_body(&self, chain: &Chain, angles: impl IntoIterator<Item = f64>) -> Vec<DVec3> {
        let mut places = Vec::new();
        self.write_places_in_body(chain, angles, &mut places);
        places
    }

    /// Writes the same into `places`, and replaces its contents.
    pub fn write_places_in_body(
        &self,
        chain: &Chain,
        angles: impl IntoIterator<Item = f64>,
        places: &mut Vec<DVec3>,
    ) {
        chain.write_places_in_body(self.joints_of(chain), angles, places);
    }

    /// Mass of the whole robot, kg.
    pub fn mass_kg(&self) -> f64 {
        self.trunk_mass_kg + self.joints.iter().map(|joint| joint.mass_kg).sum::<f64>()
    }

    /// Centre of mass for these `angles` of all joints (rad), body frame, m. For arms on tendons, only the
    /// trunk counts.
    pub fn center_of_mass_in_body(&self, angles: &[f64]) -> DVec3 {
        let (mut mass, mut moment) = (self.trunk_mass_kg, self.trunk_mass_kg * self.trunk_center_m);
        for chain in self.chains.iter().filter(|chain| chain.tendons.is_none()) {
            let (mut position, mut rotation) = (chain.root_m, chain.root_rotation);
            for (joint, angle) in self.joints_of(chain).iter().zip(&angles[chain.joints.clone()]) {
                rotation *= DQuat::from_axis_angle(joint.axis, *angle);
                moment += joint.mass_kg * (position + rotation * joint.center_m);
                mass += joint.mass_kg;
                position += rotation * joint.link_m;
            }
        }
        moment / mass
    }

    /// Lowest and highest coordinates of the limbs' roots, body frame, m: the extent of the trunk.
    pub fn root_extent(&self) -> (DVec3, DVec3) {
        let roots = || self.chains.iter().map(|chain| chain.root_m);
        let low = roots().reduce(DVec3::min).unwrap_or_default();
        let high = roots().reduce(DVec3::max).unwrap_or_default();
        (low, high)
    }

    /// Length of one cycle of the loop, s.
    pub fn period_s(&self) -> f64 {
        1.0 / self.rate_hz
    }

    /// The same robot, with a slower loop if a cycle would take less than `period_s`.
    pub(crate) fn with_period_of_at_least(&self, period_s: f64) -> Robot {
        Robot { rate_hz: self.rate_hz.min(1.0 / period_s), ..self.clone() }
    }
}

/// The bends of an arm on tendons at these turns of its winches.
fn bends_at(drive: &TendonDrive, angles: impl IntoIterator<Item = f64>) -> [SectionBend; GROUPS] {
    let (mut winches, mut bends) = ([0.0; 2 * GROUPS], [SectionBend::default(); GROUPS]);
    for (winch, angle) in winches.iter_mut().zip(angles) {
        *winch = angle;
    }
    drive.bends(&winches, &mut bends);
    bends
}

impl Chain {
    /// Writes the positions of its `joints` and, last, of its tip, body frame, m, for the same `angles` as
    /// [`Robot::tip_in_body`], into `places`, and replaces its contents.
    pub fn write_places_in_body(
        &self,
        joints: &[Joint],
        angles: impl IntoIterator<Item = f64>,
        places: &mut Vec<DVec3>,
    ) {
        let (mut position, mut rotation) = (self.root_m, self.root_rotation);
        places.clear();
        places.push(position);
        if let Some(drive) = &self.tendons {
            drive.walk(position, rotation, &bends_at(drive, angles), |joint| places.push(joint.end));
            return;
        }
        for (joint, angle) in joints.iter().zip(angles) {
            rotation *= DQuat::from_axis_angle(joint.axis, angle);
            position += rotation * joint.link_m;
            places.push(position);
        }
    }

    /// Length of the stretched chain, m.
    pub fn length_m(&self, joints: &[Joint]) -> f64 {
        if let Some(drive) = &self.tendons {
            return drive.length_m();
        }
        joints.iter().map(|joint| joint.link_m.length()).sum()
    }
}

/// Distance of a joint's mechanical stop beyond its range: this share of the range's width, or this angle if
/// larger, rad.
const STOP_SHARE: f64 = 0.1;
const STOP_RAD: f64 = 0.035;

/// Play, sag and the horn's error may take a limp joint out of its range by this much, rad.
pub(crate) const ALMOST_INSIDE_RAD: f64 = 0.1;

impl Joint {
    /// Middle of the joint's range, rad.
    pub fn middle_rad(&self) -> f64 {
        0.5 * (self.range_rad.0 + self.range_rad.1)
    }

    /// The permitted range for goals, rad: the joint's own, rounded inward to whole counts of its servo and
    /// limited to the servo's own count range, so that rounding a goal to a count never leaves the range.
    pub fn goal_range_rad(&self) -> (f64, f64) {
        let Some(servo) = &self.servo else { return self.range_rad };
        let (a, b) = (servo.count_of(self.range_rad.0), servo.count_of(self.range_rad.1));
        let (low, high) = servo.model.count_range;
        // The small tolerance keeps a limit that is a whole count from losing one to rounding error.
        let lowest = (a.min(b) - 1e-9).ceil().max(f64::from(low));
        let highest = (a.max(b) + 1e-9).floor().min(f64::from(high));
        let (p, q) = (servo.angle_of(lowest), servo.angle_of(highest));
        (p.min(q), p.max(q))
    }

    /// The angle, rad, from which the first goals of a limp joint go that is measured at `position_rad`: that angle,
    /// or the end of its range if it hangs just outside.
    pub fn start_goal_rad(&self, position_rad: f64) -> f64 {
        let (low, high) = self.goal_range_rad();
        let inside_rad = position_rad.clamp(low, high);
        if (position_rad - inside_rad).abs() <= ALMOST_INSIDE_RAD { inside_rad } else { position_rad }
    }

    /// The joint's mechanical stops, rad: a tenth of its range beyond it, at least two degrees. They are not
    /// measured; a range should end before them.
    pub fn stops_rad(&self) -> (f64, f64) {
        let (low, high) = self.range_rad;
        let beyond_rad = STOP_RAD.max(STOP_SHARE * (high - low));
        (low - beyond_rad, high + beyond_rad)
    }

    /// The angles within the servo's count range, rad; unlimited for a joint without a servo.
    pub fn servo_range_rad(&self) -> (f64, f64) {
        let Some(servo) = &self.servo else { return (f64::NEG_INFINITY, f64::INFINITY) };
        let (low, high) = servo.model.count_range;
        let (a, b) = (servo.angle_of(f64::from(low)), servo.angle_of(f64::from(high)));
        (a.min(b), a.max(b))
    }

    /// No-load speed of the servo, rad/s; infinite for a joint without a servo.
    pub fn no_load_speed_rad_s(&self) -> f64 {
        self.servo.as_ref().map_or(f64::INFINITY, |servo| servo.model.no_load_speed_rad_s)
    }
}

impl Servo {
    /// Counts per radian; negative if the servo is mounted reversed.
    fn counts_per_rad(&self) -> f64 {
        let magnitude = self.model.counts_per_turn / std::f64::consts::TAU;
        if self.reversed { -magnitude } else { magnitude }
    }

    /// The count, not rounded, at the joint angle `rad`.
    pub fn count_of(&self, rad: f64) -> f64 {
        self.zero_count + rad * self.counts_per_rad()
    }

    /// The joint angle at `count`, rad.
    pub fn angle_of(&self, count: f64) -> f64 {
        (count - self.zero_count) / self.counts_per_rad()
    }

    /// The joint speed for a speed register that reads `speed`, rad/s.
    pub fn speed_of(&self, speed: i32) -> f64 {
        f64::from(speed) * self.model.speed_unit_rad_s * self.counts_per_rad().signum()
    }

    /// The angle of one count, rad.
    pub fn count_rad(&self) -> f64 {
        1.0 / self.counts_per_rad().abs()
    }
}
