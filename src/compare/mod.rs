//! What is different: two pictures ([`diff`]), two backends ([`job`]).
//!
//! For backends read [`job`] first, then [`answers`] (which rays are answered differently), [`explain`] (by whom
//! wrongly), [`rate`] (how fast) and [`picture`] (whether more than noise differs); [`text`] and [`page`] tell it.

pub mod answers;
pub mod diff;
pub mod explain;
pub mod flip;
pub mod job;
pub mod magma;
pub mod page;
pub mod picture;
mod plane;
pub mod rate;
pub mod text;
pub mod verdict;

pub use job::{Comparison, Contender, Options, Pair, Subject, run};
pub use verdict::Verdict;
