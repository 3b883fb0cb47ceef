//! The report on hard cases: asks this library and, if there are any, others; judges; writes three files.

mod cases;
mod csv;
mod judge;
mod kit;
mod markdown;
mod own;
mod peers;
mod record;

use crate::error::Failure;
use crate::output;
use cases::Case;
use peers::Peer;
use record::Record;
use std::path::Path;

pub(crate) fn run(out: &Path, peers: Option<&Path>) -> Result<(), Failure> {
    let failed =
        |error| Failure::System(format!("{}: expected a folder to write to, found {error}", out.display()));
    let peers = peers.map(kit::find).transpose()?.unwrap_or_default();
    std::fs::create_dir_all(out).map_err(failed)?;
    let report = Report::new(peers)?;
    let json = serde_json::to_string_pretty(&report.record)
        .map_err(|error| Failure::System(format!("JSON: {error}")))?;
    for (name, text) in [
        ("hard.csv", csv::table(&report.record)),
        ("hard.json", json + "\n"),
        ("hard.md", markdown::page(&report.record)),
    ] {
        bvh_bake::write_atomically(&out.join(name), text.as_bytes())
            .map_err(|error| Failure::System(error.to_string()))?;
    }
    output::text(&report.summary(out))?;
    match report.record.first_wrong() {
        None => Ok(()),
        Some(first) => Err(Failure::invalid(
            &out.join("hard.json"),
            format!("expected right answers, found {} wrong; the first: {first}", report.record.wrong()),
        )),
    }
}

struct Report {
    record: Record,
}

impl Report {
    fn new(mut peers: Vec<Peer>) -> Result<Self, Failure> {
        let questions = peers::Questions::new()?;
        let mut cases = Vec::new();
        for (number, case) in cases::all().iter().enumerate() {
            cases.push(Self::ask(number, case, &mut peers, &questions)?);
        }
        Ok(Self { record: Record::new(cases, &peers) })
    }

    fn ask(
        number: usize,
        case: &Case,
        peers: &mut [Peer],
        questions: &peers::Questions,
    ) -> Result<record::Asked, Failure> {
        let mut asked = record::Asked::new(case);
        for (turn, order) in case.orders().into_iter().enumerate() {
            // As listed in all layouts; in the other orders these take turns, from case to case.
            let share = (turn > 0).then_some(number + turn);
            let own = own::ask(case, &order, share);
            let mut others = Vec::new();
            if !peers.is_empty() && !matches!(case.truth, cases::Truth::Refused { .. }) {
                questions.write(&order)?;
                for peer in &mut *peers {
                    others.extend(peer.ask(questions, &case.truth, &order)?);
                }
            }
            asked.orders.push(record::Answers { order: order.name, own, others });
        }
        Ok(asked)
    }

    fn summary(&self, out: &Path) -> String {
        let Record { cases, .. } = &self.record;
        let orders: usize = cases.iter().map(|case| case.orders.len()).sum();
        let mut text = format!(
            "{}: {} cases, {orders} with their orders; cbvh: {} wrong answers\n",
            out.join("hard.md").display(),
            cases.len(),
            self.record.wrong()
        );
        for peer in &self.record.peers {
            text.push_str(&format!(
                "{} {}: {} wrong of {}\n",
                peer.name,
                peer.version,
                peer.total_wrong(),
                peer.total_asked()
            ));
        }
        text
    }
}
