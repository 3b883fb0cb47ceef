//! Streams the triangles of an object in the order of their ids, part by part and as often as needed.
//!
//! Each thread can hold a few parts in memory.

use super::placement::{Moved, Placement};
use super::{Batch, BatchStream, Exact, TRIANGLES_PER_PART, Triangle, Triangles, WideTriangle};
use crate::error::BakeError;
use crate::storage::{Piece, Spill};
use crate::threads;
use bvh_format::vertex::Vertices;

/// A part of the input as it was read.
pub(crate) enum Part {
    Narrow(Piece<Triangle>),
    Wide(Piece<WideTriangle>),
}

impl Part {
    /// Returns the number of triangles.
    pub(crate) fn len(&self) -> usize {
        match self {
            Self::Narrow(piece) => piece.len(),
            Self::Wide(piece) => piece.len(),
        }
    }

    /// Visits all triangles as they were read.
    pub(crate) fn each_triangle(&self, mut visit: impl FnMut(&Exact)) -> Result<(), BakeError> {
        match self {
            Self::Narrow(piece) => {
                let all = piece.all()?;
                all.iter().for_each(|triangle| visit(&triangle.corners.map(|corner| corner.map(f64::from))));
            }
            Self::Wide(piece) => piece.all()?.iter().for_each(|triangle| visit(&triangle.corners)),
        }
        Ok(())
    }
}

/// All triangles of an object, duplicates included. All parts but the last are full.
pub(crate) struct TriangleStream {
    pub(crate) parts: Vec<Part>,
    pub(crate) count: u64,
    /// The placement of each corner when it is read; `None` if the corners are placed already.
    pub(crate) placement: Option<Placement>,
}

/// An object of the input, ready to be baked.
pub(crate) struct Gathered {
    pub(crate) name: String,
    /// How vertices follow from the offsets of the stream.
    pub(crate) behind: Vertices,
    pub(crate) stream: TriangleStream,
    /// The largest distances by which vertices moved, as far as they have been measured.
    pub(crate) moved: Moved,
    /// How far welding moved vertices before that.
    pub(crate) welded: Moved,
    /// Whether all triangles are points.
    pub(crate) is_cloud: bool,
}

impl TriangleStream {
    /// Returns the triangles of a part, and how far their corners were moved.
    pub(crate) fn measured_part(&self, number: usize) -> Result<(Batch<'_>, Moved), BakeError> {
        self.parts[number].measured(self.placement.as_ref())
    }
}

impl Part {
    /// Returns the triangles, placed if there is a placement, and how far their corners were moved.
    fn measured(&self, placement: Option<&Placement>) -> Result<(Batch<'_>, Moved), BakeError> {
        let mut moved = Moved::default();
        let are_exact = placement.is_some_and(Placement::is_corrected);
        let placed = match (self, placement) {
            (Part::Narrow(piece), None) => Batch::of(piece.all()?),
            (Part::Narrow(piece), Some(placement)) => {
                let all = piece.all()?;
                let place = |triangle: &Triangle| Triangle {
                    corners: triangle.corners.map(|c| placement.place(c.map(f64::from), &mut moved)),
                    id: triangle.id,
                };
                let exact = |triangle: &Triangle| triangle.corners.map(|corner| corner.map(f64::from));
                let kept = if are_exact { &all[..] } else { &[] };
                let triangles = all.iter().map(place).collect();
                Batch { triangles, exact: kept.iter().map(exact).collect::<Vec<Exact>>().into() }
            }
            (Part::Wide(piece), placement) => {
                let all = piece.all()?;
                let placement = placement.copied().unwrap_or_default();
                let place = |triangle: &WideTriangle| Triangle {
                    corners: triangle.corners.map(|corner| placement.place(corner, &mut moved)),
                    id: triangle.id,
                };
                let kept = if are_exact { &all[..] } else { &[] };
                let triangles = all.iter().map(place).collect();
                Batch { triangles, exact: kept.iter().map(|t| t.corners).collect::<Vec<Exact>>().into() }
            }
        };
        Ok((placed, moved))
    }
}

