//! The arguments of `cbvh dump`.

use crate::options::{size, whole};
use clap::Args;
use std::path::PathBuf;

const HELP: &str = "\
Examples:
  cbvh dump rock.cbvh
  cbvh dump rock.cbvh --page 3
  cbvh dump rock.cbvh --treelet 0 --json

Treelets are numbered through the whole file, in the order of pages and of the slots in each page.

The file is read piece by piece. That takes about 10 MiB of memory, and one byte per ten thousand bytes of the file. \
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
