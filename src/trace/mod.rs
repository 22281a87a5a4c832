//! Rays of a render, kept in a file or in memory, and asked again of any backend: what the rays alone cost.
//!
//! Read [`RayFile`] for the format's writer, [`read`] for its reader, [`record`] for rays that stay in memory,
//! [`replay`] for the stop-watch and [`clock`] for what it reads.

pub mod clock;
mod file;
mod record;
mod replay;

pub use file::{Batch, RayFile, RayFileError, read};
pub use record::record;
pub use replay::{ClassTiming, Replay, Round, ask, ask_all, replay};
