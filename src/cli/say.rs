//! Printing.

/// Prints a line to standard output. A reader who has gone away is no reason for a robot to fail.
macro_rules! say {
    ($($text:tt)*) => {{
        use std::io::Write as _;
        let _ = writeln!(std::io::stdout(), $($text)*);
    }};
}
