//! `cbvh bake` of many assets: baked in parallel within one budget, with one line of results per asset.
//!
//! Each thread takes the next asset in turn, waits for its share of the memory, and bakes it on the thread pool that
//! all share. If an asset fails, the failure is printed and noted, and the next asset follows.

mod journal;
mod list;
mod shares;

use crate::asking::files::regular_file;
use crate::bake::{self, BakeArguments, Report};
use crate::console::{self, Failure, record, spinner};
use crate::process::{self, lock};
use bvh_bake::{BakeError, ReadError};
use indicatif::ProgressBar;
use journal::{Journal, Summary};
use list::Asset;
use shares::Shares;
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

/// Bakes all assets of a manifest or a folder.
pub(crate) fn run(arguments: &BakeArguments) -> Result<(), Failure> {
    let options = bake::prepare(arguments)?;
    let start = Instant::now();
    let mut assets = match (&arguments.manifest, &arguments.inputs[..], &arguments.output) {
        (Some(manifest), ..) => list::read_manifest(manifest, &options, arguments.max_memory)?,
        (None, [folder], Some(output)) => list::read_folder(folder, output, &options, arguments.max_memory)?,
        _ => return Err(Failure::usage("expected a manifest or one folder")),
    };
    let results = arguments.out_manifest.as_deref();
    list::refuse_shared_outputs(&assets, arguments.manifest.as_deref(), results)?;
    let known = assets.iter().map(Asset::bytes).sum();
    if let Some(shard) = arguments.shard {
        let mut number = 0..;
        assets.retain(|_| number.next().is_some_and(|number| shard.has(number)));
    }
    let jobs = rayon::current_num_threads();
    let shares = arguments.max_memory.map(|budget| Shares::new(budget.saturating_sub(known), jobs));
    let spinner = spinner(arguments.quiet);
    process::remove_unfinished_files(&spinner)?;
    let done = Done {
        journal: results.map(Journal::open).transpose()?,
        summary: Summary::new(arguments.shard, assets.len()),
        stopped: None,
    };
    let queue = Queue {
        turn: Mutex::new(assets.iter().enumerate()),
        done: Mutex::new(done),
        spinner,
        shares,
        arguments,
    };
    std::thread::scope(|scope| {
        for _ in 1..jobs.min(assets.len()) {
            scope.spawn(|| queue.work());
        }
        queue.work();
    });
    queue.spinner.finish_and_clear();
    let mut done = queue.done.into_inner().unwrap_or_else(PoisonError::into_inner);
    if let Some(failure) = done.stopped {
        return Err(failure);
    }
    if let Some(journal) = done.journal {
        journal.close()?;
    }
    done.summary.close(start.elapsed().as_secs_f64());
    if arguments.json {
        console::json(&done.summary)?;
    } else if !arguments.quiet {
        console::text(&done.summary.to_text())?;
    }
    done.summary.failure(results).map_or(Ok(()), Err)
}

/// The assets to bake and all that the threads share.
struct Queue<'a, T> {
    /// The assets that remain. A thread holds the lock until it has both an asset and its memory, so that others cannot
    /// overtake a large asset for ever.
    turn: Mutex<T>,
    done: Mutex<Done>,
    spinner: ProgressBar,
    /// The memory; `None` without a budget.
    shares: Option<Shares>,
    arguments: &'a BakeArguments,
}

/// The results so far.
struct Done {
    journal: Option<Journal>,
    summary: Summary,
    /// Why no more assets are started.
    stopped: Option<Failure>,
}

impl<'a, T: Iterator<Item = (usize, &'a Asset)> + Send> Queue<'a, T> {
    /// Bakes assets until none remain.
    fn work(&self) {
        loop {
            let mut turn = lock(&self.turn);
            if lock(&self.done).stopped.is_some() {
                return;
            }
            let Some((number, asset)) = turn.next() else { return };
            let share = self.shares.as_ref().map(|shares| shares.take(shares.of(&asset.input)));
            drop(turn);
            let mut baked = self.bake(asset, share.as_ref().map(|share| share.bytes));
            drop(share);
            if let (Some(shares), Err(BakeError::Memory { .. })) = (&self.shares, &baked) {
                // The file has more triangles than its length suggests: bake it again, with the whole budget.
                let turn = lock(&self.turn);
                let share = shares.take(shares.budget());
                drop(turn);
                baked = self.bake(asset, Some(share.bytes));
            }
            if let Err(failure) = self.note(number, asset, baked) {
                lock(&self.done).stopped.get_or_insert(failure);
            }
        }
    }

    fn bake(&self, asset: &Asset, max_memory: Option<u64>) -> Result<Report, BakeError> {
        if let Some(folder) = asset.output.parent() {
            std::fs::create_dir_all(folder).map_err(|source| BakeError::Write {
                path: folder.to_owned(),
                action: "create the folder",
                source,
            })?;
        }
        // The user has not seen these names, so that none of them may make the command wait.
        regular_file(&asset.input).map_err(|source| ReadError::Io { path: asset.input.clone(), source })?;
        let inputs = std::slice::from_ref(&asset.input);
        bake::bake(inputs, &asset.output, &asset.options, self.arguments, max_memory, None)
    }

    /// Counts an asset, writes its line of results, and tells what is wrong with it.
    fn note(&self, number: usize, asset: &Asset, baked: Result<Report, BakeError>) -> Result<(), Failure> {
        let Asset { line, named_input: input, named_output: output, .. } = asset;
        let mut done = lock(&self.done);
        let (record, told): (_, Vec<String>) = match baked {
            Ok(mut report) => {
                (report.input, report.output) = (input.clone(), output.clone());
                done.summary.add(&report);
                let record = record! { line: line, exit_code: 0 }.with(report.json());
                (record, report.warnings().into_iter().map(|warning| format!("warning: {warning}")).collect())
            }
            Err(error) => {
                let failure = Failure::from_bake(asset.input.display(), &error);
                let (code, error) = failure.line().unwrap_or_else(|| (2, error.to_string()));
                done.summary.add_failed(code);
                let what =
                    record! { line: line, exit_code: code, input: input, output: output, error: error };
                (what, vec![error])
            }
        };
        self.spinner.suspend(|| told.iter().for_each(|line| console::tell_line(line)));
        self.spinner.set_message(done.summary.progress());
        match &mut done.journal {
            Some(journal) => journal.add(number, format!("{record}\n")),
            None => Ok(()),
        }
    }
}
