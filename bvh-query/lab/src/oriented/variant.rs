//! The bounds that are compared, and their bytes.

use super::bounds::{Choice, Ends, Frames, Making};
use super::walk::Test;
use bvh_format::kdop::DirectionSet::{self, Dop6, Dop14, Dop26};

/// One kind of bounds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Variant {
    pub(super) name: &'static str,
    pub(super) making: Making,
    pub(super) test: Test,
    /// Bytes of a treelet of four children with their links, its own frame included, and bytes of an anchor.
    pub(super) bytes: [u32; 2],
}

impl Variant {
    const fn new(name: &'static str, set: DirectionSet, frames: Frames, choice: Choice) -> Self {
        let making = Making { set, frames, choice, ends: Ends::Eight, frame_bits: 10, turning: true };
        // Codes, 4 bytes of kinds and 4 of links, and turning slabs of 4 bytes per child, in whole half lines: what
        // remains has room for a frame where a treelet has one. Anchors of dop26 have room for one.
        let bytes = match set {
            Dop6 => [64, 32],
            Dop14 => [96, 64],
            Dop26 => [128, 128],
        };
        Self { name, making, test: Test::Slabs, bytes }
    }

    const fn plain(mut self) -> Self {
        self.making.turning = false;
        self
    }

    const fn twelve(mut self) -> Self {
        self.making.ends = Ends::Twelve;
        self
    }

    const fn in_bytes(mut self, treelet: u32, anchor: u32) -> Self {
        self.bytes = [treelet, anchor];
        self
    }

    const fn with(mut self, test: Test) -> Self {
        self.test = test;
        self
    }

    const fn exact(mut self) -> Self {
        self.making.ends = Ends::Full;
        self
    }
}

/// The place of what the format has.
pub(super) const TODAY: usize = 1;

/// All of them.
pub(super) const VARIANTS: [Variant; 32] = [
    Variant::new("dop26, fixed", Dop26, Frames::Object, Choice::Least).plain(),
    Variant::new("dop26, fixed, turning: today", Dop26, Frames::Object, Choice::Least),
    Variant::new("dop26 per anchor, turning", Dop26, Frames::Anchor, Choice::Least),
    Variant::new("dop26 per anchor, covariance, turning", Dop26, Frames::Anchor, Choice::Covariance),
    Variant::new("dop26 per anchor, normal, turning", Dop26, Frames::Anchor, Choice::Normal),
    Variant::new("dop26 per anchor", Dop26, Frames::Anchor, Choice::Least).plain(),
    Variant::new("dop26 per 2 levels, turning", Dop26, Frames::Levels(2), Choice::Least).in_bytes(132, 128),
    Variant::new("dop26 per treelet, turning", Dop26, Frames::Treelet, Choice::Least).in_bytes(132, 128),
    Variant::new("dop26 per treelet, normal, turning", Dop26, Frames::Treelet, Choice::Normal)
        .in_bytes(132, 128),
    Variant::new("dop26 per treelet, covariance, turning", Dop26, Frames::Treelet, Choice::Covariance)
        .in_bytes(132, 128),
    Variant::new("dop26 per treelet", Dop26, Frames::Treelet, Choice::Least).plain(),
    Variant::new("dop14, fixed", Dop14, Frames::Object, Choice::Least).plain().in_bytes(64, 64),
    Variant::new("dop14, fixed, turning", Dop14, Frames::Object, Choice::Least),
    Variant::new("dop14 per anchor, turning", Dop14, Frames::Anchor, Choice::Least).in_bytes(96, 96),
    Variant::new("dop14 per anchor, normal, turning", Dop14, Frames::Anchor, Choice::Normal).in_bytes(96, 96),
    Variant::new("dop14 per 2 levels, turning", Dop14, Frames::Levels(2), Choice::Least),
    Variant::new("dop14 per treelet, turning", Dop14, Frames::Treelet, Choice::Least),
    Variant::new("dop6, fixed, turning", Dop6, Frames::Object, Choice::Least),
    Variant::new("dop6 per treelet", Dop6, Frames::Treelet, Choice::Least).plain(),
    Variant::new("dop6 per treelet, covariance", Dop6, Frames::Treelet, Choice::Covariance).plain(),
    Variant::new("dop6 per treelet, 12 bits", Dop6, Frames::Treelet, Choice::Least).plain().twelve(),
    Variant::new("dop6 per treelet, turning", Dop6, Frames::Treelet, Choice::Least),
    Variant::new("dop6 per treelet, products", Dop6, Frames::Treelet, Choice::Least)
        .plain()
        .with(Test::Products),
    Variant::new("dop6 per treelet, products, turning", Dop6, Frames::Treelet, Choice::Least)
        .with(Test::Products),
    Variant::new("ideal boxes, covariance", Dop6, Frames::Child, Choice::Covariance)
        .plain()
        .exact()
        .in_bytes(0, 0)
        .with(Test::Boxes),
    Variant::new("ideal boxes, least", Dop6, Frames::Child, Choice::Least)
        .plain()
        .exact()
        .in_bytes(0, 0)
        .with(Test::Boxes),
    Variant::new("ideal rectangles with a radius", Dop6, Frames::Child, Choice::Covariance)
        .plain()
        .exact()
        .in_bytes(0, 0)
        .with(Test::Spheres),
    Variant::new("today, ideal boxes beside", Dop26, Frames::Object, Choice::Least)
        .in_bytes(0, 0)
        .with(Test::Beside),
    Variant::new("today, all slabs along the same directions", Dop26, Frames::Object, Choice::Least)
        .in_bytes(0, 0)
        .with(Test::Search(0)),
    Variant::new("today, a search of 2 levels", Dop26, Frames::Object, Choice::Least)
        .in_bytes(0, 0)
        .with(Test::Search(2)),
    Variant::new("today, best direction", Dop26, Frames::Object, Choice::Least)
        .in_bytes(0, 0)
        .with(Test::Search(6)),
    Variant::new("dop26 per anchor, covariance, best direction", Dop26, Frames::Anchor, Choice::Covariance)
        .in_bytes(0, 0)
        .with(Test::Search(6)),
];
