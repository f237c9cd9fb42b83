//! Loads presented to the stage as a sequence of states.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

use super::*;
use crate::config;

const DT_S: f64 = 0.01;

/// One arm of the tentacle rig under a load, and its targets.
struct Arm {
    yielding: Yielding,
    state: State,
    targets: JointTargets,
}

const YIELD: YieldSettings =
    YieldSettings { load_share: 0.4, after_s: 0.2, torque_share: 0.1, for_s: 1.0, return_s: 2.0 };

impl Arm {
    fn new() -> Arm {
        let text = include_str!("../../config/tentacle.toml");
        let mut robot = config::parse(text, "tentacle.toml").unwrap().robot;
        robot.yielding = Some(YIELD);
        let mut arm = Arm {
            yielding: Yielding::new(&robot),
            state: State::new(&robot),
            targets: JointTargets::new(&robot),
        };
        arm.state.joints.iter_mut().for_each(|joint| joint.is_known = true);
        arm.targets.is_limp = false;
        arm
    }

    /// The goals sent for wanted angles of 0.3 rad.
    fn step(&mut self) -> (f64, f64) {
        self.targets.angles_rad.fill(0.3);
        self.targets.torque_shares.fill(1.0);
        self.yielding.step(DT_S, &self.state, &mut self.targets);
        (self.targets.angles_rad[2], self.targets.torque_shares[2])
    }

    fn go_on(&mut self, for_s: f64) -> (f64, f64) {
        let mut time_s = DT_S;
        while time_s < for_s - 1e-9 {
            self.step();
            time_s += DT_S;
        }
        self.step()
    }
}

#[test]
fn an_overloaded_arm_gives_way_and_returns_smoothly() {
    let mut arm = Arm::new();
    arm.state.joints[1].position_rad = 0.25;
    arm.state.joints[2].position_rad = 0.2;
    arm.state.joints[1].load_share = -0.5;
    assert_eq!(arm.go_on(0.19), (0.3, 1.0), "a short load is borne");
    arm.state.joints[1].load_share = 0.0;
    assert_eq!(arm.go_on(0.05), (0.3, 1.0));
    arm.state.joints[1].load_share = -0.5;
    assert_eq!(arm.go_on(0.22), (0.2, 0.1), "goals follow the joints of the whole arm");
    // The person keeps pulling: the arm follows, and waits.
    arm.state.joints[2].position_rad = -0.4;
    arm.state.joints[2].speed_rad_s = -0.7;
    arm.state.joints[1].load_share = 0.0;
    assert_eq!(arm.go_on(3.0), (-0.4, 0.1));
    arm.state.joints[2].speed_rad_s = 0.0;
    let mut before = arm.step();
    let mut steepest: f64 = 0.0;
    for _ in 0..200 {
        let now = arm.step();
        steepest = steepest.max((now.0 - before.0).abs() / DT_S);
        assert!(now.0 >= before.0 && now.1 >= before.1);
        before = now;
    }
    assert_eq!(before, (0.3, 1.0));
    assert!(steepest < 1.876 * 0.7 / 2.0, "{steepest} rad/s at most, of 0.7 rad in 2 s");
    assert_eq!((arm.yielding.times(), arm.yielding.is_yielding()), (1, false));
}

#[test]
fn an_arm_that_is_held_on_its_way_back_gives_way_again() {
    let mut arm = Arm::new();
    arm.state.joints[0].load_share = 0.9;
    arm.go_on(0.3);
    arm.go_on(1.2);
    assert_eq!(arm.yielding.times(), 2, "the load is there as soon as it returns");
    // A joint that is silent, or out of service, bears nothing.
    let mut arm = Arm::new();
    arm.state.joints[0].load_share = 0.9;
    arm.state.joints[0].age_s = 0.02;
    arm.state.joints[1].load_share = 0.9;
    arm.state.is_out[1] = true;
    arm.go_on(1.0);
    assert_eq!(arm.yielding.times(), 0);
}
