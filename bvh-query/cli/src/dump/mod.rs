//! `cbvh dump`: shows the contents of a whole file, of one page, or of one treelet.

mod page;
mod statistics;
mod text;
mod whole;

use crate::console::{self, Failure};
use crate::options::{size, whole};
use bvh_bake::{FileError, StoredFile};
use bvh_format::Layout;
use bvh_format::object::Object;
use bvh_format::page::{Page, check_page};
use bvh_format::source::PageBytes;
use bvh_format::treelet::Child;
use clap::Args;
use std::path::PathBuf;

/// Prints the file, page or treelet that the arguments name.
pub(crate) fn run(arguments: &DumpArguments) -> Result<(), Failure> {
    let path = &arguments.file;
    let failed = |error: FileError| Failure::from_file(path, error);
    let file = StoredFile::open(path, arguments.max_memory).map_err(failed)?;
    let layout = Layout::read_from(&file).map_err(failed)?;
    let contents = Contents { file, layout };
    let shown = if let Some(number) = arguments.page {
        let pages = contents.layout.page_count();
        if number >= pages {
            let text = format!("--page: expected a page below {pages}, found {number}");
            return Err(Failure::Usage(text));
        }
        page::page(&contents, number)
    } else if let Some(number) = arguments.treelet {
        // The counts are as the file states them, and those of a forged file may overflow.
        let treelets = contents.layout.objects.iter().map(|object| object.record().treelets.get());
        let treelets = treelets.fold(0, u64::saturating_add);
        let shown = page::treelet(&contents, number).map_err(failed)?;
        let outside = || format!("--treelet: expected a treelet below {treelets}, found {number}");
        Ok(shown.ok_or_else(|| Failure::Usage(outside()))?)
    } else {
        whole::file(&path.display().to_string(), &contents)
    };
    let record = shown.map_err(failed)?;
    if arguments.json { console::json(&record) } else { console::text(&text::of(&record)) }
}

/// A file that is read piece by piece, and its layout.
struct Contents {
    file: StoredFile,
    layout: Layout,
}

impl Contents {
    /// Returns the object that a page belongs to, and its number.
    fn object_of(&self, page: u32) -> Option<(usize, &Object)> {
        self.layout.objects.iter().enumerate().find(|(_, object)| object.pages().contains(&page))
    }

    /// Reads a page and validates it, so that its contents can be relied on.
    fn checked(&self, object: &Object, number: u32) -> Result<PageBytes<'_>, FileError> {
        let bytes = self.layout.read_page(&self.file, number)?;
        check_page(bytes.page(object).bytes(), number, object, self.layout.page_offset(number))?;
        Ok(bytes)
    }
}

/// Returns the children of a slot of a checked page, each with its place. There are no gaps between them.
fn children(page: &Page, slot: u8) -> impl Iterator<Item = (usize, Child)> {
    let links = page.links(slot);
    (0..links.children()).map(move |place| (place, links.child(place)))
}

const HELP: &str = "\
Examples:
  cbvh dump rock.cbvh
  cbvh dump rock.cbvh --page 3
  cbvh dump rock.cbvh --treelet 0 --json

Treelets are numbered through the whole file, in the order of pages and of the slots in each page.

The file is read piece by piece, in about 10 MiB of memory. \
--max-memory SIZE keeps the process within SIZE; a SIZE that is too small exits with code 4.";

/// What `dump` accepts.
#[derive(Debug, Args)]
#[command(after_help = HELP)]
pub(crate) struct DumpArguments {
    /// The .cbvh file
    pub(crate) file: PathBuf,
    /// Print one JSON object
    #[arg(long)]
    pub(crate) json: bool,
    /// Decode this treelet: the links and slabs of its children
    #[arg(long, value_name = "N", conflicts_with = "page", value_parser = whole::<u64>, allow_negative_numbers = true)]
    pub(crate) treelet: Option<u64>,
    /// Decode this page: its anchors, its links to other pages, its treelets
    #[arg(long, value_name = "N", value_parser = whole::<u32>, allow_negative_numbers = true)]
    pub(crate) page: Option<u32>,
    /// Stay within this much memory, such as 64MiB
    #[arg(long, value_name = "SIZE", value_parser = size, allow_negative_numbers = true)]
    pub(crate) max_memory: Option<u64>,
}
