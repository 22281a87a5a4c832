//! Shapes of the file as parts in the scene's coordinates.

use super::cache::MeshKey;
use super::files::MeshFiles;
use super::material::MaterialTable;
use super::part::{Body, Part};
use super::source::{At, Source};
use super::transform;
use super::{Notes, SceneError};
use crate::geometry::{MeshSource, generate, tessellate};
use crate::scene::desc::shape::{
    BoxDesc, CylinderDesc, GeneratedDesc, ObjDesc, PlaneDesc, PlyDesc, RectDesc, SphereDesc,
};
use crate::scene::desc::{SceneDesc, ShapeDesc};
use glam::DVec3;
use std::sync::Arc;

/// The parts of all shapes.
pub(super) fn parts(
    desc: &SceneDesc,
    source: &Source,
    materials: &mut MaterialTable<'_>,
    notes: &mut Notes<'_>,
) -> Result<Vec<Part>, SceneError> {
    let mut files = MeshFiles::read(desc, notes);
    let mut parts = Vec::with_capacity(desc.shapes.len());
    for (i, shape) in desc.shapes.iter().enumerate() {
        let path = format!("shapes.{i}");
        let at = source.at(&path);
        let placed = shape.placed();
        let transform = transform::compose(&placed.transform, &at.key("transform"))?;
        let name = placed.name.unwrap_or_else(|| format!("{} {i}", kind(shape)));
        let material = match (&placed.material, shape) {
            (None, ShapeDesc::Obj(_)) => None,
            (material, _) => Some(materials.index_of(material.as_deref(), &at)?),
        };
        let part = |name, material, body| Part { name, material, path: path.clone(), transform, body };
        if let ShapeDesc::Obj(desc) = shape {
            let models = read_obj(desc, &at, material, materials, &mut files, notes)?;
            let one = models.len() == 1;
            for (model, material, mesh) in models {
                let name = if one || model.is_empty() { name.clone() } else { format!("{name}/{model}") };
                parts.push(part(name, material, Body::Mesh(mesh)));
            }
        } else {
            let material = material.unwrap_or_else(|| materials.grey());
            parts.push(part(name, material, body(shape, &at, &mut files, notes)?));
        }
    }
    Ok(parts)
}

/// What names of shapes begin with.
fn kind(shape: &ShapeDesc) -> &'static str {
    match shape {
        ShapeDesc::Obj(_) => "obj",
        ShapeDesc::Ply(_) => "ply",
        ShapeDesc::Sphere(_) => "sphere",
        ShapeDesc::Box(_) => "box",
        ShapeDesc::Cylinder(_) => "cylinder",
        ShapeDesc::Rect(_) => "rect",
        ShapeDesc::Disk(_) => "disk",
        ShapeDesc::Plane(_) => "plane",
        ShapeDesc::Generated(_) => "generated",
    }
}

/// The parts of an OBJ file: name, material and mesh. With a material of the scene file's, it is that of all.
fn read_obj(
    desc: &ObjDesc,
    at: &At<'_>,
    material: Option<u32>,
    materials: &mut MaterialTable<'_>,
    files: &mut MeshFiles,
    notes: &mut Notes<'_>,
) -> Result<Vec<(String, u32, Arc<MeshSource>)>, SceneError> {
    let path = notes.path_of(&desc.file);
    let object = notes.cache.obj(&path, || files.obj(&path).map_err(|e| at.key("file").fail(e)))?;
    let file = &object.file;
    notes.files.extend(file.files.iter().cloned());
    notes.warnings.extend(file.warnings.iter().map(|w| format!("{}: {w}", path.display())));
    if file.parts.is_empty() {
        notes.warnings.push(at.warn(format!("{} has no triangles", path.display())));
    }
    let of_mtl: Vec<u32> = match material {
        Some(_) => vec![],
        None => file.materials.iter().map(|m| materials.add_mtl(m.clone())).collect(),
    };
    let mut models = Vec::with_capacity(file.parts.len());
    for (part, mesh) in file.parts.iter().zip(&object.meshes) {
        let of_part = part.material.and_then(|i| of_mtl.get(i).copied());
        let material = material.or(of_part).unwrap_or_else(|| materials.grey());
        models.push((part.name.clone(), material, Arc::clone(mesh)));
    }
    Ok(models)
}

/// The body of any shape but an OBJ file.
fn body(
    shape: &ShapeDesc,
    at: &At<'_>,
    files: &mut MeshFiles,
    notes: &mut Notes<'_>,
) -> Result<Body, SceneError> {
    match shape {
        ShapeDesc::Obj(_) => unreachable!("an OBJ file has parts of its own"),
        ShapeDesc::Ply(desc) => read_ply(desc, at, files, notes),
        ShapeDesc::Sphere(desc) => spheres(desc, at),
        ShapeDesc::Box(desc) => box_(desc, at),
        ShapeDesc::Cylinder(desc) => cylinder(desc, at),
        ShapeDesc::Rect(RectDesc { corner, u, v, .. }) => rectangle([*corner, *u, *v], at),
        ShapeDesc::Disk(d) => disk(d.center, d.normal, d.radius, d.segments, at),
        ShapeDesc::Plane(desc) => plane(desc, at),
        ShapeDesc::Generated(desc) => generated(desc, at, notes),
    }
}

