//! Answers about points, rays and segments.

use crate::asking;
use crate::asking::mesh::LoadedMesh;
use crate::asking::witness;
use bvh_format::checksum::Hasher;
use bvh_query::{ClosestPoint, RayHit, Side};
use serde_json::{Value, json};

/// An answer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Answer {
    /// The closest point of the mesh; `None` if the mesh has no triangles.
    Closest(Option<ClosestPoint>),
    /// The side that a point is on.
    Side(Side),
    /// The first hit of a ray.
    Hit(Option<RayHit>),
    /// Whether a segment meets the mesh.
    Meets(bool),
}

impl asking::Answer for Answer {
    /// Returns true for a point on the mesh or, where the side is asked for, inside it; for a hit; and for a meeting.
    fn is_positive(&self) -> bool {
        match self {
            Self::Closest(_) => self.value() <= 0.0,
            Self::Side(side) => *side == Side::Inside,
            Self::Hit(hit) => hit.is_some(),
            Self::Meets(meets) => *meets,
        }
    }

    fn value(&self) -> f64 {
        match self {
            Self::Closest(closest) => closest.map_or(f64::INFINITY, |closest| closest.distance),
            Self::Side(side) => f64::from(*side as i8),
            Self::Hit(hit) => hit.map_or(-1.0, |hit| hit.t),
            Self::Meets(meets) => f64::from(u8::from(*meets)),
        }
    }

    fn json(&self) -> Value {
        match self {
            Self::Closest(None) => json!({ "distance": null }),
            Self::Closest(Some(of)) => json!({
                "distance": of.distance, "lower": of.lower, "upper": of.upper, "point": of.point, "object": of.object,
                "triangle": of.triangle,
            }),
            Self::Side(side) => json!({ "side": *side as i8 }),
            Self::Hit(None) => json!({ "hit": false }),
            Self::Hit(Some(of)) => json!({
                "hit": true, "t": of.t, "lower": of.lower, "upper": of.upper, "point": of.point, "object": of.object,
                "triangle": of.triangle,
            }),
            Self::Meets(meets) => json!({ "meets": meets }),
        }
    }

    /// Hashes the bits of the value.
    fn hash(&self, hasher: &mut Hasher) {
        hasher.update(&self.value().to_bits().to_le_bytes());
    }
}

impl Answer {
    /// Returns the answer in words, with its unit.
    fn in_words(&self) -> String {
        let words = match self {
            Self::Closest(None) => "the mesh has no triangles",
            Self::Closest(Some(closest)) if closest.distance > 0.0 => {
                return format!("{:?} mesh units from the mesh", closest.distance);
            }
            Self::Closest(Some(_)) | Self::Side(Side::On) => "on the mesh",
            Self::Side(Side::Inside) => "inside the mesh",
            Self::Side(Side::Outside) => "outside the mesh",
            Self::Side(Side::Undefined) => {
                "undefined, because the mesh is not closed and consistently oriented"
            }
            Self::Hit(Some(hit)) => return format!("hits the mesh at {:?} times the direction", hit.t),
            Self::Hit(None) => "does not hit the mesh",
            Self::Meets(true) => "meets the mesh",
            Self::Meets(false) => "does not meet the mesh",
        };
        words.to_owned()
    }

    /// Returns the answer in words, with its bounds, its point and its triangle.
    pub(super) fn describe(&self, mesh: &LoadedMesh) -> String {
        let (lower, upper, point, object, triangle) = match self {
            Self::Closest(Some(of)) => (of.lower, of.upper, of.point, of.object, of.triangle),
            Self::Hit(Some(of)) => (of.lower, of.upper, of.point, of.object, of.triangle),
            _ => return format!("{}\n", self.in_words()),
        };
        format!(
            "{}\n  certainly {lower:?} to {upper:?}\n  at {}, {}\n",
            self.in_words(),
            witness::point(point),
            witness::name(mesh, object, triangle)
        )
    }
}
