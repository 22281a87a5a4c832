//! Lights of the file, and the lights that emitting shapes are.

use super::material::MaterialTable;
use super::part::{Body, Part};
use super::source::{At, Source};
use super::{Notes, SceneError, shape};
use crate::core::Rgb;
use crate::geometry::{Shape, TriangleMesh};
use crate::image_io::read::{LinearImage, read_linear};
use crate::scene::desc::light::{
    DirectionalDesc, EnvironmentDesc, FalloffDesc, GradientDesc, ImageDesc, PointDesc, StudioDesc,
};
use crate::scene::desc::{LightDesc, RgbDesc, SceneDesc};
use crate::scene::light::environment::{Gradient, Softbox};
use crate::scene::{Environment, Geometry, Light, Lights, Material, World};
use glam::{DAffine3, DQuat, Vec3};
use std::sync::Arc;

/// The brightest radiance of the studio that has no softboxes of its own, or a little more.
const BRIGHTEST_SHOT: f64 = 5.5;

/// Triangles of a disk that stands for a lamp.
const LAMP_SEGMENTS: u32 = 128;

/// The shapes of lamps that are described as lights.
pub(super) fn lamp_parts(
    desc: &SceneDesc,
    source: &Source,
    materials: &mut MaterialTable<'_>,
) -> Result<Vec<Part>, SceneError> {
    let mut parts = vec![];
    for (i, light) in desc.lights.iter().enumerate() {
        let path = format!("lights.{i}");
        let at = source.at(&path);
        let (name, radiance, both_sides, body) = match light {
            LightDesc::Point(_) | LightDesc::Directional(_) => continue,
            LightDesc::Rect(d) => {
                (&d.name, d.radiance, d.both_sides, shape::rectangle([d.corner, d.u, d.v], &at)?)
            }
            LightDesc::Disk(d) => {
                let body = shape::disk(d.center, d.normal, d.radius, LAMP_SEGMENTS, &at)?;
                (&d.name, d.radiance, d.both_sides, body)
            }
            LightDesc::Sphere(d) => {
                let body = Body::Spheres(vec![shape::sphere(d.center, d.radius, &at)?]);
                (&d.name, d.radiance, false, body)
            }
        };
        let name = name.clone().unwrap_or_else(|| format!("light {i}"));
        let material = materials.add_lamp(name.clone(), radiance, both_sides, path.clone());
        parts.push(Part { name, material, path, transform: DAffine3::IDENTITY, body });
    }
    Ok(parts)
}

/// All lights; emitting geometries learn which is theirs.
pub(super) fn build(
    desc: &SceneDesc,
    source: &Source,
    world: &World,
    (shapes, geometries): (&[Shape], &mut [Geometry]),
    materials: &[Material],
    notes: &mut Notes<'_>,
) -> Result<Lights, SceneError> {
    let mut lights = vec![];
    for (i, light) in desc.lights.iter().enumerate() {
        let at = source.at(&format!("lights.{i}"));
        match light {
            LightDesc::Point(desc) => lights.push(point(desc, &at, world)?),
            LightDesc::Directional(desc) => lights.push(directional(desc, &at)?),
            LightDesc::Rect(_) | LightDesc::Disk(_) | LightDesc::Sphere(_) => {}
        }
    }
    for (shape, geometry) in shapes.iter().zip(geometries) {
        let material = &materials[geometry.material as usize];
        if let Some(radiance) = material.emission {
            geometry.light = Some(lights.len() as u32);
            lights.push(emitter(shape, radiance, material.emits_both_sides));
        }
    }
    let environment = match &desc.environment {
        Some(desc) => Some(environment(desc, &source.at("environment"), notes)?),
        None => None,
    };
    Ok(Lights::new(lights, environment))
}

fn point(desc: &PointDesc, at: &At<'_>, world: &World) -> Result<Light, SceneError> {
    let position = world.to_unit(at.vector("position", desc.position)?);
    let falloff = desc.falloff == FalloffDesc::InverseSquare;
    // Intensity over the square of the distance is to stay what it is.
    let factor = if falloff { world.scale * world.scale } else { 1.0 };
    let intensity = at.key("intensity").scaled(desc.intensity, factor)?;
    if !position.is_finite() {
        return Err(at.key("position").fail("too far away for the size of the scene"));
    }
    Ok(Light::point(position, intensity, falloff, desc.shadows))
}

fn directional(desc: &DirectionalDesc, at: &At<'_>) -> Result<Light, SceneError> {
    let direction = at.direction("direction", desc.direction)?.as_vec3();
    Ok(Light::directional(direction, at.rgb("irradiance", desc.irradiance)?, desc.shadows))
}

/// The light that an emitting shape is; spheres have been parted into one shape each.
fn emitter(shape: &Shape, radiance: Rgb, both_sides: bool) -> Light {
    match shape {
        Shape::Spheres(spheres) => Light::sphere(spheres[0], radiance, both_sides),
        Shape::Mesh(mesh) => match parallelogram(mesh) {
            Some([corner, u, v]) => Light::rectangle(corner, u, v, radiance, both_sides),
            None => Light::mesh(Arc::clone(mesh), radiance, both_sides),
        },
    }
}

