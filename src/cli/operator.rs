//! Who gives the orders while a command moves the robot: the person at the terminal, and the guard's absence.

use anyhow::{Context, Result};
use crossbeam_channel::{Receiver, bounded};
use signal_hook::consts::{SIGHUP, SIGINT, SIGQUIT, SIGTERM, SIGTSTP};
use signal_hook::iterator::Signals;

use super::guard::Heart;
use super::ports::warn;
use super::status::StatusLine;
use crate::motion::Order;
use crate::platform;
use crate::run::{self, Status};

/// Said, and written into the report, when the guard is gone.
const GUARD_GONE: &str = "the guard process is gone or hangs, and nobody would take the torque off if this program \
                          died too: stopped";

/// What a loop on real servos has beside it; one on simulated servos has nothing of it.
pub(super) struct OnHardware {
    /// The processor to stay on, if one was named.
    pub(super) processor: Option<usize>,
    /// Tells the guard that the loop is alive.
    pub(super) heart: Heart,
}

/// Signals in, the status line out; and what a loop on real servos has beside it.
pub(super) struct Terminal {
    signals: Receiver<Order>,
    order: Order,
    status_line: Option<StatusLine>,
    hardware: Option<OnHardware>,
    is_first: bool,
    is_guard_gone: bool,
    has_said_so: bool,
}

impl Terminal {
    /// Catches signals from now on. Shows no status without a `status_line`.
    pub(super) fn new(status_line: Option<StatusLine>, hardware: Option<OnHardware>) -> Result<Terminal> {
        Ok(Terminal {
            signals: orders_from_signals()?,
            order: Order::Go,
            status_line,
            hardware,
            is_first: true,
            is_guard_gone: false,
            has_said_so: false,
        })
    }
}

impl run::Operator for Terminal {
    fn hear(&mut self, note: &str) {
        warn(note);
    }

    fn order(&mut self, status: &Status) -> Order {
        if let Some(OnHardware { processor, heart }) = &self.hardware {
            if self.is_first {
                // In the first cycle, when all memory is taken and all other threads are there.
                for note in platform::request_real_time(*processor) {
                    say!("  {note}");
                }
            }
            self.is_guard_gone |= !heart.beat();
        }
        self.is_first = false;
        if let Some(line) = &mut self.status_line {
            line.show(status);
            self.has_said_so = self.has_said_so || (self.is_guard_gone && line.note(GUARD_GONE));
        }
        self.order = self.signals.try_recv().unwrap_or(self.order);
        if self.is_guard_gone && !self.order.is_stop() { Order::Stop } else { self.order }
    }

    fn why_stopped(&self) -> Option<&'static str> {
        self.is_guard_gone.then_some(GUARD_GONE)
    }

    fn loop_ended(&mut self) {
        if let Some(OnHardware { heart, .. }) = &self.hardware {
            heart.rest();
            platform::end_real_time();
        }
    }
}

/// The first SIGINT or SIGTERM (or a terminal that closes, or Ctrl-Z, which would freeze the robot) orders a stop,
/// the second one at once.
fn orders_from_signals() -> Result<Receiver<Order>> {
    let (sender, receiver) = bounded(8);
    let mut signals =
        Signals::new([SIGHUP, SIGINT, SIGQUIT, SIGTERM, SIGTSTP]).context("signals could not be caught")?;
    std::thread::spawn(move || {
        let orders = std::iter::once(Order::Stop).chain(std::iter::repeat(Order::StopAtOnce));
        for (_, order) in signals.forever().zip(orders) {
            let _ = sender.try_send(order);
        }
    });
    Ok(receiver)
}
