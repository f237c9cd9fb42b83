//! The guard: a process that outlives the controller and takes the torque off if it dies without its safe stop.
//!
//! Feetech servos hold their last goal for ever, so a killed controller would leave the robot standing under
//! torque. The controller starts the guard before any torque is on and holds one end of a pipe to it. From the
//! first cycle of the loop to its last the controller writes one [`BEAT`] a cycle; then it writes [`REST`]. Each
//! side notices the loss of the other:
//!
//! - the pipe closes: the controller is gone, and its ports, which no other program could use till then, are free;
//! - the beats stop for longer than the guard allows ([`patience`]): the controller hangs, or was stopped; the
//!   guard kills it, which frees its ports;
//! - a beat cannot be written: the guard is gone, or hangs; the controller stops the robot.
//!
//! At a safe end the controller kills its guard, which then has nothing to do.

mod letting_go;
mod patience;

use std::ffi::OsString;
use std::io::{BufRead, BufReader, IsTerminal};
use std::os::fd::{AsFd, BorrowedFd, OwnedFd};
use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use anyhow::{Context, Result, bail};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fs::{OFlags, fcntl_getfl, fcntl_setfl};
use rustix::io::Errno;
use rustix::pipe::fcntl_setpipe_size;
use rustix::process::{PidfdFlags, Signal, getppid, pidfd_open, pidfd_send_signal};
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};

use super::BadInput;
use super::ports::{PortOption, devices};
use crate::{config, platform};
use letting_go::take_torque_off;
use patience::{Cause, HANGS, LOOK_EVERY, STARVES, SilenceTimer, ThreadStat};

/// Written by the controller once a cycle, and when its loop is over.
const BEAT: u8 = b'.';
const REST: u8 = b'-';
/// Beats that a hanging guard may leave unread, some ten seconds of them: the smallest possible pipe, bytes.
const PIPE_BYTES: usize = 4096;
/// Written by the guard when it is ready.
const READY: &str = "ready";
/// The controller's handle on its guard.
#[derive(Debug)]
pub(super) struct Guard {
    child: Child,
    pipe: OwnedFd,
    /// True from the first torque until an end that all servos have confirmed.
    is_needed: bool,
}

impl Guard {
    /// Starts a guard over the `ports` of the robot in `robot_file`, and waits until it is ready.
    pub(super) fn start(robot_file: &Path, ports: &[PortOption]) -> Result<Guard> {
        let program = std::env::current_exe().context("the guard could not be started")?;
        let mut arguments: Vec<OsString> = vec!["guard".into(), robot_file.into()];
        for port in ports {
            arguments.extend(["--port".into(), port.to_argument()]);
        }
        let mut child = Command::new(program)
            .args(arguments)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            // In its own process group: Ctrl-C is for the controller.
            .process_group(0)
            .spawn()
            .context("the guard could not be started")?;
        give_way();
        let (Some(pipe), Some(words)) = (child.stdin.take(), child.stdout.take()) else {
            bail!("the guard has no pipes");
        };
        never_wait(pipe.as_fd()).context("the pipe to the guard")?;
        fcntl_setpipe_size(&pipe, PIPE_BYTES).context("the pipe to the guard")?;
        let mut word = String::new();
        BufReader::new(words).read_line(&mut word).context("the guard said nothing")?;
        if word.trim() != READY {
            bail!("the guard did not get ready");
        }
        Ok(Guard { child, pipe: pipe.into(), is_needed: false })
    }
}

impl Guard {
    /// The loop's end of the pipe to the guard.
    pub(super) fn heart(&self) -> Result<Heartbeat> {
        Ok(Heartbeat(self.pipe.try_clone().context("the pipe to the guard")?))
    }

