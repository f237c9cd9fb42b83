//! Messages of a start on the wrong servos: the simulated buses have the servos of another robot.
#![allow(clippy::unwrap_used, reason = "helpers of tests; a failed one should panic")]

mod common;

use common::Spy;
use hippocamp::bus::{Buses, Disagreement, SimPorts, StartError, TransactionError};
use hippocamp::config;
use hippocamp::model::servo_model::{Protocol, ServoModel};
use hippocamp::model::{Joint, Robot};
use hippocamp::simulation;
use hippocamp::units::ServoId;
use hw_sim::FaultScript;

fn dynamixel_horse() -> Robot {
    let robot = config::parse(include_str!("../config/horse-dynamixel.toml"), "horse").unwrap().robot;
    robot.without_body()
}

fn feetech_horse() -> Robot {
    let robot = config::parse(include_str!("../config/horse.toml"), "horse").unwrap().robot;
    robot.without_body()
}

/// A spy that does not look while it waits.
type DeafSpy = Spy<fn(&SimPorts)>;

/// Starts `robot` on the servos of `built`; returns the message, and the bytes sent.
fn start(robot: &Robot, built: &Robot, gone: Option<usize>) -> (Result<(), StartError>, Vec<Vec<u8>>) {
    let (result, buses) = start_with(robot, built, gone, "");
    (result, buses.into_ports().sent)
}

/// The same with `faults`.
fn start_with(
    robot: &Robot,
    built: &Robot,
    gone: Option<usize>,
    faults: &str,
) -> (Result<(), StartError>, Buses<DeafSpy>) {
    let pose: Vec<f64> = built.joints.iter().map(Joint::middle_rad).collect();
    let faults = FaultScript::from_toml(faults).unwrap();
    let world = simulation::world_from_pose(built, &pose, 1, &faults).unwrap();
    let mut ports = Spy::new(world, (|_| {}) as fn(&SimPorts));
    (ports.gone, ports.devices) = (gone, &["/dev/one", "/dev/two", "/dev/three"]);
    let mut buses = Buses::new(robot, ports);
    let result = buses.prepare(robot);
    (result, buses)
}

/// Instruction numbers of Dynamixel Protocol 2.0 and of Feetech: Write 0x03, Sync Write 0x83.
fn writes(sent: &[Vec<u8>], protocol: Protocol) -> usize {
    let at = if protocol == Protocol::Dynamixel { 7 } else { 4 };
    sent.iter().filter(|bytes| [0x03, 0x83].contains(&bytes[at])).count()
}

/// The differences, after a check that nothing was written.
fn refused(robot: &Robot, built: &Robot) -> (Vec<Disagreement>, String) {
    let (result, sent) = start(robot, built, None);
    assert_eq!(writes(&sent, robot.buses[0].protocol), 0, "nothing is written before all agree");
    let error = result.unwrap_err();
    let said = error.to_string();
    match error {
        StartError::Disagrees(all) => (all, said),
        StartError::Transaction(error) => panic!("{error}"),
    }
}

/// `robot` with its servos on other buses.
fn moved(robot: &Robot, bus_of: impl Fn(usize, ServoId) -> usize) -> Robot {
    let mut built = robot.clone();
    for servo in built.joints.iter_mut().filter_map(|joint| joint.servo.as_mut()) {
        servo.bus = bus_of(servo.bus, servo.id);
    }
    built
}

#[test]
fn the_right_servos_start() {
    for robot in [dynamixel_horse(), feetech_horse()] {
        let (result, sent) = start(&robot, &robot, None);
        assert_eq!(result, Ok(()));
        let protocol = robot.buses[0].protocol;
        let preparation = robot.joints[0].servo.unwrap().model.registers.preparation.len();
        assert_eq!(writes(&sent, protocol), preparation * robot.joints.len());
    }
}

#[test]
fn two_swapped_adapters_are_named_with_their_devices_and_nothing_else_is_reported() {
    let robot = dynamixel_horse();
    let built = moved(&robot, |bus, _| if bus < 2 { 1 - bus } else { bus });
    let (all, said) = refused(&robot, &built);
    assert!(matches!(all.as_slice(), [Disagreement::Swapped(_)]), "{said}");
    assert_eq!(
        said,
        "the devices of bus left_hind (/dev/one) and bus left_fore (/dev/two) look swapped: the servos of \
         each answer on the other's line; exchange the two devices in the unit file (or in --port), or the two \
         plugs\n\
         the robot is not as its file says; no servo was written to"
    );
}