/// Corner and edges of a mesh that is one parallelogram, as `rect` makes it; the front is where `u x v` points.
fn parallelogram(mesh: &TriangleMesh) -> Option<[Vec3; 3]> {
    let (&[a, b, c, d], &[first, second]) = (mesh.positions(), mesh.indices()) else { return None };
    let off = (a + c - b - d).length();
    let (u, v) = (b - a, d - a);
    let size = u.length().max(v.length()) + a.abs().max_element();
    let parallel = off <= 4.0 * f32::EPSILON * size;
    match (first, second) {
        ([0, 1, 2], [0, 2, 3]) if parallel => Some([a, u, v]),
        // Mirrored by its transform.
        ([0, 2, 1], [0, 3, 2]) if parallel => Some([a, v, u]),
        _ => None,
    }
}

fn environment(
    desc: &EnvironmentDesc,
    at: &At<'_>,
    notes: &mut Notes<'_>,
) -> Result<Environment, SceneError> {
    match desc {
        EnvironmentDesc::Constant(desc) => Ok(Environment::constant(at.rgb("radiance", desc.radiance)?)),
        EnvironmentDesc::Gradient(desc) => gradient(desc, at),
        EnvironmentDesc::Studio(desc) => studio(desc, at),
        EnvironmentDesc::Image(desc) => image(desc, at, notes),
    }
}

fn gradient(desc: &GradientDesc, at: &At<'_>) -> Result<Environment, SceneError> {
    let (nadir, nadir_key) = desc.nadir.map_or((desc.horizon, "horizon"), |nadir| (nadir, "nadir"));
    Ok(Environment::gradient(
        at.direction("up", desc.up)?.as_vec3(),
        at.rgb("zenith", desc.zenith)?,
        at.rgb("horizon", desc.horizon)?,
        at.rgb(nadir_key, nadir)?,
    ))
}

fn studio(desc: &StudioDesc, at: &At<'_>) -> Result<Environment, SceneError> {
    let given = desc.softboxes.iter().flatten().map(|softbox| softbox.radiance);
    let given = given.chain([desc.background, desc.zenith, desc.nadir].into_iter().flatten());
    let brightest = match desc.softboxes {
        Some(_) => given.flat_map(RgbDesc::to_array).fold(0.0, f64::max),
        None => BRIGHTEST_SHOT,
    };
    let scale = at.scale("scale", desc.scale, brightest)?;
    let rotate_deg = at.finite("rotate_deg", desc.rotate_deg)?;
    let Some(softboxes) = &desc.softboxes else {
        let backgrounds = [("background", desc.background), ("zenith", desc.zenith), ("nadir", desc.nadir)];
        if let Some((key, _)) = backgrounds.iter().find(|(_, given)| given.is_some()) {
            let message = "goes with `softboxes`: without them the studio has a background of its own";
            return Err(at.key(key).fail(message));
        }
        return Ok(Environment::product_shot(scale, rotate_deg as f32));
    };
    let turn = DQuat::from_rotation_y(rotate_deg.to_radians());
    let lamp = |(i, softbox): (usize, &crate::scene::desc::SoftboxDesc)| {
        let at = at.key("softboxes").key(i);
        let half_tangent = |key, degrees| match at.positive(key, degrees)? {
            degrees if degrees < 180.0 => Ok((0.5 * degrees.to_radians()).tan() as f32),
            degrees => Err(at.key(key).fail(format!("{degrees} degrees: it must be below 180"))),
        };
        let softness = at.non_negative("softness", softbox.softness)?;
        if softness > 1.0 {
            return Err(at.key("softness").fail(format!("{softness}: it must be from 0 to 1")));
        }
        Ok(Softbox {
            toward: (turn * at.direction("direction", softbox.direction)?).as_vec3(),
            half_size: [
                half_tangent("width_deg", softbox.width_deg)?,
                half_tangent("height_deg", softbox.height_deg)?,
            ],
            radiance: at.rgb("radiance", softbox.radiance)? * scale,
            softness: softness as f32,
        })
    };
    let lamps = softboxes.iter().enumerate().map(lamp).collect::<Result<_, _>>()?;
    let horizon = at.rgb("background", desc.background.unwrap_or(RgbDesc::Grey(0.0)))? * scale;
    let pole = |key, given: Option<RgbDesc>| match given {
        Some(radiance) => Ok::<_, SceneError>(at.rgb(key, radiance)? * scale),
        None => Ok(horizon),
    };
    let (zenith, nadir) = (pole("zenith", desc.zenith)?, pole("nadir", desc.nadir)?);
    let background = Gradient { up: Vec3::Y, zenith, horizon, nadir };
    Ok(Environment::studio(background, lamps))
}

fn image(desc: &ImageDesc, at: &At<'_>, notes: &mut Notes<'_>) -> Result<Environment, SceneError> {
    let rotate_deg = at.finite("rotate_deg", desc.rotate_deg)? as f32;
    let path = notes.path_of(&desc.file);
    let LinearImage { width, height, pixels } = read_linear(&path).map_err(|e| at.key("file").fail(e))?;
    let finite = pixels.iter().map(|p| p.max_channel()).filter(|x| x.is_finite());
    let scale = at.scale("scale", desc.scale, finite.fold(0.0, f32::max).into())?;
    let environment = Environment::image(width, height, pixels, rotate_deg, scale)
        .map_err(|e| at.key("file").fail(format!("{}: {e}", path.display())))?;
    notes.files.push(path);
    Ok(environment)
}
