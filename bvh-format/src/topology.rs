//! The topology section: which objects are closed, a triangle of each of their components, and how often triangles
//! count whose duplicates were left out.
//!
//! A head, one record per object, the components of all objects and the nets of all objects follow each other. Section
//! 3.2 of `spec/format.md` states each byte and defines the terms.

use crate::checksum::checksum;
use crate::error::{FormatError, ensure};
use crate::object::Object;
use crate::rule::Rule;
use crate::source::{Source, chunks};
use std::ops::Range;
use zerocopy::little_endian::{I32, U32};
use zerocopy::{FromBytes, Immutable, IntoBytes, KnownLayout, Unaligned};

/// The number of bytes before the first record.
pub const HEAD_BYTES: usize = 16;
/// The lanes that a place counts for each packet: place 4 p + i is lane i of packet p of the object.
pub const LANES: u64 = crate::leaf::PACKET as u64;

/// The record of an object as stored.
///
/// [`ObjectTopology`] has an example.
#[derive(FromBytes, IntoBytes, KnownLayout, Immutable, Unaligned, Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct TopologyRecord {
    /// 1 if the object is closed, else 0.
    pub closed: U32,
    /// The number of places that list its components; 0 if each triangle counts as a component.
    pub components: U32,
    /// The number of its nets.
    pub nets: U32,
    /// Zero.
    pub reserved: U32,
}

/// The stored count of a triangle whose duplicates were left out.
///
/// [`ObjectTopology`] has an example.
#[derive(FromBytes, IntoBytes, KnownLayout, Immutable, Unaligned, Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct Net {
    /// The place of the triangle in the object.
    pub place: U32,
    /// The number of equal triangles of the input with its orientation, itself included, less the number of those with
    /// the opposite one. It is not 1.
    pub net: I32,
}

const _: () = assert!(size_of::<TopologyRecord>() == 16 && size_of::<Net>() == 8);

/// What the section states about an object: whether it is closed, and which bytes of the file are its lists.
///
/// ```
/// use bvh_format::Layout;
/// use bvh_format::topology::{Net, TopologyRecord, write_topology_head};
///
/// # let bytes = std::fs::read(concat!(env!("CARGO_MANIFEST_DIR"), "/../testdata/ok-topology.cbvh"))?;
/// let topology = Layout::read(&bytes)?.check_topology(&bytes[..])?;
/// assert_eq!(topology.iter().map(|object| object.closed).collect::<Vec<_>>(), [true, false, true, false]);
/// // The third object is a cube around a smaller one, each triangle of which was given three times.
/// assert_eq!(topology[2].component_count(), 2);
/// let nets: &[Net] = topology[2].nets(&bytes);
/// assert!(nets.len() == 12 && nets.iter().all(|net| net.net.get() == 3));
///
/// let record = TopologyRecord { closed: 1.into(), components: 1.into(), nets: 0.into(), reserved: 0.into() };
/// assert_eq!(write_topology_head(&[record]).len(), 16 + size_of::<TopologyRecord>());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ObjectTopology {
    /// Whether the triangles have no boundary, each counted as often as its net says.
    pub closed: bool,
    pub(crate) components: Range<usize>,
    pub(crate) nets: Range<usize>,
}

impl ObjectTopology {
    /// Returns the places of a triangle of each component, ascending. The list is empty if each triangle counts as a
    /// component.
    pub fn components<'a>(&self, bytes: &'a [u8]) -> &'a [U32] {
        list(bytes, &self.components)
    }

    /// Returns the nets that are not 1, by ascending places.
    pub fn nets<'a>(&self, bytes: &'a [u8]) -> &'a [Net] {
        list(bytes, &self.nets)
    }

    /// Visits the nets of a file whose bytes are read piece by piece.
    ///
    /// # Errors
    /// The errors of `visit` and of the source.
    pub fn visit_nets<S: Source + ?Sized, E: From<S::Error>>(
        &self,
        source: &S,
        mut visit: impl FnMut(&Net) -> Result<(), E>,
    ) -> Result<(), E> {
        visit_list(source, &self.nets, |_, net| visit(net))
    }

    /// Returns the nets at places of a range, by ascending places. Places must ascend in the file (rule 46), or some may be missing.
    ///
    /// # Errors
    /// The errors of the source.
    pub fn nets_between<S: Source + ?Sized>(
        &self,
        source: &S,
        places: Range<u32>,
    ) -> Result<Vec<Net>, S::Error> {
        let entry = size_of::<Net>();
        let at = |number: usize| self.nets.start + number * entry;
        // The number of nets at places before one.
        let before = |place: u32| {
            let (mut low, mut high) = (0, self.net_count());
            while low < high {
                let middle = low + (high - low) / 2;
                let bytes = source.read(at(middle)..at(middle) + size_of::<U32>())?;
                let found = U32::read_from_bytes(&bytes).map_or(0, U32::get);
                (low, high) = if found < place { (middle + 1, high) } else { (low, middle) };
            }
            Ok::<_, S::Error>(low)
        };
        let (start, end) = (before(places.start)?, before(places.end)?);
        let bytes = source.read(at(start)..at(end.max(start)))?;
        Ok(<[Net]>::ref_from_bytes(&bytes).map_or_else(|_| Vec::new(), <[Net]>::to_vec))
    }

    /// Returns the number of components listed.
    pub fn component_count(&self) -> usize {
        self.components.len() / size_of::<U32>()
    }

    /// Returns the number of nets.
    pub fn net_count(&self) -> usize {
        self.nets.len() / size_of::<Net>()
    }
}

