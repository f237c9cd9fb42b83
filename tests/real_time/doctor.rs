//! The doctor's findings about simulated robots behind pseudo-terminals, healthy and faulty; and that it changes
//! nothing.

use std::fs;

use hippocamp::model::Robot;
use serde_json::Value;

use crate::rig::Rig;

/// The doctor's output for a robot, and its exit code.
fn examine(rig: &Rig) -> (Value, Option<i32>) {
    let output = rig.start("doctor", &["--json"]).wait_with_output().unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    let said = serde_json::from_str(&text)
        .unwrap_or_else(|error| panic!("{error}: {text}{}", String::from_utf8_lossy(&output.stderr)));
    (said, output.status.code())
}

/// Lines that depend on how busy the test machine is.
const OF_THE_MACHINE: [&str; 5] =
    ["imu: ", "this machine: ", " replies", " an exchange takes ", " fast sync read"];

/// Runs all of these side by side: they wait most of the time.
fn at_once<T: Send>(cases: impl IntoIterator<Item = T>, test: impl Fn(T) + Sync) {
    std::thread::scope(|scope| {
        for case in cases {
            let test = &test;
            scope.spawn(move || test(case));
        }
    });
}

/// `verdict about: found -> cure`, one line each, without those that depend on the machine.
fn lines(said: &Value) -> Vec<String> {
    let text = |line: &Value, key: &str| line[key].as_str().unwrap_or_default().to_owned();
    let all = said["lines"].as_array().unwrap().iter();
    let of = |line: &Value| {
        let (verdict, about) = (text(line, "verdict"), text(line, "about"));
        format!("{verdict} {about}: {} -> {}", text(line, "found"), text(line, "cure"))
    };
    all.map(of).filter(|line| !OF_THE_MACHINE.iter().any(|part| line.contains(part))).collect()
}

/// Every register that does not measure, of every servo: Feetech up to 55, Dynamixel up to 119.
fn settings(rig: &Rig, robot: &Robot, last: u16) -> Vec<Option<u8>> {
    let servos = robot.joints.iter().filter_map(|joint| joint.servo);
    rig.server.as_ref().unwrap().with_world(|world| {
        servos
            .flat_map(|servo| (0..=last).map(move |address| (servo.bus, servo.id.0, address)))
            .map(|(bus, id, address)| world.register(bus, id, address))
            .collect()
    })
}

#[test]
fn a_healthy_robot_has_no_finding_and_is_not_changed() {
    at_once([("horse.toml", 55), ("horse-dynamixel.toml", 119)], |(file, last)| {
        let rig = Rig::new(file, "");
        let before = settings(&rig, &rig.robot, last);
        let (said, code) = examine(&rig);
        assert_eq!(code, Some(i32::from(said["faults"].as_u64().unwrap() > 0)), "{said:#}");
        assert!(said.to_string().contains("an exchange takes "), "{said:#}");
        // The number depends on the machine.
        assert!(said.to_string().contains("measures "), "{said:#}");
        let lines = lines(&said);
        assert!(lines.iter().all(|line| !line.starts_with("fault")), "{file}: {lines:#?}");
        assert_eq!(settings(&rig, &rig.robot, last), before, "{file}");
        let is_said = |part: &str| lines.iter().any(|line| line.starts_with("ok ") && line.contains(part));
        for part in ["calibrated, and unchanged since", "opens, and no other program uses it", "no echo"] {
            assert!(is_said(part), "{file}: no {part:?} in {lines:#?}");
        }
        assert_eq!(
            lines.iter().filter(|line| line.starts_with("ok servo ")).count(),
            16,
            "{file}: {lines:#?}"
        );
    });
}

/// The one line that is a fault, or a warning, of a rig with `faults`; all others are well, but for the power budget.
fn only(rig: &Rig, verdict: &str) -> String {
    let (said, code) = examine(rig);
    assert!(verdict != "fault" || code == Some(1), "{said:#}");
    let all = lines(&said);
    let is_it = |line: &&String| line.starts_with(verdict) && !line.contains(" a plug carries ");
    let found: Vec<&String> = all.iter().filter(is_it).collect();
    assert_eq!(found.len(), 1, "{all:#?}");
    found[0].clone()
}

