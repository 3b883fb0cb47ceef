//! `cbvh dump`: what is in a file, as a whole, a page of it, or a treelet.

mod levels;
mod page;
mod statistics;
mod whole;

use crate::arguments::DumpArguments;
use crate::error::Failure;
use crate::output;
use bvh_bake::{FileError, StoredFile};
use bvh_format::Layout;
use bvh_format::object::Object;
use bvh_format::page::check_page;
use bvh_format::source::PageBytes;
use serde::Serialize;

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
        // As stated: the numbers of a forged file may have no sum.
        let treelets = contents.layout.objects.iter().map(|object| object.record.treelets.get());
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
    if arguments.json { output::json(dump) } else { output::text(&to_text(dump)) }
}

/// A file that is read piece by piece, and where everything is in it.
struct Contents {
    file: StoredFile,
    layout: Layout,
}

impl Contents {
    /// The object that a page belongs to.
    fn object_of(&self, page: u32) -> Option<(usize, &Object)> {
        self.layout.objects.iter().enumerate().find(|(_, object)| object.pages().contains(&page))
    }

    /// A page that has been checked, so that what it says can be relied on.
    fn checked(&self, object: &Object, number: u32) -> Result<PageBytes<'_>, FileError> {
        let bytes = self.layout.read_page(&self.file, number)?;
        check_page(bytes.page(object).bytes(), number, object, self.layout.page_offset(number))?;
        Ok(bytes)
    }
}
