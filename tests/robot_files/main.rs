//! Robot files: those that come with the program, the facts of a good one, and the messages for bad ones.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod bad;
mod balls;
mod facts;
mod page;

/// A good file made to be spoiled: two buses, every optional key once, no two numbers alike where it matters.
const GOOD: &str = include_str!("good.toml");
