//! Strokes of octopus arms: bends compared with a separate optimiser, ends of groups, speeds of joints, and poles.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use glam::{DMat3, DVec3};
use hippocamp::config;
use hippocamp::ik::ArmSolver;
use hippocamp::model::{ArmGeometry, Bending, Chain, GROUPS, Joint, Pole, Robot};
use hippocamp::motion::tentacle::key_angles::KeyInterpolation;
use hippocamp::motion::tentacle::key_stroke::{KeyStroke, Part};
use hippocamp::motion::tentacle::strokes::{swim, walk};
use hippocamp::motion::tentacle::variation::Variation;
use hippocamp::motion::tentacle::winding::Winding;
use hippocamp::signals::{ArmAim, ArmTarget};

/// Cycles of one stroke.
const CYCLES: u32 = 500;
const PERIOD_S: f64 = 0.01;
/// Time of a stroke.
const STROKE_S: f64 = CYCLES as f64 * PERIOD_S;
const POSES: usize = 64;

/// The thesis' arm of 12 joints, each of two hinges.
struct Rig {
    chain: Chain,
    joints: Vec<Joint>,
    arm: ArmGeometry,
}

impl Rig {
    fn new() -> Rig {
        let text = include_str!("common/thesis_arm.toml");
        let Robot { mut chains, joints, .. } = config::parse(text, "thesis arm").expect("an arm").robot;
        let chain = chains.remove(0);
        let arm = ArmGeometry::of(&chain, &joints).expect("an arm");
        Rig { chain, joints, arm }
    }

    fn solver(&self, bending: Bending) -> ArmSolver {
        ArmSolver::new(&self.arm, &self.chain, &self.joints, bending, PERIOD_S)
    }

    fn target(&self) -> ArmTarget {
        ArmTarget::new(&self.chain, &self.joints)
    }

    /// The arm's links, m.
    fn links_m(&self) -> impl Iterator<Item = f64> + Clone {
        self.arm.joints.iter().map(|joint| joint.link_m)
    }

    /// Ends of all links, and places and axes of all hinges, by separate forward kinematics.
    fn pose(&self, angles: &[f64]) -> (Vec<DVec3>, Vec<(DVec3, DVec3)>) {
        let (mut place, mut rotation) = (DVec3::ZERO, DMat3::IDENTITY);
        let (mut ends, mut hinges) = (Vec::new(), Vec::new());
        for (joint, angle) in self.joints.iter().zip(angles) {
            hinges.push((place, rotation * joint.axis));
            rotation *= DMat3::from_axis_angle(joint.axis, *angle);
            place += rotation * joint.link_m;
            if joint.link_m.x > 0.0 {
                ends.push(place);
            }
        }
        (ends, hinges)
    }
}

/// Angles between links, squared, summed.
fn squared_bends(angles: &[f64]) -> f64 {
    angles.iter().map(|angle| angle * angle).sum()
}

fn largest_bend_deg(angles: &[f64]) -> f64 {
    let bend = |pair: &[f64]| (pair[0].cos() * pair[1].cos()).acos().to_degrees();
    angles.chunks(2).map(bend).fold(0.0, f64::max)
}

