//! Writes pages, for all commands that make one.

use crate::console::Failure;
use crate::options::size;
use bvh_bake::write_atomically_with;
use cbvh_view::{DEFAULT_MAX_BYTES, Page, PageError};
use clap::Args;
use std::path::Path;

/// The options of pages.
#[derive(Debug, Args)]
pub(crate) struct PageArguments {
    /// The most bytes of meshes in a page, such as 512MiB. A browser needs about five times as much memory [default: 256MiB]
    #[arg(long, value_name = "SIZE", value_parser = size, allow_negative_numbers = true)]
    max_page: Option<u64>,
}

impl PageArguments {
    /// Refuses a page that is too large.
    pub(crate) fn limit(&self, page: Page) -> Result<Page, Failure> {
        page.limited_to(self.max_page.unwrap_or(DEFAULT_MAX_BYTES)).map_err(Failure::from_page)
    }

    /// Returns whether a limit was given, which only a page needs.
    pub(crate) fn is_given(&self) -> bool {
        self.max_page.is_some()
    }
}

impl Failure {
    /// Classifies an error of making a page.
    pub(crate) fn from_page(error: PageError) -> Self {
        let remedy = "bake with --triangles packed or quantized to make files smaller";
        match error {
            PageError::TooLarge { found, .. } => {
                let enough = found.div_ceil(1 << 20);
                Self::Limit(format!(
                    "{error}; {remedy}, or give --max-page {enough}MiB and see whether the browser shows it"
                ))
            }
            PageError::FileTooLarge { .. } => Self::Limit(format!("{error}; {remedy}")),
            PageError::Number { .. } => Self::usage(error),
            _ => Self::Invalid(error.to_string()),
        }
    }
}

/// Writes a page whole or not at all.
pub(crate) fn write(page: &Page, path: &Path) -> Result<(), Failure> {
    let written = write_atomically_with(path, |out| page.write(out));
    written.map_err(|error| Failure::from_bake(path.display(), &error))
}

/// Refuses a page that the option calls `-`.
pub(crate) fn refuse_standard_output(option: &str, output: &Path) -> Result<(), Failure> {
    if output != Path::new("-") {
        return Ok(());
    }
    Err(Failure::Usage(format!(
        "{option}: expected a file, found -; a page appears whole or not at all, so it cannot be standard output (write ./- for a \
         file of this name)"
    )))
}

/// Returns the name of a file without its folders.
pub(crate) fn name_of(path: &Path) -> String {
    path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned()
}
