//! Panics while the robot has torque: what they have to say can wait until it is safe.

use std::backtrace::{Backtrace, BacktraceStatus};
use std::panic;
use std::sync::{Arc, Mutex, PoisonError};

use super::say::complain;

/// Does `work`. A panic in it, on any thread, says nothing at first: names for a backtrace take tenths of a second to
/// look up, which the servos of a loop that panicked do not have. It is said afterwards, backtrace included.
pub(super) fn said_afterwards<R>(work: impl FnOnce() -> R) -> R {
    let kept = Arc::new(Mutex::new(Vec::new()));
    let keeping = Arc::clone(&kept);
    let usual = panic::take_hook();
    panic::set_hook(Box::new(move |panic| {
        let thread = std::thread::current().name().unwrap_or("(without a name)").to_owned();
        // Only addresses so far; nothing at all unless RUST_BACKTRACE asks for it.
        let backtrace = Backtrace::capture();
        keeping.lock().unwrap_or_else(PoisonError::into_inner).push((thread, panic.to_string(), backtrace));
    }));
    let done = work();
    panic::set_hook(usual);
    for (thread, said, backtrace) in kept.lock().unwrap_or_else(PoisonError::into_inner).drain(..) {
        let backtrace = match backtrace.status() {
            BacktraceStatus::Captured => backtrace.to_string(),
            _ => "note: RUST_BACKTRACE=1 shows where it came from".to_owned(),
        };
        format!("thread '{thread}' {said}\n{backtrace}").lines().for_each(complain);
    }
    done
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_goes_on_as_it_would_and_the_usual_hook_is_back_afterwards() {
        let caught = said_afterwards(|| panic::catch_unwind(|| panic!("a panic this test wants")));
        assert_eq!(caught.unwrap_err().downcast_ref(), Some(&"a panic this test wants"));
    }
}
