//! Compares a file with a mesh triangle by triangle, matched by id.
//!
//! All triangles of the file, both the stored ones and the duplicates that were left out, are sorted by id and then
//! compared with the mesh in that order. If there are several differences, the error reports the first one in the
//! order of the leaves.

use super::input::{Input, InputCorners};
use super::surfaces::Surfaces;
use super::{File, Stored, VerifyError, distance, tolerance};
use crate::storage::Spill;
use crate::storage::external_sort::{Ahead, Sorted, Sorter};
use crate::storage::resources::Resources;
use bvh_format::Layout;
use bvh_format::header::SectionKind;
use bvh_format::object::Object;
use bvh_format::source::{Source, chunks};
use bytemuck::{Pod, Zeroable};

/// The place of a triangle among the leaves: object, page, and packet with lane.
type Leaf = [u32; 3];

/// A claim of the file to store the triangle with a given id.
#[derive(Clone, Copy, Pod, Zeroable, PartialEq, Eq, PartialOrd, Ord)]
#[repr(C)]
struct Claim {
    id: u32,
    /// The place of the stored triangle.
    leaf: Leaf,
    /// 0 for the stored triangle itself, 1 for the first of its duplicates, and so on.
    turn: u32,
    /// The id of the stored triangle.
    kept: u32,
    /// The place of the stored triangle in its object.
    place: u32,
    spare: u32,
    /// The bits of the stored corners.
    corners: [[u64; 3]; 3],
}

impl Claim {
    fn of_stored(number: u32, triangle: &Stored, id: u32) -> Self {
        // A packet has four lanes.
        let leaf = [number, triangle.page, u32::from(triangle.packet) << 2 | triangle.lane as u32];
        let corners = triangle.corners.map(|corner| corner.map(f64::to_bits));
        Self { id, leaf, turn: 0, kept: id, place: triangle.place, spare: 0, corners }
    }

    /// Returns the stored triangle.
    fn stored(&self) -> Stored {
        let [_, page, lane] = self.leaf;
        Stored {
            place: self.place,
            page,
            packet: (lane >> 2) as u16,
            lane: (lane & 3) as usize,
            id: Some(self.kept),
            corners: self.corners.map(|corner| corner.map(f64::from_bits)),
        }
    }

    fn role(&self) -> &'static str {
        if self.turn == 0 { "stored" } else { "a duplicate" }
    }
}

