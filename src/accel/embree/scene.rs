//! A committed scene and the shapes whose memory it reads.

use super::device::Device;
use super::ffi;
use super::query::FILTER_FLAG;
use crate::accel::{AccelError, BuildOptions, Quality};
use crate::geometry::{Shape, Sphere, TriangleMesh};
use glam::Vec3;
use std::ffi::c_void;
use std::ptr::NonNull;

/// The owner of a committed `RTCScene`. Nothing changes it after [`Scene::commit`], and its handle is not handed out.
pub(super) struct Scene {
    handle: NonNull<ffi::RTCSceneTy>,
    /// Released after the scene.
    device: Device,
    /// Embree reads the buffers of the meshes and spheres in place, and these `Arc`s keep them.
    shapes: Vec<Shape>,
}

// SAFETY: Embree's scenes may be used and released from any thread; the shapes are `Send + Sync`.
unsafe impl Send for Scene {}
// SAFETY: a committed scene is only read ("rtcIntersect and rtcOccluded may be called from many threads", the
// manual), and `&Scene` offers nothing but queries.
unsafe impl Sync for Scene {}

impl Scene {
    /// Attaches every shape that has primitives under its index and builds the hierarchy.
    ///
    /// # Errors
    /// If Embree is out of memory or refuses a shape, or if there are more shapes than ids.
    pub(super) fn commit(
        device: Device,
        shapes: &[Shape],
        options: &BuildOptions,
    ) -> Result<Self, AccelError> {
        // SAFETY: the device is alive.
        let handle = unsafe { ffi::rtcNewScene(device.as_ptr()) };
        let Some(handle) = NonNull::new(handle) else {
            device.check("creating the scene")?;
            return Err(AccelError::Embree { during: "creating the scene", message: "no scene".into() });
        };
        let scene = Self { handle, device, shapes: shapes.to_vec() };
        let quality = build_quality(options.quality);
        // SAFETY: the scene is alive and not committed yet.
        unsafe {
            ffi::rtcSetSceneFlags(scene.as_ptr(), scene_flags(options));
            ffi::rtcSetSceneBuildQuality(scene.as_ptr(), quality);
        }
        for (index, shape) in shapes.iter().enumerate().filter(|(_, shape)| shape.primitive_count() > 0) {
            let geom_id =
                u32::try_from(index).ok().filter(|&id| id != ffi::INVALID_ID).ok_or(too_many(shapes))?;
            Geometry::new(&scene.device, shape, quality)?.attach(&scene, geom_id)?;
        }
        // SAFETY: the scene is alive, and no one else has its handle yet.
        unsafe { ffi::rtcCommitScene(scene.as_ptr()) };
        scene.device.check("building the hierarchy")?;
        Ok(scene)
    }

    /// For queries: Embree's calls take the handle as mutable, and do not change a committed scene.
    pub(super) fn as_ptr(&self) -> ffi::RTCScene {
        self.handle.as_ptr()
    }

    /// By `geom_id`.
    pub(super) fn shapes(&self) -> &[Shape] {
        &self.shapes
    }

    pub(super) fn device(&self) -> &Device {
        &self.device
    }
}

impl Drop for Scene {
    fn drop(&mut self) {
        // SAFETY: this is the owner's one reference, taken when the scene was made.
        unsafe { ffi::rtcReleaseScene(self.as_ptr()) }
    }
}

fn too_many(shapes: &[Shape]) -> AccelError {
    let limit = u32::MAX as usize - 1;
    AccelError::TooMany { count: shapes.len(), what: "shapes", limit, backend: "embree" }
}

fn build_quality(quality: Quality) -> ffi::RTCBuildQuality {
    match quality {
        Quality::Fast => ffi::RTCBuildQuality::RTC_BUILD_QUALITY_LOW,
        Quality::Medium => ffi::RTCBuildQuality::RTC_BUILD_QUALITY_MEDIUM,
        Quality::High => ffi::RTCBuildQuality::RTC_BUILD_QUALITY_HIGH,
    }
}

fn scene_flags(options: &BuildOptions) -> ffi::RTCSceneFlags {
    [
        (options.robust, ffi::RTCSceneFlags::RTC_SCENE_FLAG_ROBUST),
        (options.compact, ffi::RTCSceneFlags::RTC_SCENE_FLAG_COMPACT),
        (true, FILTER_FLAG),
    ]
    .into_iter()
    .filter(|&(wanted, _)| wanted)
    .fold(ffi::RTCSceneFlags::RTC_SCENE_FLAG_NONE, |flags, (_, flag)| flags | flag)
}

