//! What a question allocates. These tests are a program of their own, because its allocator counts for all of them.

mod allocator;
#[path = "../common/mod.rs"]
mod common;
mod forged;

mod allocation;
mod bounded;
#[cfg(feature = "parallel")]
mod budgets;
