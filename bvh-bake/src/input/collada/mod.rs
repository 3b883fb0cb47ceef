//! Reads COLLADA files in one of two ways, as the reader of glTF does: as a mesh, of which each geometry that a node places is an
//! object, or as a scene of instances that share objects.
//!
//! Module `document` has the XML, of which module `schema` lists the elements that matter. Module `transform` reads what places
//! nodes, and module `geometry` reads meshes.
//!
//! The reader takes the visual scene that the file names or, if it names none, the only one; without any, each geometry is
//! where it stands. Lengths become metres, and z points up. Elements that may change triangles in a way that is not known, such as
//! controllers and `<convex_mesh>`, and references to other files are refused where they are needed, so that a mesh is never
//! what is left of one. Lines and splines have no surface, and are left out with a warning.

mod document;
mod geometry;
mod schema;
mod transform;

use crate::error::{Fault, Halt, Place, excerpt};
use crate::input::InputFile;
use crate::input::frame::{self, Affine, Frame, IDENTITY, Linear, Scales, UNIT};
use crate::input::gather::SceneFaces;
use crate::input::gltf::Sink as _;
use crate::input::xml::{Children, Number};
use crate::progress::Progress;
use crate::storage::resources::Allowance;
use bvh_format::instances::Instance;
use document::{Document, Ids};
use geometry::MeshReader;
use schema::{Attribute, Collada, Tag};
use std::collections::HashMap;
use transform::Transform;

/// What to do with the axis that a COLLADA file declares to point up.
///
/// ```
/// use bvh_bake::input::{UpAxis, read_with};
///
/// # let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../testdata/collada/centimetres.dae");
/// let turned = read_with(path.as_ref(), UpAxis::Turned, false)?;
/// let kept = read_with(path.as_ref(), UpAxis::Kept, false)?;
/// assert_eq!(turned.triangle_count(), kept.triangle_count());
/// # Ok::<(), bvh_bake::ReadError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum UpAxis {
    /// Turn the file so that this axis becomes z. A file that declares none has y up, as the specification says.
    #[default]
    Turned,
    /// Leave coordinates as they are. ROS does so with the meshes of robots.
    Kept,
}

/// The number of bytes of geometries, each counted as often as it is placed, that a file may have besides its own: a small file can
/// place a geometry any number of times.
const MAX_COPIED_BYTES: u64 = 1 << 28;
/// The number of bytes that an element of a node counts as, to bound the time that nodes and instances take.
const NODE_BYTES: u64 = 16;

/// Returns whether the first bytes of a file are those of a COLLADA file.
pub(super) fn is_collada(head: &[u8]) -> bool {
    let head = super::xml::text_of(head);
    let head = head.trim_start();
    head.starts_with('<') && head.contains("<COLLADA")
}

/// Reads a file as a mesh or as a scene, and passes on what it finds. The whole file, and what is known of its elements, must fit
/// in `memory`.
pub(super) fn read(
    input: &InputFile,
    found: &mut SceneFaces,
    memory: Allowance,
    progress: &Progress,
) -> Result<(), Halt> {
    let memory = memory.less(input.bytes_in_memory());
    let own = if input.bytes_in_memory() > 0 { 0 } else { input.length() };
    memory.require(own)?;
    let bytes = input.read_all(progress)?;
    let text = document::text(&bytes, memory.less(own))?;
    let document = &Document::parse(&text).map_err(Fault::from)?;
    let units = Units::of(document, input.up_axis())?;
    let placed = [Tag::Geometry, Tag::Node, Tag::VisualScene];
    let stated = document.all(Tag::Scale).filter_map(|scale| document.numbers::<3>(scale).ok());
    let mut scene = Scene {
        document,
        ids: Ids::of(document, placed.into_iter().flat_map(|tag| document.all(tag))),
        scales: Scales::stated(stated.flatten()),
        variants: HashMap::new(),
        objects: 0,
        found,
        bytes: 0,
    };
    scene.read(units.place(input.is_scene()))?;
    units.told().into_iter().for_each(|told| input.warnings().add(Place::File, told));
    Ok(())
}

/// The unit of lengths and the axis that points up.
struct Units {
    metres: f64,
    /// What turns the axis up to z, and its name, if that is to be done.
    turn: Option<Axis>,
}

impl Units {
    /// Reads the units of a file. All parts of a file have the same.
    fn of(document: &Document, up_axis: UpAxis) -> Result<Self, Fault> {
        let whole = document.only_child(Document::ROOT, Tag::Asset)?;
        let (metres, axis) = match whole {
            Some(asset) => (stated_metres(document, asset)?, stated_axis(document, asset)?),
            None => (None, None),
        };
        let (metres, (turn, name)) = (metres.unwrap_or(1.0), axis.unwrap_or(Y_UP));
        for part in document.all(Tag::Asset).filter(|&asset| Some(asset) != whole) {
            let (own, own_axis) = (stated_metres(document, part)?, stated_axis(document, part)?);
            if own.is_some_and(|own| own != metres) || own_axis.is_some_and(|(_, own)| own != name) {
                let expected =
                    format!("the unit and the axis of the whole file, {metres:?} metres and {name}");
                return Err(document.fault(part, expected, "others for a part of it"));
            }
        }
        Ok(Self { metres, turn: Some((turn, name)).filter(|_| up_axis == UpAxis::Turned && turn != UNIT) })
    }

