//! Many pictures in one process: geometry is read, and structures are built, once for all that share them.
//!
//! Read [`Picture`] (what is to be made), [`Workshop`] (who makes it and what it keeps), [`Record`] (what is left to
//! tell), then `jobs` (a file of jobs, with [`Frames`] and `keyframe`). [`sweep`](crate::sweep) makes its pictures here
//! too. Knows nothing of the command line.

mod frames;
mod jobs;
mod keyframe;
mod name;
mod picture;
mod record;
mod workshop;

pub use frames::Frames;
pub use jobs::{Jobs, JobsError};
pub use name::{NameError, Variables};
pub use picture::{Picture, PictureError, check_names_differ, share};
pub use record::Record;
pub use workshop::{Made, Workshop, WorkshopOptions};
