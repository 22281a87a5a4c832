//! What can be hit, each with its place and its material.

use crate::geometry::generate::Generator;
use schemars::JsonSchema;
use serde::Deserialize;
use std::path::PathBuf;

/// A shape.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[schemars(tag = "type")]
pub enum ShapeDesc {
    /// A Wavefront OBJ file.
    Obj(ObjDesc),
    /// A PLY file.
    Ply(PlyDesc),
    /// One analytic sphere, or many.
    Sphere(SphereDesc),
    /// An axis-aligned box.
    Box(BoxDesc),
    /// A cylinder.
    Cylinder(CylinderDesc),
    /// A parallelogram.
    Rect(RectDesc),
    /// A disk.
    Disk(DiskDesc),
    /// A plane that reaches as far as matters.
    Plane(PlaneDesc),
    /// A mesh from a formula.
    Generated(GeneratedDesc),
}

/// One step of a transform; exactly one of the keys is given.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields, expecting = "a table such as { translate = [x, y, z] }")]
pub struct TransformDesc {
    /// Moves.
    pub translate: Option<[f64; 3]>,
    /// Turns about an axis through the origin.
    pub rotate: Option<RotateDesc>,
    /// Scales about the origin: one factor, or one per axis.
    pub scale: Option<ScaleDesc>,
    /// Any affine map: 16 numbers, row by row, the last row `0 0 0 1`.
    pub matrix: Option<[f64; 16]>,
}

/// A rotation, counter-clockwise as seen from the tip of its axis.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table { axis = [x, y, z], deg = number }")]
pub struct RotateDesc {
    /// Its axis, of any length but zero.
    pub axis: [f64; 3],
    /// Its angle in degrees.
    pub deg: f64,
}

/// A factor, or one per axis.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "a number or [x, y, z]")]
pub enum ScaleDesc {
    /// The same along each axis.
    Uniform(f64),
    /// Along x, y and z.
    PerAxis([f64; 3]),
}

/// Which mesh a formula gives.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum GeneratorDesc {
    /// A sphere: convex.
    Sphere,
    /// A square of fractal hills.
    Terrain,
    /// A tube about a torus knot: closed and concave.
    Knot,
    /// A sphere with bumps of many sizes.
    Blob,
}

impl From<GeneratorDesc> for Generator {
    fn from(kind: GeneratorDesc) -> Self {
        match kind {
            GeneratorDesc::Sphere => Self::Sphere,
            GeneratorDesc::Terrain => Self::Terrain,
            GeneratorDesc::Knot => Self::Knot,
            GeneratorDesc::Blob => Self::Blob,
        }
    }
}

