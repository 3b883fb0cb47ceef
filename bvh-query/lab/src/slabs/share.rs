//! How narrow slabs are: the share of children whose slab is narrower than a part of what their box reaches along it.

use super::walk::Slabbed;
use cbvh_measure::table::{Cell, Cells};

/// The parts.
pub(super) const PARTS: [f64; 3] = [0.75, 0.5, 0.25];
/// The most triangles below the children of a row.
const MOST: [u32; 7] = [4, 16, 64, 256, 1024, 4096, u32::MAX];

/// Children of one mesh and one size.
#[derive(Debug, Clone)]
pub(super) struct Share {
    pub(super) mesh: String,
    /// The most triangles below; the next smaller row has those with fewer.
    pub(super) most_triangles: u32,
    pub(super) children: u64,
    /// How many slabs are narrower than each part.
    pub(super) narrower: [u64; 3],
}

impl Share {
    /// Returns the rows of a mesh.
    pub(super) fn of_mesh(mesh: &str, body: Slabbed<'_>) -> Vec<Self> {
        let row = |&most_triangles: &u32| Self {
            mesh: mesh.to_owned(),
            most_triangles,
            children: 0,
            narrower: [0; 3],
        };
        let mut rows: Vec<Self> = MOST.iter().map(row).collect();
        for (node, slab) in body.tree.nodes.iter().zip(body.slabs) {
            let Some(slab) = slab else { continue };
            let Some(row) = rows.iter_mut().find(|row| node.below <= row.most_triangles) else { continue };
            row.children += 1;
            for (count, part) in row.narrower.iter_mut().zip(PARTS) {
                *count += u64::from(slab.share < part);
            }
        }
        rows
    }

    /// Returns the sum of rows.
    pub(super) fn sum<'a>(rows: impl Iterator<Item = &'a Self>) -> (u64, [u64; 3]) {
        rows.fold((0, [0; 3]), |(children, narrower), row| {
            (children + row.children, [0, 1, 2].map(|part| narrower[part] + row.narrower[part]))
        })
    }
}

impl Cells for Share {
    fn cells(&self) -> Vec<(&'static str, Cell)> {
        let most = (self.most_triangles < u32::MAX).then_some(u64::from(self.most_triangles));
        vec![
            ("mesh", Cell::text(&self.mesh)),
            ("most_triangles", Cell::count(most)),
            ("children", Cell::Count(self.children)),
            ("narrower_than_0.75", Cell::Count(self.narrower[0])),
            ("narrower_than_0.5", Cell::Count(self.narrower[1])),
            ("narrower_than_0.25", Cell::Count(self.narrower[2])),
        ]
    }
}
