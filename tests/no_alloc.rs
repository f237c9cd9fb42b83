//! The controller's cycle allocates nothing after the first: any allocation aborts this test. The simulated buses
//! may allocate.

mod common;

use std::process::Command;
use std::time::Duration;

use assert_no_alloc::{AllocDisabler, assert_no_alloc, permit_alloc};
use common::arm::{self, strokes};
use common::{ROBOTS, capability, in_physics, plan, shipped};
use glam::DVec3;
use hippocamp::bus::{Buses, PortError, Ports, SimPorts};
use hippocamp::config;
use hippocamp::cycle::Controller;
use hippocamp::ik::{Limbs, Method};
use hippocamp::kinds::figure::FigureCapability;
use hippocamp::kinds::tentacle::Show;
use hippocamp::kinds::tentacle::TentacleCapability;
use hippocamp::model::Robot;
use hippocamp::motion::{Activity, Command as MotionOptions, Order, Place, Plan, StrokeCommand};
use hippocamp::observe::Observer;
use hippocamp::platform::{Meter, Usage};
use hippocamp::run::Cycle;
use hippocamp::signals::Status;
use hippocamp::signals::{JointTargets, Permission, Targets};
use hippocamp::simulation;
use hippocamp::telemetry::Telemetry;
use hippocamp::units::Time;
use hw_sim::FaultScript;

#[global_allocator]
static ALLOCATOR: AllocDisabler = AllocDisabler;

/// Set in the child process that shows that an allocation is caught.
const ALLOCATE: &str = "HIPPOCAMP_TEST_MAY_NOT_ALLOCATE";

/// All faults at once while it walks, and at last a servo that stays silent.
const FAULTS: &str = "
    [[fault]]
    kind = 'bit-flip'
    at_s = 4.5
    for_s = 0.08

    [[fault]]
    kind = 'noise'
    at_s = 5.0
    for_s = 0.08

    [[fault]]
    kind = 'echo'
    at_s = 5.2
    for_s = 0.5

    [[fault]]
    kind = 'unplugged'
    at_s = 6.0
    for_s = 0.3

    [[fault]]
    kind = 'late-host'
    at_s = 7.0
    delay_ms = 300

    [[fault]]
    kind = 'silent'
    at_s = 8.0
    bus = 'BUS'
    id = 3
";

/// Simulated ports, in which allocating is permitted or not.
struct PermittingPorts {
    ports: SimPorts,
    meter: Meter,
    permits: bool,
}

impl PermittingPorts {
    fn with<T>(&mut self, act: impl FnOnce(&mut SimPorts) -> T) -> T {
        let ports = &mut self.ports;
        if self.permits { permit_alloc(|| act(ports)) } else { act(ports) }
    }
}

impl Ports for PermittingPorts {
    fn usage(&mut self) -> Usage {
        self.meter.usage()
    }

    fn now(&mut self) -> Time {
        self.with(SimPorts::now)
    }

    fn discard_input(&mut self, bus: usize) -> Result<(), PortError> {
        self.with(|ports| ports.discard_input(bus))
    }

    fn send(&mut self, bus: usize, bytes: &[u8]) -> Result<(), PortError> {
        self.with(|ports| ports.send(bus, bytes))
    }

    fn receive(&mut self, bus: usize, into: &mut [u8]) -> Result<usize, PortError> {
        self.with(|ports| ports.receive(bus, into))
    }

    fn receive_imu(&mut self, into: &mut [u8]) -> Result<usize, PortError> {
        self.with(|ports| ports.receive_imu(into))
    }

    fn wait_for_input(&mut self, deadline: Time) {
        self.with(|ports| ports.wait_for_input(deadline));
    }

    fn wait_until(&mut self, deadline: Time) {
        self.with(|ports| ports.wait_until(deadline));
    }
}

/// Runs `robot` from limp to limp, cycle by cycle; returns its activities and permissions, each once.
fn run(robot: &Robot, permits: bool) -> (Vec<Activity>, Vec<Permission>) {
    let plan = plan(robot, "walk", 0.9);
    let sit_rad = plan.sit_pose_rad.clone();
    run_from(robot, (plan.into(), &sit_rad), (FAULTS, permits), |_, _| Order::Go)
}