    /// Calls `work`, which puts torque on. Afterwards the guard is no longer needed if `work` failed to start, or
    /// if every servo has confirmed its end (`is_heard`). In all other cases the guard takes the torque off once
    /// this process, or its hold on the guard, is gone.
    pub(super) fn over<R>(
        mut self,
        work: impl FnOnce() -> Result<R>,
        is_heard: impl Fn(&R) -> bool,
    ) -> Result<R> {
        self.is_needed = true;
        let done = work();
        // A failed start has put torque on no servo.
        self.is_needed = done.as_ref().is_ok_and(|done| !is_heard(done));
        done
    }
}

/// Lowers this process's own protection a little if the system spares it when memory runs out. The guard has the
/// same setting and keeps it: so the guard takes the torque off if this process has to go, and not the other way
/// round.
fn give_way() {
    const PLACE: &str = "/proc/self/oom_score_adj";
    let spared = std::fs::read_to_string(PLACE).ok().and_then(|text| text.trim().parse().ok());
    if let Some(spared) = spared.and_then(less_spared) {
        // Always permitted, since it lowers the protection.
        let _ = std::fs::write(PLACE, spared.to_string());
    }
}

/// Adjustment for a process that is spared slightly less than at `adjustment`, from -1000 (never ended) to 1000;
/// `None` if it is not spared at all.
fn less_spared(adjustment: i32) -> Option<i32> {
    (adjustment < 0).then_some((adjustment + 100).min(0))
}

fn never_wait(end: BorrowedFd<'_>) -> rustix::io::Result<()> {
    fcntl_setfl(end, fcntl_getfl(end)? | OFlags::NONBLOCK)
}

impl Drop for Guard {
    fn drop(&mut self) {
        if !self.is_needed {
            let _ = self.child.kill();
            let _ = self.child.wait();
        }
    }
}

/// Sends the guard signs of life from the loop. Never waits, allocates nothing.
#[derive(Debug)]
pub(super) struct Heartbeat(OwnedFd);

impl Heartbeat {
    /// Call once a cycle. False if the guard is gone, or has not listened for long.
    pub(super) fn beat(&self) -> bool {
        // One byte: written or not. If a signal interrupts it, further beats follow.
        matches!(rustix::io::write(&self.0, &[BEAT]), Ok(_) | Err(Errno::INTR))
    }

    /// Call when the loop is over: from now on silence means nothing.
    pub(super) fn rest(&self) {
        let _ = rustix::io::write(&self.0, &[REST]);
    }
}

/// Event that ends the guard's wait.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Found {
    /// The controller closed the pipe without a safe end.
    Gone,
    /// Its loop fell silent for longer than the guard allows.
    Silent(Cause),
}

/// Waits for the controller at the other end of `pipe` to end; `source` reports on its loop's thread.
fn listen(pipe: BorrowedFd<'_>, source: &ThreadStat) -> Result<Found> {
    let mut bytes = [0; PIPE_BYTES];
    let mut patience = SilenceTimer::default();
    let look_every = Timespec::try_from(LOOK_EVERY).context("the guard's clock")?;
    loop {
        // Only a hang-up ends the wait early: so the loop's beats do not wake the guard and cost the loop its
        // processor.
        match poll(&mut [PollFd::new(&pipe, PollFlags::empty())], Some(&look_every)) {
            Ok(_) => {}
            Err(Errno::INTR) => continue,
            Err(error) => return Err(error).context("the controller cannot be heard"),
        }
        match rustix::io::read(pipe, &mut bytes) {
            Ok(0) => return Ok(Found::Gone),
            Ok(count) => patience.hear(bytes[count - 1] == BEAT),
            Err(Errno::AGAIN | Errno::INTR) => {
                if let Some(cause) = patience.hear_nothing(source.look()) {
                    return Ok(Found::Silent(cause));
                }
            }
            Err(error) => return Err(error).context("the controller cannot be heard"),
        }
    }
}

