//! Asks a file of any bytes every query, and provides the valid files that tests damage.

use super::shapes::{dirty, soup};
use super::{mesh, options};
use bvh_bake::to_bytes;
use bvh_format::leaf::TriangleEncoding;
use bvh_format::profile::Profile;
use bvh_query::{
    Bvh, ClosestPoint, Contact, Distance, Intersection, IntersectionSurface, OpenEdges, PatchOptions,
    Patches, Penetration, PenetrationOptions, Pose, Querier, QueryError, Ray, RayHit, Relation, SelfContact,
    Side, SignedDistance,
};
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::Arc;

/// The answers of a file to every query, errors included.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Answers {
    pub(crate) collide: Result<bool, QueryError>,
    pub(crate) contacts: Result<Vec<Contact>, QueryError>,
    /// None if there are too many contacts.
    pub(crate) patches: Option<Result<Patches, QueryError>>,
    /// Of A.
    pub(crate) self_contacts: Result<Vec<SelfContact>, QueryError>,
    pub(crate) distance: Result<Distance, QueryError>,
    pub(crate) within: Result<bool, QueryError>,
    pub(crate) relation: Result<Relation, QueryError>,
    pub(crate) penetration: Result<Penetration, QueryError>,
    pub(crate) signed_distance: Result<SignedDistance, QueryError>,
    pub(crate) intersection: Result<Intersection, QueryError>,
    pub(crate) intersection_surface: Result<IntersectionSurface, QueryError>,
    /// About a point, a ray and a segment, and B.
    pub(crate) closest: Result<Option<ClosestPoint>, QueryError>,
    pub(crate) side: Result<Side, QueryError>,
    pub(crate) hits: Result<Vec<RayHit>, QueryError>,
    pub(crate) segment: Result<bool, QueryError>,
    /// Of the first object of A.
    pub(crate) open_edges: Result<Arc<OpenEdges>, QueryError>,
}

/// The largest number of contacts that is visited, because a forged file may have any number of equal triangles.
pub(crate) const MAX_CONTACTS: usize = 20_000;

impl Answers {
    /// Returns an error that refuses a file, if there is one. That a file does not state what is closed is no refusal, and nor is
    /// that a question has no answer for a radius.
    pub(crate) fn refusal(&self) -> Option<&QueryError> {
        let errors = [
            self.collide.as_ref().err(),
            self.contacts.as_ref().err(),
            self.patches.as_ref().and_then(|patches| patches.as_ref().err()),
            self.self_contacts.as_ref().err(),
            self.distance.as_ref().err(),
            self.within.as_ref().err(),
            self.relation.as_ref().err(),
            self.penetration.as_ref().err(),
            self.signed_distance.as_ref().err(),
            self.intersection.as_ref().err(),
            self.intersection_surface.as_ref().err(),
            self.closest.as_ref().err(),
            self.side.as_ref().err(),
            self.hits.as_ref().err(),
            self.segment.as_ref().err(),
            self.open_edges.as_ref().err(),
        ];
        errors
            .into_iter()
            .flatten()
            .find(|error| !matches!(error, QueryError::NoTopology | QueryError::NotClosed { .. }))
    }

    /// Returns whether any answer was refused.
    pub(crate) fn is_refused(&self) -> bool {
        self.refusal().is_some()
    }

    /// Returns whether each answer either was refused or is that of the undamaged file.
    pub(crate) fn are_refused_or(&self, other: &Self) -> bool {
        fn holds<T: PartialEq>(one: &Result<T, QueryError>, other: &Result<T, QueryError>) -> bool {
            one.is_err() || one == other
        }
        let patches_hold = match (&self.patches, &other.patches) {
            (Some(one), Some(whole)) => holds(one, whole),
            _ => self.patches.is_none() == other.patches.is_none() || self.contacts.is_err(),
        };
        patches_hold && holds(&self.collide, &other.collide) && holds(&self.contacts, &other.contacts)
            && holds(&self.self_contacts, &other.self_contacts)
            && holds(&self.distance, &other.distance) && holds(&self.relation, &other.relation)
            && holds(&self.penetration, &other.penetration)
            && holds(&self.signed_distance, &other.signed_distance) && holds(&self.intersection, &other.intersection)
            && holds(&self.intersection_surface, &other.intersection_surface) && holds(&self.closest, &other.closest) && holds(&self.side, &other.side)
            && holds(&self.open_edges, &other.open_edges)
            && holds(&self.hits, &other.hits) && holds(&self.segment, &other.segment)
            // The limit of `within` is the distance, which may have been refused.
            && (self.distance.is_err() || holds(&self.within, &other.within))
    }

