//! Rays of a render kept in a file, and asked again of any backend: what the rays alone cost.
//!
//! Read [`RayFile`] for the format's writer, [`read`] for its reader, [`replay`] for the stop-watch.

mod file;
mod replay;

pub use file::{Batch, RayFile, RayFileError, read};
pub use replay::{ClassTiming, Replay, replay};
