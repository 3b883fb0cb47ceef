//! Reads the triangles of COLLADA files, in metres, where the nodes of the scene place them.
//!
//! The axis that points up does not matter, as in ROS. Skins, lines and materials are passed over. Polygons become fans.

use crate::frame::Point;
use bvh_bake::input::mesh::Mesh;
use roxmltree::{Document, Node};
use std::collections::HashMap;

/// The rows of an affine map.
type Affine = [[f64; 4]; 3];

const IDENTITY: Affine = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]];

/// Nodes that are deeper are in a circle.
const MAX_DEPTH: usize = 64;
/// The most inputs of a corner: a position, a normal, some colours and textures.
const MAX_INPUTS: usize = 1024;
/// Nodes may name nodes and meshes again and again, so that a small file could have any number of triangles: what is read counts each
/// time, by nodes and by numbers.
const MAX_READ: usize = 1 << 27;
/// What a node counts: it is more work than a number, and a file has few.
const STEPS_PER_NODE: usize = 1 << 10;

/// Reads a file, or says what is wrong with it.
pub(crate) fn read(text: &str) -> Result<Mesh, String> {
    let document = Document::parse(text).map_err(|error| error.to_string())?;
    let of_id: HashMap<&str, Node<'_, '_>> =
        document.descendants().filter_map(|node| Some((node.attribute("id")?, node))).collect();
    let mut reader = Reader { of_id, positions: Vec::new(), triangles: Vec::new(), read: 0 };
    let root = document.root_element();
    let unit = root.descendants().find(|node| node.has_tag_name("unit"));
    let metres = unit.and_then(|unit| unit.attribute("meter")).map_or(Ok(1.0), number)?;
    if !(metres > 0.0 && metres.is_finite()) {
        return Err(format!("a unit of {metres} metres"));
    }
    let scale = IDENTITY.map(|row| row.map(|x| x * metres));
    match root.descendants().find(|node| node.has_tag_name("instance_visual_scene")) {
        Some(scene) => reader.nodes(reader.named(scene, "url")?, &scale, 0)?,
        None => {
            for geometry in root.descendants().filter(|node| node.has_tag_name("geometry")) {
                reader.geometry(geometry, &scale)?;
            }
        }
    }
    Ok(Mesh::from_triangles(reader.positions, reader.triangles))
}

struct Reader<'a, 'n> {
    of_id: HashMap<&'n str, Node<'n, 'a>>,
    positions: Vec<Point>,
    triangles: Vec<[u32; 3]>,
    read: usize,
}

impl<'a, 'n> Reader<'a, 'n> {
    /// Returns the element that an attribute names.
    fn named(&self, node: Node<'n, 'a>, attribute: &str) -> Result<Node<'n, 'a>, String> {
        let url = node.attribute(attribute).unwrap_or_default();
        let found = self.of_id.get(url.trim_start_matches('#')).copied();
        found.ok_or_else(|| format!("<{}> of '{url}', which is not there", node.tag_name().name()))
    }

    /// Counts what is read.
    fn count(&mut self, of: usize) -> Result<(), String> {
        self.read = self.read.saturating_add(of);
        if self.read > MAX_READ { Err(format!("more than {MAX_READ} nodes and numbers")) } else { Ok(()) }
    }

    /// Reads all that is in a node or in a scene.
    fn nodes(&mut self, node: Node<'n, 'a>, outer: &Affine, depth: usize) -> Result<(), String> {
        if depth > MAX_DEPTH {
            return Err("nodes in a circle".to_owned());
        }
        self.count(STEPS_PER_NODE)?;
        let mut here = *outer;
        for child in node.children().filter(Node::is_element) {
            match child.tag_name().name() {
                "matrix" => {
                    let m: [f64; 16] = numbers(child)?;
                    here =
                        product(&here, &[0, 1, 2].map(|row| [0, 1, 2, 3].map(|column| m[4 * row + column])));
                }
                "translate" => {
                    let [x, y, z] = numbers(child)?;
                    here = product(&here, &[[1.0, 0.0, 0.0, x], [0.0, 1.0, 0.0, y], [0.0, 0.0, 1.0, z]]);
                }
                "scale" => {
                    let [x, y, z] = numbers(child)?;
                    here = product(&here, &[[x, 0.0, 0.0, 0.0], [0.0, y, 0.0, 0.0], [0.0, 0.0, z, 0.0]]);
                }
                "rotate" => here = product(&here, &rotation(numbers(child)?)),
                "node" => self.nodes(child, &here, depth + 1)?,
                "instance_node" => self.nodes(self.named(child, "url")?, &here, depth + 1)?,
                "instance_geometry" => self.geometry(self.named(child, "url")?, &here)?,
                _ => {}
            }
        }
        Ok(())
    }

