//! Asks about files whose bounds are looser than they need to be, by up to 2^122: what keeps every rule is answered as
//! exactly as any file, and a bound that no rule limits does not exist.
//!
//! What a query charges for rounding grows with the magnitudes of bounds. Each test loosens one kind of bound that
//! `spec/numerics.md`, section 9, names, in files of all profiles, and compares every answer of every backend with brute force
//! in exact arithmetic.

use crate::common::asked::ask;
use crate::common::expected::Expected;
use crate::common::shapes::{plate, soup, sphere};
use crate::common::truth::Surface;
use crate::common::{Random, Triangle, bake, baked, mesh, options, queriers, random_pose, stored};
use bvh_bake::{prove_bounds, to_bytes};
use bvh_format::leaf::TriangleEncoding;
use bvh_format::object::ObjectRecord;
use bvh_format::profile::Profile;
use bvh_format::validate::validate;
use bvh_format::{FormatError, Layout, Rule};
use bvh_query::{Bvh, Pose, Querier, QueryError};
use cbvh_testkit::depth::rounds;
use cbvh_testkit::loosen::{fill_unused_lanes, loosened, move_sphere, remote_roots, rewritten, widen};

/// Checks every rule, bounds included.
fn prove(bytes: &[u8]) -> Result<(), FormatError> {
    prove_bounds(&validate(bytes)?, bytes).map(|_| ())
}

/// A soup of triangles, and flat sides along the axes: their turning slabs are along axes, too.
fn triangles() -> Vec<Triangle> {
    let mut triangles = soup(700, 3);
    for axis in 0..3 {
        for at in [-1.0, -0.25, 0.5] {
            let turned =
                |p: [f64; 3]| [0, 1, 2].map(|k| p[(k + axis) % 3] + if k == axis { at } else { 0.0 });
            let side = plate(4).into_iter().map(|triangle| triangle.map(|p| turned([p[0], p[1], p[2]])));
            triangles.extend(side);
        }
    }
    triangles
}

/// Files of all profiles of one mesh in several pages, plain and packed.
fn files() -> Vec<Vec<u8>> {
    let mesh = mesh(&triangles());
    let encodings = [TriangleEncoding::F32, TriangleEncoding::Packed];
    let both =
        |profile: Profile| encodings.map(|encoding| to_bytes(&mesh, &options(profile, encoding)).unwrap().0);
    Profile::ALL.into_iter().flat_map(both).collect()
}

/// The mesh that is asked about beside them, and poses in which the two touch here and there, or are just apart.
struct Other {
    bvh: Bvh,
    surface: Surface,
    poses: Vec<Pose>,
}

impl Other {
    fn new(random: &mut Random) -> Self {
        // Turning slabs are tested where both sides have them.
        let bvh = bake(&mesh(&sphere(1)), &options(Profile::Dop26U8Wide, TriangleEncoding::F32));
        let near = [(); 2].map(|()| random_pose(random, 1.2));
        let apart = Pose::new(*random_pose(random, 0.0).rotation(), [1.6, 1.1, 0.9]).unwrap();
        let poses = near.into_iter().chain([apart]).collect();
        Self { surface: Surface::new(stored(&bvh)), bvh, poses }
    }

    /// Compares the answers about a loosened file with brute force over the triangles of the file that it was made from.
    fn check(&self, queriers: &mut [Querier], surface: &Surface, bytes: Vec<u8>, pose: &Pose) {
        let loosened = Bvh::from_bytes(bytes).unwrap();
        Expected::new(surface, &self.surface, pose).check(&loosened, &self.bvh, pose, queriers);
        Expected::new(&self.surface, surface, pose).check(&self.bvh, &loosened, pose, queriers);
    }
}

/// A power of two from 2^10 to 2^120, or its negative, somewhat off.
fn far(random: &mut Random) -> f32 {
    let magnitude = 2f32.powi(10 + random.below(111) as i32) * (1.0 + random.signed() as f32 / 4.0);
    if random.below(2) == 0 { magnitude } else { -magnitude }
}

/// Returns a slab to loosen. Turning slabs are measured from boxes, for which only the first three count.
fn some_slab(random: &mut Random, profile: Profile) -> usize {
    random.below(if profile.has_turning_slabs() { 3 } else { profile.directions().slabs() })
}

/// Loosens each file as `edit` does, and asks about what comes out. A file that `edit` leaves as it is does not count, nor one
/// that breaks one of the rules that `edit` may break.
fn search(seed: u64, may_break: impl Fn(Rule) -> bool, edit: impl Fn(&mut Random, &[u8]) -> Vec<u8>) {
    let random = &mut Random::new(seed);
    let mut queriers = queriers();
    let (mut asked, mut refused) = (0, 0);
    for file in files() {
        let surface = Surface::new(stored(&Bvh::from_bytes(file.clone()).unwrap()));
        for _ in 0..rounds(1) {
            let bytes = edit(random, &file);
            match prove(&bytes) {
                Err(error) => {
                    assert!(may_break(error.rule), "{error}");
                    refused += 1;
                }
                Ok(()) if bytes == file => {}
                Ok(()) => {
                    let other = Other::new(random);
                    let pose = &other.poses[random.below(other.poses.len())];
                    other.check(&mut queriers, &surface, bytes, pose);
                    asked += 1;
                }
            }
        }
    }
    assert!(
        asked + refused >= Profile::ALL.len() && asked >= Profile::ALL.len() / 2,
        "{asked} files asked, {refused} refused"
    );
}

