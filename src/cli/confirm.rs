//! Asks for consent before a command writes to a servo.

use std::io::IsTerminal;

use anyhow::Result;

use super::{BadInput, interrupt, say};

/// Prints that `what` is about to be done and asks for consent, unless `yes`.
///
/// # Errors
/// If the answer is no, or no one is there to ask.
pub(super) fn confirm(what: &str, yes: bool) -> Result<()> {
    if yes {
        say!("{what}");
        return Ok(());
    }
    let input = std::io::stdin();
    if !input.is_terminal() {
        return Err(BadInput(format!("{what}: --yes does so without asking; nothing was written")).into());
    }
    say::ask(&format!("{what}. Continue? [y/N]"));
    let mut answer = String::new();
    let _ = interrupt::while_asking(|| input.read_line(&mut answer));
    match answer.trim() {
        "y" | "Y" | "yes" => Ok(()),
        _ => Err(anyhow::anyhow!("not confirmed; nothing was written")),
    }
}
