//! Panics while the robot has torque: their messages wait until the robot is safe.

use std::backtrace::{Backtrace, BacktraceStatus};
use std::panic::{self, AssertUnwindSafe};
use std::sync::{Arc, Mutex, PoisonError};

use super::say::complain;

/// Calls `work`. A panic in it, on any thread, prints nothing at first: looking up names for a backtrace takes
/// tenths of a second, which the servos of a panicked loop do not have. Afterwards the message is printed,
/// backtrace included.
pub(super) fn said_afterwards<R>(work: impl FnOnce() -> R) -> R {
    said_to(complain, work)
}

fn said_to<R>(mut tell: impl FnMut(&str), work: impl FnOnce() -> R) -> R {
    let kept = Arc::new(Mutex::new(Vec::new()));
    let keeping = Arc::clone(&kept);
    let usual = panic::take_hook();
    panic::set_hook(Box::new(move |panic| {
        let thread = std::thread::current().name().unwrap_or("(without a name)").to_owned();
        // Only addresses so far; nothing at all unless RUST_BACKTRACE asks for it.
        let backtrace = Backtrace::capture();
        keeping.lock().unwrap_or_else(PoisonError::into_inner).push((thread, panic.to_string(), backtrace));
    }));
    let done = panic::catch_unwind(AssertUnwindSafe(work));
    panic::set_hook(usual);
    for (thread, said, backtrace) in kept.lock().unwrap_or_else(PoisonError::into_inner).drain(..) {
        let backtrace = match backtrace.status() {
            BacktraceStatus::Captured => backtrace.to_string(),
            _ => "note: RUST_BACKTRACE=1 shows where it came from".to_owned(),
        };
        format!("thread '{thread}' {said}\n{backtrace}").lines().for_each(&mut tell);
    }
    done.unwrap_or_else(|cause| panic::resume_unwind(cause))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One test for all cases, since all threads share the hook.
    #[test]
    fn a_panic_unwinds_as_usual_and_is_reported_whether_it_is_caught_or_not() {
        let caught = said_to(|_| {}, || panic::catch_unwind(|| panic!("a panic this test wants")));
        assert_eq!(caught.unwrap_err().downcast_ref(), Some(&"a panic this test wants"));

        let mut said = Vec::new();
        let tell = |line: &str| said.push(line.to_owned());
        let caught = panic::catch_unwind(AssertUnwindSafe(|| said_to(tell, || panic!("another one"))));
        assert_eq!(caught.unwrap_err().downcast_ref(), Some(&"another one"));
        assert!(said.iter().any(|line| line == "another one"), "{said:?}");
    }
}
