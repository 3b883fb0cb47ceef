//! The node filter: bounds 16 pairs of nodes at a time along A's directions and, later in a walk, along B's.

use crate::isa::{Isa, Lanes};
use crate::numerics::F32_SLACK;
use crate::traverse::align::{Alignment, Prepare, form_error};
use crate::traverse::forms::{Form, upper_form};
use crate::traverse::placement::{ObjectPair, Placement};
use bvh_format::kdop::{DirectionSet, FACTORS};
use bvh_format::slabs::{Group, NodeSlabs, row};

/// What the bound of a pair means.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Measure {
    /// Only its sign counts: it is positive if the nodes are apart.
    Overlap,
    /// It is a lower bound of the distance, in mesh units.
    Distance,
    /// Nodes that are apart are left out. Of the others, it is a lower bound of the negated way along a direction on which B
    /// leaves A, in mesh units: those that stay in contact longest have the least bound.
    Leaving,
}

/// The inverse of sqrt 3, the length of directions 3 to 6, rounded down.
const CUBE: f32 = 0.577_350_2;
/// The inverse of sqrt 2, the length of directions 7 to 12, rounded down.
const FACE: f32 = std::f32::consts::FRAC_1_SQRT_2.next_down();
/// The inverse lengths of all directions, by the rows of their slabs; 1 for rows without one.
pub(super) const INVERSE_LENGTHS: [f32; 16] =
    [1.0, 1.0, 1.0, CUBE, CUBE, CUBE, CUBE, 1.0, FACE, FACE, FACE, FACE, FACE, FACE, 1.0, 1.0];

/// Bounds on the magnitudes of all nodes of an object, from those of its root.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Reach {
    /// Of slab ends.
    pub(crate) ends: f32,
    /// Of coordinates.
    pub(crate) coordinates: f32,
}

impl Reach {
    /// Rows of the root without a slab are zero.
    pub(crate) fn of(root: &NodeSlabs) -> Self {
        let larger = |largest: f32, end: &f32| if largest < end.abs() { end.abs() } else { largest };
        let ends = root.lo.iter().chain(&root.hi).fold(0.0, larger);
        Self { ends, coordinates: root.lo[..3].iter().chain(&root.hi[..3]).fold(0.0, larger) }
    }
}

/// How far B moves along a direction until its slabs leave those of A.
#[derive(Clone, Copy, Default)]
struct Ways {
    /// By slab: the way for each unit that B's lower end is below A's upper end, where B moves up, and else 0.
    up: [f32; 13],
    /// The way for each unit that A's lower end is below B's upper end, where B moves down, and else 0.
    down: [f32; 13],
    /// Minus infinity where B moves neither up nor down, and else 0.
    never: [f32; 13],
}

impl Ways {
    /// The least part of a direction along a slab, 2^-60, which counts. Along others B never leaves.
    const LEAST_RATE: f64 = 1.0 / (1u64 << 60) as f64;

    /// Ways are rounded up, by more than f32 rounds when they are applied.
    fn along(direction: [f64; 3]) -> Self {
        let mut ways = Self::default();
        for (slab, [x, y, z]) in FACTORS.into_iter().enumerate() {
            let rate = direction[0] * x + direction[1] * y + direction[2] * z;
            let way = ((1.0 + f64::from(F32_SLACK)) / rate.abs()) as f32;
            if rate > Self::LEAST_RATE {
                ways.up[slab] = way;
            } else if rate < -Self::LEAST_RATE {
                ways.down[slab] = way;
            } else {
                ways.never[slab] = f32::NEG_INFINITY;
            }
        }
        ways
    }
}

/// A direction in A's frame along which one more pair of slab ends is compared.
#[derive(Clone, Copy)]
pub(crate) struct SeparatingDirection {
    direction: [f32; 3],
    /// The upper end of a node of A.
    form_a: Form,
    /// The lower end of a node of B, less the offset.
    form_b: Form,
    offset: f32,
}

/// The test of 16 pairs of nodes, for one pose.
pub(crate) struct NodeFilter {
    /// B along A's directions.
    alignment: Alignment,
    /// B along A's directions in the other placement, if there are two.
    end: Alignment,
    /// A along B's directions, prepared once that pays.
    inverse: Alignment,
    looks_along_b: bool,
    /// For `Measure::Leaving`.
    ways: Ways,
    placement: Placement,
    set_a: DirectionSet,
    set_b: DirectionSet,
    reach_a: Reach,
    reach_b: Reach,
}