    /// Returns the transform of the topmost nodes.
    fn place(&self, as_scene: bool) -> Placement {
        let turn = Transform::Rotate(self.turn.map_or(UNIT, |(turn, _)| turn));
        let mut scales = Scales::stated([].into_iter());
        let world = if as_scene { Placement::Frame(Frame::WORLD) } else { Placement::Matrix(IDENTITY) };
        world.then(&turn, &mut scales).then(&Transform::Scale([self.metres; 3]), &mut scales)
    }

    /// Says in one line what is done to the coordinates of the file.
    fn told(&self) -> Option<String> {
        let scaled =
            (self.metres != 1.0).then(|| format!("scaled from units of {:?} metres to metres", self.metres));
        let turned = self.turn.map(|(_, name)| format!("turned from {name} to Z_UP"));
        let told: Vec<String> = scaled.into_iter().chain(turned).collect();
        (!told.is_empty()).then(|| told.join(" and "))
    }
}

/// An axis that may point up: the turn from it to z, and its name.
type Axis = (Linear, &'static str);

/// The axis of a file that declares none.
const Y_UP: Axis = ([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]], "Y_UP");
const X_UP: Axis = ([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]], "X_UP");
const Z_UP: Axis = (UNIT, "Z_UP");

/// Returns the unit that an asset states.
fn stated_metres(document: &Document, asset: Number) -> Result<Option<f64>, Fault> {
    let Some(unit) = document.only_child(asset, Tag::Unit)? else { return Ok(None) };
    let Some(stated) = document.attribute(unit, Attribute::Meter) else { return Ok(None) };
    let metres = stated.trim().parse().ok().filter(|&metres: &f64| metres > 0.0 && metres.is_finite());
    let found = || format!("meter=\"{}\"", excerpt(stated.as_bytes()));
    metres
        .map(Some)
        .ok_or_else(|| document.fault(unit, "a unit of a finite number of metres above 0", found()))
}

/// Returns the axis that an asset states to point up.
fn stated_axis(document: &Document, asset: Number) -> Result<Option<Axis>, Fault> {
    let Some(axis) = document.only_child(asset, Tag::UpAxis)? else { return Ok(None) };
    let stated = document.words(axis)?.collect::<Vec<_>>().join(" ");
    let known = [X_UP, Y_UP, Z_UP].into_iter().find(|(_, name)| *name == stated);
    known.map(Some).ok_or_else(|| document.fault(axis, "X_UP, Y_UP or Z_UP", excerpt(stated.as_bytes())))
}

/// The transform of a node, with those above it: a matrix, or a frame if nodes become instances.
#[derive(Clone, Copy)]
enum Placement {
    Matrix(Affine),
    Frame(Frame),
}

impl Placement {
    fn then(&self, transform: &Transform, scales: &mut Scales) -> Self {
        match self {
            Self::Matrix(matrix) => Self::Matrix(frame::product(matrix, &transform.matrix())),
            Self::Frame(frame) => Self::Frame(frame.then(&transform.frame(scales))),
        }
    }
}

/// Whether S of a [`Frame`] is the same, to the bit.
type ShapeBits = [[u64; 3]; 3];

struct Scene<'d, 'a, 's, 'r> {
    document: &'d Document<'a>,
    ids: Ids<'d>,
    scales: Scales,
    /// The object of each geometry and shape, as a scene.
    variants: HashMap<(Number, ShapeBits), u32>,
    /// The number of objects so far.
    objects: u32,
    found: &'s mut SceneFaces<'r>,
    /// The bytes of geometries and nodes so far.
    bytes: u64,
}

/// A node that is being visited: its children from `next` on are still to come.
struct Visit<'d, 'a> {
    node: Number,
    children: Children<'d, 'a, Collada>,
    placed: Placement,
}

impl<'d, 'a> Scene<'d, 'a, '_, '_> {
    fn read(&mut self, world: Placement) -> Result<(), Halt> {
        let Some(scene) = self.visual_scene()? else {
            for geometry in self.document.all(Tag::Geometry) {
                self.geometry(geometry, None, &world)?;
            }
            return Ok(());
        };
        self.nodes(scene, world)
    }

