//! EXR and PNG.
