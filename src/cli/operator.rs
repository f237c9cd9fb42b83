//! Gives the orders while a command moves the robot: from its driver, from signals, and when the guard is gone.

use anyhow::{Context, Result};
use crossbeam_channel::{Receiver, bounded};
use signal_hook::consts::{SIGHUP, SIGINT, SIGQUIT, SIGTERM, SIGTSTP};
use signal_hook::iterator;

use super::drivers::Driver;
use super::guard::Heartbeat;
use super::ports::warn;
use super::status::Notes;
use crate::motion::Order;
use crate::observe::Outcome;
use crate::operator::Instruction;
use crate::platform;
use crate::run;
use crate::signals::Status;

/// Printed, and written into the report, when the guard is gone.
const GUARD_GONE: &str = "the guard process is gone or hangs, so nothing would take the torque off if this program \
                          died too: stopped";

/// Parts that only a loop on real servos has.
pub(super) struct OnHardware {
    /// The processor to stay on, if one was named.
    pub(super) processor: Option<usize>,
    /// Tells the guard that the loop is alive.
    pub(super) heart: Heartbeat,
}

/// Takes orders from a driver and from signals; also holds the parts for real servos.
pub(super) struct Terminal {
    signals: Signals,
    driver: Driver,
    notes: Option<Notes>,
    hardware: Option<OnHardware>,
    is_first: bool,
    /// The last order by signal.
    ordered: Option<Order>,
    /// Why the driver ordered a stop.
    reason: &'static str,
    is_guard_gone: bool,
    has_said_so: bool,
}

impl Terminal {
    /// Its messages go to `notes`, if there is a status line.
    pub(super) fn new(
        signals: Signals,
        driver: Driver,
        notes: Option<Notes>,
        hardware: Option<OnHardware>,
    ) -> Terminal {
        Terminal {
            signals,
            driver,
            notes,
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
                // In the first cycle all memory is taken and all other threads are running.
                let notes = platform::request_real_time(*processor);
                // A thread of its own: the loop must not wait for a terminal or pipe that does not read.
                std::thread::spawn(move || notes.iter().for_each(|note| say!("  {note}")));
            }
            self.is_guard_gone |= !heart.beat();
        }
        self.is_first = false;

        let notes = self.notes.as_ref();
        let asked = self.driver.instruction(status, |words| {
            notes.map(|notes| notes.say(words));
        });
        self.ordered = self.signals.0.try_recv().ok().or(self.ordered);
        // A signal takes precedence over the driver, unless the driver orders an emergency stop.
        let Instruction { order, reason } = match self.ordered {
            Some(order) if asked.order != Order::StopAtOnce => order.into(),
            _ => asked,
        };
        self.reason = reason;
        if self.is_guard_gone && !self.has_said_so {
            self.has_said_so = self.notes.as_ref().is_none_or(|notes| notes.say(GUARD_GONE));
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

/// Orders by signals: the first SIGINT or SIGTERM orders a stop, the second one a stop at once. A closing terminal,
/// and Ctrl-Z, which would freeze the robot, count the same.
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

    /// True if a signal has come since the last call: for commands that only look.
    pub(super) fn is_stop_ordered(&self) -> bool {
        self.0.try_recv().is_ok()
    }
}