/// Least squares of the bends and, with growing weight, of the errors of the ends, from `start`: Levenberg steps on
/// all hinges, each of which must reduce the sum. Returns the sum of squared bends and the largest error, m.
fn optimise(rig: &Rig, places: [DVec3; GROUPS], start: &[f64]) -> (f64, f64) {
    let mut angles = start.to_vec();
    let missing = |angles: &[f64]| {
        let (ends, _) = rig.pose(angles);
        [3, 7, 11].iter().zip(places).map(|(link, place)| place - ends[*link]).collect::<Vec<_>>()
    };
    for weight in [1e1, 1e3, 1e5] {
        let cost = |angles: &[f64]| {
            squared_bends(angles)
                + weight * missing(angles).iter().map(|miss| miss.length_squared()).sum::<f64>()
        };
        let mut least = cost(&angles);
        let mut damping = 1e-2;
        for _ in 0..40 {
            let (ends, hinges) = rig.pose(&angles);
            let misses = missing(&angles);
            let column = |index: usize, end: usize| {
                let (place, axis) = hinges[index];
                if index / 2 < [4, 8, 12][end] {
                    axis.cross(ends[[3, 7, 11][end]] - place)
                } else {
                    DVec3::ZERO
                }
            };
            let columns: Vec<[DVec3; GROUPS]> =
                (0..24).map(|index| std::array::from_fn(|end| column(index, end))).collect();
            let dot =
                |a: &[DVec3; GROUPS], b: &[DVec3]| -> f64 { a.iter().zip(b).map(|(a, b)| a.dot(*b)).sum() };
            let mut matrix = vec![vec![0.0; 24]; 24];
            let mut right = vec![0.0; 24];
            for row in 0..24 {
                for other in 0..=row {
                    matrix[row][other] = weight * dot(&columns[row], &columns[other]);
                }
                matrix[row][row] += 1.0 + damping * (1.0 + matrix[row][row]);
                right[row] = weight * dot(&columns[row], &misses) - angles[row];
            }
            let turns = solve_symmetric(matrix, right);
            let tried: Vec<f64> =
                angles.iter().zip(&turns).map(|(a, t)| (a + t).clamp(-FRAC_PI_2, FRAC_PI_2)).collect();
            let new = cost(&tried);
            if new < least {
                let gain = least - new;
                (angles, least) = (tried, new);
                damping = (damping * 0.3_f64).max(1e-9);
                if gain < 1e-6 * least {
                    break;
                }
            } else {
                damping *= 10.0;
            }
        }
    }
    let miss_m = missing(&angles).iter().map(|miss| miss.length()).fold(0.0, f64::max);
    (squared_bends(&angles), miss_m)
}

/// Solves a symmetric positive system given by its lower half, by Cholesky's decomposition.
fn solve_symmetric(mut matrix: Vec<Vec<f64>>, mut x: Vec<f64>) -> Vec<f64> {
    let count = x.len();
    for row in 0..count {
        for column in 0..=row {
            let sum: f64 = (0..column).map(|k| matrix[row][k] * matrix[column][k]).sum();
            let left = matrix[row][column] - sum;
            matrix[row][column] = if row == column { left.sqrt() } else { left / matrix[column][column] };
        }
    }
    for row in 0..count {
        let sum: f64 = (0..row).map(|k| matrix[row][k] * x[k]).sum();
        x[row] = (x[row] - sum) / matrix[row][row];
    }
    for row in (0..count).rev() {
        let sum: f64 = (row + 1..count).map(|k| matrix[k][row] * x[k]).sum();
        x[row] = (x[row] - sum) / matrix[row][row];
    }
    x
}

