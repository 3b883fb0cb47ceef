//! Two meshes in sets of poses at given gaps, and what walks count there.

use super::bounds::{Bounds, Making};
use super::tree::Tree;
use super::variant::Variant;
use super::vector::{Vector, cross, length, minus, plus, times, unit};
use super::walk::{Counts, Side, Test, round_boxes, walk};
use crate::{Failure, output};
use bvh_bake::input;
use bvh_bake::mesh::Mesh;
use bvh_bake::{Options, Profile, TriangleEncoding, to_bytes};
use bvh_query::{Bvh, Pose, Querier};
use cbvh_testkit::Random;
use cbvh_testkit::ball::ball;
use rayon::prelude::*;
use std::path::Path;

/// The gaps, as parts of the diagonal of A's box.
pub(super) const GAPS: [f64; 4] = [1e-6, 0.001, 0.01, 0.05];
/// The names of the gaps.
pub(super) const GAP_NAMES: [&str; 4] = ["0", "0.1 %", "1 %", "5 %"];
/// The greatest number of steps towards a gap.
const STEPS: usize = 200;

/// Two meshes and poses.
pub(super) struct Scene {
    kind: String,
    name: String,
    a: Tree,
    /// `None` if it is A.
    b: Option<Tree>,
    /// For each gap, poses and distances.
    sets: Vec<Vec<(Pose, f64)>>,
}

/// What the walks of one variant in one set of poses counted, as means per query.
#[derive(Debug, Clone)]
pub(super) struct Row {
    pub(super) kind: String,
    pub(super) pair: String,
    pub(super) triangles: u32,
    pub(super) variant: Variant,
    pub(super) gap: usize,
    pub(super) is_distance: bool,
    pub(super) node_tests: f64,
    pub(super) median_node_tests: u64,
    pub(super) packet_tests: f64,
    pub(super) turning_pairs: f64,
    pub(super) searched_pairs: f64,
    pub(super) directions: f64,
    pub(super) frame_pairs: f64,
    pub(super) alignments: f64,
    pub(super) given_up: usize,
    /// Bytes of treelets and anchors per triangle, and the part of frames that are not the axes of the object.
    pub(super) bytes: f64,
    pub(super) turned_frames: f64,
}

impl Scene {
    pub(super) fn of_files(
        kind: &str,
        name: &str,
        a: &Path,
        b: &Path,
        poses: usize,
    ) -> Result<Self, Failure> {
        let file_a = baked(&input::read(a)?.merged())?;
        let file_b = if a == b { None } else { Some(baked(&input::read(b)?.merged())?) };
        Self::new(kind, name, &file_a, file_b.as_ref(), poses)
    }

    /// Makes a ball of about this many triangles against itself.
    pub(super) fn of_ball(triangles: u64, poses: usize) -> Result<Self, Failure> {
        let (positions, indices) = ball(triangles);
        let file = baked(&Mesh::from_triangles(positions, indices))?;
        Self::new("ball", &format!("ball {triangles}"), &file, None, poses)
    }

    fn new(kind: &str, name: &str, a: &Bvh, b: Option<&Bvh>, poses: usize) -> Result<Self, Failure> {
        let tree = |bvh| Tree::of_file(bvh).ok_or("a file without objects");
        let of_b = b.unwrap_or(a);
        let mut querier = Querier::new()?;
        let mut sets = Vec::new();
        for gap in GAPS {
            // The same rotations and directions for every gap.
            let mut random = Random::new(1);
            let mut set = Vec::new();
            while set.len() < poses {
                set.extend(at_gap(&mut querier, a, of_b, gap, &mut random)?);
            }
            sets.push(set);
        }
        Ok(Self { kind: kind.into(), name: name.into(), a: tree(a)?, b: b.map(tree).transpose()?, sets })
    }

    /// Counts the tests of all variants.
    pub(super) fn rows(&self, variants: &[Variant]) -> Vec<Row> {
        variants.iter().flat_map(|variant| self.rows_of(variant)).collect()
    }

