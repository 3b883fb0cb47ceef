//! Asks a file of any bytes every query, and provides the valid files that tests damage.

use super::shapes::{dirty, soup};
use super::{mesh, options};
use bvh_bake::to_bytes;
use bvh_format::leaf::TriangleEncoding;
use bvh_format::profile::Profile;
use bvh_query::{Bvh, Contact, Distance, Pose, Querier, QueryError};
use std::ops::ControlFlow;
use std::path::Path;

/// The answers of a file to every query, errors included.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Answers {
    pub(crate) collide: Result<bool, QueryError>,
    pub(crate) contacts: Result<Vec<Contact>, QueryError>,
    pub(crate) distance: Result<Distance, QueryError>,
    pub(crate) within: Result<bool, QueryError>,
}

impl Answers {
    pub(crate) fn is_refused(&self) -> bool {
        self.collide.is_err() || self.contacts.is_err() || self.distance.is_err() || self.within.is_err()
    }

    /// Returns whether each answer either was refused or is that of the undamaged file.
    pub(crate) fn are_refused_or(&self, other: &Self) -> bool {
        (self.collide.is_err() || self.collide == other.collide)
            && (self.distance.is_err() || self.distance == other.distance)
            && (self.within.is_err() || self.within == other.within)
            && (self.contacts.is_err() || self.contacts == other.contacts)
    }
}

/// Asks every query with the file as A and as B. Visits at most some thousand contacts, because a forged file may
/// have any number of equal triangles.
pub(crate) fn ask(querier: &mut Querier, bytes: &[u8], good: &Bvh, pose: &Pose) -> Option<[Answers; 2]> {
    let bvh = Bvh::from_bytes(bytes.to_vec()).ok()?;
    let mut ask = |a: &Bvh, b: &Bvh| {
        let mut contacts = Vec::new();
        let visited = querier.visit_contacts(a, b, pose, |contact| {
            contacts.push(contact);
            if contacts.len() < 5000 { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
        });
        contacts.sort_unstable();
        Answers {
            collide: querier.collide(a, b, pose),
            contacts: visited.map(|_| contacts),
            distance: querier.distance(a, b, pose),
            within: querier.within(a, b, pose, 0.25),
        }
    };
    Some([ask(&bvh, good), ask(good, &bvh)])
}

/// Returns the valid files to damage: the golden ones, and one of several pages.
pub(crate) fn victims() -> Vec<Vec<u8>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../testdata");
    let golden = ["plain", "everything", "profiles"].map(|name| format!("ok-{name}.cbvh"));
    let mut files: Vec<_> =
        golden.into_iter().map(|name| std::fs::read(folder.join(name)).unwrap()).collect();
    for profile in [Profile::Dop26U4, Profile::Dop6F16, Profile::Dop14F32] {
        let mesh = mesh(&dirty(&soup(900, 1), 2));
        files.push(to_bytes(&mesh, &options(profile, TriangleEncoding::Packed)).unwrap().0);
    }
    files
}
