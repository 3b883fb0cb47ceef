//! Scenes: two trees with the slabs of their nodes, and sets of poses with what is asked about them.

use super::patch::Patch;
use super::row::Row;
use super::slab::{Making, Slab};
use super::variant::Variant;
use super::walk::{Counts, Slabbed, walk};
use crate::scaling::GAPS;
use crate::tree::Tree;
use crate::{Failure, input};
use bvh_bake::mesh::Mesh;
use bvh_bake::{Options, Profile, TriangleEncoding};
use bvh_query::{Bvh, Pose, Querier};
use cbvh_measure::pairs::{Pair, spread_evenly};
use cbvh_measure::poses;
use cbvh_measure::rounds::Question;
use cbvh_testkit::ball::ball;
use rayon::prelude::*;
use std::path::PathBuf;

/// The names of poses that are made, by the gaps of the scaling experiment.
const MADE: [&str; 3] = ["d0sep", "d1", "d5"];

/// A tree, and the slabs that were made last.
struct Body {
    tree: Tree,
    patches: Vec<Patch>,
    slabs: Vec<Option<Slab>>,
}

impl Body {
    fn new(bvh: &Bvh) -> Result<Self, Failure> {
        let tree = Tree::of_file(bvh).ok_or("a file without objects")?;
        let (patches, slabs) = (Patch::of_tree(&tree), vec![None; tree.nodes.len()]);
        Ok(Self { tree, patches, slabs })
    }

    fn slabbed(&self) -> Slabbed<'_> {
        Slabbed { tree: &self.tree, slabs: &self.slabs }
    }
}

/// Poses and the question about them.
struct PoseSet {
    name: String,
    question: Question,
    poses: Vec<Pose>,
    /// What walks let through: 0 for contact, else the distances, mesh units.
    limits: Vec<f64>,
}

/// Two trees in sets of poses.
pub(super) struct Scene {
    pub(super) name: String,
    a: Body,
    /// `None` if it is A.
    b: Option<Body>,
    sets: Vec<PoseSet>,
    /// How the slabs were made.
    made: Option<Making>,
}

impl Scene {
    /// Reads a pair of meshes. `files` has the names of pose files for contact and for distance, in which `%s` stands for
    /// the pair's name; if there are none, poses are made. Each set has at most `count` poses.
    pub(super) fn of_pair(pair: &Pair, files: [&[String]; 2], count: usize) -> Result<Self, Failure> {
        let a = study_file(&input::mesh(&pair.a)?)?;
        let b = if pair.a == pair.b { None } else { Some(study_file(&input::mesh(&pair.b)?)?) };
        let mut sets = Vec::new();
        for (question, files) in Question::EXACT.into_iter().zip(files) {
            for file in files {
                let poses = input::poses(&PathBuf::from(file.replace("%s", &pair.name)))?;
                sets.push((label(file), question, spread_evenly(&poses, count)));
            }
        }
        Self::new(pair.name.clone(), &a, b.as_ref(), sets, count)
    }

    /// Makes a ball of about `target` triangles against itself.
    pub(super) fn of_ball(target: u64, count: usize) -> Result<Self, Failure> {
        let (positions, triangles) = ball(target);
        let name = format!("ball {target}");
        Self::new(name, &study_file(&Mesh::from_triangles(positions, triangles))?, None, Vec::new(), count)
    }

    fn new(
        name: String,
        a: &Bvh,
        b: Option<&Bvh>,
        mut sets: Vec<(String, Question, Vec<Pose>)>,
        count: usize,
    ) -> Result<Self, Failure> {
        let mut querier = Querier::new()?;
        let of_b = b.unwrap_or(a);
        if sets.is_empty() {
            for (label, gap) in MADE.into_iter().zip(GAPS) {
                let poses = poses::apart(&mut querier, a, of_b, gap, count)?;
                let question = Question::EXACT[usize::from(label != "d0sep")];
                sets.push((label.to_owned(), question, poses));
            }
        }
        let mut limited = Vec::new();
        for (name, question, poses) in sets {
            let mut limit = |pose| match question {
                Question::Collide => Ok(0.0),
                Question::Distance(_) => question.ask(&mut querier, a, of_b, pose),
            };
            let limits = poses.iter().map(&mut limit).collect::<Result<Vec<f64>, _>>()?;
            limited.push(PoseSet { name, question, poses, limits });
        }
        let b = b.map(Body::new).transpose()?;
        Ok(Self { name, a: Body::new(a)?, b, sets: limited, made: None })
    }

    /// Returns the tree and its slabs for each different mesh.
    pub(super) fn bodies(&self) -> impl Iterator<Item = Slabbed<'_>> {
        [Some(&self.a), self.b.as_ref()].into_iter().flatten().map(Body::slabbed)
    }

    /// Makes the slabs, unless they are the last ones that were made.
    pub(super) fn make(&mut self, making: Making) {
        if self.made != Some(making) {
            for body in [Some(&mut self.a), self.b.as_mut()].into_iter().flatten() {
                body.slabs = making.slabs(&body.tree, &body.patches);
            }
            self.made = Some(making);
        }
    }

    /// Walks in all poses of the sets about which `asked` says yes.
    pub(super) fn rows(&mut self, variant: &Variant, asked: impl Fn(Question) -> bool) -> Vec<Row> {
        if variant.rule.slab.is_some() {
            self.make(variant.making);
        }
        let (a, b) = (self.a.slabbed(), self.b.as_ref().unwrap_or(&self.a).slabbed());
        let sets = self.sets.iter().filter(|set| asked(set.question));
        let counted = |set: &PoseSet| -> Vec<Counts> {
            let poses = set.poses.par_iter().zip(&set.limits);
            poses.map(|(pose, &limit)| walk(a, b, pose, limit, variant.rule)).collect()
        };
        sets.map(|set| Row::new(variant, &self.name, &set.name, set.question, &counted(set))).collect()
    }
}

/// Bakes a mesh with all directions, whose first ones are those of the smaller sets, and with plain triangles.
fn study_file(mesh: &Mesh) -> Result<Bvh, Failure> {
    input::bake(mesh, &Options::default().profile(Profile::Dop26U8Wide).triangles(TriangleEncoding::F32))
}

/// Returns the name of a set of poses: that of its file without folder, extension and pair.
fn label(file: &str) -> String {
    let path = PathBuf::from(file.replace("%s", ""));
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    stem.trim_matches(['_', '-', '.']).to_owned()
}
