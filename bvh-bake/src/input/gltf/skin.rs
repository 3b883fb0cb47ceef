//! Finds where the joints of a skin take its vertices (glTF 2.0, section 3.7.3).
//!
//! A vertex p is at the sum of w G B p, divided by the sum of the weights w. G is the place of a joint in the world, as its nodes
//! state it, and B the joint's inverse bind matrix, which takes the mesh to the joint; without matrices, B is the identity. The
//! transform of the node that has the skin is ignored, because joints place it. Weights should add up to 1 and are divided by
//! their sum where they do not, because they would move a vertex towards the origin; a vertex without weights follows its first
//! joint. Other programs do the same (three.js).
//!
//! Numbers are f32 in the file; all sums are in f64, in the order of the file.

use super::accessor::{self, Reader};
use super::buffer::Buffers;
use super::schema::{Document, part, wrong};
use crate::error::{Fault, Halt};
use crate::input::frame::{self, Affine, IDENTITY};
use std::rc::Rc;

/// No node, as the number of a parent, and several.
const NONE: u32 = u32::MAX;
const SEVERAL: u32 = u32::MAX - 1;
/// How far the sum of the weights of four joints may be from 1: integers of 8 bits, each rounded by itself, are off by 4/510.
const SUM_ERROR: f64 = 1.0 / 64.0;

/// Where the joints of a skin take vertices.
pub(super) struct Joints {
    /// The number of the skin.
    pub(super) skin: usize,
    matrices: Vec<Affine>,
    /// Whether all of them turn the mesh inside out.
    pub(super) mirrors: bool,
}

/// The skins of a document.
pub(super) struct Skins<'a> {
    document: &'a Document,
    /// The parent of each node, once a skin needs them.
    parents: Vec<u32>,
    /// The places in the world of those nodes that joints needed.
    worlds: Vec<Option<Affine>>,
    last: Option<Rc<Joints>>,
}

impl<'a> Skins<'a> {
    pub(super) fn new(document: &'a Document) -> Self {
        Self { document, parents: Vec::new(), worlds: Vec::new(), last: None }
    }

    /// Returns the number of joints that must be found for a skin, besides the nodes above them.
    pub(super) fn cost(&self, node: usize, skin: usize) -> Result<u64, Fault> {
        let found = part(&self.document.skins, "skins", skin, || format!("nodes[{node}].skin"))?;
        let is_known = self.last.as_ref().is_some_and(|last| last.skin == skin);
        Ok(if is_known { 0 } else { found.joints.len() as u64 })
    }

    /// Finds the joints of a skin. The last one is kept.
    pub(super) fn joints(&mut self, skin: usize, buffers: &mut Buffers<'a>) -> Result<Rc<Joints>, Halt> {
        if let Some(last) = self.last.as_ref().filter(|last| last.skin == skin) {
            return Ok(last.clone());
        }
        self.last = None;
        let found = &self.document.skins[skin];
        let mut matrices = Vec::with_capacity(found.joints.len());
        for &joint in &found.joints {
            part(&self.document.nodes, "nodes", joint, || format!("skins[{skin}].joints"))?;
            matrices.push(self.world(joint)?);
        }
        if let Some(number) = found.inverse_bind_matrices {
            self.bind(skin, number, &mut matrices, buffers)?;
        }
        let mirrors = !matrices.is_empty() && matrices.iter().all(frame::mirrors);
        let joints = Rc::new(Joints { skin, matrices, mirrors });
        self.last = Some(joints.clone());
        Ok(joints)
    }

