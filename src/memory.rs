//! Memory that was given back stays with the process, so that the next maneuver need not ask the
//! kernel for it again.
//!
//! A maneuver made ready is some two megabytes in vectors of a few hundred kilobytes. glibc returns
//! such blocks at once and takes them anew, page by page, and on a virtual machine those faults
//! cost more than what is computed in the pages: a quarter of an estimate. Only blocks up to
//! [`LARGEST_KEPT`] are kept, and no more than [`MOST_KEPT`] at the end of the heap, so that a
//! large flight's pages go back as before.

/// Larger blocks, the buffers of the archive's files among them, are taken from the kernel and
/// returned to it, bytes.
pub const LARGEST_KEPT: i32 = 1 << 20;
/// Free bytes at the end of a heap beyond which it shrinks.
pub const MOST_KEPT: i32 = 16 << 20;

/// Tells the allocator; where it is not glibc nothing is to be told.
pub fn keep() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    #[expect(
        unsafe_code,
        reason = "there is no safe way to set the allocator's thresholds; two whole numbers are all it takes"
    )]
    // SAFETY: mallopt may be called at any time; it takes its arguments by value and refuses what
    // it does not know.
    unsafe {
        libc::mallopt(libc::M_MMAP_THRESHOLD, LARGEST_KEPT);
        libc::mallopt(libc::M_TRIM_THRESHOLD, MOST_KEPT);
    }
}
