//! Controller and guard watch each other: each in turn is dead or hung, on pseudo-terminals, in real time.

use std::fs;
use std::io::{BufRead, BufReader};
use std::os::fd::OwnedFd;
use std::os::unix::process::ExitStatusExt;
use std::process::{Child, Output, Stdio};

use crate::rig::{PATIENCE, Rig, processes_with, signal};
use hippocamp::platform::monotonic;
use rustix::pipe::PipeFlags;

/// The guard of `controller`.
fn guard_of(rig: &Rig, controller: &Child) -> u32 {
    let others: Vec<u32> =
        processes_with(&rig.robot_file).into_iter().filter(|process| *process != controller.id()).collect();
    assert_eq!(others.len(), 1, "{others:?}");
    others[0]
}

fn said(output: &Output) -> String {
    format!("{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr))
}

#[test]
fn a_controller_without_its_guard_stops_and_says_why() {
    for command in ["run", "jog"] {
        let rig = Rig::new("horse.toml", "");
        let report = rig.folder.path().join("report.json");
        let child = match command {
            "run" => rig.start("run", &["--for", "60", "--report", report.to_str().unwrap()]),
            _ => rig.start("jog", &["left_hind.hip", "-85"]),
        };
        let torque = if command == "run" { rig.robot.joints.len() } else { 1 };
        while rig.with_torque() != torque {
            std::thread::yield_now();
        }
        signal(guard_of(&rig, &child), "KILL");
        let output = child.wait_with_output().unwrap();
        let said = said(&output);
        assert_eq!(output.status.code(), Some(3), "stopped by safety: {said}");
        assert!(said.contains("STOPPED BY SAFETY: the guard process is gone"), "{said}");
        assert_eq!(rig.with_torque(), 0);
        if command == "run" {
            let report = fs::read_to_string(report).unwrap();
            assert!(report.contains("\"reason\": \"the guard process is gone"), "{report}");
            assert_slowest_cycle_is_told(&report, &said);
            // Once as it happened, once at the end.
            assert_eq!(said.matches("the guard process is gone").count(), 2, "{said}");
        }
    }
}

/// A run in real time says where the time of its slowest cycle went.
fn assert_slowest_cycle_is_told(report: &str, said: &str) {
    assert!(said.contains("slowest cycle: number "), "{said}");
    let report: serde_json::Value = serde_json::from_str(report).unwrap();
    let slowest = &report["loop"]["slowest"];
    let stages = slowest["stages_us"].as_object().unwrap().iter();
    let stages: Vec<(&String, u64)> = stages.map(|(name, us)| (name, us.as_u64().unwrap())).collect();
    let (total_us, sum_us) =
        (slowest["total_us"].as_u64().unwrap(), stages.iter().map(|(_, us)| us).sum::<u64>());
    // Each is cut to whole microseconds.
    assert!(sum_us <= total_us && total_us - sum_us <= stages.len() as u64, "{slowest}");
    assert!(slowest["processor_us"].as_u64().unwrap() > 0, "{slowest}");
    for (name, us) in stages {
        assert!(
            report["loop"]["stages_us"][name]["max"].as_u64().unwrap() >= us * 98 / 100,
            "{name}: {report}"
        );
    }
}

#[test]
fn a_controller_that_hangs_is_killed_and_its_servos_are_let_go() {
    for file in ["horse.toml", "horse-dynamixel.toml"] {
        let rig = Rig::new(file, "");
        let child = rig.start("run", &["--for", "60"]);
        rig.wait_for_torque(true);
        signal(child.id(), "STOP");
        let took = rig.wait_for_torque(false);
        let output = child.wait_with_output().unwrap();
        assert_eq!(output.status.signal(), Some(9), "{}", said(&output));
        assert!(said(&output).contains("the controller's loop gave no sign of life"), "{}", said(&output));
        println!("{file}: torque off {took:.2?} after SIGSTOP");
    }
}

#[test]
fn a_safe_end_leaves_no_guard_process() {
    let rig = Rig::new("horse.toml", "");
    let child = rig.start("jog", &["left_hind.hip", "-85"]);
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(0), "{}", said(&output));
    assert!(processes_with(&rig.robot_file).is_empty());
    assert!(!said(&output).contains("guard"), "{}", said(&output));
}

