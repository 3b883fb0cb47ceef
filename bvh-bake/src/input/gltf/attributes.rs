//! Reads the attributes of a primitive, of a morph target or of instances: which accessor has which values.

use super::whole::Number;
use serde::de::{Deserialize, Deserializer, Error, IgnoredAny, MapAccess, Visitor};
use std::fmt;

/// Attributes that place triangles, in order, with the numbers of their accessors. All others, such as normals, are skipped.
#[derive(Default)]
pub(super) struct Attributes(Vec<(Attribute, usize)>);

/// What the values of an accessor are.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Attribute {
    Position,
    /// The joints of a set, such as `JOINTS_0`.
    Joints(u32),
    /// Their weights.
    Weights(u32),
    Translation,
    Rotation,
    Scale,
    /// Values of the application's own, which have names that begin with `_`.
    Own,
}

impl Attributes {
    /// Returns the accessor of an attribute.
    pub(super) fn of(&self, attribute: Attribute) -> Option<usize> {
        let place = self.0.binary_search_by_key(&attribute, |&(found, _)| found).ok()?;
        Some(self.0[place].1)
    }

    /// Returns the number of attributes.
    pub(super) fn len(&self) -> u64 {
        self.0.len() as u64
    }

    /// Returns all attributes with their accessors.
    pub(super) fn all(&self) -> impl Iterator<Item = (Attribute, usize)> {
        self.0.iter().copied()
    }
}

impl Attribute {
    fn of_name(name: &str) -> Option<Self> {
        let set = |prefix: &str| name.strip_prefix(prefix).and_then(|set| set.parse().ok());
        match name {
            "POSITION" => Some(Self::Position),
            "TRANSLATION" => Some(Self::Translation),
            "ROTATION" => Some(Self::Rotation),
            "SCALE" => Some(Self::Scale),
            _ if name.starts_with('_') => Some(Self::Own),
            _ => set("JOINTS_").map(Self::Joints).or_else(|| set("WEIGHTS_").map(Self::Weights)),
        }
    }
}

impl<'de> Deserialize<'de> for Attributes {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        from.deserialize_map(ByName)
    }
}

struct ByName;

impl<'de> Visitor<'de> for ByName {
    type Value = Attributes;

    fn expecting(&self, to: &mut fmt::Formatter) -> fmt::Result {
        to.write_str("attributes by name")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Attributes, A::Error> {
        let mut found = Vec::new();
        while let Some(name) = map.next_key::<Name>()? {
            match name.0 {
                Some(attribute) => found.push((attribute, map.next_value::<Number>()?.0 as usize)),
                None => drop(map.next_value::<IgnoredAny>()?),
            }
        }
        found.sort_unstable();
        let twice = |pair: &[(Attribute, usize)]| pair[0].0 == pair[1].0 && pair[0].0 != Attribute::Own;
        if found.windows(2).any(twice) {
            return Err(A::Error::custom("an attribute twice"));
        }
        Ok(Attributes(found))
    }
}

/// The name of an attribute, which is not kept.
struct Name(Option<Attribute>);

impl<'de> Deserialize<'de> for Name {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        struct OfText;
        impl Visitor<'_> for OfText {
            type Value = Name;

            fn expecting(&self, to: &mut fmt::Formatter) -> fmt::Result {
                to.write_str("the name of an attribute")
            }

            fn visit_str<E: Error>(self, name: &str) -> Result<Name, E> {
                Ok(Name(Attribute::of_name(name)))
            }
        }
        from.deserialize_str(OfText)
    }
}
