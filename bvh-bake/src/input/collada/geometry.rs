//! Reads the vertices and the faces of a mesh. Nothing is kept but where the sources of a mesh begin: numbers go from the text to the
//! faces of the scene block by block.
//!
//! The ids of sources and of vertices are looked up in their own mesh, and the array of a source in that source, so that reading a mesh
//! takes a time proportional to its text.

use super::document::{Document, Ids};
use super::schema::{Attribute, Tag};
use crate::error::{Fault, Halt, Place, excerpt};
use crate::input::gather::SceneFaces;
use crate::input::gltf::Sink as _;
use crate::input::polygon::{Cutter, MAX_CORNERS};
use crate::input::text;
use crate::input::warnings::SHORT_FACES;
use crate::input::xml::Number;
use crate::limits::MAX_VERTICES;
use std::collections::HashMap;
use std::mem;

/// The number of vertices that are passed on at a time.
const BLOCK_VERTICES: usize = 1 << 14;
/// The number of corners of triangles that are passed on at a time.
const BLOCK_CORNERS: usize = 3 << 12;
/// The most numbers per vertex or corner.
const MAX_STRIDE: u64 = 1 << 10;

/// Consecutive vertices of the scene: the number of the first, and how many.
#[derive(Clone, Copy)]
struct Vertices {
    first: u64,
    count: u64,
}

/// Reads the faces of one mesh as the last object of a scene.
pub(super) struct MeshReader<'d, 'a, 's, 'r, P> {
    document: &'d Document<'a>,
    ids: Ids<'d>,
    place: P,
    /// Whether the mesh is turned inside out, so that faces have to be turned around.
    is_mirrored: bool,
    scene: &'s mut SceneFaces<'r>,
    /// The vertices of each source that has been read, and of each element `<vertices>`.
    sources: HashMap<Number, Vertices>,
    vertices: HashMap<Number, Vertices>,
    /// The number of the first vertex, and the positions of all if some polygon has holes.
    first: u64,
    positions: Option<Vec<[f64; 3]>>,
    cutter: Cutter,
    /// Triangles that have not been passed on.
    triangles: Vec<u32>,
}

impl<'d, 'a, 's, 'r, P: Fn([f64; 3]) -> [f64; 3]> MeshReader<'d, 'a, 's, 'r, P> {
    /// Reads a mesh whose vertices are moved by `place`.
    pub(super) fn read(
        document: &'d Document<'a>,
        mesh: Number,
        place: P,
        is_mirrored: bool,
        scene: &'s mut SceneFaces<'r>,
    ) -> Result<(), Halt> {
        let has_id = |&child: &Number| matches!(document.tag(child), Tag::Source | Tag::Vertices);
        let has_holes = |child: Number| document.children_of(child, Tag::Ph).next().is_some();
        let mut reader = Self {
            document,
            ids: Ids::of(document, document.children(mesh).filter(has_id)),
            place,
            is_mirrored,
            sources: HashMap::new(),
            vertices: HashMap::new(),
            first: scene.next_vertex(),
            positions: document.children(mesh).any(has_holes).then(Vec::new),
            scene,
            cutter: Cutter::default(),
            triangles: Vec::new(),
        };
        for child in document.children(mesh) {
            match document.tag(child) {
                tag if tag.has_faces() => reader.faces(child)?,
                Tag::Lines => reader.scene.leave_out(["list of lines", "lists of lines"]),
                Tag::Unknown => return Err(document.unknown(child).into()),
                _ => {}
            }
        }
        Ok(())
    }

