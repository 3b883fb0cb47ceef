//! The object table: a head, one record per object, and the names of the objects.
//!
//! An object is a named mesh with a tree of its own. Section 3 of `spec/format.md` says where each byte stands.

use crate::error::{FormatError, ensure};
use crate::kdop::two_sum;
use crate::leaf::{PACKET, Packet, TriangleEncoding};
use crate::profile::Profile;
use crate::rule::Rule;
use crate::vertex::{Predictor, Vertices, is_multiple_of_least};
use zerocopy::byteorder::little_endian::{F32, F64, I32, U32, U64};
use zerocopy::{FromBytes, Immutable, IntoBytes, KnownLayout, Unaligned};

/// The largest magnitude of a coordinate and of an origin: 2^120 mesh units.
pub const MAX_COORDINATE: f64 = (1u128 << 120) as f64;
/// The exponents e for which every product of an f16 code and 2^e mesh units is exact.
pub const F16_EXPONENTS: std::ops::RangeInclusive<i32> = -125..=112;
/// The largest radius of a shape and the largest margin of an instance: 2^118 mesh units.
pub const MAX_RADIUS: f64 = (1u128 << 118) as f64;
/// The number of bytes before the first record.
pub(crate) const TABLE_HEAD: usize = 16;

/// The record of an object as stored. Lengths are in mesh units, and coordinates are relative to `origin`.
///
/// [`Object`] has an example.
#[derive(FromBytes, IntoBytes, KnownLayout, Immutable, Unaligned, Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct ObjectRecord {
    /// Byte offset of the name among the names.
    pub name_offset: U32,
    /// Bytes of the name.
    pub name_length: U32,
    /// The origin, around which offsets are.
    pub origin: [F64; 3],
    /// Lower corner of an axis-aligned box of all vertices, around the origin.
    pub box_lo: [F32; 3],
    /// Upper corner of that box.
    pub box_hi: [F32; 3],
    /// Triangles stored.
    pub triangles: U64,
    /// Leaf packets.
    pub packets: U64,
    /// Treelets.
    pub treelets: U64,
    /// Number of the first page, whose first root is the root of the object.
    pub first_page: U32,
    /// Pages of the object.
    pub pages: U32,
    /// The largest distance by which a vertex moved before it was quantised.
    pub max_vertex_rounding: F64,
    /// The largest further distance by which `quantized` moved a vertex; 0 for other encodings.
    pub max_quantization_error: F64,
    /// Triangles of the input, whose numbers are the ids.
    pub input_triangles: U64,
    /// Zero-area triangles among those stored.
    pub degenerate: U64,
    /// Exact duplicates that were left out.
    pub duplicates: U64,
    /// The binary logarithm of the unit of f16 residuals.
    pub f16_exponent: I32,
    /// Number of the `Profile`.
    pub profile: u8,
    /// Number of the `TriangleEncoding`.
    pub triangle_encoding: u8,
    /// Zero.
    pub reserved: [u8; 2],
    /// Centre of a sphere that contains all vertices, around the origin.
    pub sphere_centre: [F32; 3],
    /// The radius of that sphere, rounded up.
    pub sphere_radius: F32,
    /// The radius of the object: it stands for all points this near to its triangles, in mesh units. The same for all objects.
    pub radius: F64,
    /// 1 if what is inside the object touches it, else 0. The same for all objects.
    pub solid: u8,
    /// How the coordinates of each axis follow from offsets: the number of a `Predictor`.
    pub predictors: [u8; 3],
    /// The digits of each predictor.
    pub digits: [u8; 3],
    /// Bit a is set if leaf blocks correct coordinates of axis a.
    pub corrected: u8,
    /// For each axis, the largest distance of a coordinate from the sum of the origin and its offset, rounded up.
    pub left_out: [F32; 3],
    /// The scale of `Predictor::Scaled`; 0 without it.
    pub scale: F64,
    /// 1 if the object is known to be convex, else 0.
    pub convex: u8,
    /// Zero.
    pub reserved_end: [u8; 3],
}

const _: () = assert!(size_of::<ObjectRecord>() == 192);

