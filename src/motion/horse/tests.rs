//! Horses driven from command to command, checked through the tips they ask for.

use glam::{DVec2, DVec3};
use proptest::prelude::*;
use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::{Rng, SeedableRng};

use super::look_ahead::PLAN_LOOKS_MAX;
use super::planner::LOOKS_MAX;
use super::{Drive, HorsePlan, LegReach, Pace, ReachTable, Reachable};
use crate::config;
use crate::kinds::horse::HorseCapability;
use crate::model::{Gait, HorseMotion, Robot};
use crate::motion::{Command, GaitChoice, Posture};
use crate::signals::Targets;

/// The thesis' swing time and half-excursion, at full size.
const SWING_S: f64 = 0.3;
const REACH_M: f64 = 0.8;
const HEIGHT_M: f64 = 1.32;
const LIFT_M: f64 = 0.12;
const DT_S: f64 = 0.01;
/// The shortest permitted stance.
const SHORTEST_STANCE_S: f64 = 0.06;

fn shipped() -> Robot {
    config::parse(include_str!("../../../config/horse.toml"), "horse").unwrap().robot
}

fn plan() -> HorsePlan {
    let settings = HorseMotion {
        legs: [0, 1, 2, 3],
        stand_height_m: HEIGHT_M,
        sit_height_m: 1.0,
        swing_time_s: SWING_S,
        swing_lift_m: LIFT_M,
        swing_ramp_share: 0.15,
        acceleration_m_s2: 5.0,
        yaw_rate_max_rad_s: 0.5,
        gaits: Gait::built_in(),
    };
    let sides_m = [0.2, 0.2, -0.2, -0.2];
    let mut plan = HorsePlan {
        neutral_in_body: std::array::from_fn(|leg| {
            DVec3::new(if leg % 2 == 0 { -0.74 } else { 0.62 }, sides_m[leg], -HEIGHT_M)
        }),
        reach: ReachTable {
            level: Reachable {
                half_excursion_m: REACH_M,
                legs: [LegReach::UNLIMITED; 4],
                levels_m: (0.0, LIFT_M),
                half_oscillation_m: 0.0,
            },
            stand_height_m: HEIGHT_M,
            heights_m: vec![],
            pitches_rad: vec![],
            cells: vec![],
            strides: vec![],
            sides_m,
            roll_max_rad: 0.0,
            sway_max_m: 0.0,
        },
        sit_pose_rad: vec![],
        crouch: (0.0, vec![]),
        stays_on_ground: false,
        paces: vec![],
        is_driven: false,
        command: Command::default(),
        settings,
    };
    plan.paces = (0..plan.settings.gaits.len())
        .map(|gait| {
            let top_m_s = plan.top_speed_by_reach_m_s(gait, REACH_M);
            Pace { forward_m_s: top_m_s, backward_m_s: top_m_s }
        })
        .collect();
    plan
}

/// Drives a horse and checks every instant.
struct Watched {
    drive: Drive,
    targets: Targets,
    stance: [Option<(f64, f64)>; 4],
    places: [Option<DVec2>; 4],
    velocities: [Option<DVec2>; 4],
    bounds: [[f64; 2]; 4],
    lift_offs: [Vec<f64>; 4],
    furthest_m: f64,
    shortest_stance_s: f64,
}

impl Watched {
    fn new(plan: &HorsePlan) -> Watched {
        Watched {
            drive: Drive::standing(plan.clone()),
            targets: Targets::new(&shipped()),
            stance: [None; 4],
            places: [None; 4],
            velocities: [None; 4],
            bounds: [[0.0; 2]; 4],
            lift_offs: Default::default(),
            furthest_m: 0.0,
            shortest_stance_s: f64::INFINITY,
        }
    }

