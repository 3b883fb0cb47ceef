//! The options of a bake.

use bvh_format::Stop;
use bvh_format::leaf::TriangleEncoding;
use bvh_format::profile::Profile;
use std::sync::Arc;

/// The time that a bake spends on a better tree. The answers and the guarantees are the same, and each bake is proved.
///
/// [`Options`] has an example.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[non_exhaustive]
pub enum Effort {
    /// For meshes that live for seconds: a bake takes about half of the time, and without [`Options::topology`] less.
    ///
    /// Clusters along a curve make the tree, children get no turning slabs, and the report does not count open edges. On the pairs of
    /// the suite, `collide` takes 1.05 times as long in the geometric mean, `contacts` and `distance` 1.10, rays 1.01. The pair that
    /// loses most takes 1.15 times as long, and the worst of all gaps of any pair 1.6: `distance` of two smooth meshes of 100,000
    /// triangles, a tenth of the diagonal apart. Files take 3 to 7 % more bytes (AMD EPYC, Zen 3, 2026-11-29).
    Quick,
    /// Splits near the leaves are fine; then the largest tenth of all subtrees moves to better places.
    #[default]
    Default,
}

impl Effort {
    /// All efforts, the quickest first.
    pub const ALL: [Self; 2] = [Self::Quick, Self::Default];

    /// Returns the name used in options and in the provenance.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Quick => "quick",
            Self::Default => "default",
        }
    }

    /// Returns the effort with a name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|effort| effort.name() == name)
    }
}

/// How a bake rounds the coordinates of its input.
///
/// ```
/// use bvh_bake::{Options, Rounding, mesh::Mesh, to_bytes};
///
/// let mesh = Mesh::from_triangles(vec![[0.1, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], vec![[0, 1, 2]]);
/// let (_, exact) = to_bytes(&mesh, &Options::default())?;
/// let (_, rounded) = to_bytes(&mesh, &Options::default().round(Rounding::F32))?;
/// assert_eq!(exact.file.max_vertex_rounding, 0.0);
/// let moved = rounded.file.max_vertex_rounding; // rounded up
/// assert!(f64::from(0.1_f32) - 0.1 <= moved && moved < 1.5e-9);
/// # Ok::<(), bvh_bake::BakeError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[non_exhaustive]
pub enum Rounding {
    /// Not at all, beyond what the file needs.
    #[default]
    None,
    /// To the nearest `f32` number, ties to even, as games store them. Numbers that are equal in two inputs stay equal, whatever
    /// else the inputs contain.
    F32,
}

impl Rounding {
    /// All ways to round.
    pub const ALL: [Self; 2] = [Self::None, Self::F32];

    /// Returns the name used in options and in the provenance.
    pub const fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::F32 => "f32",
        }
    }

    /// Returns the way to round with a name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|rounding| rounding.name() == name)
    }
}

/// The options of a bake. `Options::default()` is right for most meshes; each method changes one option of it.
///
/// ```
/// use bvh_bake::{Effort, Options};
///
/// let options = Options::default().effort(Effort::Quick).ids(false);
/// assert_eq!(options.effort, Effort::Quick);
/// ```
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Options {
    /// The treelet profile; `None` chooses the fastest one, or a smaller one if [`Self::triangles`] asks for packed or quantised
    /// triangles.
    pub profile: Option<Profile>,
    /// The triangle encoding; `None` chooses `F32`, or `Packed` for objects whose plain triangles would be slow to read.
    pub triangles: Option<TriangleEncoding>,
    /// With `Quantized`, the largest distance by which a vertex may move, in mesh units. The default is 1e-5 of the
    /// diagonal of the object's box, and the limit is a hundredth of the diagonal.
    pub max_error: Option<f64>,
    /// How coordinates are rounded, those of a scene in the frames of its objects. Poses are not rounded, and nor are
    /// [`Self::radius`] and margins. Each file states by how much its vertices moved in `max_vertex_rounding`.
    pub round: Rounding,
    /// The distance within which vertices are welded, in mesh units; 0 leaves them where they are. Before anything else, each vertex of
    /// an object goes to the position of the first vertex within this distance of it, itself included: the one that comes first in the
    /// order in which triangles and their corners use them. Positions are as given, so that welding is not transitive. It closes seams
    /// that are open by rounding errors. Triangles that lose their area stay, and so does their number. The distance may be at most the diagonal of each
    /// object's box, except for objects that are a single point; at the diagonal, an object collapses to points.
    ///
    /// `spec/format.md` (section 15.7) states which operations decide whether a vertex is within the distance.
    pub weld: f64,
    /// The time spent on the tree.
    pub effort: Effort,
    /// Whether each object of the input gets a tree of its own. [`crate::FileBake`] names objects without a name after
    /// their files.
    pub split_objects: bool,
    /// Whether [`crate::FileBake`] reads its inputs as scenes ([`crate::input::read_scene`]): the nodes of glTF and COLLADA files
    /// and the objects of other files become instances. Each object then gets its own tree.
    pub scene: bool,
    /// Whether points without a position are left out of clouds: those with a coordinate that is NaN or infinite. By default,
    /// they are refused.
    pub drop_nan: bool,
    /// Whether the original triangle numbers are kept.
    pub ids: bool,
    /// The radius of all objects, from 0 to 2^118 mesh units: each stands for all points this near to its triangles.
    pub radius: f64,
    /// Whether what is inside the objects touches them. All of them must be closed.
    pub solid: bool,
    /// Whether the file states which objects are closed, with a triangle of each component. Queries about what is
    /// inside a mesh need it. It takes less than 0.01 bytes per triangle, unless a mesh has many components or duplicates.
    pub topology: bool,
    /// What stops a bake that is under way. It changes no bytes, and [`Self::stamp`] leaves it out. See [`Self::stop`].
    pub stop: Option<Arc<dyn Stop>>,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            profile: None,
            triangles: None,
            max_error: None,
            round: Rounding::None,
            weld: 0.0,
            effort: Effort::Default,
            split_objects: false,
            scene: false,
            drop_nan: false,
            ids: true,
            radius: 0.0,
            solid: false,
            topology: true,
            stop: None,
        }
    }
}