#[test]
fn two_swapped_pairs_are_both_reported() {
    let robot = dynamixel_horse();
    let (all, said) = refused(&robot, &moved(&robot, |bus, _| bus ^ 1));
    assert_eq!(all.len(), 2, "{said}");
    assert!(said.contains("bus right_hind (/dev/three) and bus right_fore look swapped"), "{said}");
}

#[test]
fn three_adapters_swapped_in_a_ring_are_reported_servo_by_servo() {
    let robot = dynamixel_horse();
    let (all, said) = refused(&robot, &moved(&robot, |bus, _| if bus < 3 { (bus + 1) % 3 } else { bus }));
    assert_eq!(all.len(), 12, "{said}");
    assert!(all.iter().all(|one| matches!(one, Disagreement::OtherBus { .. })), "{said}");
}

#[test]
fn a_plug_on_the_wrong_bus_is_reported_for_that_servo_only() {
    let robot = dynamixel_horse();
    let (all, said) = refused(&robot, &moved(&robot, |bus, id| if id.0 == 3 { 2 } else { bus }));
    assert_eq!(all.len(), 1);
    assert!(
        said.starts_with(
            "servo 3 of joint left_hind.stifle on bus left_hind answers on bus right_hind (/dev/three) instead: \
             plug it into bus left_hind, or name the other bus in the robot file\n"
        ),
        "{said}"
    );
    // One each way is no swap of the adapters: the other servos are where they should be.
    let crossed = moved(&robot, |bus, id| match id.0 {
        3 => 1,
        5 => 0,
        _ => bus,
    });
    let (all, said) = refused(&robot, &crossed);
    assert_eq!(all.len(), 2, "{said}");
    assert!(all.iter().all(|one| matches!(one, Disagreement::OtherBus { .. })), "{said}");
}

#[test]
fn all_differences_are_reported_at_once_with_both_values() {
    let robot = dynamixel_horse();
    let mut built = robot.clone();
    built.joints[1].servo.as_mut().unwrap().model = ServoModel::named("XL430-W250").unwrap();
    built.joints[6].servo.as_mut().unwrap().id = ServoId(77);
    built.joints[9].servo.as_mut().unwrap().model = ServoModel::named("XM430-W350").unwrap();
    let (all, said) = refused(&robot, &built);
    assert_eq!(all.len(), 3, "{said}");
    assert!(
        said.starts_with(
            "servo 2 of joint left_hind.hip on bus left_hind is another model: the robot file says XM430-W210 \
             (model number 1030), the servo reports model number 1060 (XL430-W250): "
        ),
        "{said}"
    );
    assert!(
        said.contains("\nservo 7 of joint left_fore.elbow on bus left_fore did not answer a ping"),
        "{said}"
    );
    assert!(said.contains("the servo reports model number 1020 (XM430-W350)"), "{said}");
}

#[test]
fn models_that_share_a_number_are_both_named() {
    let robot = feetech_horse();
    let mut built = robot.clone();
    built.joints[0].servo.as_mut().unwrap().model = ServoModel::named("STS3250").unwrap();
    let (_, said) = refused(&robot, &built);
    assert!(said.contains("the servo reports model number 2825 (STS3250)"), "{said}");
    let (_, said) = refused(&built, &robot);
    assert!(said.contains("the servo reports model number 777 (STS3215-7V4 or STS3215-12V)"), "{said}");
}

/// Equal ids on both buses, and one different model: the model shows the swap. Otherwise nothing shows it.
#[test]
fn swapped_buses_with_equal_ids_are_recognised_by_their_models() {
    let mut robot = dynamixel_horse();
    for joint in &mut robot.joints {
        let servo = joint.servo.as_mut().unwrap();
        servo.id = ServoId((servo.id.0 - 1) % 4 + 1);
    }
    let built = moved(&robot, |bus, _| if bus < 2 { 1 - bus } else { bus });
    assert_eq!(start(&robot, &built, None).0, Ok(()));

    robot.joints[2].servo.as_mut().unwrap().model = ServoModel::named("XM430-W350").unwrap();
    let built = moved(&robot, |bus, _| if bus < 2 { 1 - bus } else { bus });
    let (all, said) = refused(&robot, &built);
    assert!(matches!(all.as_slice(), [Disagreement::Swapped(_)]), "{said}");
}

#[test]
fn a_lost_port_is_reported_once() {
    let robot = dynamixel_horse();
    let (result, _) = start(&robot, &robot, Some(1));
    let StartError::Disagrees(all) = result.unwrap_err() else { panic!("no disagreement") };
    assert_eq!(all.len(), 1);
    assert!(matches!(&all[0], Disagreement::Unheard(TransactionError::Port { .. })));
}

