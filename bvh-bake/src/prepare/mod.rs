//! Gathers the facts about all triangles of an object that are needed before its tree is built.
//!
//! There are two passes. The first measures and hashes, and its hashes give the duplicates. The second looks at the
//! triangles that are kept.

pub(crate) mod duplicates;
pub(crate) mod layout_choice;
pub(crate) mod quantization;

use crate::error::BakeError;
use crate::progress::{Stage, Step};
use crate::storage::external_sort::Sorter;
use crate::storage::resources::Resources;
use crate::threads;
use crate::tree::{Aabb, Grid, is_one_brick};
use crate::triangles::placement::Moved;
use crate::triangles::{Corners, Exact, Kept, TRIANGLES_PER_PART, TriangleStream, Triangles, fold};
use bvh_format::vertex::Vertices;
use duplicates::{Found, Hashed, Suspect};

/// The results of the first pass.
pub(crate) struct Measured {
    pub(crate) moved: Moved,
    /// The box of all corners.
    pub(crate) bounds: Aabb,
    /// The box of the centres of all triangles' boxes, each centre times two.
    centres: Aabb,
    /// One bit per triangle, set for duplicates; empty if there are none.
    pub(crate) dropped: Vec<u64>,
}

/// Runs the first pass. Passes the pairs and the nets of duplicates to `found`. Equal points of a cloud are no duplicates.
pub(crate) fn measure(
    stream: &TriangleStream,
    is_cloud: bool,
    resources: &Resources,
    found: impl FnMut(Found) -> Result<(), BakeError>,
) -> Result<Measured, BakeError> {
    let spill = resources.scratch.spill();
    let mut hashes = Sorter::of_runs(resources.sorted_at_once::<Hashed>(stream.count));
    let mut moved = Moved::default();
    let (mut bounds, mut centres) = (Aabb::EMPTY, Aabb::EMPTY);
    let batch = 4 * threads::current_num_threads();
    for start in (0..stream.parts()).step_by(batch) {
        let parts = start..(start + batch).min(stream.parts());
        let of_part = |part: usize| {
            let (triangles, moved) = stream.measured_part(part)?;
            let (mut bounds, mut centres) = (Aabb::EMPTY, Aabb::EMPTY);
            let mut hashes = Vec::with_capacity(if is_cloud { 0 } else { triangles.len() });
            for (triangle, place) in triangles.iter().zip((part * TRIANGLES_PER_PART) as u64..) {
                let own = Aabb::of_triangle(&triangle.corners);
                bounds.join(&own);
                centres.join(&Aabb::of_point(own.centre()));
                if !is_cloud {
                    hashes.push(duplicates::hashed(&triangle.corners, place));
                }
            }
            resources.progress.add(Step::Bake(Stage::Prepare), triangles.len() as u64);
            Ok::<_, BakeError>((moved, bounds, centres, hashes))
        };
        for part in threads::map(parts, of_part) {
            let (part_moved, part_bounds, part_centres, part_hashes) = part?;
            moved = moved.joined(part_moved);
            bounds.join(&part_bounds);
            centres.join(&part_centres);
            hashes.extend(&part_hashes, &spill)?;
        }
    }
    let dropped = if is_cloud {
        Vec::new()
    } else {
        let run = resources.sorted_at_once::<Suspect>(stream.count);
        duplicates::find(stream, hashes, run, &spill, found)?
    };
    Ok(Measured { moved, bounds, centres, dropped })
}

/// The results of the second pass.
pub(crate) struct Surveyed {
    pub(crate) centre: [f32; 3],
    pub(crate) radius: f32,
    /// The number of triangles without area.
    pub(crate) degenerate: u64,
    /// Counts and boxes for the division into bricks, if there is more than one.
    pub(crate) grid: Option<Grid>,
}

