//! The arm of config/tentacle.toml: every stroke, every change of stroke, shows, servos that trip.
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a test may panic; counts and times are small"
)]

mod common;

use std::cell::{Cell, RefCell};
use std::f64::consts::TAU;

use common::arm::{Arm, chance, plan, strokes};
use common::{SharedPorts, goal_counts, is_full, rate_counts_s, servo, shipped};
use glam::DVec3;
use hippocamp::bus::Slot;
use hippocamp::cycle::Controller;
use hippocamp::ik::Method;
use hippocamp::kinds::tentacle::Show;
use hippocamp::model::{Motion, Pole, Robot, TrippedServoPolicy};
use hippocamp::motion::{Activity, Order, Place, Stroke, StrokeCommand};
use hippocamp::observe::Observer;
use hippocamp::plan::RunPlan;
use hippocamp::run::run;
use hippocamp::signals::Status;
use hippocamp::signals::{Feedback, ImuReading, Permission, Question, ServoAnswer, ServoGoal};
use hippocamp::simulation;
use hippocamp::telemetry::{Outcome, Report, Telemetry};
use hw_sim::FaultScript;
use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::SeedableRng;

#[test]
fn any_stroke_follows_any_other_from_any_phase_within_the_joints_limits() {
    let robot = shipped("tentacle.toml");
    let strokes = strokes(&robot);
    let stroke_s = robot.motion.tentacle().unwrap().stroke_time_s;
    for from in &strokes {
        let mut arm = Arm::awake(&robot);
        for (number, to) in strokes.iter().enumerate() {
            for phase in [0.1, 0.35, 0.6, 0.85] {
                // A different moment of the stroke each time; winding takes longest to be under way.
                let until_s = stroke_s * (phase + 0.9 + f64::from(u32::try_from(number).unwrap()) * 0.03);
                arm.perform(StrokeCommand::of(*from), until_s);
                arm.interventions = 0;
                arm.perform(StrokeCommand::of(*to), 2.5);
                // Of 6000 goals: a joint may brush its limit where two motions overlap.
                let changed = arm.interventions;
                assert!(changed <= 10, "{from:?} to {to:?} at {phase}: {changed} goals held back by safety");
            }
        }
    }
}

#[test]
fn a_thousand_random_scripts_keep_every_limit() {
    let robot = shipped("tentacle.toml");
    let strokes = strokes(&robot);
    let mut source = Pcg64Mcg::seed_from_u64(22);
    let mut arm = Arm::awake(&robot);
    for _ in 0..1000 {
        for _ in 0..3 {
            let mut pick = |count: usize| (chance(&mut source) * count as f64) as usize % count;
            let mut stroke = strokes[pick(strokes.len())];
            let point = DVec3::new(chance(&mut source) - 0.5, chance(&mut source) - 0.5, chance(&mut source));
            if let Place::Point { .. } = stroke.place {
                let direction = (chance(&mut source) < 0.5).then_some(point.normalize());
                stroke = Stroke { place: Place::Point { in_body: 0.6 * point, direction }, ..stroke };
            }
            let mut command = StrokeCommand {
                stroke,
                tempo: 2.0 * chance(&mut source),
                turn_rad: 0.5 * TAU * (chance(&mut source) - 0.5),
            };
            if chance(&mut source) < 0.02 {
                command.tempo = f64::NAN;
            }
            arm.perform(command, 0.2 + 2.0 * chance(&mut source));
        }
    }
}

/// A run of `robot` on simulated buses on a virtual clock, driven by `order`; the goal registers of its servos are
/// checked in every cycle.
fn watched(robot: &Robot, plan: RunPlan, faults: &str, order: impl Fn(f64) -> Order) -> Report {
    watched_by(robot, plan, faults, |status| order(status.time_s))
}

