//! Faces of numbered vertices, whose corners are looked up when all have been read.
//!
//! Positions and corners are put away as they come. Then corners are taken a window at a time, ordered by the piece
//! in which their vertices are, and each piece that has any is read once for the window. Where faces and vertices
//! follow each other in the same order, as in most files, each piece is read once or twice in all; where they do not, once
//! for each window.

use super::Gatherer;
use super::counter::Counter;
use crate::error::BakeError;
use crate::io::{COORDINATE, Fault, Halt, Place, obj, ply, polygon};
use crate::means::Means;
use crate::mesh::coordinate_fits;
use crate::progress::Tally;
use crate::scratch::{Piece, Spill, Stream};
use bytemuck::{Pod, Zeroable};

/// Vertices of a piece.
const PIECE: usize = 1 << 16;
/// Corners of a piece.
const CORNERS: usize = 1 << 18;
/// Bytes of memory a corner of a window.
const WINDOW_BYTES: usize = 48;

/// Consecutive faces of equal kind.
#[derive(Clone, Copy, Pod, Zeroable, PartialEq)]
#[repr(C)]
pub(crate) struct Run {
    /// Corners of each face.
    arity: u32,
    /// The object that they belong to.
    pub(crate) object: u32,
    /// Vertices are counted anew for each group.
    group: u32,
    faces: u32,
}

/// A vertex that a face uses and that the format cannot hold.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Misfit(pub(crate) u64);

enum Points {
    Narrow(Piece<[f32; 3]>),
    Wide(Piece<[f64; 3]>),
}

/// What has been read of a file.
pub(crate) struct Indexed {
    spill: Spill,
    points: Vec<Points>,
    open: Vec<[f64; 3]>,
    vertices: u64,
    corners: Stream<u32>,
    runs: Stream<Run>,
    run: Run,
    largest: u32,
    /// Corners of a window.
    window: usize,
}

impl Indexed {
    pub(super) fn new(means: &Means) -> Self {
        Self {
            spill: means.scratch.spill(),
            points: Vec::new(),
            open: Vec::new(),
            vertices: 0,
            corners: Stream::of_pieces(CORNERS),
            runs: Stream::of_pieces(PIECE),
            run: Run::zeroed(),
            largest: 0,
            window: (means.brick_bytes / WINDOW_BYTES).max(1 << 17),
        }
    }

    pub(crate) fn vertex_count(&self) -> u64 {
        self.vertices
    }

    pub(super) fn corner_count(&self) -> u64 {
        self.corners.count()
    }

    fn add_vertex(&mut self, position: [f64; 3]) -> Result<(), BakeError> {
        self.open.push(position);
        self.vertices += 1;
        if self.open.len() == PIECE { self.close_points() } else { Ok(()) }
    }

    fn close_points(&mut self) -> Result<(), BakeError> {
        let open = std::mem::take(&mut self.open);
        let narrow = |position: &[f64; 3]| position.map(|value| value as f32);
        // Bits, since a vertex that no face uses may be NaN.
        let fits = |position: &[f64; 3]| {
            narrow(position).map(|v| f64::from(v).to_bits()) == position.map(f64::to_bits)
        };
        self.points.push(if open.iter().all(fits) {
            Points::Narrow(self.spill.put(open.iter().map(narrow).collect())?)
        } else {
            Points::Wide(self.spill.put(open)?)
        });
        Ok(())
    }

    /// Adds a face of an object. Vertices are counted anew for each group.
    fn add_face(&mut self, corners: &[u32], object: u32, group: u32) -> Result<(), BakeError> {
        let run = Run { arity: corners.len() as u32, object, group, faces: self.run.faces };
        if run != self.run || run.faces == u32::MAX {
            self.close_run()?;
            self.run = Run { faces: 0, ..run };
        }
        self.run.faces += 1;
        corners.iter().for_each(|&corner| self.largest = self.largest.max(corner));
        self.corners.append(&self.spill, corners)
    }

