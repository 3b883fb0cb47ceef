//! The exact oracles of the tests, in integers of any length: a pair takes from ten microseconds to a millisecond.
#![allow(dead_code, reason = "the tests use the rest")]

#[path = "../../../tests/exact/ball.rs"]
pub(super) mod ball;
#[path = "../../../tests/exact/decide.rs"]
pub(super) mod decide;
#[path = "../../../tests/exact/dyadic.rs"]
pub(super) mod dyadic;
#[path = "../../../tests/exact/features.rs"]
pub(super) mod features;
#[path = "../../../tests/exact/length.rs"]
pub(super) mod length;
#[path = "../../../tests/exact/meet.rs"]
pub(super) mod meet;
#[path = "../../../tests/exact/number.rs"]
pub(super) mod number;
#[path = "../../../tests/exact/separation.rs"]
pub(super) mod separation;
