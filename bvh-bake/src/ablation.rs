//! Departures from the usual tree and order of pages, for measuring what the usual ones are worth.
//!
//! Files made with them keep all rules of the format. They are no options for users: nothing here is stable.

/// What a bake does otherwise than usual. The default changes nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Ablation {
    /// How nodes are split.
    pub splits: SplitRule,
    /// How pages follow each other.
    pub pages: PageOrder,
}

/// How a node's triangles are split in two.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum SplitRule {
    /// By how often a partner of the parent's size meets a side: see `boxes::Cost`.
    #[default]
    Reach,
    /// By the surface areas of the sides' boxes (the surface area heuristic).
    SurfaceArea,
    /// Halves along the longest axis of the box, in whole treelets. Bricks are divided as usual.
    Median,
}

impl SplitRule {
    /// All of them, the usual one first.
    pub const ALL: [Self; 3] = [Self::Reach, Self::SurfaceArea, Self::Median];

    /// A name for tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Reach => "reach",
            Self::SurfaceArea => "surface-area",
            Self::Median => "median",
        }
    }
}

/// In which order the pages of an object follow each other. Whatever it asks for, a page comes after all pages
/// that link to it, since the format demands that; of those that may come next, it picks the one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum PageOrder {
    /// As planned: level by level from the root, each depth-first, and brick by brick.
    #[default]
    Levels,
    /// A page, then all below its first link, and so on.
    DepthFirst,
    /// By the number of links from the root.
    BreadthFirst,
    /// The upper half of the levels, then each part below it, all of them again so: van Emde Boas.
    VanEmdeBoas,
}

impl PageOrder {
    /// All of them, the usual one first.
    pub const ALL: [Self; 4] = [Self::Levels, Self::DepthFirst, Self::BreadthFirst, Self::VanEmdeBoas];

    /// A name for tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Levels => "levels",
            Self::DepthFirst => "depth-first",
            Self::BreadthFirst => "breadth-first",
            Self::VanEmdeBoas => "van-emde-boas",
        }
    }
}
