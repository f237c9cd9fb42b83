//! Winding round a pole: the target position of the end of every link of an arm.
//!
//! The arm lies like a taut rope: straight from its root to where it touches the pole, and from there round it.
//! Winding proceeds from the root's side to the tip. The part that is not wound yet stands off straight, on the
//! tangent, clear of the pole. An arm that goes round more than once climbs, so that it does not lie on itself.

use std::f64::consts::{PI, TAU};

use glam::DVec3;
use thiserror::Error;

use crate::model::{ArmJoint, Axis, Joint, Pole, TendonDrive};

/// How far outside the grown pole the chords of the links pass, as a share of the arm's radius, so that
/// rounding never puts one inside.
const MARGIN_SHARE: f64 = 0.01;
/// Climb per turn, in diameters of the arm.
const CLIMB_DIAMETERS: f64 = 1.1;
/// An arm climbs if it winds by more than this many turns.
const CLIMB_FROM_TURNS: f64 = 0.85;
/// Number of Newton steps to find the end of a link.
const NEWTON_STEPS: u32 = 5;

/// Reasons why an arm cannot wind round a pole.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
pub enum WindingError {
    /// The root is in the pole or touches it.
    #[error(
        "the arm's root is {off_m:.3} m from the pole's axis; its skin would be inside the pole below {least_m:.3} m"
    )]
    Inside {
        /// Distance from the root to the axis, m.
        off_m: f64,
        /// Least permitted distance, m.
        least_m: f64,
    },
    /// The pole is out of reach.
    #[error("the arm is {length_m:.3} m long and would touch the pole only after {touches_m:.3} m")]
    TooFar {
        /// Length of the arm, m.
        length_m: f64,
        /// Length of arm from the root to where it would touch the pole, m.
        touches_m: f64,
    },
    /// The arm does not bend tightly enough.
    #[error(
        "the arm would have to bend to a radius of {radius_m:.3} m, and bends to no less than {least_m:.3} m"
    )]
    TooThin {
        /// Radius of the arm's path round the pole, m.
        radius_m: f64,
        /// Least bending radius of its sections, m.
        least_m: f64,
    },
    /// The pole is not a valid cylinder.
    #[error("a pole has a radius above 0 and an axis with a direction")]
    NoPole,
}

/// The least radius, m, that an arm can bend to. An arm on `tendons` is limited by its sections' largest bends;
/// any other by how far the bending hinges of each of its `joints` go to either side. `hinges` are all hinges of
/// the arm.
pub(super) fn least_radius_m(tendons: Option<&TendonDrive>, joints: &[ArmJoint], hinges: &[Joint]) -> f64 {
    // A chord of a circle of radius R turns by 2 asin(link / 2 R) against the one before.
    let radius_m = |link_m: f64, bend_rad: f64| 0.5 * link_m / (0.5 * bend_rad.min(PI)).sin();
    if let Some(drive) = tendons {
        let sections = drive.sections().iter();
        return sections
            .map(|section| radius_m(section.link_m, section.bend_max_rad / section.joints as f64))
            .fold(0.0, f64::max);
    }
    let bend_rad = |joint: &ArmJoint| {
        let bending = hinges[joint.hinges.clone()].iter().filter(|hinge| Axis::of(hinge).0 != Axis::X);
        bending.map(|hinge| hinge.range_rad.1.min(-hinge.range_rad.0)).fold(PI, f64::min).max(0.0)
    };
    // The first joint does not count: its link lies in whatever direction its root gives.
    joints.iter().skip(1).map(|joint| radius_m(joint.link_m, bend_rad(joint))).fold(0.0, f64::max)
}

/// An arm's path round a pole.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Winding {
    root_m: DVec3,
    center_m: DVec3,
    /// Vector from the axis to the root; the direction at right angles to it in the sense of winding; and the
    /// axis' direction of climb.
    out: DVec3,
    round: DVec3,
    up: DVec3,
    /// Radius of the corners of the arm's polygon, m.
    radius_m: f64,
    /// Angle from the root to the point of contact, rad, and length to there, seen along the axis, m.
    touches_rad: f64,
    straight_m: f64,
    /// Rise along the axis per metre of path seen along it.
    slope: f64,
    length_m: f64,
}

