//! Materials of the file, of MTL files and of lamps, by index.

use super::error::{did_you_mean, one_of};
use super::source::{At, Source};
use super::surface::{Context, black};
use super::{Notes, SceneError};
use crate::bxdf::Horizon;
use crate::core::Rgb;
use crate::geometry::obj::ObjMaterial;
use crate::scene::desc::material::MaterialDesc;
use crate::scene::desc::{RgbDesc, SceneDesc};
use crate::scene::{Material, Specular, Texture, World};

/// Beyond this exponent the lobe is narrower than the rounding of an f32 direction: a mirror.
const SHARPEST: f64 = 1e13;

/// Exponent of MTL materials that have `Ks` and no `Ns`.
const MTL_EXPONENT: f32 = 100.0;

/// Reflectance of shapes without a material.
const GREY: f32 = 0.5;

/// Where a material comes from.
enum Origin<'a> {
    Described(&'a MaterialDesc),
    Mtl(ObjMaterial),
    Lamp { radiance: RgbDesc, both_sides: bool, path: String },
    Grey,
}

/// Materials by index, before there is a unit world.
pub(super) struct MaterialTable<'a> {
    entries: Vec<(String, Origin<'a>)>,
    described: usize,
    grey: Option<u32>,
}

impl<'a> MaterialTable<'a> {
    /// The materials that the file names.
    pub(super) fn new(desc: &'a SceneDesc) -> Self {
        let entries: Vec<_> =
            desc.materials.iter().map(|(name, m)| (name.clone(), Origin::Described(m))).collect();
        Self { described: entries.len(), entries, grey: None }
    }

    /// The index of a name that the file uses; the grey one for none.
    pub(super) fn index_of(&mut self, name: Option<&str>, at: &At<'_>) -> Result<u32, SceneError> {
        let Some(name) = name else { return Ok(self.grey()) };
        let names = || self.entries[..self.described].iter().map(|(name, _)| name.as_str());
        names().position(|n| n == name).map(|i| i as u32).ok_or_else(|| {
            let hint = did_you_mean(name, names());
            at.key("material")
                .fail(format!("there is no material `{name}`{hint} (there is {})", one_of(names())))
        })
    }

    /// The material of shapes that name none.
    pub(super) fn grey(&mut self) -> u32 {
        match self.grey {
            Some(index) => index,
            None => {
                let index = self.add("(grey)".into(), Origin::Grey);
                self.grey = Some(index);
                index
            }
        }
    }

    /// A material of an MTL file.
    pub(super) fn add_mtl(&mut self, material: ObjMaterial) -> u32 {
        self.add(material.name.clone(), Origin::Mtl(material))
    }

    /// The material of a lamp; `path` is where it is described.
    pub(super) fn add_lamp(
        &mut self,
        name: String,
        radiance: RgbDesc,
        both_sides: bool,
        path: String,
    ) -> u32 {
        self.add(name, Origin::Lamp { radiance, both_sides, path })
    }

    fn add(&mut self, name: String, origin: Origin<'a>) -> u32 {
        self.entries.push((name, origin));
        (self.entries.len() - 1) as u32
    }

    /// All of them in the unit world.
    pub(super) fn build(
        self,
        source: &Source,
        world: &World,
        horizon: Horizon,
        notes: &mut Notes<'_>,
    ) -> Result<Vec<Material>, SceneError> {
        let mut materials = Vec::with_capacity(self.entries.len());
        for (name, origin) in self.entries {
            let material = match origin {
                Origin::Described(desc) => {
                    let at = source.at("materials").key(&name);
                    warn_of_forgotten_kd(&name, desc, notes);
                    described(name, desc, &Context { at: &at, world, horizon })?
                }
                Origin::Mtl(mtl) => from_mtl(mtl, horizon, notes),
                Origin::Lamp { radiance, both_sides, path } => {
                    lamp(name, source.at(&path).rgb("radiance", radiance)?, both_sides)
                }
                Origin::Grey => Material { diffuse: Some(Texture::Constant(Rgb::grey(GREY))), ..black(name) },
            };
            warn_of_excess(&material, notes);
            materials.push(material);
        }
        Ok(materials)
    }
}