/// An object of an opened file: a named mesh with a tree of its own.
///
/// ```
/// use bvh_format::Layout;
/// use bvh_format::object::{ObjectRecord, Volumes};
///
/// # let bytes = std::fs::read(concat!(env!("CARGO_MANIFEST_DIR"), "/../testdata/ok-plain.cbvh"))?;
/// let layout = Layout::read(&bytes)?;
/// let cube = &layout.objects[0];
/// assert_eq!((cube.triangles(), cube.bounding_box()), (12, [[-1.0; 3], [1.0; 3]]));
/// let Volumes { half_sides, .. } = cube.volumes();
/// assert_eq!(*half_sides, [1.0; 3]);
/// let record: &ObjectRecord = cube.record();
/// assert_eq!((record.input_triangles.get(), record.duplicates.get()), (12, 0));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Object {
    pub(crate) name: String,
    pub(crate) profile: Profile,
    pub(crate) triangle_encoding: TriangleEncoding,
    pub(crate) f16_scale: f32,
    pub(crate) vertices: Vertices,
    pub(crate) volumes: Volumes,
    pub(crate) record: ObjectRecord,
}

/// The bounding volumes of an object in `f64`, as computations need them. Lengths are in mesh units, and centres are relative
/// to the origin.
///
/// [`Object`] has an example.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Volumes {
    /// The origin.
    pub origin: [f64; 3],
    /// The centre of the box, rounded to nearest.
    pub box_centre: [f64; 3],
    /// Half the sides of the box, rounded to nearest.
    pub half_sides: [f64; 3],
    /// The centre of the sphere.
    pub sphere_centre: [f64; 3],
    /// The radius of the sphere.
    pub sphere_radius: f64,
    /// The sum, over the axes, of the magnitude of the origin and three times the magnitudes of both ends of the box. It bounds
    /// the numbers that are added up when a vertex is placed.
    pub magnitude: f64,
    /// How far a vertex may be from the sum of the origin and its offsets: a bound of the Euclidean distance.
    pub left_out: f64,
}

impl Volumes {
    pub(crate) fn of(record: &ObjectRecord, vertices: &Vertices) -> Self {
        let [lo, hi] = [record.box_lo, record.box_hi].map(|corner| corner.map(|v| f64::from(v.get())));
        let origin = record.origin.map(|v| v.get());
        let magnitude = |axis: usize| origin[axis].abs() + 3.0 * (lo[axis].abs() + hi[axis].abs());
        Self {
            origin,
            box_centre: [0, 1, 2].map(|axis| (hi[axis] + lo[axis]) / 2.0),
            half_sides: [0, 1, 2].map(|axis| (hi[axis] - lo[axis]) / 2.0),
            sphere_centre: record.sphere_centre.map(|v| f64::from(v.get())),
            sphere_radius: record.sphere_radius.get().into(),
            magnitude: magnitude(0) + magnitude(1) + magnitude(2),
            // At least as long as the root of the sum of squares.
            left_out: vertices.left_out.iter().map(|&most| f64::from(most)).sum(),
        }
    }
}

impl Object {
    /// The name, which may be empty. Several objects of a file may have the same name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The number of triangles stored, at least 1. Exact duplicates that the baker left out are not among them.
    pub fn triangles(&self) -> u64 {
        self.record.triangles.get()
    }

    /// The origin in mesh units. Offsets in the file are `f32` numbers around it.
    #[inline]
    pub fn origin(&self) -> [f64; 3] {
        self.volumes.origin
    }

    /// How vertices follow from offsets.
    #[inline]
    pub fn vertices(&self) -> &Vertices {
        &self.vertices
    }

    /// The bounding volumes in `f64`.
    #[inline]
    pub fn volumes(&self) -> &Volumes {
        &self.volumes
    }

    /// The lower and the upper corner of an axis-aligned box that contains all vertices, in mesh units. It is exact where each
    /// coordinate is the sum of the origin and an `f32`, and else wider by what `f32` leaves out.
    pub fn bounding_box(&self) -> [[f64; 3]; 2] {
        let origin = self.origin();
        let corner = |v: [F32; 3]| [0, 1, 2].map(|axis| origin[axis] + f64::from(v[axis].get()));
        [corner(self.record.box_lo), corner(self.record.box_hi)]
    }