impl Default for NodeFilter {
    /// An empty test, before the first pose is prepared.
    fn default() -> Self {
        Self {
            alignment: Alignment::NONE,
            end: Alignment::NONE,
            inverse: Alignment::NONE,
            looks_along_b: false,
            ways: Ways::default(),
            placement: Placement::NONE,
            set_a: DirectionSet::Dop6,
            set_b: DirectionSet::Dop6,
            reach_a: Reach { ends: 0.0, coordinates: 0.0 },
            reach_b: Reach { ends: 0.0, coordinates: 0.0 },
        }
    }
}

impl NodeFilter {
    /// Prepares a pose.
    #[inline(always)]
    pub(crate) fn prepare<I: Isa>(
        &mut self,
        isa: I,
        pair: &ObjectPair<'_>,
        (reach_a, reach_b): (Reach, Reach),
    ) {
        self.looks_along_b = false;
        self.placement = *pair.placement;
        (self.set_a, self.set_b) =
            (pair.object_a.profile().directions(), pair.object_b.profile().directions());
        (self.reach_a, self.reach_b) = (reach_a, reach_b);
        let (alignment, placement) = (&mut self.alignment, pair.placement);
        isa.run(Prepare { alignment, placement, set: self.set_b, reach: reach_b.ends });
    }

    /// Prepares the other placement of B.
    #[inline(always)]
    pub(crate) fn prepare_end<I: Isa>(&mut self, isa: I, end: &Placement) {
        let (alignment, set, reach) = (&mut self.end, self.set_b, self.reach_b.ends);
        isa.run(Prepare { alignment, placement: end, set, reach });
    }

    /// Prepares `leaving` for a B that moves along a direction of about unit length.
    pub(crate) fn prepare_ways(&mut self, direction: [f64; 3]) {
        self.ways = Ways::along(direction);
    }

    /// Adopts a new separating direction.
    #[inline(always)]
    pub(crate) fn update_separating(
        &self,
        separating: &mut Option<SeparatingDirection>,
        direction: Option<[f32; 3]>,
    ) {
        if let Some(direction) = direction
            && separating.is_none_or(|held| held.direction != direction)
        {
            *separating = Some(self.separating_direction(direction));
        }
    }

    /// `direction` is at most of length 1.
    fn separating_direction(&self, direction: [f32; 3]) -> SeparatingDirection {
        let d = direction.map(f64::from);
        let form_a = upper_form(d, self.set_a);
        let form_b = upper_form(self.placement.seen_from_b(d), self.set_b).mirrored();
        let t = self.placement.translation;
        let offset = d[0] * t[0] + d[1] * t[1] + d[2] * t[2];
        let error = form_error(form_a.coefficients, self.reach_a.ends, 0.0)
            + form_error(form_b.coefficients, self.reach_b.ends, offset)
            + 3.0 * self.placement.error;
        SeparatingDirection { direction, form_a, form_b, offset: (offset - error) as f32 }
    }

    /// Returns bounds on the slab ends of A's nodes and of B's.
    #[inline(always)]
    pub(crate) fn reaches(&self) -> (f32, f32) {
        (self.reach_a.ends, self.reach_b.ends)
    }

    /// Prepares the test along B's directions, too.
    #[inline(always)]
    pub(crate) fn look_along_b<I: Isa>(&mut self, isa: I) {
        let placement = self.placement.inverse();
        let (alignment, set, reach) = (&mut self.inverse, self.set_a, self.reach_a.ends);
        isa.run(Prepare { alignment, placement: &placement, set, reach });
        self.looks_along_b = true;
    }

    /// Returns bounds on the coordinates of A's nodes and of B's.
    pub(crate) fn magnitudes(&self) -> (f32, f32) {
        (self.reach_a.coordinates, self.reach_b.coordinates)
    }

    /// Returns where B is.
    pub(crate) fn placement(&self) -> &Placement {
        &self.placement
    }

    /// Returns whether the test along B's directions has been prepared.
    #[inline(always)]
    pub(crate) fn looks_along_b(&self) -> bool {
        self.looks_along_b
    }

    /// Computes B's slab ends along A's directions, rounded outward.
    #[inline(always)]
    pub(crate) fn align_b<I: Isa>(&self, isa: I, group: &Group, aligned: &mut Group) {
        self.alignment.align(isa, self.set_a, group, aligned);
    }