/// `hippocamp guard`: waits for the end of the controller.
pub(super) fn guard(robot_file: &Path, ports: &[PortOption]) -> Result<()> {
    if std::io::stdin().is_terminal() {
        return Err(BadInput(
            "'guard' is for internal use: 'run' and 'jog' start it when they use real servos, and it \
             takes their torque off if the controller dies; nothing was touched"
                .to_owned(),
        )
        .into());
    }
    // A signal that ends the controller's terminal or session must not end the guard before its work.
    let ignored = Arc::new(AtomicBool::new(false));
    for signal in [SIGHUP, SIGINT, SIGTERM] {
        signal_hook::flag::register(signal, Arc::clone(&ignored)).context("signals could not be ignored")?;
    }
    let robot = config::load(robot_file)?.robot;
    let devices = devices(&robot, ports)?;
    let pipe = std::io::stdin();
    never_wait(pipe.as_fd()).context("the pipe from the controller")?;
    // The controller waits for the ready message, so it cannot have ended and its process id cannot be reused yet.
    let controller = getppid().context("the guard is for internal use")?;
    let source = ThreadStat::of(controller.as_raw_pid());
    let controller = pidfd_open(controller, PidfdFlags::empty()).context("the controller")?;
    // A process that keeps others from the processors, the controller's loop among them, must not keep the guard
    // from the servos. The guard ignores a refusal: the controller reports its own.
    platform::request_guard_priority();
    say!("{READY}");

    let found = listen(pipe.as_fd(), &source)?;
    let what = match found {
        Found::Gone => "the controller did not end safely".to_owned(),
        Found::Silent(Cause::Hangs) => {
            format!(
                "the controller's loop gave no sign of life for {} s, and was killed",
                HANGS.as_secs_f64()
            )
        }
        Found::Silent(Cause::Starves) => format!(
            "other programs kept the controller's loop from running for {} s, and it was killed",
            STARVES.as_secs_f64()
        ),
    };
    if found != Found::Gone {
        let _ = pidfd_send_signal(&controller, Signal::KILL);
    }
    take_torque_off(&robot, devices, &controller, &what)
}

#[cfg(test)]
mod tests {
    use rustix::pipe::{PipeFlags, pipe_with};

    use super::*;
    use crate::platform::{monotonic, sleep_until};

    /// The guard's end of a pipe, and the loop's.
    fn pipe() -> (OwnedFd, Heartbeat) {
        let (near, far) = pipe_with(PipeFlags::CLOEXEC | PipeFlags::NONBLOCK).unwrap();
        fcntl_setpipe_size(&far, PIPE_BYTES).unwrap();
        (near, Heartbeat(far))
    }

    #[test]
    fn the_controller_is_killed_for_memory_before_its_guard() {
        let all = [-1000, -900, -50, 0, 300].map(less_spared);
        assert_eq!(all, [Some(-900), Some(-800), Some(0), None, None]);
    }

    #[test]
    fn a_dead_guard_is_noticed_at_the_next_beat() {
        let (near, heart) = pipe();
        assert!(heart.beat());
        drop(near);
        assert!(!heart.beat());
    }

    #[test]
    fn a_guard_that_does_not_listen_is_noticed_without_waiting() {
        let (_near, heart) = pipe();
        let beats = std::iter::repeat_with(|| heart.beat()).take_while(|is_heard| *is_heard).count();
        // At 100 Hz 41 s, at 500 Hz 8 s.
        assert_eq!(beats, PIPE_BYTES);
    }

    #[test]
    fn the_guard_notices_a_silent_loop_but_not_an_ended_one() {
        let (near, heart) = pipe();
        heart.beat();
        let start = monotonic();
        let unknown = ThreadStat::of(-1);
        assert_eq!(listen(near.as_fd(), &unknown).unwrap(), Found::Silent(Cause::Hangs));
        assert!(monotonic() - start >= HANGS);

        for is_begun in [true, false] {
            let (near, heart) = pipe();
            if is_begun {
                heart.beat();
                heart.rest();
            }
            let closing = std::thread::spawn(move || {
                sleep_until(monotonic() + 2 * HANGS);
                drop(heart);
            });
            assert_eq!(listen(near.as_fd(), &unknown).unwrap(), Found::Gone, "begun: {is_begun}");
            closing.join().unwrap();
        }
    }
}