    /// Returns the visual scene that the file names, or the only one.
    fn visual_scene(&self) -> Result<Option<Number>, Fault> {
        let document = self.document;
        let named = document.only_child(Document::ROOT, Tag::Scene)?;
        let named = named.map_or(Ok(None), |scene| document.only_child(scene, Tag::InstanceVisualScene))?;
        if let Some(named) = named {
            return self
                .ids
                .find(document, named, Attribute::Url, Tag::VisualScene, "<visual_scene>")
                .map(Some);
        }
        let mut all = document.all(Tag::VisualScene);
        let first = all.next();
        match all.next() {
            None => Ok(first),
            Some(second) => {
                let expected = "one <visual_scene>, or a <scene> that names one of them";
                Err(document.fault(second, expected, "another <visual_scene> and no such name"))
            }
        }
    }

    /// Visits the nodes of a scene, each before those in it.
    fn nodes(&mut self, scene: Number, world: Placement) -> Result<(), Halt> {
        let document = self.document;
        let mut visits = vec![Visit { node: scene, children: document.children(scene), placed: world }];
        // The nodes that are being visited.
        let mut open = vec![false; document.count()];
        while let Some(Visit { node, children, placed }) = visits.last_mut() {
            let Some(child) = children.next() else {
                open[*node] = false;
                visits.pop();
                continue;
            };
            self.spend(NODE_BYTES)?;
            let inner = match document.tag(child) {
                Tag::Node => child,
                Tag::InstanceNode => self.ids.find(document, child, Attribute::Url, Tag::Node, "<node>")?,
                Tag::InstanceGeometry => {
                    let (node, placed) = (*node, *placed);
                    let geometry =
                        self.ids.find(document, child, Attribute::Url, Tag::Geometry, "<geometry>")?;
                    self.geometry(geometry, Some(node), &placed)?;
                    continue;
                }
                Tag::Unknown => return Err(document.unknown(child).into()),
                _ => continue,
            };
            if std::mem::replace(&mut open[inner], true) {
                return Err(document.fault(child, "nodes that form trees", "a node in itself").into());
            }
            let mut placed = *placed;
            for transform in document.children(inner).filter(|&child| document.tag(child).is_transform()) {
                self.spend(document.bytes(transform))?;
                placed = placed.then(&Transform::read(document, transform)?, &mut self.scales);
            }
            visits.push(Visit { node: inner, children: document.children(inner), placed });
        }
        Ok(())
    }

    /// Adds a geometry where a node places it: as an object, or as an instance of one.
    fn geometry(&mut self, geometry: Number, node: Option<Number>, placed: &Placement) -> Result<(), Halt> {
        let document = self.document;
        let name_of = |element| {
            let name = document.attribute(element, Attribute::Name).filter(|name| !name.is_empty());
            name.or_else(|| document.attribute(element, Attribute::Id))
        };
        let own = name_of(geometry).unwrap_or_default();
        let name = node.and_then(name_of).unwrap_or(own);
        // A name is a copy.
        self.spend(NODE_BYTES + name.len() as u64)?;
        match placed {
            Placement::Matrix(matrix) => {
                self.object(name, geometry, |point| frame::apply(matrix, point), frame::mirrors(matrix))?;
            }
            Placement::Frame(frame) => {
                let key = (geometry, frame.shape.map(|row| row.map(|value| (value + 0.0).to_bits())));
                let object = match self.variants.get(&key) {
                    Some(&object) => object,
                    None => self.object(own, geometry, |point| frame.shaped(point), frame.mirrors())?,
                };
                self.variants.insert(key, object);
                let (rotation, translation) = (frame.rotation, frame.translation);
                let instance =
                    Instance { name: name.to_owned(), rotation, translation, ..Instance::of_object(object) };
                self.found.instance(instance)?;
            }
        }
        Ok(())
    }

    /// Reads a geometry as an object whose vertices are moved by `place`, and returns its number.
    fn object(
        &mut self,
        name: &str,
        geometry: Number,
        place: impl Fn([f64; 3]) -> [f64; 3],
        is_mirrored: bool,
    ) -> Result<u32, Halt> {
        let document = self.document;
        self.spend(document.bytes(geometry))?;
        self.found.begin(name)?;
        self.objects += 1;
        for child in document.children(geometry) {
            match document.tag(child) {
                Tag::Mesh => MeshReader::read(document, child, &place, is_mirrored, self.found)?,
                Tag::Spline => self.found.leave_out(["spline", "splines"]),
                Tag::Unknown => return Err(document.unknown(child).into()),
                _ => {}
            }
        }
        Ok(self.objects - 1)
    }

    /// Counts what is about to be read against the limit. Each single geometry is in the file.
    fn spend(&mut self, bytes: u64) -> Result<(), Fault> {
        let most = MAX_COPIED_BYTES + self.document.length();
        self.bytes = self.bytes.saturating_add(bytes);
        if self.bytes > most {
            let what = "bytes of geometries, each counted where it is placed (as a scene they are shared)";
            return Err(Fault::Limit { place: Place::File, most, what });
        }
        Ok(())
    }
}