/// A colour that was given and that nothing shows.
fn warn_of_forgotten_kd(name: &str, desc: &MaterialDesc, notes: &mut Notes<'_>) {
    let matte = match desc {
        MaterialDesc::CosinePower(desc) => desc.matte(),
        MaterialDesc::Mirror(desc) => desc.matte(),
        _ => return,
    };
    if matte.forgets_kd() {
        notes.warnings.push(format!(
            "the material `{name}` has a `cd` that nothing shows, since `kd` is 0 where it is left out: give `kd`, or leave `cd` out"
        ));
    }
}

fn lamp(name: String, radiance: Rgb, both_sides: bool) -> Material {
    Material {
        emission: Some(radiance).filter(|e| !e.is_black()),
        emits_both_sides: both_sides,
        ..black(name)
    }
}

fn described(name: String, desc: &MaterialDesc, context: &Context<'_>) -> Result<Material, SceneError> {
    let reflectance = |kr, cr| context.texture(["kr", "cr"], kr, cr);
    match desc {
        MaterialDesc::Diffuse(desc) => context.matte(name, &desc.matte()),
        MaterialDesc::Mirror(desc) => Ok(Material {
            specular: reflectance(desc.kr, &desc.cr)?.map_or(Specular::None, Specular::Mirror),
            ..context.matte(name, &desc.matte())?
        }),
        MaterialDesc::CosinePower(desc) => {
            let exponent = context.exponent(desc.exponent)?;
            let horizon = desc.horizon.unwrap_or(context.horizon);
            let specular = match reflectance(desc.kr, &desc.cr)? {
                None => Specular::None,
                Some(reflectance) if exponent > SHARPEST => Specular::Mirror(reflectance),
                Some(reflectance) => {
                    Specular::CosinePower { reflectance, exponent: exponent as f32, horizon }
                }
            };
            Ok(Material { specular, ..context.matte(name, &desc.matte())? })
        }
        MaterialDesc::Conductor(desc) => context.conductor(name, desc),
        MaterialDesc::Plastic(desc) => context.plastic(name, desc),
        MaterialDesc::Dielectric(desc) => context.dielectric(name, desc),
        MaterialDesc::Emissive(desc) => {
            Ok(lamp(name, context.at.rgb("radiance", desc.radiance)?, desc.both_sides))
        }
    }
}

/// A material of an MTL file: `Kd` diffuse, `Ks` and `Ns` glossy, `Ka` ambient, `Ke` emitted.
fn from_mtl(mtl: ObjMaterial, horizon: Horizon, notes: &mut Notes<'_>) -> Material {
    let texture = |rgb: Option<[f32; 3]>| rgb.map(Rgb::from).filter(|c| !c.is_black()).map(Texture::Constant);
    let specular = match texture(mtl.specular) {
        None => Specular::None,
        Some(reflectance) => {
            if mtl.exponent.is_none() {
                notes.warnings.push(format!(
                    "the MTL material `{}` has Ks and no Ns: its exponent is taken to be {MTL_EXPONENT}",
                    mtl.name
                ));
            }
            match mtl.exponent.unwrap_or(MTL_EXPONENT).max(0.0) {
                exponent if f64::from(exponent) > SHARPEST => Specular::Mirror(reflectance),
                exponent => Specular::CosinePower { reflectance, exponent, horizon },
            }
        }
    };
    Material {
        ambient: texture(mtl.ambient),
        diffuse: texture(mtl.diffuse),
        specular,
        emission: mtl.emission.map(Rgb::from).filter(|e| !e.is_black()),
        ..black(mtl.name)
    }
}

/// Says so if a material reflects more light than arrives.
fn warn_of_excess(material: &Material, notes: &mut Notes<'_>) {
    let diffuse = material.diffuse.map_or(Rgb::BLACK, |t| t.brightest());
    let specular = match material.specular {
        Specular::None => Rgb::BLACK,
        Specular::Mirror(t)
        | Specular::CosinePower { reflectance: t, .. }
        | Specular::Conductor { reflectance: t, .. }
        | Specular::Plastic { base: t, .. } => t.brightest(),
        Specular::Dielectric { reflectance, transmittance, .. } => {
            let (r, t) = (reflectance.brightest(), transmittance.brightest());
            if r.max_channel() > t.max_channel() { r } else { t }
        }
    };
    let most = (diffuse + specular).max_channel();
    if most > 1.000_001 {
        notes.warnings.push(format!(
            "the material `{}` reflects up to {most:.3} times the light that arrives: lower its factors until \
             kd cd + kr cr is at most 1",
            material.name
        ));
    }
}