    fn close_run(&mut self) -> Result<(), BakeError> {
        let run = self.run;
        if run.faces > 0 { self.runs.append(&self.spill, &[run]) } else { Ok(()) }
    }

    /// Puts away what is in memory.
    pub(super) fn finish(&mut self) -> Result<(), BakeError> {
        self.close_run()?;
        self.run = Run::zeroed();
        self.runs.finish(&self.spill)?;
        self.corners.finish(&self.spill)?;
        if self.open.is_empty() { Ok(()) } else { self.close_points() }
    }

    /// The first corner that is no vertex.
    pub(super) fn first_out_of_range(&self) -> Result<Option<u32>, BakeError> {
        if self.corners.count() == 0 || u64::from(self.largest) < self.vertices {
            return Ok(None);
        }
        for piece in self.corners.pieces() {
            let corners = piece.all()?;
            if let Some(&corner) = corners.iter().find(|&&corner| u64::from(corner) >= self.vertices) {
                return Ok(Some(corner));
            }
        }
        Ok(None)
    }

    /// Gives all triangles to the gatherer, if there is one, until a corner is a misfit. All corners are vertices.
    /// `tally` is over the corners.
    pub(super) fn resolve(
        &self,
        object_of: impl Fn(&Run) -> usize,
        mut gatherer: Option<&mut Gatherer>,
        tally: &Tally,
    ) -> Result<Option<Misfit>, Halt> {
        let mut corners = Corners { stream: &self.corners, piece: 0, open: Vec::new(), at: 0 };
        let mut counter = Counter::default();
        let mut last: Option<Run> = None;
        let mut cutter = polygon::Cutter::default();
        let (mut runs, mut window) = (Vec::new(), Vec::new());
        let mut resolve_window = |runs: &mut Vec<Run>, window: &mut Vec<u32>| {
            let positions = self.look_up(window)?;
            let misfit = positions.iter().position(|position| !position.iter().all(|&c| coordinate_fits(c)));
            if let Some(misfit) = misfit {
                return Ok(Some(Misfit(window[misfit].into())));
            }
            if let Some(gatherer) = gatherer.as_deref_mut() {
                let mut at = 0;
                for run in &*runs {
                    if let Some(last) = last.filter(|last| last.group != run.group) {
                        gatherer.add_vertices(object_of(&last), counter.end_run());
                    }
                    last = Some(*run);
                    for _ in 0..run.faces {
                        let face = at..at + run.arity as usize;
                        at = face.end;
                        let (vertices, positions) = (&window[face.clone()], &positions[face]);
                        let object = object_of(run);
                        cutter.cut_polygon(positions, |triangle| {
                            // Cutting may leave out corners that add nothing.
                            triangle.iter().for_each(|&place| counter.add(vertices[place], self.vertices));
                            gatherer.add(object, triangle.map(|place| positions[place]))
                        })?;
                    }
                }
            }
            tally.add(window.len() as u64);
            runs.clear();
            window.clear();
            Ok::<_, Halt>(None)
        };
        for piece in self.runs.pieces() {
            for run in piece.all()?.iter() {
                let mut left = run.faces;
                while left > 0 {
                    let room = self.window.saturating_sub(window.len()) / run.arity as usize;
                    let now = left.min(room.max(1) as u32);
                    corners.take(now as usize * run.arity as usize, &mut window)?;
                    runs.push(Run { faces: now, ..*run });
                    left -= now;
                    if window.len() + run.arity as usize > self.window || runs.len() == PIECE {
                        let misfit = resolve_window(&mut runs, &mut window)?;
                        if misfit.is_some() {
                            return Ok(misfit);
                        }
                    }
                }
            }
        }
        let misfit = resolve_window(&mut runs, &mut window)?;
        if let (Some(gatherer), Some(last), None) = (gatherer, last, misfit) {
            gatherer.add_vertices(object_of(&last), counter.end_run());
        }
        Ok(misfit)
    }

