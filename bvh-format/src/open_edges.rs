//! The open edges of an object: why it is not closed, where, and within which distance a weld would close it.
//!
//! An object is closed if its triangles traverse each edge as often in one direction as in the other, each triangle as often as
//! its net says (section 3.2 of `spec/format.md`). An edge for which this does not hold is *open*. A triangle whose net is n counts
//! as |n| triangles, turned over if n is negative, so that duplicates count here as they do there. A triangle with two equal corners
//! traverses its edges in both directions and counts nowhere.
//!
//! Counting takes two passes over the pages of an object. The first finds the open edges: most edges cancel within their page
//! ([`uncancelled`]), and the rest is sorted and summed up ([`OpenSet`]). The second collects all triangles at the open edges, which
//! are sorted by edge and classified ([`Classifier`]). [`count`] does this in memory. A baker does the same with sorted files.

mod count;
mod gaps;
mod text;

pub use count::{Classifier, OpenSet, Sums, Traversal, count, edges_of_page, uncancelled};
pub use gaps::{MAX_MEASURED, MAX_NODES_PER_EDGE};

/// The bits of both ends of an edge, in mesh units and without negative zeros, the lesser end first.
type Ends = [u64; 6];

/// The number of open edges that are listed of each kind.
pub const MAX_LISTED: usize = 8;
/// The number of triangles that are listed of each open edge.
pub const MAX_LISTED_TRIANGLES: usize = 4;

/// The open edges of an object or of several. There are none if all objects are closed.
///
/// The text of this type says how many edges of which kind there are, and what to do about them.
///
/// ```
/// use bvh_format::Layout;
/// use bvh_format::open_edges::{OpenEdge, count, edges_of_page};
///
/// # let bytes = std::fs::read(concat!(env!("CARGO_MANIFEST_DIR"), "/../testdata/ok-topology.cbvh"))?;
/// let layout = Layout::read(&bytes)?;
/// let (number, object) = (1, &layout.objects[1]); // a cube without one of its triangles
/// let edges = count(number as u32, object.pages(), 1000, &mut |page| {
///     let page = layout.read_page(&bytes[..], page).ok()?;
///     let page = page.page(object);
///     let (leaves, ids) = (layout.leaf_block(&bytes, page.header()), layout.id_block(&bytes, page.header()));
///     Some(edges_of_page(object, &page, leaves, Some(ids), &|_| 1))
/// });
/// let edges = edges.expect("few edges");
/// assert_eq!((edges.count(), edges.boundary.count), (3, 3)); // the edges of the hole
/// for OpenEdge { ends, triangles, .. } in &edges.boundary.first {
///     println!("triangle {} from {:?} to {:?}", triangles[0], ends[0], ends[1]);
/// }
/// assert_eq!(edges.proposed_weld(), None); // a hole is no crack
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, PartialEq, Default)]
#[non_exhaustive]
pub struct OpenEdges {
    /// The edges of one triangle: the border of a hole, of a sheet, or of a crack.
    pub boundary: EdgesOfKind,
    /// The edges of two triangles that traverse them in the same direction, so that one of the two is turned over.
    pub flipped: EdgesOfKind,
    /// The edges of more than two triangles, of which more traverse them in one direction than in the other.
    pub crowded: EdgesOfKind,
    /// How near edges of one triangle are to other open edges.
    pub gaps: Gaps,
}

/// The open edges of one kind.
///
/// [`OpenEdges`] has an example.
#[derive(Debug, Clone, PartialEq, Default)]
#[non_exhaustive]
pub struct EdgesOfKind {
    /// Their number.
    pub count: u64,
    /// The first [`MAX_LISTED`] of them, by object, then by the smallest number of a triangle, then by the order of the bits of their ends.
    pub first: Vec<OpenEdge>,
}

/// An open edge.
///
/// [`OpenEdges`] has an example.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct OpenEdge {
    /// The number of the object in the file.
    pub object: u32,
    /// The ends in mesh units, in the direction in which more triangles traverse the edge.
    pub ends: [[f64; 3]; 2],
    /// The triangles at the edge, by their ids, or by their places in a file without ids: those with the smallest numbers, at most
    /// [`MAX_LISTED_TRIANGLES`].
    pub triangles: Vec<u32>,
    /// For an edge of one triangle, the distance to the nearest other open edge, as [`Gaps`] defines it; `None` if there is no other
    /// one, if the edge was not measured, or if it has more than one triangle.
    pub gap: Option<f64>,
}

