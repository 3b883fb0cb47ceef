//! The narrow phase against exact integer arithmetic.

mod distance;
mod generate;
mod intersect;
mod oracle;
