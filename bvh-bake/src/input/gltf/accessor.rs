//! Reads the numbers of an accessor, dense or sparse, block by block, and checks every offset against the buffer.

use super::buffer::{Buffers, Bytes};
use super::schema::{Accessor, ComponentType, Dimensions};
use crate::error::{Fault, Halt, Place};

/// The number of bytes that are read at a time.
const BLOCK_BYTES: usize = 1 << 18;
/// The number of values that are passed on at a time.
const BLOCK_VALUES: usize = 1 << 14;

/// Finds the buffers of an accessor, so that their bytes count.
pub(super) fn find(accessor: &Accessor, buffers: &mut Buffers) -> Result<(), Fault> {
    accessor.views().try_for_each(|view| buffers.bytes(view).map(drop))
}

/// Reads positions in the type in which they are stored: f32, or integers under `KHR_mesh_quantization`. Passes them on
/// in order, some at a time.
pub(super) fn positions(
    number: usize,
    accessor: &Accessor,
    buffers: &mut Buffers,
    give: impl FnMut(&mut [[f64; 3]]) -> Result<(), Halt>,
) -> Result<(), Halt> {
    if accessor.dimensions != Dimensions::Vec3 || accessor.component_type == ComponentType::U32 {
        return Err(
            unexpected(number, accessor, "positions of three f32 or of three 8- or 16-bit integers").into()
        );
    }
    read::<3, _>(number, accessor, buffers, |position| position, give)
}

/// Reads vertex numbers. Passes them on in order, some at a time.
pub(super) fn indices(
    number: usize,
    accessor: &Accessor,
    buffers: &mut Buffers,
    mut give: impl FnMut(&[u32]) -> Result<(), Halt>,
) -> Result<(), Halt> {
    let is_plain = is_unsigned(accessor.component_type) && !accessor.normalized;
    if accessor.dimensions != Dimensions::Scalar || !is_plain {
        return Err(unexpected(number, accessor, "vertex numbers of 8, 16 or 32 bits").into());
    }
    // Every index is exact in f64 and in the range of u32.
    read::<1, _>(number, accessor, buffers, |[index]| index as u32, |indices| give(indices))
}

fn unexpected(number: usize, accessor: &Accessor, expected: &'static str) -> Fault {
    let found = format!("accessor {number} of {:?} {:?}", accessor.dimensions, accessor.component_type);
    Fault::new(Place::File, expected, found)
}

fn read<const N: usize, T: Clone>(
    number: usize,
    accessor: &Accessor,
    buffers: &mut Buffers,
    make: impl Fn([f64; N]) -> T,
    mut give: impl FnMut(&mut [T]) -> Result<(), Halt>,
) -> Result<(), Halt> {
    let (kind, normalized) = (accessor.component_type, accessor.normalized);
    let size = N * width(kind);
    let value = |bytes: &[u8]| {
        make(std::array::from_fn(|place| component(kind, normalized, &bytes[place * width(kind)..])))
    };
    let count = accessor.count;
    let mut dense = match accessor.buffer_view {
        Some(view) => Some(Rows::of(view, accessor.byte_offset, count, size, buffers)?),
        None => {
            // The values are zero except for the sparse ones, or they are the fallback of an extension that this reader
            // does not know.
            let room = match &accessor.sparse {
                Some(sparse) => buffers.bytes(sparse.values.buffer_view)?.length,
                None => 0,
            };
            if count > room {
                return Err(unexpected(number, accessor, "an accessor with a buffer view").into());
            }
            None
        }
    };
    let mut sparse = Sparse::of(accessor, size, buffers)?;
    let mut values = Vec::with_capacity(count.min(BLOCK_VALUES as u64) as usize);
    let mut first = 0;
    while first < count {
        let now = (count - first).min(BLOCK_VALUES as u64) as usize;
        values.clear();
        match &mut dense {
            Some(rows) => {
                for _ in 0..now {
                    values.push(value(rows.next()?));
                }
            }
            None => values.resize(now, make([0.0; N])),
        }
        if let Some(sparse) = &mut sparse {
            sparse.replace(first, &mut values, value)?;
        }
        give(&mut values)?;
        first += now as u64;
    }
    sparse.map_or(Ok(()), |sparse| sparse.finish(count))
}

/// The values of a sparse accessor that replace others.
struct Sparse<'a> {
    kind: ComponentType,
    indices: Rows<'a>,
    values: Rows<'a>,
    /// The place that the next value replaces.
    next: Option<u64>,
    last: u64,
}

impl<'a> Sparse<'a> {
    fn of(accessor: &Accessor, size: usize, buffers: &mut Buffers<'a>) -> Result<Option<Self>, Fault> {
        let Some(sparse) = &accessor.sparse else { return Ok(None) };
        let (at, replacements, kind) = (&sparse.indices, &sparse.values, sparse.indices.component_type);
        if !is_unsigned(kind) {
            let expected = "sparse indices of 8, 16 or 32 bits";
            return Err(Fault::new(Place::File, expected, format!("{kind:?}")));
        }
        let indices = Rows::of(at.buffer_view, at.byte_offset, sparse.count, width(kind), buffers)?;
        let values =
            Rows::of(replacements.buffer_view, replacements.byte_offset, sparse.count, size, buffers)?;
        let mut sparse = Self { kind, indices, values, next: None, last: 0 };
        sparse.advance()?;
        Ok(Some(sparse))
    }

