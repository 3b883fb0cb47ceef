//! What a user may choose when baking.

use crate::ablation::Ablation;
use bvh_format::leaf::TriangleEncoding;
use bvh_format::profile::Profile;

/// How much time a bake takes for a better tree. Answers are the same; times and files' sizes are those of
/// `spec/rationale.md`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[non_exhaustive]
pub enum Effort {
    /// Coarser splits, and nothing is moved afterwards.
    Fast,
    /// Fine splits near the leaves; then a tenth of all subtrees, the largest, move to better places.
    #[default]
    Default,
    /// All subtrees move to better places, three times.
    High,
}

impl Effort {
    /// All of them, the quickest first.
    pub const ALL: [Self; 3] = [Self::Fast, Self::Default, Self::High];

    /// The name in options and provenance.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Fast => "fast",
            Self::Default => "default",
            Self::High => "high",
        }
    }

    /// The effort of a name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|effort| effort.name() == name)
    }
}

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
    /// How much time goes into the tree.
    pub effort: Effort,
    /// One tree per object of the input instead of one for all.
    pub split_objects: bool,
    /// Keep the original triangle numbers.
    pub ids: bool,
    /// For measurements: what to do otherwise than usual.
    #[doc(hidden)]
    pub ablation: Ablation,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            profile: None,
            triangles: None,
            max_error: None,
            effort: Effort::Default,
            split_objects: false,
            ids: true,
            ablation: Ablation::default(),
        }
    }
}

impl Options {
    /// The options as one line of text: equal options, equal text.
    pub fn stamp(&self) -> String {
        let mut stamp = format!(
            "profile={} triangles={} max_error={} effort={} split={} ids={}",
            self.profile.map_or("auto", Profile::name),
            self.triangles.map_or("auto", TriangleEncoding::name),
            self.max_error.map_or("default".to_owned(), |e| format!("{e:?}")),
            self.effort.name(),
            self.split_objects,
            self.ids
        );
        if self.ablation != Ablation::default() {
            stamp += &format!(" {:?}", self.ablation);
        }
        stamp
    }
}
