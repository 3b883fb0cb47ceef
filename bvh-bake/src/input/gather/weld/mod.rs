//! Welds the vertices of an object: each goes to the position of the first vertex within a distance of it.
//!
//! Vertices are positions. They are numbered in the order in which triangles, by ascending ids, and their corners first use
//! them. Each vertex goes to the position of the vertex with the smallest number among those within the distance, itself
//! included. Positions are as given, before any move, so that welding is not transitive: of three vertices in a row, the third
//! goes to the place of the second, from which the second has gone to the first. [`Reach`] defines "within" by operations that
//! give the same result everywhere.
//!
//! The work is divided such that no step has more of the mesh in memory than the budget allows:
//!
//! 1. Each part of the triangles lists its distinct vertices, once for each cell from which they can be reached (`cells`).
//! 2. These records are sorted by cell. What a cell lists decides where the vertices inside it go (`first`).
//! 3. The vertices that move are sorted by the part that uses them, and each part is written anew.
//!
//! Only the order of the records depends on cells and parts. The result is defined by the vertices alone, so it has the same
//! bits for any number of threads and any budget.

mod cells;
mod first;

use crate::error::{BakeError, excerpt};
use crate::storage::Spill;
use crate::storage::external_sort::{Ahead, Sorter};
use crate::storage::resources::Resources;
use crate::threads;
use crate::triangles::placement::{Extent, Moved};
use crate::triangles::{Part, TRIANGLES_PER_PART, Triangle, WideTriangle};
use bvh_format::vec3::subtract;
use bytemuck::{Pod, Zeroable};
use cells::{BYTES_PER_USE, Cells};
use first::Reach;
use std::borrow::Cow;
use std::collections::HashMap;

/// The bits of a position, in which no zero is negative, so that equal positions have equal bits.
type Bits = [u64; 3];

/// The corners of a full part.
const CORNERS_PER_PART: u64 = 3 * TRIANGLES_PER_PART as u64;

/// Triangles whose vertices have been welded.
pub(crate) struct Welded {
    pub(crate) parts: Vec<Part>,
    pub(crate) extent: Extent,
    /// Whether all triangles are points.
    pub(crate) is_cloud: bool,
    /// How far vertices moved.
    pub(crate) moved: Moved,
}

/// What is sorted: a vertex in the list of a cell, and later the move of a vertex. One type for both, so that the code that sorts exists
/// once.
#[derive(Clone, Copy, Pod, Zeroable, PartialEq, Eq, PartialOrd, Ord)]
#[repr(C)]
struct Record {
    /// The cell; for a move, the corner.
    key: u64,
    /// The position of the vertex; for a move, where it goes.
    position: Bits,
    /// The first corner of a part that uses the vertex, counted from the first corner of the object.
    corner: u64,
}

/// Triangles that are not in a gatherer, which are welded by themselves.
pub(crate) struct Unwelded {
    parts: Vec<Part>,
    open: Vec<WideTriangle>,
    extent: Extent,
    is_cloud: bool,
}

impl Unwelded {
    pub(crate) fn new() -> Self {
        Self { parts: Vec::new(), open: Vec::new(), extent: Extent::EMPTY, is_cloud: true }
    }

    /// Adds a triangle. Ids must ascend. Records in `moved` how far its corners are moved to multiples of the least unit.
    pub(crate) fn add(
        &mut self,
        mut triangle: WideTriangle,
        moved: &mut Moved,
        spill: &Spill,
    ) -> Result<(), BakeError> {
        if self.open.len() == TRIANGLES_PER_PART {
            self.parts.push(super::part(std::mem::take(&mut self.open), spill)?);
        }
        self.is_cloud &= self.extent.add_triangle(&mut triangle.corners, moved);
        self.open.push(triangle);
        Ok(())
    }

    /// Welds the triangles, of which there is at least one.
    pub(crate) fn weld(
        mut self,
        distance: f64,
        object: &str,
        resources: &Resources,
        spill: &Spill,
    ) -> Result<Welded, BakeError> {
        let is_welded = check(distance, object, self.extent.diagonal())?;
        self.parts.push(super::part(self.open, spill)?);
        if is_welded {
            return weld(self.parts, &self.extent, self.is_cloud, distance, resources, spill);
        }
        Ok(Welded {
            parts: self.parts,
            extent: self.extent,
            is_cloud: self.is_cloud,
            moved: Moved::default(),
        })
    }
}

/// Checks that a distance is a finite length.
///
/// # Errors
/// [`BakeError::Weld`] if it is not.
pub(crate) fn check_length(distance: f64) -> Result<(), BakeError> {
    if distance >= 0.0 && distance.is_finite() {
        return Ok(());
    }
    Err(BakeError::Weld { object: String::new(), found: distance, diagonal: None })
}

/// Checks the distance for an object whose box has this diagonal, and returns whether it welds anything. An object of diagonal 0
/// has one vertex.
///
/// # Errors
/// [`BakeError::Weld`] if the distance is no finite length, or exceeds the diagonal.
pub(crate) fn check(distance: f64, object: &str, diagonal: f64) -> Result<bool, BakeError> {
    check_length(distance)?;
    if distance > diagonal && diagonal > 0.0 {
        let object = excerpt(object.as_bytes());
        return Err(BakeError::Weld { object, found: distance, diagonal: Some(diagonal) });
    }
    Ok(distance > 0.0 && diagonal > 0.0)
}

