//! Embree's device: its settings, its errors, its memory.

use super::ffi;
use crate::accel::{AccelError, BuildOptions, Quality};
use std::ffi::{CStr, CString, c_char, c_void};
use std::ptr::NonNull;
use std::sync::atomic::{AtomicIsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

/// How many references spatial splits may make per triangle at high quality. Embree's own 1.2 lets them do nothing
/// where they help, on long thin triangles; the builder reserves this many times 32 bytes per triangle.
const SPATIAL_SPLIT_REPLICATIONS: f32 = 2.0;

/// The owner of an `RTCDevice`.
pub(super) struct Device {
    handle: NonNull<ffi::RTCDeviceTy>,
    /// Embree's callbacks point at it, so it lives until the handle is released.
    monitor: Arc<Monitor>,
}

// SAFETY: Embree's devices may be used from any thread ("The Embree API is thread-safe", its manual); the
// callbacks share only `Monitor`, which is `Sync`.
unsafe impl Send for Device {}
// SAFETY: as for `Send`; the error code, the one state that a query changes, is kept per thread.
unsafe impl Sync for Device {}

/// What the callbacks write.
struct Monitor {
    /// The first complaint since the last check.
    message: Mutex<Option<String>>,
    /// Allocated now.
    bytes: AtomicIsize,
    /// More than this is refused.
    limit: isize,
}

impl Device {
    /// A device for one scene.
    ///
    /// # Errors
    /// If this processor, the library's version or the settings do not suit Embree.
    pub(super) fn new(options: &BuildOptions) -> Result<Self, AccelError> {
        Self::with_memory_limit(options, isize::MAX)
    }

    /// A device that refuses to allocate more than `limit` bytes.
    fn with_memory_limit(options: &BuildOptions, limit: isize) -> Result<Self, AccelError> {
        let config = config(options);
        // SAFETY: `config` is NUL-terminated and Embree copies what it needs of it.
        let handle = unsafe { ffi::rtcNewDevice(config.as_ptr()) };
        let Some(handle) = NonNull::new(handle) else {
            // SAFETY: without a device Embree gives the error of this thread's last creation.
            let code = unsafe { ffi::rtcGetDeviceError(std::ptr::null_mut()) };
            return Err(error("creating the device", describe(code).into()));
        };
        let monitor = Arc::new(Monitor { message: Mutex::new(None), bytes: AtomicIsize::new(0), limit });
        let device = Self { handle, monitor };
        let user = Arc::as_ptr(&device.monitor).cast_mut().cast::<c_void>();
        // SAFETY: the device is alive, the callbacks have the header's signatures, and `user` outlives the device's
        // last reference: scenes own the `Device` and are released before it.
        unsafe {
            ffi::rtcSetDeviceErrorFunction(handle.as_ptr(), Some(on_error), user);
            ffi::rtcSetDeviceMemoryMonitorFunction(handle.as_ptr(), Some(on_memory), user);
        }
        device.check("setting up the device")?;
        device.check_version()?;
        Ok(device)
    }

    pub(super) fn as_ptr(&self) -> ffi::RTCDevice {
        self.handle.as_ptr()
    }

    /// Whether Embree has complained, on this thread, since the last check.
    ///
    /// # Errors
    /// If it has; with its own words.
    pub(super) fn check(&self, during: &'static str) -> Result<(), AccelError> {
        // SAFETY: the device is alive.
        let code = unsafe { ffi::rtcGetDeviceError(self.as_ptr()) };
        let message = self.monitor.message.lock().unwrap_or_else(PoisonError::into_inner).take();
        if code == ffi::RTCError::RTC_ERROR_NONE {
            return Ok(());
        }
        let name = describe(code);
        Err(error(during, message.map_or(name.into(), |text| format!("{name}: {text}"))))
    }

    /// Bytes that Embree has allocated for this device.
    pub(super) fn memory_bytes(&self) -> usize {
        usize::try_from(self.monitor.bytes.load(Ordering::Relaxed)).unwrap_or(0)
    }

    /// Version of the library that runs, such as `4.3.3`.
    pub(super) fn version(&self) -> String {
        let [major, minor, patch] = self.version_numbers();
        format!("{major}.{minor}.{patch}")
    }

    fn version_numbers(&self) -> [isize; 3] {
        use ffi::RTCDeviceProperty as Property;
        [
            Property::RTC_DEVICE_PROPERTY_VERSION_MAJOR,
            Property::RTC_DEVICE_PROPERTY_VERSION_MINOR,
            Property::RTC_DEVICE_PROPERTY_VERSION_PATCH,
        ]
        // SAFETY: the device is alive and the properties are its header's.
        .map(|property| unsafe { ffi::rtcGetDeviceProperty(self.as_ptr(), property) })
    }

    /// Minor versions changed the size of structs (4.3 grew `RTCHit` by 16 bytes) under one library name, so a
    /// library of another minor version than the header's could write past the end of ours.
    fn check_version(&self) -> Result<(), AccelError> {
        let [major, minor, _] = self.version_numbers();
        if [major, minor] == [ffi::RTC_VERSION_MAJOR as isize, ffi::RTC_VERSION_MINOR as isize] {
            return Ok(());
        }
        let built_for = ffi::RTC_VERSION_STRING.to_string_lossy();
        let message = format!(
            "the library is version {}, but gloss was built for {built_for}: build it again",
            self.version()
        );
        Err(error("comparing versions", message))
    }
}

impl Drop for Device {
    fn drop(&mut self) {
        // SAFETY: this is the owner's one reference, taken when the device was made.
        unsafe { ffi::rtcReleaseDevice(self.as_ptr()) }
    }
}

fn error(during: &'static str, message: String) -> AccelError {
    AccelError::Embree { during, message }
}

/// Embree's settings string.
fn config(options: &BuildOptions) -> CString {
    let mut settings = vec![];
    if options.threads > 0 {
        settings.push(format!("threads={}", options.threads));
    }
    if options.quality == Quality::High {
        settings.push(format!("max_spatial_split_replications={SPATIAL_SPLIT_REPLICATIONS:.1}"));
    }
    CString::new(settings.join(",")).expect("numbers and names hold no NUL")
}

/// The header's name of an error, in words.
fn describe(code: ffi::RTCError) -> &'static str {
    match code {
        ffi::RTCError::RTC_ERROR_INVALID_ARGUMENT => "invalid argument",
        ffi::RTCError::RTC_ERROR_INVALID_OPERATION => "invalid operation",
        ffi::RTCError::RTC_ERROR_OUT_OF_MEMORY => "out of memory",
        ffi::RTCError::RTC_ERROR_UNSUPPORTED_CPU => "this processor lacks instructions that Embree needs",
        ffi::RTCError::RTC_ERROR_CANCELLED => "cancelled",
        _ => "unknown error",
    }
}

