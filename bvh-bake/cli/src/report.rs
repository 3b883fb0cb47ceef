//! `cbvh report`: speed against error over all layouts, speed against size, or questions whose answers are known.

mod answers;
mod axes;
mod cold;
mod csv;
mod files;
mod hard;
mod html;
mod json;
mod machine;
mod measure;
mod model;
mod origin;
mod pairs;
mod pareto;
mod pin;
mod plot;
mod row;
mod scaling;
mod scatter;
mod source;
mod speed;
mod spread;
mod variant;

use crate::arguments::ReportArguments;
use crate::error::Failure;

pub(crate) fn run(arguments: &ReportArguments) -> Result<(), Failure> {
    match &arguments.pairs {
        Some(pairs) => speed::run(pairs, arguments),
        None if arguments.scaling => scaling::run(arguments),
        // The command line has made sure of --hard.
        None => hard::run(&arguments.out, arguments.peers.as_deref()),
    }
}
