//! Horses in physics that are pushed: they do not fall, reach the ordered speed and stay level; standing, they have
//! the ordered height.
//!
//! The suite runs one seed of fifteen seconds each. For the whole table of `docs/balance.md`:
//! `HIPPOCAMP_FULL=1 cargo test --test body_walks -- --nocapture`.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a test may panic; figures are for people")]

mod common;

use std::f64::consts::TAU;
use std::sync::Mutex;
use std::time::Duration;

use common::{ROBOTS, capability, horse_of, in_physics, is_full};
use glam::{DQuat, DVec3, EulerRot};
use hippocamp::bus::{Buses, SimPorts};
use hippocamp::ik::Method;
use hippocamp::model::{BalanceSettings, Robot};
use hippocamp::motion::horse::HorsePlan;
use hippocamp::motion::{Activity, Command, Order};
use hippocamp::run::Cycle;
use hippocamp::signals::Permission;
use hippocamp::simulation;
use hw_sim::FaultScript;
use hw_sim::body::{Push, PushFrame};
use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::{Rng, SeedableRng};

/// Impulse of each push, N s, and how long it lasts, s.
const PUSH: (f64, f64) = (0.1, 0.1);
/// Time that a walk has to reach its speed, s.
const START_S: f64 = 3.0;
/// Ordered share of the top speed of a gait.
const SHARE: f64 = 0.9;

/// How many seeds open loop.
const OPEN_LOOP_SEEDS: u64 = 3;

/// How many seeds, and for how long, s.
fn extent() -> (u64, f64) {
    if is_full() { (10, 60.0) } else { (1, 15.0) }
}

/// The same without feedback and without a correction of sag.
fn open_loop(mut robot: Robot) -> Robot {
    robot.balance = None;
    robot
}

/// Measurements of one run.
#[derive(Debug, Clone, Default)]
struct Seen {
    fell_at_s: Option<f64>,
    /// Mean speed along the trunk, and mean ordered speed, m/s.
    speed_m_s: f64,
    asked_m_s: f64,
    roll_max: f64,
    pitch_max: f64,
    /// Difference from the planned height, m: largest, and last.
    height_off_m: f64,
    last_off_m: f64,
    held: bool,
}

