//! Two adapters that are swapped while they are unplugged, in real time over pseudo-terminals.

use std::fs;
use std::os::unix::fs::symlink;
use std::path::PathBuf;

use crate::rig::Rig;
use hippocamp::bus::SerialPorts;
use hippocamp::bus::serial::Device;
use hippocamp::ik::Method;
use hippocamp::kinds::horse::HorseCapability;
use hippocamp::motion::{Command, Order};
use hippocamp::plan::RunPlan;
use hippocamp::run::run;
use hippocamp::telemetry::Outcome;

#[test]
fn adapters_swapped_while_unplugged_are_detected_and_not_written_to() {
    // Out while the robot rises.
    let faults = "[[fault]]\nkind = 'unplugged'\nbus = 'left_hind'\nat_s = 1.5\nfor_s = 1.0\n\
                  [[fault]]\nkind = 'unplugged'\nbus = 'left_fore'\nat_s = 1.5\nfor_s = 1.0\n";
    // Ids 1, 2, 3 are on both buses: goals sent down the wrong line would be taken.
    let rig = Rig::edited("horse-dynamixel.toml", faults, |text| {
        let ids = [("id = 5 ", "id = 1 "), ("id = 6 ", "id = 2 "), ("id = 7 ", "id = 3 ")];
        ids.iter().fold(text, |text, (id, twin)| text.replacen(id, twin, 1))
    });
    let (robot, server) = (&rig.robot, rig.server.as_ref().unwrap());
    // Stable names of the two sockets.
    let plugs: Vec<PathBuf> =
        robot.buses.iter().map(|bus| rig.folder.path().join(format!("plug-{}", bus.name))).collect();
    for (plug, terminal) in plugs.iter().zip(server.paths()) {
        symlink(terminal, plug).unwrap();
    }
    let devices: Vec<Device> =
        robot.buses.iter().zip(&plugs).map(|(bus, plug)| Device::of(bus, plug.clone())).collect();
    let ports = SerialPorts::open(&devices).unwrap();
    let goals = || -> Vec<[u8; 4]> {
        let servos = robot.joints.iter().filter_map(|joint| joint.servo).filter(|servo| servo.bus < 2);
        server.with_world(|world| {
            let byte = |bus, id, address| world.register(bus, id, address).unwrap();
            // Goal Position of a Dynamixel: 116, 4 bytes.
            servos.map(|servo| [116, 117, 118, 119].map(|at| byte(servo.bus, servo.id.0, at))).collect()
        })
    };

    let horse = robot.motion.horse().unwrap();
    let capability = HorseCapability::of(robot, horse).unwrap();
    let plan = RunPlan {
        motion: capability.plan(horse, Command::ahead(0, 0.0)).into(),
        method: Method::CcdThenFinish,
        move_for_s: 60.0,
        driver: None,
    };
    let (mut is_swapped, mut swapped_at_s, mut last_goals) = (false, 0.0, None);
    let report = run(robot, plan, ports, |status| {
        if !is_swapped && server.with_world(|world| world.is_unplugged(0)) {
            for (plug, terminal) in [(&plugs[0], &server.paths()[1]), (&plugs[1], &server.paths()[0])] {
                fs::remove_file(plug).unwrap();
                symlink(terminal, plug).unwrap();
            }
            (is_swapped, swapped_at_s) = (true, status.time_s);
        }
        // By then the servos' watchdogs have stopped them in place, and no adapter is plugged in yet.
        if is_swapped && last_goals.is_none() && status.time_s > swapped_at_s + 0.5 {
            last_goals = Some(goals());
        }
        Order::Go
    })
    .unwrap();
    assert_eq!(report.outcome, Outcome::StoppedBySafety, "{}", report.reason);
    for (bus, other, id) in [("left_hind", "left_fore", 8), ("left_fore", "left_hind", 4)] {
        let plug = rig.folder.path().join(format!("plug-{bus}"));
        let expected = format!(
            "bus {bus}: {} came back with other servos on it, and is not used: servo {id} of bus {other} answers \
             there",
            plug.display()
        );
        assert!(report.reason.contains(&expected), "{}", report.reason);
    }
    assert_eq!(last_goals, Some(goals()), "no goal reached a servo over the other's line");
}