/// The same, driven by an operator that gets the whole status.
fn watched_by(robot: &Robot, plan: RunPlan, faults: &str, order: impl Fn(&Status) -> Order) -> Report {
    let faults = FaultScript::from_toml(faults).unwrap();
    let ports = SharedPorts::new(simulation::world(robot, 1, &faults).unwrap());
    let eye = ports.clone();
    let mut before: Vec<Option<i32>> = vec![None; robot.joints.len()];
    let report = run(robot, plan, ports, |status: &Status| {
        let ports = eye.borrow();
        for (joint, before) in robot.joints.iter().zip(&mut before) {
            let servo = servo(joint);
            let register = servo.model.registers.goal_position;
            let bytes = (0..register.bytes).map(|place| {
                ports.world().register(servo.bus, servo.id.0, register.address + u16::from(place)).unwrap()
            });
            let goal = bytes.rev().fold(0, |value, byte| value << 8 | i32::from(byte));
            let has_torque = ports.world().shaft(servo.bus, servo.id.0).unwrap().torque_on;
            let (low, high) = goal_counts(joint);
            // On the way in from outside its range a joint may be where it is.
            if has_torque && status.activity == Activity::Performing {
                let goal_counts = f64::from(goal);
                assert!(goal_counts >= low - 1e-6 && goal_counts <= high + 1e-6, "{}: {goal}", joint.name);
                if let Some(before) = *before {
                    let step = rate_counts_s(robot, joint) * robot.period_s() + 1.0;
                    assert!(
                        f64::from((goal - before).abs()) <= step + 1e-6,
                        "{}: {before} to {goal}",
                        joint.name
                    );
                }
            }
            *before = has_torque.then_some(goal);
        }
        order(status)
    });
    report.unwrap()
}

fn run_plan(robot: &Robot, stroke: Stroke, move_for_s: f64) -> RunPlan {
    let motion = plan(robot, StrokeCommand::of(stroke)).into();
    RunPlan { motion, method: Method::CcdThenFinish, move_for_s, driver: None }
}

#[test]
fn every_stroke_runs_on_the_servos_and_ends_parked_and_limp() {
    let robot = shipped("tentacle.toml");
    let arm_m = robot.chains[0].length_m(robot.joints_of(&robot.chains[0]));
    for stroke in strokes(&robot) {
        let report = watched(&robot, run_plan(&robot, stroke, 11.0), "", |_| Order::Go);
        assert_eq!(report.outcome, Outcome::Completed, "{stroke:?}: {}", report.reason);
        assert!(report.is_end_heard);
        assert_eq!((report.joints.range_violations, report.joints.rate_violations), (0, 0), "{stroke:?}");
        let arms = report.arms.unwrap();
        if ["sway", "walk", "swim"].contains(&stroke.name) {
            assert!(arms.group_residual_max_m <= 0.02 * arm_m, "{stroke:?}: {arms:?}");
        }
        assert!(arms.bend_max_deg < 95.0, "{stroke:?}: {arms:?}");
        assert!(report.feet.is_none() && report.gait.is_none());
    }
}

/// Distances of the middle of the arm's outer two groups from the pole's surface grown by the arm's radius, m, by places
/// along the links.
fn off_pole_m(robot: &Robot, goals: &[f64], pole: Pole) -> Vec<f64> {
    let radius_m = robot.motion.tentacle().unwrap().arms[0].radius_m;
    let places = robot.places_in_body(&robot.chains[0], goals.iter().copied());
    let off_m =
        |place: DVec3| (place - pole.point_in_body).cross(pole.axis).length() - pole.radius_m - radius_m;
    let shares = (0..20).map(|part| f64::from(part) / 20.0);
    places[8..]
        .windows(2)
        .flat_map(|pair| shares.clone().map(|share| off_m(pair[0].lerp(pair[1], share))))
        .collect()
}

/// A pole before the arm, of a radius of so many of its links.
fn pole_of(links: f64) -> Pole {
    Pole {
        point_in_body: DVec3::new(0.045 + 0.034 * links, 0.0, 0.12),
        axis: DVec3::Y,
        radius_m: 0.034 * links,
    }
}