    /// Reads an element of faces.
    fn faces(&mut self, element: Number) -> Result<(), Halt> {
        let document = self.document;
        let (mut input, mut stride) = (None, 1);
        for child in document.children(element) {
            match document.tag(child) {
                Tag::Input => {}
                Tag::Unknown => return Err(document.unknown(child).into()),
                _ => continue,
            }
            let offset = document.number(child, Attribute::Offset)?.unwrap_or(0);
            if offset >= MAX_STRIDE {
                let expected = format!("an offset below {MAX_STRIDE}");
                return Err(document.fault(child, expected, offset.to_string()).into());
            }
            stride = stride.max(offset as usize + 1);
            if document.attribute(child, Attribute::Semantic) == Some("VERTEX")
                && input.replace((child, offset as usize)).is_some()
            {
                return Err(document.fault(child, "one input VERTEX", "another one").into());
            }
        }
        let stated = document.number(element, Attribute::Count)?;
        if stated == Some(0) && document.children(element).all(|child| document.tag(child) == Tag::Input) {
            return Ok(());
        }
        let Some((input, at)) = input else {
            let expected = format!("an input VERTEX in {}", document.named(element));
            return Err(document.fault(element, expected, "none").into());
        };
        let columns = Columns { stride, at, vertices: self.vertices(input)? };
        let found = match document.tag(element) {
            Tag::Triangles => self.list(element, columns)?,
            Tag::Polylist => self.polylist(element, columns)?,
            _ => self.each_list(element, columns)?,
        };
        if let Some(stated) = stated.filter(|&stated| stated != found) {
            let expected =
                format!("as many faces or lists in {} as its count, {stated}", document.named(element));
            return Err(document.fault(element, expected, found.to_string()).into());
        }
        self.flush()
    }

    /// Reads triangles, and returns how many there are.
    fn list(&mut self, element: Number, columns: Columns) -> Result<u64, Halt> {
        let document = self.document;
        let mut count = 0;
        for list in document.children_of(element, Tag::P) {
            let mut corners = Corners::of(document, list, columns)?;
            while let Some(a) = corners.next()? {
                let (b, c) = (corners.next()?, corners.next()?);
                let (Some(b), Some(c)) = (b, c) else {
                    let found = if b.is_some() { "two more corners" } else { "one more corner" };
                    return Err(document
                        .fault(list, "a multiple of three corners in a list of triangles", found)
                        .into());
                };
                self.triangle([a, b, c])?;
                count += 1;
            }
        }
        Ok(count)
    }

    /// Reads polygons whose numbers of corners are in a list of their own, and returns how many there are.
    fn polylist(&mut self, element: Number, columns: Columns) -> Result<u64, Halt> {
        let document = self.document;
        let list = document.only_child(element, Tag::P)?;
        let mut corners = list.map(|list| Corners::of(document, list, columns)).transpose()?;
        let mut next = || corners.as_mut().map_or(Ok(None), Corners::next);
        let (mut polygon, mut count) = (Vec::new(), 0);
        if let Some(counts) = document.only_child(element, Tag::Vcount)? {
            for word in document.words(counts)? {
                let length: usize =
                    word.parse().map_err(|_| document.fault_at(word, "a number of corners"))?;
                if length > MAX_CORNERS {
                    return Err(document.too_many_corners(counts).into());
                }
                polygon.clear();
                while polygon.len() < length {
                    let end = || document.fault_at(word, format!("{length} more corners in <p>"));
                    polygon.push(next()?.ok_or_else(end)?);
                }
                self.polygon(&polygon)?;
                count += 1;
            }
        }
        match next()? {
            None => Ok(count),
            Some(_) => {
                Err(document.fault(element, "as many corners in <p> as <vcount> counts", "more").into())
            }
        }
    }

    /// Reads polygons, strips or fans, of which each has a list, and returns how many lists there are.
    fn each_list(&mut self, element: Number, columns: Columns) -> Result<u64, Halt> {
        let document = self.document;
        let (mut corners, mut count) = (Vec::new(), 0);
        for list in document.children(element) {
            match document.tag(list) {
                Tag::P => {}
                Tag::Ph => {
                    self.polygon_with_holes(list, columns)?;
                    count += 1;
                    continue;
                }
                _ => continue,
            }
            count += 1;
            match document.tag(element) {
                Tag::Polygons => {
                    corners.clear();
                    Corners::of(document, list, columns)?.append_to(&mut corners)?;
                    self.polygon(&corners)?;
                }
                Tag::Tristrips => self.strip(Corners::of(document, list, columns)?)?,
                _ => self.fan(Corners::of(document, list, columns)?)?,
            }
        }
        Ok(count)
    }

