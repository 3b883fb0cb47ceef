//! The questions: collide, contacts, distance, within. Each is a visitor of one pair traversal.

#[cfg(feature = "parallel")]
pub(crate) mod batch;
pub(crate) mod collide;
pub(crate) mod contacts;
pub(crate) mod distance;
mod exact;
pub(crate) mod tracker;

use crate::bvh::Shape;
use crate::error::QueryError;
use crate::isa::{Backend, Isa, Task};
use crate::leaf::decoded::Decoded;
use crate::leaf::local::LocalFrame;
use crate::leaf::queue::{Candidate, Queue};
use crate::pose::Pose;
use crate::traverse::align::Placement;
use crate::traverse::pair::{Pair, Stack, Visitor, traverse};
use bvh_format::object::Object;
pub use distance::{Distance, DistanceOptions};
use std::cell::OnceCell;

/// Asks questions. Holds the backend and the memory that queries work in, so that a query allocates
/// nothing once the memory has grown to what the meshes need. Use one a thread.
///
/// # Worst case
/// This holds for files of any bytes, forged ones included. Each pair of objects is walked once (a distance
/// of 0 takes a second walk); let their pages have t and u treelets, p and q leaf packets in all.
///
/// - Time: a walk visits at most (t + p) * (u + q) pairs of nodes, each once, with up to four node tests or
///   one packet test each. Ordinary meshes need a few hundred. Where files come from strangers, bound it
///   further by [`Querier::set_budget`].
/// - Memory: at most 8 KiB for each treelet that the query opens, of either file, and 4 MiB; no recursion.
///   A page has at most 62 treelets. What [`Querier::contacts`] returns comes on top, 16 bytes each.
/// - Contacts: at most as many as the pages of both files have room for pairs of triangles, listed
///   duplicates included; more are an error.
///
/// A byte that was changed in a page, leaf block or id block that a query touches is an error. A file forged
/// with right checksums may hold wrong bounds: its answers may be wrong, or an error, and nothing else is.
pub struct Querier {
    backend: Backend,
    stack: Stack,
    queue: Queue,
    /// Of A and of B.
    decoded: [Decoded; 2],
    candidates: Vec<distance::Candidate>,
    budget: u64,
    stats: QueryStats,
}

/// What the last query did.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct QueryStats {
    /// Tests of up to 16 node pairs each.
    pub node_tests: u64,
    /// Pairs of leaf packets tested, up to 16 triangle pairs each.
    pub packet_tests: u64,
    /// Triangle pairs that went to exact arithmetic.
    pub exact_tests: u64,
}

impl Querier {
    /// With the fastest backend of this CPU, or the one that `CBVH_ISA` names.
    ///
    /// # Errors
    /// If `CBVH_ISA` names no backend or one that the CPU lacks.
    pub fn new() -> Result<Self, QueryError> {
        Ok(Self::with_backend(Backend::detect()?))
    }

    /// With a backend; one that the CPU lacks is replaced by the scalar one.
    pub fn with_backend(backend: Backend) -> Self {
        let backend = if backend.is_available() { backend } else { Backend::Scalar };
        Self {
            backend,
            stack: Stack::default(),
            queue: Queue::default(),
            decoded: Default::default(),
            candidates: Vec::new(),
            budget: u64::MAX,
            stats: QueryStats::default(),
        }
    }

    /// Lets each query from now on visit at most so many pairs of objects and of nodes; one that needs more
    /// ends with [`QueryError::Budget`]. Without, there is no bound but that of the files' sizes.
    ///
    /// A visit takes some 100 ns. Queries of scans and of CAD models with 10^5 to 10^6 triangles take from
    /// hundreds of visits (apart) to some 10^6 (all contacts of a deep overlap).
    pub fn set_budget(&mut self, visits: u64) {
        self.budget = visits;
    }

    /// The backend in use.
    pub fn backend(&self) -> Backend {
        self.backend
    }

    /// What the last query did.
    pub fn stats(&self) -> QueryStats {
        self.stats
    }

    /// Before a query.
    fn start(&mut self) {
        self.stats = QueryStats::default();
        self.stack.start(self.budget);
    }
}