    /// The centre and the radius of a sphere that contains all stored vertices, in mesh units. The radius is at least 0
    /// and rounded up, so that no vertex lies outside. The sphere is a good one, but not the smallest.
    pub fn bounding_sphere(&self) -> ([f64; 3], f64) {
        let (origin, mut moved) = (self.origin(), 0.0);
        let centre = [0, 1, 2].map(|axis| {
            let (sum, error) = two_sum(origin[axis], f64::from(self.record.sphere_centre[axis].get()));
            moved += error.abs();
            sum
        });
        let radius = f64::from(self.record.sphere_radius.get());
        // Rounding has moved the centre by `moved` at most; the next number covers the roundings of the sums.
        (centre, if moved > 0.0 { (radius + moved).next_up() } else { radius })
    }

    /// Returns whether the sphere of the record contains all corners of packets, as rule 35 requires. Differences,
    /// squares and sums are rounded to nearest in `f64`, without overflow or underflow. A corner may therefore be
    /// outside by 2^-50 of the radius.
    pub fn sphere_contains<'a>(&self, packets: impl IntoIterator<Item = &'a Packet>) -> bool {
        let [a, b, c] = self.record.sphere_centre.map(|c| f64::from(c.get()));
        let radius = f64::from(self.record.sphere_radius.get());
        let [p, q, r] = self.vertices.left_out.map(f64::from);
        // All lanes at once, which compilers turn into vector code.
        packets.into_iter().flat_map(|packet| &packet.corners).all(|[x, y, z]| {
            let mut inside = true;
            for lane in 0..PACKET {
                let (x, y, z) = (f64::from(x[lane]) - a, f64::from(y[lane]) - b, f64::from(z[lane]) - c);
                let (x, y, z) = (x.abs() + p, y.abs() + q, z.abs() + r);
                inside &= x * x + y * y + z * z <= radius * radius;
            }
            inside
        })
    }

    /// How far a vertex may be from the one that was given to the baker, in mesh units: 0 unless vertices were quantised, rounded
    /// or welded on purpose, or lay below the least unit of the format.
    pub fn max_move(&self) -> f64 {
        let [rounding, quantization] =
            [self.record.max_vertex_rounding.get(), self.record.max_quantization_error.get()];
        let sum = rounding + quantization;
        // Rounded up.
        if rounding > 0.0 && quantization > 0.0 { sum.next_up() } else { sum }
    }

    /// The radius in mesh units: the object stands for all points this near to its triangles.
    #[inline]
    pub fn radius(&self) -> f64 {
        self.record.radius.get()
    }

    /// Whether what is inside the object touches it.
    #[inline]
    pub fn is_solid(&self) -> bool {
        self.record.solid == 1
    }

    /// The profile: how the nodes of the tree are stored.
    #[inline]
    pub fn profile(&self) -> Profile {
        self.profile
    }

    /// How the triangles are stored.
    #[inline]
    pub fn triangle_encoding(&self) -> TriangleEncoding {
        self.triangle_encoding
    }

    /// The unit of f16 residuals, a power of two, in mesh units.
    #[inline]
    pub fn f16_scale(&self) -> f32 {
        self.f16_scale
    }

    /// The numbers of the object's pages in the node section, at least one.
    pub fn pages(&self) -> std::ops::Range<u32> {
        let first = self.record.first_page.get();
        first..first + self.record.pages.get()
    }

    /// The record of the object table, with its bytes and the numbers that have no accessor.
    #[inline]
    pub fn record(&self) -> &ObjectRecord {
        &self.record
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

/// Reads the object section, which starts at byte `at` of a file whose node section has `node_pages` pages.
///
/// # Errors
/// The first of rules 11 to 14 that does not hold.
pub(crate) fn read_objects(section: &[u8], at: u64, node_pages: u64) -> Result<Vec<Object>, FormatError> {
    let table = |found: String| FormatError::new(Rule::ObjectTable, at, "a whole object table", found);
    let (head, rest) =
        <[U32; 4]>::ref_from_prefix(section).map_err(|_| table(format!("{} bytes", section.len())))?;
    let count = head[0].get() as usize;
    let (records, names) = <[ObjectRecord]>::ref_from_prefix_with_elems(rest, count)
        .map_err(|_| table(format!("{count} objects in {} bytes", section.len())))?;
    let whole = count >= 1 && names.len() == head[1].get() as usize;
    ensure(whole, Rule::ObjectTable, at, || {
        (
            format!("at least one object, and {} bytes of names", head[1]),
            format!("{count} objects, {} bytes", names.len()),
        )
    })?;
    let mut next_page = 0;
    // Copies of the names must not be longer than the file: records that share a name would multiply its size.
    let mut names_left = names.len();
    let mut objects = Vec::with_capacity(count);
    for (index, record) in records.iter().enumerate() {
        let at = at + (TABLE_HEAD + index * size_of::<ObjectRecord>()) as u64;
        check_numbers(record, &records[0], at)?;
        let first = u64::from(record.first_page.get());
        let follows = first == next_page && record.pages.get() > 0;
        ensure(follows, Rule::ObjectPages, at + 80, || {
            (
                format!("pages from page {next_page} on"),
                format!("{} pages from page {first} on", record.pages),
            )
        })?;
        next_page += u64::from(record.pages.get());
        objects.push(read_object(record, names, &mut names_left, at)?);
    }
    ensure(next_page == node_pages, Rule::ObjectPages, at, || {
        (format!("{node_pages} pages in all"), next_page.to_string())
    })?;
    Ok(objects)
}

/// Reads one object. `names_left` is the number of bytes that the names of this record and of all later ones may have.
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
        (
            format!("at most {names_left} bytes of name after those of the earlier objects"),
            name.len().to_string(),
        )
    })?;
    *names_left -= name.len();
    let unknown = |at, what, found| FormatError::new(Rule::ObjectProfile, at, what, found);
    let profile = Profile::from_number(record.profile)
        .ok_or_else(|| unknown(at + 132, "a profile from 0 to 6", record.profile))?;
    let triangle_encoding = TriangleEncoding::from_number(record.triangle_encoding)
        .ok_or_else(|| unknown(at + 133, "a triangle encoding from 0 to 2", record.triangle_encoding))?;
    let f16_scale = f32::from_bits(((record.f16_exponent.get() + 127) as u32) << 23);
    let vertices = read_vertices(record).ok_or_else(|| {
        let expected = "predictors of vertices that fit the origin and the scale";
        FormatError::new(Rule::ObjectNumbers, at + 161, expected, format!("{record:?}"))
    })?;
    let volumes = Volumes::of(record, &vertices);
    let name = name.to_owned();
    Ok(Object { name, profile, triangle_encoding, f16_scale, vertices, volumes, record: *record })
}

