//! What it takes to verify a file of whatever content: memory by the bytes that are there and the triangles of the
//! mesh, not by the numbers that the file states.
//!
//! One test alone in its process, since threads of a pool do the work and all are counted.

#[allow(dead_code, reason = "others use the rest")]
#[path = "../../bvh-format/tests/common/seal.rs"]
mod seal;

use bvh_bake::mesh::Mesh;
use bvh_bake::{Options, to_bytes, verify};
use seal::{put, seal, section};
use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicUsize, Ordering};

static HELD: AtomicUsize = AtomicUsize::new(0);
static MOST: AtomicUsize = AtomicUsize::new(0);

struct Counting;

// SAFETY: every call goes on to the system's allocator unchanged; counting touches atomic integers.
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

/// The most bytes held at once while `work` ran, beyond those held before.
fn peak<R>(work: impl FnOnce() -> R) -> (usize, R) {
    let before = HELD.load(Ordering::Relaxed);
    MOST.store(before, Ordering::Relaxed);
    let result = work();
    (MOST.load(Ordering::Relaxed) - before, result)
}

/// A zigzag strip of so many triangles.
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
    // The pool's threads start, and stay.
    verify(&honest, &mesh).unwrap();
    let (most, _) = peak(|| verify(&honest, &mesh).unwrap());
    let limit = most.max(honest.len()) + (256 << 10);
    let (objects, nodes) = (section(&honest, 1).start, section(&honest, 2).start);
    // Every 32-bit word of header, section table, object table and first page header.
    let places = (8..40).step_by(4).chain((64..256).step_by(4));
    let places = places.chain((0..16 + 192).step_by(4).map(|at| objects + at));
    let places: Vec<usize> = places.chain((0..64).step_by(4).map(|at| nodes + at)).collect();
    for place in places {
        for value in [u32::MAX, i32::MAX as u32, 1 << 20] {
            let mut bytes = honest.clone();
            put(&mut bytes, place, &value.to_le_bytes());
            seal(&mut bytes);
            let (memory, _) = peak(|| verify(&bytes, &mesh).is_ok());
            assert!(memory <= limit, "byte {place}, {value:#x}: {memory} bytes, not {limit}");
        }
    }
    // The counter does count.
    let (memory, _) = peak(|| std::hint::black_box(vec![0u8; 2 * limit]).len());
    assert!(memory > limit);
}