/// A triangle pair in contact.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Contact {
    /// Number of the object of A in its file.
    pub object_a: u32,
    /// Triangle of A: its number in the input (without ids, its place in the order of the leaves).
    pub triangle_a: u32,
    /// Number of the object of B in its file.
    pub object_b: u32,
    /// Triangle of B.
    pub triangle_b: u32,
}

/// Two objects in place, with all that the leaf tests need.
pub(crate) struct Scene<'a> {
    pub(crate) pair: Pair<'a>,
    pub(crate) pose: &'a Pose,
    /// Made when the first leaf is visited: most queries of meshes apart never do.
    frame: OnceCell<LocalFrame>,
    /// Numbers of the objects in their files.
    pub(crate) numbers: (u32, u32),
}

impl Scene<'_> {
    /// What all packet pairs share.
    #[inline(always)]
    pub(crate) fn frame(&self) -> &LocalFrame {
        let Pair { object_a, object_b, placement, .. } = self.pair;
        self.frame.get_or_init(|| LocalFrame::new(placement, object_a, object_b))
    }
}

/// A pair of triangles of the meshes that a query came by.
#[derive(Clone, Copy, Debug)]
struct Found {
    /// Numbers of the objects in their files.
    numbers: (u32, u32),
    pair: Candidate,
}

/// Calls `visit` for each pair of objects of the two sides, in the order of the files.
fn each_pair<R>(
    a: Shape<'_>,
    b: Shape<'_>,
    pose: &Pose,
    mut visit: impl FnMut(&Scene<'_>) -> Result<Option<R>, QueryError>,
) -> Result<Option<R>, QueryError> {
    for (index_a, object_a) in a.objects().iter().enumerate() {
        for (index_b, object_b) in b.objects().iter().enumerate() {
            let placement = Placement::new(pose, object_a, object_b);
            let scene = Scene {
                pair: Pair { bvh_a: a.bvh(), object_a, bvh_b: b.bvh(), object_b, placement: &placement },
                pose,
                frame: OnceCell::new(),
                numbers: ((a.first() + index_a) as u32, (b.first() + index_b) as u32),
            };
            if let Some(result) = visit(&scene)? {
                return Ok(Some(result));
            }
        }
    }
    Ok(None)
}

/// A lower bound of the distance of two objects by their bounding spheres, mesh units; negative if
/// the spheres overlap. Costs a few nanoseconds.
fn sphere_gap(placement: &Placement, a: &Object, b: &Object) -> f64 {
    let centre = |object: &Object| object.record.sphere_centre.map(|c| f64::from(c.get()));
    let (centre_a, centre_b) = (centre(a), centre(b));
    let squared: f64 = (0..3)
        .map(|i| {
            let r = &placement.rotation[i];
            let placed = r[0] * centre_b[0] + r[1] * centre_b[1] + r[2] * centre_b[2];
            (placed + placement.translation[i] - centre_a[i]).powi(2)
        })
        .sum();
    let radius = |object: &Object| f64::from(object.record.sphere_radius.get());
    let radii = radius(a) + radius(b);
    // A pose may stretch by 2^-20 and the f64 error of a placed point is charged to the radii too.
    let gap = squared.sqrt() * (1.0 - 2f64.powi(-40));
    gap - radii * (1.0 + 2f64.powi(-19)) - 3.0 * placement.error
}

/// True if the bounding spheres or boxes of two objects show that these do not touch.
fn surely_apart(Pair { placement, object_a, object_b, .. }: &Pair<'_>) -> bool {
    sphere_gap(placement, object_a, object_b) > 0.0 || boxes_apart(placement, object_a, object_b)
}

/// True if the bounding boxes are apart along an axis of either: most of the separating axis test of Gottschalk, Lin and
/// Manocha (SIGGRAPH 1996), without the nine cross products. Costs a tenth of what it takes to prepare a walk.
fn boxes_apart(placement: &Placement, a: &Object, b: &Object) -> bool {
    let sides = |object: &Object| {
        let (lo, hi) = (object.record.box_lo, object.record.box_hi);
        [lo, hi].map(|corner| corner.map(|value| f64::from(value.get())))
    };
    apart_along_sides(placement, sides(a), sides(b))
}

/// The same for boxes given by two corners.
fn apart_along_sides(placement: &Placement, a: [[f64; 3]; 2], b: [[f64; 3]; 2]) -> bool {
    let r = &placement.rotation;
    let half = |[lo, hi]: [[f64; 3]; 2]| [0, 1, 2].map(|i| (hi[i] - lo[i]) / 2.0);
    let centre = |[lo, hi]: [[f64; 3]; 2]| [0, 1, 2].map(|i| (hi[i] + lo[i]) / 2.0);
    let (half_a, half_b) = (half(a), half(b));
    let (centre_a, centre_b) = (centre(a), centre(b));
    let between = [0, 1, 2].map(|i| {
        let placed = r[i][0] * centre_b[0] + r[i][1] * centre_b[1] + r[i][2] * centre_b[2];
        placed + placement.translation[i] - centre_a[i]
    });
    // The f64 error of a placed point, and as much for each of a few roundings here.
    let error = 4.0 * placement.error;
    // A pose may be 2^-20 from orthonormal, so that B's box leans by three times as much along its own axes.
    let lean = 2f64.powi(-18) * (half_b[0] + half_b[1] + half_b[2]);
    (0..3).any(|i| {
        let reach_b = r[i][0].abs() * half_b[0] + r[i][1].abs() * half_b[1] + r[i][2].abs() * half_b[2];
        let reach_a = r[0][i].abs() * half_a[0] + r[1][i].abs() * half_a[1] + r[2][i].abs() * half_a[2];
        let along_b = r[0][i] * between[0] + r[1][i] * between[1] + r[2][i] * between[2];
        between[i].abs() > half_a[i] + reach_b + error || along_b.abs() > reach_a + half_b[i] + lean + error
    })
}

/// A traversal with a visitor, compiled for each backend.
struct Traversal<'a, W> {
    pair: Pair<'a>,
    stack: &'a mut Stack,
    visitor: &'a mut W,
}