    /// Reads the triangles of a geometry.
    fn geometry(&mut self, geometry: Node<'n, 'a>, place: &Affine) -> Result<(), String> {
        self.count(STEPS_PER_NODE)?;
        let Some(mesh) = geometry.children().find(|node| node.has_tag_name("mesh")) else { return Ok(()) };
        let is_mirrored = determinant(place) < 0.0;
        // Primitives of a mesh mostly share their vertices.
        let mut vertices: HashMap<&str, (u32, usize)> = HashMap::new();
        for primitive in mesh.children().filter(Node::is_element) {
            let kind = primitive.tag_name().name();
            if !matches!(kind, "triangles" | "polylist" | "polygons" | "trifans" | "tristrips") {
                continue;
            }
            let inputs = || primitive.children().filter(|node| node.has_tag_name("input"));
            let offset = |input: Node<'_, '_>| match input.attribute("offset").map_or(Ok(0), index)? {
                offset if offset < MAX_INPUTS => Ok(offset),
                offset => Err(format!("an input at offset {offset}")),
            };
            let Some(input) = inputs().find(|input| input.attribute("semantic") == Some("VERTEX")) else {
                return Err(format!("<{kind}> without vertices"));
            };
            let (at, mut stride) = (offset(input)?, 1);
            for input in inputs() {
                stride = stride.max(offset(input)? + 1);
            }
            let source = input.attribute("source").unwrap_or_default();
            let (first, count) = match vertices.get(source) {
                Some(&known) => known,
                None => {
                    let known = self.vertices(input, place)?;
                    vertices.insert(source, known);
                    known
                }
            };
            let counts = primitive.children().find(|node| node.has_tag_name("vcount"));
            for list in primitive.children().filter(|node| node.has_tag_name("p")) {
                let all: Result<Vec<usize>, String> =
                    list.text().unwrap_or_default().split_whitespace().map(index).collect();
                let all = all?;
                self.count(all.len())?;
                let corner = |corner: &[usize]| match corner[at] {
                    place if place < count => Ok(first + place as u32),
                    place => Err(format!("vertex {place} of {count}")),
                };
                let corners: Result<Vec<u32>, String> = all.chunks_exact(stride).map(corner).collect();
                let corners = corners?;
                match kind {
                    "triangles" => self.add(corners.as_chunks::<3>().0.iter().copied(), is_mirrored),
                    "tristrips" => {
                        let strip = corners.windows(3).enumerate();
                        let turned = strip.map(|(number, of)| {
                            if number % 2 == 0 { [of[0], of[1], of[2]] } else { [of[1], of[0], of[2]] }
                        });
                        self.add(turned, is_mirrored);
                    }
                    "polylist" => {
                        let counts = counts.and_then(|counts| counts.text()).unwrap_or_default();
                        // Two bytes at least for each.
                        self.count(counts.len() / 2)?;
                        let mut rest = corners.as_slice();
                        for count in counts.split_whitespace() {
                            let count = index(count)?;
                            if count > rest.len() {
                                return Err("a polygon beyond the end of its list".to_owned());
                            }
                            let (polygon, others) = rest.split_at(count);
                            self.add(fan(polygon), is_mirrored);
                            rest = others;
                        }
                    }
                    _ => self.add(fan(&corners), is_mirrored),
                }
            }
        }
        Ok(())
    }

    fn add(&mut self, triangles: impl Iterator<Item = [u32; 3]>, is_mirrored: bool) {
        self.triangles.extend(triangles.map(|[a, b, c]| if is_mirrored { [a, c, b] } else { [a, b, c] }));
    }

