//! Large arrays on large pages: a ray that jumps about in a tree of a hundred megabytes, or a sampler in a picture of eight million pixels, else
//! waits for the translation of addresses as often as for the memory itself.
//!
//! SAFETY, once for all: the advice names whole pages inside memory that is borrowed for the time of the call. It changes neither what is
//! in them nor who may use them; a system that does not know it, or has no large page left, says so and does nothing.
#![allow(unsafe_code)]

use std::mem::MaybeUninit;

/// Asks the system to move what is in `items` to large pages, now. Does nothing for what is smaller than a few of them.
pub fn prefer_large_pages<T>(items: &[T]) {
    #[cfg(target_os = "linux")]
    advise(items, &[libc::MADV_HUGEPAGE, libc::MADV_COLLAPSE]);
    #[cfg(not(target_os = "linux"))]
    let _ = items;
}

/// Asks the system to use large pages where nothing has been written yet.
pub(crate) fn await_large_pages<T>(items: &[T]) {
    #[cfg(target_os = "linux")]
    advise(items, &[libc::MADV_HUGEPAGE]);
    #[cfg(not(target_os = "linux"))]
    let _ = items;
}

/// As `vec![item; len]`, on large pages if it is large.
pub(crate) fn filled<T: Clone>(item: T, len: usize) -> Vec<T> {
    let mut items = Vec::with_capacity(len);
    let room: &[MaybeUninit<T>] = items.spare_capacity_mut();
    await_large_pages(room);
    items.resize(len, item);
    items
}

#[cfg(target_os = "linux")]
fn advise<T>(items: &[T], advice: &[libc::c_int]) {
    const LARGE: usize = 2 << 20;
    let first = (items.as_ptr() as usize).next_multiple_of(LARGE);
    let end = (items.as_ptr() as usize + size_of_val(items)) / LARGE * LARGE;
    if first < end {
        for &advice in advice {
            // SAFETY: see the module.
            unsafe { libc::madvise(first as *mut libc::c_void, end - first, advice) };
        }
    }
}
