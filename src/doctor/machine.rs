//! The computer: checks whether it lets the loop run on time.

use super::lines::Lines;
use crate::platform::request_real_time;

/// Makes the same requests as a run, on a thread of its own: they end with that thread.
pub(super) fn examine(lines: &mut Lines<'_>) {
    let asked = std::thread::spawn(|| request_real_time(None)).join().unwrap_or_default();
    for said in asked {
        let (found, cure) = said.split_once(": ").unwrap_or((&said, ""));
        match said.starts_with("no ") || said.contains("not ") || said.contains("with slack") {
            true => lines.warning("this machine", found, cure),
            false => lines.ok("this machine", said),
        }
    }
}
