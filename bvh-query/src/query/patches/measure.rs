//! The centre, the normal, the length and the area of a patch. All sums are in the order of contacts.

use crate::narrow::{MAX_POINTS, cross, dot, subtract, unit};
use crate::numerics::{NORMAL_ERROR, UNIT_ROUNDOFF};
use crate::query::patches::join::Vertices;
use crate::query::regions::{ContactRegion, RegionKind};
use bvh_format::vec3::length;
use std::collections::hash_map::Entry;
use std::collections::{HashMap, HashSet};

/// What a patch is like.
pub(super) struct Measured {
    pub(super) center: [f64; 3],
    pub(super) normal: [f64; 3],
    pub(super) length: f64,
    pub(super) area: f64,
}

/// A part of a curve, which several contacts may have in common.
struct CurvePart {
    /// Its ends, the vertex of the lesser number first.
    points: [[f64; 3]; 2],
    /// How many contacts it has from the first end to the second one, less those the other way.
    turns: i32,
    error: f64,
}

/// How many times its error an area vector has to be long to tell a direction: it is then off by 2^-10 at most.
const CLEAR: f64 = 1024.0;

/// A weighted mean of vectors.
#[derive(Default)]
struct Mean {
    sum: [f64; 3],
    weight: f64,
}

impl Mean {
    fn add(&mut self, weight: f64, point: [f64; 3]) {
        add(&mut self.sum, weight, point);
        self.weight += weight;
    }

    fn value(&self) -> Option<[f64; 3]> {
        (self.weight > 0.0).then(|| self.sum.map(|x| x / self.weight))
    }
}

/// Measures the patch of some contacts.
pub(super) fn measure(regions: &[ContactRegion], vertices: &Vertices, contacts: &[usize]) -> Measured {
    // Sums are of differences from a point of the patch, so that its place costs no accuracy.
    let base = contacts.iter().find_map(|&i| regions[i].points().first()).copied().unwrap_or_default();
    let (mut by_area, mut by_length, mut by_point) = (Mean::default(), Mean::default(), Mean::default());
    // By area, by length and by number.
    let mut pushes = [Mean::default(), Mean::default(), Mean::default()];
    let (mut vector, mut error, mut area) = ([0.0; 3], 0.0, 0.0);
    for polygon in polygons(regions, vertices, contacts) {
        let flat = Polygon::new(polygon, base);
        area += flat.area;
        if dot(polygon.normal_a, polygon.normal_b) < 0.0 {
            by_area.add(flat.area, flat.center);
            pushes[0].add(flat.area, push(polygon));
            add(&mut vector, flat.area, polygon.normal_a);
        }
    }
    let curve = segments(regions, vertices, contacts);
    for segment in &curve {
        let [p, q] = segment.points.map(|p| subtract(p, base));
        let length = length(subtract(q, p));
        by_length.add(length, [0, 1, 2].map(|k| (p[k] + q[k]) / 2.0));
    }
    let overlaps = contacts.iter().any(|&i| regions[i].overlap > 0.0);
    for &i in contacts {
        let region = &regions[i];
        let weight = if overlaps { region.overlap } else { 1.0 };
        region.points().iter().for_each(|p| by_point.add(weight, subtract(*p, base)));
        pushes[2].add(weight, push(region));
        if let [p, q] = region.points() {
            pushes[1].add(length(subtract(*q, *p)), push(region));
        }
    }
    let center = by_area.value().or(by_length.value()).or(by_point.value()).unwrap_or_default();
    for segment in &curve {
        let [p, q] = segment.points.map(|p| subtract(subtract(p, base), center));
        add(&mut vector, 0.5 * f64::from(segment.turns.signum()), cross(p, q));
        let [p, q] = [p, q].map(length);
        error += (p + q) * segment.error + 16.0 * UNIT_ROUNDOFF * p * q;
    }
    let clear = |push: &[f64; 3]| length(*push) > CLEAR * NORMAL_ERROR;
    let push = pushes.iter().filter_map(Mean::value).find(clear).unwrap_or_default();
    let is_clear = length(vector) > CLEAR * error && dot(unit(vector), unit(push)) >= 0.0;
    Measured {
        center: [0, 1, 2].map(|k| base[k] + center[k]),
        normal: unit(if is_clear { vector } else { push }),
        length: by_length.weight,
        area,
    }
}

/// Returns the direction in which two triangles push B.
fn push(region: &ContactRegion) -> [f64; 3] {
    subtract(region.normal_a, region.normal_b)
}

/// Returns the polygons of a patch, without those of duplicates.
fn polygons<'r>(
    regions: &'r [ContactRegion],
    vertices: &Vertices,
    contacts: &[usize],
) -> impl Iterator<Item = &'r ContactRegion> {
    let key = |region: usize| {
        let mut key = [usize::MAX; MAX_POINTS];
        key.iter_mut().zip(vertices.of(region)).for_each(|(key, vertex)| *key = *vertex);
        key.sort_unstable();
        key
    };
    let mut seen = HashSet::new();
    let of_kind = contacts.iter().filter(|&&i| regions[i].kind == RegionKind::Polygon);
    of_kind.filter(move |&&i| seen.insert(key(i))).map(|&i| &regions[i])
}

/// Returns the segments of a patch, each once: the first contact gives its points.
fn segments(regions: &[ContactRegion], vertices: &Vertices, contacts: &[usize]) -> Vec<CurvePart> {
    let (mut segments, mut places) = (Vec::<CurvePart>::new(), HashMap::new());
    for &i in contacts {
        let region = &regions[i];
        if region.kind != RegionKind::Segment {
            continue;
        }
        if let ([p, q], [first, last]) = (region.points(), vertices.of(i)) {
            let mut segment = CurvePart { points: [*p, *q], turns: 1, error: region.error };
            if first > last {
                segment = CurvePart { points: [*q, *p], turns: -1, ..segment };
            }
            match places.entry([*first.min(last), *last.max(first)]) {
                Entry::Vacant(place) => {
                    place.insert(segments.len());
                    segments.push(segment);
                }
                Entry::Occupied(place) => {
                    let known = &mut segments[*place.get()];
                    known.turns += segment.turns;
                    known.error = known.error.max(segment.error);
                }
            }
        }
    }
    segments
}

/// The area and the centre of a polygon, seen from a point.
struct Polygon {
    area: f64,
    center: [f64; 3],
}

impl Polygon {
    /// Cuts the polygon into triangles at its first corner.
    fn new(region: &ContactRegion, base: [f64; 3]) -> Self {
        let Some((first, rest)) = region.points().split_first() else {
            return Self { area: 0.0, center: [0.0; 3] };
        };
        let from = subtract(*first, base);
        let mut mean = Mean::default();
        for pair in rest.windows(2) {
            let [p, q] = [pair[0], pair[1]].map(|p| subtract(p, *first));
            mean.add(length(cross(p, q)) / 2.0, [0, 1, 2].map(|k| from[k] + (p[k] + q[k]) / 3.0));
        }
        Self { area: mean.weight, center: mean.value().unwrap_or(from) }
    }
}

fn add(sum: &mut [f64; 3], weight: f64, v: [f64; 3]) {
    for (sum, x) in sum.iter_mut().zip(v) {
        *sum += weight * x;
    }
}
