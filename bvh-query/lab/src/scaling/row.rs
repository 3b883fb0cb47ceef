//! A row of the report on scaling.

use cbvh_measure::rounds::Work;
use cbvh_measure::spread::Spread;
use cbvh_measure::table::{self, Cell, Cells};

/// What a row is about.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Part {
    /// A ball in one size: single queries.
    Size,
    /// The growth of figures over all sizes.
    Growth,
    /// A batch of poses on some threads.
    Batch,
    /// A path, with or without a tracker.
    Path,
}

impl Part {
    /// The name in tables.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Size => "size",
            Self::Growth => "growth",
            Self::Batch => "batch",
            Self::Path => "path",
        }
    }
}

/// A baked ball.
#[derive(Debug, Clone)]
pub(super) struct Facts {
    pub(super) triangles: u64,
    pub(super) profile: &'static str,
    pub(super) encoding: &'static str,
    /// `None` if the profile has no room for any.
    pub(super) turning_slabs: Option<bool>,
    /// Bytes of the whole file, with ids.
    pub(super) file_bytes_per_tri: f64,
    /// From the mesh in memory to the proved bytes, on all processors.
    pub(super) bake_seconds: f64,
}

/// A row.
#[derive(Debug, Clone)]
pub(super) struct Row {
    pub(super) part: Part,
    /// `None` where the row is about all sizes.
    pub(super) mesh: Option<Facts>,
    /// True if turning slabs were left out.
    pub(super) without_slabs: bool,
    pub(super) question: &'static str,
    /// A fraction of the diagonal; 0 for a path in and out of contact, `None` for all gaps together.
    pub(super) gap: Option<f64>,
    /// How far the centre of B moves from pose to pose, as a fraction of the diagonal.
    pub(super) step: Option<f64>,
    pub(super) threads: Option<u64>,
    pub(super) tracker: Option<bool>,
    pub(super) poses: u64,
    pub(super) touching: u64,
    /// The least and the largest distance found, as fractions of the diagonal.
    pub(super) reached: Option<[f64; 2]>,
    /// For single queries see `Spread::of_rounds`; for batches and paths the spread over rounds of the mean query.
    pub(super) warm: Option<Spread>,
    pub(super) work: Work,
    /// How many times faster than on one thread, or than without a tracker.
    pub(super) speedup: Option<f64>,
    /// The slope of the logarithm of time over that of triangles, from a size a tenth as large or over all sizes.
    pub(super) growth: Option<f64>,
    /// The slope of the logarithm of node tests over that of triangles.
    pub(super) node_growth: Option<f64>,
}

impl Row {
    /// A row without figures.
    pub(super) fn new(part: Part, mesh: Option<Facts>, question: &'static str) -> Self {
        Self {
            part,
            mesh,
            without_slabs: false,
            question,
            gap: None,
            step: None,
            threads: None,
            tracker: None,
            poses: 0,
            touching: 0,
            reached: None,
            warm: None,
            work: Work::default(),
            speedup: None,
            growth: None,
            node_growth: None,
        }
    }

    /// The number of triangles, as plots need it.
    pub(super) fn triangles(&self) -> Option<f64> {
        self.mesh.as_ref().map(|mesh| mesh.triangles as f64)
    }

    /// Whether the trees have turning slabs; `None` where their profile has no room for any.
    fn turning_slabs(&self) -> Option<bool> {
        self.mesh.as_ref().map_or(Some(!self.without_slabs), |mesh| mesh.turning_slabs)
    }

    /// The median time in nanoseconds.
    pub(super) fn time(&self) -> Option<f64> {
        self.warm.map(|warm| warm.median)
    }

    /// Returns true for rows that are joined by one line of a plot.
    pub(super) fn is_beside(&self, other: &Self) -> bool {
        let line = |row: &Self| (row.part, row.without_slabs, row.question, row.gap);
        line(self) == line(other)
    }
}

impl Cells for Row {
    fn cells(&self) -> Vec<(&'static str, Cell)> {
        let mesh = self.mesh.as_ref();
        let name = |of: fn(&Facts) -> &'static str| mesh.map_or(Cell::Absent, |mesh| Cell::text(of(mesh)));
        let asked = self.part != Part::Growth;
        let p90 = self.warm.filter(|_| self.part == Part::Size).map(|warm| warm.p90);
        let mut cells = vec![
            ("part", Cell::text(self.part.name())),
            ("triangles", Cell::count(mesh.map(|mesh| mesh.triangles))),
            ("profile", name(|mesh| mesh.profile)),
            ("triangle_encoding", name(|mesh| mesh.encoding)),
            ("turning_slabs", Cell::flag(self.turning_slabs())),
            ("file_bytes_per_tri", Cell::number(mesh.map(|mesh| mesh.file_bytes_per_tri))),
            ("bake_seconds", Cell::number(mesh.map(|mesh| mesh.bake_seconds))),
            ("question", Cell::text(self.question)),
            ("gap", Cell::number(self.gap)),
            ("step", Cell::number(self.step)),
            ("threads", Cell::count(self.threads)),
            ("tracker", Cell::flag(self.tracker)),
            ("poses", Cell::count(asked.then_some(self.poses))),
            ("touching", Cell::count(asked.then_some(self.touching))),
            ("gap_least", Cell::number(self.reached.map(|reached| reached[0]))),
            ("gap_most", Cell::number(self.reached.map(|reached| reached[1]))),
            ("warm_ns_median", Cell::number(self.time())),
            ("warm_ns_q1", Cell::number(self.warm.map(|warm| warm.quartiles[0]))),
            ("warm_ns_q3", Cell::number(self.warm.map(|warm| warm.quartiles[1]))),
            ("warm_ns_p90", Cell::number(p90)),
        ];
        cells.extend(table::work(self.work));
        cells.extend([
            ("speedup", Cell::number(self.speedup)),
            ("growth", Cell::number(self.growth)),
            ("node_growth", Cell::number(self.node_growth)),
        ]);
        cells
    }
}

/// Writes a gap for people, in percent if it is large enough.
pub(super) fn gap_name(gap: f64) -> String {
    match gap {
        0.0 => "in and out".to_owned(),
        gap if gap < 0.001 => format!("{gap:e}"),
        gap => format!("{} %", 100.0 * gap),
    }
}
