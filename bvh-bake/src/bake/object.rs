//! Bakes objects up to their pages, in two steps: what concerns all triangles of an object, then its tree and its pages.
//!
//! No object depends on another, so that many small ones are baked side by side.

use crate::error::BakeError;
use crate::options::{Effort, Options};
use crate::pages::Style;
use crate::pages::brick::{EncodedObject, encode_object};
use crate::prepare::duplicates::Found;
use crate::prepare::layout_choice::{Choice, choose};
use crate::prepare::quantization::advised_error;
use crate::prepare::{Measured, Surveyed, measure, survey};
use crate::storage::Spill;
use crate::storage::external_sort::Sorter;
use crate::storage::resources::Resources;
use crate::topology::{MAX_FEW_PARTS, Nets, Survey};
use crate::tree::{Aabb, Bricks, Method, is_one_brick};
use crate::triangles::{Gathered, Kept};
use bvh_format::kdop::Kdop;
use bvh_format::object::{F16_EXPONENTS, ObjectRecord};
use bvh_format::vertex::Vertices;
use std::iter::Peekable;
use std::vec::IntoIter;
use zerocopy::FromZeros;

/// The most triangles of several objects that are baked side by side: far fewer than a brick has, so that they fit into
/// the memory of one.
const MAX_BATCH_TRIANGLES: u64 = 1 << 14;
/// The most objects that are baked side by side. Each takes some KiB besides its triangles.
const MAX_BATCH_OBJECTS: usize = 256;

/// Takes the objects that are baked next, at least one of them.
pub(super) fn next_batch(objects: &mut Peekable<IntoIter<Gathered>>) -> Vec<Gathered> {
    let (mut batch, mut triangles) = (Vec::new(), 0);
    while batch.len() < MAX_BATCH_OBJECTS
        && let Some(object) =
            objects.next_if(|next| batch.is_empty() || triangles + next.stream.count <= MAX_BATCH_TRIANGLES)
    {
        triangles += object.stream.count;
        batch.push(object);
    }
    batch
}

/// What all objects of a bake share.
pub(super) struct Shared<'a> {
    pub(super) options: &'a Options,
    pub(super) resources: &'a Resources,
    /// Whether the file states which objects are closed.
    pub(super) has_topology: bool,
    /// One more than the largest triangle id.
    pub(super) id_count: u64,
    /// The place for what objects keep to the end. Each thread has one file in it, however many objects there are.
    pub(super) spill: Spill,
}

/// An object before its tree is built.
pub(super) struct Prepared {
    gathered: Gathered,
    measured: Measured,
    surveyed: Surveyed,
    nets: Option<Nets>,
    /// The pairs (kept id, id of an equal triangle that is left out), until they are taken.
    pub(super) duplicates: Option<Sorter<[u32; 2]>>,
    /// The number of these pairs.
    pub(super) left_out: u64,
    /// The error that quantisation had better be allowed, if the allowed one is coarse.
    pub(super) advised_error: Option<f64>,
}

impl Prepared {
    pub(super) fn new(gathered: Gathered, shared: &Shared) -> Result<Self, BakeError> {
        let Shared { options, resources, .. } = *shared;
        let (stream, is_cloud) = (&gathered.stream, gathered.is_cloud);
        // The edges of points do not count.
        let is_counted = shared.has_topology && !(is_cloud && stream.count > MAX_FEW_PARTS);
        let mut nets = is_counted.then(|| Nets::new(resources));
        let mut duplicates = Sorter::of_runs(resources.sorted_at_once::<[u32; 2]>(stream.count));
        let measured = measure(stream, is_cloud, resources, |found| match (found, &mut nets) {
            (Found::Pair(pair), _) => duplicates.extend(&[pair], &shared.spill),
            (Found::Net { id, net, corners }, Some(nets)) => nets.add(id, net, corners, &shared.spill),
            (Found::Net { .. }, None) => Ok(()),
        })?;
        let advised_error = advised_error(options, diagonal(&measured.bounds), stream.count);
        let surveyed = survey(&Kept::new(stream, &measured.dropped), &measured, &gathered.behind, resources)?;
        let left_out = duplicates.count();
        Ok(Self { gathered, measured, surveyed, nets, duplicates: Some(duplicates), left_out, advised_error })
    }
}

/// An object whose pages are made.
pub(super) struct Built {
    pub(super) name: String,
    /// The record in the table of objects, but for the place of the pages.
    pub(super) record: ObjectRecord,
    pub(super) encoded: EncodedObject,
    /// The reason for the layout.
    pub(super) reason: String,
}