#[test]
fn a_swap_hides_no_servo_that_is_missing() {
    let robot = dynamixel_horse();
    let mut built = moved(&robot, |bus, _| if bus < 2 { 1 - bus } else { bus });
    built.joints[0].servo.as_mut().unwrap().id = ServoId(77);
    built.joints[15].servo.as_mut().unwrap().id = ServoId(78);
    let (all, said) = refused(&robot, &built);
    assert_eq!(all.len(), 3, "{said}");
    assert!(said.contains("servo 1 of joint") && said.contains("servo 16 of joint"), "{said}");
}

/// The message of `robot` on its own servos with `faults`, after a check that nothing was written.
fn said_with(robot: &Robot, faults: &str) -> String {
    let (result, buses) = start_with(robot, robot, None, faults);
    let said = result.expect_err(faults).to_string();
    assert_eq!(writes(&buses.into_ports().sent, robot.buses[0].protocol), 0, "nothing is written: {said}");
    said
}

#[test]
fn a_servo_that_is_too_hot_gets_no_torque() {
    let robot = feetech_horse();
    let hot = "[[fault]]\nat_s = 0\nkind = 'hot'\nid = 7\nbus = 'main'\ncelsius = ";
    assert!((robot.safety.temperature_c - 65.0).abs() < 1e-9);
    let said = said_with(&robot, &format!("{hot}66"));
    assert!(
        said.starts_with(
            "servo 7 of joint left_fore.elbow on bus main is at 66 C, above the limit of 65 C (temperature_max_c): \
             let \
             it cool first\n"
        ),
        "{said}"
    );
    assert_eq!(start_with(&robot, &robot, None, &format!("{hot}65")).0, Ok(()));
}

#[test]
fn a_servo_on_the_wrong_supply_voltage_gets_no_torque() {
    // STS3215-12V: 9 to 12.6 V; XM430: 10 to 14.8 V.
    for (robot, bad, good) in
        [(feetech_horse(), [8.9, 12.8], [9.0, 12.6]), (dynamixel_horse(), [9.9, 15.0], [10.0, 14.8])]
    {
        let supply = |volts: f64| format!("[[fault]]\nat_s = 0\nkind = 'low-voltage'\nvolts = {volts:.1}\n");
        for volts in bad {
            let said = said_with(&robot, &supply(volts));
            let expected = format!(
                "servo 1 of joint left_hind.pelvis on bus {} sees {volts:.1} V, and needs {:.1} to {:.1} V: ",
                robot.buses[0].name, good[0], good[1]
            );
            assert!(said.starts_with(&expected), "{said}");
            assert_eq!(said.lines().count(), 17, "all 16 are told: {said}");
        }
        for volts in good {
            assert_eq!(start_with(&robot, &robot, None, &supply(volts)).0, Ok(()), "{volts} V");
        }
    }
}

#[test]
fn a_servo_whose_replies_are_all_damaged_is_not_called_silent() {
    for robot in [feetech_horse(), dynamixel_horse()] {
        let bus = &robot.buses[0].name;
        let said =
            said_with(&robot, &format!("[[fault]]\nat_s = 0\nkind = 'bit-flip'\nbus = '{bus}'\nid = 3\n"));
        assert!(
            said.starts_with(&format!(
                "servo 3 of joint left_hind.stifle on bus {bus} sent only damaged replies to a ping, in 3 tries: "
            )),
            "{said}"
        );
    }
}

#[test]
fn a_firmware_change_since_calibration_gets_a_remark_and_the_robot_starts() {
    // hw-sim: Dynamixel 46, Feetech 3.10.
    for (mut robot, same, other) in [(feetech_horse(), "3.10", "3.9"), (dynamixel_horse(), "46", "45")] {
        let built = robot.clone();
        let bus = robot.buses[0].name.clone();
        robot.joints[0].servo.as_mut().unwrap().firmware = Some(same.parse().unwrap());
        robot.joints[1].servo.as_mut().unwrap().firmware = Some(other.parse().unwrap());
        let (result, buses) = start_with(&robot, &built, None, "");
        assert_eq!(result, Ok(()));
        assert_eq!(
            buses.notes(),
            [format!(
                "servo 2 of joint left_hind.hip on bus {bus} has firmware {same}, the unit file says {other}: an \
                 update can reset what a servo was set to; calibrate the robot again"
            )]
        );
    }
}