    /// Computes slabs along A's directions that hold B's in both placements, rounded outward, after `prepare_end`.
    #[inline(always)]
    pub(crate) fn align_b_at_both_ends<I: Isa>(&self, isa: I, group: &Group, joined: &mut Group) {
        self.alignment.align(isa, self.set_a, group, joined);
        let mut other = Group::ZERO;
        self.end.align(isa, self.set_a, group, &mut other);
        for row in 0..4 {
            isa.store(isa.load(&joined.lo[row]).min(isa.load(&other.lo[row])), &mut joined.lo[row]);
            isa.store(isa.load(&joined.hi[row]).max(isa.load(&other.hi[row])), &mut joined.hi[row]);
        }
    }

    /// Computes A's slab ends along B's directions, rounded outward, after `look_along_b`.
    #[inline(always)]
    pub(crate) fn align_a<I: Isa>(&self, isa: I, group: &Group, aligned: &mut Group) {
        self.inverse.align(isa, self.set_b, group, aligned);
    }

    /// Tests four nodes of A against four of B along A's directions: element `4 * a + b` of `bounds` is the
    /// pair `(a, b)`, and its bit is set if the bound is at most `limit`.
    #[inline(always)]
    pub(crate) fn run<I: Isa>(
        &self,
        isa: I,
        measure: Measure,
        (group_a, group_b, aligned_b): (&Group, &Group, &Group),
        separating: &Option<SeparatingDirection>,
        limit: f32,
        bounds: &mut [f32; 16],
    ) -> u16 {
        let mut gaps = gaps_along(isa, measure, self.set_a, (group_a, aligned_b));
        if let Some(separating) = separating {
            gaps = gaps.max(separating.gaps(isa, group_a, group_b));
        }
        isa.store(gaps, bounds);
        I::F32x16::bits(gaps.le(isa.splat(limit)))
    }

    /// Tests the same pairs along B's directions: raises the bounds that `run` has found.
    #[inline(always)]
    pub(crate) fn run_along_b<I: Isa>(
        &self,
        isa: I,
        measure: Measure,
        (aligned_a, group_b): (&Group, &Group),
        limit: f32,
        bounds: &mut [f32; 16],
    ) -> u16 {
        let gaps = gaps_along(isa, measure, self.set_b, (aligned_a, group_b));
        if measure != Measure::Distance {
            return I::F32x16::bits(gaps.le(isa.splat(limit)));
        }
        // Seen from A, B's directions are longer or shorter by at most 2^-19, all together: so far a rotation
        // may be off.
        let gaps = gaps.mul(isa.splat(1.0 - 1.0 / (1 << 18) as f32)).max(isa.load(bounds));
        isa.store(gaps, bounds);
        I::F32x16::bits(gaps.le(isa.splat(limit)))
    }
}

impl NodeFilter {
    /// Replaces the bounds of pairs that overlap by those of `Measure::Leaving`, along A's directions.
    #[inline(always)]
    pub(crate) fn leaving<I: Isa>(
        &self,
        isa: I,
        ends: (&Group, &Group),
        limit: f32,
        bounds: &mut [f32; 16],
    ) -> u16 {
        let mut leaving = isa.splat(f32::NEG_INFINITY);
        for slab in 0..self.set_a.slabs() {
            let (up, down) = gaps_of_ends(isa, ends, slab);
            let way = down.mul_add(isa.splat(self.ways.down[slab]), isa.splat(self.ways.never[slab]));
            leaving = leaving.max_of_numbers(up.mul_add(isa.splat(self.ways.up[slab]), way));
        }
        isa.store(leaving, bounds);
        I::F32x16::bits(leaving.le(isa.splat(limit)))
    }
}

impl SeparatingDirection {
    #[inline(always)]
    fn gaps<I: Isa>(&self, isa: I, group_a: &Group, group_b: &Group) -> I::F32x16 {
        let (mut upper_a, mut lower_b) = ([0.0; 4], [0.0; 4]);
        isa.store4(evaluate(isa, &self.form_a, group_a, isa.splat4(0.0)), &mut upper_a);
        isa.store4(evaluate(isa, &self.form_b, group_b, isa.splat4(self.offset)), &mut lower_b);
        isa.tile(&lower_b).sub(isa.repeat(&upper_a))
    }
}

/// Evaluates a form over the rows of a group, and adds an offset.
#[inline(always)]
fn evaluate<I: Isa>(isa: I, form: &Form, group: &Group, offset: I::F32x4) -> I::F32x4 {
    let rows = group.rows();
    let mut sum = offset;
    for j in 0..3 {
        let row = isa.load4(&rows[usize::from(form.rows[j] & 31)]);
        sum = row.mul_add(isa.splat4(form.coefficients[j]), sum);
    }
    sum
}

