//! What denoisers are told of a camera sample: the surface that it shows, which may stand in a mirror.
//!
//! A surface is looked through if its sharp lobes reflect at least half of its light. From there the path's own ray of
//! a sharp lobe is followed (the first one where a hit splits; at glass that of the way that shows more), so that nothing
//! is traced for this. Where that ray does not leave, because another lobe was chosen or the path ends, the surface itself
//! is told of.

use super::bounce::Leaving;
use super::path::Path;
use super::wave::Integrator;
use crate::bxdf::Bsdf;
use crate::core::Rgb;
use crate::film::Guide;
use crate::scene::SurfaceInteraction;

/// Roughness up to which things can be made out in what a lobe reflects: they are blurred by about 3 degrees.
const SHARP_ALPHA: f32 = 0.05;

/// What is known so far of what a camera sample shows.
#[derive(Clone, Copy)]
pub(super) struct Trail {
    /// What the film is told in the end.
    pub guide: Guide,
    /// Length of the way so far, in unit lengths.
    pub way: f32,
    /// Rays for which the followed one stands, where hits have split: each counts with its share.
    rays: f32,
}

impl Default for Trail {
    fn default() -> Self {
        Self { guide: Guide::default(), way: 0.0, rays: 1.0 }
    }
}

impl Integrator<'_> {
    /// Notes what the followed `path` has come to, or that it goes on: by which of the lobes.
    pub(super) fn tell(
        &self,
        path: &Path,
        point: &SurfaceInteraction,
        bsdf: &Bsdf,
        leaving: &Leaving,
        trail: &mut Trail,
    ) -> Option<usize> {
        let [mut sharp, mut other] = [Rgb::BLACK; 2];
        // Of the sharp lobes with rays, the one that reflects the most, and what all of them do.
        let (mut followed, mut most, mut with_rays) = (None, 0.0, 0.0);
        let mut other_rate = 0.0;
        for (number, lobe) in bsdf.lobes().iter().enumerate() {
            if lobe.is_sharp(SHARP_ALPHA) {
                let albedo = lobe.albedo(&point.at);
                sharp += albedo;
                let shown = if leaving.count[number] > 0 { albedo.luminance() } else { 0.0 };
                with_rays += shown;
                if shown > most {
                    (followed, most) = (Some(number), shown);
                }
            } else {
                other += lobe.albedo(&point.at);
                other_rate += leaving.rate[number];
            }
        }
        let looked_through = sharp.luminance() > 0.0 && sharp.luminance() >= other.luminance();
        if looked_through && let Some(lobe) = followed {
            trail.rays *= leaving.count[lobe] as f32 * with_rays / most;
            return followed;
        }
        // Where one lobe was chosen among several, it stands for those that were not.
        let albedo = if looked_through && other_rate > 0.0 {
            other * other_rate.recip().max(1.0)
        } else {
            sharp + other
        };
        self.describe(path, point, albedo, trail);
        None
    }

    /// Notes the surface at the end of the followed path.
    pub(super) fn describe(&self, path: &Path, point: &SurfaceInteraction, albedo: Rgb, trail: &mut Trail) {
        let Trail { guide, way, rays } = trail;
        let albedo = path.beta * albedo * *rays;
        guide.albedo = if albedo.is_finite() { albedo } else { Rgb::BLACK };
        guide.normal = point.at.n.to_array();
        guide.depth = self.scene.world.length_to_scene(*way) as f32;
    }
}
