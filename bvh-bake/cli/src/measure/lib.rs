//! The common part of `cbvh report` and the laboratory of this project: the origin of a report, and how it is written.
//!
//! This library is not meant for applications, and nothing in it is stable.

pub mod origin;

/// Writes reports.
pub mod table {
    use serde::Serialize;

    /// Writes a report as one JSON object, with a line feed at the end.
    ///
    /// # Errors
    /// Returns the error of the serializer.
    pub fn json(report: &impl Serialize) -> Result<String, serde_json::Error> {
        Ok(serde_json::to_string_pretty(report)? + "\n")
    }
}
