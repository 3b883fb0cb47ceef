//! The elements of URDF and SRDF files that are read. All others, such as materials, transmissions and extensions of simulators,
//! are passed over with what is in them.

use bvh_bake::input::xml;

/// The schema of both.
pub(crate) struct Schema;

/// An element.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Tag {
    Robot,
    Link,
    Joint,
    Parent,
    Child,
    Origin,
    Axis,
    Limit,
    Mimic,
    Collision,
    Visual,
    Geometry,
    Mesh,
    Block,
    Ball,
    Cylinder,
    Capsule,
    /// A shape that is not known. It is refused.
    OtherShape,
    Group,
    Chain,
    GroupState,
    DisableCollisions,
    EnableCollisions,
    DisableDefaultCollisions,
    /// An element of xacro that defines something, and makes nothing by itself.
    MacroDefinition,
    /// An element of xacro in place of which others were meant.
    Macro,
}

impl xml::Schema for Schema {
    type Tag = Tag;
    type Attribute = Attribute;

    const ROOT: &'static str = "robot";

    fn root() -> Tag {
        Tag::Robot
    }

    fn tag(parent: Tag, name: &str) -> Option<Tag> {
        Some(match (parent, name) {
            (Tag::Robot | Tag::Group, "link") => Tag::Link,
            (Tag::Robot | Tag::Group | Tag::GroupState, "joint") => Tag::Joint,
            (Tag::Robot | Tag::Group, "group") => Tag::Group,
            (Tag::Group, "chain") => Tag::Chain,
            (Tag::Robot, "group_state") => Tag::GroupState,
            (Tag::Robot, "disable_collisions") => Tag::DisableCollisions,
            (Tag::Robot, "enable_collisions") => Tag::EnableCollisions,
            (Tag::Robot, "disable_default_collisions") => Tag::DisableDefaultCollisions,
            (Tag::Joint, "parent") => Tag::Parent,
            (Tag::Joint, "child") => Tag::Child,
            (Tag::Joint, "axis") => Tag::Axis,
            (Tag::Joint, "limit") => Tag::Limit,
            (Tag::Joint, "mimic") => Tag::Mimic,
            (Tag::Link, "collision") => Tag::Collision,
            (Tag::Link, "visual") => Tag::Visual,
            (Tag::Joint | Tag::Collision | Tag::Visual, "origin") => Tag::Origin,
            (Tag::Collision | Tag::Visual, "geometry") => Tag::Geometry,
            (Tag::Geometry, "mesh") => Tag::Mesh,
            (Tag::Geometry, "box") => Tag::Block,
            (Tag::Geometry, "sphere") => Tag::Ball,
            (Tag::Geometry, "cylinder") => Tag::Cylinder,
            (Tag::Geometry, "capsule") => Tag::Capsule,
            (Tag::Geometry, _) => Tag::OtherShape,
            _ => return None,
        })
    }

    fn foreign(parent: Tag, name: &str) -> Option<Tag> {
        // xacro goes by the prefix, whatever it stands for.
        match (name.strip_prefix("xacro:"), parent) {
            (Some("property" | "arg" | "macro"), _) => Some(Tag::MacroDefinition),
            // A definition may hold anything.
            (_, Tag::MacroDefinition | Tag::Macro) => None,
            (Some(_), _) => Some(Tag::Macro),
            (None, Tag::Geometry) => Some(Tag::OtherShape),
            (None, _) => None,
        }
    }

    fn attribute(name: &str) -> Option<Attribute> {
        Attribute::ALL.into_iter().find(|attribute| attribute.name() == name)
    }
}

/// Declares the attributes with their names.
macro_rules! attributes {
    ($($attribute:ident $name:literal,)*) => {
        /// An attribute.
        #[derive(Clone, Copy, PartialEq, Eq, Debug)]
        pub(crate) enum Attribute {
            $($attribute,)*
        }

        impl Attribute {
            const ALL: [Self; [$($name),*].len()] = [$(Self::$attribute),*];

            /// Returns the name.
            pub(crate) fn name(self) -> &'static str {
                match self {
                    $(Self::$attribute => $name,)*
                }
            }
        }
    };
}

attributes! {
    Name "name",
    Type "type",
    Link "link",
    Xyz "xyz",
    Rpy "rpy",
    Lower "lower",
    Upper "upper",
    Joint "joint",
    Multiplier "multiplier",
    Offset "offset",
    Filename "filename",
    Scale "scale",
    Size "size",
    Radius "radius",
    Length "length",
    Link1 "link1",
    Link2 "link2",
    BaseLink "base_link",
    TipLink "tip_link",
    Value "value",
    Group "group",
}
