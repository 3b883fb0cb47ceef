//! From an object in memory to a soup, and from a soup to what has to be known of all its triangles at once.
//!
//! Two passes: the first measures and hashes, and the duplicates follow from that; the second looks at the
//! triangles that are kept.

use crate::auto::{self, Trial};
use crate::bake::Stage;
use crate::build::{Aabb, Grid, is_one_brick};
use crate::duplicates::{self, Hashed};
use crate::error::BakeError;
use crate::means::Means;
use crate::mesh;
use crate::placement::{Extent, Moved, Placement};
use crate::progress::Step;
use crate::sorter::Sorter;
use crate::soup::{Corners, Kept, PART, Part, Soup, Triangle, Triangles, fold};
use rayon::prelude::*;

/// What passes over the triangles are worth: making a soup of an object in memory, measuring, finding duplicates, and
/// surveying.
const SOUP: u64 = 2;
const MEASURE: u64 = 6;
const DUPLICATES: u64 = 4;
const SURVEY: u64 = 4;

/// What a bake takes of an object.
pub(crate) struct Prepared {
    pub(crate) name: String,
    pub(crate) origin: [f64; 3],
    pub(crate) soup: Soup,
    /// Largest moves of vertices, if they have been measured.
    pub(crate) moved: Moved,
    /// Distinct vertices referenced by the input's triangles.
    pub(crate) vertices: u64,
}

impl Prepared {
    /// An object in memory. `grid_error` is the largest move that quantisation may make, as found from the diagonal of
    /// the object's box, `None` for none.
    pub(crate) fn of_object(
        object: &mesh::Object,
        grid_error: impl Fn(f64) -> Option<f64>,
        means: &Means,
    ) -> Result<Self, BakeError> {
        let spill = means.scratch.spill();
        let count = object.triangles.len() as u64;
        let tally = means.progress.tally(Step::Bake(Stage::Prepare), SOUP, count, count);
        let used = used_vertices(object);
        let positions = || object.positions.par_iter().zip(&used).filter(|(_, used)| **used);
        let extent = positions()
            .fold(
                || Extent::EMPTY,
                |mut extent, (&position, _)| {
                    extent.add(position);
                    extent
                },
            )
            .reduce(|| Extent::EMPTY, Extent::joined);
        let placement = Placement::new(&extent, grid_error(extent.diagonal()));
        let place = |(&position, &used): (&[f64; 3], &bool)| {
            let mut moved = Moved::default();
            (if used { placement.place(position, &mut moved) } else { [0.0; 3] }, moved)
        };
        let (vertices, moved): (Vec<[f32; 3]>, Vec<Moved>) =
            object.positions.par_iter().zip(&used).map(place).unzip();
        let moved = moved.into_par_iter().reduce(Moved::default, Moved::joined);
        let triangles = object.triangles.par_chunks(PART).zip(object.triangle_ids.par_chunks(PART));
        let part = |(triangles, ids): (&[[u32; 3]], &[u32])| {
            let triangle = |(corners, &id): (&[u32; 3], &u32)| Triangle {
                corners: corners.map(|index| vertices[index as usize]),
                id,
            };
            tally.add(triangles.len() as u64);
            spill.put(triangles.iter().zip(ids).map(triangle).collect()).map(Part::Narrow)
        };
        let parts = triangles.map(part).collect::<Result<_, _>>()?;
        Ok(Self {
            name: object.name.clone(),
            origin: placement.origin(),
            soup: Soup { parts, count, placement: None },
            moved,
            vertices: used.par_iter().filter(|&&used| used).count() as u64,
        })
    }
}

fn used_vertices(object: &mesh::Object) -> Vec<bool> {
    let mut used = vec![false; object.positions.len()];
    object.triangles.iter().flatten().for_each(|&index| used[index as usize] = true);
    used
}

/// What the first pass finds.
pub(crate) struct Measured {
    pub(crate) moved: Moved,
    /// The box of all corners.
    pub(crate) bounds: Aabb,
    /// The box of twice the centres of all triangles' boxes.
    centres: Aabb,
    /// A bit for each duplicate; empty if there is none.
    pub(crate) dropped: Vec<u64>,
}

/// The first pass. `found` gets the duplicates' pairs of ids.
pub(crate) fn measure(
    soup: &Soup,
    means: &Means,
    found: impl FnMut([u32; 2]) -> Result<(), BakeError>,
) -> Result<Measured, BakeError> {
    let spill = means.scratch.spill();
    let mut hashes = Sorter::of_runs(means.sorted_at_once::<Hashed>(soup.count));
    let mut moved = Moved::default();
    let (mut bounds, mut centres) = (Aabb::EMPTY, Aabb::EMPTY);
    let tally = |weight| means.progress.tally(Step::Bake(Stage::Prepare), weight, soup.count, soup.count);
    let measuring = tally(MEASURE);
    let batch = 4 * rayon::current_num_threads();
    for start in (0..soup.parts()).step_by(batch) {
        let parts = (start..(start + batch).min(soup.parts())).into_par_iter();
        let of_part = |part: usize| {
            let (triangles, moved) = soup.measured_part(part)?;
            let (mut bounds, mut centres) = (Aabb::EMPTY, Aabb::EMPTY);
            let mut hashes = Vec::with_capacity(triangles.len());
            for (triangle, place) in triangles.iter().zip((part * PART) as u64..) {
                let own = Aabb::of_triangle(&triangle.corners);
                bounds.join(&own);
                centres.join(&Aabb::of_point(own.centre()));
                hashes.push(duplicates::hashed(&triangle.corners, place));
            }
            measuring.add(triangles.len() as u64);
            Ok((moved, bounds, centres, hashes))
        };
        let parts: Vec<_> = parts.map(of_part).collect::<Result<_, BakeError>>()?;
        for (part_moved, part_bounds, part_centres, part_hashes) in parts {
            moved = moved.joined(part_moved);
            bounds.join(&part_bounds);
            centres.join(&part_centres);
            hashes.extend(&part_hashes, &spill)?;
        }
    }
    let run = means.sorted_at_once::<[u32; 13]>(soup.count);
    let dropped = duplicates::find(soup, hashes, run, &spill, &tally(DUPLICATES), found)?;
    Ok(Measured { moved, bounds, centres, dropped })
}

