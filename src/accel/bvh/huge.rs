//! Large pages for large arrays: rays jump about in them, and with small pages each jump misses the address cache too.

#![allow(unsafe_code)] // Advice to the system about memory, by its address.

/// An empty vector with room for `count`, whose memory the system is asked to hold in large pages.
///
/// Only untouched memory gets them at once, so the advice comes before the content. Where the system takes none, the
/// vector is an ordinary one.
pub(super) fn vec_with_capacity<T>(count: usize) -> Vec<T> {
    let vec = Vec::with_capacity(count);
    advise(&vec);
    vec
}

/// Smallest array for which it is worth a system call.
#[cfg(target_os = "linux")]
const LEAST_BYTES: usize = 4 << 20;

#[cfg(target_os = "linux")]
fn advise<T>(vec: &Vec<T>) {
    use rustix::mm::{Advice, madvise};
    let page = rustix::param::page_size();
    let start = vec.as_ptr().cast::<u8>();
    let before = start.align_offset(page);
    let bytes = (vec.capacity() * size_of::<T>()).saturating_sub(before) / page * page;
    if bytes >= LEAST_BYTES {
        // SAFETY: the whole pages from `start + before` on belong to the vector's allocation, and the advice changes no
        // content. A refusal is no error: the pages stay small.
        let _ =
            unsafe { madvise(start.wrapping_add(before).cast_mut().cast(), bytes, Advice::LinuxHugepage) };
    }
}

#[cfg(not(target_os = "linux"))]
fn advise<T>(_: &Vec<T>) {}