impl<W: Visitor> Task for Traversal<'_, W> {
    type Output = Result<u64, QueryError>;

    #[inline(always)]
    fn run<I: Isa>(self, isa: I) -> Self::Output {
        traverse(isa, self.pair, self.stack, self.visitor)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::traverse::align::POSE_ERROR;

    /// Boxes that share a point are not apart, even by a rotation as far off as a pose may have; and most that have
    /// a gap between faces are.
    #[test]
    fn boxes_that_touch_are_not_apart() {
        let mut state = 3u64;
        let mut random = || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 11) as f64 / (1u64 << 53) as f64 * 2.0 - 1.0
        };
        let mut found = 0;
        for round in 0..20_000 {
            let mut sides = || {
                let (p, q) = ([random(), random(), random()], [random(), random(), random()]);
                [[0, 1, 2].map(|i| p[i].min(q[i])), [0, 1, 2].map(|i| p[i].max(q[i]))]
            };
            let (a, b) = (sides(), sides());
            let (sin, cos) = (3.0 * random()).sin_cos();
            let shear = if round % 2 == 0 { 0.9e-6 } else { -0.9e-6 };
            let rotation = [[cos, -sin, shear * cos], [sin, cos, shear * sin], [0.0, 0.0, 1.0]];
            // A corner of B on a face of A, across axis 0.
            let corner = [0, 1, 2].map(|i| if random() < 0.0 { b[0][i] } else { b[1][i] });
            let up = usize::from(random() < 0.0);
            let mut point = [0, 1, 2].map(|i| a[0][i] + (a[1][i] - a[0][i]) * (random() + 1.0) / 2.0);
            point[0] = a[up][0];
            let place = |gap: f64| {
                let turned = rotation.map(|row: [f64; 3]| (0..3).map(|k| row[k] * corner[k]).sum::<f64>());
                let translation = [point[0] + gap - turned[0], point[1] - turned[1], point[2] - turned[2]];
                Placement { rotation, translation, error: 100.0 * POSE_ERROR }
            };
            assert!(!apart_along_sides(&place(0.0), a, b), "round {round}");
            // Far out along the axis: surely beyond both boxes.
            found += u32::from(apart_along_sides(&place(if up == 1 { 1e-3 } else { -1e-3 }), a, b));
            assert!(apart_along_sides(&place(if up == 1 { 10.0 } else { -10.0 }), a, b), "round {round}");
        }
        assert!(found > 2000, "{found} of 20000");
    }
}
