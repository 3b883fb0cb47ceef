//! A page: what it shows, checked when it is made, and how it is written.
//!
//! The template has one line that the content replaces. A file is compressed and encoded as text while it is written, so
//! that no copy of it is made in memory.

use crate::content::{Content, Found, Frame, Instance, Line, Show, VERSION};
use crate::files::{Files, Named, Part};
use crate::{PageError, json};
use base64::engine::general_purpose::STANDARD;
use base64::write::EncoderWriter;
use bvh_query::{ClashClass, Groups, Motion, Pose};
use flate2::Compression;
use flate2::write::GzEncoder;
use std::io::{self, BufWriter, Write};

/// The page without content.
pub(crate) const TEMPLATE: &str = include_str!("../page.html");
/// The line of the template that the content replaces.
pub(crate) const CONTENT_LINE: &str = "<!--cbvh:content-->";

/// A page that shows meshes.
///
/// ```
/// use bvh_query::{Bvh, Pose};
/// use cbvh_view::{Named, Page};
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// # let corners = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
/// # let mesh = bvh_bake::mesh::Mesh::from_triangles(corners, vec![[0, 1, 2]]);
/// # let bvh = Bvh::from_bytes(bvh_bake::to_bytes(&mesh, &bvh_bake::Options::default())?.0)?;
/// let triangle = Named { name: "triangle".into(), path: String::new(), shape: bvh.into() };
/// let above = Pose::new(*Pose::IDENTITY.rotation(), [0.0, 0.0, 0.5])?;
/// let page = Page::pair(triangle, None, &above, None)?.limited_to(cbvh_view::DEFAULT_MAX_BYTES)?;
/// let mut html = Vec::new();
/// page.write(&mut html)?;
/// # Ok(())
/// # }
/// ```
#[derive(Debug)]
pub struct Page {
    pub(crate) files: Files,
    /// Which part of each file is shown, where the files themselves are shown. Instances say it of themselves.
    pub(crate) parts: Vec<Part>,
    pub(crate) show: Show,
}

/// A shape in the world.
///
/// [`Page::scene`] has an example.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Placed {
    /// The name of the instance.
    pub name: String,
    /// What is placed.
    pub of: Named,
    /// Where it is at first.
    pub pose: Pose,
    /// How much farther it reaches on all sides, in mesh units.
    pub margin: f64,
    /// The groups that it is in and those that it meets, which select the pairs that the page asks about.
    pub groups: Groups,
    /// Whether frames move it.
    pub moving: bool,
}

/// Two instances that clash, in the frame of the world. Lengths are in mesh units.
///
/// [`Page::clashes`] has an example.
#[derive(Clone, Copy, Debug)]
#[non_exhaustive]
pub struct PlacedClash {
    /// The numbers of the instances.
    pub pair: [usize; 2],
    /// How they clash.
    pub class: ClashClass,
    /// The bounds of their depth, if they have one.
    pub depth: Option<[f64; 2]>,
    /// How far apart the surfaces are, where that is known.
    pub distance: Option<f64>,
    /// A place where they clash.
    pub point: [f64; 3],
    /// What moves the second instance out of the first one.
    pub translation: Option<[f64; 3]>,
    /// The volume that both have in common, if that was measured.
    pub volume: Option<f64>,
    /// How thick each of both is where the other one passes through it, if that was measured and it does.
    pub pierced: [Option<f64>; 2],
}

impl Placed {
    /// A shape that stands there, without a margin and in all groups.
    pub fn new(name: impl Into<String>, of: Named, pose: Pose) -> Self {
        Self { name: name.into(), of, pose, margin: 0.0, groups: Groups::ALL, moving: false }
    }
}

impl PlacedClash {
    /// A clash of which the class and a place are known.
    pub fn new(pair: [usize; 2], class: ClashClass, point: [f64; 3]) -> Self {
        let (depth, distance, translation, volume) = (None, None, None, None);
        Self { pair, class, depth, distance, point, translation, volume, pierced: [None; 2] }
    }
}

