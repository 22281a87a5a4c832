//! How the program ends.

use super::terminal::note;
use std::process::ExitCode;

/// An exit code.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Exit {
    /// All went well.
    Done = 0,
    /// It did not; or `diff` found more than the threshold.
    Failed = 1,
    /// The arguments or the files they name make no sense.
    Bad = 2,
    /// Some of several pictures were not made.
    Some = 3,
    /// Stopped by a signal (`EX_TEMPFAIL`: try again).
    Interrupted = 75,
}

impl From<Exit> for ExitCode {
    fn from(exit: Exit) -> Self {
        Self::from(exit as u8)
    }
}

/// An error and the exit code that it leads to.
#[derive(Debug)]
pub(super) struct Failure {
    exit: Exit,
    error: anyhow::Error,
}

impl Failure {
    /// Bad usage, in a message of our own.
    pub(super) fn bad(message: String) -> Self {
        Self { exit: Exit::Bad, error: anyhow::Error::msg(message) }
    }

    /// Work that failed, in a message of our own.
    pub(super) fn failed(message: String) -> Self {
        Self { exit: Exit::Failed, error: anyhow::Error::msg(message) }
    }

    /// Says what went wrong, once.
    pub(super) fn report(self) -> Exit {
        note(&format!("error: {}", self.message()));
        self.exit
    }

    /// The error and its causes, but for those that a message before them already tells.
    fn message(&self) -> String {
        self.error.chain().map(ToString::to_string).fold(String::new(), |told, cause| match told {
            told if told.is_empty() => cause,
            told if told.contains(&cause) => told,
            told => format!("{told}: {cause}"),
        })
    }
}

/// Gives an error its exit code.
pub(super) trait OrExit<T> {
    /// The work failed.
    fn or_failed(self) -> Result<T, Failure>;
    /// The work made no sense.
    fn or_bad(self) -> Result<T, Failure>;
}

impl<T, E: Into<anyhow::Error>> OrExit<T> for Result<T, E> {
    fn or_failed(self) -> Result<T, Failure> {
        self.map_err(|e| Failure { exit: Exit::Failed, error: e.into() })
    }

    fn or_bad(self) -> Result<T, Failure> {
        self.map_err(|e| Failure { exit: Exit::Bad, error: e.into() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use anyhow::Context;

    #[test]
    fn causes_are_told_once() {
        let cause = || Err::<(), _>(anyhow::anyhow!("no such file"));
        let told = |result: anyhow::Result<()>| result.or_bad().unwrap_err().message();
        assert_eq!(told(cause().context("cannot read a.toml")), "cannot read a.toml: no such file");
        assert_eq!(
            told(cause().context("cannot read a.toml: no such file")),
            "cannot read a.toml: no such file"
        );
    }
}