#[test]
fn a_wound_arm_lies_on_its_pole_and_no_link_enters_it() {
    let mut robot = shipped("tentacle.toml");
    // As the winding put it, before it grips.
    let Motion::Tentacle(tentacle) = &mut robot.motion else { panic!("no arm") };
    tentacle.grip_share = 0.0;
    for links in [1.5, 2.5, 4.0] {
        let pole = pole_of(links);
        // As fast as it can.
        let command = StrokeCommand {
            tempo: 4.0,
            ..StrokeCommand::of(Stroke { name: "wind", place: Place::Pole(pole) })
        };
        let mut arm = Arm::awake(&robot);
        arm.perform(command, 14.0);
        assert_eq!(arm.interventions, 0, "pole of {links} links: faster than the servos");
        let offs = off_pole_m(&robot, &arm.goals[0], pole);
        let near = offs.iter().filter(|off| **off <= 0.1 * pole.radius_m).count() as f64 / offs.len() as f64;
        println!(
            "{links} links: {near} of the outer groups near, {:?}",
            offs.iter().copied().fold(f64::INFINITY, f64::min)
        );
        assert!(near >= 0.7, "pole of {links} links: {near} of the outer groups on it");
        assert!(offs.iter().all(|off| *off >= 0.0), "pole of {links} links: inside it");
        arm.perform(StrokeCommand { tempo: 4.0, ..StrokeCommand::of(Stroke::LET_GO) }, 12.0);
        assert_eq!(arm.interventions, 0, "pole of {links} links: unwound faster than the servos");
    }
}

/// A servo bears no load unless its goal lies beyond where the pole lets its joint be: goals of an arm that grips are in the
/// pole, as deep as its skin gives at most. Here nothing presses back, which is the deepest.
#[test]
fn the_goals_of_a_grip_are_no_deeper_than_the_skin_gives() {
    let robot = shipped("tentacle.toml");
    let radius_m = robot.motion.tentacle().unwrap().arms[0].radius_m;
    for links in [1.5, 2.5, 4.0] {
        let pole = pole_of(links);
        let mut arm = Arm::awake(&robot);
        arm.perform(StrokeCommand::of(Stroke { name: "wind", place: Place::Pole(pole) }), 14.0);
        let deepest_m = off_pole_m(&robot, &arm.goals[0], pole).into_iter().fold(f64::INFINITY, f64::min);
        assert!(
            (-0.31 * radius_m..-0.2 * radius_m).contains(&deepest_m),
            "pole of {links} links: {deepest_m} m"
        );
    }
}

#[test]
fn an_emergency_stop_from_any_stroke_ends_limp() {
    let robot = shipped("tentacle.toml");
    for stroke in strokes(&robot) {
        let stop = |time_s: f64| if time_s > 12.0 { Order::StopAtOnce } else { Order::Go };
        let report = watched(&robot, run_plan(&robot, stroke, 1e9), "", stop);
        assert_eq!(report.outcome, Outcome::Completed, "{stroke:?}: {}", report.reason);
        assert!(report.is_end_heard, "{stroke:?}");
        assert!(report.duration_s < 25.0, "{stroke:?}: {} s", report.duration_s);
    }
}

#[test]
fn servos_that_trip_freeze_their_joint_and_are_restarted_when_parked() {
    let robot = shipped("tentacle.toml");
    let overload = |at_s: f64, bus: &str, id: u8| {
        format!("[[fault]]\nkind = 'overload'\nat_s = {at_s}\nfor_s = 0.05\nbus = '{bus}'\nid = {id}\n")
    };
    let faults = overload(12.0, "root", 3) + &overload(13.0, "tip", 20);
    let order = |time_s: f64| {
        let stroke = match time_s {
            ..20.0 => Stroke::of("walk"),
            20.0..32.0 => Stroke::PARK,
            32.0..40.0 => Stroke::of("swim"),
            _ => return Order::Stop,
        };
        Order::Perform(StrokeCommand::of(stroke))
    };
    let report = watched(&robot, run_plan(&robot, Stroke::REST, 1e9), &faults, order);
    assert_eq!(report.outcome, Outcome::Completed, "{}", report.reason);
    assert_eq!(report.servo_restarts, 2);
    let told: Vec<&str> = report.outages.iter().map(|outage| outage.joint.as_str()).collect();
    assert_eq!(told, ["arm.lift_2", "arm.sweep_10"]);
    let words =
        "joint arm.lift_2 (servo 3 on bus root) is left without torque: its servo has tripped: overload";
    assert!(report.outages[0].reason.starts_with(words), "{}", report.outages[0].reason);
    assert_eq!((report.joints.range_violations, report.joints.rate_violations), (0, 0));
}

