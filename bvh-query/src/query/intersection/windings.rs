//! How often the other mesh winds around the vertices of a surface.

use crate::error::QueryError;
use crate::query::intersection::cuts::EdgeCut;
use crate::query::intersection::surface::Surface;
use crate::query::probe::placed::PlacedShape;
use crate::query::querier::Querier;
use bvh_format::{FormatError, Rule};
use std::collections::HashMap;

impl Querier {
    /// Returns how often another mesh winds around each vertex of a surface. `sign` tells which way vertices are moved: 1 for those
    /// of A, -1 for those of B.
    ///
    /// Along an edge the number changes where the edge passes through a triangle. So one vertex of each connected part is asked about.
    pub(super) fn windings(
        &mut self,
        surface: &Surface,
        cuts: &[EdgeCut],
        other: &PlacedShape<'_>,
        sign: f64,
    ) -> Result<Vec<i64>, QueryError> {
        let mut linked = Linked::new(surface.points.len());
        let mut agree = true;
        for face in &surface.faces {
            let [a, b, c] = face.corners;
            for (from, to) in [(a, b), (b, c), (c, a)] {
                let passed = if face.is_cut { EdgeCut::between(cuts, from, to) } else { &[] };
                let rise: i64 = passed.iter().map(|cut| cut.rise).sum();
                agree &= linked.link(from, to, if from < to { rise } else { -rise });
            }
        }
        let mut known = HashMap::new();
        let mut windings = Vec::with_capacity(surface.points.len());
        for vertex in 0..surface.points.len() as u32 {
            let (root, above) = linked.find(vertex);
            let of_root = match known.get(&root) {
                Some(winding) => *winding,
                None => {
                    let winding = self.winding_beside(other, &surface.points[root as usize], sign)?;
                    *known.entry(root).or_insert(winding)
                }
            };
            windings.push(of_root + above);
        }
        if agree {
            return Ok(windings);
        }
        // Around a closed surface, every way to a vertex leads to the same number.
        let expected = "closed objects, as it says";
        Err(FormatError::new(Rule::TopologyClosed, 0, expected, "open edges").into())
    }
}

/// Numbers that are known but for one for each set: a union-find structure with differences.
struct Linked {
    parents: Vec<u32>,
    /// The number of each element less that of its parent.
    above: Vec<i64>,
}

impl Linked {
    fn new(count: usize) -> Self {
        Self { parents: (0..count as u32).collect(), above: vec![0; count] }
    }

    /// Returns the root of an element, and the element's number less that of the root.
    fn find(&mut self, element: u32) -> (u32, i64) {
        let (mut root, mut total) = (element, 0);
        while self.parents[root as usize] != root {
            total += self.above[root as usize];
            root = self.parents[root as usize];
        }
        let (mut at, mut rest) = (element, total);
        while at != root {
            let next = std::mem::replace(&mut self.parents[at as usize], root);
            rest -= std::mem::replace(&mut self.above[at as usize], rest);
            at = next;
        }
        (root, total)
    }

    /// States that the number of `to` is that of `from` and `rise`, and returns whether this agrees with what was stated before.
    fn link(&mut self, from: u32, to: u32, rise: i64) -> bool {
        let ((root, above), (other, of_other)) = (self.find(from), self.find(to));
        if root == other {
            return of_other == above + rise;
        }
        // The lesser one stays a root, so that answers do not depend on the order of statements.
        let difference = above + rise - of_other;
        let (parent, child, difference) =
            if root < other { (root, other, difference) } else { (other, root, -difference) };
        self.parents[child as usize] = parent;
        self.above[child as usize] = difference;
        true
    }
}
