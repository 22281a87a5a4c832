//! What is wrong with a scene file, and where.

use std::fmt;
use std::path::{Path, PathBuf};

/// Where a value was written, as the parser knows it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Place {
    /// The scene file's byte.
    Offset(usize),
    /// The override of that number.
    Override(usize),
}

/// Where something is wrong, for people.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Location {
    /// In a file; line and column count from 1, the column in characters.
    File {
        /// Which.
        path: PathBuf,
        /// Line.
        line: usize,
        /// Column.
        column: usize,
    },
    /// In `-D path=value` or the flag that stands for it.
    Override(String),
}

impl Location {
    /// The line and column of a byte of `text`.
    pub(super) fn in_text(path: &Path, text: &str, offset: usize) -> Self {
        let mut end = offset.min(text.len());
        while !text.is_char_boundary(end) {
            end -= 1;
        }
        let before = &text[..end];
        let line_start = before.rfind('\n').map_or(0, |i| i + 1);
        Self::File {
            path: path.to_owned(),
            line: before.matches('\n').count() + 1,
            column: before[line_start..].chars().count() + 1,
        }
    }
}

impl fmt::Display for Location {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::File { path, line, column } => write!(f, "{}:{line}:{column}", path.display()),
            Self::Override(text) => write!(f, "-D {text}"),
        }
    }
}

/// Why a scene file does not make a scene.
#[derive(Debug, thiserror::Error)]
pub enum SceneError {
    /// A file cannot be read.
    #[error("cannot read {}: {source}", path.display())]
    Read {
        /// Which.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// The description is malformed or a value is out of its range.
    #[error("{location}: {message}")]
    Invalid {
        /// Where.
        location: Location,
        /// What is wrong, with the key's path where it has one, and what would mend it.
        message: String,
    },
}

/// The closest of `names` to what was written, as the end of a message: `; did you mean ...?`, or nothing.
pub(super) fn did_you_mean<'a>(written: &str, names: impl IntoIterator<Item = &'a str>) -> String {
    names
        .into_iter()
        .map(|name| (strsim::jaro_winkler(&written.to_lowercase(), &name.to_lowercase()), name))
        .filter(|(likeness, _)| *likeness > 0.75)
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map_or(String::new(), |(_, name)| format!("; did you mean `{name}`?"))
}

/// Names for a message: `a`, `b` or `c`.
pub(super) fn one_of<'a>(names: impl IntoIterator<Item = &'a str>) -> String {
    let quoted: Vec<String> = names.into_iter().map(|name| format!("`{name}`")).collect();
    match quoted.split_last() {
        None => "nothing (there are none)".into(),
        Some((last, [])) => last.clone(),
        Some((last, rest)) => format!("{} or {last}", rest.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_and_columns_count_from_one_and_in_characters() {
        let text = "a = 1\nµ = é\n";
        let at = |offset| Location::in_text(Path::new("s.toml"), text, offset).to_string();
        assert_eq!(at(0), "s.toml:1:1");
        assert_eq!(at(6), "s.toml:2:1");
        assert_eq!(at(text.find('é').unwrap()), "s.toml:2:5");
        assert_eq!(at(1000), "s.toml:3:1");
    }

    #[test]
    fn near_names_are_suggested_and_far_ones_are_not() {
        assert_eq!(did_you_mean("exponnt", ["kr", "exponent"]), "; did you mean `exponent`?");
        assert_eq!(did_you_mean("zzz", ["kr", "exponent"]), "");
    }
}