    /// Adds the vertices that an input names, and returns the first of them and their number.
    fn vertices(&mut self, input: Node<'n, 'a>, place: &Affine) -> Result<(u32, usize), String> {
        let vertices = self.named(input, "source")?;
        let position = vertices
            .children()
            .find(|node| node.has_tag_name("input") && node.attribute("semantic") == Some("POSITION"))
            .ok_or("vertices without positions")?;
        let source = self.named(position, "source")?;
        let find = |name: &str| source.descendants().find(|node| node.has_tag_name(name));
        let values = find("float_array").and_then(|node| node.text()).unwrap_or_default();
        let values: Result<Vec<f64>, String> = values.split_whitespace().map(number).collect();
        let accessor = find("accessor");
        let of = |name: &str, without: usize| {
            accessor.and_then(|node| node.attribute(name)).map_or(Ok(without), index)
        };
        let (stride, offset) = (of("stride", 3)?.max(3), of("offset", 0)?);
        let first = self.positions.len();
        let values = values?;
        self.count(values.len())?;
        let rows = values.get(offset..).unwrap_or_default().chunks(stride).filter(|row| row.len() >= 3);
        self.positions
            .extend(rows.map(|row| place.map(|of| of[0] * row[0] + of[1] * row[1] + of[2] * row[2] + of[3])));
        Ok((first as u32, self.positions.len() - first))
    }
}

/// Divides a polygon into triangles about its first corner.
fn fan(polygon: &[u32]) -> impl Iterator<Item = [u32; 3]> {
    polygon.windows(2).skip(1).map(|edge| [polygon[0], edge[0], edge[1]])
}

fn product(a: &Affine, b: &Affine) -> Affine {
    a.map(|row| {
        [0, 1, 2, 3].map(|column| {
            let sum: f64 = (0..3).map(|k| row[k] * b[k][column]).sum();
            if column == 3 { sum + row[3] } else { sum }
        })
    })
}

fn determinant(of: &Affine) -> f64 {
    let [a, b, c] = of;
    a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0])
        + a[2] * (b[0] * c[1] - b[1] * c[0])
}

/// Returns the turn about an axis by an angle in degrees.
fn rotation([x, y, z, degrees]: [f64; 4]) -> Affine {
    let long = (x * x + y * y + z * z).sqrt();
    if long == 0.0 {
        return IDENTITY;
    }
    let (sin, cos) = libm::sincos(degrees.to_radians());
    let [x, y, z] = [x, y, z].map(|part| part / long);
    let versine = 1.0 - cos;
    [
        [cos + versine * x * x, versine * x * y - sin * z, versine * x * z + sin * y, 0.0],
        [versine * x * y + sin * z, cos + versine * y * y, versine * y * z - sin * x, 0.0],
        [versine * x * z - sin * y, versine * y * z + sin * x, cos + versine * z * z, 0.0],
    ]
}

fn number(text: &str) -> Result<f64, String> {
    text.trim().parse().map_err(|_| format!("'{text}' in place of a number"))
}

fn index(text: &str) -> Result<usize, String> {
    text.trim().parse().map_err(|_| format!("'{text}' in place of a whole number"))
}