/// A pipe with room for `left` more bytes: its two ends.
fn nearly_full_pipe(left: usize) -> (OwnedFd, OwnedFd) {
    let (read, write) = rustix::pipe::pipe_with(PipeFlags::CLOEXEC).unwrap();
    let size = rustix::pipe::fcntl_setpipe_size(&write, 4096).unwrap();
    let filling = vec![b'\n'; size - left];
    assert_eq!(rustix::io::write(&write, &filling).unwrap(), filling.len());
    (read, write)
}

#[test]
fn a_loop_does_not_wait_for_a_reader_of_its_output() {
    let rig = Rig::new("horse.toml", "");
    let jog = |stdout: Stdio| {
        let mut command = rig.command("jog", &["left_hind.hip", "-85"]);
        command.stdout(stdout).spawn().unwrap()
    };
    let output = jog(Stdio::piped()).wait_with_output().unwrap();
    // The pipe has room for the output before the loop begins, and for nothing more.
    let said = String::from_utf8(output.stdout).unwrap();
    let before = said.lines().take_while(|line| !line.contains("real-time priority"));
    let before = before.map(|line| line.len() + 1).sum();
    let (read, write) = nearly_full_pipe(before);
    let mut child = jog(write.into());
    let start = monotonic();
    while rig.with_torque() == 0 && monotonic() - start < PATIENCE {
        assert!(child.try_wait().unwrap().is_none(), "it ended");
        std::thread::yield_now();
    }
    let waits = rig.with_torque() == 0;
    drop(read);
    assert!(!waits, "the loop waits");
    assert_eq!(child.wait().unwrap().code(), Some(0));
}

/// Real-time priority of a process' first thread; 0 where it has none (proc(5), rt_priority).
fn real_time_priority(process: u32) -> u32 {
    let stat = fs::read_to_string(format!("/proc/{process}/stat")).unwrap();
    let (_, fields) = stat.rsplit_once(") ").unwrap();
    fields.split(' ').nth(37).unwrap().parse().unwrap()
}

#[test]
fn an_endless_computation_of_the_loop_leaves_the_guard_a_processor() {
    let rig = Rig::new("horse.toml", "");
    let child = rig.start("run", &["--for", "60"]);
    rig.wait_for_torque(true);
    let [controller, guard] = [child.id(), guard_of(&rig, &child)].map(real_time_priority);
    signal(child.id(), "KILL");
    rig.wait_for_torque(false);
    child.wait_with_output().unwrap();
    if controller == 0 {
        eprintln!(
            "skipped: this user may not have real-time priorities ('rtprio 80' in limits.conf permits them)"
        );
        return;
    }
    assert!(guard > controller, "{guard} and {controller}");
}

#[test]
fn the_guard_waits_for_a_port_that_is_briefly_in_use() {
    let rig = Rig::new("horse.toml", "");
    let device = rig.server.as_ref().unwrap().paths()[0].clone();
    let earlier = serialport::new(device.to_str().unwrap(), 1_000_000).exclusive(true);
    let earlier = serialport::TTYPort::open(&earlier).unwrap();
    let mut child = rig.start("jog", &["left_hind.hip", "-85"]);
    let mut said = BufReader::new(child.stderr.take().unwrap()).lines().map(Result::unwrap);
    assert!(said.any(|line| line.contains("is in use")), "it did not wait");
    drop(earlier);
    let rest: Vec<String> = said.collect();
    assert_eq!(child.wait().unwrap().code(), Some(0), "{rest:?}");
}

#[test]
fn a_port_that_cannot_be_opened_leaves_no_guard_process() {
    let rig = Rig::new("horse.toml", "");
    // Another program uses the port. A guard that acted would try to open it for a minute.
    let device = rig.server.as_ref().unwrap().paths()[0].clone();
    let missing = format!("main={}.gone", device.display());
    for command in [&["run", "--for", "1"][..], &["jog", "left_hind.hip", "-85"]] {
        let child = rig.start(command[0], &[&command[1..], &["--port", &missing]].concat());
        let output = child.wait_with_output().unwrap();
        assert_eq!(output.status.code(), Some(1), "{}", said(&output));
        assert!(said(&output).contains("does not exist"), "{}", said(&output));
        assert!(!said(&output).contains("guard"), "{}", said(&output));
        assert!(processes_with(&rig.robot_file).is_empty());
    }
}
