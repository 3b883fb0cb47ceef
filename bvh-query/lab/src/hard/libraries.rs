//! The other libraries that can be asked: the programs of a build, by name.

use super::peers::Peer;
use crate::Failure;
use std::path::Path;

/// Name, program, variant, precision, modes.
type Known = (&'static str, &'static str, &'static str, &'static str, &'static [&'static str]);

const KNOWN: [Known; 10] = [
    ("coal-OBBRSS", "peer_coal", "OBBRSS", "f64", &["collide", "contacts", "distance"]),
    ("coal-OBB", "peer_coal", "OBB", "f64", &["collide", "contacts"]),
    ("fcl-OBBRSS", "peer_fcl", "OBBRSS", "f64", &["collide", "contacts", "distance"]),
    ("fcl-OBB", "peer_fcl", "OBB", "f64", &["collide", "contacts"]),
    ("parry3d", "peer_parry", "api", "f32", &["collide", "distance"]),
    ("parry3d-f64", "peer_parry", "api-f64", "f64", &["collide", "distance"]),
    ("cgal-rigid", "peer_cgal", "", "f64", &["collide"]),
    ("bullet-gimpact", "peer_bullet", "", "f32", &["collide", "contacts"]),
    ("ode-opcode", "peer_ode", "", "f32", &["collide"]),
    // Embree has a tree of boxes; its program tests triangles itself, in f64.
    ("embree-boxes", "peer_embree", "refit", "f32", &["collide", "contacts"]),
];

/// Returns all known programs in `build/bin`.
pub(super) fn find(build: &Path) -> Result<Vec<Peer>, Failure> {
    let bin = build.join("bin");
    let there = KNOWN.into_iter().filter(|known| bin.join(known.1).is_file());
    let peers: Vec<_> = there
        .map(|(name, program, variant, precision, modes)| {
            // The program runs in another folder.
            let program = bin.join(program).canonicalize().unwrap_or_else(|_| bin.join(program));
            Peer::new(name, program, variant, precision, modes)
        })
        .collect();
    if peers.is_empty() {
        return Err(format!("{}: expected programs peer_*, found none", bin.display()).into());
    }
    Ok(peers)
}
