//! The elements of a COLLADA file from which triangles come (COLLADA 1.4.1 and 1.5 specifications, chapter 5). All others, such as
//! materials, animations and `<extra>`, are skipped with what is in them.

use crate::input::xml::Schema;

/// The schema.
pub(super) struct Collada;

impl Schema for Collada {
    type Tag = Tag;
    type Attribute = Attribute;

    const ROOT: &'static str = "COLLADA";

    fn root() -> Tag {
        Tag::Collada
    }

    fn tag(parent: Tag, name: &str) -> Option<Tag> {
        Tag::of(parent, name)
    }

    fn attribute(name: &str) -> Option<Attribute> {
        Attribute::of(name)
    }

    fn has_text(tag: Tag) -> bool {
        tag.has_text()
    }
}

/// An element.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub(super) enum Tag {
    Collada,
    Asset,
    Unit,
    UpAxis,
    LibraryGeometries,
    LibraryNodes,
    LibraryVisualScenes,
    Scene,
    InstanceVisualScene,
    Geometry,
    Mesh,
    Spline,
    Source,
    FloatArray,
    TechniqueCommon,
    Accessor,
    Param,
    Vertices,
    Input,
    Triangles,
    Tristrips,
    Trifans,
    Polylist,
    Polygons,
    Lines,
    P,
    Ph,
    H,
    Vcount,
    VisualScene,
    Node,
    Matrix,
    Lookat,
    Rotate,
    Scale,
    Skew,
    Translate,
    InstanceNode,
    InstanceGeometry,
    /// An element that changes triangles in a way that this reader does not know. It is refused where it is needed.
    Unknown,
}

impl Tag {
    /// Returns the element of a name in a parent, or `None` if it has no triangles.
    pub(super) fn of(parent: Self, name: &str) -> Option<Self> {
        let tag = match (parent, name) {
            (_, "extra") => return None,
            (Self::Collada, "asset") => Self::Asset,
            (Self::Collada, "library_geometries") => Self::LibraryGeometries,
            (Self::Collada, "library_nodes") => Self::LibraryNodes,
            (Self::Collada, "library_visual_scenes") => Self::LibraryVisualScenes,
            (Self::Collada, "scene") => Self::Scene,
            (Self::Asset, "unit") => Self::Unit,
            (Self::Asset, "up_axis") => Self::UpAxis,
            (Self::Scene, "instance_visual_scene") => Self::InstanceVisualScene,
            (Self::Collada | Self::Asset | Self::Scene, _) => return None,

            (
                Self::LibraryGeometries
                | Self::LibraryNodes
                | Self::LibraryVisualScenes
                | Self::Geometry
                | Self::VisualScene
                | Self::Node,
                "asset",
            ) => Self::Asset,
            (Self::LibraryGeometries, "geometry") => Self::Geometry,
            (Self::LibraryNodes | Self::VisualScene | Self::Node, "node") => Self::Node,
            (Self::LibraryVisualScenes, "visual_scene") => Self::VisualScene,
            (Self::LibraryGeometries | Self::LibraryNodes | Self::LibraryVisualScenes, _) => return None,

            (Self::Geometry, "mesh") => Self::Mesh,
            (Self::Geometry, "spline") => Self::Spline,
            (Self::Mesh, "source") => Self::Source,
            (Self::Mesh, "vertices") => Self::Vertices,
            (Self::Mesh, "triangles") => Self::Triangles,
            (Self::Mesh, "tristrips") => Self::Tristrips,
            (Self::Mesh, "trifans") => Self::Trifans,
            (Self::Mesh, "polylist") => Self::Polylist,
            (Self::Mesh, "polygons") => Self::Polygons,
            (Self::Mesh, "lines" | "linestrips") => Self::Lines,
            (Self::Source, "float_array") => Self::FloatArray,
            (Self::Source, "technique_common") => Self::TechniqueCommon,
            (Self::Source, "asset" | "technique") => return None,
            (Self::TechniqueCommon, "accessor") => Self::Accessor,
            (Self::Accessor, "param") => Self::Param,
            (Self::Vertices, "input") => Self::Input,
            (parent, "input") if parent.has_faces() => Self::Input,
            (parent, "p") if parent.has_faces() => Self::P,
            (Self::Polylist, "vcount") => Self::Vcount,
            (Self::Polygons, "ph") => Self::Ph,
            (Self::Ph, "p") => Self::P,
            (Self::Ph, "h") => Self::H,

            (Self::VisualScene, "evaluate_scene") => return None,
            (Self::Node, "instance_camera" | "instance_light") => return None,
            (Self::Node, "matrix") => Self::Matrix,
            (Self::Node, "lookat") => Self::Lookat,
            (Self::Node, "rotate") => Self::Rotate,
            (Self::Node, "scale") => Self::Scale,
            (Self::Node, "skew") => Self::Skew,
            (Self::Node, "translate") => Self::Translate,
            (Self::Node, "instance_node") => Self::InstanceNode,
            (Self::Node, "instance_geometry") => Self::InstanceGeometry,

            (parent, _) if parent.has_content() => Self::Unknown,
            _ => return None,
        };
        Some(tag)
    }

    /// Returns whether an element holds faces.
    pub(super) fn has_faces(self) -> bool {
        matches!(self, Self::Triangles | Self::Tristrips | Self::Trifans | Self::Polylist | Self::Polygons)
    }

    /// Returns whether an element is a transform of a node.
    pub(super) fn is_transform(self) -> bool {
        matches!(
            self,
            Self::Matrix | Self::Lookat | Self::Rotate | Self::Scale | Self::Skew | Self::Translate
        )
    }

    /// Returns whether an element has text that is read.
    pub(super) fn has_text(self) -> bool {
        self.is_transform()
            || matches!(self, Self::UpAxis | Self::FloatArray | Self::P | Self::H | Self::Vcount)
    }

    /// Returns whether an element that is not known may change the triangles of this one.
    fn has_content(self) -> bool {
        self.has_faces()
            || self.has_text()
            || matches!(
                self,
                Self::Geometry
                    | Self::Mesh
                    | Self::Source
                    | Self::TechniqueCommon
                    | Self::Accessor
                    | Self::Vertices
                    | Self::Ph
                    | Self::VisualScene
                    | Self::Node
            )
    }
}

/// An attribute.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Attribute {
    Count,
    Id,
    Meter,
    Name,
    Offset,
    Semantic,
    Source,
    Stride,
    Type,
    Url,
}

impl Attribute {
    /// Returns the attribute of a name, or `None` if no triangle depends on it.
    pub(super) fn of(name: &str) -> Option<Self> {
        Some(match name {
            "count" => Self::Count,
            "id" => Self::Id,
            "meter" => Self::Meter,
            "name" => Self::Name,
            "offset" => Self::Offset,
            "semantic" => Self::Semantic,
            "source" => Self::Source,
            "stride" => Self::Stride,
            "type" => Self::Type,
            "url" => Self::Url,
            _ => return None,
        })
    }

    /// Returns the name.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Count => "count",
            Self::Id => "id",
            Self::Meter => "meter",
            Self::Name => "name",
            Self::Offset => "offset",
            Self::Semantic => "semantic",
            Self::Source => "source",
            Self::Stride => "stride",
            Self::Type => "type",
            Self::Url => "url",
        }
    }
}