/// The same with the plan `motion` from the present joint angles, with `faults`, driven by `order`, which gets time
/// and activity.
fn run_from(
    robot: &Robot,
    (motion, pose_rad): (Plan, &[f64]),
    (faults, permits): (&str, bool),
    mut order: impl FnMut(f64, Activity) -> Order,
) -> (Vec<Activity>, Vec<Permission>) {
    let faults = faults.replace("BUS", &robot.buses[0].name);
    let faults = FaultScript::from_toml(&faults).unwrap_or_else(|error| panic!("{error}"));
    let world = simulation::world_from_pose(robot, pose_rad, 1, &faults).unwrap_or_else(|e| panic!("{e}"));
    let mut buses = Buses::new(
        robot,
        PermittingPorts { ports: SimPorts::on_virtual_clock(world), meter: Meter::default(), permits },
    );
    buses.prepare(robot).unwrap_or_else(|error| panic!("{error}"));

    let mut cycle = Cycle::new(robot, motion, Method::CcdThenFinish, 60.0, buses);
    let period = Duration::from_secs_f64(robot.period_s());
    let mut deadline = cycle.now();
    let (mut activities, mut permissions) = (Vec::new(), Vec::new());
    let mut telemetry = Telemetry::new(robot);
    cycle.step(Order::Go);
    telemetry.observe(&cycle.record());
    cycle.end();
    while cycle.record().facts.activity != Activity::Done {
        deadline = deadline + period;
        assert_no_alloc(|| {
            cycle.begin(deadline);
            let order = order(deadline.as_secs_f64(), cycle.record().facts.activity);
            cycle.step(order);
            telemetry.observe(&cycle.record());
            cycle.end_stage(telemetry.stage());
            cycle.end();
        });
        let record = cycle.record();
        if activities.last() != Some(&record.facts.activity) {
            activities.push(record.facts.activity);
        }
        if permissions.last() != Some(&record.state.permission) {
            permissions.push(record.state.permission);
        }
        assert!(deadline.as_secs_f64() < 60.0, "this run does not end");
    }
    (activities, permissions)
}

#[test]
fn arms_allocate_nothing_in_any_stroke() {
    for name in ["tentacle.toml", "octopus.toml"] {
        let robot = shipped(name);
        let plan = arm::plan(&robot, StrokeCommand::default());
        let mut controller = Controller::new(&robot, plan, Method::CcdThenFinish, f64::MAX);
        let mut orders: Vec<Order> =
            strokes(&robot).into_iter().map(|stroke| Order::Perform(StrokeCommand::of(stroke))).collect();
        orders.push(Order::Stop);
        let mut cycle = |order: Order| {
            controller.decide(robot.period_s(), order);
            controller.learn_from_goals();
        };
        cycle(Order::Go);
        assert_no_alloc(|| {
            for order in &orders {
                // An arm starts in less, and unwinds, parks and goes limp in less.
                let cycles = if order.is_stop() { 3000 } else { 700 };
                (0..cycles).for_each(|_| cycle(*order));
            }
        });
        assert_eq!(controller.record(&[]).facts.activity, Activity::Done, "{name}");
    }
}

#[test]
fn the_cycle_allocates_nothing_from_limp_to_limp() {
    for file in ROBOTS {
        let (activities, permissions) = run(&shipped(file), true);
        use Activity::{Done, Limp, Rising, Standing, Stopping, Walking};
        assert!(
            activities == [Rising, Standing, Walking, Stopping, Done]
                || activities == [Limp, Rising, Standing, Walking, Stopping, Done],
            "{file}: {activities:?}"
        );
        use Permission::{Hold, Move, Stop};
        // The unplugged bus causes a hold that passes, the silent servo one that does not. In the stall Dynamixels
        // stop by themselves, and the controller asks for their positions.
        match shipped(file).joints[0].servo.unwrap().model.registers.bus_watchdog {
            None => assert_eq!(permissions, [Move, Hold, Move, Hold, Stop], "{file}"),
            Some(_) => assert_eq!(permissions, [Move, Hold, Move, Hold, Move, Hold, Stop], "{file}"),
        }
    }
}

/// With weight sharing, sag correction and feedback. Takes two seconds.
#[test]
fn the_cycle_of_a_horse_on_the_ground_allocates_nothing() {
    let robot = in_physics("horse.toml");
    let plan = plan(&robot, "walk-steady", 0.9);
    let sit_rad = plan.sit_pose_rad.clone();
    let order = |s: f64, _| if s < 9.0 { Order::Go } else { Order::Stop };
    let (activities, permissions) = run_from(&robot, (plan.into(), &sit_rad), ("", true), order);
    assert!(activities.contains(&Activity::Walking), "{activities:?}");
    assert_eq!(permissions, [Permission::Move]);
}

