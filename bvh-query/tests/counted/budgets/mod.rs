//! Asks every question of forged files with small budgets, and counts what each question takes: calls and bytes.
//!
//! A question has the answer that it has without a budget, or ends with the budget's error. It never takes more than the
//! budget allows, though the files are such that it would take millions of times as much.

mod pairs;
mod scenes;

use crate::allocator::peak;
use crate::common::Triangle;
use bvh_query::{QueryError, SceneError};
use std::fmt::Debug;

const BUDGETS: [u64; 4] = [0, 1, 100, 10_000];
/// The bytes that a question may take whatever its budget: the memory that a querier begins with.
const BASE_BYTES: u64 = 2 << 20;
/// The bytes that a visit may add: both nodes that it opens, and vectors of twice the length.
const BYTES_PER_VISIT: u64 = 16 << 10;

/// The errors of a budget that ran out.
trait Spent: PartialEq + Debug {
    fn is_spent(&self, budget: u64) -> bool;
}

impl Spent for QueryError {
    fn is_spent(&self, budget: u64) -> bool {
        *self == QueryError::Budget { visits: budget }
    }
}

impl Spent for SceneError {
    fn is_spent(&self, budget: u64) -> bool {
        match self {
            SceneError::Query(source)
            | SceneError::Pair { source, .. }
            | SceneError::Instance { source, .. } => source.is_spent(budget),
            _ => false,
        }
    }
}

/// Lets batches and parallel scenes work on this thread alone, whose bytes are counted. WebAssembly has no other.
fn use_this_thread() {
    #[cfg(not(target_family = "wasm"))]
    rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread().build().unwrap();
}

/// Asks with a budget, and checks the bytes and the error. Returns the answer.
fn within_budget<R: Debug, E: Spent>(
    name: &str,
    budget: u64,
    ask: impl FnOnce() -> Result<R, E>,
) -> Result<R, E> {
    let (bytes, answer) = peak(ask);
    let most = BASE_BYTES + budget * BYTES_PER_VISIT;
    assert!(bytes as u64 <= most, "{name}, budget {budget}: {bytes} bytes, not {most}");
    if let Err(error) = &answer {
        assert!(error.is_spent(budget), "{name}, budget {budget}: {error:?}");
    }
    answer
}

/// Returns an answer as text to compare.
fn text<R: Debug, E>(answer: Result<R, E>) -> Result<String, E> {
    answer.map(|answer| format!("{answer:?}"))
}

/// A tetrahedron at a place.
fn tetrahedron(size: f64, at: [f64; 3]) -> Vec<Triangle> {
    let corner = |axis: usize| [0, 1, 2].map(|k| at[k] + if k == axis { size } else { 0.0 });
    let [o, x, y, z] = [at, corner(0), corner(1), corner(2)];
    vec![[o, y, x], [o, x, z], [o, z, y], [x, y, z]]
}

/// Many small tetrahedra, on a line along y.
fn dust(count: usize) -> Vec<Triangle> {
    (0..count).flat_map(|number| tetrahedron(0.25, [0.0, number as f64, 0.0])).collect()
}
