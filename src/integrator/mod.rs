//! Radiance from rays.