fn list<'a, T: FromBytes + KnownLayout + Immutable>(bytes: &'a [u8], range: &Range<usize>) -> &'a [T] {
    bytes.get(range.clone()).and_then(|bytes| <[T]>::ref_from_bytes(bytes).ok()).unwrap_or(&[])
}

/// Writes the head and the records. All components follow as `u32`, and then all nets, object by object.
pub fn write_topology_head(records: &[TopologyRecord]) -> Vec<u8> {
    let sum = |of: fn(&TopologyRecord) -> u32| records.iter().map(of).fold(0, u32::wrapping_add);
    let mut section = Vec::with_capacity(HEAD_BYTES + size_of_val(records));
    let counts = [sum(|record| record.components.get()), sum(|record| record.nets.get())];
    for number in [records.len() as u32, counts[0], counts[1], 0] {
        section.extend_from_slice(&number.to_le_bytes());
    }
    section.extend_from_slice(records.as_bytes());
    section
}

/// Reads the head and the records of the section, which is `section` of the file. It does not look at the lists.
///
/// # Errors
/// The first of rules 44 and 45 that does not hold, or an error of the source.
pub(crate) fn read_records<S: Source + ?Sized>(
    source: &S,
    section: &Range<usize>,
    objects: &[Object],
) -> Result<Vec<ObjectTopology>, S::Error> {
    let table = HEAD_BYTES + objects.len() * size_of::<TopologyRecord>();
    let bytes = source.read(section.start..section.start + section.len().min(table))?;
    Ok(read_table(&bytes, section, objects)?)
}

fn read_table(
    bytes: &[u8],
    section: &Range<usize>,
    objects: &[Object],
) -> Result<Vec<ObjectTopology>, FormatError> {
    let at = section.start as u64;
    let refused =
        |expected: String, found: String| FormatError::new(Rule::TopologyTable, at, expected, found);
    let (head, rest) = <[U32; 4]>::ref_from_prefix(bytes)
        .map_err(|_| refused(format!("a head of {HEAD_BYTES} bytes"), format!("{} bytes", bytes.len())))?;
    let [count, components, nets] = [0, 1, 2].map(|number: usize| u64::from(head[number].get()));
    ensure(count == objects.len() as u64, Rule::TopologyTable, at, || {
        (format!("records of {} objects", objects.len()), count.to_string())
    })?;
    let lists = HEAD_BYTES as u64 + count * size_of::<TopologyRecord>() as u64;
    let length = lists + components * size_of::<U32>() as u64 + nets * size_of::<Net>() as u64;
    let records = <[TopologyRecord]>::ref_from_bytes(rest).ok();
    let Some(records) =
        records.filter(|records| records.len() == objects.len() && length == section.len() as u64)
    else {
        return Err(refused(format!("{length} bytes"), format!("{} bytes", section.len())));
    };
    let sum =
        |of: fn(&TopologyRecord) -> u32| records.iter().map(|record| u64::from(of(record))).sum::<u64>();
    let sums = [sum(|record| record.components.get()), sum(|record| record.nets.get())];
    ensure(sums == [components, nets], Rule::TopologyTable, at + 4, || {
        (format!("{} components and {} nets", sums[0], sums[1]), format!("{components} and {nets}"))
    })?;
    // The lists lie within the section, since their lengths add up to its length.
    let mut component = section.start + lists as usize;
    let mut net = component + components as usize * size_of::<U32>();
    let mut topology = Vec::with_capacity(objects.len());
    for (index, (record, object)) in records.iter().zip(objects).enumerate() {
        let at = at + (HEAD_BYTES + index * size_of::<TopologyRecord>()) as u64;
        let closed = record.closed.get();
        ensure(closed <= 1, Rule::TopologyRecord, at, || ("0 or 1".into(), closed.to_string()))?;
        for (offset, count) in [(4, record.components), (8, record.nets)] {
            ensure(u64::from(count.get()) <= object.triangles(), Rule::TopologyRecord, at + offset, || {
                (format!("at most {}, one per triangle", object.triangles()), count.to_string())
            })?;
        }
        let components = component..component + record.components.get() as usize * size_of::<U32>();
        let nets = net..net + record.nets.get() as usize * size_of::<Net>();
        (component, net) = (components.end, nets.end);
        topology.push(ObjectTopology { closed: closed == 1, components, nets });
    }
    Ok(topology)
}