/// Returns the signed gap of each of 16 pairs, four nodes of A and four of B, along one direction of both groups.
#[inline(always)]
fn gap<I: Isa>(isa: I, ends: (&Group, &Group), slab: usize) -> I::F32x16 {
    let (up, down) = gaps_of_ends(isa, ends, slab);
    down.max_of_numbers(up)
}

/// Returns how far B is above A, and below it.
#[inline(always)]
fn gaps_of_ends<I: Isa>(isa: I, (group_a, group_b): (&Group, &Group), slab: usize) -> (I::F32x16, I::F32x16) {
    let (rows_a, rows_b) = (group_a.rows(), group_b.rows());
    let (lo_a, hi_a) = (isa.repeat(&rows_a[row(slab)]), isa.repeat(&rows_a[16 + row(slab)]));
    let (lo_b, hi_b) = (isa.tile(&rows_b[row(slab)]), isa.tile(&rows_b[16 + row(slab)]));
    (lo_b.sub(hi_a), lo_a.sub(hi_b))
}

/// Returns the gap of each of 16 pairs, four nodes of A and four of B, along the directions of a set, which the groups of both
/// are aligned to.
#[inline(always)]
pub(crate) fn gaps_along<I: Isa>(
    isa: I,
    measure: Measure,
    set: DirectionSet,
    ends: (&Group, &Group),
) -> I::F32x16 {
    match set {
        DirectionSet::Dop6 => gaps::<I, 3>(isa, measure, ends),
        DirectionSet::Dop14 => gaps::<I, 7>(isa, measure, ends),
        DirectionSet::Dop26 => gaps::<I, 13>(isa, measure, ends),
    }
}

/// Returns the gap of each of 16 pairs: for `Overlap` the largest signed gap along any direction, for
/// `Distance` a lower bound of the distance.
#[inline(always)]
fn gaps<I: Isa, const SLABS: usize>(isa: I, measure: Measure, ends: (&Group, &Group)) -> I::F32x16 {
    // Three maxima side by side, so that none waits for the one before.
    let [mut x, mut y, mut z] = [gap(isa, ends, 0), gap(isa, ends, 1), gap(isa, ends, 2)];
    if measure != Measure::Distance {
        for slab in 3..SLABS {
            let gap = gap(isa, ends, slab);
            match slab % 3 {
                0 => x = x.max_of_numbers(gap),
                1 => y = y.max_of_numbers(gap),
                _ => z = z.max_of_numbers(gap),
            }
        }
        return x.max_of_numbers(y).max_of_numbers(z);
    }
    // Along the three axes gaps add up like the sides of a box.
    let zero = isa.splat(0.0);
    let [side_x, side_y, side_z] = [x.max(zero), y.max(zero), z.max(zero)];
    let sum = side_z.mul_add(side_z, side_y.mul_add(side_y, side_x.mul(side_x)));
    if SLABS > 3 {
        let mut cube = gap(isa, ends, 3);
        for slab in 4..7 {
            cube = cube.max_of_numbers(gap(isa, ends, slab));
        }
        x = x.max_of_numbers(cube.mul(isa.splat(CUBE)));
    }
    if SLABS > 7 {
        // Two maxima side by side, so that none waits for the one before.
        let [mut even, mut odd] = [gap(isa, ends, 7), gap(isa, ends, 8)];
        for slab in [9, 11] {
            even = even.max_of_numbers(gap(isa, ends, slab));
            odd = odd.max_of_numbers(gap(isa, ends, slab + 1));
        }
        y = y.max_of_numbers(even.max_of_numbers(odd).mul(isa.splat(FACE)));
    }
    let largest = x.max_of_numbers(y).max_of_numbers(z);
    // Up to four roundings of the sum and one of the root, each 2^-24 relative, and three squares that
    // underflow by 2^-150 each: of a sum from 2^-126 on, no more than that again.
    //
    // Where the boxes overlap, the largest gap itself, perhaps negative, tells which pair overlaps
    // most. Where squares underflow to less, at gaps below 2^-63, or overflow, at gaps beyond 2^63, it has
    // to do as well.
    //
    // Products with subnormal results may round up, but not past a limit, which is an f32 itself: one that
    // the exact product does not exceed is not exceeded by the nearest f32 either.
    let normal = isa.splat(f32::MIN_POSITIVE).le(sum);
    let apart = I::F32x16::select(normal, sum.sqrt(), largest);
    let apart = I::F32x16::select(sum.le(isa.splat(f32::MAX)), apart, largest);
    largest.max(apart).mul(isa.splat(1.0 - F32_SLACK))
}
