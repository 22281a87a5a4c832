//! EXR and PNG.

pub mod read;
