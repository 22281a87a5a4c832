//! Materials: what makes a [`Bsdf`] of a point.

use crate::bxdf::{
    Bsdf, Bxdf, Coat, ComplexIor, Conductor, Dielectric, DielectricWay, Diffuse, Horizon, Mirror, Plastic,
};
use crate::core::Rgb;
use glam::Vec3;

/// A colour that may vary over space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Texture {
    /// The same everywhere.
    Constant(Rgb),
    /// Cubes of two colours, with edges of length `1 / frequency` in the unit world.
    Checker {
        /// Colour of the cube at the origin.
        even: Rgb,
        /// Colour of its neighbours.
        odd: Rgb,
        /// Cubes per unit length.
        frequency: f32,
        /// A corner of the cube at the origin.
        origin: Vec3,
    },
}

impl Texture {
    /// The largest value of each channel.
    pub fn brightest(&self) -> Rgb {
        match *self {
            Self::Constant(colour) => colour,
            Self::Checker { even, odd, .. } => {
                Rgb::new(even.r.max(odd.r), even.g.max(odd.g), even.b.max(odd.b))
            }
        }
    }

    /// The colour at a point of the unit world.
    #[inline]
    pub fn at(&self, p: Vec3) -> Rgb {
        match *self {
            Self::Constant(colour) => colour,
            Self::Checker { even, odd, frequency, origin } => {
                let cell = ((p - origin) * frequency).floor();
                if (cell.x as i64 + cell.y as i64 + cell.z as i64) & 1 == 0 { even } else { odd }
            }
        }
    }
}

/// What a material does beside its diffuse part.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Specular {
    /// Nothing.
    None,
    /// A mirror with reflectance `kr cr`.
    Mirror(Texture),
    /// The glossy lobe.
    CosinePower {
        /// `kr cr`.
        reflectance: Texture,
        /// Finite exponent.
        exponent: f32,
        /// Below the surface.
        horizon: Horizon,
    },
    /// A metal.
    Conductor {
        /// Colour that multiplies the reflection.
        reflectance: Texture,
        /// Index of refraction; without one, everything is reflected at every angle.
        ior: Option<ComplexIor>,
        /// Roughness.
        alpha: f32,
    },
    /// A rough clear coat over a diffuse base; takes the place of the diffuse part.
    Plastic {
        /// Reflectance of the base.
        base: Texture,
        /// What lies over it.
        coat: Coat,
    },
    /// Glass.
    Dielectric {
        /// Colour that multiplies the reflection.
        reflectance: Texture,
        /// Colour that multiplies the transmission.
        transmittance: Texture,
        /// Index of the inner side over that of the outer side.
        eta: f32,
    },
}

/// A material: lobes and light of its own.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// Name in the scene file.
    pub name: String,
    /// `ka ca`: what it shows of the scene's ambient radiance.
    pub ambient: Option<Texture>,
    /// `kd cd`.
    pub diffuse: Option<Texture>,
    /// About the mirror direction.
    pub specular: Specular,
    /// Radiance that it emits from its front.
    pub emission: Option<Rgb>,
    /// Whether the back emits as well.
    pub emits_both_sides: bool,
}

impl Material {
    /// Whether it has any lobe.
    #[inline]
    pub fn reflects(&self) -> bool {
        self.diffuse.is_some() || self.specular != Specular::None
    }

    /// The lobes at every point, if they are the same everywhere.
    pub fn uniform_bsdf(&self) -> Option<Bsdf> {
        let specular = match &self.specular {
            Specular::None => [None; 2],
            Specular::Mirror(texture)
            | Specular::CosinePower { reflectance: texture, .. }
            | Specular::Conductor { reflectance: texture, .. }
            | Specular::Plastic { base: texture, .. } => [Some(texture), None],
            Specular::Dielectric { reflectance, transmittance, .. } => {
                [Some(reflectance), Some(transmittance)]
            }
        };
        let mut textures = self.diffuse.iter().chain(specular.into_iter().flatten());
        textures.all(|texture| matches!(texture, Texture::Constant(_))).then(|| self.bsdf(Vec3::ZERO))
    }

    /// The lobes at a point of the unit world.
    pub fn bsdf(&self, p: Vec3) -> Bsdf {
        let mut bsdf = Bsdf::BLACK;
        if let Some(diffuse) = &self.diffuse {
            bsdf.add(Bxdf::Diffuse(Diffuse { reflectance: diffuse.at(p) }));
        }
        match &self.specular {
            Specular::None => {}
            Specular::Mirror(t) => bsdf.add(Bxdf::Mirror(Mirror { reflectance: t.at(p) })),
            Specular::CosinePower { reflectance, exponent, horizon } => {
                bsdf.add(Bxdf::cosine_power(reflectance.at(p), *exponent, *horizon));
            }
            Specular::Conductor { reflectance, ior, alpha } => {
                let reflectance = reflectance.at(p);
                bsdf.add(Bxdf::Conductor(Conductor { reflectance, ior: *ior, alpha: *alpha }));
            }
            Specular::Plastic { base, coat } => {
                bsdf.add(Bxdf::Plastic(Plastic::new(base.at(p), *coat)));
            }
            Specular::Dielectric { reflectance, transmittance, eta } => {
                let ways =
                    [(DielectricWay::Transmission, transmittance), (DielectricWay::Reflection, reflectance)];
                for (way, colour) in ways {
                    bsdf.add(Bxdf::Dielectric(Dielectric { way, colour: colour.at(p), eta: *eta }));
                }
            }
        }
        bsdf
    }
}