    /// Multiplies the places of joints by their inverse bind matrices.
    fn bind(
        &self,
        skin: usize,
        number: usize,
        matrices: &mut [Affine],
        buffers: &mut Buffers<'a>,
    ) -> Result<(), Halt> {
        let user = || format!("skins[{skin}].inverseBindMatrices");
        let accessor = self.document.accessor(number, user)?;
        if accessor.count < matrices.len() as u64 {
            let expected = format!("a matrix for each of {} joints", matrices.len());
            return Err(wrong(&expected, &format!("{} in {}", accessor.count, user())).into());
        }
        let mut reader =
            Reader::<16>::of(number, accessor, &accessor::MATRICES, accessor::BLOCK_BYTES, buffers)?;
        let mut block = Vec::new();
        for some in matrices.chunks_mut(accessor::BLOCK_VALUES / 16) {
            // The columns of a 4x4 matrix, of which the last row is 0, 0, 0, 1.
            reader.block(some.len(), &mut block, |columns| -> Affine {
                std::array::from_fn(|row| std::array::from_fn(|column| columns[4 * column + row]))
            })?;
            for (matrix, inverse) in some.iter_mut().zip(&block) {
                *matrix = frame::product(matrix, inverse);
            }
        }
        Ok(())
    }

    /// Returns the place of a node in the world, whichever scene it belongs to.
    fn world(&mut self, node: usize) -> Result<Affine, Fault> {
        let nodes = &self.document.nodes;
        if self.parents.is_empty() {
            self.worlds = vec![None; nodes.len()];
            self.parents = vec![NONE; nodes.len()];
            for (number, above) in nodes.iter().enumerate() {
                for &child in &above.children {
                    let parent = &mut self.parents[child];
                    *parent = if *parent == NONE { number as u32 } else { SEVERAL };
                }
            }
        }
        // Up to a node whose place is known, and down again.
        let (mut path, mut at) = (vec![node], node);
        let mut world = loop {
            if let Some(world) = self.worlds[at] {
                path.pop();
                break world;
            }
            match self.parents[at] {
                NONE => break IDENTITY,
                SEVERAL => return Err(no_tree(at)),
                parent => at = parent as usize,
            }
            // More nodes than there are: a node is above itself.
            if path.len() == nodes.len() {
                return Err(no_tree(at));
            }
            path.push(at);
        };
        for &number in path.iter().rev() {
            world = frame::product(&world, &frame::local(nodes[number].transform()));
            self.worlds[number] = Some(world);
        }
        Ok(world)
    }
}

/// Returns the fault of a node that has several parents, or is below itself.
pub(super) fn no_tree(node: usize) -> Fault {
    wrong("nodes that form trees, each node below one other at most", &format!("node {node} twice"))
}

/// The joints of a vertex and their weights, a set of four after the other.
pub(super) type Influences = [(usize, f64)];

/// What a skin did to weights.
#[derive(Default)]
pub(super) struct Mended {
    /// The vertices whose weights did not add up to 1.
    pub(super) scaled: u64,
    /// The vertices without weights.
    pub(super) weightless: u64,
}

impl Joints {
    /// Returns where a vertex is.
    pub(super) fn place(
        &self,
        point: [f64; 3],
        influences: &Influences,
        mended: &mut Mended,
    ) -> Result<[f64; 3], Fault> {
        let mut sum = 0.0;
        for &(_, weight) in influences {
            if !(weight >= 0.0 && weight.is_finite()) {
                let expected = format!("finite weights from 0 of the joints of skins[{}]", self.skin);
                return Err(wrong(&expected, &format!("{weight:e}")));
            }
            sum += weight;
        }
        if sum == 0.0 {
            mended.weightless += 1;
            return Ok(frame::apply(self.matrix(influences[0].0)?, point));
        }
        let off = (sum - 1.0).abs();
        mended.scaled += u64::from(off > SUM_ERROR * (influences.len() / 4) as f64);
        let mut place = [0.0; 3];
        // A joint that has no weight need not exist.
        for &(joint, weight) in influences.iter().filter(|&&(_, weight)| weight > 0.0) {
            let moved = frame::apply(self.matrix(joint)?, point);
            place = [0, 1, 2].map(|axis| place[axis] + weight * moved[axis]);
        }
        Ok(place.map(|value| value / sum))
    }

    fn matrix(&self, joint: usize) -> Result<&Affine, Fault> {
        let (joints, skin) = (self.matrices.len(), self.skin);
        self.matrices.get(joint).ok_or_else(|| {
            wrong(&format!("joints below {joints}, of which skins[{skin}] has so many"), &joint.to_string())
        })
    }
}
