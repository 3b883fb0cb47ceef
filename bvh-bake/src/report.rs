//! What a bake did: the file it made, and what the file does not say.

use crate::progress::Traffic;
use crate::summary::FileSummary;

/// The outcome of a bake.
#[derive(Debug, Clone, PartialEq)]
pub struct BakeReport {
    /// The file: layout, counts, bytes, errors.
    pub file: FileSummary,
    /// Why this layout: one sentence, of the first object; empty if the user chose all of it.
    pub reason: String,
    /// Distinct vertices that the input's triangles use.
    pub vertices: u64,
    /// Mean over nodes and slabs of decoded width / tight width.
    pub width_inflation: f64,
    /// Mean over nodes of the box volume's ratio.
    pub volume_inflation: f64,
    /// Mean number of children of a treelet.
    pub mean_children: f64,
    /// What was read and written of files.
    pub traffic: Traffic,
    /// Seconds from the parsed mesh, or within a budget from the start of reading, to the finished bytes, or to the closed file where one is written.
    pub seconds: f64,
}
