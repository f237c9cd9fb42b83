//! The messages for a command that ends in an error: one line for each fault, always with the file concerned.

use std::error::Error;
use std::ffi::OsString;
use std::path::Path;

use clap::Parser;

use super::{Arguments, BAD_INPUT, COMPLETED, FAILED, say};
use crate::bus::StartError;
use crate::bus::serial::OpenError;
use crate::config::ConfigError;
use crate::kinds::Refusal;
use crate::output::OutputError;
use crate::printable::printable;
use crate::recording::ReadError;
use crate::replay::ReplayError;
use crate::service::{BackupError, BadValue};

/// Bad input: exit code 2.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub(super) struct BadInput(pub(super) String);

impl From<Refusal> for BadInput {
    fn from(Refusal(why): Refusal) -> BadInput {
        BadInput(why)
    }
}

/// Several faults at once, one line each.
#[derive(Debug, thiserror::Error)]
#[error("{}", lines.join("\n"))]
pub(super) struct Several {
    pub(super) lines: Vec<String>,
    /// True if the input is at fault.
    pub(super) is_input: bool,
}

/// Parses the command line.
///
/// # Errors
/// The exit code if the program should end here: after --help, and after a wrong command line.
pub(super) fn parse() -> Result<Arguments, u8> {
    let error = match Arguments::try_parse() {
        Ok(arguments) => return Ok(arguments),
        Err(error) => error,
    };
    if !error.use_stderr() {
        say::note(error.print());
        return Err(say::end(COMPLETED));
    }
    let typed: Vec<OsString> = std::env::args_os().collect();
    let shown = || typed.iter().map(|argument| printable(&argument.to_string_lossy()).into_owned());
    if shown().zip(&typed).all(|(shown, typed)| shown.as_str() == typed) {
        let _ = error.print();
    } else {
        // The error quotes the typed text, with its newlines. So parse a printable copy, which fails in the same
        // way.
        let error = Arguments::try_parse_from(shown()).err().unwrap_or(error);
        error.render().to_string().lines().for_each(say::complain);
    }
    Err(BAD_INPUT)
}

/// Prints why a command with these `files`, the main one first, ended; returns the exit code.
pub(super) fn tell(error: &anyhow::Error, files: &[&Path]) -> u8 {
    let is_refusal = is_refusal(error);
    let mut lines = lines_of(error);
    if is_refusal && !error.is::<ConfigError>() {
        name_file(&mut lines, files);
    }
    lines[0].insert_str(0, "hippocamp: ");
    lines.iter().for_each(|line| say::complain(line));
    if is_refusal { BAD_INPUT } else { FAILED }
}

fn is_refusal(error: &anyhow::Error) -> bool {
    error.is::<BadInput>()
        || error.is::<OutputError>()
        || error.is::<ConfigError>()
        || error.is::<ReadError>()
        || error.is::<BackupError>()
        || error.is::<BadValue>()
        || error.is::<ReplayError>()
        || error.downcast_ref::<Several>().is_some_and(|several| several.is_input)
}

/// The error and its causes in one line; if it lists faults, one line each. At least one line.
fn lines_of(error: &anyhow::Error) -> Vec<String> {
    let mut lines = vec![String::new()];
    for cause in error.chain() {
        let mut faults = faults_of(cause).into_iter();
        if let (Some(last), Some(first)) = (lines.last_mut(), faults.next()) {
            *last += if last.is_empty() { "" } else { ": " };
            *last += &first;
        }
        lines.extend(faults);
    }
    lines
}

fn faults_of(cause: &(dyn Error + 'static)) -> Vec<String> {
    if let Some(error) = cause.downcast_ref::<ConfigError>() {
        error.lines()
    } else if let Some(error) = cause.downcast_ref::<OpenError>() {
        error.faults.iter().map(ToString::to_string).collect()
    } else if let Some(error) = cause.downcast_ref::<StartError>() {
        error.to_string().lines().map(str::to_owned).collect()
    } else if let Some(error) = cause.downcast_ref::<Several>() {
        error.lines.clone()
    } else {
        vec![cause.to_string()]
    }
}

/// Adds the first of `files` if the lines name none of them.
fn name_file(lines: &mut [String], files: &[&Path]) {
    let is_named = |file: &&Path| lines.iter().any(|line| line.contains(&*file.to_string_lossy()));
    let (Some(file), false) = (files.first(), files.iter().any(is_named)) else { return };
    let first = &mut lines[0];
    *first = match first.starts_with("--") {
        true => format!("{first} ({})", file.display()),
        false => format!("{}: {first}", file.display()),
    };
}

#[cfg(test)]
mod tests {
    use anyhow::anyhow;

    use super::*;

    #[test]
    fn each_fault_has_a_line_and_context_stands_before_the_first() {
        let several =
            Several { lines: vec!["bus a".to_owned(), "bus b\nforged".to_owned()], is_input: false };
        let error = anyhow::Error::from(several).context("the ports");
        assert_eq!(lines_of(&error), ["the ports: bus a", "bus b\nforged"]);
        assert_eq!(lines_of(&anyhow!("gone").context("joint")), ["joint: gone"]);
    }

    #[test]
    fn a_refusal_without_a_file_name_is_printed_with_the_file_it_concerns() {
        let files = [Path::new("a.toml"), Path::new("b.toml")];
        for (said, told) in [
            ("foal has no servos", "a.toml: foal has no servos"),
            ("--gait pace: expected one of walk", "--gait pace: expected one of walk (a.toml)"),
            ("b.toml:3: expected a gait", "b.toml:3: expected a gait"),
        ] {
            let mut lines = vec![said.to_owned()];
            name_file(&mut lines, &files);
            assert_eq!(lines, [told]);
        }
    }
}
