//! What a user may choose when baking.

use bvh_format::leaf::TriangleEncoding;
use bvh_format::profile::Profile;

/// How to bake. `Options::default()` is right for most meshes.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// Treelet profile; `None` picks the one of least estimated query cost for each object.
    pub profile: Option<Profile>,
    /// Triangle encoding; `None` picks `F32` or `Packed`, whichever the cost model prefers.
    pub triangles: Option<TriangleEncoding>,
    /// For `Quantized`: how far a vertex may move, in mesh units. Default: 1e-5 of the diagonal of
    /// the object's box.
    pub max_error: Option<f64>,
    /// One tree per object of the input instead of one for all.
    pub split_objects: bool,
    /// Keep the original triangle numbers.
    pub ids: bool,
}

impl Default for Options {
    fn default() -> Self {
        Self { profile: None, triangles: None, max_error: None, split_objects: false, ids: true }
    }
}

impl Options {
    /// The options as one line of text: equal options, equal text.
    pub fn stamp(&self) -> String {
        format!(
            "profile={} triangles={} max_error={} split={} ids={}",
            self.profile.map_or("auto", Profile::name),
            self.triangles.map_or("auto", TriangleEncoding::name),
            self.max_error.map_or("default".to_owned(), |e| format!("{e:?}")),
            self.split_objects,
            self.ids
        )
    }
}
