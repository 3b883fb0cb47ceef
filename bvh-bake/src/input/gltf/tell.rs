//! Warns of what a glTF file holds that changes triangles and is not read, or is read in another way than its author may expect.

use super::schema::{Document, Mode, Primitive};
use super::skin::Mended;
use crate::error::Place;
use crate::input::warnings::Warnings;

/// What has been met, each kind of which is told once.
pub(super) struct Told {
    /// Whether each mesh has been met. What a mesh lacks is counted once.
    meshes: Vec<bool>,
    /// Primitives of points and lines, and those that have no positions.
    without_area: u64,
    without_positions: u64,
    /// The nodes with meshes that are invisible, and the first of them.
    hidden: u64,
    first_hidden: usize,
    /// What skins did to weights.
    pub(super) mended: Mended,
}

impl Told {
    pub(super) fn new(document: &Document) -> Self {
        Self {
            meshes: vec![false; document.meshes.len()],
            without_area: 0,
            without_positions: 0,
            hidden: 0,
            first_hidden: 0,
            mended: Mended::default(),
        }
    }

    /// Begins a mesh, and returns whether it has not been met before.
    pub(super) fn begin_mesh(&mut self, mesh: usize) -> bool {
        !std::mem::replace(&mut self.meshes[mesh], true)
    }

    /// Counts a primitive that has no triangles.
    pub(super) fn leave_out(&mut self, primitive: &Primitive, is_first: bool) {
        match primitive.mode {
            Mode::PointsOrLines => self.without_area += u64::from(is_first),
            _ => self.without_positions += u64::from(is_first),
        }
    }

    /// Counts a node with a mesh that is invisible.
    pub(super) fn hide(&mut self, node: usize) {
        if self.hidden == 0 {
            self.first_hidden = node;
        }
        self.hidden += 1;
    }

    /// Warns of everything. `seen` are the nodes that were read.
    pub(super) fn tell(&self, document: &Document, seen: &[bool], warnings: &Warnings) {
        let add = |count: u64, one: &str, many: &str| match count {
            0 => {}
            1 => warnings.add(Place::File, one),
            _ => warnings.add(Place::File, many.replace('#', &count.to_string())),
        };
        add(
            document.animations.iter().filter(|animation| animation.moves()).count() as u64,
            "left out an animation that moves nodes or changes weights, which are read as the file states them at rest",
            "left out # animations that move nodes or change weights, which are read as the file states them at rest",
        );
        let first = self.first_hidden;
        add(
            self.hidden,
            &format!(
                "read the mesh of an invisible node (KHR_node_visibility), nodes[{first}], like any other"
            ),
            &format!(
                "read the meshes of # invisible nodes (KHR_node_visibility), of which nodes[{first}] is the first, like any other"
            ),
        );
        let levels =
            document.nodes.iter().zip(seen).filter(|&(_, &seen)| seen).flat_map(|(node, _)| node.levels());
        add(
            levels.filter(|&&level| !seen.get(level).is_some_and(|&seen| seen)).count() as u64,
            "left out a node that shows another with less detail (MSFT_lod)",
            "left out # nodes that show others with less detail (MSFT_lod)",
        );
        add(
            self.without_area,
            "left out a primitive of points or lines",
            "left out # primitives of points or lines",
        );
        add(
            self.without_positions,
            "left out a primitive without positions",
            "left out # primitives without positions",
        );
        let Mended { scaled, weightless } = self.mended;
        add(
            scaled,
            "divided the weights of a vertex of a skin by their sum, which is not 1",
            "divided the weights of # vertices of skins by their sum, which is not 1",
        );
        add(
            weightless,
            "moved a vertex of a skin that has no weights with its first joint",
            "moved # vertices of skins that have no weights with their first joint",
        );
    }
}
