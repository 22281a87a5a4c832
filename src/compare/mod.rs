//! What is different: two pictures ([`diff`]).

pub mod diff;
pub mod flip;
pub mod magma;
mod plane;
