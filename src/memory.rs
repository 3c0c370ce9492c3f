//! Settings of the allocator: memory that is freed stays with the process, so that the next
//! maneuver need not request it from the kernel again.
//!
//! A prepared maneuver takes some two megabytes in vectors of a few hundred kilobytes. By default
//! glibc returns such blocks to the kernel at once and takes them anew, page by page. On a virtual
//! machine these page faults cost a quarter of the time of an estimate. Only blocks up to
//! [`LARGEST_KEPT`] are kept, and no more than [`MOST_KEPT`] at the end of the heap. The pages of a
//! large flight are thus returned as before.

/// Size above which glibc requests a block from the kernel and returns it when freed, bytes.
/// Buffers of the archive's files are such blocks.
const LARGEST_KEPT: i32 = 1 << 20;
/// Free bytes at the end of a heap beyond which it shrinks.
const MOST_KEPT: i32 = 16 << 20;

/// Sets the limits of glibc's allocator; does nothing with another allocator.
pub fn keep_freed_memory() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    #[expect(
        unsafe_code,
        reason = "there is no safe way to set the allocator's thresholds; two whole numbers are all it takes"
    )]
    // SAFETY: mallopt may be called at any time; it takes its arguments by value and rejects
    // parameters that it does not have.
    unsafe {
        libc::mallopt(libc::M_MMAP_THRESHOLD, LARGEST_KEPT);
        libc::mallopt(libc::M_TRIM_THRESHOLD, MOST_KEPT);
    }
}
