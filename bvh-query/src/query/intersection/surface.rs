//! The part of a mesh that may be in another one: its triangles, and the vertices that they share.

use crate::error::QueryError;
use crate::file::place::TrianglePlace;
use crate::narrow::{Point, Triangle};
use crate::query::exact::placed;
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
}
