//! The part of a mesh that may be in another one: its triangles, the vertices that they share, and how often the other mesh winds
//! around these.

use crate::error::QueryError;
use crate::file::place::TrianglePlace;
use crate::narrow::{Point, Triangle};
use crate::query::exact::placed;
use crate::query::intersection::cuts::EdgeCut;
use crate::query::probe::near::near;
use crate::query::probe::placed::{IntoObject, PlacedShape};
use crate::query::querier::Querier;
use bvh_format::leaf::VertexBlock;
use bvh_format::{FormatError, Rule};
use std::collections::HashMap;
use std::hash::{BuildHasher, Hasher, RandomState};

/// A stored triangle.
#[derive(Clone, Copy, Debug)]
pub(super) struct Face {
    /// The numbers of its vertices.
    pub(super) corners: [u32; 3],
    /// How often it counts: see [`crate::file::topology`].
    pub(super) net: i32,
    /// Whether it touches the other mesh.
    pub(super) is_cut: bool,
}

/// The triangles of a mesh that may be in another one.
#[derive(Default)]
pub(super) struct Surface {
    /// The distinct vertices, in A's frame.
    pub(super) points: Vec<Point>,
    pub(super) faces: Vec<Face>,
    /// The object of the shape and the place of each face, ascending.
    places: Vec<(u32, TrianglePlace)>,
}

impl Surface {
    /// Returns the corners of a face.
    pub(super) fn triangle(&self, face: u32) -> Triangle {
        self.faces[face as usize].corners.map(|vertex| self.points[vertex as usize])
    }

    /// Returns the face at a place of an object of the shape.
    pub(super) fn face_at(&self, object: u32, place: TrianglePlace) -> Result<u32, QueryError> {
        let found = self.places.binary_search(&(object, place));
        let expected = "all triangles that touch a box in slabs that do";
        found.map(|face| face as u32).map_err(|_| {
            FormatError::new(Rule::BoundContains, 0, expected, format_args!("one in page {}", place.page))
                .into()
        })
    }
}

/// Numbers equal points alike.
#[derive(Default)]
struct Vertices(HashMap<[u64; 3], u32, Mixed>);

impl Vertices {
    fn number(&mut self, points: &mut Vec<Point>, point: Point) -> u32 {
        // Both zeros are one number.
        let point = point.map(|x| x + 0.0);
        *self.0.entry(point.map(f64::to_bits)).or_insert_with(|| {
            points.push(point);
            points.len() as u32 - 1
        })
    }
}

/// Hashes coordinates in a few steps, with a key of the process, so that no mesh is made for its hashes to collide.
#[derive(Clone)]
struct Mixed(u64);

impl Default for Mixed {
    fn default() -> Self {
        Self(RandomState::new().hash_one(0))
    }
}

impl BuildHasher for Mixed {
    type Hasher = Self;

    fn build_hasher(&self) -> Self {
        self.clone()
    }
}

impl Hasher for Mixed {
    fn write(&mut self, bytes: &[u8]) {
        for chunk in bytes.chunks(8) {
            let mut word = [0; 8];
            word[..chunk.len()].copy_from_slice(chunk);
            let product = u128::from(self.0 ^ u64::from_le_bytes(word)) * 0x9e37_79b9_7f4a_7c15;
            self.0 = (product >> 64) as u64 ^ product as u64;
        }
    }

    fn finish(&self) -> u64 {
        self.0
    }
}

impl Querier {
    /// Returns the triangles of a mesh whose leaves reach into the box of another one.
    pub(super) fn surface_near(
        &mut self,
        mesh: &PlacedShape<'_>,
        other: &PlacedShape<'_>,
    ) -> Result<Surface, QueryError> {
        let (mut surface, mut vertices) = (Surface::default(), Vertices::default());
        let (shape, bvh) = (mesh.shape, mesh.shape.bvh());
        for (number, object) in shape.objects().iter().enumerate() {
            let topology = bvh.topology(shape.first() + number)?;
            let bounds = IntoObject::new(mesh.pose.as_ref(), object).bounds_of(other);
            let mut places = near(bvh, object, &bounds, &mut self.memory.budget)?;
            places.sort_unstable();
            for of_page in places.chunk_by(|one, other| one.page == other.page) {
                let page = bvh.page(object, of_page[0].page)?;
                let block = bvh.leaf_block(object, &page)?;
                let packets = page.header().packets.get().into();
                let stored = VertexBlock::new(object.triangle_encoding(), object.vertices(), block, packets);
                for place in of_page {
                    let mut corners = stored.triangle(place.packet.into(), place.lane.into());
                    if let Some(pose) = &mesh.pose {
                        corners = placed(&corners, pose);
                    }
                    let each_once = topology.counts_each_once();
                    let net = if each_once { 1 } else { topology.net(bvh.place_of(object, *place)?) };
                    let corners = corners.map(|corner| vertices.number(&mut surface.points, corner));
                    surface.faces.push(Face { corners, net, is_cut: false });
                }
            }
            surface.places.extend(places.into_iter().map(|place| (number as u32, place)));
        }
        Ok(surface)
    }

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
