//! Gathers the faces of a file after all have been read: looks up their corners and cuts polygons into triangles.

use super::Gatherer;
use crate::error::{Fault, Halt};
use crate::input::indexed::{FaceRun, IndexedFaces, LookedUp};
use crate::input::names::Names;
use crate::input::polygon::Cutter;
use crate::threads;

/// The number of faces that one thread cuts at a time.
const FACES_PER_TASK: usize = 1 << 12;

impl Gatherer<'_> {
    /// Adds faces that have been checked to the objects of `names`.
    pub(super) fn add_faces(&mut self, faces: &IndexedFaces, names: &Names) -> Result<(), Halt> {
        let first = self.names.len();
        for name in names.all() {
            self.object(name.clone())?;
        }
        faces.each_window(|runs, corners| {
            let positions = faces.look_up(corners)?;
            let mut start = 0;
            for runs in runs.chunk_by(|a, b| names.of(a).0 == names.of(b).0) {
                let object = first + names.of(&runs[0]).0;
                let triangles = Triangles::of(runs, start, &positions)?;
                start += runs.iter().map(|run| run.faces as usize * run.corners as usize).sum::<usize>();
                let corners_of = |number| triangles.corners(number).map(|place| positions.at(place));
                self.add_triangles(object, triangles.count(), corners_of)?;
            }
            Ok::<_, Halt>(())
        })
    }
}

/// The triangles of consecutive faces, as places in a window.
enum Triangles {
    /// All faces are triangles. The first one starts at `start`.
    Faces {
        start: usize,
        count: usize,
    },
    Cut(Vec<[u32; 3]>),
}

impl Triangles {
    /// Returns the triangles of runs of faces. The first run starts at the place `start` of a window.
    fn of(runs: &[FaceRun], start: usize, positions: &LookedUp) -> Result<Self, Fault> {
        if runs.iter().all(|run| run.corners == 3) {
            return Ok(Self::Faces { start, count: runs.iter().map(|run| run.faces as usize).sum() });
        }
        let mut faces = Vec::new();
        let mut at = start;
        for run in runs {
            for _ in 0..run.faces {
                faces.push((at, run.corners as usize));
                at += run.corners as usize;
            }
        }
        let cut = |faces: &[(usize, usize)]| {
            let (mut cutter, mut triangles, mut polygon) = (Cutter::default(), Vec::new(), Vec::new());
            for &(start, corners) in faces {
                polygon.clear();
                polygon.extend((start..start + corners).map(|place| positions.at(place)));
                let keep = |triangle: [usize; 3]| {
                    triangles.push(triangle.map(|corner| (start + corner) as u32));
                    Ok::<_, Fault>(())
                };
                cutter.cut_polygon(&polygon, keep)?;
            }
            Ok(triangles)
        };
        if faces.len() < FACES_PER_TASK {
            return Ok(Self::Cut(cut(&faces)?));
        }
        let cut: Result<Vec<Vec<[u32; 3]>>, Fault> =
            threads::map(faces.chunks(FACES_PER_TASK), cut).into_iter().collect();
        Ok(Self::Cut(cut?.concat()))
    }

    fn count(&self) -> usize {
        match self {
            Self::Faces { count, .. } => *count,
            Self::Cut(triangles) => triangles.len(),
        }
    }

    /// Returns the places of a triangle's corners.
    #[inline]
    fn corners(&self, number: usize) -> [usize; 3] {
        match self {
            Self::Faces { start, .. } => [0, 1, 2].map(|corner| start + 3 * number + corner),
            Self::Cut(triangles) => triangles[number].map(|place| place as usize),
        }
    }
}