/// A shape's own fields and those that every shape has.
macro_rules! placed {
    ($(
        $(#[$meta:meta])*
        pub struct $desc:ident { $($(#[$field_meta:meta])* pub $field:ident: $ty:ty,)* }
    )*) => {
        $(
            $(#[$meta])*
            #[derive(Clone, Debug, Deserialize, JsonSchema)]
            #[serde(deny_unknown_fields, expecting = "a table")]
            pub struct $desc {
                $($(#[$field_meta])* pub $field: $ty,)*
                /// What reports call it.
                pub name: Option<String>,
                /// Name of its material; a grey diffuse one if it is left out.
                pub material: Option<String>,
                /// Steps from the shape's own coordinates to the scene's, applied one after the other.
                #[serde(default)]
                pub transform: Vec<TransformDesc>,
            }

            impl From<&$desc> for Placed {
                fn from(desc: &$desc) -> Self {
                    Self {
                        name: desc.name.clone(),
                        material: desc.material.clone(),
                        transform: desc.transform.clone(),
                    }
                }
            }
        )*

        impl ShapeDesc {
            /// What every shape has.
            pub fn placed(&self) -> Placed {
                match self {
                    Self::Obj(d) => d.into(),
                    Self::Ply(d) => d.into(),
                    Self::Sphere(d) => d.into(),
                    Self::Box(d) => d.into(),
                    Self::Cylinder(d) => d.into(),
                    Self::Rect(d) => d.into(),
                    Self::Disk(d) => d.into(),
                    Self::Plane(d) => d.into(),
                    Self::Generated(d) => d.into(),
                }
            }
        }
    };
}

/// What every shape has.
#[derive(Clone, Debug, Default)]
pub struct Placed {
    /// What reports call it.
    pub name: Option<String>,
    /// Name of its material.
    pub material: Option<String>,
    /// Steps to the scene's coordinates.
    pub transform: Vec<TransformDesc>,
}

placed! {
    /// A Wavefront OBJ file; without `material` it has those of its MTL files (`Kd`, `Ks`, and `Ns` as the exponent).
    pub struct ObjDesc {
        /// The file, relative to the scene file.
        pub file: PathBuf,
    }

    /// A PLY file.
    pub struct PlyDesc {
        /// The file, relative to the scene file.
        pub file: PathBuf,
    }

    /// One analytic sphere, or many that share a material.
    pub struct SphereDesc {
        /// Centre; the origin if it is left out.
        pub center: Option<[f64; 3]>,
        /// Radius; 1 if it is left out.
        pub radius: Option<f64>,
        /// Many at once, each as `[x, y, z, radius]`, in place of `center` and `radius`.
        #[serde(default)]
        pub spheres: Vec<[f64; 4]>,
    }

    /// An axis-aligned box between two corners.
    pub struct BoxDesc {
        /// A corner.
        pub min: [f64; 3],
        /// The opposite corner.
        pub max: [f64; 3],
    }

    /// A cylinder between the middles of its two ends.
    pub struct CylinderDesc {
        /// Middle of one end.
        pub base: [f64; 3],
        /// Middle of the other end.
        pub top: [f64; 3],
        /// Radius.
        pub radius: f64,
        /// Whether the ends are closed.
        #[serde(default = "yes")]
        pub caps: bool,
        /// Flat strips around it; its normals are those of the round surface.
        #[serde(default = "segments")]
        pub segments: u32,
    }

    /// A parallelogram; its front is where `u` turns to `v` counter-clockwise.
    pub struct RectDesc {
        /// A corner.
        pub corner: [f64; 3],
        /// The edge from that corner to the next.
        pub u: [f64; 3],
        /// The edge from that corner to the one before.
        pub v: [f64; 3],
    }

    /// A disk.
    pub struct DiskDesc {
        /// Its middle.
        #[serde(default)]
        pub center: [f64; 3],
        /// Where its front faces; of any length but zero.
        #[serde(default = "up")]
        pub normal: [f64; 3],
        /// Radius.
        #[serde(default = "one")]
        pub radius: f64,
        /// Triangles that it is made of.
        #[serde(default = "segments")]
        pub segments: u32,
    }

    /// A square that stands for an endless plane.
    pub struct PlaneDesc {
        /// A point of the plane: the middle of the square.
        #[serde(default)]
        pub point: [f64; 3],
        /// Where its front faces; of any length but zero.
        #[serde(default = "up")]
        pub normal: [f64; 3],
        /// Edge of the square; 20 000 times the extent of the other shapes if it is left out, and then it does not
        /// count when the scene is scaled to the unit world.
        pub size: Option<f64>,
    }

    /// A mesh from a formula, about one unit large about the origin.
    pub struct GeneratedDesc {
        /// Which.
        pub kind: GeneratorDesc,
        /// About how many triangles.
        #[serde(default = "triangles")]
        pub triangles: u32,
        /// Which of its variants.
        #[serde(default)]
        pub seed: u64,
    }
}

fn one() -> f64 {
    1.0
}

fn up() -> [f64; 3] {
    [0.0, 1.0, 0.0]
}

fn yes() -> bool {
    true
}

fn segments() -> u32 {
    128
}

fn triangles() -> u32 {
    100_000
}
