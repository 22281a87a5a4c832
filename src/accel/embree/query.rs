//! One set of calls for Embree 3 and 4: they differ in where the flags and the filter are passed.

use super::ffi;
use super::packet::{Mask, Packet};
use super::polish::{Verdict, judge};
use super::scene::Scene;
use crate::accel::Coherence;
use crate::core::{Hit, Ray};
use crate::geometry::Shape;

/// What makes a scene ready for a filter that comes with the call.
#[cfg(embree3)]
pub(super) const FILTER_FLAG: ffi::RTCSceneFlags = ffi::RTCSceneFlags::RTC_SCENE_FLAG_CONTEXT_FILTER_FUNCTION;
#[cfg(embree4)]
pub(super) const FILTER_FLAG: ffi::RTCSceneFlags =
    ffi::RTCSceneFlags::RTC_SCENE_FLAG_FILTER_FUNCTION_IN_ARGUMENTS;

#[cfg(embree3)]
type Context = ffi::RTCIntersectContext;
#[cfg(embree4)]
type Context = ffi::RTCRayQueryContext;

/// What a call is told besides its rays.
#[repr(C)]
pub(super) struct Query<'a> {
    /// First, since Embree hands the filter a pointer to it, which is then also one to the query.
    context: Context,
    #[cfg(embree4)]
    flags: ffi::RTCRayQueryFlags,
    #[cfg(embree3)]
    coherence: Coherence,
    filter: Option<Filter<'a>>,
}

/// How far a filter trusts Embree's candidates.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Care {
    /// Altogether: only the ray's rule is obeyed.
    Trusting,
    /// Each is held against its primitive, and what Embree misplaced is kept aside.
    Checking,
    /// All are kept aside and none is accepted, so that none hides another.
    Exhaustive,
}

/// What the filter knows of the one ray that it serves.
struct Filter<'a> {
    shapes: &'a [Shape],
    ray: &'a Ray,
    /// What the filter looks at besides the ray's rule.
    care: Care,
    /// The best of those that it rejected because Embree had misplaced them.
    best: Option<Hit>,
}

impl<'a> Query<'a> {
    /// A query of rays that may hit everything.
    pub(super) fn all(coherence: Coherence) -> Self {
        Self::new(coherence, None)
    }

    /// A query of one ray that obeys its rule.
    pub(super) fn filtered(shapes: &'a [Shape], ray: &'a Ray, care: Care) -> Self {
        Self::new(Coherence::Incoherent, Some(Filter { shapes, ray, care, best: None }))
    }

    /// The closest of the candidates that the filter kept.
    pub(super) fn best(&self) -> Option<Hit> {
        self.filter.as_ref().and_then(|filter| filter.best)
    }

    #[cfg(embree3)]
    fn new(coherence: Coherence, filter: Option<Filter<'a>>) -> Self {
        use ffi::RTCIntersectContextFlags as Flags;
        let flags = match coherence {
            Coherence::Coherent => Flags::RTC_INTERSECT_CONTEXT_FLAG_COHERENT,
            Coherence::Incoherent => Flags::RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT,
        };
        let callback: ffi::RTCFilterFunctionN = if filter.is_some() { Some(on_candidate) } else { None };
        let instances = [ffi::INVALID_ID; ffi::INSTANCE_LEVELS];
        Self { context: Context { flags, filter: callback, instID: instances }, coherence, filter }
    }

    #[cfg(embree4)]
    fn new(coherence: Coherence, filter: Option<Filter<'a>>) -> Self {
        use ffi::RTCRayQueryFlags as Flags;
        let hint = match coherence {
            Coherence::Coherent => Flags::RTC_RAY_QUERY_FLAG_COHERENT,
            Coherence::Incoherent => Flags::RTC_RAY_QUERY_FLAG_INCOHERENT,
        };
        let invoke = match filter {
            None => Flags::RTC_RAY_QUERY_FLAG_NONE,
            Some(_) => Flags::RTC_RAY_QUERY_FLAG_INVOKE_ARGUMENT_FILTER,
        };
        Self { context: Context::default(), flags: hint | invoke, filter }
    }

