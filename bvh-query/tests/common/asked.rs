//! Asks a file of any bytes every query, and provides the valid files that tests damage.

use super::shapes::{dirty, soup};
use super::{Random, mesh, options};
use bvh_bake::to_bytes;
use bvh_format::leaf::TriangleEncoding;
use bvh_format::profile::Profile;
use bvh_query::{
    Bvh, ClosestPoint, Contact, Distance, Pose, Querier, QueryError, Ray, RayHit, Relation, Side,
};
use cbvh_testkit::seal::section;
use std::ops::ControlFlow;
use std::path::Path;

/// The answers of a file to every query, errors included.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Answers {
    pub(crate) collide: Result<bool, QueryError>,
    pub(crate) contacts: Result<Vec<Contact>, QueryError>,
    pub(crate) distance: Result<Distance, QueryError>,
    pub(crate) within: Result<bool, QueryError>,
    pub(crate) relation: Result<Relation, QueryError>,
    /// About a point, a ray and a segment, and B.
    pub(crate) closest: Result<Option<ClosestPoint>, QueryError>,
    pub(crate) side: Result<Side, QueryError>,
    pub(crate) hits: Result<Vec<RayHit>, QueryError>,
    pub(crate) segment: Result<bool, QueryError>,
}

impl Answers {
    /// Returns whether any answer was refused. That a file does not state what is closed is no refusal.
    pub(crate) fn is_refused(&self) -> bool {
        let is_told =
            |error: Option<&QueryError>| error.is_some_and(|error| *error != QueryError::NoTopology);
        let of_pairs = self.collide.is_err() || self.contacts.is_err() || self.distance.is_err();
        let of_probes = self.closest.is_err() || self.hits.is_err() || self.segment.is_err();
        let of_sides = is_told(self.side.as_ref().err()) || is_told(self.relation.as_ref().err());
        of_pairs || of_probes || of_sides || self.within.is_err()
    }

    /// Returns whether each answer either was refused or is that of the undamaged file.
    pub(crate) fn are_refused_or(&self, other: &Self) -> bool {
        (self.collide.is_err() || self.collide == other.collide)
            && (self.distance.is_err() || self.distance == other.distance)
            && (self.within.is_err() || self.within == other.within)
            && (self.contacts.is_err() || self.contacts == other.contacts)
            && (self.relation.is_err() || self.relation == other.relation)
            && (self.closest.is_err() || self.closest == other.closest)
            && (self.side.is_err() || self.side == other.side)
            && (self.hits.is_err() || self.hits == other.hits)
            && (self.segment.is_err() || self.segment == other.segment)
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
        let (at, point) = (b.all().at(pose), [0.25, -0.5, 0.125]);
        Answers {
            collide: querier.collide(a, b, pose),
            contacts: visited.map(|_| contacts),
            distance: querier.distance(a, b, pose),
            within: querier.within(a, b, pose, 0.25),
            relation: querier.relation(a, b, pose),
            closest: querier.closest_point(at, point, f64::INFINITY),
            side: querier.side(at, point),
            hits: querier.all_hits(at, &Ray::new(point, [0.3, 0.2, -0.9])),
            segment: querier.segment_hit(at, point, [0.1, 0.2, -0.3]),
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

/// Returns a place in a file of any bytes, more often one that is in use: near the start of a page or of a section.
pub(crate) fn place_in_file(bytes: &[u8], random: &mut Random) -> usize {
    let start = match random.below(3) {
        0 => section(bytes, 1 + random.below(8) as u32).start,
        _ => 4096 * random.below(bytes.len().div_ceil(4096)),
    };
    let within = if random.below(3) == 0 { random.below(4096) } else { random.below(512) };
    (start + within).min(bytes.len() - 1)
}
