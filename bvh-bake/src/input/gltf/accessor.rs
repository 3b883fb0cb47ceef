//! Reads the numbers of an accessor, dense or sparse, and checks every offset against the buffer.

use super::buffer::Buffers;
use crate::error::{Fault, Place};
use gltf::Accessor;
use gltf::accessor::{DataType, Dimensions, sparse::IndexType};
use gltf::buffer::View;

/// Reads positions in the type in which they are stored: f32, or integers under `KHR_mesh_quantization`.
pub(super) fn positions(accessor: &Accessor, buffers: &mut Buffers) -> Result<Vec<[f64; 3]>, Fault> {
    if accessor.dimensions() != Dimensions::Vec3 || accessor.data_type() == DataType::U32 {
        return Err(unexpected(accessor, "positions of three f32 or of three 8- or 16-bit integers"));
    }
    read::<3, _>(accessor, buffers, |position| position)
}

/// Reads vertex numbers.
pub(super) fn indices(accessor: &Accessor, buffers: &mut Buffers) -> Result<Vec<u32>, Fault> {
    let unsigned = matches!(accessor.data_type(), DataType::U8 | DataType::U16 | DataType::U32);
    if accessor.dimensions() != Dimensions::Scalar || !unsigned || accessor.normalized() {
        return Err(unexpected(accessor, "vertex numbers of 8, 16 or 32 bits"));
    }
    // Every index is exact in f64 and in the range of u32.
    read::<1, _>(accessor, buffers, |[index]| index as u32)
}

fn unexpected(accessor: &Accessor, expected: &'static str) -> Fault {
    let found =
        format!("accessor {} of {:?} {:?}", accessor.index(), accessor.dimensions(), accessor.data_type());
    Fault::new(Place::File, expected, found)
}

fn read<const N: usize, T: Clone>(
    accessor: &Accessor,
    buffers: &mut Buffers,
    make: impl Fn([f64; N]) -> T,
) -> Result<Vec<T>, Fault> {
    let (kind, normalized) = (accessor.data_type(), accessor.normalized());
    let size = N * width(kind);
    let value = |bytes: &[u8]| {
        make(std::array::from_fn(|place| component(kind, normalized, &bytes[place * width(kind)..])))
    };
    let mut values = match accessor.view() {
        Some(view) => rows(&view, accessor.offset(), accessor.count(), size, buffers)?.map(value).collect(),
        None => {
            // The values are zero except for the sparse ones, or they are the fallback of an extension that this reader
            // does not know.
            let room = match accessor.sparse() {
                Some(sparse) => buffers.bytes(&sparse.values().view().buffer())?.len(),
                None => 0,
            };
            if accessor.count() > room {
                return Err(unexpected(accessor, "an accessor with a buffer view"));
            }
            vec![make([0.0; N]); accessor.count()]
        }
    };
    if let Some(sparse) = accessor.sparse() {
        let index_kind = match sparse.indices().index_type() {
            IndexType::U8 => DataType::U8,
            IndexType::U16 => DataType::U16,
            IndexType::U32 => DataType::U32,
        };
        let at = sparse.indices();
        let places: Vec<usize> = rows(&at.view(), at.offset(), sparse.count(), width(index_kind), buffers)?
            .map(|bytes| component(index_kind, false, bytes) as usize)
            .collect();
        let replacements = sparse.values();
        let rows = rows(&replacements.view(), replacements.offset(), sparse.count(), size, buffers)?;
        for (place, bytes) in places.into_iter().zip(rows) {
            let count = values.len();
            let slot = values.get_mut(place).ok_or_else(|| {
                Fault::new(Place::File, format!("sparse indices below {count}"), place.to_string())
            })?;
            *slot = value(bytes);
        }
    }
    Ok(values)
}

/// Returns the bytes of each of `count` rows of `size` bytes.
fn rows<'b>(
    view: &View,
    offset: usize,
    count: usize,
    size: usize,
    buffers: &'b mut Buffers,
) -> Result<impl Iterator<Item = &'b [u8]> + use<'b>, Fault> {
    let buffer = buffers.bytes(&view.buffer())?;
    let stride = view.stride().unwrap_or(size);
    let bytes = buffer.get(view.offset()..).and_then(|rest| rest.get(..view.length())).unwrap_or_default();
    let bytes = bytes.get(offset..).unwrap_or_default();
    let needed = match count {
        0 => Some(0),
        _ => (count - 1).checked_mul(stride).and_then(|whole| whole.checked_add(size)),
    };
    if needed.is_none_or(|needed| needed > bytes.len()) {
        let expected =
            format!("at most {} bytes, which is what buffer view {} holds", bytes.len(), view.index());
        return Err(Fault::new(Place::File, expected, format!("{count} rows of {stride} bytes")));
    }
    Ok((0..count).map(move |row| &bytes[row * stride..row * stride + size]))
}

fn width(kind: DataType) -> usize {
    match kind {
        DataType::I8 | DataType::U8 => 1,
        DataType::I16 | DataType::U16 => 2,
        DataType::U32 | DataType::F32 => 4,
    }
}

/// Returns one number. Normalized integers represent the range from -1 to 1.
fn component(kind: DataType, normalized: bool, bytes: &[u8]) -> f64 {
    let (value, largest) = match kind {
        DataType::I8 => (f64::from(bytes[0] as i8), f64::from(i8::MAX)),
        DataType::U8 => (f64::from(bytes[0]), f64::from(u8::MAX)),
        DataType::I16 => (f64::from(i16::from_le_bytes([bytes[0], bytes[1]])), f64::from(i16::MAX)),
        DataType::U16 => (f64::from(u16::from_le_bytes([bytes[0], bytes[1]])), f64::from(u16::MAX)),
        DataType::U32 => {
            (f64::from(u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]])), f64::from(u32::MAX))
        }
        DataType::F32 => return f64::from(f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]])),
    };
    if normalized { (value / largest).max(-1.0) } else { value }
}