impl<S: Source + ?Sized> File<'_, S>
where
    VerifyError: From<S::Error>,
{
    /// Checks that every triangle of the mesh is, exactly once, either stored or a duplicate of a stored one. Returns the
    /// largest distance between a corner and the place where it is stored, and the number of duplicates. Adds all triangles
    /// to the surfaces.
    pub(super) fn compare_by_id(
        &self,
        input: &impl Input,
        surfaces: &mut Surfaces,
        resources: &Resources,
    ) -> Result<(f64, u64), VerifyError> {
        let spill = resources.scratch.spill();
        let stored = self.stored_claims(resources, &spill)?;
        let dropped = self.dropped_claims(&stored, resources, &spill)?;
        let (mut stored, mut dropped) = (Ahead::of(&stored)?, Ahead::of(&dropped)?);
        let mut verdict = Verdict::new(self.layout, input.counts().iter().sum());
        input.visit(&mut |number, id, corners| {
            let mut any = false;
            // In the order of the leaves.
            loop {
                let claims =
                    if first_of(&stored, id) <= first_of(&dropped, id) { &mut stored } else { &mut dropped };
                let Some(claim) = claims.next_if(|claim| claim.id == id)? else { break };
                if let Some(way) = verdict.judge(&claim, Some((number, corners)), any) {
                    let ([object, ..], corners) = (claim.leaf, claim.stored().corners);
                    match claim.turn {
                        0 => surfaces.add(object, &corners, way)?,
                        _ => surfaces.add_duplicates(object, claim.place, &corners, way)?,
                    }
                }
                any = true;
            }
            if !any {
                verdict.missing.get_or_insert(id);
            }
            Ok(())
        })?;
        // The remaining claims have ids that do not occur in the mesh.
        for claims in [&mut stored, &mut dropped] {
            while let Some(claim) = claims.next_if(|_| true)? {
                verdict.judge(&claim, None, false);
            }
        }
        verdict.finish()
    }

    fn stored_claims(&self, resources: &Resources, spill: &Spill) -> Result<Sorted<Claim>, VerifyError> {
        let mut claims = Sorter::of_runs(resources.sorted_at_once::<Claim>(u64::MAX));
        for (number, object) in (0..).zip(&self.layout.objects) {
            self.each_triangle(object, |triangle| {
                let Some(id) = triangle.id else { return Ok(()) };
                Ok(claims.extend(&[Claim::of_stored(number, triangle, id)], spill)?)
            })?;
        }
        Ok(claims.finish())
    }

    /// Returns the duplicates that were left out, each with the stored triangle that it equals. The pairs of the file
    /// come in the order of the kept ids, as the stored triangles do.
    fn dropped_claims(
        &self,
        stored: &Sorted<Claim>,
        resources: &Resources,
        spill: &Spill,
    ) -> Result<Sorted<Claim>, VerifyError> {
        let mut claims = Sorter::of_runs(resources.sorted_at_once::<Claim>(u64::MAX));
        let section = self.layout.sections.iter().find(|section| section.kind == SectionKind::Duplicates);
        let Some(section) = section else { return Ok(claims.finish()) };
        let mut merge = stored.merge();
        let (mut now, mut turn) = (merge.next()?, 0);
        for chunk in chunks(section.range.clone()) {
            let bytes = self.source.read(chunk)?;
            for pair in bytes.as_chunks::<8>().0 {
                let [kept, dropped]: [[u8; 4]; 2] = zerocopy::transmute!(*pair);
                let (kept, dropped) = (u32::from_le_bytes(kept), u32::from_le_bytes(dropped));
                while now.is_some_and(|claim| claim.id < kept) {
                    (now, turn) = (merge.next()?, 0);
                }
                // A pair that refers to no stored triangle claims nothing.
                if let Some(claim) = now.filter(|claim| claim.id == kept) {
                    turn += 1;
                    claims.extend(&[Claim { id: dropped, turn, ..claim }], spill)?;
                }
            }
        }
        Ok(claims.finish())
    }
}

/// Returns the place of the first claim to an id, or a place after all others if there is no such claim.
fn first_of(claims: &Ahead<Claim>, id: u32) -> (bool, Leaf, u32) {
    match &claims.first {
        Some(claim) if claim.id == id => (false, claim.leaf, claim.turn),
        _ => (true, Leaf::default(), 0),
    }
}

/// The differences and figures found so far.
struct Verdict<'a> {
    layout: &'a Layout,
    /// The number of triangles in the mesh.
    count: u64,
    max_move: f64,
    duplicates: u64,
    /// The first difference in the order of the leaves.
    first: Option<((Leaf, u32), VerifyError)>,
    /// The first triangle of the mesh that the file does not contain.
    missing: Option<u32>,
}

impl<'a> Verdict<'a> {
    fn new(layout: &'a Layout, count: u64) -> Self {
        Self { layout, count, max_move: 0.0, duplicates: 0, first: None, missing: None }
    }

    /// Compares a claim with the triangle of the mesh that has its id, if there is one, and with the number of that
    /// triangle's object. `taken` says that an earlier claim had the same id. Returns 1 if the triangle of the mesh has the
    /// orientation of the stored one, -1 if it has the opposite one, and nothing if the claim is wrong.
    fn judge(&mut self, claim: &Claim, triangle: Option<(u32, &InputCorners)>, taken: bool) -> Option<i32> {
        match self.check(claim, triangle, taken) {
            Ok((moved, way)) => {
                self.max_move = self.max_move.max(moved);
                self.duplicates += u64::from(claim.turn > 0);
                Some(way)
            }
            Err(error) => {
                let at = (claim.leaf, claim.turn);
                if self.first.as_ref().is_none_or(|(first, _)| at < *first) {
                    self.first = Some((at, error));
                }
                None
            }
        }
    }