    fn step(&mut self, command: Command) {
        self.drive.step(DT_S, Some(command));
        self.drive.write(HEIGHT_M, &mut self.targets);
        let now_s = self.drive.now_s();
        for (leg, foot) in self.targets.feet().iter().enumerate() {
            let neutral = self.drive.plan().neutral_in_body[leg];
            let tip = self.targets.tip_in_body(leg).unwrap();
            let excursion_m = tip.x - neutral.x;
            self.furthest_m = self.furthest_m.max(excursion_m.abs());
            assert!(tip.is_finite() && (tip.y - neutral.y).abs() < 1e-12);
            assert!(excursion_m.abs() <= REACH_M * (1.0 + 1e-9), "leg {leg} at {excursion_m} m, {now_s} s");
            let place = DVec2::new(tip.x + foot.plane_distance_m, tip.z + self.targets.trunk_in_world.z);
            assert!((-1e-12..=LIFT_M + 1e-12).contains(&place.y));
            if foot.is_swing {
                if let Some((_, since_s)) = self.stance[leg].take() {
                    self.lift_offs[leg].push(now_s);
                    // The change is seen at most one cycle late at either end.
                    self.shortest_stance_s = self.shortest_stance_s.min(now_s - since_s + DT_S);
                }
            } else {
                // A foot that stands when the watch begins has stood for a long time.
                let since_s = if self.places[leg].is_some() { now_s } else { f64::NEG_INFINITY };
                let (start_m, _) = *self.stance[leg].get_or_insert((place.x, since_s));
                let slip_m = (place.x - start_m).abs();
                // Tolerance for the rounding of positions some kilometres away.
                assert!(slip_m <= 1e-11, "leg {leg} slips {slip_m} m at {now_s} s");
            }
            let velocity = self.places[leg].map(|before| (place - before) / DT_S);
            if let (Some(now), Some(before)) = (velocity, self.velocities[leg]) {
                let bound = foot.swing_acceleration_m_s2.max(self.bounds[leg][0]).max(self.bounds[leg][1]);
                assert!(now.distance(before) <= bound * DT_S + 1e-8, "leg {leg} jumps at {now_s} s");
            }
            self.bounds[leg] = [foot.swing_acceleration_m_s2, self.bounds[leg][0]];
            self.places[leg] = Some(place);
            self.velocities[leg] = velocity;
        }
        assert!(self.shortest_stance_s >= SHORTEST_STANCE_S);
    }

    /// Continues until `is_done`; returns the time it took, s.
    fn until(&mut self, command: Command, longest_s: f64, is_done: impl Fn(&Drive) -> bool) -> f64 {
        let from_s = self.drive.now_s();
        while !is_done(&self.drive) {
            assert!(self.drive.now_s() < from_s + longest_s, "{command:?} not followed");
            self.step(command);
        }
        self.drive.now_s() - from_s
    }
}

fn command(gait: usize, speed_m_s: f64) -> Command {
    Command { gait: GaitChoice::Gait(gait), speed_m_s, ..Command::default() }
}

fn reached(gait: usize, speed_m_s: f64) -> impl Fn(&Drive) -> bool {
    move |drive| {
        drive.gait() == Some(gait)
            && (drive.velocity().speed_m_s - speed_m_s).abs() < 1e-9
            && drive.walk().strides.is_some_and(|strides| !strides.is_changing(drive.now_s()))
    }
}

#[test]
fn every_gait_begins_reaches_its_speed_and_comes_to_a_stand() {
    let plan = plan();
    for gait in 0..plan.settings.gaits.len() {
        for direction in [1.0, -1.0] {
            let mut horse = Watched::new(&plan);
            horse.step(Command::default());
            let speed = direction * plan.paces[gait].forward_m_s;
            horse.until(command(gait, speed), 20.0, reached(gait, speed));
            let period_s = plan.settings.gaits[gait].period_s(SWING_S);
            horse.lift_offs = Default::default();
            for _ in 0..1000 {
                horse.step(command(gait, speed));
            }
            for leg in 0..4 {
                let gaps = horse.lift_offs[leg].windows(2).map(|pair| pair[1] - pair[0]);
                assert!(gaps.clone().count() > 5);
                assert!(gaps.into_iter().all(|gap| (gap - period_s).abs() <= DT_S + 1e-9));
            }
            horse.until(Command::default(), 20.0, Drive::is_standing);
            for leg in 0..4 {
                let from_neutral = horse.targets.tip_in_body(leg).unwrap() - plan.neutral_in_body[leg];
                assert!(from_neutral.length() < 1e-8, "leg {leg} ends off its neutral point");
            }
        }
    }
}

#[test]
fn every_change_of_gait_from_every_phase_keeps_standing_feet_in_place() {
    let plan = plan();
    let gaits = plan.settings.gaits.len();
    for from in 0..gaits {
        for to in (0..gaits).filter(|to| *to != from) {
            let (before, after) = (0.9 * plan.paces[from].forward_m_s, 0.9 * plan.paces[to].forward_m_s);
            let mut steady = Drive::standing(plan.clone());
            for _ in 0..1000 {
                steady.step(DT_S, Some(command(from, before)));
            }
            let period_s = plan.settings.gaits[from].period_s(SWING_S);
            let mut longest: f64 = 0.0;
            for phase in 0..50 {
                let mut horse = Watched::new(&plan);
                horse.drive = steady.clone();
                let wait_s = period_s * f64::from(phase) / 50.0;
                horse.drive.step(wait_s, Some(command(from, before)));
                horse.until(command(to, after), 20.0, reached(to, after));
                let clock = horse.drive.walk().strides.unwrap().clock;
                longest =
                    longest.max(clock.phase(clock.change_end_s()) - clock.phase(clock.change_start_s()));
                for _ in 0..100 {
                    horse.step(command(to, after));
                }
            }
            let name = |gait: usize| &plan.settings.gaits[gait].name;
            println!("{} -> {}: {longest:.2} strides", name(from), name(to));
            assert!(longest <= 4.0);
        }
    }
}