impl Built {
    pub(super) fn new(prepared: Prepared, shared: &Shared) -> Result<Self, BakeError> {
        let Shared { options, resources, id_count, .. } = *shared;
        let Prepared { gathered, measured, mut surveyed, nets, left_out, .. } = prepared;
        let Gathered { name, behind, stream, moved, welded, is_cloud } = gathered;
        let moved = moved.joined(measured.moved).rounded_up();
        let f16_exponent = f16_exponent(&measured.bounds);
        let triangles = Kept::new(&stream, &measured.dropped).count();
        let Choice { profile, encoding, reason } = choose(triangles, is_cloud, options);
        let grid = surveyed.grid.take();
        // Points have no extent, so that finer splits make no better tree of them.
        let method = match options.effort {
            _ if is_cloud => Method::Coarse,
            Effort::Quick => Method::Curve,
            Effort::Default => Method::Fine,
        };
        let (width, bounds) = (profile.width(), &measured.bounds);
        // A single brick takes the triangles as they are.
        let is_whole = is_one_brick(triangles) && triangles == stream.count && stream.is_placed();
        let bricks = if is_whole {
            Bricks::of_one(stream.into_batches(), bounds, width, method)
        } else {
            let kept = Kept::new(&stream, &measured.dropped);
            let bricks = Bricks::divide(&kept, bounds, grid, width, method, resources)?;
            drop(stream);
            bricks
        };
        let origin = behind.are_corrected().then_some(behind.origin);
        let survey = nets.map(|nets| Survey::new(nets, bricks.boxes(), triangles, origin));
        let style = Style {
            profile,
            encoding,
            f16_scale: 2f32.powi(f16_exponent),
            ids: options.ids,
            is_cloud,
            is_quick: method == Method::Curve,
            behind,
        };
        let encoded = encode_object(bricks, style, survey, resources, &shared.spill)?;
        let bounds = bounds_of_vertices(&measured.bounds, &behind);
        let record = ObjectRecord {
            origin: behind.origin.map(Into::into),
            box_lo: [0, 1, 2].map(|a| bounds.lo[a].into()),
            box_hi: [0, 1, 2].map(|a| bounds.hi[a].into()),
            triangles: triangles.into(),
            packets: encoded.packets.into(),
            treelets: encoded.treelets.into(),
            max_vertex_rounding: sum_up(welded.rounded_up().rounding, moved.rounding).into(),
            max_quantization_error: moved.quantization.into(),
            input_triangles: id_count.into(),
            degenerate: surveyed.degenerate.into(),
            duplicates: left_out.into(),
            f16_exponent: f16_exponent.into(),
            profile: style.profile.number(),
            triangle_encoding: style.encoding as u8,
            sphere_centre: surveyed.centre.map(Into::into),
            sphere_radius: surveyed.radius.into(),
            // -0.0 + 0.0 is 0.0.
            radius: (options.radius + 0.0).into(),
            solid: options.solid.into(),
            predictors: behind.predictors.map(|predictor| predictor.parts().0),
            digits: behind.predictors.map(|predictor| predictor.parts().1),
            corrected: (0..3).map(|axis| u8::from(behind.corrected[axis]) << axis).sum(),
            left_out: behind.left_out.map(Into::into),
            scale: behind.scale.into(),
            ..ObjectRecord::new_zeroed()
        };
        Ok(Self { name, record, encoded, reason })
    }
}

/// Returns the box of the vertices behind offsets that have a box, around the origin.
fn bounds_of_vertices(bounds: &Aabb, behind: &Vertices) -> Kdop {
    let mut kdop = Kdop::EMPTY;
    for axis in 0..3 {
        (kdop.lo[axis], kdop.hi[axis]) = (bounds.lo(axis), bounds.hi(axis));
    }
    kdop.widened(&behind.margins())
}

/// Returns an upper bound of the sum of two lengths, which is their sum if one is 0.
fn sum_up(a: f64, b: f64) -> f64 {
    if a.min(b) == 0.0 { a + b } else { (a + b).next_up() }
}

/// Returns the diagonal of a box, in mesh units.
fn diagonal(bounds: &Aabb) -> f64 {
    (0..3).map(|a| (f64::from(bounds.hi(a)) - f64::from(bounds.lo(a))).powi(2)).sum::<f64>().sqrt()
}

/// Returns the power of two that is the unit of f16 residuals. The largest slab of the object stays below half of f16's
/// range.
fn f16_exponent(bounds: &Aabb) -> i32 {
    let widest = (0..3).map(|a| f64::from(bounds.hi(a)) - f64::from(bounds.lo(a))).sum::<f64>();
    if widest == 0.0 {
        return 0;
    }
    // The next power of two is taken from the bits, because a logarithm may differ between platforms.
    let exponent = ((widest.to_bits() - 1) >> 52) as i32 - 1022;
    (exponent - 14).clamp(*F16_EXPONENTS.start(), *F16_EXPONENTS.end())
}
