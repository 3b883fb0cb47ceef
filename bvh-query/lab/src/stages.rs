//! Measures what the stages of a question about two meshes take, beside the question without the clock of the stages.

use crate::Failure;
use crate::arguments::StagesArguments;
use bvh_query::stages::{Spent, Stage, record, ticks};
use bvh_query::{Bvh, Pose, Querier, QueryError};
use std::fmt::Write;
use std::hint::black_box;
use std::ops::ControlFlow;
use std::path::Path;
use std::time::Instant;

/// The ticks of a question, and what its stages took, if the clock was running.
type Measured = (u64, [Spent; Stage::ALL.len()]);

/// Measures all poses and returns the table.
pub(crate) fn run(arguments: &StagesArguments) -> Result<String, Failure> {
    let StagesArguments { ask, repeat, rounds, .. } = arguments;
    let (a, b, poses) = (Bvh::read(&arguments.a)?, Bvh::read(&arguments.b)?, read_poses(&arguments.poses)?);
    let mut querier = Querier::new()?;
    let backend = querier.backend().name();
    let mut answer = |pose: &Pose| -> Result<f64, QueryError> {
        Ok(match &**ask {
            "distance" => querier.distance(&a, &b, pose)?.distance,
            "contacts" => querier.visit_contacts(&a, &b, pose, |_| ControlFlow::Continue(()))? as f64,
            _ => f64::from(u8::from(querier.collide(&a, &b, pose)?)),
        })
    };
    let mut measure = |pose: &Pose, clock_runs: bool| -> Result<Measured, QueryError> {
        let start = ticks();
        let (answered, spent) =
            if clock_runs { record(|| answer(pose)) } else { (answer(pose), Default::default()) };
        let whole = ticks().saturating_sub(start);
        black_box(answered?);
        Ok((whole, spent))
    };
    for pose in &poses {
        measure(pose, true)?;
    }
    let (began, first) = (Instant::now(), ticks());
    // By pose, without the clock and with it.
    let mut fastest: Vec<[Measured; 2]> = vec![[(u64::MAX, Default::default()); 2]; poses.len()];
    for _ in 0..*rounds {
        for clock_runs in [false, true] {
            for (pose, fastest) in poses.iter().zip(&mut fastest) {
                let fastest = &mut fastest[usize::from(clock_runs)];
                for time in 0..*repeat {
                    let measured = measure(pose, clock_runs)?;
                    if (time > 0 || *repeat == 1) && measured.0 < fastest.0 {
                        *fastest = measured;
                    }
                }
            }
        }
    }
    let nanoseconds = began.elapsed().as_nanos() as f64 / (ticks() - first) as f64;
    let (clock, rows) = table(&fastest)?;
    Ok(format!(
        "{ask}, {} poses, each asked {repeat} times in a row, fastest of {rounds} rounds; {backend}\n\
         1 tick = {nanoseconds:.3} ns; {clock}\n{rows}",
        poses.len()
    ))
}

/// Returns what the clock took, and the table of what a question takes, on average over the poses.
fn table(fastest: &[[Measured; 2]]) -> Result<(String, String), Failure> {
    let mean = |of: &dyn Fn(&[Measured; 2]) -> u64| {
        fastest.iter().map(|measured| of(measured) as f64).sum::<f64>() / fastest.len() as f64
    };
    let whole = mean(&|[(without, _), _]| *without);
    let sum = |part: fn(&Spent) -> u64| mean(&|[_, (_, spent)]| spent.iter().map(part).sum());
    let (ticks, readings) = (sum(|spent| spent.ticks), sum(|spent| spent.readings));
    // What the clock adds to a question, in equal shares.
    let cost = (ticks - whole) / readings;
    let clock =
        format!("{readings:.0} readings of the clock per question, {cost:.1} ticks each, are subtracted");
    let mut rows =
        format!("{:32}{:>10}{:>12}{:>14}{:>8}\n", "stage", "calls", "ticks/call", "ticks/query", "share");
    let mut row = |name: &str, calls: f64, ticks: f64| {
        let (each, share) = (ticks / calls, 100.0 * ticks / whole);
        writeln!(rows, "{name:32}{calls:>10.2}{each:>12.1}{ticks:>14.1}{share:>7.1}%")
    };
    for stage in Stage::ALL {
        let of_stage = |part: fn(&Spent) -> u64| mean(&|[_, (_, spent)]| part(&spent[stage as usize]));
        let [calls, ticks, readings] =
            [of_stage(|spent| spent.calls), of_stage(|spent| spent.ticks), of_stage(|spent| spent.readings)];
        if calls > 0.0 {
            row(stage.name(), calls, ticks - cost * readings)?;
        }
    }
    row("the question, without the clock", 1.0, whole)?;
    Ok((clock, rows))
}

/// Reads poses, one per line: the rows of a 3 by 4 matrix. `#` starts a comment.
fn read_poses(path: &Path) -> Result<Vec<Pose>, Failure> {
    let text = std::fs::read_to_string(path).map_err(|error| format!("{}: {error}", path.display()))?;
    let mut poses = Vec::new();
    for (number, line) in text.lines().enumerate() {
        let words: Vec<&str> = line.split('#').next().unwrap_or("").split_whitespace().collect();
        if !words.is_empty() {
            let place = format!("{}, line {}", path.display(), number + 1);
            poses.push(read_pose(&words).map_err(|error| format!("{place}: {error}"))?);
        }
    }
    if poses.is_empty() {
        return Err(format!("{}: expected at least one pose, found none", path.display()).into());
    }
    Ok(poses)
}

fn read_pose(words: &[&str]) -> Result<Pose, Failure> {
    let numbers: Vec<f64> = words.iter().map(|word| word.parse()).collect::<Result<_, _>>()?;
    match <&[f64; 12]>::try_from(&numbers[..]) {
        Ok(rows) => Ok(Pose::from_rows(rows)?),
        Err(_) => Err(format!("expected 12 numbers, found {}", numbers.len()).into()),
    }
}