    /// Reads a strip. The triangles without area that join its parts are left out.
    fn strip<'w>(&mut self, mut corners: Corners<'_, '_, impl Iterator<Item = &'w str>>) -> Result<(), Halt> {
        let (Some(mut a), Some(mut b)) = (corners.next()?, corners.next()?) else { return Ok(()) };
        let mut is_turned = false;
        while let Some(c) = corners.next()? {
            if a != b && b != c && c != a {
                self.triangle(if is_turned { [b, a, c] } else { [a, b, c] })?;
            }
            (a, b, is_turned) = (b, c, !is_turned);
        }
        Ok(())
    }

    fn fan<'w>(&mut self, mut corners: Corners<'_, '_, impl Iterator<Item = &'w str>>) -> Result<(), Halt> {
        let (Some(a), Some(mut b)) = (corners.next()?, corners.next()?) else { return Ok(()) };
        while let Some(c) = corners.next()? {
            self.triangle([a, b, c])?;
            b = c;
        }
        Ok(())
    }

    /// Reads a polygon with holes, which is cut here.
    fn polygon_with_holes(&mut self, element: Number, columns: Columns) -> Result<(), Halt> {
        let document = self.document;
        let (mut corners, mut holes) = (Vec::new(), Vec::new());
        let outline = document.only_child(element, Tag::P)?;
        let outline = outline.ok_or_else(|| document.fault(element, "an outline, <p>, in <ph>", "none"))?;
        for ring in [outline].into_iter().chain(document.children(element)) {
            match document.tag(ring) {
                Tag::H => holes.push(corners.len() as u32),
                Tag::Unknown => return Err(document.unknown(ring).into()),
                _ if ring == outline && corners.is_empty() => {}
                _ => continue,
            }
            Corners::of(document, ring, columns)?.append_to(&mut corners)?;
        }
        let positions = self.positions.as_ref().expect("they are kept where a polygon has holes");
        let position = |&corner: &u32| positions[(u64::from(corner) - self.first) as usize];
        let positions: Vec<[f64; 3]> = corners.iter().map(position).collect();
        let mut cutter = mem::take(&mut self.cutter);
        let cut = cutter.cut_with_holes(&positions, &holes, |triangle| {
            self.triangle(triangle.map(|place| corners[place]))
        });
        self.cutter = cutter;
        cut
    }

    fn triangle(&mut self, [a, b, c]: [u32; 3]) -> Result<(), Halt> {
        self.triangles.extend(if self.is_mirrored { [a, c, b] } else { [a, b, c] });
        if self.triangles.len() < BLOCK_CORNERS { Ok(()) } else { self.flush() }
    }

    fn polygon(&mut self, corners: &[u32]) -> Result<(), Halt> {
        match *corners {
            [_, _, _, _, ..] => {}
            [a, b, c] => return self.triangle([a, b, c]),
            _ => {
                self.scene.leave_out(SHORT_FACES);
                return Ok(());
            }
        }
        self.flush()?;
        let mut corners = corners.to_vec();
        if self.is_mirrored {
            corners[1..].reverse();
        }
        self.scene.faces(corners.len(), &corners)
    }

    /// Passes on the triangles that wait.
    fn flush(&mut self) -> Result<(), Halt> {
        if self.triangles.is_empty() {
            return Ok(());
        }
        self.scene.faces(3, &self.triangles)?;
        self.triangles.clear();
        Ok(())
    }

    /// Returns the vertices that an input VERTEX names.
    fn vertices(&mut self, input: Number) -> Result<Vertices, Halt> {
        let document = self.document;
        let element =
            self.ids.find(document, input, Attribute::Source, Tag::Vertices, "<vertices> of this mesh")?;
        if let Some(&known) = self.vertices.get(&element) {
            return Ok(known);
        }
        let mut position = None;
        for child in document.children(element) {
            if document.tag(child) == Tag::Unknown {
                return Err(document.unknown(child).into());
            }
            if document.attribute(child, Attribute::Semantic) == Some("POSITION")
                && position.replace(child).is_some()
            {
                return Err(document.fault(child, "one input POSITION", "another one").into());
            }
        }
        let position =
            position.ok_or_else(|| document.fault(element, "an input POSITION in <vertices>", "none"))?;
        let source =
            self.ids.find(document, position, Attribute::Source, Tag::Source, "<source> of this mesh")?;
        let vertices = match self.sources.get(&source) {
            Some(&known) => known,
            None => self.positions(source)?,
        };
        self.sources.insert(source, vertices);
        self.vertices.insert(element, vertices);
        Ok(vertices)
    }

    /// Reads the positions of a source.
    fn positions(&mut self, source: Number) -> Result<Vertices, Halt> {
        let document = self.document;
        let accessor = Accessor::of(document, source)?;
        let first = self.scene.next_vertex();
        let (mut block, mut row, mut rows, mut values) = (Vec::new(), [0.0; 3], 0, 0);
        for word in document.words(accessor.array)? {
            let value = text::number(word.as_bytes()).ok_or_else(|| document.fault_at(word, "a number"))?;
            let place = u64::checked_sub(values, accessor.offset);
            values += 1;
            let Some(column) = place.map(|place| place % accessor.stride) else { continue };
            if let Some(axis) = accessor.columns.iter().position(|&known| known == column) {
                row[axis] = value;
            }
            if column == accessor.last_column && accessor.count.is_none_or(|count| rows < count) {
                rows += 1;
                block.push((self.place)(row));
                if block.len() == BLOCK_VERTICES {
                    self.add_vertices(&mut block)?;
                }
            }
        }
        self.add_vertices(&mut block)?;
        let stated = document.number(accessor.array, Attribute::Count)?;
        if let Some(stated) = stated.filter(|&stated| stated != values) {
            let expected =
                format!("as many numbers in {} as its count, {stated}", document.named(accessor.array));
            return Err(document.fault(accessor.array, expected, values.to_string()).into());
        }
        if let Some(count) = accessor.count.filter(|&count| count != rows) {
            let expected = format!("{count} vertices in <source>, which is the count of its <accessor>");
            return Err(document.fault(accessor.array, expected, rows.to_string()).into());
        }
        Ok(Vertices { first, count: rows })
    }

    fn add_vertices(&mut self, block: &mut Vec<[f64; 3]>) -> Result<(), Halt> {
        self.scene.vertices(block)?;
        if let Some(positions) = &mut self.positions {
            positions.extend_from_slice(block);
        }
        block.clear();
        if self.scene.next_vertex() > MAX_VERTICES {
            return Err(Fault::Limit { place: Place::File, most: MAX_VERTICES, what: "vertices" }.into());
        }
        Ok(())
    }
}

