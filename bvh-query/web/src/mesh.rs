//! A mesh in the bytes of a `.cbvh` file: all objects of the file, or one.

use crate::answers::{floats, ids};
use crate::arguments::{Answer, bytes, refused, room, wrong};
use bvh_query::{Bvh, OwnedShape};
use js_sys::{Array, Float64Array, JsString, Uint8Array};
use wasm_bindgen::prelude::*;

/// A handle to a mesh. Several handles may share the bytes of a file.
#[wasm_bindgen]
pub struct Mesh {
    pub(crate) shape: OwnedShape,
}

impl From<Bvh> for Mesh {
    fn from(bvh: Bvh) -> Self {
        Self { shape: bvh.into() }
    }
}

#[wasm_bindgen]
impl Mesh {
    /// Opens the bytes of a file, which are copied.
    pub fn open(file: &Uint8Array) -> Answer<Mesh> {
        Bvh::from_bytes(bytes(file, "bytes")?).map(Self::from).map_err(refused)
    }

    /// Copies the bytes of the file.
    pub fn bytes(&self) -> Answer<Uint8Array> {
        Ok(Uint8Array::from(&self.shape.bytes().map_err(refused)?[..]))
    }

    /// The number of bytes of the file.
    pub fn size(&self) -> usize {
        self.shape.bvh().bytes().len()
    }

    /// The same core with a radius, which shares the bytes.
    pub fn rounded(&self, radius: f64) -> Answer<Mesh> {
        Ok(Self { shape: self.shape.clone().rounded(radius).map_err(refused)? })
    }

    /// The same mesh, of which the inside counts as well.
    pub fn solid(&self) -> Answer<Mesh> {
        Ok(Self { shape: self.shape.clone().solid().map_err(refused)? })
    }

    /// The open edges: the number of each kind and of cracks, the nearest gap, the widest crack and the weld that is proposed, or NaN;
    /// of each edge that is listed its kind, its object and the number of its triangles; these triangles; both ends and the gap of each
    /// edge; and a sentence about them.
    #[wasm_bindgen(js_name = openEdges)]
    pub fn open_edges(&self) -> Answer<Array> {
        let edges = self.shape.shape().open_edges().map_err(refused)?;
        let (mut counts, mut numbers, mut triangles, mut places) =
            (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        for (kind, (_, of_kind)) in (0..).zip(edges.kinds()) {
            counts.push(of_kind.count as f64);
            for edge in &of_kind.first {
                numbers.extend_from_slice(&[kind, edge.object, edge.triangles.len() as u32]);
                triangles.extend_from_slice(&edge.triangles);
                places.extend_from_slice(edge.ends.as_flattened());
                places.push(edge.gap.unwrap_or(f64::NAN));
            }
        }
        counts.push(edges.gaps.cracks as f64);
        for length in [edges.gaps.nearest, edges.gaps.widest_crack, edges.proposed_weld()] {
            counts.push(length.unwrap_or(f64::NAN));
        }
        let found = Array::new();
        found.push(&floats(counts.into_iter()));
        found.push(&ids(numbers.into_iter()));
        found.push(&ids(triangles.into_iter()));
        found.push(&floats(places.into_iter()));
        found.push(&JsString::from(edges.to_string()));
        Ok(found)
    }

    pub fn radius(&self) -> f64 {
        self.shape.shape().radius()
    }

    #[wasm_bindgen(js_name = maxMove)]
    pub fn max_move(&self) -> f64 {
        self.shape.shape().max_move()
    }

    #[wasm_bindgen(js_name = isSolid)]
    pub fn is_solid(&self) -> bool {
        self.shape.shape().is_solid()
    }

    /// One object of the file, which shares its bytes.
    pub fn object(&self, number: f64) -> Answer<Mesh> {
        let bvh = self.shape.bvh().clone();
        let objects = bvh.objects().len();
        let whole =
            Some(number).filter(|number| number.fract() == 0.0 && (0.0..2f64.powi(32)).contains(number));
        let shape = whole.and_then(|number| OwnedShape::object(bvh, number as usize));
        let shape = shape.ok_or_else(|| {
            wrong("object", format_args!("expected a number below {objects}, found {number}"))
        })?;
        Ok(Self { shape })
    }

    /// The names of all objects of the file.
    pub fn names(&self) -> Vec<String> {
        self.shape.bvh().objects().iter().map(|object| object.name().to_owned()).collect()
    }

    /// The number of triangles stored.
    pub fn count(&self) -> f64 {
        self.shape.shape().triangles() as f64
    }

    /// The lower and the upper corner of the box of all objects.
    pub fn bounds(&self) -> JsValue {
        let boxes = self.shape.shape().objects().iter().map(|object| object.bounding_box());
        let joined = boxes.reduce(|[lo_a, hi_a], [lo_b, hi_b]| {
            [[0, 1, 2].map(|k| lo_a[k].min(lo_b[k])), [0, 1, 2].map(|k| hi_a[k].max(hi_b[k]))]
        });
        floats(joined.iter().flatten().flatten().copied())
    }

    /// The nine coordinates of each triangle in the order of ids, NaN for an id that no triangle has.
    pub fn triangles(&self) -> Answer<Float64Array> {
        let shape = self.shape.shape();
        let objects = shape.objects().len();
        if objects > 1 && !shape.bvh().layout().has_ids() {
            let found = format_args!("expected one object in a file without ids, found {objects}");
            return Err(wrong("triangles", found));
        }
        let mut end = 0;
        // A forged file may have the id 2^32 - 1. For so many triangles there is never room.
        shape.visit_triangles(|id, _| end = end.max((id as usize).saturating_add(1))).map_err(refused)?;
        let mut corners = room("triangles", [[f64::NAN; 3]; 3], end)?;
        shape.visit_triangles(|id, triangle| corners[id as usize] = triangle).map_err(refused)?;
        Ok(Float64Array::from(corners.as_flattened().as_flattened()))
    }

    /// Checks the whole file.
    pub fn validate(&self) -> Answer<()> {
        self.shape.bvh().validate().map_err(refused)
    }
}
