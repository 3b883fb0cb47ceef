//! Reads where a node repeats its mesh (`EXT_mesh_gpu_instancing`).
//!
//! Each instance has a translation, a rotation and a scale below those of the node; what is not stated changes nothing. The nodes
//! below are not repeated.

use super::accessor::{self, Reader, Wanted};
use super::attributes::{Attribute, Attributes};
use super::buffer::Buffers;
use super::schema::{Document, wrong};
use crate::error::Fault;
use crate::input::frame::Transform;

/// The number of instances that are read at a time.
const BLOCK: usize = 1 << 10;
/// The number of bytes that are read at a time of each attribute.
const BLOCK_BYTES: usize = 1 << 14;

/// The transforms of the instances of a node, in order.
pub(super) struct Placements<'a> {
    node: usize,
    translations: Option<Reader<'a, 3>>,
    rotations: Option<Reader<'a, 4>>,
    scales: Option<Reader<'a, 3>>,
    /// The number of instances, and of those that were read.
    pub(super) count: u64,
    first: u64,
}

impl<'a> Placements<'a> {
    /// Finds the instances of a node.
    pub(super) fn of(
        node: usize,
        attributes: &Attributes,
        document: &'a Document,
        buffers: &mut Buffers<'a>,
    ) -> Result<Self, Fault> {
        let user = || format!("EXT_mesh_gpu_instancing of nodes[{node}]");
        let mut count = None;
        for (_, number) in attributes.all() {
            let found = document.accessor(number, user)?.count;
            let expected = *count.get_or_insert(found);
            if found != expected {
                let expected = format!("attributes with as many values, {expected}, in {}", user());
                return Err(wrong(&expected, &format!("{found} in accessors[{number}]")));
            }
        }
        let Some(count) = count else {
            return Err(wrong(
                "an attribute that says how many instances there are",
                &format!("none in {}", user()),
            ));
        };
        Ok(Self {
            node,
            translations: reader(
                attributes,
                Attribute::Translation,
                &accessor::TRANSLATIONS,
                document,
                buffers,
            )?,
            rotations: reader(attributes, Attribute::Rotation, &accessor::ROTATIONS, document, buffers)?,
            scales: reader(attributes, Attribute::Scale, &accessor::TRANSLATIONS, document, buffers)?,
            count,
            first: 0,
        })
    }

    /// Reads the next transforms; none are left if there are none.
    pub(super) fn block(&mut self, transforms: &mut Vec<Transform>) -> Result<(), Fault> {
        let now = (self.count - self.first).min(BLOCK as u64) as usize;
        self.first += now as u64;
        let node = self.node;
        let translations = values(&mut self.translations, [0.0; 3], now, node)?;
        let rotations = values(&mut self.rotations, [0.0, 0.0, 0.0, 1.0], now, node)?;
        let scales = values(&mut self.scales, [1.0; 3], now, node)?;
        let all = translations.into_iter().zip(rotations).zip(scales);
        transforms.clear();
        transforms.extend(all.map(|((translation, rotation), scale)| Transform::Decomposed {
            translation,
            rotation,
            scale,
        }));
        Ok(())
    }
}

fn reader<'a, const N: usize>(
    attributes: &Attributes,
    attribute: Attribute,
    wanted: &Wanted,
    document: &'a Document,
    buffers: &mut Buffers<'a>,
) -> Result<Option<Reader<'a, N>>, Fault> {
    let reader = |number| Reader::of(number, &document.accessors[number], wanted, BLOCK_BYTES, buffers);
    attributes.of(attribute).map(reader).transpose()
}

/// Reads the next values of an attribute, or makes as many of what it is when it is not stated.
fn values<const N: usize>(
    reader: &mut Option<Reader<N>>,
    otherwise: [f64; N],
    count: usize,
    node: usize,
) -> Result<Vec<[f64; N]>, Fault> {
    let Some(reader) = reader else { return Ok(vec![otherwise; count]) };
    let mut values = Vec::new();
    reader.block(count, &mut values, |value| value)?;
    match values.as_flattened().iter().find(|value| !value.is_finite()) {
        None => Ok(values),
        Some(value) => {
            let expected = format!("finite numbers in EXT_mesh_gpu_instancing of nodes[{node}]");
            Err(wrong(&expected, &format!("{value:e}")))
        }
    }
}
