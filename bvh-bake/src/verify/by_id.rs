//! Compares triangle by triangle, matched by id.
//!
//! What the file has of each id, stored triangles and duplicates left out, is sorted by id, and then gone through beside
//! the mesh. Of several differences the one told is the first in the order of the leaves.

use super::input::{Corners, Input};
use super::{Stored, VerifyError, distance, each_triangle, place, tolerance};
use crate::means::Means;
use crate::scratch::Spill;
use crate::sorter::{Merge, Sorted, Sorter};
use bvh_format::Layout;
use bvh_format::header::SectionKind;
use bvh_format::object::Object;
use bvh_format::source::{Source, chunks};
use bytemuck::{Pod, Zeroable};

/// Where a triangle is among the leaves: object, page, packet and lane.
type Leaf = [u32; 3];

/// What the file has of an id.
#[derive(Clone, Copy, Pod, Zeroable, PartialEq, Eq, PartialOrd, Ord)]
#[repr(C)]
struct Claim {
    id: u32,
    /// Of the stored triangle.
    leaf: Leaf,
    /// 0 for the stored triangle itself, 1 for the first of its duplicates.
    turn: u32,
    /// The id of the stored triangle.
    kept: u32,
    /// The bits of the stored corners.
    corners: [[u32; 3]; 3],
}

impl Claim {
    fn of_stored(number: u32, triangle: &Stored, id: u32) -> Self {
        // A packet has four lanes.
        let leaf = [number, triangle.page, u32::from(triangle.packet) << 2 | triangle.lane as u32];
        let corners = triangle.corners.map(|corner| corner.map(f32::to_bits));
        Self { id, leaf, turn: 0, kept: id, corners }
    }

    /// The stored triangle.
    fn stored(&self) -> Stored {
        let [_, page, lane] = self.leaf;
        Stored {
            page,
            packet: (lane >> 2) as u16,
            lane: (lane & 3) as usize,
            id: Some(self.kept),
            corners: self.corners.map(|corner| corner.map(f32::from_bits)),
        }
    }

    fn role(&self) -> &'static str {
        if self.turn == 0 { "stored" } else { "a duplicate" }
    }
}

/// Checks that every triangle of the mesh is stored or a duplicate of a stored one, exactly once.
/// Returns the largest distance of a corner from where it is stored, and the number of duplicates.
pub(super) fn compare<S: Source + ?Sized>(
    layout: &Layout,
    source: &S,
    input: &impl Input,
    means: &Means,
) -> Result<(f64, u64), VerifyError>
where
    VerifyError: From<S::Error>,
{
    let spill = means.scratch.spill();
    let stored = stored_claims(layout, source, means, &spill)?;
    let dropped = dropped_claims(layout, source, &stored, means, &spill)?;
    let (mut stored, mut dropped) = (Claims::new(stored.merge())?, Claims::new(dropped.merge())?);
    let mut verdict = Verdict::new(layout, input.counts().iter().sum());
    input.visit(&mut |number, id, corners| {
        let mut any = false;
        // In the order of the leaves.
        loop {
            let claims = if stored.first_of(id) <= dropped.first_of(id) { &mut stored } else { &mut dropped };
            let Some(claim) = claims.take(id)? else { break };
            verdict.judge(&claim, Some((number, corners)), any);
            any = true;
        }
        if !any {
            verdict.missing.get_or_insert(id);
        }
        Ok(())
    })?;
    // What is left has ids that the mesh has not.
    for claims in [&mut stored, &mut dropped] {
        while let Some(claim) = claims.next()? {
            verdict.judge(&claim, None, false);
        }
    }
    verdict.finish()
}

fn stored_claims<S: Source + ?Sized>(
    layout: &Layout,
    source: &S,
    means: &Means,
    spill: &Spill,
) -> Result<Sorted<Claim>, VerifyError>
where
    VerifyError: From<S::Error>,
{
    let mut claims = Sorter::of_runs(means.sorted_at_once::<Claim>(u64::MAX));
    for (number, object) in (0..).zip(&layout.objects) {
        each_triangle(layout, source, object, |triangle| {
            let Some(id) = triangle.id else { return Ok(()) };
            Ok(claims.extend(&[Claim::of_stored(number, triangle, id)], spill)?)
        })?;
    }
    Ok(claims.finish())
}

/// The duplicates that were left out, each with the stored triangle that it is one of. Pairs come in the order of the
/// kept ids, as the stored triangles do.
fn dropped_claims<S: Source + ?Sized>(
    layout: &Layout,
    source: &S,
    stored: &Sorted<Claim>,
    means: &Means,
    spill: &Spill,
) -> Result<Sorted<Claim>, VerifyError>
where
    VerifyError: From<S::Error>,
{
    let mut claims = Sorter::of_runs(means.sorted_at_once::<Claim>(u64::MAX));
    let section = layout.sections.iter().find(|section| section.kind == SectionKind::Duplicates);
    let Some(section) = section else { return Ok(claims.finish()) };
    let mut merge = stored.merge();
    let (mut now, mut turn) = (merge.next()?, 0);
    for chunk in chunks(section.range.clone()) {
        let bytes = source.read(chunk)?;
        for pair in bytes.as_chunks::<8>().0 {
            let [kept, dropped]: [[u8; 4]; 2] = zerocopy::transmute!(*pair);
            let (kept, dropped) = (u32::from_le_bytes(kept), u32::from_le_bytes(dropped));
            while now.is_some_and(|claim| claim.id < kept) {
                (now, turn) = (merge.next()?, 0);
            }
            // A pair that no stored triangle leads to claims nothing.
            if let Some(claim) = now.filter(|claim| claim.id == kept) {
                turn += 1;
                claims.extend(&[Claim { id: dropped, turn, ..claim }], spill)?;
            }
        }
    }
    Ok(claims.finish())
}

