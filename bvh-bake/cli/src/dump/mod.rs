//! `cbvh dump`: shows what a file contains: all of it, one page, or one treelet.

mod arguments;
mod levels;
mod page;
mod statistics;
mod whole;

pub(crate) use arguments::DumpArguments;

use crate::console::{self, Failure};
use bvh_bake::{FileError, StoredFile};
use bvh_format::Layout;
use bvh_format::object::Object;
use bvh_format::page::check_page;
use bvh_format::source::PageBytes;
use serde::Serialize;

/// Prints the file, page or treelet that the arguments name.
pub(crate) fn run(arguments: &DumpArguments) -> Result<(), Failure> {
    let path = &arguments.file;
    let failed = |error: FileError| Failure::from_file(path, error);
    let file = StoredFile::open(path, arguments.max_memory).map_err(failed)?;
    let layout = Layout::read_from(&file).map_err(failed)?;
    let contents = Contents { file, layout };
    if let Some(number) = arguments.page {
        let pages = contents.layout.page_count();
        if number >= pages {
            let text = format!("--page: expected a page below {pages}, found {number}");
            return Err(Failure::Usage(text));
        }
        let dump = page::PageDump::new(&contents, number).map_err(failed)?;
        return print(arguments, &dump, page::PageDump::to_text);
    }
    if let Some(number) = arguments.treelet {
        // The counts are as the file states them, and those of a forged file may overflow.
        let treelets = contents.layout.objects.iter().map(|object| object.record().treelets.get());
        let treelets = treelets.fold(0, u64::saturating_add);
        return match page::TreeletDump::find(&contents, number).map_err(failed)? {
            Some(dump) => print(arguments, &dump, page::TreeletDump::to_text),
            None => {
                let text = format!("--treelet: expected a treelet below {treelets}, found {number}");
                Err(Failure::Usage(text))
            }
        };
    }
    let name = path.display().to_string();
    print(arguments, &whole::FileDump::new(name, &contents).map_err(failed)?, whole::FileDump::to_text)
}

fn print<T: Serialize>(
    arguments: &DumpArguments,
    dump: &T,
    to_text: impl Fn(&T) -> String,
) -> Result<(), Failure> {
    if arguments.json { console::json(dump) } else { console::text(&to_text(dump)) }
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