#[test]
fn a_jammed_joint_goes_limp_and_the_show_continues_without_it() {
    let mut robot = shipped("tentacle.toml");
    let jam = "[[fault]]\nkind = 'stuck'\nat_s = 12.0\nfor_s = 10.0\nbus = 'root'\nid = 3";
    let order = |time_s: f64| {
        let stroke = match time_s {
            ..20.0 => Stroke::of("walk"),
            20.0..32.0 => Stroke::PARK,
            32.0..40.0 => Stroke::of("swim"),
            _ => return Order::Stop,
        };
        Order::Perform(StrokeCommand::of(stroke))
    };
    // Times of the cycles held once the jam began, and when the joint was in service again.
    let (late_holds, back_s) = (RefCell::new(Vec::new()), Cell::new(0.0));
    let walked = |robot: &Robot| {
        let (held, frozen) = (Cell::new(0), Cell::new([0; 2]));
        late_holds.borrow_mut().clear();
        let report = watched_by(robot, run_plan(robot, Stroke::REST, 1e9), jam, |status| {
            let is_walk = (12.0..20.0).contains(&status.time_s);
            held.set(held.get() + u32::from(is_walk && status.permission != Permission::Move));
            if status.time_s > 11.0 && status.permission == Permission::Hold {
                late_holds.borrow_mut().push(status.time_s);
            }
            let [most, last] = frozen.get();
            let now = status.frozen;
            if now < most && back_s.get() == 0.0 {
                back_s.set(status.time_s);
            }
            frozen.set([most.max(now), if status.time_s < 36.0 { now } else { last }]);
            order(status.time_s)
        });
        (report, held.get(), frozen.get())
    };
    let (report, held, frozen) = walked(&robot);
    assert_eq!(report.outcome, Outcome::Completed, "{}", report.reason);
    assert_eq!(
        (held, frozen),
        (0, [1, 0]),
        "cycles held in the walk; joints out at most, and in the last stroke"
    );
    assert_eq!(report.servo_restarts, 0, "let go before it tripped");
    assert!(report.outages[0].reason.contains("(servo 3 on bus root)"), "{:?}", report.outages);
    assert!(report.outages[0].reason.contains("does not follow its goal"), "{:?}", report.outages);
    assert_eq!((report.joints.range_violations, report.joints.rate_violations), (0, 0));
    // The arms are held while the joint, free and in service again, goes slowly from where the jam held it to where the
    // others are parked: one stretch, from the cycle it is back, no longer than the slow way across its range. They are
    // parked then, and nothing else holds them.
    let holds = late_holds.borrow().clone();
    let period_s = robot.period_s();
    let (low, high) = robot.joints[2].range_rad;
    let longest_s = (high - low) / robot.safety.slow_rate_rad_s;
    assert!((holds[0] - back_s.get()).abs() < 1.5 * period_s, "{} s, back at {} s", holds[0], back_s.get());
    assert!(holds.windows(2).all(|pair| pair[1] - pair[0] < 1.5 * period_s), "{holds:?}");
    assert!((holds.len() as f64) * period_s < longest_s, "{} cycles", holds.len());
    assert!((20.0..32.0).contains(&holds[0]) && *holds.last().unwrap() < 32.0, "{holds:?}");
    // The same jam stops a robot whose file says "stop".
    robot.safety.tripped_servo = TrippedServoPolicy::Stop;
    let (report, held, _) = walked(&robot);
    assert!(report.outcome != Outcome::Completed && held > 0, "{}", report.reason);
}

/// What is asked of one servo, or of its bus.
struct Orders {
    restart: Option<usize>,
    question: Option<(usize, Question)>,
}

/// Servos that are always at their goals, except for random trips and lost replies; motion warms them.
struct Servos {
    slots: Vec<Slot>,
    positions: Vec<i32>,
    alarmed: Vec<bool>,
    /// Cycles for which each is away after a restart.
    away: Vec<u32>,
    warmth_c: f64,
    source: Pcg64Mcg,
    trips: u64,
}

