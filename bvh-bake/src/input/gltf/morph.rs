//! Finds the weights of morph targets: those of a node or, without them, those of its mesh (glTF 2.0, section 3.7.2.2).
//!
//! A vertex is at p + sum of w d, over the targets in their order, where d is what a target adds. Targets of weight 0 are not read.
//! Nodes whose weights differ have different shapes. Weights are read as f32, as transforms are.

use super::attributes::Attribute;
use super::schema::{Document, Primitive, wrong};
use crate::error::Fault;
use std::collections::HashMap;
use std::rc::Rc;

/// The weights of a node's mesh.
pub(super) struct Morph {
    /// Equal weights have equal numbers; if all are 0, the number is 0.
    pub(super) number: u32,
    /// The targets whose weight is not 0.
    active: Vec<(usize, f64)>,
    /// The number of all weights, and where they are.
    count: usize,
    stated_in: String,
}

/// The weights that have occurred.
pub(super) struct Morphs<'a> {
    document: &'a Document,
    of_meshes: HashMap<usize, Rc<Morph>>,
    /// The numbers of weights, by their bits.
    numbers: HashMap<Vec<u32>, u32>,
    none: Rc<Morph>,
}

impl<'a> Morphs<'a> {
    pub(super) fn new(document: &'a Document) -> Self {
        let none = Morph { number: 0, active: Vec::new(), count: 0, stated_in: String::new() };
        Self { document, of_meshes: HashMap::new(), numbers: HashMap::new(), none: none.into() }
    }

    /// Returns the weights with which a node has a mesh. Takes time in proportion to those that the node states.
    pub(super) fn of(&mut self, node: usize, mesh: usize) -> Rc<Morph> {
        if let Some(weights) = &self.document.nodes[node].weights {
            return self.of_weights(weights, || format!("nodes[{node}].weights"));
        }
        if let Some(known) = self.of_meshes.get(&mesh) {
            return known.clone();
        }
        let found =
            self.of_weights(&self.document.meshes[mesh].weights, || format!("meshes[{mesh}].weights"));
        self.of_meshes.insert(mesh, found.clone());
        found
    }

    fn of_weights(&mut self, weights: &[f32], stated_in: impl FnOnce() -> String) -> Rc<Morph> {
        let all = weights.iter().map(|&weight| f64::from(weight)).enumerate();
        let active: Vec<_> = all.filter(|&(_, weight)| weight != 0.0).collect();
        if active.is_empty() {
            return self.none.clone();
        }
        let next = self.numbers.len() as u32 + 1;
        let bits = weights.iter().map(|weight| (weight + 0.0).to_bits()).collect();
        let number = *self.numbers.entry(bits).or_insert(next);
        Morph { number, active, count: weights.len(), stated_in: stated_in() }.into()
    }
}

impl Morph {
    /// Returns the number of targets that are read for each primitive.
    pub(super) fn targets(&self) -> u64 {
        self.active.len() as u64
    }

    /// Returns what each target adds to a primitive, as the number of an accessor, and its weight. A target may leave positions as
    /// they are.
    pub(super) fn deltas(&self, primitive: &Primitive) -> Result<Vec<(usize, f64)>, Fault> {
        let targets = &primitive.targets;
        if !self.active.is_empty() && targets.len() != self.count {
            let expected = format!("a weight for each of {} morph targets", targets.len());
            return Err(wrong(&expected, &format!("{} in {}", self.count, self.stated_in)));
        }
        let delta =
            |&(target, weight): &(usize, f64)| Some((targets[target].of(Attribute::Position)?, weight));
        Ok(self.active.iter().filter_map(delta).collect())
    }
}
