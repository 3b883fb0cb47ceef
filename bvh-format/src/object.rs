//! The object table: one record per named mesh in the file, then their names.
//!
//! The section starts with `u32` number of objects, `u32` bytes of names and eight zero bytes; then
//! come the records, then the names (UTF-8, no terminators).

use crate::error::{FormatError, ensure};
use crate::leaf::TriangleEncoding;
use crate::profile::Profile;
use crate::rule::Rule;
use zerocopy::byteorder::little_endian::{F32, F64, I32, U32, U64};
use zerocopy::{FromBytes, Immutable, IntoBytes, KnownLayout, Unaligned};

/// The largest magnitude of a coordinate, 2^120, and of an origin.
pub const MAX_COORDINATE: f64 = (1u128 << 120) as f64;
/// Exponents of f16 residuals for which every product of a code and the unit is exact.
pub const F16_EXPONENTS: std::ops::RangeInclusive<i32> = -125..=112;
/// Bytes before the first record.
const TABLE_HEAD: usize = 16;

/// An object's record. Lengths are in mesh units; coordinates are around `origin`.
#[derive(FromBytes, IntoBytes, KnownLayout, Immutable, Unaligned, Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct ObjectRecord {
    /// Byte offset of the name among the names.
    pub name_offset: U32,
    /// Bytes of the name.
    pub name_length: U32,
    /// A vertex of the mesh is `origin + v`, exact in f64.
    pub origin: [F64; 3],
    /// Lower corner of the axis-aligned box of all v.
    pub box_lo: [F32; 3],
    /// Upper corner.
    pub box_hi: [F32; 3],
    /// Triangles stored.
    pub triangles: U64,
    /// Leaf packets.
    pub packets: U64,
    /// Treelets.
    pub treelets: U64,
    /// Number of the first page; its first root is the object's root.
    pub first_page: U32,
    /// Pages of the object.
    pub pages: U32,
    /// Largest move of a vertex by rounding to `origin + f32`.
    pub max_vertex_rounding: F64,
    /// Largest move of a vertex by quantisation to a grid; 0 but for `quantized`.
    pub max_quantization_error: F64,
    /// Triangles of the input, of which ids are drawn.
    pub input_triangles: U64,
    /// Zero-area triangles among those stored.
    pub degenerate: U64,
    /// Exact duplicates left out.
    pub duplicates: U64,
    /// f16 residuals count 2^this.
    pub f16_exponent: I32,
    /// Number of the `Profile`.
    pub profile: u8,
    /// Number of the `TriangleEncoding`.
    pub triangle_encoding: u8,
    /// Zero.
    pub reserved: [u8; 2],
    /// Centre of a sphere around all v.
    pub sphere_centre: [F32; 3],
    /// Its radius, rounded up.
    pub sphere_radius: F32,
    /// Zero.
    pub reserved_end: [u8; 40],
}

const _: () = assert!(size_of::<ObjectRecord>() == 192);

/// An object of an opened file.
#[derive(Debug, Clone, PartialEq)]
pub struct Object {
    /// Its name, possibly empty.
    pub name: String,
    /// How its nodes are written.
    pub profile: Profile,
    /// How its triangles are written.
    pub triangle_encoding: TriangleEncoding,
    /// 2^`f16_exponent`.
    pub f16_scale: f32,
    /// The record.
    pub record: ObjectRecord,
}

impl Object {
    /// The numbers of its pages.
    pub fn pages(&self) -> std::ops::Range<u32> {
        let first = self.record.first_page.get();
        first..first + self.record.pages.get()
    }
}

/// Writes the object section.
pub fn write_objects(objects: &[(String, ObjectRecord)]) -> Vec<u8> {
    let names: usize = objects.iter().map(|(name, _)| name.len()).sum();
    let mut section = Vec::with_capacity(TABLE_HEAD + objects.len() * 192 + names);
    section.extend_from_slice(&(objects.len() as u32).to_le_bytes());
    section.extend_from_slice(&(names as u32).to_le_bytes());
    section.extend_from_slice(&[0; 8]);
    let mut offset = 0;
    for (name, record) in objects {
        let record =
            ObjectRecord { name_offset: offset.into(), name_length: (name.len() as u32).into(), ..*record };
        section.extend_from_slice(record.as_bytes());
        offset += name.len() as u32;
    }
    objects.iter().for_each(|(name, _)| section.extend_from_slice(name.as_bytes()));
    section
}

/// Reads the object section, which starts at byte `at` of the file.
///
/// # Errors
/// The first of rules 11 to 14 that does not hold; `node_pages` is the length of the node section.
pub fn read_objects(section: &[u8], at: u64, node_pages: u64) -> Result<Vec<Object>, FormatError> {
    let table = |found: String| FormatError::new(Rule::ObjectTable, at, "a whole object table", found);
    let (head, rest) =
        <[U32; 4]>::ref_from_prefix(section).map_err(|_| table(format!("{} bytes", section.len())))?;
    let count = head[0].get() as usize;
    let (records, names) = <[ObjectRecord]>::ref_from_prefix_with_elems(rest, count)
        .map_err(|_| table(format!("{count} objects in {} bytes", section.len())))?;
    let whole = count >= 1 && names.len() == head[1].get() as usize;
    ensure(whole, Rule::ObjectTable, at, || {
        (format!("an object and {} bytes of names", head[1]), format!("{count}, {}", names.len()))
    })?;
    let mut next_page = 0;
    // Copied names are no longer than the file: records that share theirs would multiply its size.
    let mut names_left = names.len();
    let mut objects = Vec::with_capacity(count);
    for (index, record) in records.iter().enumerate() {
        let at = at + (TABLE_HEAD + index * size_of::<ObjectRecord>()) as u64;
        check_numbers(record, at)?;
        let first = u64::from(record.first_page.get());
        let follows = first == next_page && record.pages.get() > 0;
        ensure(follows, Rule::ObjectPages, at + 80, || {
            (format!("pages from {next_page}"), format!("{} from {first}", record.pages))
        })?;
        next_page += u64::from(record.pages.get());
        objects.push(read_object(record, names, &mut names_left, at)?);
    }
    ensure(next_page == node_pages, Rule::ObjectPages, at, || {
        (format!("{node_pages} pages in all"), next_page.to_string())
    })?;
    Ok(objects)
}