/// Pushed over: the key poses of its direction, joints that give way, at rest, limp.
#[test]
fn no_fall_allocates() {
    let push = |at_s: f64, impulse_n_s: f64, direction_deg: f64| {
        format!(
            "[[fault]]\nkind = 'push'\nat_s = {at_s}\nimpulse_n_s = {impulse_n_s}\ndirection_deg = {direction_deg}\n"
        )
    };
    let horse = in_physics("horse.toml");
    let walk = plan(&horse, "walk-steady", 0.9);
    let figure = in_physics("figure.toml");
    let motion = figure.motion.figure().unwrap_or_else(|| panic!("no figure"));
    let stand = FigureCapability::of(&figure, motion).unwrap_or_else(|error| panic!("{error}")).plan(0);
    let [sits, sits_figure] = [walk.sit_pose_rad.clone(), stand.pose_rad[0].clone()];
    for (robot, motion, faults, order) in [
        (&horse, (walk.into(), &sits[..]), push(6.0, 2.4, 90.0), Order::Go),
        (&figure, (stand.into(), &sits_figure[..]), push(16.0, 1.7, 0.0), Order::Take(0)),
    ] {
        let (activities, permissions) = run_from(robot, motion, (&faults, true), |_, _| order);
        let name = &robot.name;
        assert!(
            activities.ends_with(&[Activity::Falling, Activity::Lying, Activity::Done]),
            "{name}: {activities:?}"
        );
        // Joints that the ground pushes past their range are off their goals: this causes only a hold.
        assert!(!permissions.contains(&Permission::Stop), "{name}: {permissions:?}");
    }
}

/// Every stroke, in quick succession; an overload while it walks, which a restart clears once the arms are parked,
/// a servo that restarts, and at last one that stays silent.
const ARM_FAULTS: &str = "
    [[fault]]
    kind = 'bit-flip'
    at_s = 4.5
    for_s = 0.08

    [[fault]]
    kind = 'overload'
    at_s = 6.0
    for_s = 11.0
    bus = 'BUS'
    id = 2

    [[fault]]
    kind = 'unplugged'
    at_s = 9.0
    for_s = 0.3

    [[fault]]
    kind = 'late-host'
    at_s = 10.0
    delay_ms = 300

    [[fault]]
    kind = 'reset'
    at_s = 21.0
    bus = 'BUS'
    id = 4

    [[fault]]
    kind = 'silent'
    at_s = 30.0
    bus = 'BUS'
    id = 3
";

#[test]
fn a_show_of_arms_allocates_nothing_from_limp_to_limp() {
    for file in ["tentacle.toml", "octopus.toml"] {
        let robot = shipped(file);
        let tentacle = robot.motion.tentacle().unwrap();
        let plan = TentacleCapability::of(&robot, tentacle).plan(&robot, tentacle, StrokeCommand::default());
        let park_rad = plan.park_pose_rad.clone();
        let mut script = Show::of_all_strokes(tentacle, 60.0);
        // Sway, walk, swim, reach, (wind, let go,) park, two seconds each but for winding.
        let mut time_s = 0.0;
        for entry in &mut script.entries {
            entry.time_s = time_s;
            let Order::Perform(command) = &mut entry.order else { panic!("{entry:?}") };
            time_s += if let Place::Pole(_) = command.stroke.place { 6.0 } else { 2.0 };
        }
        script.repeats_after_s = Some(time_s + 6.0);
        let mut show = Show::new(&robot, script);
        let mut status = STATUS;
        let mut parked = 0;
        let (activities, permissions) =
            run_from(&robot, (plan.into(), &park_rad), (ARM_FAULTS, true), |time_s, activity| {
                (status.time_s, status.activity) = (time_s, activity);
                parked += u32::from(activity == Activity::Parked);
                show.instruction(&status).0.order
            });
        assert!(
            activities.contains(&Activity::Performing) && parked > 100,
            "{file}: {activities:?}, {parked}"
        );
        assert_eq!(activities.last(), Some(&Activity::Done), "{file}");
        // The unplugged bus and the servo that restarts cause holds that pass.
        let holds = permissions.iter().filter(|permission| **permission == Permission::Hold).count();
        assert!(holds >= 3 && permissions.last() == Some(&Permission::Stop), "{file}: {permissions:?}");
    }
}

/// The status of a standing robot.
const STATUS: Status = Status { activity: Activity::Standing, ..Status::LIMP };