/// Where the positions of a source are in its array.
struct Accessor {
    array: Number,
    /// The number of vertices, if it is stated.
    count: Option<u64>,
    offset: u64,
    stride: u64,
    /// The columns of x, y and z, and the last of these.
    columns: [u64; 3],
    last_column: u64,
}

impl Accessor {
    fn of(document: &Document, source: Number) -> Result<Self, Fault> {
        let within = |parent: Number, tag: Tag, expected: &'static str| {
            let child = document.only_child(parent, tag)?;
            child.ok_or_else(|| {
                let other = document.children(parent).find(|&child| document.tag(child) == Tag::Unknown);
                document.fault(
                    parent,
                    expected,
                    other.map_or("none".to_owned(), |other| document.named(other)),
                )
            })
        };
        let array = within(source, Tag::FloatArray, "a <float_array> in the <source> of positions")?;
        let technique = within(source, Tag::TechniqueCommon, "a <technique_common> in <source>")?;
        let accessor = within(technique, Tag::Accessor, "an <accessor> in <technique_common>")?;
        let url = document.attribute(accessor, Attribute::Source).unwrap_or_default();
        if url.strip_prefix('#').is_none_or(|id| document.attribute(array, Attribute::Id) != Some(id)) {
            let expected = "the id of the <float_array> in this <source>, as #id";
            return Err(document.fault(
                accessor,
                expected,
                format!("source=\"{}\"", excerpt(url.as_bytes())),
            ));
        }
        let columns = columns(document, accessor)?;
        let last_column = columns.into_iter().fold(0, u64::max);
        let params = document.children_of(accessor, Tag::Param).count() as u64;
        let least = params.max(last_column + 1);
        let stride = document.number(accessor, Attribute::Stride)?.unwrap_or(least);
        if stride < least {
            let expected = format!("a stride of at least {least}");
            return Err(document.fault(accessor, expected, stride.to_string()));
        }
        let offset = document.number(accessor, Attribute::Offset)?.unwrap_or(0);
        let count = document.number(accessor, Attribute::Count)?;
        Ok(Self { array, count, offset, stride, columns, last_column })
    }
}