/// How near edges of one triangle are to other open edges of their object.
///
/// The *gap* of an edge is the least distance D, in mesh units, for which another open edge has both its ends within D of those of
/// this edge, each end of one near another end of the other, so that a weld within D may make the two edges one. The gap is the
/// distance of some edge, but another one may be nearer, because a search ends after [`MAX_NODES_PER_EDGE`] nodes. An edge whose gap is
/// less than a hundredth of its length is a *crack*. At larger gaps, the nearest edge may be on the other side of a hole, and a weld
/// would change the shape.
///
/// If an object has more than [`MAX_MEASURED`] open edges, only the first that many are measured, among each other, in the order of the
/// bits of their ends.
///
/// [`Classifier`] has an example.
#[derive(Debug, Clone, PartialEq, Default)]
#[non_exhaustive]
pub struct Gaps {
    /// The least gap of all edges that were measured.
    pub nearest: Option<f64>,
    /// The number of cracks.
    pub cracks: u64,
    /// The greatest gap of a crack.
    pub widest_crack: Option<f64>,
    /// The least length of the edge of a crack.
    pub shortest_crack: Option<f64>,
}

impl OpenEdges {
    /// Returns whether all edges cancel, so that the objects are closed.
    pub fn is_empty(&self) -> bool {
        self.count() == 0
    }

    /// Returns the number of open edges of all kinds.
    pub fn count(&self) -> u64 {
        self.kinds().iter().map(|(_, of_kind)| of_kind.count).sum()
    }

    /// Returns all kinds with their names.
    pub fn kinds(&self) -> [(&'static str, &EdgesOfKind); 3] {
        [("boundary", &self.boundary), ("flipped", &self.flipped), ("crowded", &self.crowded)]
    }

    /// Adds the open edges of an object after those of all objects before it.
    pub fn join(&mut self, other: Self) {
        for (own, other) in [
            (&mut self.boundary, other.boundary),
            (&mut self.flipped, other.flipped),
            (&mut self.crowded, other.crowded),
        ] {
            own.count += other.count;
            let room = MAX_LISTED.saturating_sub(own.first.len());
            own.first.extend(other.first.into_iter().take(room));
        }
        let (gaps, other) = (&mut self.gaps, other.gaps);
        let least = |a: Option<f64>, b: Option<f64>| a.into_iter().chain(b).reduce(f64::min);
        gaps.nearest = least(gaps.nearest, other.nearest);
        gaps.cracks += other.cracks;
        gaps.widest_crack = gaps.widest_crack.into_iter().chain(other.widest_crack).reduce(f64::max);
        gaps.shortest_crack = least(gaps.shortest_crack, other.shortest_crack);
    }

    /// Returns a distance within which a weld should close all cracks, if there are any: the least power of ten that is at least twice
    /// the widest crack, or else twice the widest crack, whichever is less than half of the length of each edge of a crack. Twice,
    /// because a weld is not transitive and more than two edges may meet in a crack.
    ///
    /// It is a proposal. Smaller details of the mesh than this distance collapse, and a weld may leave a crack open, because each
    /// vertex goes to the first of those within the distance. The bake with the weld states whether the objects are closed.
    pub fn proposed_weld(&self) -> Option<f64> {
        let (widest, shortest) = (self.gaps.widest_crack?, self.gaps.shortest_crack?);
        let distances = [power_of_ten_above(2.0 * widest), 2.0 * widest];
        distances.into_iter().find(|distance| *distance > 0.0 && *distance < shortest / 2.0)
    }
}

/// Returns the least power of ten that is at least a positive number.
fn power_of_ten_above(value: f64) -> f64 {
    // The shortest decimal gives the exponent without a logarithm, which could differ between platforms.
    let decimal = format!("{value:e}");
    let (digits, exponent) = decimal.split_once('e').unwrap_or(("1", "0"));
    let exponent = exponent.parse::<i32>().unwrap_or(0) + i32::from(digits != "1");
    format!("1e{exponent}").parse().unwrap_or(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn powers_of_ten_are_the_next_ones() {
        for (value, power) in [
            (1.0, 1.0),
            (1.1, 10.0),
            (0.999, 1.0),
            (1e-15, 1e-15),
            (2.4e-16, 1e-15),
            (1.000_000_1e-15, 1e-14),
            (5e-324, 1e-323),
            (3e35, 1e36),
        ] {
            assert_eq!(power_of_ten_above(value), power, "{value:e}");
        }
    }
}
