//! Computes the right answers for two meshes in a pose, from the oracles over all pairs of triangles.

use super::nearest::Blocks;
use super::tally::Tally;
use super::{Stored, Triangle, placed, size};
use bvh_query::{Contact, Distance, Pose};
use cbvh_testkit::exact::{Boxed, Length, certainly_farther, intersect};

/// A mesh as a file stores it.
pub(crate) struct Surface {
    pub(crate) stored: Vec<Stored>,
    pub(crate) corners: Vec<Triangle>,
}

impl Surface {
    pub(crate) fn new(stored: Vec<Stored>) -> Self {
        let corners = stored.iter().map(|stored| stored.corners).collect();
        Self { stored, corners }
    }

    /// Returns the place in the list of the triangle that an answer names.
    fn find(&self, object: u32, id: u32) -> Option<usize> {
        self.stored.binary_search_by_key(&(object, id), |stored| (stored.object, stored.id)).ok()
    }
}

/// Two meshes, placed by a pose.
pub(crate) struct Truth<'a> {
    a: &'a Surface,
    b: &'a Surface,
    boxed_a: Vec<Boxed>,
    boxed_b: Vec<Boxed>,
    /// The diagonal of the box around both.
    pub(crate) size: f64,
}

impl<'a> Truth<'a> {
    pub(crate) fn new(a: &'a Surface, b: &'a Surface, pose: &Pose) -> Self {
        let corners_b = placed(&b.corners, pose);
        let boxed = |corners: &[Triangle]| corners.iter().map(|&t| Boxed::new(t)).collect();
        let size = size(&a.corners, &corners_b);
        Self { a, b, boxed_a: boxed(&a.corners), boxed_b: boxed(&corners_b), size }
    }

    fn blocks(&self) -> [Blocks; 2] {
        [&self.boxed_a, &self.boxed_b].map(|boxed| Blocks::new(boxed))
    }

    /// Returns whether the meshes meet. `hint` is a pair to try first, and is set to the pair that meets.
    pub(crate) fn collide(&self, hint: &mut (usize, usize), tally: &mut Tally) -> bool {
        if intersect(&self.boxed_a[hint.0], &self.boxed_b[hint.1], &mut tally.decided) {
            return true;
        }
        for (i, a) in self.boxed_a.iter().enumerate() {
            for (j, b) in self.boxed_b.iter().enumerate() {
                if intersect(a, b, &mut tally.decided) {
                    *hint = (i, j);
                    return true;
                }
            }
        }
        false
    }

    fn pair(&self, i: usize, j: usize) -> Contact {
        let (a, b) = (&self.a.stored[i], &self.b.stored[j]);
        Contact { object_a: a.object, triangle_a: a.id, object_b: b.object, triangle_b: b.id }
    }

    /// Returns all pairs in contact, in ascending order.
    pub(crate) fn contacts(&self, tally: &mut Tally) -> Vec<Contact> {
        let [blocks_a, blocks_b] = self.blocks();
        let pairs = blocks_a.contacts(&blocks_b, &mut tally.decided);
        tally.pairs += (self.boxed_a.len() * self.boxed_b.len()) as u64;
        tally.contacts += pairs.len() as u64;
        pairs.into_iter().map(|(i, j)| self.pair(i, j)).collect()
    }

    /// Returns the exact distance of each pair, in ascending order of the pairs.
    pub(crate) fn lengths(&self) -> Vec<(Length, Contact)> {
        let mut lengths = Vec::new();
        for (i, a) in self.boxed_a.iter().enumerate() {
            for (j, b) in self.boxed_b.iter().enumerate() {
                lengths.push((Length::between(&a.corners, &b.corners), self.pair(i, j)));
            }
        }
        lengths
    }

    /// Returns the corners, as placed, of the triangles that an answer names.
    pub(crate) fn triangles(&self, answer: &Distance) -> Option<[&Boxed; 2]> {
        let i = self.a.find(answer.object_a, answer.triangle_a)?;
        let j = self.b.find(answer.object_b, answer.triangle_b)?;
        Some([&self.boxed_a[i], &self.boxed_b[j]])
    }

    /// Returns the exact distance of the pair that an answer names, and the largest difference between two of its
    /// coordinates.
    pub(crate) fn named(&self, answer: &Distance, tally: &mut Tally) -> Option<(Length, f64)> {
        let [a, b] = self.triangles(answer)?;
        tally.lengths += 1;
        Some((Length::between(&a.corners, &b.corners), a.span(b)))
    }

    /// Returns the same for the closest pair, which is the named one or a closer one.
    pub(crate) fn distance(&self, named: (Length, f64), tally: &mut Tally) -> (Length, f64) {
        let limit = named.0.floor().next_up();
        let mut least = named;
        for a in &self.boxed_a {
            for b in &self.boxed_b {
                if !certainly_farther(a, b, limit) {
                    tally.lengths += 1;
                    let length = Length::between(&a.corners, &b.corners);
                    if length.is_less(&least.0) {
                        least = (length, a.span(b));
                    }
                }
            }
        }
        least
    }

    /// Returns the exact distances of up to three pairs that may be the nearest, of those closer than `reach`. Arithmetic in
    /// f64 chooses them, which is fast enough for large meshes.
    pub(crate) fn nearest(&self, reach: f64) -> Vec<Length> {
        let [blocks_a, blocks_b] = self.blocks();
        let nearest = blocks_a.nearest(&blocks_b, reach, 1e-9 * self.size);
        let exact = |&(_, i, j): &(f64, usize, usize)| {
            Length::between(&self.boxed_a[i].corners, &self.boxed_b[j].corners)
        };
        nearest.iter().take(3).map(exact).collect()
    }
}
