//! The `hippocamp` command.

fn main() {}
