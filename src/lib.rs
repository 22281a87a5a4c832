//! Glossy reflection on large meshes: a renderer whose rays are answered by Embree or by a pure-Rust BVH.
//!
//! Read from the bottom of the layers to the top; a module imports only those above it in this list.
//!
//! | layer | module | holds |
//! | --- | --- | --- |
//! | 0 | [`core`] | rays, hits, frames, colours, warps with their pdfs, samplers |
//! | 1 | [`geometry`] | triangle meshes, spheres, bounds, readers and generators |
//! | 1 | [`bxdf`] | one lobe a file; [`bxdf::Bsdf`] is what a surface point reflects with |
//! | 1 | [`film`], [`image_io`] | per pixel: sum, sum of squares, count; EXR, HDR and PNG |
//! | 2 | [`accel`] | who answers rays: `brute`, `bvh`, `embree` |
//! | 3 | [`scene`] | description, loading, camera, lights, materials, the plan |
//! | 4 | [`integrator`] | radiance from rays: the wave loop |
//! | 5 | [`render`] | tiles on threads, stop rules |
//! | 6 | [`trace`], [`report`], [`compare`], [`figures`], [`farm`], [`batch`], [`sweep`], [`trade`] | whole jobs made of renders |
//! | 7 | [`cli`] | the command line |

pub mod accel;
pub mod batch;
pub mod bxdf;
pub mod cli;
pub mod compare;
pub mod core;
pub mod farm;
pub mod figures;
pub mod film;
pub mod geometry;
pub mod guiding;
pub mod image_io;
pub mod integrator;
pub mod render;
pub mod report;
pub mod scene;
pub mod sweep;
pub mod trace;
pub mod trade;