/// Checks the lists of all objects: the order of their places, and that only nets other than 1 are listed.
///
/// # Errors
/// The first of rules 46 and 47 that does not hold, or an error of the source.
pub(crate) fn check_lists<S: Source + ?Sized>(
    source: &S,
    topology: &[ObjectTopology],
    objects: &[Object],
) -> Result<(), S::Error> {
    for (of_object, object) in topology.iter().zip(objects) {
        let end = object.record().packets.get() * LANES;
        let mut next = 0;
        visit_list(source, &of_object.components, |at, place: &U32| {
            ascend(at, place.get(), &mut next, end)?;
            Ok::<_, S::Error>(())
        })?;
        let mut next = 0;
        visit_list(source, &of_object.nets, |at, net: &Net| {
            ascend(at, net.place.get(), &mut next, end)?;
            ensure(net.net.get() != 1, Rule::TopologyNet, at + 4, || {
                ("a net that is not 1".into(), "1".into())
            })?;
            Ok::<_, S::Error>(())
        })?;
    }
    Ok(())
}

/// Checks that a place is at least `next` and less than `end`, and sets `next` to the one after it.
fn ascend(at: u64, place: u32, next: &mut u64, end: u64) -> Result<(), FormatError> {
    ensure((*next..end).contains(&u64::from(place)), Rule::TopologyPlace, at, || {
        (format!("a place from {next} and below {end}"), place.to_string())
    })?;
    *next = u64::from(place) + 1;
    Ok(())
}

/// Visits the entries of a list, each with its byte offset in the file.
pub(crate) fn visit_list<S: Source + ?Sized, T: FromBytes + KnownLayout + Immutable, E: From<S::Error>>(
    source: &S,
    range: &Range<usize>,
    mut visit: impl FnMut(u64, &T) -> Result<(), E>,
) -> Result<(), E> {
    // Chunks hold whole entries, because their length is a multiple of all sizes of entries.
    for chunk in chunks(range.clone()) {
        let bytes = source.read(chunk.clone())?;
        let entries = <[T]>::ref_from_bytes(&bytes).unwrap_or(&[]);
        for (number, entry) in entries.iter().enumerate() {
            visit((chunk.start + number * size_of::<T>()) as u64, entry)?;
        }
    }
    Ok(())
}

/// Returns the boundary of a triangle as one number. For each edge it adds the checksum of the edge, or subtracts it if
/// the triangle goes along the edge from its greater end to its lesser one. An edge between equal ends adds nothing. The ends
/// are the bits of the coordinates, of vertices or of offsets that determine them, none of which is -0.
///
/// The sum over triangles without a boundary is 0, since each edge is added as often as it is subtracted. The sum over
/// others is 0 with a probability of about 2^-64. All sums wrap around.
pub fn boundary<T: Copy + Into<u64> + IntoBytes + Immutable>(ends: &[[T; 3]; 3]) -> u64 {
    // Two numbers for each end, which are compared faster than three.
    let keys = ends.map(|[x, y, z]| (u128::from(x.into()) << 64 | u128::from(y.into()), z.into()));
    let mut sum = 0u64;
    for (from, to) in [(0, 1), (1, 2), (2, 0)] {
        if keys[from] < keys[to] {
            sum = sum.wrapping_add(edge_checksum(&ends[from], &ends[to]));
        } else if keys[to] < keys[from] {
            sum = sum.wrapping_sub(edge_checksum(&ends[to], &ends[from]));
        }
    }
    sum
}

/// Returns the boundary of a triangle, given its offsets, and its vertices if offsets do not determine these.
pub fn boundary_of(offsets: &[[f32; 3]; 3], vertices: Option<&[[f64; 3]; 3]>) -> u64 {
    // -0.0 + 0.0 is 0.0; every other number stays as it is.
    match vertices {
        None => boundary(&offsets.map(|corner| corner.map(|value| (value + 0.0).to_bits()))),
        Some(vertices) => boundary(&vertices.map(|corner| corner.map(|value| (value + 0.0).to_bits()))),
    }
}

/// Returns the checksum of the bytes of an edge: x, y and z of its lesser end, then those of its greater end.
fn edge_checksum<T: IntoBytes + Immutable>(lesser: &[T; 3], greater: &[T; 3]) -> u64 {
    let mut bytes = [0; 48];
    let half = size_of::<[T; 3]>();
    bytes[..half].copy_from_slice(lesser.as_bytes());
    bytes[half..2 * half].copy_from_slice(greater.as_bytes());
    checksum(&bytes[..2 * half])
}