    /// Asks every query about two meshes in a pose, and about a point and a segment from it, with `probed` in its place.
    pub(crate) fn of(
        querier: &mut Querier,
        (a, b, pose): (&Bvh, &Bvh, &Pose),
        (probed, place): (&Bvh, &Pose),
        [point, end]: [[f64; 3]; 2],
    ) -> Self {
        let mut contacts = Vec::new();
        let visited = querier.visit_contacts(a, b, pose, |contact| {
            contacts.push(contact);
            if contacts.len() < MAX_CONTACTS { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
        });
        contacts.sort_unstable();
        let mut self_contacts = Vec::new();
        let self_visited = querier.visit_self_contacts(a, |contact| {
            self_contacts.push(contact);
            if self_contacts.len() < MAX_CONTACTS {
                ControlFlow::Continue(())
            } else {
                ControlFlow::Break(())
            }
        });
        self_contacts.sort_unstable();
        let at = probed.all().at(place);
        let distance = querier.distance(a, b, pose);
        let limit = distance.as_ref().map_or(0.25, |answer| answer.distance);
        Self {
            collide: querier.collide(a, b, pose),
            patches: (contacts.len() < MAX_CONTACTS)
                .then(|| querier.patches(a, b, pose, &PatchOptions::new().max_contacts(500).max_points(4))),
            contacts: visited.map(|_| contacts),
            self_contacts: self_visited.map(|_| self_contacts),
            within: querier.within(a, b, pose, if limit.is_finite() { limit } else { 0.0 }),
            distance,
            relation: querier.relation(a, b, pose),
            penetration: querier.penetration(a, b, pose, &PenetrationOptions::new()),
            signed_distance: querier.signed_distance(a, b, pose, &PenetrationOptions::new()),
            intersection: querier.intersection(a, b, pose),
            intersection_surface: querier.intersection_surface(a, b, pose),
            closest: querier.closest_point(at, point, f64::INFINITY),
            side: querier.side(at, point),
            hits: querier.all_hits(at, &Ray::new(point, [0.3, 0.2, -0.9])),
            segment: querier.segment_hit(at, point, end),
            open_edges: a.open_edges(0),
        }
    }
}

/// Asks every query with the file as A and as B.
pub(crate) fn ask(querier: &mut Querier, bytes: &[u8], good: &Bvh, pose: &Pose) -> Option<[Answers; 2]> {
    let bvh = Bvh::from_bytes(bytes.to_vec()).ok()?;
    let segment = [[0.25, -0.5, 0.125], [0.1, 0.2, -0.3]];
    let mut ask = |a: &Bvh, b: &Bvh| Answers::of(querier, (a, b, pose), (b, pose), segment);
    Some([ask(&bvh, good), ask(good, &bvh)])
}

/// Returns the valid files to damage: the golden ones, and one of several pages.
pub(crate) fn victims() -> Vec<Vec<u8>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../testdata");
    let golden = ["plain", "everything", "profiles", "points"].map(|name| format!("ok-{name}.cbvh"));
    let mut files: Vec<_> =
        golden.into_iter().map(|name| std::fs::read(folder.join(name)).unwrap()).collect();
    for profile in [Profile::Dop26U4, Profile::Dop6F16, Profile::Dop14F32] {
        let mesh = mesh(&dirty(&soup(900, 1), 2));
        files.push(to_bytes(&mesh, &options(profile, TriangleEncoding::Packed)).unwrap().0);
    }
    files
}
