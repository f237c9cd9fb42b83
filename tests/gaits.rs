//! Every gait and every change of gait: no foot leaves its place.
//!
//! With `HIPPOCAMP_FULL` set, changes from every fiftieth of the stride at two speeds, and a thousand random scripts; else
//! from every fifth at one speed, and sixty scripts.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a test may panic; figures are for people")]

mod common;
mod on_feet;

use std::sync::atomic::{AtomicU64, Ordering};

use common::{capability, horse_of, is_full, shipped};
use hippocamp::model::Robot;
use hippocamp::motion::horse::HorsePlan;
use hippocamp::motion::{Command, GaitChoice, Posture};
use on_feet::OnFeet;
use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::{Rng, SeedableRng};

/// The thesis' limit: the foot within 0.8 m fore and aft of its root.
const THESIS_REACH_M: f64 = 0.8;
/// No stance is shorter than this in the thesis' 0.3 s swing; the same share in others.
const SHORTEST_STANCE: f64 = 0.06 / 0.3;
/// Nothing takes longer to stop from and stand level, s.
const LONGEST_STOP_S: f64 = 30.0;

/// Shares of the gaits' top speeds: ordered at first, and as the goal.
fn shares() -> &'static [f64] {
    if is_full() { &[0.9, 0.95] } else { &[0.95] }
}

/// How many phases of a stride a change is begun in.
fn phases() -> u32 {
    if is_full() { 50 } else { 3 }
}

fn thoroughbred() -> (Robot, HorsePlan) {
    let robot = shipped("thoroughbred.toml");
    let mut plan = capability(&robot).plan(&horse_of(&robot), Command::default());
    assert!(plan.reach.level.half_excursion_m >= THESIS_REACH_M);
    plan.reach.level.half_excursion_m = THESIS_REACH_M;
    (robot, plan)
}

/// What the changes from one gait to another looked like, from all phases.
#[derive(Default)]
struct Changes {
    /// The longest, strides of the stride clock.
    strides: f64,
    /// Time from the order until the new gait has the new speed, s.
    duration_s: f64,
    furthest_m: f64,
    residual_m: f64,
    shortest_stance_s: f64,
    interventions: u64,
    begun: f64,
}

/// Changes from the gait with index `from` to `to` and back, each at `share` of its top speed, from every phase.
fn changes(robot: &Robot, plan: &HorsePlan, from: usize, to: usize, share: f64) -> Changes {
    let speed = |gait: usize| share * plan.top_speed_m_s(GaitChoice::Gait(gait));
    let (before, after) = (Command::ahead(from, speed(from)), Command::ahead(to, speed(to)));
    let mut found = Changes { shortest_stance_s: f64::INFINITY, ..Changes::default() };
    let mut horse = OnFeet::new(robot, plan);
    follow(&mut horse, before);
    for _ in 0..phases() {
        // Each time later by this part of a stride.
        let phase = horse.drive().walk().phase(horse.drive().now_s());
        while horse.drive().walk().phase(horse.drive().now_s())
            < (phase + 1.0).floor() + found.begun / f64::from(phases())
        {
            horse.step(before);
        }
        found.begun += 1.0;
        let asked_s = horse.drive().now_s();
        follow(&mut horse, after);
        found.duration_s = found.duration_s.max(horse.drive().now_s() - asked_s);
        found.strides = found.strides.max(horse.drive().walk().last_change_strides());
        follow(&mut horse, before);
    }
    horse.assert_kept();
    let feet = horse.telemetry.feet_report().unwrap();
    found.furthest_m = feet.excursion_max_m;
    found.residual_m = feet.ik_residual_max_m;
    found.shortest_stance_s = horse.shortest_stance_s;
    found.interventions = horse.interventions;
    found
}

/// Continues until the horse follows its order, and for one more stride.
fn follow(horse: &mut OnFeet<'_>, command: Command) {
    let from_s = horse.drive().now_s();
    while !horse.drive().does(command) {
        horse.step(command);
        assert!(horse.drive().now_s() < from_s + 60.0, "{command:?} is not followed");
    }
}

/// All ordered pairs, both ways in one go; a table of them.
fn all_pairs(robot: &Robot, plan: &HorsePlan, share: f64) {
    let name = |gait: usize| plan.settings.gaits[gait].name.as_str();
    let gaits = plan.settings.gaits.len();
    // For docs/gaits.md.
    println!("[{} at {share}]", robot.name);
    println!("| from, to | {} |", (0..gaits).map(name).collect::<Vec<_>>().join(" | "));
    println!("|---{}|", "|---".repeat(gaits));
    let mut all = Changes { shortest_stance_s: f64::INFINITY, ..Changes::default() };
    for from in 0..gaits {
        let mut row = format!("| {} |", name(from));
        for to in 0..gaits {
            if to == from {
                row += "  |";
                continue;
            }
            let found = changes(robot, plan, from, to, share);
            row += &format!(" {} / {:.1} |", found.strides, found.duration_s);
            all.furthest_m = all.furthest_m.max(found.furthest_m);
            all.residual_m = all.residual_m.max(found.residual_m);
            all.shortest_stance_s = all.shortest_stance_s.min(found.shortest_stance_s);
            all.interventions += found.interventions;
            assert!(found.strides <= 4.0);
            assert!(found.shortest_stance_s >= SHORTEST_STANCE * plan.settings.swing_time_s);
        }
        println!("{row}");
    }
    println!();
    println!(
        "{} at {share}: feet {:.4} m from neutral, {:.2} um left, stances of {:.0} ms at least, {} goals changed",
        robot.name,
        all.furthest_m,
        1e6 * all.residual_m,
        1e3 * all.shortest_stance_s,
        all.interventions
    );
}