/// Welds the vertices of an object. All parts but the last are full, and `extent` is that of their corners. The distance is above
/// 0 and at most the diagonal of the extent.
pub(crate) fn weld(
    parts: Vec<Part>,
    extent: &Extent,
    is_cloud: bool,
    distance: f64,
    resources: &Resources,
    spill: &Spill,
) -> Result<Welded, BakeError> {
    let count = parts.len() as u64 * TRIANGLES_PER_PART as u64;
    let cells = Cells::new(extent, distance, count);
    let mut uses = Sorter::of_runs(resources.sorted_at_once::<Record>(u64::MAX));
    let batch = 4 * threads::current_num_threads();
    for start in (0..parts.len()).step_by(batch) {
        let list =
            |number: usize| Ok::<_, BakeError>(cells.list(&vertices(&wide(&parts[number])?, number as u64)));
        for listed in threads::map(start..(start + batch).min(parts.len()), list) {
            uses.extend(&listed?, spill)?;
        }
    }
    let mut moves = Sorter::of_runs(resources.sorted_at_once::<Record>(u64::MAX));
    let most = resources.sorted_at_once::<[u8; BYTES_PER_USE]>(u64::MAX);
    cells.first_vertices(uses, &Reach::new(distance), most, spill, &mut moves)?;
    if moves.count() == 0 {
        return Ok(Welded { parts, extent: *extent, is_cloud, moved: Moved::default() });
    }
    let moves = moves.finish();
    let mut moves = Ahead::of(&moves)?;
    let mut welded =
        Welded { parts: Vec::new(), extent: Extent::EMPTY, is_cloud: true, moved: Moved::default() };
    let (mut parts, mut number) = (parts.into_iter(), 0);
    loop {
        let mut numbered = Vec::new();
        for part in parts.by_ref().take(batch) {
            number += 1;
            let mut own = Vec::new();
            while let Some(next) = moves.next_if(|next| next.corner < number * CORNERS_PER_PART)? {
                own.push(next);
            }
            numbered.push((part, own));
        }
        if numbered.is_empty() {
            return Ok(welded);
        }
        for part in threads::map(numbered, |(part, moves)| moved_part(part, &moves, spill)) {
            let Welded { mut parts, extent, is_cloud, moved } = part?;
            welded.parts.append(&mut parts);
            welded.extent = welded.extent.joined(extent);
            welded.is_cloud &= is_cloud;
            welded.moved = welded.moved.joined(moved);
        }
    }
}

/// Returns the triangles of a part in `f64` numbers.
pub(crate) fn wide(part: &Part) -> Result<Cow<'_, [WideTriangle]>, BakeError> {
    Ok(match part {
        Part::Wide(piece) => piece.all()?,
        Part::Narrow(piece) => {
            let widen = |triangle: &Triangle| WideTriangle {
                corners: triangle.corners.map(|corner| corner.map(f64::from)),
                id: triangle.id,
                spare: 0,
            };
            piece.all()?.iter().map(widen).collect()
        }
    })
}

fn bits(position: [f64; 3]) -> Bits {
    // -0.0 + 0.0 is 0.0; every other number stays as it is.
    position.map(|value| (value + 0.0).to_bits())
}

/// Returns the distinct vertices of part `number`, each with the first of its corners.
fn vertices(triangles: &[WideTriangle], number: u64) -> Vec<(Bits, u64)> {
    let mut seen = HashMap::with_capacity(triangles.len());
    let mut vertices = Vec::with_capacity(triangles.len());
    let corners = triangles.iter().flat_map(|triangle| triangle.corners);
    for (corner, place) in corners.zip(number * CORNERS_PER_PART..) {
        let position = bits(corner);
        if seen.insert(position, position).is_none() {
            vertices.push((position, place));
        }
    }
    vertices
}

/// Returns a part with its vertices moved. `moves` are those of the part.
fn moved_part(part: Part, moves: &[Record], spill: &Spill) -> Result<Welded, BakeError> {
    let all = wide(&part)?;
    let mut welded =
        Welded { parts: Vec::new(), extent: Extent::EMPTY, is_cloud: true, moved: Moved::default() };
    // Vertices are multiples of the least unit before they are welded.
    let unmoved = &mut Moved::default();
    if moves.is_empty() {
        for triangle in all.iter() {
            welded.is_cloud &= welded.extent.add_triangle(&mut triangle.corners.clone(), unmoved);
        }
        drop(all);
        welded.parts.push(part);
        return Ok(welded);
    }
    let mut all = all.into_owned();
    drop(part);
    let mut places = HashMap::with_capacity(moves.len());
    for moved in moves {
        let place = (moved.corner % CORNERS_PER_PART) as usize;
        let (from, to) = (all[place / 3].corners[place % 3], moved.position.map(f64::from_bits));
        welded.moved.record_rounding(subtract(from, to));
        places.insert(bits(from), moved.position);
    }
    for triangle in &mut all {
        for corner in &mut triangle.corners {
            if let Some(to) = places.get(&bits(*corner)) {
                *corner = to.map(f64::from_bits);
            }
        }
        welded.is_cloud &= welded.extent.add_triangle(&mut triangle.corners, unmoved);
    }
    welded.parts.push(super::part(all, spill)?);
    Ok(welded)
}