/// What the second pass finds.
pub(crate) struct Surveyed {
    pub(crate) centre: [f32; 3],
    pub(crate) radius: f32,
    /// Zero-area triangles.
    pub(crate) degenerate: u64,
    /// Counts and boxes for the division into bricks, if there is more than one.
    pub(crate) grid: Option<Grid>,
    /// The patches that trials ask for, in the order of `auto::patches`.
    pub(crate) patches: Vec<Vec<Corners>>,
}

/// The second pass. `trials` are those of the choice of a profile, empty if there is none to choose.
pub(crate) fn survey(
    kept: &Kept,
    measured: &Measured,
    trials: &[Trial],
    means: &Means,
) -> Result<Surveyed, BakeError> {
    let tally = means.progress.tally(Step::Bake(Stage::Prepare), SURVEY, kept.count(), kept.count());
    let bounds = &measured.bounds;
    let centre = [0, 1, 2].map(|a| ((f64::from(bounds.lo(a)) + f64::from(bounds.hi(a))) / 2.0) as f32);
    let wanted = auto::patches(trials);
    struct Sum {
        squared: f64,
        degenerate: u64,
        grid: Option<Grid>,
        /// The number of a patch, and some of its corners.
        patches: Vec<(usize, Vec<Corners>)>,
    }
    let new = || Sum {
        squared: 0.0,
        degenerate: 0,
        grid: (!is_one_brick(kept.count())).then(|| Grid::empty(&measured.centres)),
        patches: Vec::new(),
    };
    let add = |sum: &mut Sum, part: usize| {
        let triangles = kept.part(part)?;
        for triangle in triangles.iter() {
            for corner in &triangle.corners {
                let squared =
                    (0..3).map(|a| (f64::from(corner[a]) - f64::from(centre[a])).powi(2)).sum::<f64>();
                sum.squared = sum.squared.max(squared);
            }
            sum.degenerate += u64::from(is_degenerate(&triangle.corners));
            if let Some(grid) = &mut sum.grid {
                grid.add(&Aabb::of_triangle(&triangle.corners));
            }
        }
        let first = kept.first(part);
        let end = first + triangles.len() as u64;
        // Ascending by where they start, and none is longer than the longest.
        let near = wanted.partition_point(|(start, _)| *start + auto::LONGEST_PATCH <= first);
        for (number, (start, length)) in wanted.iter().enumerate().skip(near) {
            if *start >= end {
                break;
            }
            let (from, to) = ((*start).max(first), (start + length).min(end));
            if from < to {
                let some = &triangles[(from - first) as usize..(to - first) as usize];
                sum.patches.push((number, some.iter().map(|triangle| triangle.corners).collect()));
            }
        }
        tally.add(triangles.len() as u64);
        Ok(())
    };
    let mut all = Surveyed { centre, radius: 0.0, degenerate: 0, grid: None, patches: Vec::new() };
    all.patches.resize(wanted.len(), Vec::new());
    let mut squared = 0f64;
    for sum in fold(kept.parts(), new, add)? {
        squared = squared.max(sum.squared);
        all.degenerate += sum.degenerate;
        all.grid = match (all.grid, sum.grid) {
            (Some(a), Some(b)) => Some(a.merged(&b)),
            (a, b) => a.or(b),
        };
        sum.patches.into_iter().for_each(|(number, corners)| all.patches[number].extend(corners));
    }
    // Differences of f32 in f64, three squares, two sums and a root: each rounds by at most 2^-53
    // relative; 2^-40 covers them, the f32 above it covers the last rounding.
    all.radius = ((squared.sqrt() * (1.0 + 2f64.powi(-40))) as f32).next_up();
    Ok(all)
}

/// True if the three corners lie on a line, decided exactly: the cross product of two edges has
/// components that are sums of products of f32 differences, each a 2-by-2 orientation.
fn is_degenerate(triangle: &Corners) -> bool {
    let [a, b, c] = triangle.map(|corner| corner.map(f64::from));
    [(0, 1), (1, 2), (2, 0)].into_iter().all(|(x, y)| {
        let point = |p: [f64; 3]| robust::Coord { x: p[x], y: p[y] };
        robust::orient2d(point(a), point(b), point(c)) == 0.0
    })
}
