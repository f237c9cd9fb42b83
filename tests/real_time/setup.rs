//! `hippocamp setup`, and `servo restore` afterwards.

use std::fs;
use std::io::{Read, Write};
use std::process::Command;
use std::time::Duration;

use hippocamp::platform::{monotonic, sleep_until};
use rustix::pty::{OpenptFlags, grantpt, ioctl_tiocgptpeer, openpt, unlockpt};

use super::boxed::Boxed;

/// Settings of a Feetech STS, and of a Dynamixel.
const STS: std::ops::Range<u16> = 0..40;
const X: std::ops::Range<u16> = 0..64;

fn servo(arguments: &[&str]) -> String {
    let output = Command::new(env!("CARGO_BIN_EXE_hippocamp")).arg("servo").args(arguments).output().unwrap();
    let text =
        String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{arguments:?}: {text}");
    text
}

/// The settings in a backup.
fn settings(path: &std::path::Path) -> String {
    let text = fs::read_to_string(path).unwrap();
    let (_, rest) = text.split_once("[settings]").unwrap();
    rest.split_once("[volatile]").unwrap().0.to_owned()
}

/// Restores the servo of `joint` from its backup, and checks it by other means.
fn assert_restored(boxed: &Boxed, joint: &str, as_new: &[Option<u8>], addresses: std::ops::Range<u16>) {
    let device = boxed.device(joint).display().to_string();
    let (id, kept) = (boxed.id_of(joint).to_string(), boxed.backup(joint));
    assert_ne!(boxed.bytes(joint, addresses.clone()), as_new, "setup has changed something");
    // Another servo that was never set up would be in its way.
    let text = servo(&["restore", &device, &id, &kept.display().to_string(), "--yes"]);
    assert!(text.contains("every setting is that of"), "{text}");
    assert_eq!(boxed.id_of(joint), 1);
    assert_eq!(boxed.bytes(joint, addresses), as_new);
    let again = boxed.folder.path().join(format!("{joint}.again.toml"));
    servo(&["backup", &device, "1", &again.display().to_string()]);
    assert_eq!(settings(&kept), settings(&again));
}

#[test]
fn new_feetech_servos_become_those_of_a_robot_and_can_be_restored() {
    let boxed = Boxed::new("horse.toml");
    let first = boxed.robot.joints[0].name.clone();
    assert_eq!(boxed.robot.joints[0].servo.unwrap().id.0, 1, "this one ends where new ones begin");
    let as_new = boxed.bytes(&first, STS);
    let (code, text) = boxed.set_up(|_, _| {});
    assert_eq!(code, Some(0), "{text}");
    boxed.assert_all_set_up();
    // Return delay, response level, limits, mode, offset; locked.
    let second = boxed.robot.joints[1].name.clone();
    let bytes = boxed.bytes(&second, 0..56);
    assert_eq!(bytes[7..13].iter().map(|byte| byte.unwrap()).collect::<Vec<_>>(), [0, 1, 0, 0, 0xFF, 0x0F]);
    assert_eq!(
        (bytes[33], bytes[31], bytes[32], bytes[40], bytes[55]),
        (Some(0), Some(0), Some(0), Some(0), Some(1))
    );
    let unit = fs::read_to_string(boxed.unit_file()).unwrap();
    assert!(unit.contains(&format!("device = \"{}\"", boxed.server.paths()[0].display())), "{unit}");

    // Again: everything is already done, and nothing is written.
    boxed.server.with_world(hw_sim::World::keep_requests);
    let (code, text) = boxed.set_up(|_, _| {});
    assert_eq!(code, Some(0), "{text}");
    assert_eq!(text.matches(" is set up\n").count(), 16, "{text}");
    let writes = boxed.server.with_world(|world| {
        let writes = world.requests(0).iter().filter(|request| request.instruction != 2).count();
        world.forget_requests();
        writes
    });
    assert_eq!(writes, 0);

    assert_restored(&boxed, &first, &as_new, STS);
    boxed.pull_out(&first);
    assert_restored(&boxed, &second, &as_new, STS);
}

/// Waits for an effect of the program.
fn wait_until(mut is_true: impl FnMut() -> bool) {
    let start = monotonic();
    while !is_true() {
        assert!(monotonic() - start < Duration::from_secs(60));
        sleep_until(monotonic() + Duration::from_micros(200));
    }
}

