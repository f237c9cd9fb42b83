//! Ranges of ball joints in robot files.

use glam::DVec2;
use hippocamp::config;
use hippocamp::model::{ArmGeometry, Robot};

const TENTACLE: &str = include_str!("../../config/tentacle.toml");

/// The tentacle with these corners, lift and sweep in degrees, and perhaps more keys of theirs.
fn with_corners(corners: &[&str]) -> String {
    let corners: String = corners.iter().map(|corner| format!("\n[[arm.ball]]\n{corner}\n")).collect();
    let without: String = TENTACLE.split("[[arm.ball]]").next().unwrap().to_owned();
    // The shipped file's own corners, if any, stand last.
    format!("{without}{corners}")
}

fn parse(corners: &[&str]) -> Result<Robot, String> {
    config::parse(&with_corners(corners), "tentacle.toml")
        .map(|file| file.robot)
        .map_err(|error| error.to_string())
}

const SQUARE: [&str; 4] = [
    "lift_deg = 60\nsweep_deg = 0",
    "lift_deg = 0\nsweep_deg = 60\ntwist_range_deg = [-20, 30]",
    "lift_deg = -60\nsweep_deg = 0",
    "lift_deg = 0\nsweep_deg = -60",
];

#[test]
fn every_joint_of_an_arm_has_the_range_of_its_corners() {
    let robot = parse(&SQUARE).unwrap();
    let chain = &robot.chains[0];
    let arm = ArmGeometry::of(chain, robot.joints_of(chain)).unwrap();
    for joint in &arm.joints {
        let ball = joint.range.as_ref().unwrap();
        // Up is about -y: half of 60 degrees has the sine 0.5.
        assert!(ball.has_swing(DVec2::new(-0.49, 0.0)) && !ball.has_swing(DVec2::new(-0.51, 0.0)));
        assert!(ball.has_swing(DVec2::new(0.2, 0.29)) && !ball.has_swing(DVec2::new(0.2, 0.31)));
        let (low, high) = ball.twist_range_rad(DVec2::new(0.0, 0.5));
        assert!((low.to_degrees() + 20.0).abs() < 1e-9 && (high.to_degrees() - 30.0).abs() < 1e-9);
    }
}

#[test]
fn corners_without_a_valid_range_are_refused() {
    for (corners, said) in [
        (vec![SQUARE[0], SQUARE[1]], "at least 3 corners"),
        (vec![SQUARE[0], SQUARE[2], SQUARE[1], "lift_deg = 10\nsweep_deg = -50"], "cross"),
        (
            vec![
                "lift_deg = 60\nsweep_deg = 60",
                "lift_deg = 10\nsweep_deg = 60",
                "lift_deg = 60\nsweep_deg = 10",
            ],
            "straight joint",
        ),
        (
            vec![SQUARE[0], SQUARE[2], "lift_deg = 0\nsweep_deg = 60\ntwist_range_deg = [30, -20]"],
            "lowest twist first",
        ),
        (vec![SQUARE[0], "lift_deg = 200\nsweep_deg = 0", SQUARE[2]], "from -180 to 180"),
        (vec![SQUARE[0], "sweep_deg = 0", SQUARE[2]], "lift_deg"),
    ] {
        let error = parse(&corners).unwrap_err();
        assert!(error.contains(said), "{error:?} says nothing of {said:?}");
    }
}
