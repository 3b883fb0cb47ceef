//! Reads the numbers of an accessor, dense or sparse, block by block, and checks every offset against the buffer.

use super::buffer::{Buffers, Bytes};
use super::data::{Accessor, ComponentType, Dimensions};
use super::schema::wrong;
use crate::error::{Fault, Place};

/// The number of bytes that are read at a time from an accessor, if it is the only one.
pub(super) const BLOCK_BYTES: usize = 1 << 18;
/// The number of values that are passed on at a time.
pub(super) const BLOCK_VALUES: usize = 1 << 14;

/// What an accessor must hold.
pub(super) struct Wanted {
    dimensions: Dimensions,
    /// Whether numbers of a type will do, normalized or not.
    fits: fn(ComponentType, bool) -> bool,
    /// The values, for messages.
    name: &'static str,
    /// Whether the values are zero if the accessor has none. It may be that they are in an extension that is not known.
    may_be_zero: bool,
}

/// Positions, in the type in which they are stored: f32, or integers under `KHR_mesh_quantization`.
pub(super) const POSITIONS: Wanted = Wanted {
    dimensions: Dimensions::Vec3,
    fits: |kind, _| kind == ComponentType::F32 || is_narrow(kind),
    name: "positions: VEC3 of f32, or of integers of 8 or 16 bits",
    may_be_zero: false,
};
/// What a morph target adds to positions.
pub(super) const DELTAS: Wanted = Wanted { may_be_zero: true, ..POSITIONS };
/// Vertex numbers.
pub(super) const INDICES: Wanted = Wanted {
    dimensions: Dimensions::Scalar,
    fits: |kind, normalized| is_unsigned(kind) && !normalized,
    name: "vertex numbers: SCALAR of u8, u16 or u32",
    may_be_zero: false,
};
/// The joints of a vertex.
pub(super) const JOINTS: Wanted = Wanted {
    dimensions: Dimensions::Vec4,
    fits: |kind, normalized| is_unsigned(kind) && is_narrow(kind) && !normalized,
    name: "joints: VEC4 of u8 or u16",
    may_be_zero: false,
};
/// The weights of these joints. Integers that are not normalized have the same ratios, and are divided by their sum.
pub(super) const WEIGHTS: Wanted = Wanted {
    dimensions: Dimensions::Vec4,
    fits: |kind, _| kind == ComponentType::F32 || is_unsigned(kind) && is_narrow(kind),
    name: "weights: VEC4 of f32, u8 or u16",
    may_be_zero: false,
};
/// The matrices that take a skin to its joints.
pub(super) const MATRICES: Wanted = Wanted {
    dimensions: Dimensions::Mat4,
    fits: |kind, _| kind == ComponentType::F32,
    name: "matrices: MAT4 of f32",
    may_be_zero: false,
};
/// Translations or scales of instances.
pub(super) const TRANSLATIONS: Wanted = Wanted {
    dimensions: Dimensions::Vec3,
    fits: |kind, _| kind == ComponentType::F32,
    name: "translations or scales: VEC3 of f32",
    may_be_zero: false,
};
/// Rotations of instances, as quaternions.
pub(super) const ROTATIONS: Wanted = Wanted {
    dimensions: Dimensions::Vec4,
    fits: |kind, normalized| kind == ComponentType::F32 || is_narrow(kind) && normalized,
    name: "rotations: VEC4 of f32, or of normalized integers of 8 or 16 bits",
    may_be_zero: false,
};

/// Reads the values of an accessor in order, N numbers each.
pub(super) struct Reader<'a, const N: usize> {
    kind: ComponentType,
    normalized: bool,
    /// The stored values; `None` if all are zero but for sparse ones.
    dense: Option<Rows<'a>>,
    sparse: Option<Sparse<'a>>,
    /// The values that have been read, and the number of all.
    first: u64,
    count: u64,
}

