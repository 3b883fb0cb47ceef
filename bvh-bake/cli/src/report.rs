//! `cbvh report`: questions whose answers are known, and what came of them. So far, the hard cases.

mod hard;

use crate::arguments::ReportArguments;
use crate::error::Failure;

pub(crate) fn run(arguments: &ReportArguments) -> Result<(), Failure> {
    // The command line has made sure of --hard.
    hard::run(&arguments.out, arguments.peers.as_deref())
}