/// Keeps the first message. An `extern "C"` function aborts rather than unwinds, and nothing here panics.
unsafe extern "C" fn on_error(user: *mut c_void, _: ffi::RTCError, text: *const c_char) {
    if user.is_null() || text.is_null() {
        return;
    }
    // SAFETY: `user` is the `Monitor` that the device registered and outlives; Embree's text ends with a NUL.
    let (monitor, text) = unsafe { (&*user.cast::<Monitor>(), CStr::from_ptr(text)) };
    let mut message = monitor.message.lock().unwrap_or_else(PoisonError::into_inner);
    message.get_or_insert_with(|| text.to_string_lossy().into_owned());
}

/// Counts what is allocated (`bytes > 0`) and freed; `false` makes Embree give up with an error.
unsafe extern "C" fn on_memory(user: *mut c_void, bytes: isize, _post: bool) -> bool {
    if user.is_null() {
        return true;
    }
    // SAFETY: `user` is the `Monitor` that the device registered and outlives.
    let monitor = unsafe { &*user.cast::<Monitor>() };
    let now = monitor.bytes.fetch_add(bytes, Ordering::Relaxed).wrapping_add(bytes);
    bytes <= 0 || now <= monitor.limit
}

#[cfg(test)]
mod tests {
    use super::super::scene::Scene;
    use super::*;
    use crate::geometry::{Shape, Sphere};
    use glam::Vec3;

    #[test]
    fn refused_memory_is_an_error_in_embrees_words() {
        let sphere = |i: u16| Sphere { center: Vec3::splat(f32::from(i)), radius: 0.5 };
        let shapes = [Shape::Spheres((0..5000).map(sphere).collect())];
        let options = BuildOptions { threads: 1, ..BuildOptions::default() };
        let commit = |limit| Scene::commit(Device::with_memory_limit(&options, limit)?, &shapes, &options);
        assert!(commit(isize::MAX).is_ok());
        let Err(AccelError::Embree { during, message }) = commit(100_000) else {
            panic!("a hierarchy of 5000 spheres does not fit in 100 kB")
        };
        assert_eq!(during, "building the hierarchy");
        assert!(message.starts_with("out of memory"), "{message}");
    }

    #[test]
    fn options_become_settings() {
        let settings = |threads, quality| {
            config(&BuildOptions { threads, quality, ..BuildOptions::default() }).into_string().unwrap()
        };
        assert_eq!(settings(0, Quality::Medium), "");
        assert_eq!(settings(3, Quality::High), "threads=3,max_spatial_split_replications=2.0");
    }
}