impl TriangleStream {
    /// Whether all corners are placed, so that they are not placed anew each time they are read.
    pub(crate) fn is_placed(&self) -> bool {
        self.placement.is_none() && self.parts.iter().all(|part| matches!(part, Part::Narrow(_)))
    }

    /// Returns all triangles of a placed stream without copying them.
    pub(crate) fn into_batches(self) -> BatchStream {
        let pieces = self.parts.into_iter().map(|part| match part {
            Part::Narrow(piece) => piece,
            Part::Wide(_) => unreachable!("the stream is placed"),
        });
        BatchStream::of_stored(pieces.collect())
    }

    /// Places all corners at once if all triangles are in memory, because otherwise every pass would place them again.
    /// Returns the stream and how far the corners moved if it placed them. Triangles whose vertices do not follow from their
    /// offsets stay as they were read.
    pub(crate) fn placed_in_memory(self, spill: &Spill) -> Result<(Self, Moved), BakeError> {
        let Self { parts, count, placement } = self;
        let is_placed = |part: &Part| placement.is_none() && matches!(part, Part::Narrow(_));
        let is_in_memory = |part: &Part| match part {
            Part::Narrow(piece) => piece.in_memory().is_some(),
            Part::Wide(piece) => piece.in_memory().is_some(),
        };
        let stays = parts.iter().all(is_placed) || !parts.iter().all(is_in_memory);
        if stays || placement.is_some_and(|placement| placement.is_corrected()) {
            return Ok((Self { parts, count, placement }, Moved::default()));
        }
        let place = |part: Part| {
            let (batch, moved) = part.measured(placement.as_ref())?;
            let triangles = batch.triangles.into_owned();
            drop(part);
            Ok((Part::Narrow(spill.put(triangles)?), moved))
        };
        let placed = threads::map(parts, place).into_iter().collect::<Result<Vec<_>, BakeError>>()?;
        let moved = placed.iter().fold(Moved::default(), |all, (_, moved)| all.joined(*moved));
        let parts = placed.into_iter().map(|(part, _)| part).collect();
        Ok((Self { parts, count, placement: None }, moved))
    }
}

impl Triangles for TriangleStream {
    fn parts(&self) -> usize {
        self.parts.len()
    }

    fn part(&self, number: usize) -> Result<Batch<'_>, BakeError> {
        Ok(self.measured_part(number)?.0)
    }

    fn are_exact(&self) -> bool {
        self.placement.is_some_and(|placement| placement.is_corrected())
    }
}

/// A stream without its duplicates.
pub(crate) struct Kept<'a> {
    pub(crate) stream: &'a TriangleStream,
    /// One bit per triangle, set for those that are left out; empty if none is.
    dropped: &'a [u64],
    /// The number of triangles kept in each part.
    counts: Vec<u64>,
}

impl<'a> Kept<'a> {
    pub(crate) fn new(stream: &'a TriangleStream, dropped: &'a [u64]) -> Self {
        let kept_of = |part: usize| {
            let size = (stream.count - (part * TRIANGLES_PER_PART) as u64).min(TRIANGLES_PER_PART as u64);
            let words = dropped.get(part * TRIANGLES_PER_PART / 64..).unwrap_or(&[]);
            let missing: u32 = words.iter().take(TRIANGLES_PER_PART / 64).map(|word| word.count_ones()).sum();
            size - u64::from(missing)
        };
        Self { stream, dropped, counts: (0..stream.parts.len()).map(kept_of).collect() }
    }

    /// Returns the number of triangles kept.
    pub(crate) fn count(&self) -> u64 {
        self.counts.iter().sum()
    }
}

impl Triangles for Kept<'_> {
    fn parts(&self) -> usize {
        self.stream.parts.len()
    }

    fn part(&self, number: usize) -> Result<Batch<'_>, BakeError> {
        let all = self.stream.part(number)?;
        if self.counts[number] == all.len() as u64 {
            return Ok(all);
        }
        let first = number * TRIANGLES_PER_PART;
        let is_kept = |place: &usize| self.dropped[(first + place) / 64] >> ((first + place) % 64) & 1 == 0;
        Ok(all.at((0..all.len()).filter(is_kept)))
    }

    fn are_exact(&self) -> bool {
        self.stream.are_exact()
    }
}
