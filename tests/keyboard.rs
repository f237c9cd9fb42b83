//! A person at the keyboard: keys typed into a real terminal, and what its screen shows.
//!
//! Simulated buses and a virtual clock, so nothing here waits for time to pass: each key is typed once the screen
//! shows what the one before has done.
#![allow(clippy::unwrap_used, reason = "helpers of tests; a failed one should panic")]

use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;

use pty_process::Size;
use pty_process::blocking::Pty;
use rustix::termios::{LocalModes, tcgetattr};

const HORSE: &str = "config/horse.toml";
const UP: &str = "\x1b[A";
const LEFT: &str = "\x1b[D";
const RIGHT: &str = "\x1b[C";
/// A program that writes nothing for this long counts as hung.
const SILENCE: Duration = Duration::from_secs(120);
/// A state not reached after so many status lines, half an hour of the run, will not come.
const LINES: usize = 10_000;

/// The program in a terminal of 24 lines.
struct Screen {
    pty: Pty,
    child: Child,
    pieces: Receiver<Vec<u8>>,
    /// Read from the terminal but not shown yet.
    pending: Vec<u8>,
    parser: vt100::Parser,
}

/// A status line.
#[derive(Debug, PartialEq)]
struct Line {
    /// The robot's motion, and the ordered motion if that differs: "walk -> trot".
    doing: String,
    speed_m_s: f64,
    asked_m_s: f64,
    /// Turn and turn asked for, degrees/s to the left.
    turn_deg_s: f64,
    asked_deg_s: f64,
}

impl Screen {
    fn run(arguments: &[&str]) -> Screen {
        let (pty, pts) = pty_process::blocking::open().unwrap();
        pty.resize(Size::new(24, 100)).unwrap();
        let child = pty_process::blocking::Command::new(env!("CARGO_BIN_EXE_hippocamp"))
            .args(["run", HORSE, "--keys", "--virtual"])
            .args(arguments)
            .current_dir(env!("CARGO_MANIFEST_DIR"))
            .spawn(pts)
            .unwrap();
        let mut reader = std::fs::File::from(rustix::io::dup(&pty).unwrap());
        let (sender, pieces) = channel();
        std::thread::spawn(move || {
            let mut bytes = [0; 1024];
            // An error means that the other end is closed.
            while let Ok(count @ 1..) = reader.read(&mut bytes) {
                if sender.send(bytes[..count].to_vec()).is_err() {
                    return;
                }
            }
        });
        Screen { pty, child, pieces, pending: Vec::new(), parser: vt100::Parser::new(24, 100, 0) }
    }

    fn press(&mut self, keys: &str) {
        self.pty.write_all(keys.as_bytes()).unwrap();
    }

    fn text(&self) -> String {
        self.parser.screen().contents()
    }

    /// Shows what the program wrote, up to the next status line at most; false once there is no more.
    fn advance(&mut self) -> bool {
        while self.pending.is_empty() {
            match self.pieces.recv_timeout(SILENCE) {
                Ok(piece) => self.pending = piece,
                Err(_) => return false,
            }
        }
        let next = self.pending.iter().skip(1).position(|byte| *byte == b'\r');
        let rest = self.pending.split_off(next.map_or(self.pending.len(), |next| next + 1));
        self.parser.process(&self.pending);
        self.pending = rest;
        true
    }

    /// Waits until the screen shows `words`.
    fn see(&mut self, words: &str) {
        for _ in 0..LINES {
            if self.text().contains(words) {
                return;
            }
            if !self.advance() {
                break;
            }
        }
        panic!("the screen never showed '{words}':\n{}", self.text());
    }

    /// Waits for a status line that passes the check.
    fn see_line(&mut self, what: &str, is_right: impl Fn(&Line) -> bool) -> Line {
        for _ in 0..LINES {
            if let Some(line) = self.line().filter(|line| is_right(line)) {
                return line;
            }
            if !self.advance() {
                break;
            }
        }
        panic!("the screen never showed {what}:\n{}", self.text());
    }

    /// The status line, if all of it is there.
    fn line(&self) -> Option<Line> {
        let text = self.text();
        let (_, line) = text.lines().rfind(|line| line.ends_with(" V"))?.split_once(" s ")?;
        let mut parts = line.split(", ");
        let doing = parts.next()?;
        let pair = |part: &str, unit: &str| -> Option<(f64, f64)> {
            let (reached, asked) = part.strip_suffix(unit)?.split_once(" of ")?;
            Some((reached.rsplit(' ').next()?.parse().ok()?, asked.parse().ok()?))
        };
        let (speed_m_s, asked_m_s) = pair(doing, " m/s").unwrap_or_default();
        let doing = doing.split(" 0.").next()?.to_owned();
        let turn = parts.next()?;
        let (turn_deg_s, asked_deg_s) = match (pair(turn, " deg/s left"), pair(turn, " deg/s right")) {
            (Some(left), _) => left,
            (_, Some((reached, asked))) => (-reached, -asked),
            _ => (0.0, 0.0),
        };
        Some(Line { doing, speed_m_s, asked_m_s, turn_deg_s, asked_deg_s })
    }

    /// Waits for a robot that goes `gait` as fast as it was asked to, straight on.
    fn see_gait(&mut self, gait: &str) -> Line {
        self.see_line(&format!("a {gait} at the speed asked for"), |line| {
            line.doing == gait && line.asked_m_s > 0.0 && line.reached() && line.asked_deg_s.abs() < 0.05
        })
    }

