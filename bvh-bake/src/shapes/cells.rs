//! The surface of full cells of a grid or of an octree.
//!
//! A face of a cell is left out where a full cell covers it. Where smaller cells cover parts of it, the rest is divided into
//! squares like the cells of the octree. An edge of a square is divided at all corners of squares that lie on it. Edges then
//! cancel wherever large and small cells meet, so the surface is closed.

use super::check;
use crate::error::ShapeError;
use crate::input::mesh::Mesh;
use std::collections::{HashMap, HashSet};

/// A place on the grid of the finest cells, or on a coarser one.
type Place = [i64; 3];

/// A full cell of an octree.
///
/// ```
/// use bvh_bake::shapes::{OctreeCell, octree};
///
/// // A cube with sides of two of the finest cells, and one of these beside it.
/// let cells = [OctreeCell { corner: [0, 0, 0], size: 2 }, OctreeCell { corner: [2, 0, 0], size: 1 }];
/// let surface = octree(&cells, 0.5)?;
/// assert!(surface.objects[0].positions.contains(&[1.5, 0.0, 0.0]));
/// # Ok::<(), bvh_bake::ShapeError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct OctreeCell {
    /// The corner with the least coordinates, in sides of the finest cells: multiples of `size`.
    pub corner: [i32; 3],
    /// The side, in sides of the finest cells: a power of two.
    pub size: u32,
}

/// Makes the surface of full cells of a grid, without the faces between two full cells. Cell (i, j, k) is the cube of this side
/// from (i, j, k) times the side on. A cell that is given twice counts once. The surface is closed and looks outwards.
///
/// # Errors
/// [`ShapeError::Length`] if the side is not finite and above 0.
pub fn voxels(cells: &[[i32; 3]], side: f64) -> Result<Mesh, ShapeError> {
    surface(cells.iter().map(|&corner| OctreeCell { corner, size: 1 }), side)
}

/// Makes the surface of full cells of an octree, without what two of them have in common. `side` is that of the finest cells.
/// A cell that is given twice, or that is part of another one, counts once. The surface is closed and looks outwards. The cost
/// grows with the number of cells and with the number of faces of small cells on large ones.
///
/// # Errors
/// [`ShapeError::Length`] if the side is not finite and above 0, and [`ShapeError::Cell`] if the size of a cell is not a power
/// of two or its corner is not at multiples of it.
pub fn octree(cells: &[OctreeCell], side: f64) -> Result<Mesh, ShapeError> {
    let is_of_octree = |cell: &OctreeCell| {
        cell.size.is_power_of_two() && cell.corner.iter().all(|&at| i64::from(at) % i64::from(cell.size) == 0)
    };
    if let Some(number) = cells.iter().position(|cell| !is_of_octree(cell)) {
        let OctreeCell { corner, size } = cells[number];
        return Err(ShapeError::Cell { number, corner, size });
    }
    surface(cells.iter().copied(), side)
}

/// A square of the surface.
struct Square {
    /// The corner with the least coordinates.
    corner: Place,
    size: i64,
    /// The axis that it is across, and whether it looks along it or against it.
    axis: usize,
    is_along: bool,
}

impl Square {
    /// Returns the corners, counter-clockwise as seen from outside.
    fn ring(&self) -> [Place; 4] {
        let (u, v) = ((self.axis + 1) % 3, (self.axis + 2) % 3);
        let order =
            if self.is_along { [(0, 0), (1, 0), (1, 1), (0, 1)] } else { [(0, 0), (0, 1), (1, 1), (1, 0)] };
        order.map(|(along_u, along_v)| {
            let mut corner = self.corner;
            corner[u] += along_u * self.size;
            corner[v] += along_v * self.size;
            corner
        })
    }
}

/// Cells by level, 0 for the finest, and place on the grid of the level.
#[derive(Default)]
struct Octree {
    full: HashSet<(u32, Place)>,
    /// Cells that are not full and have parts that are.
    divided: HashSet<(u32, Place)>,
    levels: u32,
}

impl Octree {
    /// Returns whether a full cell has this one as a part.
    fn is_within(&self, level: u32, place: Place) -> bool {
        (level + 1..self.levels)
            .any(|above| self.full.contains(&(above, place.map(|at| at >> (above - level)))))
    }