/// Reads what a record states about vertices, or returns `None` if it breaks rule 12.
fn read_vertices(record: &ObjectRecord) -> Option<Vertices> {
    let mut vertices = Vertices::around(record.origin.map(F64::get));
    for axis in 0..3 {
        let predictor = Predictor::from_parts(record.predictors[axis], record.digits[axis])?;
        let left_out = record.left_out[axis].get();
        let is_corrected = record.corrected >> axis & 1 == 1;
        let is_sum = predictor == Predictor::Sum && !is_corrected;
        if predictor.needs_no_origin() && vertices.origin[axis] != 0.0
            || !(0.0..=MAX_COORDINATE as f32).contains(&left_out)
            || is_sum && left_out != 0.0
        {
            return None;
        }
        vertices.predictors[axis] = predictor;
        vertices.corrected[axis] = is_corrected;
        vertices.left_out[axis] = left_out;
    }
    vertices.scale = record.scale.get();
    let is_scaled = vertices.predictors.contains(&Predictor::Scaled);
    let has_scale = if is_scaled { vertices.scale.abs().is_normal() } else { vertices.scale == 0.0 };
    (has_scale && record.corrected < 8 && record.convex <= 1).then_some(vertices)
}

/// Checks rule 12 for a record. All have the radius and the solidity of the first one.
fn check_numbers(record: &ObjectRecord, first: &ObjectRecord, at: u64) -> Result<(), FormatError> {
    let limit = MAX_COORDINATE;
    let coordinate = |v: f64| v.abs() <= limit;
    let origin = record.origin.iter().all(|v| coordinate(v.get()) && is_multiple_of_least(v.get()));
    let boxed = (0..3).all(|a| {
        let (lo, hi) = (f64::from(record.box_lo[a].get()), f64::from(record.box_hi[a].get()));
        // Beyond the offsets by what these leave out.
        lo >= -2.0 * limit && hi <= 2.0 * limit && lo <= hi
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
    let rounded = (0.0..=MAX_RADIUS).contains(&record.radius.get())
        && record.radius.get().to_bits() == first.radius.get().to_bits()
        && record.solid <= 1
        && record.solid == first.solid;
    let holds = origin && boxed && errors && exponent && sphere && counts && rounded;
    ensure(holds, Rule::ObjectNumbers, at, || {
        ("finite, ordered numbers within the limits".into(), format!("{record:?}"))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use zerocopy::FromZeros;

    /// Names that overlap could make a file of n bytes take n^2 bytes of memory.
    #[test]
    fn names_that_share_bytes_are_refused() {
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
    fn boxes_and_spheres_are_placed_at_the_origin() {
        let mut record = ObjectRecord::new_zeroed();
        record.origin = [1e6, -0.5, 0.0].map(Into::into);
        record.box_lo = [-1.0, -2.0, -3.0].map(Into::into);
        record.box_hi = [1.0, 2.0, 3.0].map(Into::into);
        record.sphere_centre = [0.25, 0.5, -0.25].map(Into::into);
        record.sphere_radius = 4.0.into();
        let (profile, triangle_encoding) = (Profile::Dop14U8, TriangleEncoding::F32);
        let object = |record| {
            let vertices = read_vertices(&record).unwrap();
            let (name, volumes) = ("a".to_owned(), Volumes::of(&record, &vertices));
            Object { name, profile, triangle_encoding, f16_scale: 1.0, vertices, volumes, record }
        };
        let exact = object(record);
        let Volumes { origin, box_centre, half_sides, sphere_centre, sphere_radius, magnitude, left_out } =
            exact.volumes;
        assert_eq!([origin, box_centre, half_sides], [[1e6, -0.5, 0.0], [0.0; 3], [1.0, 2.0, 3.0]]);
        assert_eq!((sphere_centre, sphere_radius), ([0.25, 0.5, -0.25], 4.0));
        assert_eq!((magnitude, left_out), (1e6 + 0.5 + 3.0 * 12.0, 0.0));
        assert_eq!(exact.bounding_box(), [[999_999.0, -2.5, -3.0], [1_000_001.0, 1.5, 3.0]]);
        assert_eq!(exact.bounding_sphere(), ([1_000_000.25, 0.0, -0.25], 4.0));
        // The last bits of the centre do not fit beside the origin: the radius makes up for them.
        record.sphere_centre[0] = 1e-12.into();
        let (centre, radius) = object(record).bounding_sphere();
        assert_eq!(centre[0], 1e6);
        assert!(radius > 4.0 + 1e-12 && radius < 4.0 + 2e-12, "{radius}");
    }

    #[test]
    fn origins_are_multiples_of_the_least_unit() {
        let mut record = ObjectRecord::new_zeroed();
        record.triangles = 1.into();
        record.packets = 1.into();
        let smallest = 2f64.powi(-180);
        for (origin, holds) in [
            (0.0, true),
            (-smallest, true),
            (3.0 * smallest, true),
            (-(2f64.powi(120)), true),
            (smallest / 2.0, false),
            (smallest * 1.5, false),
            (2f64.powi(-180 + 51) + smallest / 2.0, false),
            (2f64.powi(-1074), false),
            (2f64.powi(121), false),
            (f64::NAN, false),
        ] {
            record.origin[1] = origin.into();
            assert_eq!(check_numbers(&record, &record, 0).is_ok(), holds, "{origin:e}");
        }
    }
}