fn profile(bytes: &[u8]) -> Profile {
    Layout::read(bytes).unwrap().objects[0].profile()
}

/// Returns the file with an end of a slab of some roots moved outward to `to`, and that of each node as far as it may be.
fn with_wide_slab(
    bytes: &[u8],
    slab: usize,
    upper: bool,
    to: f32,
    is_wide: impl Fn((u32, u8)) -> bool,
) -> Vec<u8> {
    let bytes = rewritten(
        bytes,
        |_| (),
        |node, bound| {
            if is_wide(node.root) {
                widen(&mut bound.kdop, slab, upper, to);
            }
        },
    );
    bytes.unwrap()
}

/// Without the rule, contacts were lost along the other directions, in which the anchor is tight: each backend lost others.
#[test]
fn an_anchor_beyond_the_child_that_leads_to_it_is_refused() {
    let random = &mut Random::new(1);
    let mut queriers = queriers();
    let (mut refused, mut answered) = (0, 0);
    for file in files() {
        let surface = Surface::new(stored(&Bvh::from_bytes(file.clone()).unwrap()));
        let (profile, roots) = (profile(&file), remote_roots(&file));
        if roots.is_empty() {
            // The smallest profile holds the mesh in one page.
            continue;
        }
        for _ in 0..rounds(if profile.has_turning_slabs() { 10 } else { 2 }) {
            let (root, to) = (roots[random.below(roots.len())], far(random));
            let slab = some_slab(random, profile);
            let bytes = with_wide_slab(&file, slab, to > 0.0, to.abs(), |other| other == root);
            assert_eq!(validate(&bytes).unwrap_err().rule, Rule::Nested);
            let other = Other::new(random);
            let pose = &other.poses[random.below(2)];
            let as_a = Expected::new(&surface, &other.surface, pose);
            let as_b = Expected::new(&other.surface, &surface, pose);
            for querier in &mut queriers {
                // A new querier has not opened any node.
                *querier = Querier::with_backend(querier.backend());
                let asked = ask(querier, &bytes, &other.bvh, pose).unwrap();
                for (answers, expected) in asked.into_iter().zip([&as_a, &as_b]) {
                    match answers.contacts {
                        Ok(contacts) => {
                            assert_eq!(contacts, expected.contacts(), "{}", querier.backend());
                            answered += 1;
                        }
                        Err(QueryError::Damaged(error)) => {
                            assert_eq!(error.rule, Rule::Nested);
                            refused += 1;
                        }
                        Err(error) => panic!("{error}"),
                    }
                }
            }
        }
    }
    assert!(refused > answered / 8, "{refused} refused, {answered} answered");
}

#[test]
fn slabs_of_the_root_and_of_all_nodes() {
    search(
        2,
        |rule| rule == Rule::Nested,
        |random, file| {
            let (slab, to, some) = (some_slab(random, profile(file)), far(random), random.bits());
            // Some of the roots below, and all nodes below these, keep their ends.
            with_wide_slab(file, slab, to > 0.0, to.abs(), |(page, root)| {
                page == 0 || some >> ((page + u32::from(root)) % 64) & 1 == 1
            })
        },
    );
}

/// Ends of any slabs, turning slabs and units of f16 residuals, by any factor.
#[test]
fn any_bounds_of_any_nodes() {
    search(3, |_| true, |random, file| loosened(file, random).unwrap());
}

#[test]
fn boxes_of_records() {
    search(
        4,
        |_| false,
        |random, file| {
            let record = |record: &mut ObjectRecord| {
                for _ in 0..1 + random.below(3) {
                    let (axis, to) = (random.below(3), far(random));
                    let end = if to > 0.0 { &mut record.box_hi[axis] } else { &mut record.box_lo[axis] };
                    *end = if to > 0.0 { end.get().max(to) } else { end.get().min(to) }.into();
                }
            };
            rewritten(file, record, |_, _| ()).unwrap()
        },
    );
}

#[test]
fn spheres_of_records() {
    search(
        5,
        |_| false,
        |random, file| {
            let (axis, by) = (random.below(3), far(random));
            rewritten(file, |record| move_sphere(record, axis, by), |_, _| ()).unwrap()
        },
    );
}

#[test]
fn lanes_without_triangles() {
    search(
        6,
        |_| false,
        |random, file| {
            let mut bytes = file.to_vec();
            fill_unused_lanes(&mut bytes, far(random));
            bytes
        },
    );
}

/// Ends that are stored as they are could be anything.
#[test]
fn a_stored_slab_beyond_its_treelet_is_refused_at_first_touch() {
    let mesh = mesh(&soup(900, 3));
    let file = to_bytes(&mesh, &options(Profile::Dop14F32, TriangleEncoding::F32)).unwrap().0;
    let other = baked(&sphere(1));
    for slab in 0..7 {
        // Only the anchors are as they were.
        let bytes = rewritten(
            &file,
            |_| (),
            |node, bound| {
                if !node.is_root {
                    widen(&mut bound.kdop, slab, false, 1e20);
                    widen(&mut bound.kdop, slab, true, 1e20);
                }
            },
        );
        let bytes = bytes.unwrap();
        assert_eq!(validate(&bytes).unwrap_err().rule, Rule::Nested);
        for querier in &mut queriers() {
            let bvh = Bvh::from_bytes(bytes.clone()).unwrap();
            let refused = querier.contacts(&bvh, &other, &Pose::IDENTITY);
            assert!(matches!(refused, Err(QueryError::Damaged(error)) if error.rule == Rule::Nested));
        }
    }
}
