//! A picture in parts: broken off and gone on with, cut into shards for many machines, and put together again.
//!
//! All of it rests on one file, the [`Checkpoint`]: an EXR of exact sums and counts that knows of which picture it is a
//! part. Read `header` (what a checkpoint says of itself), `file` (how it is stored), [`Shard`] (how work is cut),
//! [`merge()`] (how parts become the whole), [`Keeper`] (who writes while a render runs), [`submit`] (how a scheduler is
//! told). Knows nothing of scenes but their hash and settings.

mod file;
mod header;
mod keeper;
mod merge;
mod scheduler;
mod shard;
pub mod submit;
mod words;

pub use file::{Checkpoint, CheckpointError, Summary};
pub use header::{Header, Identity, Part};
pub use keeper::Keeper;
pub use merge::{MergeError, Merged, find, merge};
pub use scheduler::{SchedulerError, find_index};
pub use shard::{Shard, ShardBy, ShardError};