/// Claims in ascending order, of which the first can be looked at.
struct Claims<'a> {
    merge: Merge<'a, Claim>,
    first: Option<Claim>,
}

impl<'a> Claims<'a> {
    fn new(mut merge: Merge<'a, Claim>) -> Result<Self, VerifyError> {
        let first = merge.next()?;
        Ok(Self { merge, first })
    }

    /// Where the first claim to an id stands; behind all others if there is none.
    fn first_of(&self, id: u32) -> (bool, Leaf, u32) {
        match &self.first {
            Some(claim) if claim.id == id => (false, claim.leaf, claim.turn),
            _ => (true, Leaf::default(), 0),
        }
    }

    fn take(&mut self, id: u32) -> Result<Option<Claim>, VerifyError> {
        if self.first.is_some_and(|claim| claim.id == id) { self.next() } else { Ok(None) }
    }

    fn next(&mut self) -> Result<Option<Claim>, VerifyError> {
        let next = self.merge.next()?;
        Ok(std::mem::replace(&mut self.first, next))
    }
}

/// What has been found so far.
struct Verdict<'a> {
    layout: &'a Layout,
    /// Triangles of the mesh.
    count: u64,
    max_move: f64,
    duplicates: u64,
    /// The first difference in the order of the leaves.
    first: Option<((Leaf, u32), VerifyError)>,
    /// The first triangle of the mesh that is nowhere.
    missing: Option<u32>,
}

impl<'a> Verdict<'a> {
    fn new(layout: &'a Layout, count: u64) -> Self {
        Self { layout, count, max_move: 0.0, duplicates: 0, first: None, missing: None }
    }

    /// Compares a claim with the triangle of the mesh and the number of its object, if there is one.
    fn judge(&mut self, claim: &Claim, triangle: Option<(u32, &Corners)>, taken: bool) {
        match self.check(claim, triangle, taken) {
            Ok(moved) => {
                self.max_move = self.max_move.max(moved);
                self.duplicates += u64::from(claim.turn > 0);
            }
            Err(error) => {
                let at = (claim.leaf, claim.turn);
                if self.first.as_ref().is_none_or(|(first, _)| at < *first) {
                    self.first = Some((at, error));
                }
            }
        }
    }

    /// How far the corners are from where they are stored.
    fn check(
        &self,
        claim: &Claim,
        triangle: Option<(u32, &Corners)>,
        taken: bool,
    ) -> Result<f64, VerifyError> {
        let what = || format!("triangle {}", claim.id);
        let Some((number, corners)) = triangle else {
            let expected = format!("an id below {}", self.count);
            return Err(VerifyError::differs(what(), expected, format!("{}, {}", claim.id, claim.role())));
        };
        if taken {
            return Err(VerifyError::differs(what(), "once", format!("again, {}", claim.role())));
        }
        // One mesh object for each of the file's, or all for one.
        let own = claim.leaf[0];
        if self.layout.objects.len() > 1 && own != number {
            let expected = format!("in object {number} of the mesh");
            return Err(VerifyError::differs(what(), expected, format!("in that of {own}")));
        }
        // A claim has the number of an object.
        let Some(object) = self.layout.objects.get(own as usize) else { return Ok(0.0) };
        let stored = claim.stored();
        if claim.turn > 0 {
            return check_duplicate(object, &stored, claim.kept, claim.id, *corners);
        }
        (0..3).try_fold(0.0f64, |most, corner| {
            let moved =
                check_corner(object, &stored, claim.id, corner, corners[corner], stored.corners[corner])?;
            Ok(most.max(moved))
        })
    }

    fn finish(self) -> Result<(f64, u64), VerifyError> {
        if let Some((_, error)) = self.first {
            return Err(error);
        }
        // The counts have been compared and none was taken twice, so none is missing but by a pair that no
        // stored triangle leads to.
        match self.missing {
            Some(id) => {
                Err(VerifyError::differs(format!("triangle {id}"), "stored or a duplicate", "neither"))
            }
            None => Ok((self.max_move, self.duplicates)),
        }
    }
}

/// Checks where a corner is stored; returns how far from the mesh's.
fn check_corner(
    object: &Object,
    triangle: &Stored,
    id: u32,
    corner: usize,
    expected: [f64; 3],
    stored: [f32; 3],
) -> Result<f64, VerifyError> {
    let found = place(object, stored);
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

/// Checks that the corners of a triangle left out are those stored, in any order.
fn check_duplicate(
    object: &Object,
    kept: &Stored,
    kept_id: u32,
    id: u32,
    corners: [[f64; 3]; 3],
) -> Result<f64, VerifyError> {
    const ORDERS: [[usize; 3]; 6] = [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [2, 1, 0], [1, 0, 2]];
    let stored = kept.corners.map(|corner| place(object, corner));
    let moved =
        |order: &[usize; 3]| (0..3).map(|i| distance(corners[i], stored[order[i]])).fold(0.0, f64::max);
    let least = ORDERS.iter().map(moved).fold(f64::INFINITY, f64::min);
    if least <= tolerance(object) {
        return Ok(least);
    }
    let what = format!("triangle {id}, left out as a duplicate of {kept_id}");
    Err(VerifyError::differs(what, format!("{corners:?}"), format!("{stored:?}")))
}
