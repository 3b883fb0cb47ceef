//! The instances section: a head, one record per instance, and the names of the instances.
//!
//! An instance is an object with a pose in the world. Section 3.1 of `spec/format.md` states the place of each byte.

use crate::error::{FormatError, ensure};
use crate::object::MAX_RADIUS;
use crate::rule::Rule;
use crate::vec3::{cross, dot};
use std::collections::HashSet;
use zerocopy::byteorder::little_endian::{F64, U32};
use zerocopy::{FromBytes, Immutable, IntoBytes, KnownLayout, Unaligned};

/// The largest translation of an instance along an axis: 2^118 mesh units.
pub const MAX_WORLD: f64 = (1u128 << 118) as f64;
/// How far from orthonormal the rotation of an instance may be, as [`departure`] measures it: 2^-23.
pub const MAX_RIGID_ERROR: f64 = 1.0 / (1u64 << 23) as f64;
/// The number of bytes before the first record.
const TABLE_HEAD: usize = 16;

/// The record of an instance as stored.
///
/// [`Instance`] has an example.
#[derive(FromBytes, IntoBytes, KnownLayout, Immutable, Unaligned, Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct InstanceRecord {
    /// Byte offset of the name among the names.
    pub name_offset: U32,
    /// Bytes of the name.
    pub name_length: U32,
    /// Number of the object.
    pub object: U32,
    /// The groups that the instance is in.
    pub member: U32,
    /// The groups that it meets: it is tested against their instances.
    pub meets: U32,
    /// 1 if what is inside the instance touches it, even if its object is not solid; else 0.
    pub solid: U32,
    /// What is added to the radius of the object, in mesh units.
    pub margin: F64,
    /// The rotation, row by row.
    pub rotation: [F64; 9],
    /// The translation in mesh units.
    pub translation: [F64; 3],
}

const _: () = assert!(size_of::<InstanceRecord>() == 128);

/// An object with a pose in the world. A point `x` of the object, in mesh units, is at `R x + t`.
///
/// ```
/// use bvh_format::Layout;
/// use bvh_format::instances::{Instance, InstanceRecord, write_instances};
///
/// # let bytes = std::fs::read(concat!(env!("CARGO_MANIFEST_DIR"), "/../testdata/ok-scene.cbvh"))?;
/// let instances = Layout::read(&bytes)?.read_instances(&bytes[..])?;
/// assert!(instances.iter().all(|instance| instance.pose_fault().is_none()));
///
/// let tilted = Instance { rotation: [[1.0, 0.5, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], ..Instance::of_object(0) };
/// assert_eq!(tilted.pose_fault(), Some(("a rotation within 2^-23 of orthonormal", 0.5)));
///
/// let section = write_instances(&instances); // a head, the records, and the names
/// assert!(section.len() > instances.len() * size_of::<InstanceRecord>());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Instance {
    /// The name. Several instances may have an empty one; all others differ.
    pub name: String,
    /// The number of the object in the object table.
    pub object: u32,
    /// The groups that the instance is in, one bit per group.
    pub member: u32,
    /// The groups that it meets, one bit per group: it is tested against their instances.
    pub meets: u32,
    /// Whether what is inside the instance touches it, even if its object is not solid.
    pub solid: bool,
    /// What is added to the radius of the object, from 0 to 2^118 mesh units.
    pub margin: f64,
    /// The rows of the rotation R.
    pub rotation: [[f64; 3]; 3],
    /// The translation t in mesh units.
    pub translation: [f64; 3],
}

impl Instance {
    /// Returns an instance without a name, with the identity pose and in all groups.
    pub fn of_object(object: u32) -> Self {
        Self {
            name: String::new(),
            object,
            member: u32::MAX,
            meets: u32::MAX,
            solid: false,
            margin: 0.0,
            rotation: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            translation: [0.0; 3],
        }
    }

    /// Returns what is wrong with the pose, and the faulty number. Returns `None` if the pose is rigid and within the
    /// limits.
    pub fn pose_fault(&self) -> Option<(&'static str, f64)> {
        let numbers = self.rotation.as_flattened().iter().chain(&self.translation);
        if let Some(&found) = numbers.clone().find(|number| !number.is_finite()) {
            return Some(("finite numbers in the pose", found));
        }
        if let Some(&far) = self.translation.iter().find(|t| t.abs() > MAX_WORLD) {
            return Some(("a translation of at most 2^118 along each axis", far));
        }
        let error = departure(&self.rotation, 1.0);
        if error.is_nan() || error > MAX_RIGID_ERROR {
            return Some(("a rotation within 2^-23 of orthonormal", error));
        }
        let turn = handedness(&self.rotation);
        (turn < 0.0).then_some(("a rotation that is no reflection", turn))
    }
}

