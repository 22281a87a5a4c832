//! One described material in the unit world.

use super::SceneError;
use super::source::At;
use crate::bxdf::{Coat, ComplexIor, Horizon};
use crate::core::Rgb;
use crate::scene::desc::RgbDesc;
use crate::scene::desc::colour::{CheckerDesc, ColourDesc};
use crate::scene::desc::material::{ConductorDesc, DielectricDesc, ExponentDesc, MatteDesc, PlasticDesc};
use crate::scene::{Material, Specular, Texture, World};
use glam::DVec3;

/// Roughness where none is given.
const ALPHA: f32 = 0.1;

/// What the conversion of one material needs.
pub(super) struct Context<'a> {
    /// The material in the file.
    pub(super) at: &'a At<'a>,
    /// Where checkers are.
    pub(super) world: &'a World,
    /// The settings' policy below the surface.
    pub(super) horizon: Horizon,
}

impl Context<'_> {
    /// A factor times a colour; `None` for black.
    pub(super) fn texture(
        &self,
        keys: [&str; 2],
        factor: f64,
        colour: &ColourDesc,
    ) -> Result<Option<Texture>, SceneError> {
        let factor = self.at.non_negative(keys[0], factor)? as f32;
        let at = self.at.key(keys[1]);
        let texture = match colour {
            ColourDesc::Constant(rgb) => Texture::Constant(at.radiance(*rgb)? * factor),
            ColourDesc::Checker(desc) => checker(desc, factor, &at, self.world)?,
        };
        Ok(Some(texture).filter(|t| !t.brightest().is_black()))
    }

    /// A material that so far has its diffuse and ambient parts only.
    pub(super) fn matte(&self, name: String, desc: &MatteDesc) -> Result<Material, SceneError> {
        let (ca, ca_key) = desc.ca.as_ref().map_or((&desc.cd, "cd"), |ca| (ca, "ca"));
        Ok(Material {
            ambient: self.texture(["ka", ca_key], desc.ka, ca)?,
            diffuse: self.texture(["kd", "cd"], desc.kd.unwrap_or(0.0), &desc.cd)?,
            ..black(name)
        })
    }

    /// A metal.
    pub(super) fn conductor(&self, name: String, desc: &ConductorDesc) -> Result<Material, SceneError> {
        let ior = match (desc.metal, desc.eta, desc.k) {
            (None, None, None) => None,
            (Some(metal), None, None) => {
                let [eta, k] = metal.ior().map(Rgb::from);
                Some(ComplexIor { eta, k })
            }
            (None, Some(eta), Some(k)) => {
                Some(ComplexIor { eta: self.index("eta", eta)?, k: self.index("k", k)? })
            }
            _ => {
                return Err(self
                    .at
                    .fail("an index of refraction is `metal`, or `eta` and `k`: give one or both"));
            }
        };
        let reflectance = self.texture(["reflectance"; 2], 1.0, &desc.reflectance)?;
        let alpha = self.roughness(desc.alpha, desc.exponent)?;
        let specular = match reflectance {
            None => Specular::None,
            Some(reflectance) => Specular::Conductor { reflectance, ior, alpha },
        };
        Ok(Material { specular, ..black(name) })
    }

    /// A part of an index of refraction, by channel.
    fn index(&self, key: &str, value: RgbDesc) -> Result<Rgb, SceneError> {
        /// Far beyond all metals.
        const GREATEST: f64 = 1e12;
        match value.to_array().into_iter().find(|x| !(0.0..=GREATEST).contains(x)) {
            None => self.at.rgb(key, value),
            Some(x) => {
                let message = format!("{x:e}: an index of refraction is from 0 to {GREATEST:e}");
                Err(self.at.key(key).fail(message))
            }
        }
    }

    /// Plastic.
    pub(super) fn plastic(&self, name: String, desc: &PlasticDesc) -> Result<Material, SceneError> {
        let eta = self.at.positive("eta", desc.eta)?;
        if !(1.0..=100.0).contains(&eta) {
            let message = format!("{eta}: the index of a coat must be from 1 (air) to 100");
            return Err(self.at.key("eta").fail(message));
        }
        let (kd, cd) = desc.base();
        let base = self.texture(["kd", "cd"], kd, &cd)?;
        let base = base.unwrap_or(Texture::Constant(Rgb::BLACK));
        if base.brightest().max_channel() > 1.0 {
            let given = if desc.kd.is_some() { "kd" } else { "cd" };
            let message = "kd cd is above 1: no base reflects more light than arrives";
            return Err(self.at.key(given).fail(message));
        }
        let alpha = self.roughness(desc.alpha, desc.exponent)?;
        Ok(Material {
            specular: Specular::Plastic { base, coat: Coat::new(eta as f32, alpha) },
            ..black(name)
        })
    }

    /// Glass.
    pub(super) fn dielectric(&self, name: String, desc: &DielectricDesc) -> Result<Material, SceneError> {
        let eta = self.at.positive("eta", desc.eta)? as f32;
        let colour = |key, colour| {
            let texture = self.texture([key; 2], 1.0, colour)?;
            Ok::<_, SceneError>(texture.unwrap_or(Texture::Constant(Rgb::BLACK)))
        };
        let reflectance = colour("reflectance", &desc.reflectance)?;
        let transmittance = colour("transmittance", &desc.transmittance)?;
        Ok(Material { specular: Specular::Dielectric { reflectance, transmittance, eta }, ..black(name) })
    }

    /// The roughness of microfacets, given as such or by the cosine power whose lobe is about as wide.
    ///
    /// About the mirror direction the lobe's angle is twice that of the half vector: `exp(-e a^2 / 2)` and
    /// `exp(-(a / 2)^2 / alpha^2)` agree for `e = 1 / (2 alpha^2)`.
    fn roughness(&self, alpha: Option<f64>, exponent: Option<ExponentDesc>) -> Result<f32, SceneError> {
        match (alpha, exponent) {
            (None, None) => Ok(ALPHA),
            (Some(alpha), None) => match self.at.non_negative("alpha", alpha)? {
                alpha if alpha <= 1.0 => Ok(alpha as f32),
                alpha => Err(self.at.key("alpha").fail(format!("{alpha}: the roughest is 1"))),
            },
            (None, Some(exponent)) => {
                let exponent = self.exponent(exponent)?;
                Ok((2.0 * exponent).sqrt().recip().min(1.0) as f32)
            }
            (Some(_), Some(_)) => Err(self.at.key("alpha").fail("goes without `exponent`: give one of them")),
        }
    }

    /// An exponent, perhaps infinite.
    pub(super) fn exponent(&self, ExponentDesc(exponent): ExponentDesc) -> Result<f64, SceneError> {
        match exponent >= 0.0 {
            true => Ok(exponent),
            false => {
                let message = format!("{exponent} is no exponent: it must be at least 0, or inf");
                Err(self.at.key("exponent").fail(message))
            }
        }
    }
}

/// A material that reflects and emits nothing.
pub(super) fn black(name: String) -> Material {
    Material {
        name,
        ambient: None,
        diffuse: None,
        specular: Specular::None,
        emission: None,
        emits_both_sides: false,
    }
}

/// A checker in the unit world.
fn checker(desc: &CheckerDesc, factor: f32, at: &At<'_>, world: &World) -> Result<Texture, SceneError> {
    let size = at.positive("size", desc.size)?;
    let origin = at.vector("origin", desc.origin)?;
    let colours = at.key("checker");
    let [even, odd] = [colours.rgb("0", desc.checker[0])?, colours.rgb("1", desc.checker[1])?];
    // The pattern repeats every two cubes: an origin near the world's keeps the digits of the coordinates.
    let period = 2.0 * size;
    let near = origin + period * ((world.center - origin) / period).round();
    let shifted = near - DVec3::splat(size / 4096.0);
    let frequency = (size * world.scale).recip() as f32;
    if !frequency.is_finite() || frequency == 0.0 {
        return Err(at.key("size").fail(format!("{size} is too far from the size of the scene")));
    }
    Ok(Texture::Checker { even: even * factor, odd: odd * factor, frequency, origin: world.to_unit(shifted) })
}
