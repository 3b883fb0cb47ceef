//! Stores the vertices and faces of a file as they are read, in memory or in scratch files.
//!
//! A face may use vertices that come later in the file, so that the positions of corners are looked up when all have
//! been read. Corners are then processed in windows. If the vertices are in memory, they are looked up in place. If
//! they are in scratch files, the corners of a window are sorted by the piece that contains their vertices, and each
//! piece that is needed is read once per window. If faces and vertices follow each other in the same order, as in most
//! files, each piece is read once or twice in total; otherwise it is read once per window.

use crate::error::BakeError;
use crate::limits::coordinate_fits;
use crate::storage::resources::Resources;
use crate::storage::{Piece, Spill, Stream};
use bytemuck::{Pod, Zeroable};

/// The number of vertices in a piece.
const PIECE_VERTICES: usize = 1 << 16;
/// The number of corners in a piece.
const PIECE_CORNERS: usize = 1 << 18;
/// The number of runs in a piece.
const PIECE_RUNS: usize = 1 << 16;
/// Bytes of memory per corner of a window while corners are looked up and made into triangles.
const WINDOW_BYTES_PER_CORNER: usize = 48;

/// Consecutive faces with the same number of corners, object and group.
#[derive(Clone, Copy, Pod, Zeroable, PartialEq)]
#[repr(C)]
pub(crate) struct FaceRun {
    /// The number of corners of each face.
    pub(crate) corners: u32,
    /// The number of the object that the faces belong to.
    pub(crate) object: u32,
    /// The number of the group. A mesh in memory numbers its vertices anew for each group.
    pub(crate) group: u32,
    pub(crate) faces: u32,
}

enum Positions {
    Narrow(Piece<[f32; 3]>),
    Wide(Piece<[f64; 3]>),
}

/// The vertices and faces read from a file.
pub(crate) struct IndexedFaces {
    spill: Spill,
    positions: Vec<Positions>,
    /// The vertices that do not fill a piece yet.
    open: Vec<[f64; 3]>,
    vertices: u64,
    /// Whether the format cannot hold some vertex, whether used or not.
    has_misfits: bool,
    corners: Stream<u32>,
    runs: Stream<FaceRun>,
    /// The run that may still grow.
    run: FaceRun,
    largest: u32,
    window_corners: usize,
}

impl IndexedFaces {
    pub(crate) fn new(resources: &Resources) -> Self {
        Self {
            spill: resources.scratch.spill(),
            positions: Vec::new(),
            open: Vec::new(),
            vertices: 0,
            has_misfits: false,
            corners: Stream::of_pieces(PIECE_CORNERS),
            runs: Stream::of_pieces(PIECE_RUNS),
            run: FaceRun::zeroed(),
            largest: 0,
            window_corners: (resources.brick_bytes / WINDOW_BYTES_PER_CORNER).max(1 << 17),
        }
    }

    pub(crate) fn vertex_count(&self) -> u64 {
        self.vertices
    }

    pub(crate) fn add_vertices(&mut self, mut positions: &[[f64; 3]]) -> Result<(), BakeError> {
        self.vertices += positions.len() as u64;
        self.has_misfits |= !positions.as_flattened().iter().all(|&value| coordinate_fits(value));
        while !positions.is_empty() {
            let (now, later) = positions.split_at(positions.len().min(PIECE_VERTICES - self.open.len()));
            self.open.extend_from_slice(now);
            positions = later;
            if self.open.len() == PIECE_VERTICES {
                self.close_piece()?;
            }
        }
        Ok(())
    }

    fn close_piece(&mut self) -> Result<(), BakeError> {
        let open = std::mem::take(&mut self.open);
        let narrow = |position: &[f64; 3]| position.map(|value| value as f32);
        // The bits are compared, because a vertex that no face uses may be NaN.
        let fits = |position: &[f64; 3]| {
            narrow(position).map(|v| f64::from(v).to_bits()) == position.map(f64::to_bits)
        };
        self.positions.push(if open.iter().all(fits) {
            Positions::Narrow(self.spill.put(open.iter().map(narrow).collect())?)
        } else {
            Positions::Wide(self.spill.put(open)?)
        });
        Ok(())
    }