/// Runs the second pass.
pub(crate) fn survey(
    kept: &Kept,
    measured: &Measured,
    behind: &Vertices,
    resources: &Resources,
) -> Result<Surveyed, BakeError> {
    let (bounds, left_out) = (&measured.bounds, behind.left_out.map(f64::from));
    let most_left_out = left_out.into_iter().fold(0.0, f64::max);
    let centre = [0, 1, 2].map(|a| ((f64::from(bounds.lo(a)) + f64::from(bounds.hi(a))) / 2.0) as f32);
    struct Sum {
        squared: f64,
        degenerate: u64,
        grid: Option<Grid>,
    }
    let new = || Sum {
        squared: 0.0,
        degenerate: 0,
        grid: (!is_one_brick(kept.count())).then(|| Grid::empty(&measured.centres)),
    };
    let add = |sum: &mut Sum, part: usize| {
        let triangles = kept.part(part)?;
        for (place, triangle) in triangles.iter().enumerate() {
            for corner in &triangle.corners {
                let away = |a: usize| (f64::from(corner[a]) - f64::from(centre[a])).abs() + left_out[a];
                sum.squared = sum.squared.max((0..3).map(|a| away(a).powi(2)).sum::<f64>());
            }
            let vertices = || {
                triangles
                    .exact
                    .get(place)
                    .copied()
                    .unwrap_or_else(|| behind.predicted_triangle(&triangle.corners))
            };
            let may_be = !has_area(&triangle.corners, most_left_out);
            sum.degenerate += u64::from(may_be && is_degenerate(vertices()));
            if let Some(grid) = &mut sum.grid {
                grid.add(&Aabb::of_triangle(&triangle.corners));
            }
        }
        resources.progress.add(Step::Bake(Stage::Prepare), triangles.len() as u64);
        Ok(())
    };
    let mut all = Surveyed { centre, radius: 0.0, degenerate: 0, grid: None };
    let mut squared = 0f64;
    for sum in fold(kept.parts(), new, add)? {
        squared = squared.max(sum.squared);
        all.degenerate += sum.degenerate;
        all.grid = match (all.grid, sum.grid) {
            (Some(a), Some(b)) => Some(a.merged(&b)),
            (a, b) => a.or(b),
        };
    }
    // Differences of f32 in f64, sums with what is left out, three squares, two sums and a root each round by at most 2^-53 of
    // themselves. The factor 1 + 2^-40 covers these, and the next f32 covers the last rounding.
    all.radius = ((squared.sqrt() * (1.0 + 2f64.powi(-40))) as f32).next_up();
    Ok(all)
}

/// Returns true if the vertices behind these offsets, which are this near along each axis, certainly do not lie on a line.
fn has_area(corners: &Corners, left_out: f64) -> bool {
    let [a, b, c] = corners.map(|corner| corner.map(f64::from));
    let [p, q] = [b, c].map(|end| [0, 1, 2].map(|k| end[k] - a[k]));
    let largest = p.iter().chain(&q).fold(0.0, |most: f64, value| most.max(value.abs())) + 2.0 * left_out;
    // A component of the cross product changes by at most 8 d E if differences of at most E change by 2 d each, and it is rounded
    // by less than 2^-50 E^2. Twice that is charged, and 2^-1000 for products that vanish.
    let charge = largest * (16.0 * left_out + largest * 2f64.powi(-48)) + 2f64.powi(-1000);
    (0..3).any(|k| (p[k] * q[(k + 1) % 3] - p[(k + 1) % 3] * q[k]).abs() > charge)
}

/// Returns true if the three vertices lie on a line. This is decided exactly: each component of the cross product of two
/// edges is a sum of products of differences, which is a 2-by-2 orientation.
fn is_degenerate([a, b, c]: Exact) -> bool {
    [(0, 1), (1, 2), (2, 0)].into_iter().all(|(x, y)| {
        let point = |p: [f64; 3]| robust::Coord { x: p[x], y: p[y] };
        robust::orient2d(point(a), point(b), point(c)) == 0.0
    })
}