impl<'a, const N: usize> Reader<'a, N> {
    /// Makes a reader of an accessor, which holds blocks of `block_bytes` bytes, but at least one value.
    pub(super) fn of(
        number: usize,
        accessor: &Accessor,
        wanted: &Wanted,
        block_bytes: usize,
        buffers: &mut Buffers<'a>,
    ) -> Result<Self, Fault> {
        let (kind, normalized, count) = (accessor.component_type, accessor.normalized, accessor.count);
        let unfit = |expected: &'static str| {
            Fault::new(Place::File, expected, format!("{accessor} in accessors[{number}]"))
        };
        if accessor.dimensions != wanted.dimensions || !(wanted.fits)(kind, normalized) {
            return Err(unfit(wanted.name));
        }
        let mut rows = |view, offset, count, size| {
            Rows::of(number, Range { view, offset, count, size }, block_bytes, buffers)
        };
        let size = N * width(kind);
        let dense = match accessor.buffer_view {
            Some(view) => Some(rows(view, accessor.byte_offset, count, size)?),
            None => None,
        };
        let sparse = match &accessor.sparse {
            None => None,
            Some(sparse) => {
                let (at, values, kind) = (&sparse.indices, &sparse.values, sparse.indices.component_type);
                if !is_unsigned(kind) {
                    let found = format!("{kind:?} in accessors[{number}]");
                    return Err(Fault::new(Place::File, "sparse indices of 8, 16 or 32 bits", found));
                }
                let indices = rows(at.buffer_view, at.byte_offset, sparse.count, width(kind))?;
                let values = rows(values.buffer_view, values.byte_offset, sparse.count, size)?;
                Some(Sparse::of(number, kind, indices, values)?)
            }
        };
        // Zeros take no bytes, so that any number of them may be declared.
        let room = sparse.as_ref().map_or(0, |sparse| sparse.values.bytes.length);
        if dense.is_none() && !wanted.may_be_zero && count > room {
            return Err(unfit("an accessor with a buffer view"));
        }
        Ok(Self { kind, normalized, dense, sparse, first: 0, count })
    }

    /// Reads the next values, at most `most` of them, as `make` makes them of numbers. None are left if there are none.
    pub(super) fn block<T: Clone>(
        &mut self,
        most: usize,
        values: &mut Vec<T>,
        make: impl Fn([f64; N]) -> T,
    ) -> Result<(), Fault> {
        let (kind, normalized) = (self.kind, self.normalized);
        let value = |bytes: &[u8]| {
            make(std::array::from_fn(|place| component(kind, normalized, &bytes[place * width(kind)..])))
        };
        let now = (self.count - self.first).min(most as u64) as usize;
        values.clear();
        match &mut self.dense {
            Some(rows) => {
                for _ in 0..now {
                    values.push(value(rows.next()?));
                }
            }
            None => values.resize(now, make([0.0; N])),
        }
        if let Some(sparse) = &mut self.sparse {
            sparse.replace(self.first, values, value)?;
        }
        self.first += now as u64;
        match &self.sparse {
            Some(sparse) if self.first == self.count => sparse.finish(self.count),
            _ => Ok(()),
        }
    }
}

/// The values of a sparse accessor that replace others.
struct Sparse<'a> {
    /// The number of the accessor.
    number: usize,
    kind: ComponentType,
    indices: Rows<'a>,
    values: Rows<'a>,
    /// The place that the next value replaces.
    next: Option<u64>,
    last: u64,
}

impl<'a> Sparse<'a> {
    fn of(number: usize, kind: ComponentType, indices: Rows<'a>, values: Rows<'a>) -> Result<Self, Fault> {
        let mut sparse = Self { number, kind, indices, values, next: None, last: 0 };
        sparse.advance()?;
        Ok(sparse)
    }