impl Winding {
    /// The path of an arm with these links round `pole`, on the side that turns its root less out of `ahead`
    /// (body frame). Its skin is pressed in by `squeeze_m`, which makes the grip.
    pub fn new(
        root_in_body: DVec3,
        ahead: DVec3,
        links_m: impl Iterator<Item = f64> + Clone,
        arm_radius_m: f64,
        pole: Pole,
        squeeze_m: f64,
    ) -> Result<Winding, WindingError> {
        let axis = pole.axis.try_normalize().ok_or(WindingError::NoPole)?;
        if !(pole.radius_m > 0.0 && pole.radius_m.is_finite() && pole.point_in_body.is_finite()) {
            return Err(WindingError::NoPole);
        }
        let length_m: f64 = links_m.clone().sum();
        let longest_m = links_m.fold(0.0, f64::max);
        let from_point = root_in_body - pole.point_in_body;
        let center_m = pole.point_in_body + axis * from_point.dot(axis);
        let off = root_in_body - center_m;
        let skin_m = pole.radius_m + arm_radius_m - squeeze_m + MARGIN_SHARE * arm_radius_m;
        // Chords between corners on this circle touch the grown pole in their middle.
        let radius_m = skin_m.hypot(0.5 * longest_m);
        let off_m = off.length();
        if off_m <= radius_m {
            return Err(WindingError::Inside { off_m, least_m: radius_m });
        }
        let out = off / off_m;
        let touches_rad = (radius_m / off_m).acos();
        let straight_m = radius_m * touches_rad.tan();
        if straight_m >= length_m {
            return Err(WindingError::TooFar { length_m, touches_m: straight_m });
        }
        let left = axis.cross(out);
        let toward = |round: DVec3| round * touches_rad.cos() - out * touches_rad.sin();
        let round = if toward(left).dot(ahead) >= toward(-left).dot(ahead) { left } else { -left };
        let up = if ahead.dot(axis) < 0.0 { -axis } else { axis };
        // The climb must not depend on the grip: the path must not jump while the grip changes.
        let loose_m = (skin_m + squeeze_m).hypot(0.5 * longest_m);
        let loose_straight_m = (off_m * off_m - loose_m * loose_m).max(0.0).sqrt();
        let turns = (length_m - loose_straight_m) / (TAU * loose_m);
        let slope = if turns > CLIMB_FROM_TURNS {
            CLIMB_DIAMETERS * 2.0 * arm_radius_m / (TAU * radius_m)
        } else {
            0.0
        };
        Ok(Winding {
            root_m: root_in_body,
            center_m,
            out,
            round,
            up,
            radius_m,
            touches_rad,
            straight_m,
            slope,
            length_m,
        })
    }

    /// The same path; an error if it is tighter than `least_m`.
    pub(super) fn not_tighter_than(self, least_m: f64) -> Result<Winding, WindingError> {
        if self.radius_m < least_m {
            return Err(WindingError::TooThin { radius_m: self.radius_m, least_m });
        }
        Ok(self)
    }

    /// Length of arm that can be wound, m.
    pub fn length_m(&self) -> f64 {
        self.length_m - self.straight_m
    }

    /// Radius of the path round the pole, m.
    pub fn radius_m(&self) -> f64 {
        self.radius_m
    }

    /// Share of the arm that lies on the pole when fully wound, 0 to 1.
    pub fn contact_share(&self) -> f64 {
        self.length_m() / self.length_m
    }

    /// Writes the ends of links of these lengths, body frame, m, when `wound_m` of the arm is wound.
    pub fn write(&self, wound_m: f64, links_m: impl Iterator<Item = f64>, places: &mut [DVec3]) {
        let (mut distance_m, mut place) = (0.0, self.root_m);
        for (link_m, end) in links_m.zip(places) {
            let mut next_m = distance_m + link_m / 1.0_f64.hypot(self.slope);
            for _ in 0..NEWTON_STEPS {
                let (there, along) = self.at(next_m, wound_m);
                let chord = there - place;
                let distance_m = chord.length();
                next_m += (link_m - distance_m) * distance_m / chord.dot(along);
            }
            place = self.at(next_m, wound_m).0;
            distance_m = next_m;
            *end = place;
        }
    }

