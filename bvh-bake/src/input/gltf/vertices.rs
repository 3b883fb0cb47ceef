//! Reads the vertices of a primitive where its morph targets and its skin take them, block by block.

use super::accessor::{self, BLOCK_BYTES, BLOCK_VALUES, Reader};
use super::attributes::Attribute;
use super::buffer::Buffers;
use super::morph::Morph;
use super::schema::{Document, Primitive, wrong};
use super::skin::{Joints, Mended};
use crate::error::{Fault, Halt};
use std::rc::Rc;

/// The number of bytes that are read at a time from all accessors of a vertex together.
const ALL_BYTES: usize = 1 << 21;
/// The least number of bytes that are read at a time from one of very many accessors. The memory for them is part of that for the
/// JSON that names them.
const LEAST_BYTES: usize = 1 << 8;

/// A mesh as a node has it. Shapes with equal keys are equal.
pub(super) struct Shape {
    pub(super) mesh: usize,
    pub(super) morph: Rc<Morph>,
    pub(super) joints: Option<Rc<Joints>>,
}

/// What tells shapes apart: the mesh, its weights and its skin.
pub(super) type Key = (usize, u32, Option<usize>);

impl Shape {
    pub(super) fn key(&self) -> Key {
        (self.mesh, self.morph.number, self.joints.as_ref().map(|joints| joints.skin))
    }

    /// Returns whether the skin turns the mesh inside out.
    pub(super) fn mirrors(&self) -> bool {
        self.joints.as_ref().is_some_and(|joints| joints.mirrors)
    }
}

/// The accessors from which the vertices of a primitive come. Primitives with the same ones share their vertices.
#[derive(PartialEq, Eq, Hash)]
pub(super) struct Sources {
    position: usize,
    /// What each morph target adds, and the bits of its weight.
    deltas: Vec<(usize, u64)>,
    /// The accessors of joints and those of their weights.
    sets: Vec<(usize, usize)>,
}

impl Sources {
    /// Finds the accessors of a primitive, which is called `user` in messages.
    pub(super) fn of(
        position: usize,
        primitive: &Primitive,
        shape: &Shape,
        user: &dyn Fn() -> String,
    ) -> Result<Self, Fault> {
        let deltas = shape.morph.deltas(primitive)?;
        let deltas = deltas.into_iter().map(|(accessor, weight)| (accessor, weight.to_bits())).collect();
        let mut sets = Vec::new();
        if shape.joints.is_some() {
            for (attribute, joints) in primitive.attributes.all() {
                let Attribute::Joints(set) = attribute else { continue };
                let missing =
                    || wrong(&format!("WEIGHTS_{set} in {}, which has JOINTS_{set}", user()), "none");
                sets.push((joints, primitive.attributes.of(Attribute::Weights(set)).ok_or_else(missing)?));
            }
            if sets.is_empty() {
                return Err(wrong(&format!("JOINTS_0 in {}, which a node with a skin has", user()), "none"));
            }
        }
        Ok(Self { position, deltas, sets })
    }

    /// Opens the accessors.
    pub(super) fn open<'a>(
        &self,
        document: &'a Document,
        buffers: &mut Buffers<'a>,
        user: &dyn Fn() -> String,
    ) -> Result<Vertices<'a>, Fault> {
        let count = document.accessor(self.position, user)?.count;
        let of_count = |number: usize| {
            let accessor = document.accessor(number, user)?;
            if accessor.count != count {
                let expected =
                    format!("{count} values, as many as positions, in accessors[{number}] of {}", user());
                return Err(wrong(&expected, &accessor.count.to_string()));
            }
            Ok((number, accessor))
        };
        let accessors = 1 + self.deltas.len() + 2 * self.sets.len();
        let bytes = (ALL_BYTES / accessors).clamp(LEAST_BYTES, BLOCK_BYTES);
        let (number, accessor) = of_count(self.position)?;
        let positions = Reader::of(number, accessor, &accessor::POSITIONS, bytes, buffers)?;
        let mut vertices = Vertices { count, accessors, positions, deltas: Vec::new(), sets: Vec::new() };
        for &(number, weight) in &self.deltas {
            let (number, accessor) = of_count(number)?;
            let reader = Reader::of(number, accessor, &accessor::DELTAS, bytes, buffers)?;
            vertices.deltas.push((reader, f64::from_bits(weight)));
        }
        for &(joints, weights) in &self.sets {
            let [(joints, of_joints), (weights, of_weights)] = [of_count(joints)?, of_count(weights)?];
            let joints = Reader::of(joints, of_joints, &accessor::JOINTS, bytes, buffers)?;
            vertices
                .sets
                .push((joints, Reader::of(weights, of_weights, &accessor::WEIGHTS, bytes, buffers)?));
        }
        Ok(vertices)
    }
}

/// The opened accessors of a primitive.
pub(super) struct Vertices<'a> {
    pub(super) count: u64,
    accessors: usize,
    positions: Reader<'a, 3>,
    deltas: Vec<(Reader<'a, 3>, f64)>,
    sets: Vec<(Reader<'a, 4>, Reader<'a, 4>)>,
}

impl Vertices<'_> {
    /// Returns the number of values that are read.
    pub(super) fn cost(&self) -> u64 {
        self.count.saturating_mul(self.accessors as u64)
    }

    /// Reads all vertices, and passes them on in order, some at a time.
    pub(super) fn read(
        mut self,
        joints: Option<&Joints>,
        mended: &mut Mended,
        mut give: impl FnMut(&mut [[f64; 3]]) -> Result<(), Halt>,
    ) -> Result<(), Halt> {
        let (mut positions, mut deltas) = (Vec::new(), Vec::new());
        let mut left = self.count;
        // The values of a vertex are together, so that those of very many sets take less room.
        let sets = self.sets.len();
        let most = (BLOCK_VALUES / (4 * sets).max(1)).max(1);
        let mut influences = Vec::new();
        while left > 0 {
            self.positions.block(most, &mut positions, |position| position)?;
            left -= positions.len() as u64;
            for (reader, weight) in &mut self.deltas {
                reader.block(most, &mut deltas, |delta| delta)?;
                for (position, delta) in positions.iter_mut().zip(&deltas) {
                    *position = [0, 1, 2].map(|axis| position[axis] + *weight * delta[axis]);
                }
            }
            if let Some(joints) = joints {
                self.influences(most, positions.len(), &mut influences)?;
                for (position, influences) in positions.iter_mut().zip(influences.chunks(4 * sets)) {
                    *position = joints.place(*position, influences, mended)?;
                }
            }
            give(&mut positions)?;
        }
        Ok(())
    }

    /// Reads the joints and weights of the next vertices: those of all sets of a vertex, then those of the next.
    fn influences(&mut self, most: usize, count: usize, into: &mut Vec<(usize, f64)>) -> Result<(), Fault> {
        let sets = self.sets.len();
        into.clear();
        into.resize(4 * sets * count, (0, 0.0));
        let (mut of_joints, mut of_weights) = (Vec::new(), Vec::new());
        for (set, (joints, weights)) in self.sets.iter_mut().enumerate() {
            joints.block(most, &mut of_joints, |joints| joints)?;
            weights.block(most, &mut of_weights, |weights| weights)?;
            for (vertex, (joints, weights)) in of_joints.iter().zip(&of_weights).enumerate() {
                let at = 4 * (sets * vertex + set);
                for place in 0..4 {
                    // Joints are integers of 16 bits at most.
                    into[at + place] = (joints[place] as usize, weights[place]);
                }
            }
        }
        Ok(())
    }
}