/// Returns the columns that are named X, Y and Z. Columns without a name are skipped, and without any they are x, y and z.
fn columns(document: &Document, accessor: Number) -> Result<[u64; 3], Fault> {
    let mut columns = [None; 3];
    let mut count = 0;
    for (column, param) in document.children(accessor).enumerate() {
        if document.tag(param) == Tag::Unknown {
            return Err(document.unknown(param));
        }
        count += 1;
        let name = document.attribute(param, Attribute::Name).unwrap_or_default();
        let Some(axis) = ["x", "y", "z"].iter().position(|axis| name.eq_ignore_ascii_case(axis)) else {
            continue;
        };
        let kind = document.attribute(param, Attribute::Type).unwrap_or("float");
        if !["float", "double"].contains(&kind) {
            let found = excerpt(kind.as_bytes());
            return Err(document.fault(param, "a <param> of the type float", found));
        }
        if columns[axis].replace(column as u64).is_some() {
            return Err(document.fault(
                param,
                format!("one <param> named {}", excerpt(name.as_bytes())),
                "another one",
            ));
        }
    }
    match columns {
        [Some(x), Some(y), Some(z)] => Ok([x, y, z]),
        _ if count == 0 => Ok([0, 1, 2]),
        _ => {
            let names = document
                .children(accessor)
                .map(|param| document.attribute(param, Attribute::Name).unwrap_or("?"));
            let names = names.collect::<Vec<_>>().join(" ");
            Err(document.fault(
                accessor,
                "each <param> of positions named: X, Y and Z",
                excerpt(names.as_bytes()),
            ))
        }
    }
}

/// The numbers per corner of a list, which of them is that of the vertex, and the vertices.
#[derive(Clone, Copy)]
struct Columns {
    stride: usize,
    at: usize,
    vertices: Vertices,
}

/// The corners of a list, as numbers of vertices of the scene.
struct Corners<'d, 'a, W> {
    document: &'d Document<'a>,
    list: Number,
    columns: Columns,
    words: W,
}

impl<'d, 'a> Corners<'d, 'a, ()> {
    fn of(
        document: &'d Document<'a>,
        list: Number,
        columns: Columns,
    ) -> Result<Corners<'d, 'a, impl Iterator<Item = &'a str> + use<'d, 'a>>, Fault> {
        Ok(Corners { document, list, columns, words: document.words(list)? })
    }
}

impl<'w, W: Iterator<Item = &'w str>> Corners<'_, '_, W> {
    fn next(&mut self) -> Result<Option<u32>, Fault> {
        let Columns { stride, at, vertices } = self.columns;
        let mut corner = 0;
        for column in 0..stride {
            match self.words.next() {
                Some(word) if column == at => {
                    let number = word.parse().ok().filter(|&number: &u64| number < vertices.count);
                    let expected = || format!("a vertex number below {}", vertices.count);
                    corner = number.ok_or_else(|| self.document.fault_at(word, expected()))?;
                }
                Some(_) => {}
                None if column == 0 => return Ok(None),
                None => {
                    let expected = format!("a multiple of {stride} numbers, which each corner has");
                    return Err(self.document.fault(self.list, expected, format!("{column} more")));
                }
            }
        }
        Ok(Some((vertices.first + corner) as u32))
    }

    /// Adds all corners to those of a polygon.
    fn append_to(mut self, polygon: &mut Vec<u32>) -> Result<(), Fault> {
        while let Some(corner) = self.next()? {
            polygon.push(corner);
            if polygon.len() > MAX_CORNERS {
                return Err(self.document.too_many_corners(self.list));
            }
        }
        Ok(())
    }
}
