//! Radiance from rays: the wave loop and what it decides at a surface.
//!
//! A tile is rendered by one thread. All paths of a wave take the same step together: their rays go to the
//! accelerator as one slice, hits are shaded by eight, surfaces of a kind together (`order`), shadow rays go as a second
//! slice, and the rays that leave make the next wave. Read [`Integrator::render`](Integrator) in `wave`, then `vertex` (one
//! hit), `eight` (what eight hits need, found side by side), `alike` (the ordinary case: eight surfaces of
//! one kind, by their `lobes`; `bounced` are the rays that leave them), `bounce` (which rays leave a hit), `direct` (light
//! straight from lights), `candidates` (samples of lights chosen among several), `guided` (rays towards caustics), `portals`
//! (samples of the environment through windows) and `occlusion` (reflections of the environment without rays); `start` is
//! where camera rays begin, `edges` those that look for edges of lamps alone, and `roots` where it all comes together.
//! Knows nothing of files or progress, nor of threads but where edges are looked for before the picture.

mod alike;
mod bounce;
mod bounced;
mod candidates;
mod direct;
mod edges;
mod eight;
mod guide;
mod guided;
mod lobes;
mod metals;
mod occlusion;
mod order;
mod path;
mod plastics;
mod portals;
mod powers;
mod roots;
mod start;
mod tally;
mod vertex;
mod wave;

pub use edges::EmitterEdges;
pub use start::z_order;
pub use tally::{ClassCount, RayClass, RayLog, Tally};
pub use wave::{Integrator, Scratch, Work};
