//! While a world is prepared, memory that is let go is the system's again at once.
//!
//! Of what large arrays leave behind glibc's allocator keeps as much as the largest of them took, up to 32 MiB, and twice that at the end of
//! each thread's memory: when a million triangles were prepared it held 20 MiB that nobody used, a fifth of all. So its thresholds are low
//! meanwhile (`mallopt`, of the whole process). Afterwards they are what it would have come to by itself: whoever takes and gives megabytes
//! for each picture would wait for pages otherwise, a tenth of the time that a refresh takes.
//!
//! SAFETY, once for all: thresholds are numbers, and set under the allocator's own lock. They change when memory is given back, never whose
//! it is.
#![allow(unsafe_code)]

use std::sync::{Mutex, PoisonError};

/// What is as large has pages of its own; so much may lie free at the end of each thread's memory.
///
/// Half of the first: the apartment takes 1 MiB less, and a tenth more time, for pages; twice: 2 MiB more. Of the second four times as much:
/// 1 MiB more; half: the same.
const LOW: [i32; 2] = [512 << 10, 256 << 10];
/// Where the allocator's own adaptation ends.
const HIGH: [i32; 2] = [32 << 20, 64 << 20];

/// How many worlds are being prepared.
static PREPARED: Mutex<usize> = Mutex::new(0);

/// Memory is spared until it is dropped.
pub(crate) struct Sparing(());

impl Sparing {
    pub(crate) fn begin() -> Sparing {
        let mut prepared = PREPARED.lock().unwrap_or_else(PoisonError::into_inner);
        *prepared += 1;
        set_thresholds(LOW);
        Sparing(())
    }
}

impl Drop for Sparing {
    fn drop(&mut self) {
        let mut prepared = PREPARED.lock().unwrap_or_else(PoisonError::into_inner);
        *prepared -= 1;
        if *prepared == 0 {
            set_thresholds(HIGH);
        }
    }
}

fn set_thresholds([mapped, trimmed]: [i32; 2]) {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    // SAFETY: see the module.
    unsafe {
        libc::mallopt(libc::M_MMAP_THRESHOLD, mapped);
        libc::mallopt(libc::M_TRIM_THRESHOLD, trimmed);
        // What lies free from before, the file's bytes above all.
        libc::malloc_trim(0);
    }
    #[cfg(not(all(target_os = "linux", target_env = "gnu")))]
    let _ = [mapped, trimmed];
}