impl Servos {
    fn exchange(&mut self, goals: &[ServoGoal], orders: Orders, is_moving: bool) {
        let Orders { restart, question } = orders;
        // Half a minute of strokes warms by a kelvin, and cools again; so a show gets hot now and then.
        let hot_c = if is_moving { 45.0 } else { 0.0 };
        self.warmth_c += (hot_c - self.warmth_c) * 2e-5;
        for (index, goal) in goals.iter().enumerate() {
            if restart == Some(index) {
                self.alarmed[index] = false;
                self.away[index] = 10;
            }
            let [trip, loss] = [1e-6, 2e-3].map(|likely| chance(&mut self.source) < likely);
            if trip && *goal != ServoGoal::Limp && !self.alarmed[index] {
                self.alarmed[index] = true;
                self.trips += 1;
            }
            match goal {
                ServoGoal::Move { position, .. } if !self.alarmed[index] && self.away[index] == 0 => {
                    self.positions[index] = *position;
                }
                _ => {}
            }
            let is_away = self.away[index] > 0;
            self.away[index] = self.away[index].saturating_sub(1);
            // On their bus no servo is asked in the cycle of a restart, nor for feedback in the cycle of a
            // question.
            let is_with = |of: Option<usize>| of.is_some_and(|of| (of < 12) == (index < 12));
            self.slots[index] = match question {
                _ if is_away || loss || is_with(restart) => Slot::Missing,
                Some((of, Question::Alarms)) if is_with(Some(of)) => {
                    Slot::Answered(ServoAnswer::Alarms(if self.alarmed[index] { 0x20 } else { 0 }))
                }
                // Only servos that were ordered to restart have restarted.
                Some((of, Question::Torque)) if is_with(Some(of)) => {
                    Slot::Answered(ServoAnswer::Torque(true))
                }
                _ => Slot::Fresh(Feedback {
                    position: self.positions[index],
                    voltage_decivolt: 50,
                    temperature_c: (30.0 + self.warmth_c) as u8,
                    alarms: if self.alarmed[index] { 0x80 } else { 0 },
                    ..Feedback::default()
                }),
            };
        }
    }
}

/// Four minutes of the show at the loop's own rate, all bytes on simulated buses, on servos that trip by chance (a trip in
/// half a minute, which is what a restart while parked can keep up with) and a line that loses and damages replies. Each
/// stays silent for less than it may. With `HIPPOCAMP_FULL` set, eight hours of it.
#[test]
fn a_show_on_the_buses_continues_through_random_trips_and_lost_replies() {
    let robot = shipped("tentacle.toml");
    let tentacle = robot.motion.tentacle().unwrap();
    let mut source = Pcg64Mcg::seed_from_u64(11);
    let minutes = if is_full() { 480.0 } else { 4.0 };
    let (mut faults, mut trips) = (String::new(), 0);
    let mut at_s = 20.0;
    while at_s < 60.0 * minutes {
        let joint = &robot.joints[(chance(&mut source) * 24.0) as usize];
        let servo = servo(joint);
        let place = format!("bus = '{}'\nid = {}\n", robot.buses[servo.bus].name, servo.id.0);
        let (kind, for_s) = match chance(&mut source) {
            ..0.3 => ("overload", 0.05),
            // A reply that comes three cycles late is lost, and so is the next one.
            0.3..0.6 => ("slow", 0.05 * chance(&mut source) + 0.005),
            0.6..0.8 => ("bit-flip", 0.08),
            _ => ("garbled", 0.08),
        };
        trips += u64::from(kind == "overload");
        faults += &format!("[[fault]]\nkind = '{kind}'\nat_s = {at_s}\nfor_s = {for_s}\n{place}");
        if kind == "slow" {
            faults += "delay_ms = 30\n";
        }
        at_s += 12.0 * chance(&mut source) + 0.1;
    }
    let show = RefCell::new(Show::new(&robot, Show::of_all_strokes(tentacle, 60.0 * minutes)));
    let last_minute = Cell::new(0);
    let mut plan = run_plan(&robot, Stroke::REST, 1e9);
    plan.driver = Some("a show".to_owned());
    let report = watched_by(&robot, plan, &faults, |status| {
        let is_moving = status.time_s > 60.0 * (minutes - 1.0) && status.activity == Activity::Performing;
        last_minute.set(last_minute.get() + u32::from(is_moving));
        show.borrow_mut().instruction(status).0.order
    });
    assert_eq!(report.outcome, Outcome::Completed, "{}", report.reason);
    assert_eq!((report.joints.range_violations, report.joints.rate_violations), (0, 0));
    assert!(last_minute.get() > 3000, "it moved for {} of the last 6000 cycles", last_minute.get());
    // The report keeps this many of them.
    let told = (trips / 2).min(256);
    assert!(trips >= 5 && report.outages.len() as u64 >= told, "{trips} trips: {:?}", report.outages);
    assert!(report.servo_restarts >= trips / 2, "{} restarts after {trips} trips", report.servo_restarts);
    assert!(report.buses.iter().all(|bus| bus.missing > 20 && bus.corrupt > 10), "{:?}", report.buses);
    let lost: u64 = report.buses.iter().map(|bus| bus.missing + bus.corrupt).sum();
    println!("{minutes} minutes: {trips} trips, {} restarts, {lost} replies lost", report.servo_restarts);
}