/// `names_left` is how many bytes the names of this record and of those behind it may have together.
fn read_object(
    record: &ObjectRecord,
    names: &[u8],
    names_left: &mut usize,
    at: u64,
) -> Result<Object, FormatError> {
    let start = record.name_offset.get() as usize;
    let name = names.get(start..start.saturating_add(record.name_length.get() as usize));
    let name = name
        .and_then(|name| std::str::from_utf8(name).ok())
        .ok_or_else(|| FormatError::new(Rule::ObjectTable, at, "a UTF-8 name among the names", start))?;
    ensure(name.len() <= *names_left, Rule::ObjectTable, at + 4, || {
        (format!("at most {names_left} bytes of name behind the earlier ones"), name.len().to_string())
    })?;
    *names_left -= name.len();
    let unknown = |at, what, found| FormatError::new(Rule::ObjectProfile, at, what, found);
    let profile = Profile::from_number(record.profile)
        .ok_or_else(|| unknown(at + 132, "a profile from 0 to 9", record.profile))?;
    let triangle_encoding = TriangleEncoding::from_number(record.triangle_encoding)
        .ok_or_else(|| unknown(at + 133, "a triangle encoding from 0 to 2", record.triangle_encoding))?;
    let f16_scale = f32::from_bits(((record.f16_exponent.get() + 127) as u32) << 23);
    Ok(Object { name: name.to_owned(), profile, triangle_encoding, f16_scale, record: *record })
}

/// True for multiples of 2^-149, the smallest positive f32.
fn is_multiple_of_smallest(value: f64) -> bool {
    // At most 2^269: exact.
    (value * 2f64.powi(149)).fract() == 0.0
}

fn check_numbers(record: &ObjectRecord, at: u64) -> Result<(), FormatError> {
    let limit = MAX_COORDINATE;
    let coordinate = |v: f64| v.abs() <= limit;
    let origin = record.origin.iter().all(|v| coordinate(v.get()) && is_multiple_of_smallest(v.get()));
    let boxed = (0..3).all(|a| {
        let (lo, hi) = (f64::from(record.box_lo[a].get()), f64::from(record.box_hi[a].get()));
        coordinate(lo) && coordinate(hi) && lo <= hi
    });
    let errors = [record.max_vertex_rounding, record.max_quantization_error];
    let errors = errors.iter().all(|v| v.get() >= 0.0 && v.get() <= limit);
    let exponent = F16_EXPONENTS.contains(&record.f16_exponent.get());
    let sphere = record.sphere_centre.iter().all(|v| coordinate(v.get().into()))
        && record.sphere_radius.get() >= 0.0
        && record.sphere_radius.get().is_finite();
    // Ids and places in the order of leaves are 32-bit numbers.
    let counts = record.triangles.get() >= 1
        && record.input_triangles.get() < 1 << 32
        && record.packets.get() < 1 << 30
        && record.triangles.get() <= 4 * record.packets.get();
    let holds = origin && boxed && errors && exponent && sphere && counts;
    ensure(holds, Rule::ObjectNumbers, at, || {
        ("finite, ordered numbers within the limits".into(), format!("{record:?}"))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use zerocopy::FromZeros;

    /// Names that lie over each other would make a file of n bytes one of n^2 in memory.
    #[test]
    fn names_are_together_no_longer_than_their_bytes() {
        let mut record = ObjectRecord::new_zeroed();
        record.triangles = 1.into();
        record.packets = 1.into();
        record.pages = 1.into();
        let names = ["first", "", "third"].map(|name| (name.to_owned(), record));
        let mut section = write_objects(&names);
        for (number, _) in names.iter().enumerate() {
            let at = TABLE_HEAD + 192 * number + 80;
            section[at..at + 4].copy_from_slice(&(number as u32).to_le_bytes());
        }
        let read = read_objects(&section, 0, 3).unwrap();
        assert_eq!(read.iter().map(|object| &object.name[..]).collect::<Vec<_>>(), ["first", "", "third"]);
        // The second name becomes the letter t, and then there is one too many.
        section[TABLE_HEAD + 192 + 4] = 1;
        let error = read_objects(&section, 0, 3).unwrap_err();
        assert_eq!((error.rule, error.offset), (Rule::ObjectTable, TABLE_HEAD as u64 + 2 * 192 + 4));
    }

    #[test]
    fn origins_are_multiples_of_the_smallest_f32() {
        let mut record = ObjectRecord::new_zeroed();
        record.triangles = 1.into();
        record.packets = 1.into();
        let smallest = 2f64.powi(-149);
        for (origin, holds) in [
            (0.0, true),
            (-smallest, true),
            (3.0 * smallest, true),
            (-(2f64.powi(120)), true),
            (smallest / 2.0, false),
            (smallest * 1.5, false),
            (2f64.powi(-149 + 51) + smallest / 2.0, false),
            (2f64.powi(-1074), false),
            (2f64.powi(121), false),
            (f64::NAN, false),
        ] {
            record.origin[1] = origin.into();
            assert_eq!(check_numbers(&record, 0).is_ok(), holds, "{origin:e}");
        }
    }
}