impl Page {
    /// Shows one shape alone.
    ///
    /// # Errors
    /// [`PageError::FileTooLarge`].
    pub fn file(of: Named) -> Result<Self, PageError> {
        Self::of_both(of, None, |_| Show::File)
    }

    /// Shows B in a pose in the frame of A, and whether they are at most `within` mesh units apart if that is given. Without
    /// B, A is placed in its own frame.
    ///
    /// # Errors
    /// [`PageError::FileTooLarge`], and [`PageError::Number`] for `within`.
    pub fn pair(a: Named, b: Option<Named>, pose: &Pose, within: Option<f64>) -> Result<Self, PageError> {
        within.map(|within| length("within", within)).transpose()?;
        Self::of_both(a, b, |same| Show::Pair { pose: *pose, within, same })
    }

    /// Shows the motion of B from one pose in the frame of A to another one: its origin moves on a line, and it turns about one
    /// axis the shorter way. Without B, A moves in its own frame. A tolerance of `None` is that of `bvh_query::MotionOptions`.
    ///
    /// # Errors
    /// [`PageError::FileTooLarge`], [`PageError::Motion`] if the poses are half a turn apart, and [`PageError::Number`] for the
    /// clearance or the tolerance.
    pub fn motion(
        a: Named,
        b: Option<Named>,
        ends: [Pose; 2],
        clearance: f64,
        tolerance: Option<f64>,
    ) -> Result<Self, PageError> {
        Motion::between(&ends[0], &ends[1])?;
        length("clearance", clearance)?;
        if let Some(found) = tolerance.filter(|tolerance| !(tolerance.is_finite() && *tolerance > 0.0)) {
            return Err(PageError::Number { name: "tolerance", expected: "a finite length above 0", found });
        }
        Self::of_both(a, b, |same| Show::Motion { motion: ends, clearance, tolerance, same })
    }

    /// Makes a page of one shape or two. Tells `show` whether both are the same.
    fn of_both(a: Named, b: Option<Named>, show: impl FnOnce(bool) -> Show) -> Result<Self, PageError> {
        let mut files = Files::default();
        let mut parts = vec![files.add(a)?.1];
        let mut same = b.is_none();
        if let Some(b) = b {
            let (name, path) = (b.name.clone(), b.path.clone());
            let (number, part) = files.add(b)?;
            same = number == 0 && part == parts[0] && files.list[0].is_called(&name, &path);
            if !same {
                // A page of two objects of one file, or of two files with the same bytes, has these bytes twice.
                if number == 0 {
                    files.repeat(0, name, path);
                }
                parts.push(part);
            }
        }
        Ok(Self { files, parts, show: show(same) })
    }