    /// Lists the parts of a cell that leave free the face which it shows along an axis, as large as they can be. Returns
    /// whether the whole face is free. `near` is 0 for the face at the least coordinate, 1 for the other one.
    fn free(&self, level: u32, place: Place, axis: usize, near: i64, found: &mut Vec<(u32, Place)>) -> bool {
        if self.full.contains(&(level, place)) {
            return false;
        }
        let before = found.len();
        let mut is_free = true;
        if self.divided.contains(&(level, place)) {
            for quarter in 0..4 {
                let mut part = place.map(|at| 2 * at);
                part[axis] += near;
                part[(axis + 1) % 3] += quarter & 1;
                part[(axis + 2) % 3] += quarter >> 1;
                is_free &= self.free(level - 1, part, axis, near, found);
            }
        }
        if is_free {
            found.truncate(before);
            found.push((level, place));
        }
        is_free
    }
}

/// Makes the surface of cells whose corners are at multiples of their sizes.
fn surface(cells: impl Iterator<Item = OctreeCell>, side: f64) -> Result<Mesh, ShapeError> {
    check("side", side)?;
    let mut octree = Octree::default();
    let mut ordered: Vec<(u32, Place)> = Vec::new();
    for OctreeCell { corner, size } in cells {
        let level = size.trailing_zeros();
        ordered.push((level, corner.map(|at| i64::from(at) >> level)));
        octree.levels = octree.levels.max(level + 1);
    }
    ordered.sort_unstable();
    ordered.dedup();
    octree.full = ordered.iter().copied().collect();
    ordered.retain(|&(level, place)| !octree.is_within(level, place));
    for &(level, place) in &ordered {
        let ancestors =
            (level + 1..octree.levels).map(|above| (above, place.map(|at| at >> (above - level))));
        for ancestor in ancestors {
            if !octree.divided.insert(ancestor) {
                break;
            }
        }
    }
    let (mut squares, mut free) = (Vec::new(), Vec::new());
    for &(level, place) in &ordered {
        for axis in 0..3 {
            for is_along in [false, true] {
                let mut neighbour = place;
                neighbour[axis] += if is_along { 1 } else { -1 };
                if octree.is_within(level, neighbour) {
                    continue;
                }
                octree.free(level, neighbour, axis, i64::from(!is_along), &mut free);
                squares.extend(free.drain(..).map(|(level, mut place)| {
                    place[axis] += i64::from(!is_along);
                    Square { corner: place.map(|at| at << level), size: 1 << level, axis, is_along }
                }));
            }
        }
    }
    Ok(triangulated(&squares, side))
}

/// Divides squares into triangles whose edges cancel.
fn triangulated(squares: &[Square], side: f64) -> Mesh {
    // The corners on the lines along each axis, in order. The coordinate along the line comes last.
    let turned = |at: Place, axis: usize| [at[(axis + 1) % 3], at[(axis + 2) % 3], at[axis]];
    let lines = [0, 1, 2].map(|axis| {
        let mut corners: Vec<Place> = Vec::new();
        // Nothing is between the ends of the shortest edges.
        if squares.iter().any(|square| square.size > 1) {
            corners.extend(squares.iter().flat_map(Square::ring).map(|corner| turned(corner, axis)));
            corners.sort_unstable();
            corners.dedup();
        }
        corners
    });
    let (mut numbers, mut positions, mut triangles) = (HashMap::new(), Vec::new(), Vec::new());
    let mut number = |corner: Place| {
        *numbers.entry(corner).or_insert_with(|| {
            positions.push(corner.map(|at| at as f64 * side));
            positions.len() as u32 - 1
        })
    };
    let mut ring = Vec::new();
    for square in squares {
        ring.clear();
        let corners = square.ring();
        for edge in 0..4 {
            let (from, to) = (corners[edge], corners[(edge + 1) % 4]);
            ring.push(number(from));
            if square.size == 1 {
                continue;
            }
            let axis = (0..3).find(|&axis| from[axis] != to[axis]).unwrap_or(0);
            let line = &lines[axis];
            let (least, most) = (from.min(to), from.max(to));
            let first = line.partition_point(|corner| *corner <= turned(least, axis));
            let last = line.partition_point(|corner| *corner < turned(most, axis));
            let between = line[first..last].iter().map(|corner| {
                let mut at = from;
                at[axis] = corner[2];
                at
            });
            if from == least {
                ring.extend(between.map(&mut number));
            } else {
                ring.extend(between.rev().map(&mut number));
            }
        }
        if let [a, b, c, d] = ring[..] {
            triangles.extend([[a, b, c], [a, c, d]]);
        } else {
            // Its size is not 1, so its middle is on the grid.
            let middle = number([0, 1, 2].map(|axis| (corners[0][axis] + corners[2][axis]) / 2));
            triangles.extend((0..ring.len()).map(|k| [middle, ring[k], ring[(k + 1) % ring.len()]]));
        }
    }
    Mesh::from_triangles(positions, triangles)
}

