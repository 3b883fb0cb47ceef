//! The parts of a glTF document that say where numbers are and of which type: accessors, buffer views and buffers.

use super::whole::{self, Number};
use crate::error::excerpt;
use serde::Deserialize;
use std::fmt;

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Accessor {
    #[serde(default, deserialize_with = "whole::maybe")]
    pub(super) buffer_view: Option<usize>,
    #[serde(default, deserialize_with = "whole::one")]
    pub(super) byte_offset: u64,
    pub(super) component_type: ComponentType,
    #[serde(default)]
    pub(super) normalized: bool,
    #[serde(deserialize_with = "whole::one")]
    pub(super) count: u64,
    #[serde(rename = "type")]
    pub(super) dimensions: Dimensions,
    pub(super) sparse: Option<Sparse>,
}

/// The type of the numbers.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Deserialize)]
#[serde(from = "Number")]
pub(super) enum ComponentType {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
    Unknown(u64),
}

impl From<Number> for ComponentType {
    fn from(Number(number): Number) -> Self {
        match number {
            5120 => Self::I8,
            5121 => Self::U8,
            5122 => Self::I16,
            5123 => Self::U16,
            5125 => Self::U32,
            5126 => Self::F32,
            _ => Self::Unknown(number),
        }
    }
}

/// What the numbers form, such as `VEC3`.
#[derive(PartialEq, Eq, Debug, Deserialize)]
#[serde(from = "String")]
pub(super) enum Dimensions {
    Scalar,
    Vec3,
    Vec4,
    Mat4,
    /// What no triangle needs, or what is unknown.
    Other(Box<str>),
}

impl From<String> for Dimensions {
    fn from(name: String) -> Self {
        match name.as_str() {
            "SCALAR" => Self::Scalar,
            "VEC3" => Self::Vec3,
            "VEC4" => Self::Vec4,
            "MAT4" => Self::Mat4,
            _ => Self::Other(name.into()),
        }
    }
}

/// Says what an accessor holds, such as `VEC3 of f32`.
impl fmt::Display for Accessor {
    fn fmt(&self, to: &mut fmt::Formatter) -> fmt::Result {
        match &self.dimensions {
            Dimensions::Other(name) => write!(to, "{} of ", excerpt(name.as_bytes()))?,
            known => write!(to, "{} of ", format!("{known:?}").to_ascii_uppercase())?,
        }
        if self.normalized {
            to.write_str("normalized ")?;
        }
        match self.component_type {
            ComponentType::Unknown(number) => write!(to, "componentType {number}"),
            known => to.write_str(&format!("{known:?}").to_ascii_lowercase()),
        }
    }
}

/// Values of an accessor that replace others.
#[derive(Deserialize)]
pub(super) struct Sparse {
    #[serde(deserialize_with = "whole::one")]
    pub(super) count: u64,
    pub(super) indices: SparseIndices,
    pub(super) values: SparseValues,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct SparseIndices {
    #[serde(deserialize_with = "whole::one")]
    pub(super) buffer_view: usize,
    #[serde(default, deserialize_with = "whole::one")]
    pub(super) byte_offset: u64,
    pub(super) component_type: ComponentType,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct SparseValues {
    #[serde(deserialize_with = "whole::one")]
    pub(super) buffer_view: usize,
    #[serde(default, deserialize_with = "whole::one")]
    pub(super) byte_offset: u64,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct View {
    #[serde(deserialize_with = "whole::one")]
    pub(super) buffer: usize,
    #[serde(default, deserialize_with = "whole::one")]
    pub(super) byte_offset: u64,
    #[serde(deserialize_with = "whole::one")]
    pub(super) byte_length: u64,
    #[serde(default, deserialize_with = "whole::maybe")]
    pub(super) byte_stride: Option<u64>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Buffer {
    #[serde(deserialize_with = "whole::one")]
    pub(super) byte_length: u64,
    /// Data in base64, or a file; none for the bytes embedded in a binary file.
    pub(super) uri: Option<String>,
}
