//! Embree's C declarations, as bindgen read them from the installed header.
//!
//! Every struct's size and every field's place is held against the header at compile time by the assertions
//! inside the generated file.

#![allow(
    dead_code,
    missing_docs,
    non_camel_case_types,
    non_snake_case,
    non_upper_case_globals,
    unreachable_pub,
    clippy::all,
    clippy::undocumented_unsafe_blocks,
    reason = "generated from Embree's header, with its names"
)]

include!(concat!(env!("OUT_DIR"), "/embree.rs"));

/// What Embree calls no geometry, no primitive and no instance (a cast in the header, which bindgen leaves out).
pub(super) const INVALID_ID: u32 = u32::MAX;

/// Length of the arrays of instance ids.
pub(super) const INSTANCE_LEVELS: usize = RTC_MAX_INSTANCE_LEVEL_COUNT as usize;
