//! What a comparison comes to.

use serde::Serialize;

/// How two backends compare; the worse is the greater.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// Every pixel has the same bits, and every ray the same answer.
    Identical,
    /// What differs is no more than noise, and next to no ray is answered wrongly.
    StatisticallyEqual,
    /// They do not show the same scene.
    Differs,
}

impl Verdict {
    /// In words.
    pub fn name(self) -> &'static str {
        match self {
            Self::Identical => "identical",
            Self::StatisticallyEqual => "statistically equal",
            Self::Differs => "differs",
        }
    }
}
