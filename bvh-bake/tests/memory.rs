//! Bounds the memory for verifying a file of any content: it depends on the bytes that are there and on the triangles
//! of the mesh, not on the numbers that the file states.
//!
//! This test is alone in its process, because the threads of a pool do the work and all threads are counted.

use bvh_bake::mesh::Mesh;
use bvh_bake::{Options, to_bytes, verify};
use cbvh_testkit::damage::overstated;
use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicUsize, Ordering};

static HELD: AtomicUsize = AtomicUsize::new(0);
static MOST: AtomicUsize = AtomicUsize::new(0);

struct Counting;

// SAFETY: every call is passed to the system's allocator unchanged. Counting touches only atomic integers.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        let held = HELD.fetch_add(layout.size(), Ordering::Relaxed) + layout.size();
        MOST.fetch_max(held, Ordering::Relaxed);
        // SAFETY: the caller's promises are passed on.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        HELD.fetch_sub(layout.size(), Ordering::Relaxed);
        // SAFETY: the caller's promises are passed on.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static COUNTING: Counting = Counting;

/// Returns the most bytes that were held at once while `work` ran, beyond those held before.
fn peak<R>(work: impl FnOnce() -> R) -> (usize, R) {
    let before = HELD.load(Ordering::Relaxed);
    MOST.store(before, Ordering::Relaxed);
    let result = work();
    (MOST.load(Ordering::Relaxed) - before, result)
}

/// Makes a zigzag strip of `count` triangles.
fn strip(count: u32) -> Mesh {
    let corner = |i: u32| [f64::from(i), f64::from(i % 2), f64::from(i * i % 7)];
    Mesh::from_triangles(
        (0..count + 2).map(corner).collect(),
        (0..count).map(|i| [i, i + 1, i + 2]).collect(),
    )
}

#[test]
fn stated_numbers_allocate_nothing() {
    let mesh = strip(2000);
    let (honest, _) = to_bytes(&mesh, &Options::default()).unwrap();
    // Starts the pool's threads, which stay.
    verify(&honest, &mesh).unwrap();
    let (most, _) = peak(|| verify(&honest, &mesh).unwrap());
    let limit = most.max(honest.len()) + (256 << 10);
    for (stated, bytes) in overstated(&honest) {
        let (memory, _) = peak(|| verify(&bytes, &mesh).is_ok());
        assert!(memory <= limit, "{stated}: {memory} bytes, not {limit}");
    }
    // The counter counts.
    let (memory, _) = peak(|| std::hint::black_box(vec![0u8; 2 * limit]).len());
    assert!(memory > limit);
}