    /// Adds faces to a group of an object, each with the stated number of corners.
    pub(crate) fn add_run(
        &mut self,
        corners_per_face: u32,
        faces: u32,
        object: u32,
        group: u32,
        corners: &[u32],
    ) -> Result<(), BakeError> {
        let run = FaceRun { corners: corners_per_face, object, group, faces: self.run.faces };
        if run != self.run || self.run.faces.checked_add(faces).is_none() {
            self.close_run()?;
            self.run = FaceRun { faces: 0, ..run };
        }
        self.run.faces += faces;
        self.add_corners(corners)
    }

    /// Adds corners that belong to no face but may be misfits.
    pub(crate) fn add_corners(&mut self, corners: &[u32]) -> Result<(), BakeError> {
        self.largest = corners.iter().copied().fold(self.largest, u32::max);
        self.corners.append(&self.spill, corners)
    }

    fn close_run(&mut self) -> Result<(), BakeError> {
        let run = self.run;
        if run.faces > 0 { self.runs.append(&self.spill, &[run]) } else { Ok(()) }
    }

    /// Stores what is still in memory, after all has been read.
    pub(crate) fn finish(&mut self) -> Result<(), BakeError> {
        self.close_run()?;
        self.run = FaceRun::zeroed();
        self.runs.finish(&self.spill)?;
        self.corners.finish(&self.spill)?;
        if self.open.is_empty() { Ok(()) } else { self.close_piece() }
    }

    /// Returns the first corner that is not a vertex of the file: its place among all corners, and its number.
    pub(crate) fn first_out_of_range(&self) -> Result<Option<(u64, u32)>, BakeError> {
        if self.corners.count() == 0 || u64::from(self.largest) < self.vertices {
            return Ok(None);
        }
        let mut before = 0;
        for piece in self.corners.pieces() {
            let corners = piece.all()?;
            if let Some(place) = corners.iter().position(|&corner| u64::from(corner) >= self.vertices) {
                return Ok(Some((before + place as u64, corners[place])));
            }
            before += corners.len() as u64;
        }
        Ok(None)
    }

    /// Returns the first corner that the format cannot hold: its place among all corners, and its vertex. If there is an
    /// `end`, only the corners before it are searched. All corners must be vertices of the file.
    pub(crate) fn first_misfit(&self, end: Option<u64>) -> Result<Option<(u64, u32)>, BakeError> {
        if !self.has_misfits {
            return Ok(None);
        }
        let all = end.unwrap_or(u64::MAX).min(self.corners.count());
        let mut left = all;
        let mut corners = CornerReader::new(self);
        let mut window = Vec::new();
        while left > 0 {
            let now = left.min(self.window_corners as u64);
            left -= now;
            window.clear();
            corners.take(now as usize, &mut window)?;
            let positions = self.sorted_look_up(&window)?;
            let misfit = positions.iter().position(|position| !position.iter().all(|&c| coordinate_fits(c)));
            if let Some(misfit) = misfit {
                return Ok(Some((all - left - now + misfit as u64, window[misfit])));
            }
        }
        Ok(None)
    }

    /// Passes all faces, which must have been checked, to the caller in order and in windows: the runs of a window, and
    /// its corners.
    pub(crate) fn each_window<E: From<BakeError>>(
        &self,
        mut visit: impl FnMut(&[FaceRun], &[u32]) -> Result<(), E>,
    ) -> Result<(), E> {
        let mut corners = CornerReader::new(self);
        let (mut runs, mut window) = (Vec::new(), Vec::new());
        for piece in self.runs.pieces() {
            for run in piece.all()?.iter() {
                let mut left = run.faces;
                while left > 0 {
                    let room = self.window_corners.saturating_sub(window.len()) / run.corners as usize;
                    let now = left.min(room.max(1) as u32);
                    corners.take(now as usize * run.corners as usize, &mut window)?;
                    runs.push(FaceRun { faces: now, ..*run });
                    left -= now;
                    if window.len() + run.corners as usize > self.window_corners || runs.len() == PIECE_RUNS {
                        visit(&runs, &window)?;
                        runs.clear();
                        window.clear();
                    }
                }
            }
        }
        visit(&runs, &window)
    }