    /// Waits for the end of the program; its exit code.
    fn end(&mut self) -> Option<i32> {
        while self.advance() {}
        self.child.wait().unwrap().code()
    }
}

impl Line {
    /// As fast and as sharply as asked, to the last place shown.
    fn reached(&self) -> bool {
        (self.speed_m_s - self.asked_m_s).abs() < 1.5e-3 && (self.turn_deg_s - self.asked_deg_s).abs() < 0.15
    }
}

impl Drop for Screen {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// A path for a file of one test.
fn scratch(name: &str) -> PathBuf {
    Path::new(env!("CARGO_TARGET_TMPDIR")).join(name)
}

#[test]
fn keys_make_the_horse_walk_trot_canter_turn_and_stop() {
    let mut screen = Screen::run(&[]);
    screen.see("1 walk");
    screen.see("EMERGENCY STOP");
    screen.see_line("a standing horse", |line| line.doing == "standing");

    screen.press("1");
    screen.see_line("a walk on the spot", |line| line.doing == "walk" && line.asked_m_s.abs() < 1e-9);
    screen.press(&UP.repeat(5));
    let walk = screen.see_gait("walk");

    let gaits = ["walk", "walk-steady", "trot", "canter"];
    let key = |name: &str| (1 + gaits.iter().position(|gait| *gait == name).unwrap()).to_string();
    screen.press(&key("trot"));
    let trot = screen.see_gait("trot");
    assert!(trot.speed_m_s > 1.5 * walk.speed_m_s, "half of a trot is faster: {trot:?} after {walk:?}");
    screen.press(&key("canter"));
    let canter = screen.see_gait("canter");
    assert!(canter.speed_m_s > 1.5 * trot.speed_m_s, "{canter:?} after {trot:?}");

    screen.press(&key("walk"));
    screen.see_gait("walk");
    screen.press(&LEFT.repeat(2));
    let left = screen.see_line("a turn to the left", |line| line.asked_deg_s > 0.0 && line.reached());
    assert!(left.doing == "walk" && left.turn_deg_s > 0.5, "{left:?}");
    screen.press(&RIGHT.repeat(4));
    screen.see_line("a turn to the right", |line| line.turn_deg_s < -0.5 && line.reached());

    screen.press(" ");
    let stands = screen.see_line("a standing horse", |line| line.doing == "standing");
    assert!(stands.speed_m_s.abs() < 1e-9 && stands.asked_m_s.abs() < 1e-9, "{stands:?}");
    screen.press("q");
    assert_eq!(screen.end(), Some(0), "{}", screen.text());
    assert!(screen.text().contains("completed: stopped by the operator"), "{}", screen.text());
    assert!(screen.text().contains("0 goals outside their range, 0 too fast"), "{}", screen.text());
}

#[test]
fn every_way_to_stop_ends_the_run_and_restores_the_terminal() {
    for keys in ["q", "x", "X", "\x1b", "\x03", "\x04", "\x1a", "qx", "\x03\x03"] {
        let mut screen = Screen::run(&[]);
        screen.see_line("a horse that does as it is told", |line| line.asked_m_s.abs() < 1e-9);
        let settings = tcgetattr(&screen.pty).unwrap().local_modes;
        assert!(!settings.intersects(LocalModes::ICANON | LocalModes::ECHO), "{keys:?}");
        screen.press(keys);
        assert_eq!(screen.end(), Some(0), "{keys:?}: {}", screen.text());
        // Two signals at once may be one to the program.
        let ended = match keys {
            "x" | "X" | "\x1b" | "qx" => "completed: emergency stop by the operator",
            "\x03\x03" => " by the operator",
            _ => "completed: stopped by the operator",
        };
        assert!(screen.text().contains(ended), "{keys:?}: {}", screen.text());
        let settings = tcgetattr(&screen.pty).unwrap().local_modes;
        assert!(settings.contains(LocalModes::ICANON | LocalModes::ECHO), "{keys:?}");
    }
}

#[test]
fn arrow_and_other_keys_cause_no_emergency_stop() {
    let mut screen = Screen::run(&[]);
    screen.see("up, down");
    screen.press("\x1bOA\x1b[3~\x1b[15~\x1bOP");
    let first = screen.see_line("one step faster", |line| line.asked_m_s > 0.0);
    screen.press(UP);
    screen.see_line("two steps faster", |line| (line.asked_m_s - 2.0 * first.asked_m_s).abs() < 1.5e-3);
    screen.press("q");
    assert_eq!(screen.end(), Some(0));
}

#[test]
fn the_loss_of_the_terminal_ends_the_run() {
    let report = scratch("terminal-gone.json");
    let mut screen = Screen::run(&["--report", report.to_str().unwrap()]);
    screen.see("up, down");
    screen.press("1");
    let Screen { pty, child, pieces, .. } = &mut screen;
    // Both of this side's ends are closed: the reading thread's, once it has read the last, and this one.
    drop(std::mem::replace(pieces, channel().1));
    let (other, _) = pty_process::blocking::open().unwrap();
    drop(std::mem::replace(pty, other));
    assert_eq!(child.wait().unwrap().code(), Some(0));
    let report = std::fs::read_to_string(report).unwrap();
    assert!(report.contains("\"outcome\": \"completed\""), "{report}");
}

#[test]
fn keys_need_a_terminal() {
    let output = Command::new(env!("CARGO_BIN_EXE_hippocamp"))
        .args(["run", HORSE, "--keys", "--virtual"])
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .stdin(Stdio::null())
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert!(said.contains("--keys") && said.contains("not a terminal"), "{said}");
}