    /// Shows a scene: instances, the pairs that may touch, further margins of pairs, and frames. A frame has the poses of all
    /// moving instances, in the order of the instances.
    ///
    /// ```
    /// use bvh_query::Pose;
    /// use cbvh_view::{Named, Page, Placed};
    ///
    /// # let block = bvh_query::Bvh::from_bytes(bvh_bake::to_bytes(&bvh_bake::shapes::block([2.0; 3])?, &Default::default())?.0)?;
    /// let of = Named { name: "block".into(), path: "block.cbvh".into(), shape: block.into() };
    /// let at = |x| Pose::new(*Pose::IDENTITY.rotation(), [x, 0.0, 0.0]);
    /// let still = Placed::new("left", of.clone(), at(0.0)?);
    /// let mut moving = Placed::new("right", of, at(3.0)?);
    /// moving.moving = true;
    /// let frames = vec![vec![at(3.0)?], vec![at(2.0)?]]; // of the one that moves
    /// let page = Page::scene([still, moving], vec![[0, 1]], vec![], frames)?; // the two may touch
    /// # page.write(&mut std::io::sink())?;
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`PageError::FileTooLarge`], [`PageError::Number`] for a margin, and [`PageError::Instance`] or [`PageError::Frame`] if
    /// pairs or frames do not fit the instances.
    pub fn scene(
        placed: impl IntoIterator<Item = Placed>,
        allowed: Vec<[usize; 2]>,
        pair_margins: Vec<([usize; 2], f64)>,
        frames: Vec<Vec<Pose>>,
    ) -> Result<Self, PageError> {
        let (files, instances) = instances(placed)?;
        let count = instances.len();
        allowed.iter().flatten().try_for_each(|&found| instance(count, found))?;
        for ([a, b], margin) in &pair_margins {
            instance(count, *a)?;
            instance(count, *b)?;
            length("margin", *margin)?;
        }
        let expected = instances.iter().filter(|instance| instance.moving).count();
        refuse_frames(&frames, expected)?;
        let pair_margins = pair_margins.into_iter().map(|([a, b], margin)| (a, b, margin)).collect();
        let frames = frames.into_iter().map(Frame).collect();
        let show = Show::Scene { instances, allowed, pair_margins, frames };
        Ok(Self { files, parts: Vec::new(), show })
    }

    /// Shows instances and which of them clash, in this order.
    ///
    /// ```
    /// use bvh_query::{Clash, ClashOptions, Pose, Querier};
    /// use cbvh_view::{Named, Page, Placed, PlacedClash};
    ///
    /// # let block = bvh_query::Bvh::from_bytes(bvh_bake::to_bytes(&bvh_bake::shapes::block([2.0; 3])?, &Default::default())?.0)?;
    /// let at = |x| Pose::new(*Pose::IDENTITY.rotation(), [x, 0.0, 0.0]);
    /// let found: Clash = Querier::new()?.clash(&block, &block, &at(1.5)?, &ClashOptions::new())?;
    /// // The frame of the first instance is that of the world here.
    /// let mut clash = PlacedClash::new([0, 1], found.class, found.point);
    /// clash.depth = found.depth.map(|depth| [depth.lower, depth.upper]);
    /// clash.translation = found.depth.map(|depth| depth.translation);
    /// # let of = Named { name: "block".into(), path: "block.cbvh".into(), shape: block.into() };
    /// let left = Placed::new("left", of.clone(), at(0.0)?);
    /// let right = Placed::new("right", of, at(1.5)?);
    /// let page = Page::clashes([left, right], &[clash])?;
    /// # page.write(&mut std::io::sink())?;
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`PageError::FileTooLarge`], [`PageError::Number`] for a margin or a number of a clash, and [`PageError::Instance`] if a
    /// clash is about an instance that is not there.
    pub fn clashes(
        placed: impl IntoIterator<Item = Placed>,
        clashes: &[PlacedClash],
    ) -> Result<Self, PageError> {
        let (files, instances) = instances(placed)?;
        let found = clashes.iter().map(|clash| {
            let PlacedClash { pair: [a, b], class, depth, distance, point, translation, volume, pierced } =
                *clash;
            instance(instances.len(), a)?;
            instance(instances.len(), b)?;
            let [lower, upper] = depth.map_or([None; 2], |depth| depth.map(Some));
            let [pierced_a, pierced_b] = pierced;
            let lengths = [lower, upper, distance, volume, pierced_a, pierced_b].into_iter().flatten();
            lengths.chain(point).chain(translation.into_iter().flatten()).try_for_each(finite)?;
            Ok(Found { a, b, class, lower, upper, distance, point, translation, volume, pierced })
        });
        let clashes = found.collect::<Result<_, PageError>>()?;
        Ok(Self { files, parts: Vec::new(), show: Show::Clash { instances, clashes } })
    }

    /// Returns how many bytes the files, and the numbers of frames or of a robot's lines, have before they are packed.
    pub fn bytes(&self) -> u64 {
        let numbers: u64 = match &self.show {
            Show::Scene { frames, .. } => frames.iter().map(|frame| 12 * frame.0.len() as u64).sum(),
            Show::Robot { lines, .. } => lines.iter().map(Line::numbers).sum(),
            _ => 0,
        };
        self.files.bytes().saturating_add(numbers.saturating_mul(size_of::<f64>() as u64))
    }

    /// Returns the page if its files and frames have at most so many bytes, before they are packed.
    ///
    /// # Errors
    /// [`PageError::TooLarge`].
    pub fn limited_to(self, limit: u64) -> Result<Self, PageError> {
        let found = self.bytes();
        if found > limit { Err(PageError::TooLarge { found, limit }) } else { Ok(self) }
    }

    /// Writes the page. The same content gives the same bytes.
    ///
    /// Cost: that of compressing all files. No file is copied in memory, except one that states another radius than its shape.
    ///
    /// # Errors
    /// The errors of `out`.
    pub fn write(&self, out: impl Write) -> io::Result<()> {
        let mut out = BufWriter::with_capacity(1 << 16, out);
        // A test counts the line in the template.
        let (before, after) = TEMPLATE.split_once(CONTENT_LINE).unwrap_or((TEMPLATE, ""));
        out.write_all(before.as_bytes())?;
        out.write_all(b"<script type=\"application/json\" id=\"cbvh-content\">")?;
        let parts = self.parts.iter().copied().chain(std::iter::repeat(Part::default()));
        let files = self.files.list.iter().zip(parts).map(|(file, part)| file.entry(part)).collect();
        json::write(&Content { version: VERSION, files, show: &self.show }, &mut out)?;
        out.write_all(b"</script>")?;
        for file in &self.files.list {
            out.write_all(b"\n<script type=\"text/plain\" class=\"cbvh-file\">")?;
            let mut packed = GzEncoder::new(EncoderWriter::new(&mut out, &STANDARD), Compression::default());
            packed.write_all(&file.shape.bytes().map_err(io::Error::other)?)?;
            packed.finish()?.finish()?;
            out.write_all(b"</script>")?;
        }
        out.write_all(after.as_bytes())?;
        out.flush()
    }
}

