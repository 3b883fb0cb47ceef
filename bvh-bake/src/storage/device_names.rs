//! The names that Windows takes for devices, in whatever folder and with whatever extension.

use std::path::Path;

/// Returns whether Windows takes a part of a path for a device.
pub(crate) fn names_device(path: &Path) -> bool {
    path.iter().any(|part| is_device(&part.to_string_lossy()))
}

fn is_device(part: &str) -> bool {
    let stem = part.split(['.', ':']).next().unwrap_or_default().trim_end().to_ascii_uppercase();
    let is_port = |kind: &str| {
        let number = stem.strip_prefix(kind).map(|rest| rest.chars().collect::<Vec<_>>());
        matches!(number.as_deref(), Some(['0'..='9' | '¹' | '²' | '³']))
    };
    matches!(&*stem, "CON" | "PRN" | "AUX" | "NUL" | "CONIN$" | "CONOUT$") || is_port("COM") || is_port("LPT")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn devices_are_known_by_their_names() {
        for part in ["NUL", "nul.bin", "con", "COM1", "lpt9.txt", "COM¹", "aux ", "nul:stream"] {
            assert!(is_device(part), "{part}");
        }
        for part in ["null.bin", "COM", "COM10", "a.con", "console", ""] {
            assert!(!is_device(part), "{part}");
        }
        assert!(names_device(Path::new("out/nul.cbvh")) && !names_device(Path::new("out/null.cbvh")));
    }
}