#[test]
fn in_a_turn_every_leg_has_its_own_stride_and_none_slips_in_its_plane() {
    let plan = plan();
    let mut horse = Watched::new(&plan);
    horse.step(Command::default());
    let turning = Command { yaw_rate_rad_s: 0.3, ..command(2, 2.0) };
    horse.until(turning, 10.0, |drive| (drive.velocity().yaw_rate_rad_s - 0.3).abs() < 1e-9);
    let (from, from_s) = (horse.targets.trunk_in_world, horse.drive.now_s());
    // Once round a circle of radius V / w.
    while horse.drive.now_s() - from_s < std::f64::consts::TAU / 0.3 - 0.5 * DT_S {
        horse.step(turning);
    }
    assert!(horse.targets.trunk_in_world.distance(from) < 2.0 * DT_S);
}

#[test]
fn by_speed_alone_the_horse_goes_through_the_gaits_up_and_down() {
    let plan = plan();
    let mut horse = Watched::new(&plan);
    horse.step(Command::default());
    let mut taken = Vec::new();
    for (speed_m_s, lasts_s) in [(12.0, 40.0), (0.5, 40.0), (0.0, 20.0)] {
        let until_s = horse.drive.now_s() + lasts_s;
        while horse.drive.now_s() < until_s {
            horse.step(Command { gait: GaitChoice::Auto, speed_m_s, ..Command::default() });
            let gait = horse.drive.gait();
            if taken.last() != Some(&gait) {
                taken.push(gait);
            }
        }
        assert!((horse.drive.velocity().speed_m_s - speed_m_s).abs() < 1e-9, "{speed_m_s} is not reached");
    }
    let name = |gait: &Option<usize>| gait.map_or("stand", |gait| plan.settings.gaits[gait].name.as_str());
    let names: Vec<&str> = taken.iter().map(name).collect();
    assert_eq!(
        names,
        ["walk", "trot", "canter", "gallop", "canter", "trot", "walk", "stand"],
        "each once, none to and fro"
    );
}

/// However hard it is to find a way to follow a request, no cycle checks more than the limit. The request leaves hardly
/// any room in this horse's postures: a cycle that tried all ways would check 8141 stances and swings here.
#[test]
fn no_cycle_examines_more_plans_than_its_time_allows() {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("config/thoroughbred.toml");
    let robot = config::load(&path).unwrap().robot;
    let horse = robot.motion.horse().unwrap();
    let plan = HorseCapability::of(&robot, horse).unwrap().plan(horse, Command::default());
    let mut source = Pcg64Mcg::seed_from_u64(39);
    let mut draw = move |from: f64, to: f64| {
        from + (to - from) * (source.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
    };
    let mut drive = Drive::standing(plan);
    let mut most = 0;
    for _ in 0..10 {
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 to 8")]
        let gait = GaitChoice::Gait(draw(0.0, 8.99) as usize);
        let posture = Posture {
            rise_m: draw(-0.1, 0.03),
            pitch_rad: draw(-0.15, 0.15),
            roll_rad: draw(-0.15, 0.15),
            ..Posture::default()
        };
        let yaw_rate_rad_s = draw(-0.5, 0.5);
        let command = Command { gait, speed_m_s: draw(-1.0, 6.0), yaw_rate_rad_s, posture };
        let until_s = drive.now_s() + draw(0.0, 4.0);
        while drive.now_s() < until_s {
            drive.step(robot.period_s(), Some(command));
            most = most.max(drive.looked());
        }
    }
    assert!(most > LOOKS_MAX, "{most}: nothing was hard here");
    assert!(most <= LOOKS_MAX + 2 * PLAN_LOOKS_MAX, "{most}");
}

/// Requests of an operator who changes their mind.
fn any_command() -> impl Strategy<Value = (f64, Command)> {
    let gait = prop_oneof![
        1 => Just(GaitChoice::Stand),
        2 => Just(GaitChoice::Auto),
        5 => (0_usize..9).prop_map(GaitChoice::Gait)
    ];
    (0.0..5.0, gait, -8.0..14.0, -0.8..0.8).prop_map(|(lasts_s, gait, speed_m_s, yaw_rate_rad_s)| {
        (lasts_s, Command { gait, speed_m_s, yaw_rate_rad_s, posture: Posture::default() })
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn any_order_at_any_time_keeps_standing_feet_in_place(
        requests in prop::collection::vec(any_command(), 1..12),
    ) {
        let mut horse = Watched::new(&plan());
        horse.step(Command::default());
        for (lasts_s, command) in requests {
            let until_s = horse.drive.now_s() + lasts_s;
            while horse.drive.now_s() < until_s {
                horse.step(command);
            }
        }
        horse.until(Command::default(), 30.0, Drive::is_standing);
    }
}