fn read_ply(
    desc: &PlyDesc,
    at: &At<'_>,
    files: &mut MeshFiles,
    notes: &mut Notes<'_>,
) -> Result<Body, SceneError> {
    let path = notes.path_of(&desc.file);
    let mesh = notes.cache.ply(&path, || files.ply(&path).map_err(|e| at.key("file").fail(e)))?;
    notes.files.push(path);
    Ok(Body::Mesh(mesh))
}

fn spheres(desc: &SphereDesc, at: &At<'_>) -> Result<Body, SceneError> {
    if desc.spheres.is_empty() {
        let (center, radius) = (desc.center.unwrap_or_default(), desc.radius.unwrap_or(1.0));
        return Ok(Body::Spheres(vec![sphere(center, radius, at)?]));
    }
    for (key, given) in [("center", desc.center.is_some()), ("radius", desc.radius.is_some())] {
        if given {
            return Err(at
                .key(key)
                .fail("goes without `spheres`, each of which has its own: give one of them"));
        }
    }
    let list = at.key("spheres");
    let spheres = desc.spheres.iter().enumerate().map(|(i, &[x, y, z, radius])| {
        let at = list.key(i);
        for (axis, value) in [("0", x), ("1", y), ("2", z)] {
            at.finite(axis, value)?;
        }
        Ok((DVec3::new(x, y, z), at.positive("3", radius)?))
    });
    Ok(Body::Spheres(spheres.collect::<Result<_, SceneError>>()?))
}

/// One sphere's centre and radius.
pub(super) fn sphere(center: [f64; 3], radius: f64, at: &At<'_>) -> Result<(DVec3, f64), SceneError> {
    Ok((at.vector("center", center)?, at.positive("radius", radius)?))
}

fn box_(desc: &BoxDesc, at: &At<'_>) -> Result<Body, SceneError> {
    let (min, max) = (at.vector("min", desc.min)?, at.vector("max", desc.max)?);
    if (max - min).cmpeq(DVec3::ZERO).any() {
        let message = "the same coordinate as `min`: a box without thickness is a `rect`";
        return Err(at.key("max").fail(message));
    }
    Ok(Body::Mesh(Arc::new(tessellate::box_(min, max))))
}

fn cylinder(desc: &CylinderDesc, at: &At<'_>) -> Result<Body, SceneError> {
    let (base, top) = (at.vector("base", desc.base)?, at.vector("top", desc.top)?);
    if base == top {
        return Err(at.key("top").fail("the same point as `base`: a cylinder without height is a `disk`"));
    }
    let (radius, segments) = (at.positive("radius", desc.radius)?, checked_segments(desc.segments, at)?);
    Ok(Body::Mesh(Arc::new(tessellate::cylinder(base, top - base, radius, desc.caps, segments))))
}

/// A parallelogram from a corner and two edges.
pub(super) fn rectangle([corner, u, v]: [[f64; 3]; 3], at: &At<'_>) -> Result<Body, SceneError> {
    let corner = at.vector("corner", corner)?;
    let (u, v) = (at.vector("u", u)?, at.vector("v", v)?);
    if at.direction("u", u.into())?.cross(at.direction("v", v.into())?).length() < 1e-12 {
        return Err(at.key("v").fail("parallel to `u`: the rectangle has no area"));
    }
    Ok(Body::Mesh(Arc::new(tessellate::rectangle(corner, u, v))))
}

/// A disk.
pub(super) fn disk(
    center: [f64; 3],
    normal: [f64; 3],
    radius: f64,
    segments: u32,
    at: &At<'_>,
) -> Result<Body, SceneError> {
    let (center, normal) = (at.vector("center", center)?, at.direction("normal", normal)?);
    let (radius, segments) = (at.positive("radius", radius)?, checked_segments(segments, at)?);
    Ok(Body::Mesh(Arc::new(tessellate::disk(center, normal, radius, segments))))
}

fn plane(desc: &PlaneDesc, at: &At<'_>) -> Result<Body, SceneError> {
    let (point, normal) = (at.vector("point", desc.point)?, at.direction("normal", desc.normal)?);
    match desc.size {
        None => Ok(Body::EndlessPlane { point, normal }),
        Some(size) => {
            Ok(Body::Mesh(Arc::new(tessellate::plane(point, normal, 0.5 * at.positive("size", size)?))))
        }
    }
}

fn generated(desc: &GeneratedDesc, at: &At<'_>, notes: &mut Notes<'_>) -> Result<Body, SceneError> {
    /// About what fits into memory.
    const MOST: u32 = 200_000_000;
    if !(1..=MOST).contains(&desc.triangles) {
        let message = format!("{} triangles: it must be from 1 to {MOST}", desc.triangles);
        return Err(at.key("triangles").fail(message));
    }
    let key = MeshKey::Generated(format!("{:?} {} {}", desc.kind, desc.triangles, desc.seed));
    let make = || Ok(generate::generate(desc.kind.into(), desc.triangles as usize, desc.seed));
    Ok(Body::Mesh(notes.cache.mesh(key, make)?))
}

fn checked_segments(segments: u32, at: &At<'_>) -> Result<u32, SceneError> {
    match segments {
        3..=1_000_000 => Ok(segments),
        _ => Err(at.key("segments").fail(format!("{segments} segments: it must be from 3 to 1000000"))),
    }
}