    fn advance(&mut self) -> Result<(), Fault> {
        if self.indices.left == 0 {
            self.next = None;
            return Ok(());
        }
        let next = component(self.kind, false, self.indices.next()?) as u64;
        if next < self.last {
            let expected = format!("sparse indices in ascending order, after {}", self.last);
            return Err(Fault::new(Place::File, expected, format!("{next} in accessors[{}]", self.number)));
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
    fn finish(&self, count: u64) -> Result<(), Fault> {
        match self.next {
            None => Ok(()),
            Some(place) => {
                let expected = format!("sparse indices below {count}");
                Err(Fault::new(Place::File, expected, format!("{place} in accessors[{}]", self.number)))
            }
        }
    }
}

/// The bytes of rows, which are read in order.
struct Rows<'a> {
    bytes: Bytes<'a>,
    /// The offset of the row after those in the block.
    offset: u64,
    stride: u64,
    size: usize,
    /// The rows that have not been returned.
    left: u64,
    /// The number of bytes that are read at a time.
    block_bytes: usize,
    block: Vec<u8>,
    /// The place in the block of the next row, and the number of rows from there on.
    at: usize,
    in_block: usize,
}

/// The rows of a buffer view that an accessor needs: `count` of `size` bytes, from an offset on.
struct Range {
    view: usize,
    offset: u64,
    count: u64,
    size: usize,
}

impl<'a> Rows<'a> {
    /// Makes a reader of rows for an accessor.
    fn of(
        accessor: usize,
        Range { view, offset, count, size }: Range,
        block_bytes: usize,
        buffers: &mut Buffers<'a>,
    ) -> Result<Self, Fault> {
        let found = buffers.view(view, accessor)?;
        let bytes = buffers.bytes(view, accessor)?;
        // A stride of 0 means, in old files, that rows follow each other. Nothing follows a single row.
        let stride = match found.byte_stride.filter(|&stride| stride > 0 && count > 1) {
            None => size as u64,
            Some(stride) if stride >= size as u64 => stride,
            Some(stride) => {
                let expected =
                    format!("byteStride of at least {size}, the bytes of a value of accessors[{accessor}]");
                return Err(wrong(&expected, &format!("{stride} in bufferViews[{view}]")));
            }
        };
        let (start, length) = (found.byte_offset, found.byte_length);
        let is_inside = start.checked_add(length).is_some_and(|end| end <= bytes.length);
        let room = if is_inside { length.saturating_sub(offset) } else { 0 };
        let needed = match count {
            0 => Some(0),
            _ => (count - 1).checked_mul(stride).and_then(|whole| whole.checked_add(size as u64)),
        };
        if needed.is_none_or(|needed| needed > room) {
            let expected = format!("at most {room} bytes, which is what buffer view {view} holds");
            let found = format!("{count} values, one every {stride} bytes, in accessors[{accessor}]");
            return Err(Fault::new(Place::File, expected, found));
        }
        let offset = start.saturating_add(offset);
        Ok(Self {
            bytes,
            offset,
            stride,
            size,
            left: count,
            block_bytes,
            block: Vec::new(),
            at: 0,
            in_block: 0,
        })
    }

    /// Returns the next row, of which there must be one.
    #[inline]
    fn next(&mut self) -> Result<&[u8], Fault> {
        if self.in_block == 0 {
            self.fill()?;
        }
        let row = self.at..self.at + self.size;
        self.at += self.stride as usize;
        self.in_block -= 1;
        self.left -= 1;
        Ok(&self.block[row])
    }

    /// Reads the next rows.
    #[cold]
    fn fill(&mut self) -> Result<(), Fault> {
        let rows = self.left.clamp(1, (self.block_bytes as u64 / self.stride).max(1));
        self.block.resize(((rows - 1) * self.stride) as usize + self.size, 0);
        self.bytes.read(self.offset, &mut self.block)?;
        self.offset += rows * self.stride;
        (self.at, self.in_block) = (0, rows as usize);
        Ok(())
    }
}

fn is_unsigned(kind: ComponentType) -> bool {
    matches!(kind, ComponentType::U8 | ComponentType::U16 | ComponentType::U32)
}

fn is_narrow(kind: ComponentType) -> bool {
    matches!(kind, ComponentType::I8 | ComponentType::U8 | ComponentType::I16 | ComponentType::U16)
}

fn width(kind: ComponentType) -> usize {
    match kind {
        ComponentType::I8 | ComponentType::U8 => 1,
        ComponentType::I16 | ComponentType::U16 => 2,
        ComponentType::U32 | ComponentType::F32 => 4,
        ComponentType::Unknown(_) => unreachable!("no reader is made for a type that is not known"),
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
        ComponentType::Unknown(_) => unreachable!("no reader is made for a type that is not known"),
        ComponentType::F32 => return f64::from(f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]])),
    };
    if normalized { (value / largest).max(-1.0) } else { value }
}
