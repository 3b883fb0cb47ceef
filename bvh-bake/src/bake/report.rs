//! The report of a bake: the file that it made, and what the file itself does not state.

use crate::bake::summary::FileSummary;
use crate::progress::Traffic;

/// The outcome of a bake.
#[derive(Debug, Clone, PartialEq)]
pub struct BakeReport {
    /// The summary of the file: layout, counts, bytes and errors.
    pub file: FileSummary,
    /// The reason for this layout: one sentence about the first object, or empty if the user chose the whole layout.
    pub reason: String,
    /// The largest error that is not coarse for an object of this size and number of triangles, in mesh units. `None`
    /// unless `Options::max_error` exceeds it, so that quantisation may have collapsed triangles that matter.
    pub advised_max_error: Option<f64>,
    /// The number of distinct vertices that the input's triangles use.
    pub vertices: u64,
    /// The mean of decoded width over tight width, over all nodes and slabs.
    pub width_inflation: f64,
    /// The mean of decoded box volume over tight box volume, over all nodes.
    pub volume_inflation: f64,
    /// The mean number of children per treelet.
    pub mean_children: f64,
    /// The bytes read from files and written to files.
    pub traffic: Traffic,
    /// The seconds from the parsed mesh (with a memory budget, from the start of reading) to the finished bytes, or to
    /// the closed file if one is written.
    pub seconds: f64,
}
