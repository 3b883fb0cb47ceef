//! Compares what a file states about its surfaces with the triangles of the mesh: which objects are closed, and the nets
//! of triangles whose duplicates were left out.
//!
//! The edges of all triangles are sorted, each with how often it is traversed. This shares nothing with the baker, which
//! cancels edges part by part, nor with the check of rule 48, which adds up their checksums.

use super::VerifyError;
use crate::storage::Spill;
use crate::storage::external_sort::{Ahead, Sorter};
use crate::storage::resources::Resources;
use bvh_format::Layout;
use bvh_format::source::Source;
use bvh_format::topology::ObjectTopology;
use bytemuck::{Pod, Zeroable};

/// The traversals of an edge by triangles of an object.
#[derive(Clone, Copy, Pod, Zeroable, PartialEq, Eq, PartialOrd, Ord)]
#[repr(C)]
struct Traversals {
    object: u64,
    /// The bits of both ends, the lesser one first.
    ends: [[u64; 3]; 2],
    /// How often it is traversed from the first end to the second one, less how often the other way.
    count: i64,
}

/// The duplicates of a triangle.
#[derive(Clone, Copy, Pod, Zeroable, PartialEq, Eq, PartialOrd, Ord)]
#[repr(C)]
struct Duplicates {
    object: u32,
    place: u32,
    /// The number of duplicates with its orientation, less that of the others.
    count: i32,
}

/// The triangles of the mesh, while they are compared one after the other, if the file states anything about surfaces.
pub(super) struct Surfaces {
    stated: Vec<ObjectTopology>,
    edges: Sorter<Traversals>,
    duplicates: Sorter<Duplicates>,
    spill: Spill,
}

impl Surfaces {
    pub(super) fn new<S: Source + ?Sized>(
        layout: &Layout,
        source: &S,
        resources: &Resources,
    ) -> Result<Self, S::Error> {
        // The sorters of triangles have their buffers at the same time.
        let run = resources.sorted_at_once::<Traversals>(u64::MAX) / 2;
        Ok(Self {
            stated: layout.read_topology(source)?,
            edges: Sorter::of_runs(run),
            duplicates: Sorter::of_runs(run),
            spill: resources.scratch.spill(),
        })
    }

    /// Adds a stored triangle, `count` times.
    pub(super) fn add(
        &mut self,
        object: u32,
        corners: &[[f64; 3]; 3],
        count: i32,
    ) -> Result<(), VerifyError> {
        if self.stated.is_empty() {
            return Ok(());
        }
        // -0.0 + 0.0 is 0.0; every other number stays as it is.
        let [a, b, c] = corners.map(|corner| corner.map(|value| (value + 0.0).to_bits()));
        for (from, to) in [(a, b), (b, c), (c, a)] {
            let count = if from < to { count } else { -count };
            if from != to {
                let ends = [from.min(to), from.max(to)];
                let edge = Traversals { object: object.into(), ends, count: count.into() };
                self.edges.extend(&[edge], &self.spill)?;
            }
        }
        Ok(())
    }

    /// Adds duplicates of the triangle that is stored at a place: `count` more with its orientation than with the
    /// opposite one.
    pub(super) fn add_duplicates(
        &mut self,
        object: u32,
        place: u32,
        corners: &[[f64; 3]; 3],
        count: i32,
    ) -> Result<(), VerifyError> {
        self.duplicates.extend(&[Duplicates { object, place, count }], &self.spill)?;
        self.add(object, corners, count)
    }

    /// Compares all of them with what the file states.
    pub(super) fn compare<S: Source + ?Sized>(self, source: &S) -> Result<(), VerifyError>
    where
        VerifyError: From<S::Error>,
    {
        let Self { stated, edges, duplicates, .. } = self;
        let mut closed = vec![true; stated.len()];
        let mut last: Option<Traversals> = None;
        let mut sum = 0i64;
        let mut finish = |last: Option<Traversals>, sum: i64| {
            if let Some(closed) = last.and_then(|last| closed.get_mut(last.object as usize)) {
                *closed &= sum == 0;
            }
        };
        edges.visit(|edge| {
            if last.is_none_or(|last| (last.object, last.ends) != (edge.object, edge.ends)) {
                finish(last, sum);
                sum = 0;
            }
            sum += edge.count;
            last = Some(*edge);
            Ok(())
        })?;
        finish(last, sum);
        let word = |closed| if closed { "closed" } else { "open" };
        for (number, (topology, expected)) in stated.iter().zip(&closed).enumerate() {
            if topology.closed != *expected {
                let what = format!("the surface of object {number}");
                return Err(VerifyError::differs(what, word(*expected), word(topology.closed)));
            }
        }
        let duplicates = duplicates.finish();
        let mut duplicates = Ahead::of(&duplicates)?;
        for (number, topology) in (0..).zip(&stated) {
            topology.visit_nets(source, |listed| {
                let found = Some((listed.place.get(), i64::from(listed.net.get())));
                differ(number, next_net(&mut duplicates, number)?, found)
            })?;
            differ(number, next_net(&mut duplicates, number)?, None)?;
        }
        Ok(())
    }
}

/// Returns an error unless the next net of an object and that in the file are the same.
fn differ(number: u32, expected: Option<(u32, i64)>, found: Option<(u32, i64)>) -> Result<(), VerifyError> {
    let text = |net: Option<(u32, i64)>| {
        net.map_or("no further net".to_owned(), |(place, net)| format!("{net} at place {place}"))
    };
    if expected == found {
        return Ok(());
    }
    Err(VerifyError::differs(format!("the nets of object {number}"), text(expected), text(found)))
}

/// Returns the place and the net of the next triangle of an object whose net is not 1. Skips earlier objects.
fn next_net(duplicates: &mut Ahead<Duplicates>, object: u32) -> Result<Option<(u32, i64)>, VerifyError> {
    while let Some(first) = duplicates.next_if(|next| next.object <= object)? {
        let mut net = 1 + i64::from(first.count);
        while let Some(same) =
            duplicates.next_if(|next| (next.object, next.place) == (first.object, first.place))?
        {
            net += i64::from(same.count);
        }
        if first.object == object && net != 1 {
            return Ok(Some((first.place, net)));
        }
    }
    Ok(None)
}
