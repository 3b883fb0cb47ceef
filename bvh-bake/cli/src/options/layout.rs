//! The layout of nodes and triangles: `--profile` and `--triangles`.

use bvh_bake::Options;
use bvh_format::leaf::TriangleEncoding;
use bvh_format::profile::Profile;
use clap::Args;

/// How nodes and triangles are stored.
#[derive(Debug, Args)]
pub(crate) struct LayoutArguments {
    /// Bounding volumes: auto, dop14-u8, dop6-u8, dop6-f16, dop14-f32, dop26-u4 or dop26-u8-wide
    #[arg(long, value_name = "P", default_value = "auto", value_parser = profile)]
    pub(crate) profile: Choice<Profile>,
    /// Triangles: auto, f32 (the fastest), packed (the same values in fewer bytes) or quantized (vertices move a little)
    #[arg(long, value_name = "T", default_value = "auto", value_parser = triangles)]
    pub(crate) triangles: Choice<TriangleEncoding>,
}

impl LayoutArguments {
    /// Returns the default options with this layout.
    pub(crate) fn to_options(&self) -> Options {
        Options::default().profile(self.profile.named()).triangles(self.triangles.named())
    }

    /// Returns whether vertices may move, so that `--max-error` has a meaning.
    pub(crate) fn is_quantized(&self) -> bool {
        self.triangles.named() == Some(TriangleEncoding::Quantized)
    }
}

/// A choice by name, or the baker's.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Choice<T> {
    Auto,
    Named(T),
}

impl<T: Copy> Choice<T> {
    /// Returns the choice as the baker's options have it: `None` leaves it to the baker.
    pub(crate) fn named(self) -> Option<T> {
        match self {
            Self::Auto => None,
            Self::Named(choice) => Some(choice),
        }
    }
}

/// Parses the name of a profile.
pub(crate) fn profile(name: &str) -> Result<Choice<Profile>, String> {
    if name == "auto" {
        return Ok(Choice::Auto);
    }
    let names: Vec<_> = Profile::ALL.into_iter().map(Profile::name).collect();
    Profile::from_name(name).map(Choice::Named).ok_or_else(|| format!("expected auto, {}", names.join(", ")))
}

/// Parses the name of a triangle encoding.
pub(crate) fn triangles(name: &str) -> Result<Choice<TriangleEncoding>, String> {
    if name == "auto" {
        return Ok(Choice::Auto);
    }
    let encoding = TriangleEncoding::ALL.into_iter().find(|encoding| encoding.name() == name);
    encoding.map(Choice::Named).ok_or_else(|| "expected auto, f32, packed or quantized".to_owned())
}
