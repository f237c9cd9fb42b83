//! Ctrl-C in commands that talk to single servos: the step under way is finished, then no other is begun.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use anyhow::{Context, Result};
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
use signal_hook::flag;

use super::FAILED;

/// Set once the user wants to break off; asked for a second time, the program ends at once.
pub(super) fn flag() -> Result<Arc<AtomicBool>> {
    let is_set = Arc::new(AtomicBool::new(false));
    for signal in [SIGHUP, SIGINT, SIGTERM] {
        flag::register_conditional_shutdown(signal, i32::from(FAILED), Arc::clone(&is_set))
            .and_then(|_| flag::register(signal, Arc::clone(&is_set)))
            .context("signals could not be caught")?;
    }
    Ok(is_set)
}