/// Returns how far `R R^T` is from a multiple of I: the largest entry of the difference, or NaN.
#[inline]
pub fn departure(rotation: &[[f64; 3]; 3], multiple: f64) -> f64 {
    let [x, y, z] = *rotation;
    // The product is symmetric, to the bit.
    let products = [dot(x, x), dot(y, y), dot(z, z), dot(x, y), dot(x, z), dot(y, z)];
    let expected = [multiple, multiple, multiple, 0.0, 0.0, 0.0];
    // The bits of magnitudes are in the order of the magnitudes, and those of NaN are greater than all others.
    let mut worst = 0;
    for k in 0..6 {
        worst = worst.max((products[k] - expected[k]).abs().to_bits());
    }
    f64::from_bits(worst)
}

/// Returns the determinant of three rows, which is negative for a reflection.
pub fn handedness(&[x, y, z]: &[[f64; 3]; 3]) -> f64 {
    dot(cross(x, y), z)
}

/// Writes the instances section.
pub fn write_instances(instances: &[Instance]) -> Vec<u8> {
    let names: usize = instances.iter().map(|instance| instance.name.len()).sum();
    let mut section = Vec::with_capacity(TABLE_HEAD + instances.len() * size_of::<InstanceRecord>() + names);
    section.extend_from_slice(&(instances.len() as u32).to_le_bytes());
    section.extend_from_slice(&(names as u32).to_le_bytes());
    section.extend_from_slice(&[0; 8]);
    let mut offset = 0;
    for instance in instances {
        let name_length = instance.name.len() as u32;
        // -0.0 + 0.0 is 0.0; every other number stays as it is.
        let number = |value: f64| F64::from(value + 0.0);
        let rotation = instance.rotation.as_flattened();
        let record = InstanceRecord {
            name_offset: offset.into(),
            name_length: name_length.into(),
            object: instance.object.into(),
            member: instance.member.into(),
            meets: instance.meets.into(),
            solid: u32::from(instance.solid).into(),
            margin: number(instance.margin),
            rotation: std::array::from_fn(|entry| number(rotation[entry])),
            translation: instance.translation.map(number),
        };
        section.extend_from_slice(record.as_bytes());
        offset += name_length;
    }
    instances.iter().for_each(|instance| section.extend_from_slice(instance.name.as_bytes()));
    section
}