#[cfg(test)]
mod tests {
    use super::super::tests::volume;
    use super::*;

    /// Random cells of an octree of this many levels: full ones, some of them twice, and some parts of full ones.
    fn random(random: &mut cbvh_testkit::Random, levels: usize) -> Vec<OctreeCell> {
        (0..1 + random.below(30))
            .map(|_| {
                let size = 1 << random.below(levels);
                let corner = [0; 3].map(|_: i32| (random.below(32) as i32 - 16) / size * size);
                OctreeCell { corner, size: size as u32 }
            })
            .collect()
    }

    /// The finest cells that are full.
    fn finest(cells: &[OctreeCell]) -> HashSet<[i32; 3]> {
        let parts = |cell: &OctreeCell| {
            let (corner, size) = (cell.corner, cell.size as i32);
            (0..size.pow(3)).map(move |k| {
                [corner[0] + k % size, corner[1] + k / size % size, corner[2] + k / size / size]
            })
        };
        cells.iter().flat_map(parts).collect()
    }

    /// The squares of the grid that triangles cover, by twice the area in each direction.
    fn areas(mesh: &Mesh) -> [f64; 6] {
        let object = &mesh.objects[0];
        let mut areas = [0.0; 6];
        for triangle in &object.triangles {
            let [p, q, r] = triangle.map(|number| object.positions[number as usize]);
            let (e, f) = ([0, 1, 2].map(|k| q[k] - p[k]), [0, 1, 2].map(|k| r[k] - p[k]));
            let normal = [0, 1, 2].map(|k| e[(k + 1) % 3] * f[(k + 2) % 3] - e[(k + 2) % 3] * f[(k + 1) % 3]);
            let across: Vec<usize> = (0..3).filter(|&k| normal[k] != 0.0).collect();
            assert_eq!(across.len(), 1, "a triangle has an area and is across an axis");
            areas[2 * across[0] + usize::from(normal[across[0]] > 0.0)] += normal[across[0]].abs();
        }
        areas
    }

    #[test]
    fn cells_of_any_size_have_the_surface_of_their_finest_parts() {
        let mut numbers = cbvh_testkit::Random::new(5);
        for round in 0..400 {
            let cells = random(&mut numbers, 1 + round % 5);
            let full = finest(&cells);
            let mesh = octree(&cells, 1.0).unwrap();
            assert_eq!(volume(&mesh), full.len() as f64);
            let fine = voxels(&full.iter().copied().collect::<Vec<_>>(), 1.0).unwrap();
            assert_eq!(areas(&mesh), areas(&fine));
            assert!(mesh.triangle_count() <= 2 * fine.triangle_count());
        }
    }

    #[test]
    fn large_cells_stay_large() {
        let large = OctreeCell { corner: [0; 3], size: 1 << 30 };
        assert_eq!(octree(&[large, large], 0.5).unwrap().triangle_count(), 12);
        // Nor does a part of the same cell count.
        let part = OctreeCell { corner: [4, 8, 12], size: 4 };
        assert_eq!(octree(&[part, large], 0.5).unwrap().triangle_count(), 12);
        // One beside it hides a square of it. The other squares grow with the distance from that one.
        let beside = OctreeCell { corner: [-1, 1 << 20, 1 << 21], size: 1 };
        let mesh = octree(&[large, beside], 0.5).unwrap();
        assert!(mesh.triangle_count() < 1000, "{}", mesh.triangle_count());
        assert!(volume(&mesh) > 0.0);
        // One that touches along an edge only divides that edge.
        let along = OctreeCell { corner: [-1, -1, 7], size: 1 };
        let mesh = octree(&[large, along], 0.5).unwrap();
        assert_eq!(mesh.triangle_count(), 4 * 2 + 2 * 6 + 12);
        assert!(volume(&mesh) > 0.0);
    }

    #[test]
    fn what_is_no_cell_of_an_octree_is_refused() {
        for (corner, size) in
            [([0; 3], 0), ([0; 3], 3), ([2, 0, 0], 4), ([0, 0, -1], 2), ([i32::MIN, 0, 1], 1 << 31)]
        {
            let cells = [OctreeCell { corner: [0; 3], size: 1 }, OctreeCell { corner, size }];
            assert_eq!(octree(&cells, 1.0), Err(ShapeError::Cell { number: 1, corner, size }));
        }
        assert!(octree(&[OctreeCell { corner: [i32::MIN; 3], size: 1 << 31 }], 1.0).is_ok());
        assert_eq!(octree(&[], 1.0).unwrap().triangle_count(), 0);
    }
}