/// Eight hours at a fifth of the loop's rate, on servos without buses; the test above runs minutes of the same with
/// all bytes on simulated buses.
#[test]
fn a_show_continues_for_eight_hours_of_trips_and_lost_replies() {
    let mut robot = shipped("tentacle.toml");
    robot.rate_hz = 20.0;
    let tentacle = robot.motion.tentacle().unwrap();
    let mut show = Show::new(&robot, Show::of_all_strokes(tentacle, 1e9));
    let mut controller =
        Controller::new(&robot, plan(&robot, StrokeCommand::default()), Method::CcdThenFinish, f64::MAX);
    let mut telemetry = Telemetry::new(&robot);
    let middle = robot.joints.iter().map(|joint| servo(joint).count_of(0.0) as i32);
    let count = robot.joints.len();
    let mut servos = Servos {
        slots: vec![Slot::Missing; count],
        positions: middle.collect(),
        alarmed: vec![false; count],
        away: vec![0; count],
        warmth_c: 0.0,
        source: Pcg64Mcg::seed_from_u64(6),
        trips: 0,
    };
    let (dt_s, hours) = (robot.period_s(), 8.0);
    let cycles = (hours * 3600.0 * robot.rate_hz) as u64;
    let (mut performed, mut cooled, mut hottest_c, mut restarts) = (0_u64, 0_u64, 0.0_f64, 0_u64);
    let mut activity = Activity::Limp;
    for cycle in 0..cycles {
        let status = Status {
            time_s: cycle as f64 * dt_s,
            activity,
            permission: controller.record(&servos.slots).state.permission,
            hottest_c: 30.0 + servos.warmth_c,
            ..Status::LIMP
        };
        let (instruction, note) = show.instruction(&status);
        cooled += u64::from(note.is_some_and(|note| note.contains("hot")));
        let goals = controller.decide(dt_s, instruction.order);
        let restart = goals.restart();
        restarts += u64::from(restart.is_some());
        let orders = Orders { restart, question: goals.question() };
        let goals = goals.servos().to_vec();
        servos.exchange(&goals, orders, activity == Activity::Performing);
        controller.learn(dt_s, &servos.slots, &ImuReading::default());
        let record = controller.record(&servos.slots);
        telemetry.observe(&record);
        activity = record.facts.activity;
        assert_ne!(record.state.permission, Permission::Stop, "stopped after {} s", status.time_s);
        hottest_c = hottest_c.max(status.hottest_c);
        // The last half hour counts: it still moves.
        performed += u64::from(activity == Activity::Performing && cycles - cycle < 1800 * 20);
    }
    let joints = telemetry.joints_report();
    assert_eq!((joints.range_violations, joints.rate_violations), (0, 0), "{joints:?}");
    assert!(servos.trips > 5, "{} trips", servos.trips);
    assert!(restarts >= servos.trips / 2, "{restarts} restarts after {} trips", servos.trips);
    assert!(servos.alarmed.iter().filter(|alarmed| **alarmed).count() <= 2, "trips are healed");
    assert!(cooled > 0 && hottest_c <= robot.safety.temperature_c, "{cooled} times hot, {hottest_c} C");
    assert!(performed > 600 * 20, "it moved for {performed} of the last 36000 cycles");
}

