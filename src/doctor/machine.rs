//! The computer: whether it lets the loop be punctual.

use super::lines::Lines;
use crate::platform::request_real_time;

/// Asks for what a run asks for, on a thread that takes it with it.
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
