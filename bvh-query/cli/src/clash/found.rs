//! The clashes that were found: their order, their ids, and their fields and words.

use super::parts::{Assembly, centre};
use crate::console::{Record, hex, record, shown};
use bvh_format::checksum::checksum;
use bvh_query::{ClashClass, Intersection, Pose, Querier, QueryError, Relation, SceneClash};
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
    /// What both have in common, where that is asked for and known.
    pub(super) shared: Option<Intersection>,
    /// Why magnitudes that were asked for are not known, in words.
    reason: Option<&'static str>,
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
pub(super) const BY_WEIGHT: [ClashClass; 9] = [
    ClashClass::Piercing,
    ClashClass::Protruding,
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
            shared: clash.magnitudes,
            reason: None,
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
            shared: None,
            reason: None,
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

    /// Orders clashes by the volume that parts have in common, the largest first, and else as [`Found::order`] does.
    pub(super) fn order_by_volume(&self, other: &Self) -> Ordering {
        let volume = |of: &Self| of.shared.map_or(0.0, |shared| shared.volume);
        volume(other).total_cmp(&volume(self)).then_with(|| self.order(other))
    }

    /// Returns whether the parts may have this volume in common.
    pub(super) fn may_share(&self, volume: f64) -> bool {
        match self.shared {
            Some(shared) => shared.volume + shared.volume_error >= volume,
            None => self.reason.is_some(),
        }
    }

    /// Adds the magnitudes of a part and its copy, and the reason where there are none.
    pub(super) fn complete(&mut self, assembly: &Assembly, querier: &mut Querier) -> Result<(), QueryError> {
        if self.shared.is_some() || matches!(self.class, ClashClass::Near | ClashClass::Touching) {
            return Ok(());
        }
        let [first, second] = self.parts.map(|number| &assembly.parts[number]);
        let (a, b) = (first.shape.opened()?, second.shape.opened()?);
        self.reason = match [a.shape(), b.shape()].map(|shape| shape.is_closed()) {
            [Err(error), _] | [_, Err(error)] => return Err(error),
            [Ok(false), Ok(false)] => Some("both are not closed"),
            [Ok(false), _] => Some("a is not closed"),
            [_, Ok(false)] => Some("b is not closed"),
            _ if first.margin + second.margin + a.shape().radius() + b.shape().radius() > 0.0 => {
                Some("a part has a margin")
            }
            _ => None,
        };
        if self.reason.is_none() && self.class == ClashClass::Duplicated {
            // Copies are in one place.
            let mut shared = querier.intersection(a.shape(), b.shape(), &Pose::IDENTITY)?;
            shared.bounds = Some(first.bounds());
            self.shared = Some(shared);
        }
        Ok(())
    }

    /// Returns whether a class that was named is that of the clash: overlapping stands for piercing and protruding, too.
    pub(super) fn is_of(&self, class: ClashClass) -> bool {
        let divided = matches!(self.class, ClashClass::Piercing | ClashClass::Protruding);
        self.class == class || class == ClashClass::Overlapping && divided
    }

    /// Returns whether `--fail-on` is about this clash if it is about its class.
    pub(super) fn is_fresh(&self) -> bool {
        self.status != Some(Status::Same)
    }

    pub(super) fn json(&self) -> Record {
        let shared = self.shared;
        self.named()
            .with(record! { translation: self.translation, point: self.point })
            .with((shared.is_some() || self.reason.is_some()).then(|| {
                record! {
                    volume: shared.map(|shared| shared.volume),
                    volume_error: shared.map(|shared| shared.volume_error),
                    area: shared.map(|shared| [shared.area_a, shared.area_b]),
                    pierced: shared.map(|shared| [shared.pierced_a, shared.pierced_b]),
                    box: shared.map(|shared| shared.bounds),
                    reason: self.reason,
                }
            }))
            .with(self.status.map(|status| record! { status: status.name() }))
    }

    /// The fields of a row, in order.
    pub(super) const COLUMNS: [&'static str; 27] = [
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
        "volume",
        "volume_error",
        "area_a",
        "area_b",
        "pierced_a",
        "pierced_b",
        "low_x",
        "low_y",
        "low_z",
        "high_x",
        "high_y",
        "high_z",
        "status",
    ];

    /// Returns the same with a field for each coordinate.
    pub(super) fn row(&self) -> Record {
        let moved = self.translation.map(|v| v.map(Some)).unwrap_or_default();
        let [x, y, z] = self.point;
        let shared = self.shared.as_ref();
        let corner = |which: usize| {
            let corners = shared.and_then(|shared| shared.bounds);
            corners.map(|corners| corners[which].map(Some)).unwrap_or_default()
        };
        let (low, high) = (corner(0), corner(1));
        self.named().with(record! {
            translation_x: moved[0], translation_y: moved[1], translation_z: moved[2],
            x: x, y: y, z: z,
            volume: shared.map(|shared| shared.volume), volume_error: shared.map(|shared| shared.volume_error),
            area_a: shared.map(|shared| shared.area_a), area_b: shared.map(|shared| shared.area_b),
            pierced_a: shared.and_then(|shared| shared.pierced_a),
            pierced_b: shared.and_then(|shared| shared.pierced_b),
            low_x: low[0], low_y: low[1], low_z: low[2], high_x: high[0], high_y: high[1], high_z: high[2],
            status: self.status.map(Status::name),
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
        let mut words = vec![self.lengths()];
        if let Some(Intersection { volume, pierced_a, pierced_b, .. }) = self.shared {
            words.push(format!("volume {}", short(volume)));
            let pierced = [("first", pierced_a), ("second", pierced_b)].into_iter();
            words.extend(pierced.filter_map(|(which, thickness)| {
                Some(format!("{} of the {which} pierced", short(thickness?)))
            }));
        }
        words.extend(self.reason.map(str::to_owned));
        words.retain(|words| !words.is_empty());
        words.join(", ")
    }

    /// Returns how far apart or how deep in each other the parts are, in words.
    fn lengths(&self) -> String {
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