fn strokes(variation_rad: f64, between: KeyInterpolation) -> [(&'static str, KeyStroke); 2] {
    let part = Part { role: 4, is_right: false, walk_plane_rad: FRAC_PI_2 };
    let variation = Variation::new(3, 0, variation_rad);
    [("walk", walk::of_arm(part, between, variation.clone())), ("swim", swim::of_arm(between, variation))]
}

/// Poses of the second of two strokes, and the largest error of a group's end in it, m.
fn poses_of(rig: &Rig, bending: Bending, stroke: KeyStroke) -> (Vec<Vec<f64>>, f64) {
    let mut solver = rig.solver(bending);
    let mut target = rig.target();
    let mut angles = vec![0.0; 24];
    let mut poses = Vec::new();
    let mut largest_m: f64 = 0.0;
    let cycles = CYCLES;
    for cycle in 0..2 * cycles {
        let phase = TAU * f64::from(cycle) * PERIOD_S / STROKE_S;
        target.ends_in_body = stroke.ends_in_arm(rig.arm.group_lengths_m(), phase, 0.0);
        let solution = solver.solve(&target, cycle == 0, &mut angles);
        if cycle >= cycles {
            poses.push(angles.clone());
            largest_m = largest_m.max(solution.residual_m);
        }
    }
    (poses, largest_m)
}

#[test]
fn the_smooth_rule_bends_little_more_than_the_least_that_reaches() {
    let rig = Rig::new();
    println!(
        "[bends]\n| stroke | sum of squared bends against the least found | largest bend | ends off by at most |"
    );
    println!("|---|---|---|---|");
    for (name, stroke) in strokes(0.0, KeyInterpolation::Smooth) {
        let (poses, miss_m) = poses_of(&rig, Bending::Smooth, stroke);
        assert!(miss_m <= 0.02 * rig.arm.length_m(), "{name}: {miss_m} m");
        let (mut worst, mut largest_deg, mut at_floor) = (0.0_f64, 0.0_f64, 0);
        for pose in 0..POSES {
            let index = pose * poses.len() / POSES;
            let ours = &poses[index];
            let phase = TAU * index as f64 / poses.len() as f64;
            let places = stroke.ends_in_arm(rig.arm.group_lengths_m(), phase, 0.0);
            // Starts from this pose, from curls to all sides, and from an almost straight arm.
            let starts = (0..8_u32).map(|start| -> Vec<f64> {
                let side = |hinge: u32| if start >> (hinge / 8) & 1 == 0 { 0.3 } else { -0.3 };
                (0..24).map(|hinge| side(hinge) * if hinge % 2 == 0 { 1.0 } else { 0.3 }).collect()
            });
            let least = starts
                .chain([ours.clone(), vec![0.02; 24]])
                .map(|start| optimise(&rig, places, &start))
                .filter(|(_, miss_m)| *miss_m < 2e-3 * rig.arm.length_m())
                .map(|(bends, _)| bends)
                .fold(f64::INFINITY, f64::min);
            assert!(least.is_finite(), "{name}: nothing reaches at pose {pose}");
            let bends = squared_bends(ours);
            // Where the minimum is almost zero, the slight screw of the resting arm remains, 0.03 rad a joint
            // (docs/ik.md): the test only requires that no more remains.
            let floor = 12.0 * 0.03 * 0.03;
            assert!(bends <= (1.2 * least).max(1.2 * floor), "{name} at {pose}: {bends}, least {least}");
            worst = worst.max(if least > floor { bends / least } else { 0.0 });
            at_floor += u32::from(bends > 1.2 * least);
            largest_deg = largest_deg.max(largest_bend_deg(ours));
        }
        let miss_share = 100.0 * miss_m / rig.arm.length_m();
        println!("| {name} | {worst:.2} | {largest_deg:.0} deg | {miss_share:.2} % of the arm |");
        assert!(at_floor <= 2, "{name}: {at_floor} of {POSES} poses are near the straight arm");
    }
}

#[test]
fn joints_follow_strokes_within_the_speed_of_small_servos() {
    // Half the no-load speed of an XL330-M288, 10.8 rad/s.
    let rig = Rig::new();
    println!(
        "[speeds]\n| stroke, key angles | fastest joint | strongest acceleration | ends off by at most |"
    );
    println!("|---|---|---|---|");
    for between in [KeyInterpolation::Smooth, KeyInterpolation::Linear] {
        for (name, stroke) in strokes(0.05, between) {
            let (poses, miss_m) = poses_of(&rig, Bending::Smooth, stroke);
            let speed = |a: &[f64], b: &[f64]| -> Vec<f64> {
                a.iter().zip(b).map(|(a, b)| (b - a) / PERIOD_S).collect()
            };
            let speeds: Vec<Vec<f64>> = poses.windows(2).map(|pair| speed(&pair[0], &pair[1])).collect();
            let largest =
                |rows: &[Vec<f64>]| rows.iter().flatten().fold(0.0_f64, |most, x| most.max(x.abs()));
            let accelerations: Vec<Vec<f64>> =
                speeds.windows(2).map(|pair| speed(&pair[0], &pair[1])).collect();
            println!(
                "| {name}, {} | {:.1} rad/s | {:.0} rad/s^2 | {:.2} % of the arm |",
                if between == KeyInterpolation::Smooth { "smooth" } else { "linear" },
                largest(&speeds),
                largest(&accelerations),
                100.0 * miss_m / rig.arm.length_m()
            );
            assert!(largest(&speeds) < 0.5 * 10.8, "{name} {between:?}");
            assert!(largest(&accelerations) < 60.0, "{name} {between:?}");
            assert!(miss_m <= 0.02 * rig.arm.length_m(), "{name} {between:?}: {miss_m} m");
        }
    }
}

/// Straight lines between key angles have corners; the strokes round them within a fortieth of a stroke, so that
/// speed is continuous: its step from cycle to cycle goes to zero with the cycle time, and acceleration has a bound
/// that does not depend on the loop's rate.
#[test]
fn joints_have_a_continuous_speed_where_key_angles_have_corners() {
    let rig = Rig::new();
    for (name, stroke) in strokes(0.0, KeyInterpolation::Linear) {
        let leap = |rate_hz: f64| {
            let cycles = (STROKE_S * rate_hz).round();
            let mut solver =
                ArmSolver::new(&rig.arm, &rig.chain, &rig.joints, Bending::Smooth, 1.0 / rate_hz);
            let (mut target, mut angles) = (rig.target(), vec![0.0; 24]);
            let (mut last, mut speeds, mut most) = (angles.clone(), vec![0.0; 24], 0.0_f64);
            let mut cycle = 0.0;
            while cycle < 2.0 * cycles {
                target.ends_in_body =
                    stroke.ends_in_arm(rig.arm.group_lengths_m(), TAU * cycle / cycles, 0.0);
                solver.solve(&target, cycle <= 0.0, &mut angles);
                for ((angle, last), speed) in angles.iter().zip(&last).zip(&mut speeds) {
                    let now = (angle - last) * rate_hz;
                    most = if cycle >= cycles { most.max((now - *speed).abs()) } else { most };
                    *speed = now;
                }
                last.copy_from_slice(&angles);
                cycle += 1.0;
            }
            most
        };
        let leaps = [100.0, 200.0, 400.0].map(leap);
        println!("{name}: speed leaps by {leaps:?} rad/s at 100, 200 and 400 cycles a second");
        // At the acceleration of the corner itself, which faster loops resolve, speed gains half as much in half
        // the time.
        assert!(leaps[2] < 0.5 * leaps[0] && leaps[2] < 0.65 * leaps[1], "{name}: {leaps:?}");
        assert!(400.0 * leaps[2] < 60.0, "{name}: {leaps:?}");
    }
}

#[test]
fn the_thesis_rule_brings_groups_to_their_pseudo_targets() {
    let rig = Rig::new();
    println!("[descent]\n| stroke | largest bend | ends off by at most |\n|---|---|---|");
    for (name, stroke) in strokes(0.0, KeyInterpolation::Linear) {
        let (poses, miss_m) = poses_of(&rig, Bending::Ccd, stroke);
        let largest_deg = poses.iter().map(|pose| largest_bend_deg(pose)).fold(0.0, f64::max);
        let miss_share = 100.0 * miss_m / rig.arm.length_m();
        println!("| {name} | {largest_deg:.0} deg | {miss_share:.2} % of the arm |");
        assert!(miss_m <= 0.02 * rig.arm.length_m(), "{name}: {miss_m} m");
    }
}

#[test]
fn joints_wind_the_arm_round_poles() {
    let rig = Rig::new();
    // The arm lies along x, and its radius is the length of its first link.
    let (link_m, arm_radius_m) = (0.5, 0.5);
    for radius_links in [1.5, 2.5, 4.0] {
        let radius_m = radius_links * link_m;
        let pole = Pole {
            point_in_body: DVec3::new(1.2, radius_m + 1.2, 7.0),
            axis: DVec3::new(0.0, 0.1, 1.0),
            radius_m,
        };
        let axis = pole.axis.normalize();
        let winding = Winding::new(DVec3::ZERO, DVec3::X, rig.links_m(), arm_radius_m, pole, 0.0).unwrap();
        let mut solver = rig.solver(Bending::Smooth);
        let mut target = ArmTarget { aim: ArmAim::Places, ..rig.target() };
        let mut angles = vec![0.0; 24];
        let cycles = 400;
        for cycle in 0..=cycles {
            let before = angles.clone();
            let share = f64::from(cycle) / f64::from(cycles);
            let wound_m = winding.length_m() * (0.5 - 0.5 * (PI * share).cos());
            winding.write(wound_m, rig.links_m(), &mut target.places_in_body);
            let solution = solver.solve(&target, cycle == 0, &mut angles);
            assert!(solution.residual_m < 1e-6, "{radius_links}: {solution:?}");
            let step = angles.iter().zip(&before).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(cycle == 0 || step < 5.4 * PERIOD_S, "{radius_links}: a joint turns {step} rad");
        }
        let (ends, _) = rig.pose(&angles);
        let centreline = ends.windows(2).enumerate().flat_map(|(link, pair)| {
            let (from, to) = (pair[0], pair[1]);
            (0..20).map(move |part| (link + 1, from.lerp(to, f64::from(part) / 20.0)))
        });
        let (mut near, mut all) = (0, 0);
        for (link, place) in centreline {
            let off_m = (place - pole.point_in_body).cross(axis).length() - radius_m - arm_radius_m;
            assert!(off_m >= 0.0, "{radius_links}: link {link} is {off_m} m inside");
            if link >= 4 {
                all += 1;
                near += i32::from(off_m <= 0.1 * radius_m);
            }
        }
        println!("{radius_links} links: {near} of {all} near the pole");
        assert!(f64::from(near) >= 0.7 * f64::from(all), "{radius_links}: {near} of {all}");
    }
}
