//! What is compared: all layouts, and departures from the usual tree and order of pages.

use bvh_bake::{Ablation, Options, PageOrder, SplitRule};
use bvh_format::leaf::TriangleEncoding;
use bvh_format::profile::Profile;

/// Which comparison a row of the report belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Group {
    /// Each profile with each encoding of triangles.
    Layout,
    /// Ways to split nodes.
    Splits,
    /// Orders of pages.
    Pages,
    /// Modelled: what residuals are relative to.
    Predictor,
    /// Modelled: children of a treelet.
    Branching,
    /// Modelled: triangles of a leaf.
    Leaf,
}

impl Group {
    /// The name in tables.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Layout => "layout",
            Self::Splits => "splits",
            Self::Pages => "pages",
            Self::Predictor => "predictor",
            Self::Branching => "branching",
            Self::Leaf => "leaf",
        }
    }
}

/// A way to bake.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Variant {
    pub(super) group: Group,
    /// Its name in its group.
    pub(super) name: String,
    pub(super) profile: Profile,
    pub(super) triangles: TriangleEncoding,
    pub(super) ablation: Ablation,
}

/// The layout of the comparisons that are not about layouts: the format's default, with plain triangles.
pub(super) const USUAL: (Profile, TriangleEncoding) = (Profile::Dop14U8, TriangleEncoding::F32);

/// All variants. The usual one is there three times, measured each time: how far the three differ is noise.
pub(super) fn all() -> Vec<Variant> {
    let mut variants = Vec::new();
    for profile in Profile::ALL {
        for triangles in TriangleEncoding::ALL {
            let name = format!("{} {}", profile.name(), triangles.name());
            let ablation = Ablation::default();
            variants.push(Variant { group: Group::Layout, name, profile, triangles, ablation });
        }
    }
    let (profile, triangles) = USUAL;
    let mut add = |group, name: &str, ablation| {
        variants.push(Variant { group, name: name.to_owned(), profile, triangles, ablation });
    };
    for splits in SplitRule::ALL {
        add(Group::Splits, splits.name(), Ablation { splits, ..Ablation::default() });
    }
    for pages in PageOrder::ALL {
        add(Group::Pages, pages.name(), Ablation { pages, ..Ablation::default() });
    }
    variants
}

impl Variant {
    /// What the baker is told.
    pub(super) fn options(&self) -> Options {
        Options {
            profile: Some(self.profile),
            triangles: Some(self.triangles),
            ablation: self.ablation,
            ..Options::default()
        }
    }

    /// True for the variant whose answers those of others with these triangles must equal: floats as they are.
    pub(super) fn is_reference(&self, triangles: TriangleEncoding) -> bool {
        self.group == Group::Layout && self.profile == Profile::Dop14F32 && self.triangles == triangles
    }
}
