//! Checks that a warm query allocates nothing. The allocator itself counts.

use bvh_bake::mesh::Mesh;
use bvh_query::{Bvh, Pose, Querier, Ray, Tracker};
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::ops::ControlFlow;

thread_local! {
    static ALLOCATIONS: Cell<u64> = const { Cell::new(0) };
}

struct Counting;

// SAFETY: every call is passed to the system's allocator unchanged. Counting touches only a thread-local integer,
// which needs no allocation and has no destructor.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ALLOCATIONS.with(|count| count.set(count.get() + 1));
        // SAFETY: the caller's promises are passed on.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: the caller's promises are passed on.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static COUNTING: Counting = Counting;

/// Bakes a bumpy sheet of 2 * n * n triangles.
fn sheet(n: u32) -> Bvh {
    let height = |x: u32, y: u32| f64::from((x * 7 + y * 13) % 11) / 40.0;
    let positions =
        (0..=n).flat_map(|y| (0..=n).map(move |x| [f64::from(x), f64::from(y), height(x, y)])).collect();
    let corner = |x: u32, y: u32| y * (n + 1) + x;
    let triangles = (0..n)
        .flat_map(|y| (0..n).map(move |x| (x, y)))
        .flat_map(|(x, y)| {
            let (a, b, c, d) = (corner(x, y), corner(x + 1, y), corner(x + 1, y + 1), corner(x, y + 1));
            [[a, b, c], [a, c, d]]
        })
        .collect();
    let mesh = Mesh::from_triangles(positions, triangles);
    Bvh::from_bytes(bvh_bake::to_bytes(&mesh, &bvh_bake::Options::default()).unwrap().0).unwrap()
}

#[test]
fn warm_queries_allocate_nothing() {
    let bvh = sheet(40);
    let mut querier = Querier::new().unwrap();
    let poses: Vec<Pose> = (0..20)
        .map(|i| {
            let (sin, cos) = (f64::from(i) * 0.3).sin_cos();
            let turn = [[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]];
            Pose::new(turn, [f64::from(i), -3.0, f64::from(i % 5) * 0.2]).unwrap()
        })
        .collect();
    let mut ask = |poses: &[Pose]| {
        let mut answers = 0.0;
        let mut tracker = Tracker::new();
        for pose in poses {
            answers += f64::from(u8::from(querier.collide(&bvh, &bvh, pose).unwrap()));
            answers += querier.distance(&bvh, &bvh, pose).unwrap().distance;
            answers += f64::from(u8::from(querier.within(&bvh, &bvh, pose, 0.1).unwrap()));
            answers +=
                querier.visit_contacts(&bvh, &bvh, pose, |_| ControlFlow::Continue(())).unwrap() as f64;
            let (at, point) = (bvh.all().at(pose), [0.3, 0.2, 0.7]);
            answers += querier.closest_point(at, point, f64::INFINITY).unwrap().unwrap().distance;
            answers += f64::from(querier.side(at, point).unwrap() as u8);
            answers +=
                querier.first_hit(at, &Ray::new(point, [0.1, 0.2, -0.9])).unwrap().map_or(0.0, |hit| hit.t);
            answers += f64::from(u8::from(querier.segment_hit(at, point, [0.9, -0.7, -0.8]).unwrap()));
            answers += f64::from(u8::from(tracker.collide(&mut querier, &bvh, &bvh, pose).unwrap()));
            answers += tracker.distance(&mut querier, &bvh, &bvh, pose).unwrap().distance;
            answers += f64::from(u8::from(tracker.within(&mut querier, &bvh, &bvh, pose, 0.1).unwrap()));
        }
        answers
    };
    let cold = ask(&poses);
    let before = ALLOCATIONS.get();
    let warm = ask(&poses);
    assert_eq!(ALLOCATIONS.get(), before);
    assert_eq!(warm, cold);
    // The counter counts.
    drop(std::hint::black_box(vec![0u8; 100]));
    assert!(ALLOCATIONS.get() > before);
}
