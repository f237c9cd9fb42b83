//! Who gives the orders while a command moves the robot: its driver, signals, and the guard's absence.

use anyhow::{Context, Result};
use crossbeam_channel::{Receiver, bounded};
use signal_hook::consts::{SIGHUP, SIGINT, SIGQUIT, SIGTERM, SIGTSTP};
use signal_hook::iterator;

use super::drivers::Driver;
use super::guard::Heart;
use super::ports::warn;
use super::status::StatusLine;
use crate::motion::Order;
use crate::operator::Instruction;
use crate::platform;
use crate::run;
use crate::signals::Status;
use crate::telemetry::Outcome;

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

/// A driver and signals in, the status line out; and what a loop on real servos has beside it.
pub(super) struct Terminal {
    signals: Signals,
    driver: Driver,
    status_line: Option<StatusLine>,
    hardware: Option<OnHardware>,
    is_first: bool,
    /// What signals ordered last.
    ordered: Option<Order>,
    /// Why the driver ordered a stop.
    reason: &'static str,
    is_guard_gone: bool,
    has_said_so: bool,
}

impl Terminal {
    /// Shows no status without a `status_line`.
    pub(super) fn new(
        signals: Signals,
        driver: Driver,
        status_line: Option<StatusLine>,
        hardware: Option<OnHardware>,
    ) -> Terminal {
        Terminal {
            signals,
            driver,
            status_line,
            hardware,
            is_first: true,
            ordered: None,
            reason: Instruction::from(Order::Stop).reason,
            is_guard_gone: false,
            has_said_so: false,
        }
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
                let notes = platform::request_real_time(*processor);
                // A terminal that does not take them, or a pipe that nobody reads, is no reason for the loop to wait.
                std::thread::spawn(move || notes.iter().for_each(|note| say!("  {note}")));
            }
            self.is_guard_gone |= !heart.beat();
        }
        self.is_first = false;

        let line = &mut self.status_line;
        let asked = self.driver.instruction(status, |words| {
            if let Some(line) = line {
                line.note(words);
            }
        });
        self.ordered = self.signals.0.try_recv().ok().or(self.ordered);
        // A signal counts for more than the driver, but for an emergency.
        let Instruction { order, reason } = match self.ordered {
            Some(order) if asked.order != Order::StopAtOnce => order.into(),
            _ => asked,
        };
        self.reason = reason;
        if let Some(line) = &mut self.status_line {
            line.show(status, order);
            self.has_said_so = self.has_said_so || (self.is_guard_gone && line.note(GUARD_GONE));
        }
        if self.is_guard_gone && !order.is_stop() { Order::Stop } else { order }
    }

    fn why_stopped(&self) -> (Outcome, &'static str) {
        match self.is_guard_gone {
            true => (Outcome::StoppedBySafety, GUARD_GONE),
            false => (Outcome::Completed, self.reason),
        }
    }

    fn loop_ended(&mut self) {
        if let Some(OnHardware { heart, .. }) = &self.hardware {
            heart.rest();
            platform::end_real_time();
        }
    }
}

/// Orders by signals: the first SIGINT or SIGTERM (or a terminal that closes, or Ctrl-Z, which would freeze the
/// robot) orders a stop, the second one at once.
pub(super) struct Signals(Receiver<Order>);

impl Signals {
    /// Catches them from now on.
    pub(super) fn catch() -> Result<Signals> {
        let (sender, receiver) = bounded(8);
        let mut signals = iterator::Signals::new([SIGHUP, SIGINT, SIGQUIT, SIGTERM, SIGTSTP])
            .context("signals could not be caught")?;
        std::thread::spawn(move || {
            let orders = std::iter::once(Order::Stop).chain(std::iter::repeat(Order::StopAtOnce));
            for (_, order) in signals.forever().zip(orders) {
                let _ = sender.try_send(order);
            }
        });
        Ok(Signals(receiver))
    }

    /// Whether one has come since this was last asked: for commands that do nothing but look.
    pub(super) fn is_stop_ordered(&self) -> bool {
        self.0.try_recv().is_ok()
    }
}
