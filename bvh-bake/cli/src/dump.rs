//! `cbvh dump`: what is in a file, as a whole, a page of it, or a treelet.

mod page;
mod statistics;
mod whole;

use crate::arguments::DumpArguments;
use crate::error::Failure;
use crate::opened;
use crate::output;
use bvh_format::object::Object;
use bvh_format::page::{PAGE, Page, check_page};
use bvh_format::{FormatError, Rule};
use bvh_query::Bvh;
use serde::Serialize;

pub(crate) fn run(arguments: &DumpArguments) -> Result<(), Failure> {
    let path = &arguments.file;
    let bvh = opened::open(path)?;
    let failed = |error: FormatError| Failure::invalid(path, error);
    if let Some(number) = arguments.page {
        let pages = bvh.layout().page_count();
        if number >= pages {
            let text = format!("--page: expected a page below {pages}, found {number}");
            return Err(Failure::Usage(text));
        }
        return print(
            arguments,
            &page::PageDump::new(&bvh, number).map_err(failed)?,
            page::PageDump::to_text,
        );
    }
    if let Some(number) = arguments.treelet {
        // As stated: the numbers of a forged file may have no sum.
        let treelets = bvh.objects().iter().map(|object| object.record.treelets.get());
        let treelets = treelets.fold(0, u64::saturating_add);
        return match page::TreeletDump::find(&bvh, number).map_err(failed)? {
            Some(dump) => print(arguments, &dump, page::TreeletDump::to_text),
            None => {
                let text = format!("--treelet: expected a treelet below {treelets}, found {number}");
                Err(Failure::Usage(text))
            }
        };
    }
    let name = path.display().to_string();
    print(arguments, &whole::FileDump::new(name, &bvh).map_err(failed)?, whole::FileDump::to_text)
}

fn print<T: Serialize>(
    arguments: &DumpArguments,
    dump: &T,
    to_text: impl Fn(&T) -> String,
) -> Result<(), Failure> {
    if arguments.json { output::json(dump) } else { output::text(&to_text(dump)) }
}

/// The object that a page belongs to.
fn object_of(bvh: &Bvh, page: u32) -> Option<(usize, &Object)> {
    let holds = |object: &Object| {
        let first = object.record.first_page.get();
        page >= first && page - first < object.record.pages.get()
    };
    bvh.objects().iter().enumerate().find(|(_, object)| holds(object))
}

/// A page that has been checked, so that what it says can be relied on.
fn checked<'a>(bvh: &'a Bvh, object: &Object, number: u32) -> Result<Page<'a>, FormatError> {
    let at = bvh.layout().page_offset(number);
    let bytes: &[u8; PAGE] = bvh
        .layout()
        .page_bytes(bvh.bytes(), number)
        .ok_or_else(|| FormatError::new(Rule::ObjectPages, at, "a page", "the end of the section"))?;
    check_page(bytes, number, object, at)?;
    Ok(Page::new(bytes, object.profile))
}
