//! Ctrl-C in commands that write to single servos: the program finishes the present step and begins no other. While
//! it asks the user something nothing is under way, so it ends at once.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, OnceLock};

use anyhow::{Context, Result};
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
use signal_hook::flag;

use super::FAILED;

/// Static, since signals concern the whole program.
static STATE: OnceLock<State> = OnceLock::new();

struct State {
    is_to_stop: Arc<AtomicBool>,
    is_asking: Arc<AtomicBool>,
}

/// Catches Ctrl-C from now on. The returned flag is set once the user wants to break off; the second time, the
/// program ends at once.
pub(super) fn catch() -> Result<&'static AtomicBool> {
    let state = State { is_to_stop: Arc::default(), is_asking: Arc::default() };
    if STATE.get().is_none() {
        for signal in [SIGHUP, SIGINT, SIGTERM] {
            flag::register_conditional_shutdown(signal, i32::from(FAILED), Arc::clone(&state.is_asking))
                .and_then(|_| {
                    flag::register_conditional_shutdown(
                        signal,
                        i32::from(FAILED),
                        Arc::clone(&state.is_to_stop),
                    )
                })
                .and_then(|_| flag::register(signal, Arc::clone(&state.is_to_stop)))
                .context("signals could not be caught")?;
        }
    }
    Ok(&STATE.get_or_init(|| state).is_to_stop)
}

/// Calls `ask`, which waits for the user.
pub(super) fn while_asking<R>(ask: impl FnOnce() -> R) -> R {
    let set = |is_asking| {
        if let Some(state) = STATE.get() {
            state.is_asking.store(is_asking, Ordering::Relaxed);
        }
    };
    set(true);
    let result = ask();
    set(false);
    result
}