/// Finds the files of instances.
pub(crate) fn instances(
    placed: impl IntoIterator<Item = Placed>,
) -> Result<(Files, Vec<Instance>), PageError> {
    let mut files = Files::default();
    let instances = placed.into_iter().map(|Placed { name, of, pose, margin, groups, moving }| {
        length("margin", margin)?;
        let (file, part) = files.add(of)?;
        let Groups { member, meets } = groups;
        Ok(Instance { name, file, part, pose, margin, moving, member, meets })
    });
    let instances = instances.collect::<Result<_, PageError>>()?;
    Ok((files, instances))
}

/// Refuses the number of an instance that is not there.
fn instance(count: usize, found: usize) -> Result<(), PageError> {
    if found < count { Ok(()) } else { Err(PageError::Instance { count, found }) }
}

/// Refuses frames with the poses of too few or too many instances.
pub(crate) fn refuse_frames(frames: &[Vec<Pose>], expected: usize) -> Result<(), PageError> {
    let wrong = (1..).zip(frames).find(|(_, poses)| poses.len() != expected);
    wrong.map_or(Ok(()), |(frame, poses)| Err(PageError::Frame { frame, expected, found: poses.len() }))
}

/// Refuses what is no length. JSON has no way to write what is not finite.
fn length(name: &'static str, found: f64) -> Result<(), PageError> {
    let expected = "a finite length of at least 0";
    if found.is_finite() && found >= 0.0 { Ok(()) } else { Err(PageError::Number { name, expected, found }) }
}

/// Refuses a number of a clash that is not finite.
fn finite(found: f64) -> Result<(), PageError> {
    let (name, expected) = ("clash", "a finite number");
    if found.is_finite() { Ok(()) } else { Err(PageError::Number { name, expected, found }) }
}
