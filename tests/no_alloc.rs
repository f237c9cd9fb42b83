//! The controller's cycle allocates nothing after the first: any allocation aborts this test. What the simulated
//! buses allocate is theirs, and permitted.

mod common;

use std::process::Command;
use std::time::Duration;

use assert_no_alloc::{AllocDisabler, assert_no_alloc, permit_alloc};
use common::{ROBOTS, capability, in_physics, plan, shipped};
use glam::DVec3;
use hippocamp::bus::{Buses, PortError, Ports, SimPorts};
use hippocamp::config;
use hippocamp::cycle::Cycle;
use hippocamp::ik::{Limbs, Method};
use hippocamp::model::Robot;
use hippocamp::motion::{Activity, Command as Asked, Order};
use hippocamp::run::Status;
use hippocamp::signals::{Aim, JointTargets, Permission, Targets};
use hippocamp::simulation;
use hippocamp::units::Time;
use hw_sim::FaultScript;

#[global_allocator]
static ALLOCATOR: AllocDisabler = AllocDisabler;

/// Set for the child process that shows that an allocation is caught.
const ALLOCATE: &str = "HIPPOCAMP_TEST_MAY_NOT_ALLOCATE";

/// Everything at once while it walks, and at last a servo that stays silent.
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
    permits: bool,
}

impl PermittingPorts {
    fn with<T>(&mut self, act: impl FnOnce(&mut SimPorts) -> T) -> T {
        let ports = &mut self.ports;
        if self.permits { permit_alloc(|| act(ports)) } else { act(ports) }
    }
}

impl Ports for PermittingPorts {
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

/// Runs `robot` from limp to limp, cycle by cycle; returns what it did and what it was permitted, each once.
fn run(robot: &Robot, permits: bool) -> (Vec<Activity>, Vec<Permission>) {
    run_with(robot, FAULTS, permits)
}

/// The same with faults of its own.
fn run_with(robot: &Robot, faults: &str, permits: bool) -> (Vec<Activity>, Vec<Permission>) {
    let plan = plan(robot, "walk", 0.9);
    let sit_rad = plan.sit_pose_rad.clone();
    let faults = faults.replace("BUS", &robot.buses[0].name);
    let faults = FaultScript::from_toml(&faults).unwrap_or_else(|error| panic!("{error}"));
    let world = simulation::world_from_pose(robot, &sit_rad, 1, &faults).unwrap_or_else(|e| panic!("{e}"));
    let mut buses = Buses::new(robot, PermittingPorts { ports: SimPorts::on_virtual_clock(world), permits });
    buses.prepare(robot).unwrap_or_else(|error| panic!("{error}"));

    let mut cycle = Cycle::new(robot, plan, Method::CcdThenFinish, 60.0, buses);
    let period = Duration::from_secs_f64(robot.period_s());
    let mut deadline = cycle.buses_mut().ports_mut().now();
    let (mut activities, mut permissions) = (Vec::new(), Vec::new());
    cycle.step(Order::Go);
    while cycle.activity() != Activity::Done {
        deadline = deadline + period;
        assert_no_alloc(|| {
            cycle.buses_mut().ports_mut().wait_until(deadline);
            cycle.step(Order::Go);
        });
        if activities.last() != Some(&cycle.activity()) {
            activities.push(cycle.activity());
        }
        if permissions.last() != Some(&cycle.state().permission) {
            permissions.push(cycle.state().permission);
        }
        assert!(deadline.as_secs_f64() < 60.0, "this run does not end");
    }
    (activities, permissions)
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
        // The unplugged bus is a hold that passes, the silent servo one that does not.
        assert_eq!(permissions, [Move, Hold, Move, Hold, Stop], "{file}");
    }
}

#[test]
fn a_fall_allocates_nothing() {
    let robot = in_physics("horse.toml");
    use Activity::{Done, Falling, Lying, Rising, Standing, Walking};
    let push = "[[fault]]\nkind = 'push'\nat_s = 6.0\n";
    let over = run_with(&robot, &format!("{push}impulse_n_s = 2.4\ndirection_deg = 90"), true).0;
    assert_eq!(
        over.iter().filter(|activity| **activity != Activity::Limp).collect::<Vec<_>>(),
        [&Rising, &Standing, &Walking, &Falling, &Lying, &Done]
    );
}

/// The test above can fail: with the simulated buses not excepted, the same run aborts.
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
    use hippocamp::operator::{Axis, Button, Gamepad, Key, Keys, PadEvent, Playback, Repertoire};
    let robot = shipped("horse.toml");
    let horse = robot.motion.horse().unwrap();
    let repertoire = Repertoire::of(&capability(&robot).plan(horse, Asked::default()));
    let mut keys = Keys::new(repertoire.clone());
    let mut gamepad = Gamepad::new(repertoire, 0.5);
    let text = "[[at]]\ntime_s = 0\ngait = 'walk'\nspeed_m_s = 0.05\n[[at]]\ntime_s = 1\ngait = 'stand'";
    let script = config::parse_script(text, "test.toml", &robot).unwrap_or_else(|error| panic!("{error}"));
    let mut playback = Playback::new(script);
    let mut status = Status {
        time_s: 0.0,
        activity: Activity::Standing,
        gait: None,
        stroke: None,
        frozen: 0,
        speed_m_s: 0.0,
        yaw_rate_rad_s: 0.0,
        permission: Permission::Move,
        late_cycles: 0,
        hottest_c: 30.0,
        lowest_v: 12.0,
        is_imu_lost: false,
        is_recording_lost: false,
    };
    let (mut driven, mut stops, mut notes) = (0, 0, 0);
    assert_no_alloc(|| {
        let typed = "13g^<  0rftb5npzq".chars().map(Key::Character);
        for key in typed.chain([Key::Up, Key::Left, Key::Gone, Key::Escape]) {
            notes += usize::from(keys.press(key).is_some());
            driven += usize::from(matches!(keys.instruction().order, Order::Drive(_)));
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
    assert!(driven > 10 && stops > 10 && notes >= 3, "{driven} {stops} {notes}: nothing was asked for");
}

/// A walk seldom asks for what a leg cannot reach, and never searches its branches.
#[test]
fn inverse_kinematics_allocates_nothing_out_of_reach() {
    let robot = shipped("horse.toml");
    let mut limbs = Limbs::new(&robot, Method::CcdThenFinish);
    let (mut targets, mut joints) = (Targets::new(&robot), JointTargets::new(&robot));
    targets.aim = Aim::Tips;
    targets.tips_in_body.fill(DVec3::new(0.3, 0.0, 0.3));
    assert_no_alloc(|| limbs.solve(&targets, &mut joints));
    assert!(joints.residual_m.iter().all(|residual_m| *residual_m > 0.1), "{:?}", joints.residual_m);
}
