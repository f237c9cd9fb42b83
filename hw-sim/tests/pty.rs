//! Buses on pseudo-terminals: the bytes of the manuals, in real time.
#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod common;

use std::fs::{File, OpenOptions};
use std::io::{Read, Write};

use common::*;
use hw_sim::pty::PtyServer;
use hw_sim::{BusConfig, FaultScript, World};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::termios::{OptionalActions, tcgetattr, tcsetattr};

/// Long enough never to pass in a test that works.
const MINUTE: Timespec = Timespec { tv_sec: 60, tv_nsec: 0 };

/// A server of `world` and the folder its links are in.
fn served(world: World) -> (PtyServer, tempfile::TempDir) {
    let folder = tempfile::tempdir().unwrap();
    (PtyServer::start(world, folder.path()).unwrap(), folder)
}

fn open(server: &PtyServer, bus: usize, baud: u32) -> File {
    let line = OpenOptions::new().read(true).write(true).open(&server.paths()[bus]).unwrap();
    let mut settings = tcgetattr(&line).unwrap();
    settings.set_speed(baud).unwrap();
    tcsetattr(&line, OptionalActions::Now, &settings).unwrap();
    line
}

/// Waits for the expected bytes, or for the end of the line.
fn wait(line: &File, flags: PollFlags) -> PollFlags {
    let mut lines = [PollFd::new(line, flags)];
    poll(&mut lines, Some(&MINUTE)).unwrap();
    lines[0].revents()
}

#[test]
fn a_servo_answers_at_its_rate_and_not_before_the_wire_allows() {
    let (server, _folder) = served(world(feetech_bus(vec![servo("STS3215-12V", 1)])));
    let mut line = open(&server, 0, 1_000_000);
    let before = server.with_world(|world| world.now_ns());
    line.write_all(&feetech(1, 0x01, &[])).unwrap();
    let mut answer = [0; 6];
    line.read_exact(&mut answer).unwrap();
    assert_eq!(answer.to_vec(), feetech(1, 0, &[]));
    // 12 bytes at 10 us.
    assert!(server.with_world(|world| world.now_ns()) >= before + 120_000);
}

#[test]
fn at_another_rate_a_line_stays_silent() {
    let legs = feetech_bus(vec![servo("STS3215-12V", 1)]);
    let arms = BusConfig { name: "arms".into(), ..legs.clone() };
    let world = World::new(&[legs, arms], FaultScript::default(), 1).unwrap();
    let (server, _folder) = served(world);
    let (mut legs, mut arms) = (open(&server, 0, 500_000), open(&server, 1, 1_000_000));
    let ping = feetech(1, 0x01, &[]);
    legs.write_all(&ping).unwrap();
    arms.write_all(&ping).unwrap();
    // When the one that is understood has answered, the other has had its time.
    arms.read_exact(&mut [0; 6]).unwrap();
    assert_eq!(poll(&mut [PollFd::new(&legs, PollFlags::IN)], Some(&Timespec::default())), Ok(0));
    let from_servos = |bus| server.with_world(|world| world.wire_statistics(bus)).unwrap().bytes_from_servos;
    assert_eq!((from_servos(0), from_servos(1)), (0, 6));
    // At the right rate it answers too.
    drop(legs);
    let mut legs = open(&server, 0, 1_000_000);
    legs.write_all(&ping).unwrap();
    legs.read_exact(&mut [0; 6]).unwrap();
}

#[test]
fn a_scripted_unplug_hangs_up_and_the_path_reappears() {
    let script = "[[fault]]\nkind = 'unplugged'\nbus = 'legs'\nat_s = 0.05\nfor_s = 0.05\n";
    let (server, _folder) = served(world_with_faults(feetech_bus(vec![servo("STS3215-12V", 1)]), script));
    let line = open(&server, 0, 1_000_000);
    assert!(wait(&line, PollFlags::empty()).contains(PollFlags::HUP));
    // Under the same path there is another terminal, when its time has come.
    while server.with_world(|world| world.is_unplugged(0)) || !server.paths()[0].exists() {}
    let mut line = open(&server, 0, 1_000_000);
    line.write_all(&feetech(1, 0x01, &[])).unwrap();
    assert!(wait(&line, PollFlags::IN).contains(PollFlags::IN));
}

#[test]
fn dropping_the_server_hangs_up_and_removes_the_links() {
    let (server, folder) = served(world(feetech_bus(vec![servo("STS3215-12V", 1)])));
    let line = open(&server, 0, 1_000_000);
    drop(server);
    assert!(wait(&line, PollFlags::empty()).contains(PollFlags::HUP));
    assert_eq!(folder.path().read_dir().unwrap().count(), 0);
}