    /// What is known of the rays.
    #[cfg(embree3)]
    pub(super) fn coherence(&self) -> Coherence {
        self.coherence
    }

    /// Covers the whole query, not only its first field.
    fn context(&mut self) -> *mut Context {
        (&raw mut *self).cast()
    }

    #[cfg(embree4)]
    fn callback(&self) -> ffi::RTCFilterFunctionN {
        if self.filter.is_some() { Some(on_candidate) } else { None }
    }

    #[cfg(embree4)]
    fn closest(&mut self) -> ffi::RTCIntersectArguments {
        ffi::RTCIntersectArguments {
            flags: self.flags,
            feature_mask: ffi::RTCFeatureFlags::RTC_FEATURE_FLAG_ALL,
            filter: self.callback(),
            context: self.context(),
            ..Default::default()
        }
    }

    #[cfg(embree4)]
    fn any(&mut self) -> ffi::RTCOccludedArguments {
        ffi::RTCOccludedArguments {
            flags: self.flags,
            feature_mask: ffi::RTCFeatureFlags::RTC_FEATURE_FLAG_ALL,
            filter: self.callback(),
            context: self.context(),
            ..Default::default()
        }
    }
}

/// Embree's question, for each primitive that the one ray of a filtered call would hit, whether the hit counts.
///
/// An `extern "C"` function aborts rather than unwinds, and nothing here panics: Embree's ids are those of shapes
/// that are there.
unsafe extern "C" fn on_candidate(arguments: *const ffi::RTCFilterFunctionNArguments) {
    // SAFETY: Embree calls with valid arguments whose context is the one that the call was given, the first field
    // of a `Query` that outlives the call and that nothing else uses during it.
    let (arguments, query) = unsafe { (&*arguments, &mut *(*arguments).context.cast::<Query<'_>>()) };
    let Some(filter) = &mut query.filter else { return };
    // SAFETY: filtered calls have one ray, for which the arrays of rays and hits have length 1: they are then laid
    // out as `RTCRay` and `RTCHit` are, in words of 4 bytes, of which these are always there.
    let (t, geom_id, prim_id) = unsafe {
        let (ray, hit) = (arguments.ray.cast::<f32>(), arguments.hit.cast::<u32>());
        (*ray.add(word::T), *hit.add(word::GEOM_ID), *hit.add(word::PRIM_ID))
    };
    if !filter.accepts(Hit { t, u: 0.0, v: 0.0, geom_id, prim_id }) {
        // SAFETY: one ray, one flag.
        unsafe { *arguments.valid = 0 };
    }
}

/// Places in a ray and a hit, in words.
mod word {
    use super::ffi::{RTCHit, RTCRay};
    use std::mem::offset_of;

    pub(super) const T: usize = offset_of!(RTCRay, tfar) / 4;
    pub(super) const GEOM_ID: usize = offset_of!(RTCHit, geomID) / 4;
    pub(super) const PRIM_ID: usize = offset_of!(RTCHit, primID) / 4;
}

impl Filter<'_> {
    /// Whether Embree may take the candidate as it found it.
    fn accepts(&mut self, candidate: Hit) -> bool {
        if self.ray.skip.rejects(candidate.geom_id, candidate.prim_id) {
            return false;
        }
        if self.care == Care::Trusting {
            return true;
        }
        let exact = match judge(self.shapes, self.ray, candidate) {
            Verdict::Right(_) if self.care == Care::Checking => return true,
            Verdict::Right(hit) | Verdict::Elsewhere(hit) => hit,
            Verdict::Miss => return false,
        };
        if self.best.is_none_or(|best| exact.t < best.t) {
            self.best = Some(exact);
        }
        false
    }
}

impl Scene {
    /// Closest hit of one ray.
    pub(super) fn intersect1(&self, query: &mut Query<'_>, ray: &mut ffi::RTCRayHit) {
        // SAFETY: the scene is committed; ray and query are valid and aligned as their types say.
        unsafe {
            #[cfg(embree3)]
            ffi::rtcIntersect1(self.as_ptr(), query.context(), ray);
            #[cfg(embree4)]
            ffi::rtcIntersect1(self.as_ptr(), ray, &mut query.closest());
        }
    }

    /// Any hit of one ray.
    pub(super) fn occluded1(&self, query: &mut Query<'_>, ray: &mut ffi::RTCRay) {
        // SAFETY: as for `intersect1`.
        unsafe {
            #[cfg(embree3)]
            ffi::rtcOccluded1(self.as_ptr(), query.context(), ray);
            #[cfg(embree4)]
            ffi::rtcOccluded1(self.as_ptr(), ray, &mut query.any());
        }
    }
}

/// The packet calls of one width.
macro_rules! packet_calls {
    ($width:literal, $intersect:ident, $occluded:ident) => {
        impl PacketCalls<$width> for Scene {
            fn intersect_packet(
                &self,
                query: &mut Query<'_>,
                mask: &Mask<$width>,
                packet: &mut Packet<$width>,
            ) {
                let packet = (&raw mut *packet).cast();
                // SAFETY: the scene is committed; `Packet` has the layout of Embree's struct of this width and its
                // alignment (asserted beside it), and so has the mask.
                unsafe {
                    #[cfg(embree3)]
                    ffi::$intersect(mask.as_ptr(), self.as_ptr(), query.context(), packet);
                    #[cfg(embree4)]
                    ffi::$intersect(mask.as_ptr(), self.as_ptr(), packet, &mut query.closest());
                }
            }

            fn occluded_packet(
                &self,
                query: &mut Query<'_>,
                mask: &Mask<$width>,
                packet: &mut Packet<$width>,
            ) {
                let rays = (&raw mut *packet).cast();
                // SAFETY: as above; the rays come first in a packet.
                unsafe {
                    #[cfg(embree3)]
                    ffi::$occluded(mask.as_ptr(), self.as_ptr(), query.context(), rays);
                    #[cfg(embree4)]
                    ffi::$occluded(mask.as_ptr(), self.as_ptr(), rays, &mut query.any());
                }
            }
        }
    };
}

/// Calls that answer `N` rays at once.
pub(super) trait PacketCalls<const N: usize> {
    /// Closest hits of the rays that the mask names.
    fn intersect_packet(&self, query: &mut Query<'_>, mask: &Mask<N>, packet: &mut Packet<N>);
    /// Any hit of the rays that the mask names.
    fn occluded_packet(&self, query: &mut Query<'_>, mask: &Mask<N>, packet: &mut Packet<N>);
}

packet_calls!(4, rtcIntersect4, rtcOccluded4);
packet_calls!(8, rtcIntersect8, rtcOccluded8);
packet_calls!(16, rtcIntersect16, rtcOccluded16);

/// Embree 3's streams; Embree 4 has none.
#[cfg(embree3)]
impl Scene {
    /// Closest hits of rays one after the other.
    pub(super) fn intersect_stream(&self, query: &mut Query<'_>, rays: &mut [ffi::RTCRayHit]) {
        let (first, count) = (rays.as_mut_ptr(), rays.len() as u32);
        // SAFETY: the scene is committed; pointer, count and stride describe the slice.
        unsafe {
            ffi::rtcIntersect1M(self.as_ptr(), query.context(), first, count, size_of::<ffi::RTCRayHit>());
        }
    }

    /// Any hit of rays one after the other.
    pub(super) fn occluded_stream(&self, query: &mut Query<'_>, rays: &mut [ffi::RTCRay]) {
        let (first, count) = (rays.as_mut_ptr(), rays.len() as u32);
        // SAFETY: as for `intersect_stream`.
        unsafe {
            ffi::rtcOccluded1M(self.as_ptr(), query.context(), first, count, size_of::<ffi::RTCRay>());
        }
    }

    /// Closest hits of packets one after the other.
    pub(super) fn intersect_packet_stream(&self, query: &mut Query<'_>, packets: &mut [Packet<8>]) {
        let (first, count) = (packets.as_mut_ptr().cast(), packets.len() as u32);
        // SAFETY: as for `intersect_stream`; a packet has Embree's layout for 8 rays.
        unsafe {
            ffi::rtcIntersectNM(self.as_ptr(), query.context(), first, 8, count, size_of::<Packet<8>>());
        }
    }
}