#[test]
fn the_cycle_of_a_figure_allocates_nothing_from_limp_to_limp() {
    let robot = in_physics("figure.toml");
    let figure = robot.motion.figure().unwrap_or_else(|| panic!("no figure"));
    let capability = FigureCapability::of(&robot, figure).unwrap_or_else(|error| panic!("{error}"));
    let mut controller = Controller::new(&robot, capability.plan(0), Method::CcdThenFinish, 60.0);
    let dt_s = robot.period_s();
    let mut cycle = |order: Order| {
        controller.decide(dt_s, order);
        controller.learn_from_goals();
        controller.record(&[]).facts.activity
    };
    cycle(Order::Take(0));
    let mut activity = Activity::Limp;
    assert_no_alloc(|| {
        for number in 0..10_000 {
            let pose = if number < 4000 { 0 } else { number / 300 % figure.poses.len() };
            activity = cycle(if number < 7000 { Order::Take(pose) } else { Order::Stop });
        }
    });
    assert_eq!(activity, Activity::Done);
}

/// The first test can fail: with the simulated buses not excepted, the same run aborts.
#[test]
fn an_allocation_in_the_cycle_is_caught() {
    if std::env::var_os(ALLOCATE).is_some() {
        run(&shipped("horse.toml"), false);
        return;
    }
    let output = std::env::current_exe()
        .and_then(|this| {
            Command::new(this)
                .args(["--exact", "an_allocation_in_the_cycle_is_caught", "--nocapture"])
                .env(ALLOCATE, "1")
                .output()
        })
        .unwrap_or_else(|error| panic!("{error}"));
    assert!(!output.status.success(), "nothing was caught");
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(said.contains("memory allocation of"), "{said}");
}

#[test]
fn no_operator_allocates() {
    use hippocamp::kinds::KeyDriver as _;
    use hippocamp::kinds::horse::{Axis, Button, Gamepad, Keys, PadEvent, Repertoire};
    use hippocamp::kinds::tentacle::StrokeKeys;
    use hippocamp::operator::{Key, Playback};
    let robot = shipped("horse.toml");
    let horse = robot.motion.horse().unwrap();
    let repertoire = Repertoire::of(&capability(&robot).plan(horse, MotionOptions::default()));
    let mut keys = Keys::new(repertoire.clone());
    let mut gamepad = Gamepad::new(repertoire, 0.5);
    let text = "[[at]]\ntime_s = 0\ngait = 'walk'\nspeed_m_s = 0.05\n[[at]]\ntime_s = 1\ngait = 'stand'";
    let script = config::parse_script(text, "test.toml", &robot).unwrap_or_else(|error| panic!("{error}"));
    let mut playback = Playback::new(script);
    let mut status = STATUS;
    let arms = shipped("tentacle.toml");
    let mut stroke_keys = StrokeKeys::new(arms.motion.tentacle().unwrap());
    let mut performed = 0;
    let (mut driven, mut stops, mut notes) = (0, 0, 0);
    assert_no_alloc(|| {
        let typed = "13g^<  0rftb5npzq".chars().map(Key::Character);
        for key in typed.chain([Key::Up, Key::Left, Key::Gone, Key::Escape]) {
            notes += usize::from(keys.press(key).is_some());
            driven += usize::from(matches!(keys.instruction().order, Order::Drive(_)));
        }
        let typed = "123456pwsad0 ".chars().map(Key::Character);
        for key in typed.chain([Key::Up, Key::Left, Key::Gone, Key::Escape]) {
            stroke_keys.press(key);
            performed += usize::from(matches!(stroke_keys.instruction().order, Order::Perform(_)));
        }
        for tenths in 0..100 {
            status.time_s = f64::from(tenths) * 0.1;
            stops += usize::from(playback.instruction(&status).order.is_stop());
            let event = match tenths {
                10 => PadEvent::Pressed(Button::Arm),
                20..25 => PadEvent::Moved(Axis::Speed, 1.0),
                50 => PadEvent::Unplugged,
                _ => continue,
            };
            notes += usize::from(gamepad.hear(event, status.time_s).is_some());
            notes += usize::from(gamepad.instruction(status.time_s + 1.0).1.is_some());
        }
    });
    assert_eq!(performed, 15, "all keys but the ends");
    assert!(driven > 10 && stops > 10 && notes >= 3, "{driven} {stops} {notes}: nothing was asked for");
}

/// A walk rarely has targets out of reach, and never searches other branches.
#[test]
fn inverse_kinematics_allocates_nothing_out_of_reach() {
    let robot = shipped("horse.toml");
    let mut limbs = Limbs::new(&robot, Method::CcdThenFinish);
    let (mut targets, mut joints) = (Targets::new(&robot), JointTargets::new(&robot));
    targets.set_tips().tips_in_body.fill(DVec3::new(0.3, 0.0, 0.3));
    assert_no_alloc(|| limbs.solve(&targets, &mut joints));
    assert!(joints.residual_m.iter().all(|residual_m| *residual_m > 0.1), "{:?}", joints.residual_m);
}
