//! A ray, what it must not hit, and what it hit.

use glam::Vec3;

/// What a ray must not hit: the rule against hitting the surface that it leaves.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Skip {
    /// Everything may be hit.
    #[default]
    None,
    /// One primitive: right for every mesh of flat triangles.
    Primitive {
        /// Geometry of the primitive.
        geom: u32,
        /// The primitive within it.
        prim: u32,
    },
    /// A whole geometry: the lecture's rule, which loses the self-reflection of concave objects.
    Geometry(u32),
}

impl Skip {
    /// Whether a hit on this primitive is to be ignored.
    #[inline]
    pub fn rejects(self, geom_id: u32, prim_id: u32) -> bool {
        match self {
            Self::None => false,
            Self::Primitive { geom, prim } => geom == geom_id && prim == prim_id,
            Self::Geometry(geom) => geom == geom_id,
        }
    }
}

/// The half-line `origin + t * dir` for `t_min <= t <= t_max`.
///
/// `dir` need not have unit length; `t` counts in multiples of it. A ray with `t_min > t_max`, with a NaN
/// component, an infinite origin or direction, or a zero direction is inactive: it hits nothing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Where the ray starts.
    pub origin: Vec3,
    /// First parameter that counts as a hit, at least 0.
    pub t_min: f32,
    /// Where the ray goes.
    pub dir: Vec3,
    /// Last parameter that counts as a hit; may be infinite.
    pub t_max: f32,
    /// What the ray must not hit.
    pub skip: Skip,
}

impl Ray {
    /// An unbounded ray that may hit everything.
    pub fn new(origin: Vec3, dir: Vec3) -> Self {
        Self { origin, t_min: 0.0, dir, t_max: f32::INFINITY, skip: Skip::None }
    }

    /// A ray that hits nothing.
    pub fn inactive() -> Self {
        Self { t_min: 1.0, t_max: -1.0, ..Self::new(Vec3::ZERO, Vec3::Z) }
    }

    /// The point at parameter `t`.
    #[inline]
    pub fn at(&self, t: f32) -> Vec3 {
        self.origin + t * self.dir
    }

    /// Whether a backend may be asked about this ray: see the type's description for what makes one inactive.
    #[inline]
    pub fn is_active(&self) -> bool {
        self.t_min <= self.t_max && self.origin.is_finite() && self.dir.is_finite() && self.dir != Vec3::ZERO
    }
}

/// The first primitive along a ray.
///
/// For triangles `(u, v)` are barycentric: the point is `(1-u-v) p0 + u p1 + v p2`. For spheres they are zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Ray parameter of the hit.
    pub t: f32,
    /// First barycentric coordinate.
    pub u: f32,
    /// Second barycentric coordinate.
    pub v: f32,
    /// Index of the geometry in the slice that the accelerator was built from.
    pub geom_id: u32,
    /// Index of the primitive in its geometry.
    pub prim_id: u32,
}