impl Options {
    /// Sets the treelet profile; `None` lets the baker choose.
    #[must_use]
    pub fn profile(self, profile: impl Into<Option<Profile>>) -> Self {
        Self { profile: profile.into(), ..self }
    }

    /// Sets the triangle encoding; `None` lets the baker choose.
    #[must_use]
    pub fn triangles(self, triangles: impl Into<Option<TriangleEncoding>>) -> Self {
        Self { triangles: triangles.into(), ..self }
    }

    /// Sets how far quantisation may move a vertex, in mesh units; `None` for the default.
    #[must_use]
    pub fn max_error(self, max_error: impl Into<Option<f64>>) -> Self {
        Self { max_error: max_error.into(), ..self }
    }

    /// Sets how coordinates are rounded.
    #[must_use]
    pub fn round(self, round: Rounding) -> Self {
        Self { round, ..self }
    }

    /// Sets the distance within which vertices are welded, in mesh units; 0 leaves them where they are.
    #[must_use]
    pub fn weld(self, distance: f64) -> Self {
        Self { weld: distance, ..self }
    }

    /// Sets the time spent on the tree.
    #[must_use]
    pub fn effort(self, effort: Effort) -> Self {
        Self { effort, ..self }
    }

    /// Sets whether each object of the input gets a tree of its own.
    #[must_use]
    pub fn split_objects(self, split_objects: bool) -> Self {
        Self { split_objects, ..self }
    }

    /// Sets whether files are read as scenes.
    #[must_use]
    pub fn scene(self, scene: bool) -> Self {
        Self { scene, ..self }
    }

    /// Sets whether points without a position are left out of clouds.
    #[must_use]
    pub fn drop_nan(self, drop_nan: bool) -> Self {
        Self { drop_nan, ..self }
    }

    /// Sets whether the original triangle numbers are kept.
    #[must_use]
    pub fn ids(self, ids: bool) -> Self {
        Self { ids, ..self }
    }

    /// Sets the radius of all objects, in mesh units.
    #[must_use]
    pub fn radius(self, radius: f64) -> Self {
        Self { radius, ..self }
    }

    /// Sets whether what is inside the objects touches them. The file then states which objects are closed.
    #[must_use]
    pub fn solid(self, solid: bool) -> Self {
        Self { solid, ..self }
    }

    /// Sets whether the file states which objects are closed.
    #[must_use]
    pub fn topology(self, topology: bool) -> Self {
        Self { topology, ..self }
    }

    /// Stops the bake when another thread, a timer or a signal handler sets a flag, or when the function that stands in its place
    /// returns true. The bake then ends with [`BakeError::Stopped`](crate::BakeError::Stopped), most often within a tenth of a second,
    /// and leaves nothing behind: an output that was there stays as it was. One flag may stop many bakes, and the queries of
    /// `bvh_query`, too.
    ///
    /// What is not stopped is what does not go piece by piece: a wait for the system, such as for the medium or a pipe, a sort that has
    /// room in memory, and the parsing of an XML or JSON document.
    ///
    /// ```
    /// use bvh_bake::{BakeError, Options, shapes, to_bytes};
    /// use std::sync::Arc;
    /// use std::sync::atomic::{AtomicBool, Ordering};
    ///
    /// let stop = Arc::new(AtomicBool::new(false));
    /// let options = Options::default().stop(Some(stop.clone()));
    /// assert!(to_bytes(&shapes::block([2.0; 3])?, &options).is_ok());
    /// stop.store(true, Ordering::Relaxed); // on any thread
    /// assert!(matches!(to_bytes(&shapes::block([2.0; 3])?, &options), Err(BakeError::Stopped)));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    #[must_use]
    pub fn stop(self, stop: Option<Arc<dyn Stop>>) -> Self {
        Self { stop, ..self }
    }

    /// Returns the options as one line of text. Equal options give equal text.
    pub fn stamp(&self) -> String {
        format!(
            "profile={} triangles={} max_error={} effort={} split={} ids={}{}{}{}{}{}{}{}",
            self.profile.map_or("auto", Profile::name),
            self.triangles.map_or("auto", TriangleEncoding::name),
            self.max_error.map_or("default".to_owned(), |e| format!("{e:?}")),
            self.effort.name(),
            self.split_objects,
            self.ids,
            if self.weld == 0.0 { String::new() } else { format!(" weld={:?}", self.weld) },
            if self.scene { " scene=true" } else { "" },
            if self.drop_nan { " drop_nan=true" } else { "" },
            if self.topology { "" } else { " topology=false" },
            if self.radius == 0.0 { String::new() } else { format!(" radius={:?}", self.radius) },
            if self.solid { " solid=true" } else { "" },
            if self.round == Rounding::None {
                String::new()
            } else {
                format!(" round={}", self.round.name())
            }
        )
    }
}
