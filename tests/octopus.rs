//! The eight arms of config/octopus.toml: they reach the targets of their strokes, and keep clear of each other.
#![allow(
    clippy::unwrap_used,
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a test may panic; counts and times are small"
)]

mod common;

use std::f64::consts::TAU;

use common::arm::{Arm, chance, strokes};
use common::shipped;
use glam::DVec3;
use hippocamp::model::{Motion, Pole, TipPath};
use hippocamp::motion::tentacle::winder;
use hippocamp::motion::tentacle::winding::WindingError;
use hippocamp::motion::{Place, Stroke, StrokeCommand};
use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::SeedableRng;

#[test]
fn sections_end_where_their_strokes_put_them() {
    let robot = shipped("octopus.toml");
    let arm_m = robot.chains[0].length_m(robot.joints_of(&robot.chains[0]));
    for stroke in [Stroke::of("walk"), Stroke::of("swim")] {
        let mut arm = Arm::awake(&robot);
        let (mut largest_m, mut swung_m) = (0.0_f64, [DVec3::INFINITY, DVec3::NEG_INFINITY]);
        for _ in 0..(16.0 * robot.rate_hz) as usize {
            arm.perform(StrokeCommand::of(stroke), robot.period_s());
            let record = arm.controller.record(&[]);
            let left_m = record.joints.group_residual_m.iter().fold(0.0, |a: f64, b| a.max(*b));
            largest_m = largest_m.max(left_m);
            let tip = robot.tip_in_body(&robot.chains[3], arm.goals[0][18..24].iter().copied());
            swung_m = [swung_m[0].min(tip), swung_m[1].max(tip)];
        }
        let swung_m = (swung_m[1] - swung_m[0]).length();
        println!(
            "{stroke:?}: {largest_m} m left, the tip of the rear arm goes {swung_m} m to and fro, {} m clear, {} held back",
            arm.clearance_m, arm.interventions
        );
        assert!(largest_m <= 0.02 * arm_m, "{stroke:?}: {largest_m} m of {arm_m} m");
        assert!(swung_m > 0.4 * arm_m, "{stroke:?}: {swung_m} m");
    }
}

#[test]
fn any_stroke_follows_any_other_clear_of_the_other_arms() {
    let robot = shipped("octopus.toml");
    let strokes = strokes(&robot);
    for from in &strokes {
        let mut arm = Arm::awake(&robot);
        for to in &strokes {
            arm.perform(StrokeCommand::of(*from), 4.3);
            arm.interventions = 0;
            arm.perform(StrokeCommand { turn_rad: 0.6, ..StrokeCommand::of(*to) }, 3.0);
            println!("{from:?} to {to:?}: {} held back, {} m clear", arm.interventions, arm.clearance_m);
        }
    }
}

#[test]
fn random_scripts_keep_arms_apart() {
    let robot = shipped("octopus.toml");
    let strokes = strokes(&robot);
    let mut source = Pcg64Mcg::seed_from_u64(21);
    let mut arm = Arm::awake(&robot);
    for _ in 0..100 {
        let mut place = || {
            0.4 * DVec3::new(
                chance(&mut source) - 0.5,
                chance(&mut source) - 0.5,
                0.6 * chance(&mut source) - 0.3,
            )
        };
        let places = [place(), 1.5 * place(), place()];
        let mut pick = |count: usize| (chance(&mut source) * count as f64) as usize % count;
        let mut stroke = strokes[pick(strokes.len())];
        if let Place::Point { .. } = stroke.place {
            stroke = match pick(2) {
                0 => Stroke { name: "path", place: Place::Path(TipPath::new(&places, 0.1).unwrap()) },
                _ => Stroke { place: Place::Point { in_body: 1.5 * places[0], direction: None }, ..stroke },
            };
        }
        let command = StrokeCommand {
            stroke,
            tempo: 2.0 * chance(&mut source),
            turn_rad: 0.5 * TAU * (chance(&mut source) - 0.5),
        };
        arm.perform(command, 0.5 + 4.0 * chance(&mut source));
    }
    println!("{} m clear", arm.clearance_m);
}

/// A section of four links of 30 mm that bends by a right angle lies on no circle below 30 / (2 sin 11.25 deg) = 76.9 mm;
/// tapered links are a little shorter.
#[test]
fn sections_wind_round_thick_poles_and_refuse_thin_ones() {
    let mut robot = shipped("octopus.toml");
    let Motion::Tentacle(tentacle) = &mut robot.motion else { panic!("no arms") };
    // As the winding put it, before it grips.
    tentacle.grip_share = 0.0;
    let (settings, chain) = (tentacle.clone(), robot.chains[0].clone());
    let skin_m = settings.arms[0].radius_m;
    let ahead = chain.root_rotation * DVec3::X;
    let beside = |radius_m: f64| Pole {
        point_in_body: chain.root_m + ahead * 0.05 + DVec3::Z.cross(ahead) * (radius_m + skin_m + 0.01),
        axis: DVec3::Z,
        radius_m,
    };
    for radius_m in [0.03, 0.045, 0.058] {
        let error = winder::check(&robot, &settings, beside(radius_m)).unwrap_err();
        let WindingError::TooThin { least_m, .. } = error else { panic!("{radius_m} m: {error}") };
        assert!((0.975 * 0.0769..0.0769).contains(&least_m), "{error}");
    }
    let pole = beside(0.15);
    winder::check(&robot, &settings, pole).unwrap();
    let mut arm = Arm::awake(&robot);
    arm.perform(
        StrokeCommand { tempo: 4.0, ..StrokeCommand::of(Stroke { name: "wind", place: Place::Pole(pole) }) },
        14.0,
    );
    let places = robot.places_in_body(&chain, arm.goals[0][chain.joints.clone()].iter().copied());
    let off_m =
        |place: DVec3| (place - pole.point_in_body).cross(pole.axis).length() - pole.radius_m - skin_m;
    let along = |places: &[DVec3]| -> Vec<f64> {
        let chord = |pair: &[DVec3]| [0.0, 0.25, 0.5, 0.75].map(|share| off_m(pair[0].lerp(pair[1], share)));
        places.windows(2).flat_map(chord).collect()
    };
    let outer = along(&places[4..]);
    let near = outer.iter().filter(|off| **off <= 0.1 * pole.radius_m).count() as f64 / outer.len() as f64;
    let deepest_m = along(&places).into_iter().fold(f64::INFINITY, f64::min);
    println!("{near} of the outer sections on the pole, {deepest_m} m deep");
    assert!(near >= 0.7, "{near}");
    // Sections do not meet a tangent exactly where links would.
    assert!(deepest_m > -5e-4, "{deepest_m}");
}