    fn rows_of(&self, variant: &Variant) -> Vec<Row> {
        output::tell(&format!("{}: {}", self.name, variant.name));
        let of = |tree: &Tree| {
            let bounds = Bounds::new(tree, variant.making);
            let beside = (variant.test == Test::Beside).then(|| Bounds::new(tree, Making::IDEAL_BOXES));
            let round = round_boxes(tree, beside.as_ref().unwrap_or(&bounds), variant.test);
            (bounds, round)
        };
        let (bounds_a, of_b) = (of(&self.a), self.b.as_ref().map(of));
        let bounds_b = of_b.as_ref().unwrap_or(&bounds_a);
        let a = Side { tree: &self.a, bounds: &bounds_a.0, round: &bounds_a.1 };
        let b = Side { tree: self.b.as_ref().unwrap_or(&self.a), bounds: &bounds_b.0, round: &bounds_b.1 };
        let triangles = self.a.nodes[0].below;
        let [treelet, anchor] = variant.bytes.map(f64::from);
        let bytes = treelet * self.a.treelets() as f64 + anchor * self.a.anchors() as f64;
        let mut rows = Vec::new();
        for is_distance in [false, true] {
            for (gap, set) in self.sets.iter().enumerate() {
                let count = |(pose, distance): &(Pose, f64)| {
                    walk(a, b, pose, if is_distance { *distance } else { 0.0 }, variant.test)
                };
                let mut counts: Vec<Counts> = set.par_iter().map(count).collect();
                counts.sort_by_key(|counts| counts.node_tests);
                let mean = |of: fn(&Counts) -> u64| {
                    counts.iter().map(of).sum::<u64>() as f64 / counts.len().max(1) as f64
                };
                rows.push(Row {
                    kind: self.kind.clone(),
                    pair: self.name.clone(),
                    triangles,
                    variant: *variant,
                    gap,
                    is_distance,
                    node_tests: mean(|counts| counts.node_tests),
                    median_node_tests: counts[counts.len() / 2].node_tests,
                    packet_tests: mean(|counts| counts.packet_tests),
                    turning_pairs: mean(|counts| counts.turning_pairs),
                    searched_pairs: mean(|counts| counts.searched_pairs),
                    directions: mean(|counts| counts.directions),
                    frame_pairs: mean(|counts| counts.frame_pairs),
                    alignments: mean(|counts| counts.alignments),
                    given_up: counts.iter().filter(|counts| counts.given_up).count(),
                    bytes: bytes / f64::from(triangles),
                    turned_frames: bounds_a.0.turned_frames as f64 / bounds_a.0.frames.len() as f64,
                });
            }
        }
        rows
    }
}

/// Bakes a mesh with all directions and with plain triangles.
pub(super) fn baked(mesh: &Mesh) -> Result<Bvh, Failure> {
    let options = Options::default().profile(Profile::Dop26U8Wide).triangles(TriangleEncoding::F32);
    let bvh = Bvh::from_bytes(to_bytes(mesh, &options)?.0)?;
    bvh.validate()?;
    Ok(bvh)
}

/// Turns B at random, and moves it from afar along the line between the closest points until it is a gap from A: nothing
/// on the way can be closer. Returns `None` if this takes too many steps.
fn at_gap(
    querier: &mut Querier,
    a: &Bvh,
    b: &Bvh,
    gap: f64,
    random: &mut Random,
) -> Result<Option<(Pose, f64)>, Failure> {
    let sphere = |bvh: &Bvh| -> (Vector, f64, f64) {
        let Some(object) = bvh.objects().first() else { return ([0.0; 3], 0.0, 0.0) };
        let record = object.record();
        let lo: Vector = record.box_lo.map(|c| f64::from(c.get()));
        let hi: Vector = record.box_hi.map(|c| f64::from(c.get()));
        let centre = plus(object.origin(), times(plus(lo, hi), 0.5));
        (centre, length(minus(hi, lo)) / 2.0, length(minus(hi, lo)))
    };
    let ((centre_a, radius_a, diagonal), (centre_b, radius_b, _)) = (sphere(a), sphere(b));
    let n = unit(random.point());
    let x = unit(cross(n, random.point()));
    let rotation = [x, cross(n, x), n];
    let direction = unit(random.point());
    let turned_centre = super::vector::turned(&rotation, centre_b);
    let mut t = minus(plus(centre_a, times(direction, 1.1 * (radius_a + radius_b))), turned_centre);
    let target = gap * diagonal;
    for _ in 0..STEPS {
        let pose = Pose::new(rotation, t)?;
        let found = querier.distance(a, b, &pose)?;
        if found.distance <= 1.01 * target {
            return Ok((found.distance >= 0.5 * target).then_some((pose, found.distance)));
        }
        // Rounding must not move it too far.
        let by = (found.distance - target) / found.distance * (1.0 - 1e-12);
        t = plus(t, times(minus(found.point_a, found.point_b), by));
    }
    Ok(None)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::oriented::variant::VARIANTS;
    use bvh_format::kdop::DirectionSet;

    #[test]
    fn each_walk_meets_the_closest_packets_and_ends_early_where_meshes_are_far_apart() {
        let scene = Scene::of_ball(2000, 4).unwrap();
        for row in scene.rows(&VARIANTS) {
            assert_eq!(row.given_up, 0);
            assert!(row.node_tests >= 1.0);
            // The limit is the distance: the packets with the closest points must be tested.
            assert!(!row.is_distance || row.packet_tests >= 1.0, "{}: {row:?}", row.variant.name);
            // At a twentieth of their size, 26 directions keep the packets of balls apart.
            let is_fine = row.variant.making.set == DirectionSet::Dop26 && row.gap == 3;
            assert!(row.is_distance || !is_fine || row.packet_tests == 0.0, "{}: {row:?}", row.variant.name);
        }
    }
}