/// One run: rises from sitting, then follows `command` at each time for `for_s`, pushed once a second.
fn run(
    robot: &Robot,
    plan: &HorsePlan,
    seed: u64,
    for_s: f64,
    push: f64,
    command: &(dyn Fn(f64) -> Command + Sync),
) -> Seen {
    let world =
        simulation::world_from_pose(robot, &plan.sit_pose_rad, seed, &FaultScript::default()).unwrap();
    let mut buses = Buses::new(robot, SimPorts::on_virtual_clock(world));
    buses.prepare(robot).unwrap();
    let mut cycle = Cycle::new(robot, plan.clone(), Method::CcdThenFinish, for_s, buses);
    let (dt_s, period) = (robot.period_s(), Duration::from_secs_f64(robot.period_s()));
    let sole_m =
        robot.chains.iter().filter_map(|chain| chain.foot).map(|foot| foot.below_tip_m()).fold(0.0, f64::max);
    let mut deadline = cycle.now();
    let mut chance = Pcg64Mcg::seed_from_u64(seed);
    let (mut seen, mut on_feet_s, mut pushes) = (Seen::default(), 0.0, 0.0);
    let (mut measured_s, mut last_m) = (0.0, None::<DVec3>);
    while on_feet_s < for_s {
        cycle.step(Order::Drive(command(on_feet_s)));
        deadline = deadline + period;
        // A robot whose reflex handles a fall no longer stands, so it counts as fallen.
        if cycle.record().facts.falls.is_some_and(|report| report.falls > 0) {
            seen.fell_at_s = Some(on_feet_s);
            break;
        }
        let truth = cycle.record().facts.truth.unwrap();
        if matches!(cycle.record().facts.activity, Activity::Standing | Activity::Walking) {
            on_feet_s += dt_s;
            let (yaw, pitch, roll) = truth.orientation.to_euler(EulerRot::ZYX);
            seen.roll_max = seen.roll_max.max(roll.abs());
            seen.pitch_max = seen.pitch_max.max(pitch.abs());
            seen.last_off_m = truth.height_m - cycle.record().targets.trunk_in_world.z - sole_m;
            seen.height_off_m = seen.height_off_m.max(seen.last_off_m.abs());
            seen.held |= cycle.record().state.permission != Permission::Move;
            if let Some(last_m) = last_m.filter(|_| on_feet_s > START_S) {
                let ahead = DQuat::from_rotation_z(yaw) * DVec3::X;
                seen.speed_m_s += (truth.position_m - last_m).dot(ahead);
                seen.asked_m_s += command(on_feet_s).speed_m_s * dt_s;
                measured_s += dt_s;
            }
            last_m = Some(truth.position_m);
            if truth.is_fallen {
                seen.fell_at_s = Some(on_feet_s);
                break;
            }
            if push > 0.0 && on_feet_s > 1.0 + pushes {
                pushes += 1.0;
                let direction = TAU * f64::from(chance.next_u32()) / f64::from(u32::MAX);
                let force_n = DVec3::new(direction.cos(), direction.sin(), 0.0) * (push / PUSH.1);
                let push = Push { force_n: force_n.into(), frame: PushFrame::World, place_m: [0.0; 3] };
                cycle.buses_mut().ports_mut().world_mut().push(push, PUSH.1);
            }
        }
        let now_s = cycle.now().as_secs_f64();
        assert!(now_s < for_s + 30.0, "it never gets on its feet: {:?}", cycle.record().facts.cause);
        cycle.begin(deadline);
    }
    seen.speed_m_s /= f64::max(measured_s, dt_s);
    seen.asked_m_s /= f64::max(measured_s, dt_s);
    seen
}

/// All seeds, spread over the cores.
fn run_all(
    robot: &Robot,
    plan: &HorsePlan,
    (seeds, for_s): (u64, f64),
    command: &(dyn Fn(f64) -> Command + Sync),
) -> Vec<Seen> {
    let (next, found) = (Mutex::new(1..=seeds), Mutex::new(Vec::new()));
    let work = || {
        while let Some(seed) = next.lock().unwrap().next() {
            let seen = run(robot, plan, seed, for_s, PUSH.0, command);
            found.lock().unwrap().push((seed, seen));
        }
    };
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    std::thread::scope(|scope| (0..cores).for_each(|_| drop(scope.spawn(work))));
    let mut found = found.into_inner().unwrap();
    found.sort_by_key(|(seed, _)| *seed);
    found.into_iter().map(|(_, seen)| seen).collect()
}

/// One line of the table, which is printed.
struct Line {
    falls: usize,
    /// Lowest and highest mean speed, shares of the ordered speed.
    speed: (f64, f64),
    roll_deg: f64,
    pitch_deg: f64,
}

fn line(robot: &Robot, what: &str, runs: &[Seen]) -> Line {
    let most = |of: fn(&Seen) -> f64| runs.iter().map(of).fold(f64::NEG_INFINITY, f64::max);
    let least = |of: fn(&Seen) -> f64| runs.iter().map(of).fold(f64::INFINITY, f64::min);
    let share = |seen: &Seen| seen.speed_m_s / seen.asked_m_s;
    let line = Line {
        falls: runs.iter().filter(|seen| seen.fell_at_s.is_some()).count(),
        speed: (least(share), most(share)),
        roll_deg: most(|seen| seen.roll_max).to_degrees(),
        pitch_deg: most(|seen| seen.pitch_max).to_degrees(),
    };
    println!(
        "| {} | {what} | {:.3} | {:.2} to {:.2} | {:.1} | {:.1} | {:.1} | {} of {} |",
        robot.name,
        runs[0].asked_m_s,
        line.speed.0,
        line.speed.1,
        line.roll_deg,
        line.pitch_deg,
        1e3 * most(|seen| seen.height_off_m),
        line.falls,
        runs.len()
    );
    assert!(runs.iter().all(|seen| !seen.held), "{what}: safety held the robot");
    line
}

