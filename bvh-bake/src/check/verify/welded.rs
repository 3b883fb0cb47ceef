//! Welds the mesh that a file is compared with, by the distance that the file's provenance states.
//!
//! This uses the weld of the bake, which the tests of bakes compare with brute force. Corners are welded where the input has them,
//! so the comparison that follows measures the other moves alone.

use super::input::{Input, InputCorners};
use super::{VerifyError, source_of, tolerance};
use crate::check::provenance::{text_of, value_of};
use crate::input::gather::weld::{Unwelded, Welded, wide};
use crate::input::mesh::Instance;
use crate::options::Rounding;
use crate::storage::external_sort::{Ahead, Sorted, Sorter};
use crate::storage::resources::Resources;
use crate::triangles::WideTriangle;
use crate::triangles::placement::Moved;
use bvh_format::Layout;
use bvh_format::source::Source;
use bytemuck::{Pod, Zeroable};
use std::borrow::Cow;

/// A triangle of the mesh.
#[derive(Clone, Copy, Pod, Zeroable, PartialEq, Eq, PartialOrd, Ord)]
#[repr(C)]
struct Row {
    /// The number of the object in the file, and the id. Triangles that are welded come by ids, so that these stand first.
    order: [u32; 2],
    /// The bits of the corners.
    corners: [[u64; 3]; 3],
}

/// Returns how the coordinates of a file were rounded and the distance within which its vertices were welded, as its provenance
/// states it; 0 if they were not.
pub(super) fn stated<S: Source + ?Sized>(layout: &Layout, source: &S) -> Result<(Rounding, f64), S::Error> {
    let text = text_of(layout, source)?.unwrap_or_default();
    let round = value_of(&text, "round").and_then(Rounding::from_name).unwrap_or_default();
    Ok((round, value_of(&text, "weld").and_then(|value| value.parse().ok()).unwrap_or(0.0)))
}

/// The mesh, welded.
pub(super) struct WeldedInput<'a> {
    counts: &'a [u64],
    instances: Cow<'a, [Instance]>,
    /// All triangles, by ascending ids.
    rows: Sorted<Row>,
    /// The largest distance by which a weld moved a vertex, plus that of rounding before it, in mesh units.
    pub(super) moved: f64,
}

impl<'a> WeldedInput<'a> {
    /// Welds each object of the file by itself.
    pub(super) fn new(
        input: &'a impl Input,
        (round, distance): (Rounding, f64),
        layout: &Layout,
        resources: &Resources,
    ) -> Result<Self, VerifyError> {
        let spill = resources.scratch.spill();
        // The sorters of the weld have their buffers at the same time.
        let run = resources.sorted_at_once::<Row>(u64::MAX) / 2;
        let mut given = Sorter::of_runs(run);
        let mut rounded = Moved::default();
        input.visit(&mut |number, id, corners| {
            let object = source_of(layout, number) as u32;
            let corners = corners.map(|corner| round.round(corner, &mut rounded).map(f64::to_bits));
            Ok(given.extend(&[Row { order: [object, id], corners }], &spill)?)
        })?;
        let given = given.finish();
        let mut given = Ahead::of(&given)?;
        let mut rows = Sorter::of_runs(run);
        let mut most = Moved::default();
        for (number, object) in (0..).zip(&layout.objects) {
            let mut triangles = Unwelded::new();
            while let Some(row) = given.next_if(|row| row.order[0] == number)? {
                let corners = row.corners.map(|corner| corner.map(f64::from_bits));
                triangles.add(WideTriangle { corners, id: row.order[1], spare: 0 }, &mut rounded, &spill)?;
            }
            let Welded { parts, moved, .. } = triangles.weld(distance, object.name(), resources, &spill)?;
            for part in parts {
                let row = |triangle: &WideTriangle| Row {
                    order: [triangle.id, number],
                    corners: triangle.corners.map(|corner| corner.map(f64::to_bits)),
                };
                rows.extend(&wide(&part)?.iter().map(row).collect::<Vec<_>>(), &spill)?;
            }
            let stated = tolerance(object);
            if moved.rounding > stated {
                let what = format!("the weld of object {number} within {distance:e}");
                let found = format!("a stated move of at most {stated:e}");
                return Err(VerifyError::differs(what, format!("a move of {:e}", moved.rounding), found));
            }
            most = most.joined(moved);
        }
        Ok(Self {
            counts: input.counts(),
            instances: input.instances(),
            rows: rows.finish(),
            moved: most.rounding + rounded.rounding,
        })
    }
}

impl Input for WeldedInput<'_> {
    fn counts(&self) -> &[u64] {
        self.counts
    }

    fn instances(&self) -> Cow<'_, [Instance]> {
        Cow::Borrowed(&self.instances)
    }

    fn visit(
        &self,
        visit: &mut dyn FnMut(u32, u32, &InputCorners) -> Result<(), VerifyError>,
    ) -> Result<(), VerifyError> {
        let mut rows = self.rows.merge();
        while let Some(row) = rows.next()? {
            visit(row.order[1], row.order[0], &row.corners.map(|corner| corner.map(f64::from_bits)))?;
        }
        Ok(())
    }
}
