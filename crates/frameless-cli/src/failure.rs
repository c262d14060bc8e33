//! What went wrong, as one line and an exit code.

use std::fmt;

use crate::output::printable;

/// An error together with whose mistake it is.
#[derive(Debug)]
pub(crate) struct Failure {
    error: anyhow::Error,
    bad_input: bool,
}

impl Failure {
    /// The arguments or a file are not what they should be.
    pub(crate) fn bad_input(error: impl Into<anyhow::Error>) -> Failure {
        Failure { error: error.into(), bad_input: true }
    }

    /// Something else: the machine, its disk or display, or a mistake of ours.
    pub(crate) fn other(error: impl Into<anyhow::Error>) -> Failure {
        Failure { error: error.into(), bad_input: false }
    }

    /// Arguments that the parser refuses: its sentence without the usage below it.
    pub(crate) fn of_arguments(error: &clap::Error) -> Failure {
        let text = error.to_string();
        let sentence = text.split("\n\nUsage:").next().unwrap_or_default();
        let sentence = sentence.split("\n\nFor more information").next().unwrap_or_default();
        let sentence = sentence.trim_start_matches("error: ").replace("\n\n", "; ");
        Failure::bad_input(anyhow::anyhow!("{sentence}; see --help"))
    }

    /// 2: bad input; 1: everything else.
    pub(crate) fn code(&self) -> u8 {
        if self.bad_input { 2 } else { 1 }
    }
}

/// What is not known to be the user's mistake.
impl From<anyhow::Error> for Failure {
    fn from(error: anyhow::Error) -> Failure {
        Failure::other(error)
    }
}

impl fmt::Display for Failure {
    /// The error and its causes on one line. Some errors tell their cause themselves: it is not told again.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut told = String::new();
        for cause in self.error.chain() {
            let cause = one_line(&cause.to_string());
            if !told.ends_with(&cause) {
                told = if told.is_empty() { cause } else { format!("{told}: {cause}") };
            }
        }
        f.write_str(&told)
    }
}

/// Lines joined by spaces.
fn one_line(text: &str) -> String {
    printable(&text.split_whitespace().collect::<Vec<_>>().join(" "))
}

#[cfg(test)]
mod tests {
    use super::*;
    use anyhow::{Context, anyhow};

    #[test]
    fn causes_are_joined_and_told_once() {
        let error: anyhow::Error = Err::<(), _>(anyhow!("disk full"))
            .context("cannot write a.png: disk full")
            .context("render")
            .unwrap_err();
        let failure = Failure::from(error);
        assert_eq!(failure.to_string(), "render: cannot write a.png: disk full");
        assert_eq!(failure.code(), 1);
    }

    #[test]
    fn an_error_is_one_line_without_terminal_commands() {
        let failure = Failure::bad_input(anyhow!("line 3:\n  |\n3 | x = \u{1b}[2J\n"));
        assert_eq!(failure.to_string(), "line 3: | 3 | x = \u{fffd}[2J");
        assert_eq!(failure.code(), 2);
    }
}