#[test]
fn faults_are_named_with_servo_and_remedy() {
    let cases = [
        (
            "kind = 'silent'\nid = 3",
            "fault",
            "servo 3 of joint left_hind.stifle on bus main: no answer at 1000000 baud",
        ),
        (
            "kind = 'bit-flip'\nid = 5",
            "fault",
            "servo 5 of joint left_fore.scapula on bus main: only damaged answers",
        ),
        (
            "kind = 'hot'\nid = 7\ncelsius = 66",
            "fault",
            "servo 7 of joint left_fore.elbow on bus main: 66 C: the limit is 65",
        ),
        (
            "kind = 'hot'\nid = 7\ncelsius = 60",
            "warning",
            "servo 7 of joint left_fore.elbow on bus main: 60 C: near",
        ),
        ("kind = 'echo'", "warning", "bus main: the adapter returns what it is sent"),
    ];
    // Two at a time: a line that is served late loses replies.
    cases.chunks(2).for_each(|pair| {
        at_once(pair, |(fault, verdict, expected)| {
            let rig = Rig::new("horse.toml", &format!("[[fault]]\nat_s = 0\n{fault}\n"));
            let line = only(&rig, verdict);
            assert!(line.contains(*expected), "{fault}: {line}");
            assert!(!line.ends_with("-> "), "no cure: {line}");
        })
    });
}

#[test]
fn the_wrong_robot_file_is_recognised_by_its_servos() {
    let rig = Rig::new("horse.toml", "");
    let text = fs::read_to_string(&rig.robot_file).unwrap();
    // Of the servos on the bus, one is another model, one is not in the file, and the bus is at another rate.
    let edited = text
        .replacen(
            "model = \"STS3215-12V\", bus = \"main\", id = 2 ",
            "model = \"STS3250\", bus = \"main\", id = 2 ",
            1,
        )
        .replacen("bus = \"main\", id = 4 ", "bus = \"main\", id = 40 ", 1);
    fs::write(&rig.robot_file, &edited).unwrap();
    let (said, code) = examine(&rig);
    let all = lines(&said);
    assert_eq!(code, Some(1));
    for expected in [
        "fault unit file: ",
        "fault servo 2 of joint left_hind.hip on bus main: it is STS3215-7V4 or STS3215-12V, and the robot file says STS3250",
        "fault servo 40 of joint left_hind.hock on bus main: no answer",
        "warning bus main: it has servos that are not in the robot file: id 4 (STS3215-7V4 or STS3215-12V)",
    ] {
        assert!(all.iter().any(|line| line.starts_with(expected)), "no {expected:?} in {all:#?}");
    }
    // The wrong rate: the servo is found at its rate.
    fs::write(&rig.robot_file, text.replace("baud = 1000000", "baud = 500000")).unwrap();
    let all = lines(&examine(&rig).0);
    let expected = "fault servo 1 of joint left_hind.pelvis on bus main: it is set to 1000000 baud, and its bus to 500000";
    assert!(all.iter().any(|line| line.starts_with(expected)), "{all:#?}");
}

#[test]
fn a_missing_adapter_is_reported_and_the_other_buses_are_checked() {
    let mut rig =
        Rig::new("horse-dynamixel.toml", "[[fault]]\nat_s = 0\nkind = 'unplugged'\nbus = 'left_fore'\n");
    let (said, code) = examine(&rig);
    let all = lines(&said);
    assert_eq!(code, Some(1));
    assert!(
        all.iter().any(|line| line.starts_with("fault bus left_fore: ") && line.contains("does not exist")),
        "{all:#?}"
    );
    assert_eq!(all.iter().filter(|line| line.starts_with("ok servo ")).count(), 12, "{all:#?}");

    // In words, for people. All four buses and the unit are gone.
    rig.server = None;
    let output = rig.start("doctor", &[]).wait_with_output().unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(text.contains("FAULT    bus left_hind: ") && text.contains("\n           -> plug "), "{text}");
    assert!(text.contains("horse-dynamixel: 5 faults, "), "{text}");
}