/// Returns the numbers of an element.
fn numbers<const N: usize>(node: Node<'_, '_>) -> Result<[f64; N], String> {
    let all: Result<Vec<f64>, String> =
        node.text().unwrap_or_default().split_whitespace().map(number).collect();
    let all = all?;
    let found = all.len();
    all.try_into().map_err(|_| format!("<{}> of {found} numbers in place of {N}", node.tag_name().name()))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A square in centimetres, as a polygon, a list, triangles, a fan and a strip, moved, turned and mirrored.
    fn square(primitive: &str, nodes: &str) -> Result<Mesh, String> {
        read(&format!(
            "<COLLADA><asset><unit meter=\"0.01\"/></asset><library_geometries><geometry id=\"g\"><mesh>\
             <source id=\"s\"><float_array>0 0 0 100 0 0 100 100 0 0 100 0</float_array></source>\
             <vertices id=\"v\"><input semantic=\"POSITION\" source=\"#s\"/></vertices>{primitive}</mesh></geometry>\
             </library_geometries><library_visual_scenes><visual_scene id=\"w\">{nodes}</visual_scene>\
             </library_visual_scenes><scene><instance_visual_scene url=\"#w\"/></scene></COLLADA>"
        ))
    }

    const INPUT: &str =
        "<input semantic=\"VERTEX\" source=\"#v\" offset=\"1\"/><input semantic=\"NORMAL\" offset=\"0\"/>";
    const HERE: &str = "<node><instance_geometry url=\"#g\"/></node>";

    #[test]
    fn each_primitive_is_the_same_square() {
        let all = "9 0 9 1 9 2 9 3";
        for (kind, lists, expected) in [
            ("triangles", "<p>9 0 9 1 9 2 9 0 9 2 9 3</p>".to_owned(), [[0, 1, 2], [0, 2, 3]]),
            ("polylist", format!("<vcount>4</vcount><p>{all}</p>"), [[0, 1, 2], [0, 2, 3]]),
            ("polygons", format!("<p>{all}</p>"), [[0, 1, 2], [0, 2, 3]]),
            ("trifans", format!("<p>{all}</p>"), [[0, 1, 2], [0, 2, 3]]),
            ("tristrips", "<p>9 0 9 1 9 3 9 2</p>".to_owned(), [[0, 1, 3], [3, 1, 2]]),
        ] {
            let mesh = square(&format!("<{kind}>{INPUT}{lists}</{kind}>"), HERE).unwrap();
            assert_eq!(mesh.objects[0].triangles, expected, "{kind}");
            let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
            assert_eq!(mesh.objects[0].positions, corners, "{kind}");
        }
    }

    #[test]
    fn nodes_place_what_is_in_them() {
        let polygon = format!("<polygons>{INPUT}<p>9 0 9 1 9 2 9 3</p></polygons>");
        let place = |transform: &str| {
            let mesh = square(&polygon, &format!("<node><translate>0 0 100</translate>{HERE}</node><node>{transform}<node><instance_geometry url=\"#g\"/></node></node>")).unwrap();
            let object = &mesh.objects[0];
            assert_eq!(object.positions[1], [1.0, 0.0, 1.0]);
            (object.positions[5].map(|x| (x * 1e6).round() / 1e6), object.triangles[2])
        };
        assert_eq!(
            place("<translate>100 0 0</translate><rotate>0 0 2 90</rotate>"),
            ([1.0, 1.0, 0.0], [4, 5, 6])
        );
        assert_eq!(
            place("<rotate>0 0 2 90</rotate><translate>100 0 0</translate>"),
            ([0.0, 2.0, 0.0], [4, 5, 6])
        );
        assert_eq!(place("<scale>-2 1 1</scale>"), ([-2.0, 0.0, 0.0], [4, 6, 5]));
        let matrix = "<matrix>0 -1 0 50 1 0 0 0 0 0 1 0 0 0 0 1</matrix>";
        assert_eq!(place(matrix), ([0.5, 1.0, 0.0], [4, 5, 6]));
    }

    #[test]
    fn mistakes_are_named() {
        let polygon = |p: &str| format!("<polygons>{INPUT}<p>{p}</p></polygons>");
        let twice = |number: usize| {
            let next = format!("<instance_node url=\"#n{}\"/>", number + 1);
            format!("<node id=\"n{number}\">{next}{next}</node>")
        };
        let again: String = (0..40).map(twice).collect::<String>() + "<node id=\"n40\"/>";
        let far = format!(
            "<polygons><input semantic=\"VERTEX\" source=\"#v\" offset=\"{}\"/><p>0</p></polygons>",
            usize::MAX
        );
        let at_offset = format!("an input at offset {}", usize::MAX);
        for (primitive, nodes, expected) in [
            (far, HERE, &*at_offset),
            (polygon("0 0 0 1 0 4"), HERE, "vertex 4 of 4"),
            (polygon("0 0 0 x 0 1"), HERE, "'x' in place of a whole number"),
            (
                polygon("0 0 0 1 0 2"),
                "<node><instance_geometry url=\"#h\"/></node>",
                "'#h', which is not there",
            ),
            (polygon("0 0 0 1 0 2"), &again, "nodes and numbers"),
            (
                polygon("0 0 0 1 0 2"),
                "<node id=\"n\"><instance_node url=\"#n\"/></node>",
                "nodes in a circle",
            ),
            (
                polygon("0 0 0 1 0 2"),
                "<node><matrix>1 2</matrix></node>",
                "<matrix> of 2 numbers in place of 16",
            ),
            (
                "<polylist><vcount>5</vcount><p>0</p></polylist>".to_owned(),
                HERE,
                "<polylist> without vertices",
            ),
            (
                format!("<polylist>{INPUT}<vcount>5</vcount><p>0 0</p></polylist>"),
                HERE,
                "beyond the end of its list",
            ),
        ] {
            let message = square(&primitive, nodes).unwrap_err();
            assert!(message.contains(expected), "{message}");
        }
        assert!(
            read("<COLLADA><asset><unit meter=\"0\"/></asset></COLLADA>").unwrap_err().contains("unit of 0")
        );
    }
}
