//! The `hippocamp` command.

use std::process::ExitCode;

fn main() -> ExitCode {
    hippocamp::cli::main()
}