    /// Returns the largest distance between a corner and the place where it is stored, and the orientation.
    fn check(
        &self,
        claim: &Claim,
        triangle: Option<(u32, &InputCorners)>,
        taken: bool,
    ) -> Result<(f64, i32), VerifyError> {
        let what = || format!("triangle {}", claim.id);
        let Some((number, corners)) = triangle else {
            let expected = format!("an id below {}", self.count);
            return Err(VerifyError::differs(what(), expected, format!("{}, {}", claim.id, claim.role())));
        };
        if taken {
            return Err(VerifyError::differs(what(), "once", format!("again, {}", claim.role())));
        }
        // The mesh has one object for each of the file's, or the file has one object for all of the mesh's.
        let own = claim.leaf[0];
        if self.layout.objects.len() > 1 && own != number {
            let expected = format!("in object {number} of the mesh");
            return Err(VerifyError::differs(what(), expected, format!("in object {own}")));
        }
        let object = self.layout.objects.get(own as usize).expect("every claim has the number of an object");
        let stored = claim.stored();
        if claim.turn > 0 {
            return check_duplicate(object, &stored, claim.kept, claim.id, *corners);
        }
        let mut most = 0.0f64;
        for corner in 0..3 {
            let moved =
                check_corner(object, &stored, claim.id, corner, corners[corner], stored.corners[corner])?;
            most = most.max(moved);
        }
        Ok((most, 1))
    }

    fn finish(self) -> Result<(f64, u64), VerifyError> {
        if let Some((_, error)) = self.first {
            return Err(error);
        }
        // The counts agree and no id was claimed twice. A triangle can therefore be missing only if a pair refers to
        // no stored triangle.
        match self.missing {
            Some(id) => {
                Err(VerifyError::differs(format!("triangle {id}"), "stored or a duplicate", "neither"))
            }
            None => Ok((self.max_move, self.duplicates)),
        }
    }
}

/// Checks the place where a corner is stored, and returns its distance from the corner in the mesh.
fn check_corner(
    object: &Object,
    triangle: &Stored,
    id: u32,
    corner: usize,
    expected: [f64; 3],
    found: [f64; 3],
) -> Result<f64, VerifyError> {
    let moved = distance(expected, found);
    let limit = tolerance(object);
    // Written such that a NaN fails.
    if moved <= limit {
        return Ok(moved);
    }
    let what = format!("triangle {id}, corner {corner} (page {}, packet {})", triangle.page, triangle.packet);
    Err(VerifyError::differs(
        what,
        format!("{expected:?} within {limit:e}"),
        format!("{found:?}, {moved:e} away"),
    ))
}

/// Checks that a triangle that was left out has the same corners as the stored one, in any order. Returns how far they
/// moved, and 1 or -1 for the same orientation or the opposite one.
fn check_duplicate(
    object: &Object,
    kept: &Stored,
    kept_id: u32,
    id: u32,
    corners: [[f64; 3]; 3],
) -> Result<(f64, i32), VerifyError> {
    // The first three keep the orientation.
    const ORDERS: [[usize; 3]; 6] = [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [2, 1, 0], [1, 0, 2]];
    let stored = kept.corners;
    let moved =
        |order: &[usize; 3]| (0..3).map(|i| distance(corners[i], stored[order[i]])).fold(0.0, f64::max);
    let [same, opposite] =
        [&ORDERS[..3], &ORDERS[3..]].map(|orders| orders.iter().map(moved).fold(f64::INFINITY, f64::min));
    let least = same.min(opposite);
    if least <= tolerance(object) {
        // With two equal corners, both are as far away.
        return Ok((least, if same <= opposite { 1 } else { -1 }));
    }
    let what = format!("triangle {id}, left out as a duplicate of {kept_id}");
    Err(VerifyError::differs(what, format!("{corners:?}"), format!("{stored:?}")))
}