/// Reads the instances section, which starts at byte `at` of a file with this number of objects.
///
/// # Errors
/// The first of rules 40 to 43 and 50 that does not hold.
pub(crate) fn read_instances(section: &[u8], at: u64, objects: usize) -> Result<Vec<Instance>, FormatError> {
    let table =
        |found: String| FormatError::new(Rule::InstanceTable, at, "a whole table of instances", found);
    let (head, rest) =
        <[U32; 4]>::ref_from_prefix(section).map_err(|_| table(format!("{} bytes", section.len())))?;
    let count = head[0].get() as usize;
    let (records, names) = <[InstanceRecord]>::ref_from_prefix_with_elems(rest, count)
        .map_err(|_| table(format!("{count} instances in {} bytes", section.len())))?;
    let whole = count >= 1 && names.len() == head[1].get() as usize;
    ensure(whole, Rule::InstanceTable, at, || {
        (
            format!("at least one instance, and {} bytes of names", head[1]),
            format!("{count} instances, {} bytes", names.len()),
        )
    })?;
    // Copies of the names must not be longer than the file: records that share a name would multiply its size.
    let mut names_left = names.len();
    let mut taken = HashSet::new();
    let mut instances = Vec::with_capacity(count);
    for (index, record) in records.iter().enumerate() {
        let at = at + (TABLE_HEAD + index * size_of::<InstanceRecord>()) as u64;
        let start = record.name_offset.get() as usize;
        let name = names.get(start..start.saturating_add(record.name_length.get() as usize));
        let name = name.filter(|name| name.len() <= names_left);
        let name = name.and_then(|name| std::str::from_utf8(name).ok()).ok_or_else(|| {
            let expected = format!("a UTF-8 name of at most {names_left} bytes among the names");
            FormatError::new(
                Rule::InstanceTable,
                at,
                expected,
                format!("{} others from {start}", record.name_length),
            )
        })?;
        names_left -= name.len();
        let object = record.object.get();
        ensure((object as usize) < objects, Rule::InstanceObject, at + 8, || {
            (format!("an object below {objects} for instance {index} {name:?}"), object.to_string())
        })?;
        let [x, y, z] = [0, 1, 2].map(|row| [0, 1, 2].map(|column| record.rotation[3 * row + column].get()));
        let instance = Instance {
            name: name.to_owned(),
            object,
            member: record.member.get(),
            meets: record.meets.get(),
            solid: record.solid.get() == 1,
            margin: record.margin.get(),
            rotation: [x, y, z],
            translation: record.translation.map(|t| t.get()),
        };
        let fits = record.solid.get() <= 1 && (0.0..=MAX_RADIUS).contains(&instance.margin);
        ensure(fits, Rule::InstanceMargin, at + 20, || {
            let found = format!("{} and {:e} in instance {index} {name:?}", record.solid, instance.margin);
            ("0 or 1, and a margin from 0 to 2^118".into(), found)
        })?;
        if let Some((what, found)) = instance.pose_fault() {
            let found = format!("{found:e} in instance {index} {name:?}");
            return Err(FormatError::new(Rule::InstancePose, at + 32, what, found));
        }
        ensure(name.is_empty() || taken.insert(name), Rule::InstanceName, at, || {
            (format!("a name of its own for instance {index}"), format!("{name:?} again"))
        })?;
        instances.push(instance);
    }
    Ok(instances)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn named(name: &str, object: u32) -> Instance {
        Instance { name: name.to_owned(), ..Instance::of_object(object) }
    }

    #[test]
    fn what_is_written_is_read() {
        let mut turned = named("arm", 2);
        turned.rotation = [[0.0, -1.0, -0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]];
        turned.translation = [1e30, -2.5, MAX_WORLD];
        (turned.member, turned.meets) = (5, 0);
        (turned.solid, turned.margin) = (true, 0.25);
        let all = [named("", 0), turned, named("", 0), named("\u{e9}", 1)];
        let read = read_instances(&write_instances(&all), 0, 3).unwrap();
        assert_eq!(read, all);
        assert!(read[1].rotation[0][2].is_sign_positive());
    }

    /// Names that overlap could make a file of n bytes take n^2 bytes of memory.
    #[test]
    fn names_that_share_bytes_are_refused() {
        let mut section = write_instances(&[named("first", 0), named("", 0), named("third", 0)]);
        section[TABLE_HEAD + 128 + 4] = 1;
        let error = read_instances(&section, 100, 1).unwrap_err();
        assert_eq!((error.rule, error.offset), (Rule::InstanceTable, 100 + TABLE_HEAD as u64 + 2 * 128));
    }

    #[test]
    fn limits_of_poses_are_allowed_and_the_next_number_is_not() {
        let of = |edit: fn(&mut Instance)| {
            let mut instance = named("a", 0);
            edit(&mut instance);
            read_instances(&write_instances(&[instance]), 0, 1).err().map(|error| error.rule)
        };
        assert_eq!(of(|a| a.translation[1] = -MAX_WORLD), None);
        assert_eq!(of(|a| a.translation[1] = -MAX_WORLD.next_up()), Some(Rule::InstancePose));
        assert_eq!(of(|a| a.rotation[0][1] = MAX_RIGID_ERROR), None);
        assert_eq!(of(|a| a.rotation[0][1] = MAX_RIGID_ERROR.next_up()), Some(Rule::InstancePose));
        assert_eq!(of(|a| a.rotation[2][2] = -1.0), Some(Rule::InstancePose));
        assert_eq!(of(|a| a.rotation[0][0] = f64::NAN), Some(Rule::InstancePose));
        assert_eq!(of(|a| a.translation[0] = f64::INFINITY), Some(Rule::InstancePose));
        assert_eq!(of(|a| a.rotation = [[1e200; 3]; 3]), Some(Rule::InstancePose));
        assert_eq!(of(|a| a.object = 1), Some(Rule::InstanceObject));
        assert_eq!(of(|a| a.margin = MAX_RADIUS), None);
        for wrong in [MAX_RADIUS.next_up(), -1e-300, f64::NAN, f64::INFINITY] {
            let mut instance = named("a", 0);
            instance.margin = wrong;
            let error = read_instances(&write_instances(&[instance]), 0, 1).unwrap_err();
            assert_eq!(error.rule, Rule::InstanceMargin, "{wrong}");
        }
        assert_eq!(read_instances(&write_instances(&[]), 0, 1).unwrap_err().rule, Rule::InstanceTable);
    }
}
