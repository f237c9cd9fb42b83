//! The operators: they give a running robot its orders, cycle by cycle.
//!
//! In: a script's entries, keys, sticks, and the time. Out: an [`Instruction`]. Operators touch no terminal, device
//! or file; nothing waits; and once made no operator allocates.

mod ending;
mod key_codes;
mod script;

use crate::motion::Order;
pub use ending::Ending;
pub use key_codes::{Decoder, Key};
pub use script::{Entry, Playback, Script};

/// An order, and the reason in the report if the run ends by it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Instruction {
    /// The order.
    pub order: Order,
    /// The reason, for the report.
    pub reason: &'static str,
}

impl From<Order> for Instruction {
    fn from(order: Order) -> Instruction {
        let reason = match order {
            Order::StopAtOnce => "emergency stop by the operator",
            Order::Go | Order::Drive(_) | Order::Perform(_) | Order::Take(_) | Order::Stop => {
                "stopped by the operator"
            }
        };
        Instruction { order, reason }
    }
}
