//! Lines from standard input, which may be a terminal, a pipe, or nothing at all.

use std::io::{self, BufRead, BufReader};
use std::time::Duration;

use crossbeam_channel::{Receiver, bounded};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::process::getpgrp;
use rustix::termios::tcgetpgrp;

use crate::platform::{monotonic, sleep_until};

/// Most lines that wait while one is carried out.
const LINES_WAITING: usize = 64;
/// Time between checks whether there is input, and whether this program may read it.
const LOOK_EVERY: Duration = Duration::from_millis(200);

/// The typed lines. The channel closes at the end of standard input.
pub(in crate::cli) fn lines() -> io::Result<Receiver<String>> {
    let (sender, receiver) = bounded(LINES_WAITING);
    std::thread::Builder::new().name("standard input".to_owned()).spawn(move || {
        let mut input = BufReader::new(io::stdin());
        let mut line = Vec::new();
        loop {
            if input.buffer().is_empty() && !is_ready() {
                continue;
            }
            line.clear();
            match input.read_until(b'\n', &mut line) {
                Ok(1..) if sender.send(String::from_utf8_lossy(&line).into_owned()).is_ok() => {}
                _ => return,
            }
        }
    })?;
    Ok(receiver)
}

/// Waits a while for input. The system would stop a background program that reads its terminal, and its servos with
/// it: so this waits until the program is in the foreground.
fn is_ready() -> bool {
    let input = io::stdin();
    if tcgetpgrp(&input).is_ok_and(|foreground| foreground != getpgrp()) {
        sleep_until(monotonic() + LOOK_EVERY);
        return false;
    }
    let Ok(timeout) = Timespec::try_from(LOOK_EVERY) else { return true };
    // Input that cannot be polled can be read at once.
    poll(&mut [PollFd::new(&input, PollFlags::IN)], Some(&timeout)) != Ok(0)
}