    /// The positions of some vertices.
    fn look_up(&self, vertices: &[u32]) -> Result<Vec<[f64; 3]>, BakeError> {
        let mut ends = vec![0u32; self.points.len()];
        let piece_of = |vertex: u32| vertex as usize / PIECE;
        vertices.iter().for_each(|&vertex| ends[piece_of(vertex)] += 1);
        let mut start = 0;
        for end in &mut ends {
            (*end, start) = (start, start + *end);
        }
        let mut order = vec![0u32; vertices.len()];
        for (place, &vertex) in (0..).zip(vertices) {
            let end = &mut ends[piece_of(vertex)];
            order[*end as usize] = place;
            *end += 1;
        }
        let mut positions = vec![[0.0; 3]; vertices.len()];
        let mut start = 0;
        for (points, end) in self.points.iter().zip(ends) {
            let places = &order[start as usize..end as usize];
            start = end;
            if places.is_empty() {
                continue;
            }
            let within = |place: u32| vertices[place as usize] as usize % PIECE;
            match points {
                Points::Narrow(piece) => {
                    let all = piece.all()?;
                    places.iter().for_each(|&p| positions[p as usize] = all[within(p)].map(f64::from));
                }
                Points::Wide(piece) => {
                    let all = piece.all()?;
                    places.iter().for_each(|&p| positions[p as usize] = all[within(p)]);
                }
            }
        }
        Ok(positions)
    }
}

/// Corners in the order of the file.
struct Corners<'a> {
    stream: &'a Stream<u32>,
    piece: usize,
    open: Vec<u32>,
    at: usize,
}

impl Corners<'_> {
    fn take(&mut self, mut count: usize, into: &mut Vec<u32>) -> Result<(), BakeError> {
        while count > 0 {
            if self.at == self.open.len() {
                let Some(piece) = self.stream.pieces().get(self.piece) else { return Ok(()) };
                self.open = piece.all()?.into_owned();
                (self.piece, self.at) = (self.piece + 1, 0);
            }
            let now = count.min(self.open.len() - self.at);
            into.extend_from_slice(&self.open[self.at..self.at + now]);
            self.at += now;
            count -= now;
        }
        Ok(())
    }
}

impl ply::Faces for Indexed {
    fn vertices(&self) -> u64 {
        self.vertices
    }

    fn vertex(&mut self, position: [f64; 3]) -> Result<(), Halt> {
        Ok(self.add_vertex(position)?)
    }

    fn misfit(&mut self, _: Place, _: f64) -> Result<(), Halt> {
        // Wrong only if a face uses it.
        Ok(())
    }

    fn face(&mut self, corners: &[u32]) -> Result<(), Halt> {
        Ok(self.add_face(corners, 0, 0)?)
    }
}

impl obj::Statements for Indexed {
    fn vertex(&mut self, position: [f64; 3]) -> Result<(), Halt> {
        Ok(self.add_vertex(position)?)
    }

    fn face(&mut self, corners: &[u32], object: u32, group: u32) -> Result<(), Halt> {
        Ok(self.add_face(corners, object, group)?)
    }
}

/// Looks for what is wrong with a vertex of a PLY file.
pub(super) struct Probe {
    misfit: Misfit,
    vertices: u64,
}

impl Probe {
    pub(super) fn new(misfit: Misfit) -> Self {
        Self { misfit, vertices: 0 }
    }
}

impl ply::Faces for Probe {
    fn vertices(&self) -> u64 {
        self.vertices
    }

    fn vertex(&mut self, _: [f64; 3]) -> Result<(), Halt> {
        self.vertices += 1;
        Ok(())
    }

    fn misfit(&mut self, place: Place, found: f64) -> Result<(), Halt> {
        if self.vertices == self.misfit.0 {
            return Err(Fault::new(place, COORDINATE, found.to_string()).into());
        }
        Ok(())
    }

    fn face(&mut self, _: &[u32]) -> Result<(), Halt> {
        Ok(())
    }
}
