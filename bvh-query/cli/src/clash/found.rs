//! The clashes that were found: their order, their ids, and their fields and words.

use super::parts::{Assembly, centre};
use crate::console::{Record, hex, record, shown};
use bvh_format::checksum::checksum;
use bvh_query::{ClashClass, Relation, SceneClash};
use std::cmp::Ordering;

/// A clash of two parts, in the frame of the world.
pub(super) struct Found<'a> {
    /// The names of the parts, that of the earlier one first.
    pub(super) names: [&'a str; 2],
    /// The numbers of the parts.
    pub(super) parts: [usize; 2],
    pub(super) class: ClashClass,
    relation: Relation,
    /// How far apart the surfaces are, where that is known.
    pub(super) distance: Option<f64>,
    /// The bounds of the depth.
    pub(super) depth: Option<[f64; 2]>,
    /// What moves the second part out of the first one.
    pub(super) translation: Option<[f64; 3]>,
    pub(super) point: [f64; 3],
    /// How the clash compares with that of the baseline.
    pub(super) status: Option<Status>,
}

/// How a clash compares with that of an earlier run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Status {
    New,
    Changed,
    Same,
}

impl Status {
    pub(super) const ALL: [Self; 3] = [Self::New, Self::Changed, Self::Same];

    pub(super) fn name(self) -> &'static str {
        ["new", "changed", "same"][self as usize]
    }
}

/// The classes of clashes, those that matter most first.
pub(super) const BY_WEIGHT: [ClashClass; 7] = [
    ClashClass::Overlapping,
    ClashClass::Undecided,
    ClashClass::Intersecting,
    ClashClass::Duplicated,
    ClashClass::Contained,
    ClashClass::Near,
    ClashClass::Touching,
];

impl<'a> Found<'a> {
    /// Returns the answer about two parts.
    pub(super) fn of(
        assembly: &'a Assembly,
        parts: [usize; 2],
        SceneClash { clash, .. }: &SceneClash,
    ) -> Self {
        let world = &assembly.parts[parts[0]].world;
        let turn = |v: [f64; 3]| world.rotation().map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2]);
        let has_distance = clash.distance.is_finite() && clash.class != ClashClass::Contained;
        Self {
            names: parts.map(|number| &*assembly.parts[number].name),
            parts,
            class: clash.class,
            relation: clash.relation,
            distance: has_distance.then_some(clash.distance),
            depth: clash.depth.map(|depth| [depth.lower, depth.upper]),
            translation: clash.depth.filter(|_| clash.distance == 0.0).map(|depth| turn(depth.translation)),
            point: world.place(clash.point),
            status: None,
        }
    }

    /// Returns the clash of a part and its copy.
    pub(super) fn of_copy(assembly: &'a Assembly, parts: [usize; 2]) -> Self {
        Self {
            names: parts.map(|number| &*assembly.parts[number].name),
            parts,
            class: ClashClass::Duplicated,
            relation: Relation::Touching,
            distance: Some(0.0),
            depth: None,
            translation: None,
            point: centre(&assembly.parts[parts[0]].bounds()),
            status: None,
        }
    }

    /// Returns a name that a later run gives the same clash: a hash of both names, in either order.
    pub(super) fn id(&self) -> String {
        let [a, b] = self.names;
        let (first, last) = if a <= b { (a, b) } else { (b, a) };
        hex(checksum(format!("{first}\0{last}").as_bytes()))
    }

    /// Orders clashes by what matters: by class, deep ones and near ones first, and else by their parts.
    pub(super) fn order(&self, other: &Self) -> Ordering {
        let weight = |of: &Self| BY_WEIGHT.iter().position(|class| *class == of.class);
        let depth = |of: &Self| of.depth.map_or(0.0, |[_, upper]| upper);
        let distance = |of: &Self| of.distance.unwrap_or(0.0);
        let (one, two) = (weight(self), weight(other));
        one.cmp(&two)
            .then_with(|| depth(other).total_cmp(&depth(self)))
            .then_with(|| distance(self).total_cmp(&distance(other)))
            .then_with(|| self.parts.cmp(&other.parts))
    }

    /// Returns whether `--fail-on` is about this clash if it is about its class.
    pub(super) fn is_fresh(&self) -> bool {
        self.status != Some(Status::Same)
    }

    pub(super) fn json(&self) -> Record {
        self.named()
            .with(record! { translation: self.translation, point: self.point })
            .with(self.status.map(|status| record! { status: status.name() }))
    }

    /// The fields of a row, in order.
    pub(super) const COLUMNS: [&'static str; 15] = [
        "id",
        "class",
        "a",
        "b",
        "relation",
        "distance",
        "lower",
        "upper",
        "translation_x",
        "translation_y",
        "translation_z",
        "x",
        "y",
        "z",
        "status",
    ];

    /// Returns the same with a field for each coordinate.
    pub(super) fn row(&self) -> Record {
        let moved = self.translation.map(|v| v.map(Some)).unwrap_or_default();
        let [x, y, z] = self.point;
        self.named().with(record! {
            translation_x: moved[0], translation_y: moved[1], translation_z: moved[2],
            x: x, y: y, z: z, status: self.status.map(Status::name),
        })
    }

    fn named(&self) -> Record {
        let [a, b] = self.names;
        record! {
            id: self.id(), class: self.class.name(), a: a, b: b, relation: self.relation as u8, distance: self.distance,
            lower: self.depth.map(|[lower, _]| lower), upper: self.depth.map(|[_, upper]| upper),
        }
    }

    /// Returns how much the parts clash, in words.
    pub(super) fn extent(&self) -> String {
        match (self.class, self.depth, self.distance) {
            (ClashClass::Contained, ..) if self.relation == Relation::AInB => {
                "the first in the second".to_owned()
            }
            (ClashClass::Contained, ..) => "the second in the first".to_owned(),
            (_, _, Some(distance)) if distance > 0.0 => format!("{} apart", short(distance)),
            (_, Some([lower, upper]), _) => format!("{} to {} deep", short(lower), short(upper)),
            _ => String::new(),
        }
    }

    /// Returns both names for a person.
    pub(super) fn both(&self) -> String {
        both(self.names[0], self.names[1])
    }

    /// Returns the place for a person.
    pub(super) fn place(&self) -> String {
        self.point.map(short).join(" ")
    }
}

/// Returns two names for a person.
pub(super) fn both(a: &str, b: &str) -> String {
    format!("{} | {}", shown(a), shown(b))
}

/// Returns a number for a person: six digits.
pub(super) fn short(value: f64) -> String {
    let rounded = format!("{value:.5e}").parse::<f64>().unwrap_or(value) + 0.0;
    let text = format!("{rounded:?}");
    text.strip_suffix(".0").unwrap_or(&text).to_owned()
}