#[test]
fn the_thoroughbred_changes_between_all_gaits_from_all_phases() {
    let (robot, plan) = thoroughbred();
    shares().iter().for_each(|share| all_pairs(&robot, &plan, *share));
}

#[test]
fn the_robots_change_between_all_gaits_within_their_servos_speed() {
    for file in common::ROBOTS {
        let robot = shipped(file);
        let plan = capability(&robot).plan(&horse_of(&robot), Command::default());
        shares().iter().for_each(|share| all_pairs(&robot, &plan, *share));
    }
}

/// The operator's next order, and how long it holds, s.
fn any_command(plan: &HorsePlan, chance: &mut Pcg64Mcg) -> (f64, Command) {
    let mut share = || f64::from(chance.next_u32()) / f64::from(u32::MAX);
    let gaits = plan.settings.gaits.len();
    let top_m_s = plan.top_speed_m_s(GaitChoice::Auto);
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a small whole number")]
    let gait = match (share() * (gaits + 3) as f64) as usize {
        gait if gait < gaits => GaitChoice::Gait(gait),
        gait if gait == gaits => GaitChoice::Stand,
        _ => GaitChoice::Auto,
    };
    let mut around = |size: f64| size * (2.0 * share() - 1.0);
    let stand_m = plan.settings.stand_height_m;
    let command = Command {
        gait,
        speed_m_s: 0.4 * top_m_s + around(1.0 * top_m_s),
        yaw_rate_rad_s: around(0.5),
        posture: Posture {
            rise_m: around(0.15 * stand_m),
            pitch_rad: around(0.3),
            roll_rad: around(0.25),
            sway_m: around(0.05 * stand_m),
        },
    };
    (0.2 + 6.0 * share(), command)
}

/// `scripts` of 60 s each, over all processors.
fn random_scripts(robot: &Robot, plan: &HorsePlan, scripts: u64) {
    let next = AtomicU64::new(0);
    let workers = std::thread::available_parallelism().map_or(1, usize::from);
    std::thread::scope(|scope| {
        for _ in 0..workers {
            scope.spawn(|| {
                loop {
                    let seed = next.fetch_add(1, Ordering::Relaxed);
                    if seed >= scripts {
                        break;
                    }
                    random_script(robot, plan, seed);
                }
            });
        }
    });
}

fn random_script(robot: &Robot, plan: &HorsePlan, seed: u64) {
    let mut chance = Pcg64Mcg::seed_from_u64(seed);
    let mut horse = OnFeet::new(robot, plan);
    while horse.drive().now_s() < 60.0 {
        let (lasts_s, command) = any_command(plan, &mut chance);
        let until_s = horse.drive().now_s() + lasts_s;
        while horse.drive().now_s() < until_s {
            horse.step(command);
        }
    }
    // From any motion and posture, an order to stop brings it to a level stand.
    let told_s = horse.drive().now_s();
    while !horse.drive().is_standing() {
        horse.step(Command::default());
        assert!(horse.drive().now_s() < told_s + LONGEST_STOP_S, "script {seed} never comes to a stand");
    }
    horse.assert_kept();
}

#[test]
fn a_trunk_that_may_accelerate_steeply_starts_and_stops_in_every_gait_all_the_same() {
    let robot = shipped("horse.toml");
    let mut plan = capability(&robot).plan(&horse_of(&robot), Command::default());
    plan.settings.acceleration_m_s2 = 20.0;
    for gait in 0..plan.settings.gaits.len() {
        let mut horse = OnFeet::new(&robot, &plan);
        follow(&mut horse, Command::ahead(gait, 0.9 * plan.top_speed_m_s(GaitChoice::Gait(gait))));
        follow(&mut horse, Command::default());
        horse.assert_kept();
    }
}

#[test]
fn random_scripts_keep_every_limit() {
    let (horse_scripts, thoroughbred_scripts) = if is_full() { (600, 400) } else { (16, 10) };
    let robot = shipped("horse.toml");
    let plan = capability(&robot).plan(&horse_of(&robot), Command::default());
    random_scripts(&robot, &plan, horse_scripts);
    let (robot, plan) = thoroughbred();
    random_scripts(&robot, &plan, thoroughbred_scripts);
}
