//! Lines from standard input, which may be a terminal, a pipe, or nothing at all.

use std::io::{self, BufRead, BufReader};
use std::time::Duration;

use crossbeam_channel::{Receiver, bounded};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::process::getpgrp;
use rustix::termios::tcgetpgrp;

use crate::platform::{monotonic, sleep_until};

/// Lines that may wait while one is carried out.
const LINES_WAITING: usize = 64;
/// How often it is looked whether there is something to read, and whether it may be read.
const LOOK_EVERY: Duration = Duration::from_millis(200);

/// What is typed, line by line. At the end of standard input there is no more.
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

/// Waits a while for something to read. A program in the background that read its terminal would be stopped by the
/// system, and its servos with it: it waits until it is in the foreground.
fn is_ready() -> bool {
    let input = io::stdin();
    if tcgetpgrp(&input).is_ok_and(|foreground| foreground != getpgrp()) {
        sleep_until(monotonic() + LOOK_EVERY);
        return false;
    }
    let Ok(timeout) = Timespec::try_from(LOOK_EVERY) else { return true };
    // Where it cannot be waited for, it can be read at once.
    poll(&mut [PollFd::new(&input, PollFlags::IN)], Some(&timeout)) != Ok(0)
}
