//! Finds the version of a glTF file, also of one that cannot be read because it has another version.

use super::schema::wrong;
use crate::error::{Fault, excerpt};
use serde::Deserialize;
use serde::de::{Deserializer, IgnoredAny, MapAccess, SeqAccess, Visitor};
use std::fmt;

/// The version of a file.
pub(super) struct Version {
    /// `asset.version`, if the file states it.
    pub(super) stated: Option<String>,
    /// `asset.minVersion`: the least version that a reader must know.
    pub(super) least: Option<String>,
}

/// What files of all versions have.
#[derive(Deserialize)]
struct AnyFile {
    asset: Option<AnyAsset>,
    #[serde(default)]
    meshes: Kind,
    #[serde(default)]
    nodes: Kind,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct AnyAsset {
    version: Option<Text>,
    min_version: Option<Text>,
}

/// A version, which may be a number.
#[derive(Deserialize)]
#[serde(untagged)]
enum Text {
    Text(String),
    Number(f64),
}

impl Version {
    /// Finds the version of a file that is no glTF 2.0 document, but JSON.
    pub(super) fn of(text: &[u8]) -> Option<Self> {
        let file: AnyFile = serde_json::from_slice(text).ok()?;
        let text = |text: Text| match text {
            Text::Text(text) => text,
            Text::Number(number) => format!("{number:?}"),
        };
        let asset = file.asset.unwrap_or(AnyAsset { version: None, min_version: None });
        let (stated, least) = (asset.version.map(text), asset.min_version.map(text));
        // The lists of glTF 1.0 have names. A file of that version need not state it.
        let is_old = file.meshes == Kind::Names || file.nodes == Kind::Names;
        Some(Self { stated: stated.or_else(|| is_old.then(|| "1.0".to_owned())), least })
    }

    /// Returns the fault of a version that is not read. A file may have features of a later version that a reader need not know.
    pub(super) fn check(self) -> Option<Fault> {
        let numbers = |text: &str| {
            let (major, minor) = text.split_once('.').unwrap_or((text, "0"));
            Some((major.parse::<u32>().ok()?, minor.parse::<u32>().ok()?))
        };
        if let Some(least) = self.least {
            let is_read = numbers(&least).is_some_and(|least| least <= (2, 0));
            let found = || format!("{} in asset.minVersion", excerpt(least.as_bytes()));
            return (!is_read)
                .then(|| wrong("asset.minVersion of at most 2.0, the version that is read", &found()));
        }
        let stated = self.stated?;
        if stated.split('.').next() == Some("2") {
            return None;
        }
        let found = excerpt(stated.as_bytes());
        let remedy = match numbers(&stated) {
            Some((0 | 1, _)) => format!("glTF of version {found}; convert it to version 2.0"),
            _ => found,
        };
        Some(wrong("asset.version 2.0", &remedy))
    }
}

/// Whether a list is one, or has names.
#[derive(Default, PartialEq, Eq)]
enum Kind {
    Names,
    #[default]
    Other,
}

impl<'de> Deserialize<'de> for Kind {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        struct OfAny;
        impl<'de> Visitor<'de> for OfAny {
            type Value = Kind;

            fn expecting(&self, to: &mut fmt::Formatter) -> fmt::Result {
                to.write_str("a list")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Kind, A::Error> {
                while map.next_entry::<IgnoredAny, IgnoredAny>()?.is_some() {}
                Ok(Kind::Names)
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Kind, A::Error> {
                while list.next_element::<IgnoredAny>()?.is_some() {}
                Ok(Kind::Other)
            }
        }
        from.deserialize_any(OfAny)
    }
}