/// A person turns a joint of the arm with more torque than the arm should resist, and releases it.
#[test]
fn a_pulled_arm_yields_on_its_servos_and_returns() {
    let robot = shipped("tentacle.toml");
    let of = servo(&robot.joints[2]);
    let place = robot.joints[..2].iter().filter(|joint| servo(joint).bus == of.bus).count();
    let pull_nm = 0.8 * of.model.stall_torque_nm;
    let ports = SharedPorts::new(simulation::world(&robot, 1, &FaultScript::default()).unwrap());
    let hand = ports.clone();
    let rests_at = Cell::new(0.0);
    let mut seen: Vec<(f64, f64)> = Vec::new();
    let report = run(&robot, run_plan(&robot, Stroke::REST, 1e9), ports, |status: &Status| {
        let counts = hand.borrow().world().shaft(of.bus, of.id.0).unwrap().position_counts;
        let angle = counts * of.count_rad();
        if status.time_s < 20.0 {
            rests_at.set(angle);
        }
        // As far as a hand would.
        let is_pulled = (20.0..21.0).contains(&status.time_s) && angle < rests_at.get() + 0.9;
        hand.load(of.bus, place, if is_pulled { pull_nm } else { 0.0 });
        seen.push((status.time_s, angle));
        if status.time_s < 30.0 { Order::Go } else { Order::Stop }
    });
    let report = report.unwrap();
    assert_eq!(report.outcome, Outcome::Completed, "{}", report.reason);
    assert_eq!((report.joints.range_violations, report.joints.rate_violations), (0, 0));
    let at = |s: f64| seen.iter().find(|(time_s, _)| *time_s >= s).unwrap().1;
    let before = rests_at.get();
    // Its servo holds it at first, then it moves against viscosity only.
    assert!((at(20.2) - before).abs() < 0.5, "{} rad at once", at(20.2) - before);
    assert!((at(21.0) - before).abs() > 0.3, "it gave way by {} rad", at(21.0) - before);
    assert!((at(29.0) - before).abs() < 0.02, "{} rad off after it returned", at(29.0) - before);
    let steepest = seen.windows(2).filter(|pair| pair[0].0 > 21.5 && pair[1].0 < 29.0);
    let steepest = steepest.map(|pair| (pair[1].1 - pair[0].1).abs() / robot.period_s()).fold(0.0, f64::max);
    assert!(steepest < 2.0, "it snaps back at {steepest} rad/s");
}

/// Its servos fall silent during a change of motion: the joint targets stay until they answer again, and the change
/// continues from there.
#[test]
fn a_change_of_motion_waits_while_safety_holds() {
    let robot = shipped("tentacle.toml");
    let dt_s = robot.period_s();
    let mut arm = Arm::awake(&robot);
    arm.perform(StrokeCommand::of(Stroke::of("swim")), 3.0);
    let walk = StrokeCommand::of(Stroke::of("walk"));
    arm.perform(walk, 0.1);
    let silent = vec![Slot::Missing; robot.joints.len()];
    let (mut held, mut wanted) = (0, Vec::new());
    let mut silent_s = 0.0;
    while held < 20 {
        arm.controller.decide(dt_s, Order::Perform(walk));
        let record = arm.controller.record(&silent);
        if record.facts.is_held {
            assert!(held == 0 || record.joints.angles_rad == wanted, "cycle {held} of the hold");
            held += 1;
        }
        wanted.clone_from(&record.joints.angles_rad);
        arm.controller.learn(dt_s, &silent, &ImuReading::default());
        silent_s += dt_s;
        assert!(silent_s < 1.0, "it was held for {held} cycles");
    }
}