    /// Finds the positions of the given vertices.
    pub(crate) fn look_up<'a>(&'a self, vertices: &'a [u32]) -> Result<LookedUp<'a>, BakeError> {
        let in_memory = |positions: &'a Positions| match positions {
            Positions::Narrow(piece) => piece.in_memory().map(InMemory::Narrow),
            Positions::Wide(piece) => piece.in_memory().map(InMemory::Wide),
        };
        match self.positions.iter().map(in_memory).collect() {
            Some(pieces) => Ok(LookedUp::InPlace { vertices, pieces }),
            None => Ok(LookedUp::Copied(self.sorted_look_up(vertices)?)),
        }
    }

    /// Finds the positions of the given vertices, and reads each piece at most once.
    pub(crate) fn sorted_look_up(&self, vertices: &[u32]) -> Result<Vec<[f64; 3]>, BakeError> {
        let mut ends = vec![0u32; self.positions.len()];
        let piece_of = |vertex: u32| vertex as usize / PIECE_VERTICES;
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
        for (piece, end) in self.positions.iter().zip(ends) {
            let places = &order[start as usize..end as usize];
            start = end;
            if places.is_empty() {
                continue;
            }
            let within = |place: u32| vertices[place as usize] as usize % PIECE_VERTICES;
            match piece {
                Positions::Narrow(piece) => {
                    let all = piece.all()?;
                    places.iter().for_each(|&p| positions[p as usize] = all[within(p)].map(f64::from));
                }
                Positions::Wide(piece) => {
                    let all = piece.all()?;
                    places.iter().for_each(|&p| positions[p as usize] = all[within(p)]);
                }
            }
        }
        Ok(positions)
    }
}

/// A piece of positions in memory.
pub(crate) enum InMemory<'a> {
    Narrow(&'a [[f32; 3]]),
    Wide(&'a [[f64; 3]]),
}

/// The positions of the corners of a window.
pub(crate) enum LookedUp<'a> {
    InPlace { vertices: &'a [u32], pieces: Vec<InMemory<'a>> },
    Copied(Vec<[f64; 3]>),
}

impl LookedUp<'_> {
    /// Returns the position of the corner at a place of the window.
    #[inline]
    pub(crate) fn at(&self, place: usize) -> [f64; 3] {
        match self {
            Self::InPlace { vertices, pieces } => {
                let vertex = vertices[place] as usize;
                match &pieces[vertex / PIECE_VERTICES] {
                    InMemory::Narrow(piece) => piece[vertex % PIECE_VERTICES].map(f64::from),
                    InMemory::Wide(piece) => piece[vertex % PIECE_VERTICES],
                }
            }
            Self::Copied(positions) => positions[place],
        }
    }
}

/// Reads the corners in the order of the file.
struct CornerReader<'a> {
    stream: &'a Stream<u32>,
    next_piece: usize,
    open: Vec<u32>,
    taken: usize,
}

impl<'a> CornerReader<'a> {
    fn new(faces: &'a IndexedFaces) -> Self {
        Self { stream: &faces.corners, next_piece: 0, open: Vec::new(), taken: 0 }
    }

    fn take(&mut self, mut count: usize, into: &mut Vec<u32>) -> Result<(), BakeError> {
        while count > 0 {
            if self.taken == self.open.len() {
                let Some(piece) = self.stream.pieces().get(self.next_piece) else { return Ok(()) };
                self.open = piece.all()?.into_owned();
                (self.next_piece, self.taken) = (self.next_piece + 1, 0);
            }
            let now = count.min(self.open.len() - self.taken);
            into.extend_from_slice(&self.open[self.taken..self.taken + now]);
            self.taken += now;
            count -= now;
        }
        Ok(())
    }
}