    fn advance(&mut self) -> Result<(), Fault> {
        if self.indices.left == 0 {
            self.next = None;
            return Ok(());
        }
        let next = component(self.kind, false, self.indices.next()?) as u64;
        if next < self.last {
            let expected = format!("sparse indices in ascending order, after {}", self.last);
            return Err(Fault::new(Place::File, expected, next.to_string()));
        }
        (self.next, self.last) = (Some(next), next);
        Ok(())
    }

    /// Replaces values that begin with the one at the place `first`.
    fn replace<T>(&mut self, first: u64, values: &mut [T], make: impl Fn(&[u8]) -> T) -> Result<(), Fault> {
        while let Some(slot) = self.next.and_then(|place| values.get_mut((place - first) as usize)) {
            *slot = make(self.values.next()?);
            self.advance()?;
        }
        Ok(())
    }

    /// Checks that nothing is left after `count` values.
    fn finish(self, count: u64) -> Result<(), Halt> {
        match self.next {
            None => Ok(()),
            Some(place) => {
                let expected = format!("sparse indices below {count}");
                Err(Fault::new(Place::File, expected, place.to_string()).into())
            }
        }
    }
}

/// The bytes of rows, which are read in order.
struct Rows<'a> {
    bytes: Bytes<'a>,
    /// The offset of the row after those in the block.
    offset: u64,
    stride: usize,
    size: usize,
    /// The rows that have not been returned.
    left: u64,
    block: Vec<u8>,
    /// The place in the block of the next row, and the number of rows from there on.
    at: usize,
    in_block: usize,
}

impl<'a> Rows<'a> {
    /// Makes a reader of `count` rows of `size` bytes.
    fn of(
        view: usize,
        offset: u64,
        count: u64,
        size: usize,
        buffers: &mut Buffers<'a>,
    ) -> Result<Self, Fault> {
        let (bytes, found) = (buffers.bytes(view)?, buffers.view(view));
        let stride = found.byte_stride.unwrap_or(size as u64);
        let (start, length) = (found.byte_offset, found.byte_length);
        let is_inside = start.checked_add(length).is_some_and(|end| end <= bytes.length);
        let room = if is_inside { length.saturating_sub(offset) } else { 0 };
        let needed = match count {
            0 => Some(0),
            _ => (count - 1).checked_mul(stride).and_then(|whole| whole.checked_add(size as u64)),
        };
        if needed.is_none_or(|needed| needed > room) {
            let expected = format!("at most {room} bytes, which is what buffer view {view} holds");
            return Err(Fault::new(Place::File, expected, format!("{count} rows of {stride} bytes")));
        }
        let (offset, stride) = (start + offset, stride as usize);
        Ok(Self { bytes, offset, stride, size, left: count, block: Vec::new(), at: 0, in_block: 0 })
    }

    /// Returns the next row, of which there must be one.
    #[inline]
    fn next(&mut self) -> Result<&[u8], Fault> {
        if self.in_block == 0 {
            self.fill()?;
        }
        let row = self.at..self.at + self.size;
        self.at += self.stride;
        self.in_block -= 1;
        self.left -= 1;
        Ok(&self.block[row])
    }

    /// Reads the next rows.
    #[cold]
    fn fill(&mut self) -> Result<(), Fault> {
        let rows = self.left.clamp(1, (BLOCK_BYTES / self.stride).max(1) as u64) as usize;
        self.block.resize((rows - 1) * self.stride + self.size, 0);
        self.bytes.read(self.offset, &mut self.block)?;
        self.offset += (rows * self.stride) as u64;
        (self.at, self.in_block) = (0, rows);
        Ok(())
    }
}

fn is_unsigned(kind: ComponentType) -> bool {
    matches!(kind, ComponentType::U8 | ComponentType::U16 | ComponentType::U32)
}

fn width(kind: ComponentType) -> usize {
    match kind {
        ComponentType::I8 | ComponentType::U8 => 1,
        ComponentType::I16 | ComponentType::U16 => 2,
        ComponentType::U32 | ComponentType::F32 => 4,
    }
}

/// Returns one number. Normalized integers represent the range from -1 to 1.
fn component(kind: ComponentType, normalized: bool, bytes: &[u8]) -> f64 {
    let (value, largest) = match kind {
        ComponentType::I8 => (f64::from(bytes[0] as i8), f64::from(i8::MAX)),
        ComponentType::U8 => (f64::from(bytes[0]), f64::from(u8::MAX)),
        ComponentType::I16 => (f64::from(i16::from_le_bytes([bytes[0], bytes[1]])), f64::from(i16::MAX)),
        ComponentType::U16 => (f64::from(u16::from_le_bytes([bytes[0], bytes[1]])), f64::from(u16::MAX)),
        ComponentType::U32 => {
            (f64::from(u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]])), f64::from(u32::MAX))
        }
        ComponentType::F32 => return f64::from(f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]])),
    };
    if normalized { (value / largest).max(-1.0) } else { value }
}
