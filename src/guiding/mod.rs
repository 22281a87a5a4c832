//! Path guiding: where a surface should look for light that its own rays hardly find.
//!
//! Towards caustics: a ray that leaves a wall meets the spot of a chrome ball that mirrors the lamp once in thousands of
//! times, and then brings thousands of times the mean: the bright dots of path tracing. So before a render photons are shot
//! that meet a lamp, then a sharp glossy surface, then a diffuse one (Jensen 1995, *Importance Driven Path Tracing using the
//! Photon Map*), or one that is much rougher than what has reflected them: the floor of brushed steel before a mirror. Where they
//! land they tell from where, and part of the rays that leave the surface are sent there, each ray weighted by the density of the
//! mixture; those of a glossy lobe to what it shows of that light. Photons carry no light into the picture: however few or wrong,
//! they change its noise and never its mean.
//!
//! Towards all other light that surfaces reflect: a room whose lamps face its ceiling is lit by a patch of that, which a wall's rays
//! meet now and then. So camera paths walk the scene before a render, and what they bring back tells from where each part of
//! it is lit, where that is from few directions (Müller et al. 2017, *Practical Path Guiding for Efficient Light-Transport
//! Simulation*; mixtures as Vorba et al. 2014 have them). Of the numbers of a Sobol sequence a lobe's own rays make good use, so
//! that guides must be good to be better: they know of thousands of sights each, and a pilot looks whether they are.
//!
//! Towards portals: of a sky that is seen through a window a wall's rays find as much as the window takes of the view, and
//! samples of the sky by its own brightness are stopped by the walls. So rays are sent out before a render that look for the
//! sky, and where few find it, those tell where samples of lights shall look for it too. Whoever wants that elsewhere puts
//! rectangles into his windows by hand (Bitterli et al. 2015, *Portal-Masked Environment Map Sampling*).
//!
//! Read [`GuideMap`] first; `photons` makes what it is made of, from points of `reflectors`, `look` finds what else there is,
//! `sights` what camera paths see, and `portals` what finds the sky; a `mixture` is what it gives, which `fit` makes of photons.
//! [`Guides`] are both maps that the rays of wide lobes ask.

mod fit;
mod guides;
mod look;
mod map;
mod mixture;
mod photons;
mod portals;
mod reflectors;
mod sights;

pub use guides::{CellNumbers, Guides};
pub use map::{Cell, GuideMap, unguided};
pub use mixture::{Lobe, Mixture};
