//! States another radius and solidity in a copy of a file, and leaves everything else as it is.

use crate::checksum::checksum;
use crate::error::FormatError;
use crate::header::{SectionKind, head_checksum, head_mut};
use crate::layout::{ContentHasher, Layout};
use crate::object::{ObjectRecord, TABLE_HEAD};
use std::mem::offset_of;

/// Returns a file like the given one, with this radius in mesh units and this solidity for all of its objects. Checksums of
/// the other sections stay, so that damage to these is still found. Whether solid objects are closed is not checked.
///
/// Cost: that of copying the file and of its checksum.
///
/// # Errors
/// The errors of [`Layout::read`] for the given file, and rule 12 for a radius that is negative, NaN or above 2^118.
pub fn with_rounding(bytes: &[u8], radius: f64, solid: bool) -> Result<Vec<u8>, FormatError> {
    let layout = Layout::read(bytes)?;
    let mut file = bytes.to_vec();
    let objects = layout.sections.iter().find(|section| section.kind == SectionKind::Objects);
    // A file that has been read has objects.
    let objects = objects.map_or(0..0, |section| section.range.clone());
    for number in 0..layout.objects.len() {
        let mut put = |field: usize, value: &[u8]| {
            let at = objects.start + TABLE_HEAD + number * size_of::<ObjectRecord>() + field;
            file[at..at + value.len()].copy_from_slice(value);
        };
        // -0.0 + 0.0 is 0.0.
        put(offset_of!(ObjectRecord, radius), &(radius + 0.0).to_le_bytes());
        put(offset_of!(ObjectRecord, solid), &[solid.into()]);
    }
    let sum = checksum(&file[objects]);
    let mut content = ContentHasher::default();
    for section in layout.sections.iter().filter(|section| section.kind.is_content()) {
        content.begin(section.kind, section.range.len() as u64);
        content.update(&file[section.range.clone()]);
    }
    // A file that has been read has a head.
    if let Some((header, entries)) = head_mut(&mut file) {
        for entry in entries.iter_mut().filter(|entry| entry.kind.get() == SectionKind::Objects as u32) {
            entry.checksum = sum.into();
        }
        header.content_checksum = content.finish().into();
        header.header_checksum = head_checksum(header, entries).into();
    }
    Layout::read(&file)?;
    Ok(file)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rule::Rule;
    use crate::validate::validate;

    fn golden(name: &str) -> Vec<u8> {
        let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../testdata");
        std::fs::read(folder.join(name)).unwrap()
    }

    #[test]
    fn all_objects_have_the_radius_and_all_else_stays() {
        for name in ["ok-everything.cbvh", "ok-profiles.cbvh", "ok-scene.cbvh", "ok-points.cbvh"] {
            let plain = golden(name);
            let rounded = with_rounding(&plain, 0.5, false).unwrap();
            let layout = validate(&rounded).unwrap();
            assert!(layout.objects.iter().all(|object| (object.radius(), object.is_solid()) == (0.5, false)));
            let stated = Layout::read(&plain).unwrap().objects[0].radius();
            assert!(with_rounding(&rounded, stated, false).unwrap() == plain, "{name}");
        }
    }

    #[test]
    fn what_is_no_radius_and_damage_stay_broken() {
        let plain = golden("ok-plain.cbvh");
        for wrong in [-1.0, f64::NAN, f64::INFINITY, crate::object::MAX_RADIUS.next_up()] {
            let error = with_rounding(&plain, wrong, false).unwrap_err();
            assert_eq!(error.rule, Rule::ObjectNumbers, "{wrong}");
        }
        assert_eq!(validate(&with_rounding(&plain, 0.0, true).unwrap()).unwrap_err().rule, Rule::SolidClosed);
        let mut damaged = plain.clone();
        let last = Layout::read(&plain).unwrap().sections[2].range.start;
        damaged[last] ^= 1;
        let error = validate(&with_rounding(&damaged, 0.5, false).unwrap()).unwrap_err();
        assert_eq!(error.rule, Rule::SectionChecksum);
        assert!(with_rounding(&plain[..100], 0.5, false).is_err());
    }
}
