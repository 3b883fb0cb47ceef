//! The command `cbvh`.
fn main() {}
