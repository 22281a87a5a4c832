//! The small nouns that every layer shares: rays, hits, frames, colours, warps, samplers.
//!
//! Knows nothing of scenes, surfaces or images. Read [`Ray`] and [`Hit`] first.

mod blue_noise;
pub mod exponential;
mod fixed;
mod frame;
pub mod lanes;
pub mod memory;
mod prefetch;
mod ray;
mod rgb;
pub mod sampler;
pub mod special;
pub mod warp;
mod wide;

pub use fixed::{Fixed, Gathered, Ordinary};
pub use frame::Frame;
pub use prefetch::prefetch;
pub use ray::{Hit, Ray, Skip};
pub use rgb::Rgb;
pub use sampler::{Sampler, SamplerKind};
pub use wide::{Wide, widely};

pub use glam::Vec3;