    /// The position `distance_m` from the root along the path as seen along the axis, and its derivative.
    fn at(&self, distance_m: f64, wound_m: f64) -> (DVec3, DVec3) {
        let on_pole_m = (distance_m - self.straight_m).clamp(0.0, wound_m.max(0.0));
        let straight_m = distance_m - self.straight_m - on_pole_m;
        let (sine, cosine) = (self.touches_rad + on_pole_m / self.radius_m).sin_cos();
        let tangent = self.round * cosine - self.out * sine;
        let touching = self.center_m + self.radius_m * (self.out * cosine + self.round * sine);
        let rise = self.up * self.slope;
        (touching + tangent * straight_m + rise * distance_m, tangent + rise)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::link_length;

    /// Links of the thesis' arm, half as long as the arm is wide: their length is its radius.
    fn links(count: usize) -> impl Iterator<Item = f64> + Clone {
        (0..count).map(|index| link_length(1.0, 0.01, index))
    }

    /// A pole beside an arm that stands upright.
    fn pole(radius_links: f64, off_m: f64) -> Pole {
        Pole {
            point_in_body: DVec3::new(0.3, off_m, 5.0),
            axis: DVec3::new(1.5, 0.0, 0.1),
            radius_m: 0.5 * radius_links,
        }
    }

    /// Distance from the axis.
    fn off_m(place: DVec3, pole: Pole) -> f64 {
        (place - pole.point_in_body).cross(pole.axis.normalize()).length()
    }

    fn winding(pole: Pole, count: usize) -> Winding {
        Winding::new(DVec3::ZERO, DVec3::Z, links(count), 0.5, pole, 0.0).unwrap()
    }

    #[test]
    fn the_distal_groups_lie_on_the_pole_and_no_link_enters_it_on_the_way() {
        for radius_links in [1.5, 2.5, 4.0] {
            let pole = Pole {
                point_in_body: DVec3::new(1.5 + 0.5 * radius_links, 0.0, 1.2),
                axis: DVec3::Y,
                ..pole(radius_links, 0.0)
            };
            let winding = winding(pole, 12);
            let mut places = [DVec3::ZERO; 12];
            for step in 0..=20 {
                let wound_m = winding.length_m() * f64::from(step) / 20.0;
                winding.write(wound_m, links(12), &mut places);
                let mut from = DVec3::ZERO;
                let (mut near, mut all) = (0, 0);
                for (index, (place, link_m)) in places.iter().zip(links(12)).enumerate() {
                    assert!((place.distance(from) - link_m).abs() < 1e-9, "links keep their length");
                    for part in 0..=10 {
                        let off_m = off_m(from.lerp(*place, f64::from(part) / 10.0), pole) - pole.radius_m;
                        // The arm thins towards its tip: its own radius is that of its links.
                        assert!(off_m >= 0.5, "{off_m} m off with {wound_m} m wound");
                        if index >= 4 {
                            all += 1;
                            near += i32::from(off_m <= 0.5 + 0.1 * pole.radius_m);
                        }
                    }
                    from = *place;
                }
                assert!(step < 20 || f64::from(near) >= 0.7 * f64::from(all), "{near} of {all}");
            }
        }
    }

    #[test]
    fn coils_of_a_long_arm_do_not_touch() {
        let pole = Pole { point_in_body: DVec3::new(1.8, 0.0, 1.2), axis: DVec3::Y, radius_m: 0.5 };
        let winding = winding(pole, 36);
        let mut places = [DVec3::ZERO; 36];
        winding.write(winding.length_m(), links(36), &mut places);
        for (index, place) in places.iter().enumerate() {
            for later in &places[(index + 4).min(36)..] {
                assert!(place.distance(*later) > 0.95, "{place} and {later}");
            }
        }
    }

    #[test]
    fn tightening_a_grip_moves_no_point_of_the_arm_far() {
        let (mut before, mut now) = ([DVec3::ZERO; 16], [DVec3::ZERO; 16]);
        let mut climbing = 0;
        for radius in 0..100 {
            let radius_m = 0.4 + 0.02 * f64::from(radius);
            let pole = Pole { point_in_body: DVec3::new(0.9 + radius_m, 0.0, 1.2), axis: DVec3::Y, radius_m };
            for step in 0..=30 {
                let squeeze_m = 0.005 * f64::from(step);
                let winding = Winding::new(DVec3::ZERO, DVec3::Z, links(16), 0.5, pole, squeeze_m).unwrap();
                winding.write(winding.length_m(), links(16), &mut now);
                let most_m = now.iter().zip(&before).map(|(a, b)| a.distance(*b)).fold(0.0, f64::max);
                assert!(step == 0 || most_m < 0.06, "radius {radius_m}, {squeeze_m} m deep: {most_m} m");
                climbing += i32::from(step == 0 && winding.slope > 0.0);
                before = now;
            }
        }
        assert!((5..95).contains(&climbing), "{climbing} of 100 climb");
    }

    #[test]
    fn poles_out_of_reach_or_round_the_root_are_refused() {
        let new = |pole| Winding::new(DVec3::ZERO, DVec3::Z, links(12), 0.5, pole, 0.0);
        assert!(matches!(new(pole(2.0, 20.0)), Err(WindingError::TooFar { .. })));
        let near = Pole { point_in_body: DVec3::Z, axis: DVec3::X, radius_m: 0.5 };
        assert!(matches!(new(near), Err(WindingError::Inside { .. })));
        assert_eq!(new(Pole { axis: DVec3::ZERO, ..near }), Err(WindingError::NoPole));
        assert_eq!(new(Pole { radius_m: f64::NAN, ..near }), Err(WindingError::NoPole));
    }
}
