//! Hard cases: asks cbvh and, if their programs exist, other libraries, judges the answers, and writes three files.

mod judge;
mod markdown;
mod own;
mod peers;
mod record;

use crate::arguments::HardArguments;
use crate::{Failure, output};
use cbvh_testkit::hard_cases::{self, Case, Truth};
use own::Own;
use peers::{Peer, Questions};
use rayon::prelude::*;
use record::{Answers, Asked, Record};
use std::path::Path;

pub(crate) fn run(arguments: &HardArguments) -> Result<String, Failure> {
    let out = &arguments.out;
    let mut peers = arguments.peers.as_deref().map(Peer::find).transpose()?.unwrap_or_default();
    output::make_folder(out)?;
    let questions = Questions::new()?;
    let all: Vec<Case> = hard_cases::all().into_iter().step_by(usize::from(arguments.every)).collect();
    let own: Vec<Vec<Own>> = all.par_iter().enumerate().map(|(number, case)| ask_own(number, case)).collect();
    let asked = all.iter().zip(own).map(|(case, own)| ask_others(case, own, &mut peers, &questions));
    let cases = asked.collect::<Result<Vec<_>, _>>()?;
    let record = Record::new(cases, &peers);
    let files = [("hard.json", output::json(&record)?), ("hard.md", markdown::page(&record))];
    output::write(out, &files)?;
    match record.first_wrong() {
        None => Ok(summary(&record, out)),
        Some(first) => {
            let wrong = record.wrong();
            Err(format!("{}: {wrong} wrong answers; the first: {first}", out.join("hard.json").display())
                .into())
        }
    }
}

/// Asks cbvh about a case in all orders. The listed order is asked in all layouts; in the other orders the layouts take
/// turns from case to case.
fn ask_own(number: usize, case: &Case) -> Vec<Own> {
    let share = |turn: usize| (turn > 0).then_some(number + turn);
    case.orders().iter().enumerate().map(|(turn, order)| own::ask(case, order, share(turn))).collect()
}

/// Asks the other libraries about a case in all orders, and returns all answers.
fn ask_others(
    case: &Case,
    own: Vec<Own>,
    peers: &mut [Peer],
    questions: &Questions,
) -> Result<Asked, Failure> {
    let mut asked = Asked::new(case);
    for (order, own) in case.orders().into_iter().zip(own) {
        let mut others = Vec::new();
        if !peers.is_empty() && !matches!(case.truth, Truth::Refused { .. }) {
            questions.write(&order)?;
            for peer in &mut *peers {
                others.extend(peer.ask(questions, &case.truth, &order)?);
            }
        }
        asked.orders.push(Answers { order: order.name, own, others });
    }
    Ok(asked)
}

fn summary(record: &Record, out: &Path) -> String {
    let orders: usize = record.cases.iter().map(|case| case.orders.len()).sum();
    let page = out.join("hard.md");
    let (page, cases, wrong) = (page.display(), record.cases.len(), record.wrong());
    let mut text = format!("{page}: {cases} cases in {orders} orders; cbvh: {wrong} wrong answers\n");
    for peer in &record.peers {
        let (wrong, asked) = (peer.total_wrong(), peer.total_asked());
        text += &format!("{} {}: {wrong} wrong of {asked}\n", peer.name, peer.version);
    }
    text
}

/// Writes a number in the fewest digits that give it back.
fn digits(x: f64) -> String {
    format!("{x:?}")
}