/// The owner of an `RTCGeometry` that is not attached yet.
struct Geometry<'a> {
    handle: NonNull<ffi::RTCGeometryTy>,
    device: &'a Device,
}

impl<'a> Geometry<'a> {
    /// A committed geometry over the shape's own buffers.
    fn new(device: &'a Device, shape: &Shape, quality: ffi::RTCBuildQuality) -> Result<Self, AccelError> {
        let kind = match shape {
            Shape::Mesh(_) => ffi::RTCGeometryType::RTC_GEOMETRY_TYPE_TRIANGLE,
            Shape::Spheres(_) => ffi::RTCGeometryType::RTC_GEOMETRY_TYPE_SPHERE_POINT,
        };
        // SAFETY: the device is alive.
        let handle = unsafe { ffi::rtcNewGeometry(device.as_ptr(), kind) };
        let Some(handle) = NonNull::new(handle) else {
            device.check("creating a geometry")?;
            return Err(AccelError::Embree { during: "creating a geometry", message: "no geometry".into() });
        };
        let geometry = Self { handle, device };
        match shape {
            Shape::Mesh(mesh) => geometry.share_mesh(mesh)?,
            Shape::Spheres(spheres) => geometry.share_spheres(spheres)?,
        }
        // SAFETY: the geometry is alive and its buffers are set.
        unsafe {
            ffi::rtcSetGeometryBuildQuality(handle.as_ptr(), quality);
            ffi::rtcCommitGeometry(handle.as_ptr());
        }
        device.check("committing a geometry")?;
        Ok(geometry)
    }

    fn share_mesh(&self, mesh: &TriangleMesh) -> Result<(), AccelError> {
        // Embree loads 16 bytes at the last vertex, of which the padding vertex gives the last 4.
        let padded = mesh.padded_positions();
        assert!(padded.len() > mesh.positions().len(), "the mesh pads its positions");
        let positions = &padded[..mesh.positions().len()];
        // SAFETY: the buffers live as long as the scene keeps the mesh, nothing writes to them, 4-byte elements
        // are aligned, and the vertex buffer is padded as just asserted.
        unsafe {
            self.share(
                ffi::RTCBufferType::RTC_BUFFER_TYPE_VERTEX,
                ffi::RTCFormat::RTC_FORMAT_FLOAT3,
                positions,
            );
            self.share(
                ffi::RTCBufferType::RTC_BUFFER_TYPE_INDEX,
                ffi::RTCFormat::RTC_FORMAT_UINT3,
                mesh.indices(),
            );
        }
        self.device.check("sharing a mesh's buffers")
    }

    fn share_spheres(&self, spheres: &[Sphere]) -> Result<(), AccelError> {
        // SAFETY: the buffer lives as long as the scene keeps the spheres, nothing writes to it, and a sphere is
        // four floats of 16 bytes, so that a 16-byte load at the last one stays inside.
        unsafe {
            self.share(
                ffi::RTCBufferType::RTC_BUFFER_TYPE_VERTEX,
                ffi::RTCFormat::RTC_FORMAT_FLOAT4,
                spheres,
            );
        }
        self.device.check("sharing spheres")
    }

    /// # Safety
    /// Each item must be what the format says, and the items, with what Embree reads beyond the last, must live and
    /// stay as they are until the scene is released.
    unsafe fn share<T>(&self, kind: ffi::RTCBufferType, format: ffi::RTCFormat, items: &[T]) {
        // SAFETY: the geometry is alive; the rest is the caller's promise.
        unsafe {
            ffi::rtcSetSharedGeometryBuffer(
                self.handle.as_ptr(),
                kind,
                0,
                format,
                items.as_ptr().cast::<c_void>(),
                0,
                size_of::<T>(),
                items.len(),
            );
        }
    }

    /// Hands the geometry to the scene.
    fn attach(self, scene: &Scene, geom_id: u32) -> Result<(), AccelError> {
        // SAFETY: both are alive; the scene takes its own reference, and ours is released on drop.
        unsafe { ffi::rtcAttachGeometryByID(scene.as_ptr(), self.handle.as_ptr(), geom_id) };
        self.device.check("attaching a geometry")
    }
}

impl Drop for Geometry<'_> {
    fn drop(&mut self) {
        // SAFETY: this is the owner's one reference, taken when the geometry was made.
        unsafe { ffi::rtcReleaseGeometry(self.handle.as_ptr()) }
    }
}

// The formats above say what these are.
const _: () = {
    assert!(size_of::<Vec3>() == 12 && size_of::<[u32; 3]>() == 12);
    assert!(size_of::<Sphere>() == 16 && align_of::<Sphere>() == 16);
};