#[test]
fn new_dynamixels_become_those_of_a_robot_despite_interruptions() {
    let boxed = Boxed::new("horse-dynamixel.toml");
    let names: Vec<String> = boxed.robot.joints.iter().map(|joint| joint.name.clone()).collect();
    let as_new = boxed.bytes(&names[0], X);

    // Killed as soon as the second servo has its id, and not yet its rate.
    let mut is_second = false;
    let killed = boxed.set_up(|line, child| {
        is_second |= line.starts_with(&format!("{}: servo 1 ", names[1]));
        if is_second && line.starts_with("  baud_rate") {
            wait_until(|| boxed.id_of(&names[1]) == 2);
            child.kill().unwrap();
        }
    });
    assert_eq!(killed.0, None, "{}", killed.1);
    // Killed before the third is written to.
    let killed = boxed.set_up(|line, child| {
        if line.starts_with(&format!("{}: servo 1 ", names[2])) {
            child.kill().unwrap();
        }
    });
    assert_eq!(killed.0, None, "{}", killed.1);
    assert!(!killed.1.contains("plug in its new XM430-W210 (to be servo 2 "), "{}", killed.1);
    // The fifth is pulled out while it is written to, and put back when that is noticed; the seventh's adapter is
    // lost, which ends it.
    let mut is_pulled = false;
    let ended = boxed.set_up(|line, _| {
        if line.starts_with(&format!("{}: servo 1 ", names[4])) && !is_pulled {
            boxed.pull_out(&names[4]);
            is_pulled = true;
        }
        if line.contains("once it is back") {
            boxed.plug_in(&names[4]);
        }
        if line.starts_with(&format!("{}: servo 1 ", names[6])) {
            boxed.server.with_world(|world| world.unplug(1, u64::MAX));
        }
    });
    assert_eq!(ended.0, Some(1), "{}", ended.1);
    assert!(ended.1.contains("is gone: plug its adapter in again"), "{}", ended.1);
    boxed.server.with_world(|world| world.plug_in(1));
    wait_until(|| boxed.device(&names[6]).exists());

    let (code, text) = boxed.set_up(|_, _| {});
    assert_eq!(code, Some(0), "{text}");
    boxed.assert_all_set_up();
    for name in &names {
        // 4 Mbaud, no return delay, position mode, full limits; limp.
        let bytes = boxed.bytes(name, 0..65);
        let at = |address: usize| bytes[address].unwrap();
        assert_eq!((at(8), at(9), at(10), at(11), at(64)), (6, 0, 0, 3, 0), "{name}");
        assert_eq!(([at(48), at(49), at(52), at(53)], at(12)), ([0xFF, 0x0F, 0, 0], 255), "{name}");
    }
    // The backup of a servo whose setup was interrupted has its original settings.
    for name in [&names[0], &names[1], &names[2], &names[4]] {
        assert!(!boxed.backup(&format!("{name}.2")).exists(), "{name}");
        assert_restored(&boxed, name, &as_new, X);
        boxed.pull_out(name);
    }
}

#[test]
fn setup_names_obstacles_and_waits_for_their_removal() {
    let boxed = Boxed::new("horse-dynamixel.toml");
    let names: Vec<String> = boxed.robot.joints.iter().map(|joint| joint.name.clone()).collect();
    // Two new ones at once.
    boxed.plug_in(&names[1]);
    let (_, text) = boxed.set_up(|line, child| {
        if line.contains("two servos may have this id") {
            boxed.pull_out(&names[1]);
        }
        if line.starts_with(&format!("{}: servo 1 (dynamixel, 4000000 baud), set up", names[0])) {
            child.kill().unwrap();
        }
    });
    assert!(text.contains("two servos may have this id"), "{text}");
    assert!(text.contains("servo 1 (dynamixel, 4000000 baud), set up"), "{text}");
}

/// A person at a terminal who answers each question by `answer`.
fn converse(mut command: Command, mut answer: impl FnMut(&str) -> Option<String>) -> (Option<i32>, String) {
    let flags = OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC;
    let ours = openpt(flags).unwrap();
    grantpt(&ours).unwrap();
    unlockpt(&ours).unwrap();
    let theirs = ioctl_tiocgptpeer(&ours, flags).unwrap();
    let mut ours = fs::File::from(ours);
    command.stdin(theirs.try_clone().unwrap()).stdout(theirs.try_clone().unwrap()).stderr(theirs);
    let mut child = command.spawn().unwrap();
    // The command keeps the program's end open as well.
    drop(command);
    let (mut all, mut unanswered) = (String::new(), String::new());
    let mut piece = [0; 512];
    // A terminal without a program reads as an error.
    while let Ok(count @ 1..) = ours.read(&mut piece) {
        let text = String::from_utf8_lossy(&piece[..count]).into_owned();
        all.push_str(&text);
        unanswered.push_str(&text);
        if let Some(reply) = answer(&unanswered) {
            unanswered.clear();
            ours.write_all(reply.as_bytes()).unwrap();
        }
    }
    (child.wait().unwrap().code(), all)
}

#[test]
fn a_person_is_asked_before_each_step_and_can_say_no() {
    let boxed = Boxed::new("horse-dynamixel.toml");
    let names: Vec<String> = boxed.robot.joints.iter().map(|joint| joint.name.clone()).collect();
    let mut asked = 0;
    let (code, text) = converse(boxed.setup_command(), |text| {
        if text.contains("then press Enter (q to end)") {
            boxed.plug_in(&names[asked]);
            asked += 1;
            return Some("\n".into());
        }
        // The second is refused.
        text.contains("Continue? [y/N]").then(|| if asked == 1 { "y\n".into() } else { "n\n".into() })
    });
    assert_eq!(code, Some(1), "{text}");
    assert!(text.contains("not confirmed; nothing was written"), "{text}");
    assert_eq!(boxed.bytes(&names[0], 8..10), [Some(6), Some(0)], "4 Mbaud, no delay");
    let (bus, place) = boxed.place(&names[1]);
    assert_eq!(boxed.server.with_world(|world| world.id_at(bus, place)), Some(1));
    // Without a terminal there is no question, and nothing is done.
    let (code, text) = {
        let output = boxed.setup_command().stdin(std::process::Stdio::null()).output().unwrap();
        (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
    };
    assert_eq!(code, Some(2), "{text}");
    assert!(text.contains("--yes"), "{text}");
}
