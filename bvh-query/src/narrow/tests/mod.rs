//! Compares the narrow phase with exact integer arithmetic.

mod depth;
mod distance;
mod generate;
mod intersect;
mod many;
mod oracle;
mod within;

#[path = "../../../tests/exact"]
#[allow(dead_code, reason = "the integration tests use the rest")]
mod exact {
    pub(super) mod ball;
    pub(super) mod decide;
    pub(super) mod dyadic;
    pub(super) mod features;
    pub(super) mod length;
    pub(super) mod meet;
    pub(super) mod number;
    pub(super) mod separation;
}
