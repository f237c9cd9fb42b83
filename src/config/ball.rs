//! `[[arm.ball]]`, and `ball` of a chain's joint: how far hinges in one place may turn together.

use std::f64::consts::PI;

use super::number::Limits;
use super::reader::Section;
use crate::model::BallJoint;
use crate::model::ball_joint::{Corner, SwingTwist};

/// Most corners of a region: one every ten degrees or so.
const CORNERS_MAX: usize = 32;

/// The shared range in `section`; `Some(None)` if it has none, `None` after a fault.
pub(super) fn read(section: &Section<'_>) -> Option<Option<BallJoint>> {
    let meaning = "the corners, in order, of the region in which the joint bends, beside its hinges' ranges";
    let corners = section.list("ball", meaning, CORNERS_MAX, read_corner);
    if corners.is_empty() {
        return Some(None);
    }
    match BallJoint::new(corners.into_iter().collect::<Option<_>>()?) {
        Ok(ball) if ball.has_swing(glam::DVec2::ZERO) => Some(Some(ball)),
        Ok(_) => {
            section.fault("ball", "corners round the straight joint: lift 0 and sweep 0 must lie inside");
            None
        }
        Err(error) => {
            section.fault("ball", error.to_string());
            None
        }
    }
}

fn read_corner(section: &Section<'_>) -> Option<Corner> {
    let within = Limits::FromTo(-180.0, 180.0);
    let lift = section.number("lift_deg", "how far up the joint is bent there in degrees", within);
    let sweep = section.number("sweep_deg", "how far to the left it is bent there in degrees", within);
    let twist = if section.has("twist_range_deg") {
        let meaning = "the lowest and highest twist there in degrees";
        let twist = section.numbers::<2>("twist_range_deg", meaning, within);
        twist.map(|[low, high]| (low.to_radians(), high.to_radians()))
    } else {
        Some((-PI, PI))
    };
    let swing = SwingTwist::swing_to(lift?.to_radians(), sweep?.to_radians());
    Some(Corner { swing, twist_rad: twist? })
}