/// A gait at nine tenths of its top speed, with feedback; with `HIPPOCAMP_FULL` also open loop.
fn walks(name: &str, gait: &str) -> Line {
    let robot = in_physics(name);
    let plan = capability(&robot).plan(&horse_of(&robot), Command::default());
    let choice = plan.gait_choice(gait).unwrap();
    let speed_m_s = SHARE * plan.top_speed_m_s(choice);
    if name == "horse.toml" {
        let least_m_s = if gait == "walk-steady" { 0.045 } else { 0.0 };
        let least_m_s = if gait == "trot" { 0.11 } else { least_m_s };
        assert!(speed_m_s >= least_m_s, "{gait} at {speed_m_s} m/s");
    }
    let command = move |_: f64| Command { gait: choice, speed_m_s, ..Command::default() };
    if is_full() {
        let (robot, (_, for_s)) = (open_loop(robot.clone()), extent());
        line(
            &robot,
            &format!("{gait}, open loop"),
            &run_all(&robot, &plan, (OPEN_LOOP_SEEDS, for_s), &command),
        );
    }
    line(&robot, gait, &run_all(&robot, &plan, extent(), &command))
}

#[test]
fn steady_walk_and_trot_stay_level_and_keep_their_speed() {
    for name in ROBOTS {
        for gait in ["walk-steady", "trot"] {
            let line = walks(name, gait);
            assert_eq!(line.falls, 0, "{name} {gait}");
            assert!(line.roll_deg < 4.0 && line.pitch_deg < 4.0, "{name} {gait}");
            assert!(line.speed.0 > 0.85 && line.speed.1 < 1.15, "{name} {gait}: {:?}", line.speed);
        }
    }
}

#[test]
fn the_walk_of_the_thesis_does_not_fall() {
    for name in ROBOTS {
        assert_eq!(walks(name, "walk").falls, 0, "{name}");
    }
}

#[test]
fn the_horse_does_not_fall_from_walk_to_trot_and_back() {
    for name in ROBOTS {
        let robot = in_physics(name);
        let plan = capability(&robot).plan(&horse_of(&robot), Command::default());
        let (seeds, for_s) = extent();
        let ahead = |gait: &str| {
            let gait = plan.gait_choice(gait).unwrap();
            Command { gait, speed_m_s: SHARE * plan.top_speed_m_s(gait), ..Command::default() }
        };
        for walk in ["walk-steady", "walk"] {
            let (slow, fast) = (ahead(walk), ahead("trot"));
            let command = move |s: f64| if s > for_s / 3.0 && s < 2.0 * for_s / 3.0 { fast } else { slow };
            let runs = run_all(&robot, &plan, (seeds, for_s), &command);
            let found = line(&robot, &format!("{walk}, trot, {walk}"), &runs);
            assert_eq!(found.falls, 0, "{name}");
        }
    }
}

#[test]
fn the_horse_stands_at_the_ordered_height() {
    println!("[sag]\n| robot | with | without |\n|---|---|---|");
    for name in ROBOTS {
        let corrected = in_physics(name);
        let mut sagging = corrected.clone();
        sagging.balance =
            corrected.balance.map(|balance| BalanceSettings { sag_correction: false, ..balance });
        let plan = capability(&corrected).plan(&horse_of(&corrected), Command::default());
        let stand = |robot: &Robot| run(robot, &plan, 1, 3.0, 0.0, &|_| Command::default()).last_off_m * 1e3;
        let (with_mm, without_mm) = (stand(&corrected), stand(&sagging));
        println!("| {} | {with_mm:.1} mm | {without_mm:.1} mm |", corrected.name);
        assert!(with_mm.abs() < 2.0 && with_mm.abs() < without_mm.abs(), "{name}");
    }
}
