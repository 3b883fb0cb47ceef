//! What every command prints, and how it ends: standard output, standard error, exit codes.

mod failure;
mod number;
mod output;
mod spinner;
mod words;

pub(crate) use failure::{Failure, tell_json, tell_line};
pub(crate) use number::significant;
pub(crate) use output::{hex, json, lines, text};
pub(crate) use spinner::spinner;
pub(crate) use words::{length, names, plural};
