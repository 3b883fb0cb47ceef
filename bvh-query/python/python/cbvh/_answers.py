"""The types of answers: enumerations and named tuples of numbers and arrays."""

import enum
from typing import Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


class _Named(enum.IntEnum):
    """A number that is printed as its name. It equals the number."""

    def __str__(self) -> str:
        return self.name


class Relation(_Named):
    """The relation of two meshes.

    - ``TOUCHING``: their surfaces have a point in common.
    - ``APART``: they have nothing in common, insides included.
    - ``A_IN_B``: all of the first mesh is inside the second.
    - ``B_IN_A``: all of the second mesh is inside the first.
    - ``MIXED``: some parts of a mesh are inside the other and some are not, or some of each mesh are.
    - ``UNDEFINED``: the answer depends on the inside of a mesh that is not closed.
    """

    TOUCHING = 0
    APART = 1
    A_IN_B = 2
    B_IN_A = 3
    MIXED = 4
    UNDEFINED = 5


class Side(_Named):
    """On which side of a mesh a point is.

    - ``OUTSIDE``, ``ON``, ``INSIDE``: the point is outside, on the surface, or inside.
    - ``UNDEFINED``: the point is not on the surface, and the mesh has no inside, because it is not closed.
    """

    OUTSIDE = -1
    ON = 0
    INSIDE = 1
    UNDEFINED = 2


class MotionKind(_Named):
    """Whether a path is free.

    - ``FREE``: at no time are the meshes within the clearance.
    - ``HIT``: at the time `at`, they are within the clearance.
    - ``NEAR``: their distance is at some time at most the clearance plus the tolerance, but in no pose tested are they
      within the clearance.
    """

    FREE = 0
    HIT = 1
    NEAR = 2


class RegionKind(_Named):
    """What two triangles in contact have in common.

    - ``POINT``: they touch in one point.
    - ``SEGMENT``: they meet in a segment: they cross, or an edge touches.
    - ``POLYGON``: they overlap in one plane, in a convex polygon.
    """

    POINT = 0
    SEGMENT = 1
    POLYGON = 2


class SelfContactKind(_Named):
    """How two triangles of one mesh meet where they should not.

    - ``CROSSING``: they have no corner in common, and touch or cross.
    - ``AT_CORNER``: they have one corner in common, and another point.
    - ``FOLDED``: they have an edge in common and overlap beyond it, in one plane.
    - ``DUPLICATE``: they have the same corners, in any order.
    """

    CROSSING = 0
    AT_CORNER = 1
    FOLDED = 2
    DUPLICATE = 3


class ClashClass(_Named):
    """How two parts of an assembly lie.

    - ``APART``: their surfaces are farther apart than the clearance and the tolerance, and neither is inside the other.
    - ``NEAR``: their surfaces are farther apart than the tolerance, but at most the clearance.
    - ``TOUCHING``: their surfaces are at most the tolerance apart, or they have points in common and their depth is at most
      the tolerance.
    - ``OVERLAPPING``: their depth exceeds the tolerance.
    - ``CONTAINED``: one is wholly inside the other.
    - ``DUPLICATED``: both are the same part in the same place, to within the tolerance.
    - ``UNDECIDED``: they have points in common, and the tolerance lies between the bounds found for their depth.
    - ``INTERSECTING``: they have points in common, and one is not closed, so that they have no depth.
    - ``PIERCING``: their depth exceeds the tolerance, and one passes through the other. If magnitudes are asked for, parts that
      overlap are this or ``PROTRUDING``.
    - ``PROTRUDING``: their depth exceeds the tolerance, and neither passes through the other.
    """

    APART = 0
    NEAR = 1
    TOUCHING = 2
    OVERLAPPING = 3
    CONTAINED = 4
    DUPLICATED = 5
    UNDECIDED = 6
    INTERSECTING = 7
    PIERCING = 8
    PROTRUDING = 9


class Distance(NamedTuple):
    """The least distance of two meshes. After N queries, each field has N elements or rows.

    - ``distance``: the distance in mesh units; 0 if they touch. Shape () or (N,).
    - ``lower``: a certified lower bound of the least distance of the meshes.
    - ``upper``: a certified upper bound of it.
    - ``point_a``: the closest point of the first mesh, in its frame. Shape (3,) or (N, 3).
    - ``point_b``: the closest point of the second mesh, in the frame of the first.
    - ``object_a``: the number of the first mesh's object in its file. An int, or an array of uint32.
    - ``triangle_a``: the number of its triangle in the input or, in a file without ids, of its place. The same type.
    - ``object_b``, ``triangle_b``: those of the second mesh.
    """

    distance: Any
    lower: Any
    upper: Any
    point_a: Floats
    point_b: Floats
    object_a: Any
    triangle_a: Any
    object_b: Any
    triangle_b: Any


class Separation(NamedTuple):
    """How far the second mesh moves along a direction until the insides are disjoint. After N queries, each field has N
    elements or rows.

    - ``lower``: the insides meet at all shorter moves along the direction, in mesh units. Shape () or (N,).
    - ``upper``: the length of ``translation``.
    - ``translation``: a move of the second mesh along the direction, in the frame of the first, at which the insides are
      disjoint. Shape (3,) or (N, 3).
    """

    lower: Any
    upper: Any
    translation: Floats


class Penetration(NamedTuple):
    """How deep two meshes overlap. After N queries, each field has N elements or rows.

    - ``lower``: no shorter translation makes the insides disjoint, in mesh units. Shape () or (N,).
    - ``upper``: the length of ``translation``.
    - ``translation``: a translation of the second mesh, in the frame of the first, at which the insides are disjoint. Shape
      (3,) or (N, 3).
    - ``point``: a point in both meshes, in the frame of the first, where ``lower`` is above 0. Shape (3,) or (N, 3).
    - ``radii``: the radii of two balls about the point, one inside each mesh, which prove ``lower``: their sum, but for
      roundings. Both are 0 where convex meshes or parts prove more. Shape (2,) or (N, 2).
    - ``is_spent``: whether the budget or the most visits ended the search. Shape () or (N,).
    """

    lower: Any
    upper: Any
    translation: Floats
    point: Floats
    radii: Floats
    is_spent: Any


class SignedDistance(NamedTuple):
    """How far apart two meshes are or, below zero, how deep they overlap. After N queries, each field has N elements or
    rows.

    - ``lower``: the signed distance is at least this, in mesh units. Shape () or (N,).
    - ``upper``: it is at most this.
    - ``normal``: the direction in which the second mesh moves away from the first at unit length, in the frame of the first:
      from ``point_a`` to ``point_b`` or, where they overlap, along ``translation``. 0 where none is known, as for meshes that
      touch and have no depth. Shape (3,) or (N, 3).
    - ``point_a``: the closest point of the first mesh, in its frame or, where they overlap, the one that the second mesh
      touches after the translation.
    - ``point_b``: the closest point of the second mesh, in the frame of the first or, where they overlap, the one that touches
      ``point_a`` after the translation.
    - ``translation``: where they overlap, a translation of the second mesh, in the frame of the first, at which the insides are
      disjoint; its length is ``-lower``. Else 0.
    - ``is_signed``: whether both meshes have an inside: they are closed, and have a radius or triangles with area. If not, they
      have no depth, and the number is their distance. Shape () or (N,).
    - ``is_spent``: whether the budget ended the search for a depth. Shape () or (N,).
    """

    lower: Any
    upper: Any
    normal: Floats
    point_a: Floats
    point_b: Floats
    translation: Floats
    is_signed: Any
    is_spent: Any


class Intersection(NamedTuple):
    """What two meshes have in common, in mesh units. After N queries, each field has N elements or rows. Only the volume's error is
    certified; all other numbers are rounded.

    - ``volume``: the volume of the intersection. Shape () or (N,).
    - ``volume_error``: the volume is off by at most this.
    - ``area_a``: the area of the first mesh's surface inside the second.
    - ``area_b``: the area of the second mesh's surface inside the first.
    - ``bounds``: the least and the largest coordinates of the intersection, in the frame of the first mesh; NaN if it is empty. Shape
      (2, 3) or (N, 2, 3).
    - ``pierced_a``: how thick the first mesh is where the second passes through it; NaN if it does so nowhere. Shape () or (N,).
    - ``pierced_b``: how thick the second mesh is where the first passes through it.
    """

    volume: Any
    volume_error: Any
    area_a: Any
    area_b: Any
    bounds: Floats
    pierced_a: Any
    pierced_b: Any


class IntersectionSurface(NamedTuple):
    """The boundary of what two meshes have in common: polygons, each of which lies in one triangle.

    - ``points``: the corners of all polygons, loop by loop, in the frame of the first mesh and in mesh units. Shape (K, 3).
    - ``loops``: the number of corners of each loop, uint32 of shape (L,). Seen from outside, an outline goes around counterclockwise and
      holes clockwise, unless the mesh is turned inside out.
    - ``polygons``: the number of loops of each polygon, its outline and then its holes. uint32 of shape (P,).
    """

    points: Floats
    loops: NDArray[np.uint32]
    polygons: NDArray[np.uint32]


class Clash(NamedTuple):
    """How two parts of an assembly lie, and by how much. After N queries, each field has N elements or rows.

    - ``kind``: a `ClashClass` or, for N poses, their numbers as uint8, shape (N,), printed as names.
    - ``relation``: whether they touch and, if not, whether one is inside the other: a `Relation`, or numbers likewise.
    - ``distance``: for near parts, and for touching ones without a common point, how far apart their surfaces are, in mesh
      units; infinite for parts that are apart, and 0 for all others. Shape () or (N,).
    - ``point``: a point of the clash in the frame of the first mesh: between the closest points, in both parts, or in contact;
      0 for parts that are apart. Shape (3,) or (N, 3).
    - ``depth``: for parts that touch, overlap or are undecided, the bounds of their depth, both 0 without a common point. For
      all others, and for parts that are not closed, its numbers are NaN.
    - ``magnitudes``: None unless asked for. For parts that overlap, are undecided, contain each other or are duplicated, what they
      have in common (`Intersection`). For all others, and for parts that are not closed, its numbers are NaN.
    """

    kind: Any
    relation: Any
    distance: Any
    point: Floats
    depth: Penetration
    magnitudes: Intersection | None


class ContactRegions(NamedTuple):
    """Where triangles in contact meet, in the frame of the first mesh and in mesh units.

    - ``triangles``: object and triangle of the first mesh, object and triangle of the second, uint32 of shape (K, 4).
    - ``kind``: what they have in common, exactly: numbers of `RegionKind` as uint8, shape (K,), printed as names.
    - ``point_count``: the number of points of each region, uint8 of shape (K,).
    - ``points``: a point, the ends of a segment, or the corners of a polygon; the rest is NaN. Shape (K, 6, 3). Where two
      planes cross, the ends follow the cross product of ``normal_a`` and ``normal_b``, so that the segments of closed meshes
      form directed loops. Corners go around counterclockwise, seen from where ``normal_a`` points to.
    - ``normal_a``: the unit normals of the first mesh's triangles, 0 for those without area, shape (K, 3). Between two
      rounded meshes whose cores are apart, the direction from the first core to the second.
    - ``normal_b``: those of the second mesh's; between such rounded meshes, the opposite.
    - ``error``: each point is certainly at most this far from the exact one, shape (K,).
    - ``overlap``: the sum of the radii less the distance of the triangles, at least 0; 0 without radii. Shape (K,).
    - ``total``: the number of all contacts, which is greater than K if the limit left some out.
    """

    triangles: NDArray[np.uint32]
    kind: Any
    point_count: NDArray[np.uint8]
    points: Floats
    normal_a: Floats
    normal_b: Floats
    error: Floats
    overlap: Floats
    total: int


class Patches(NamedTuple):
    """Contacts that are joined into P connected patches, in the frame of the first mesh and in mesh units. Numbers are
    rounded, and not certified.

    - ``center``: the mean of a patch's polygons by area; else of its curves by length; else of its points. Shape (P, 3).
    - ``normal``: the direction in which the first mesh pushes the second, at length 1; 0 if the normals cancel. Shape (P, 3).
    - ``length``: the length of the curves in which the surfaces meet, shape (P,).
    - ``area``: the area of what triangles have in common that are in one plane, shape (P,).
    - ``depth``: an estimate of how far the second mesh has to move along the normal to leave the first here, shape (P,).
    - ``first``: the row in ``regions`` of a patch's first contact, shape (P,).
    - ``contact_count``: the number of its contacts, shape (P,).
    - ``regions``: the `ContactRegions` of the first patch, of the second one, and so on, in ascending order within each.
    - ``first_point``: the row in ``points`` of a patch's first contact point, shape (P,).
    - ``point_count``: the number of its contact points, shape (P,).
    - ``points``: Q contact points, those of the first patch, of the second one, and so on; none without ``max_points``. Each
      is in the middle between both surfaces on a line along the patch's normal, or where they meet. Shape (Q, 3).
    - ``point_normals``: the direction in which the first mesh pushes the second at each point, at length 1. It is that of
      the surfaces where the line meets them, so points of a curved patch have different ones. Shape (Q, 3).
    - ``point_depths``: how deep the meshes overlap at each point along its normal, at least 0. For meshes with a radius,
      it is about their cores: minus the gap between these where they are apart. So a radius serves as the margin of a
      simulator; if the radii are a part of the bodies, add their sum. Shape (Q,).
    """

    center: Floats
    normal: Floats
    length: Floats
    area: Floats
    depth: Floats
    first: NDArray[np.int64]
    contact_count: NDArray[np.int64]
    regions: ContactRegions
    first_point: NDArray[np.int64]
    point_count: NDArray[np.int64]
    points: Floats
    point_normals: Floats
    point_depths: Floats


class SelfContacts(NamedTuple):
    """Pairs of triangles of one mesh that meet where they should not, in ascending order.

    - ``triangles``: object and triangle of the one, object and triangle of the other, uint32 of shape (K, 4).
    - ``kind``: numbers of `SelfContactKind` as uint8, shape (K,), printed as names.
    - ``total``: the number of all pairs, which is greater than K if the limit left some out.
    """

    triangles: NDArray[np.uint32]
    kind: Any
    total: int


class OpenEdge(NamedTuple):
    """An edge that leaves an object open.

    - ``kind``: "boundary", "flipped" or "crowded", as in `OpenEdges`.
    - ``object``: the number of the object in the file.
    - ``triangles``: the ids of its triangles, or their places in a file without ids: at most four, the smallest numbers.
    - ``ends``: in the direction in which more triangles traverse the edge, in mesh units, shape (2, 3).
    - ``gap``: for an edge of one triangle, how near another open edge is; None if that is not known.
    """

    kind: str
    object: int
    triangles: NDArray[np.uint32]
    ends: Floats
    gap: float | None


class OpenEdges(NamedTuple):
    """Why a mesh is not closed. ``str()`` says it in a sentence, with the remedy.

    - ``boundary``: the number of edges of one triangle: the border of a hole, of a sheet, or of a crack.
    - ``flipped``: the number of edges of two triangles that face opposite ways.
    - ``crowded``: the number of edges of more than two triangles, which do not cancel.
    - ``edges``: the first eight of each kind, a list of `OpenEdge`.
    - ``nearest_gap``: the least gap. The gap of an edge of one triangle is the distance within which `bake` with ``weld`` may make it one
      with another open edge, in mesh units.
    - ``cracks``: the number of edges whose gap is less than a hundredth of their length.
    - ``widest_crack``: the greatest gap of a crack; None without cracks.
    - ``proposed_weld``: a distance for ``weld`` that should close all cracks; None if there is none.
    """

    boundary: int
    flipped: int
    crowded: int
    edges: list[OpenEdge]
    nearest_gap: float | None
    cracks: int
    widest_crack: float | None
    proposed_weld: float | None
    text: str

    def __str__(self) -> str:
        return self.text


class MotionAnswer(NamedTuple):
    """Whether a path is free, and where it ends if it is not. After N queries, each field has N elements or rows.

    - ``kind``: a `MotionKind` or, for N paths, their numbers as uint8, shape (N,), printed as names.
    - ``free_until``: before this time, from 0 to 1, the meshes certainly are not within the clearance. 1 if the path is
      free.
    - ``at``: for HIT, the earliest time found at which they are within the clearance; for NEAR, the time of the first
      undecided pose; else NaN.
    - ``nearest``: their distance at the time `at`, which is 0 if they touch. If the path is free, its numbers are NaN
      and 0.
    """

    kind: Any
    free_until: Any
    at: Any
    nearest: Distance


class ClosestPoint(NamedTuple):
    """The point of a mesh that is closest to a point. After N queries, each field has N elements or rows.

    - ``found``: whether there is such a point within the given distance. If not, the numbers are NaN and 0. Shape () or
      (N,).
    - ``distance``: the distance in mesh units.
    - ``lower``: a certified lower bound of the least distance.
    - ``upper``: a certified upper bound of it.
    - ``point``: the closest point, in the frame of the query. Shape (3,) or (N, 3).
    - ``object``: the number of the object in the file. An int, or an array of uint32.
    - ``triangle``: the number of the triangle in the input or, in a file without ids, of its place. The same type.
    """

    found: Any
    distance: Any
    lower: Any
    upper: Any
    point: Floats
    object: Any
    triangle: Any


class RayHit(NamedTuple):
    """Where a ray hits a mesh. After N queries, each field has N elements or rows.

    - ``found``: whether it hits. If not, the numbers are NaN and 0. Shape () or (N,).
    - ``t``: the parameter: the hit is at origin + t * direction.
    - ``lower``: a certified lower bound of the parameter.
    - ``upper``: a certified upper bound of it.
    - ``point``: the hit, in the frame of the query. Shape (3,) or (N, 3).
    - ``object``: the number of the object in the file. An int, or an array of uint32.
    - ``triangle``: the number of the triangle in the input or, in a file without ids, of its place. The same type.
    """

    found: Any
    t: Any
    lower: Any
    upper: Any
    point: Floats
    object: Any
    triangle: Any


class SceneRelations(NamedTuple):
    """Pairs of instances, and their relations.

    - ``pairs``: numbers of instances, A and B, shape (K, 2).
    - ``relations``: numbers of `Relation` as uint8, shape (K,), printed as names.
    """

    pairs: NDArray[np.int64]
    relations: NDArray[np.uint8]


class SceneContacts(NamedTuple):
    """Pairs of triangles in contact, in ascending order of the pairs of instances.

    - ``pairs``: numbers of instances, A and B, shape (K, 2).
    - ``triangles``: object and triangle of A, object and triangle of B, shape (K, 4).
    """

    pairs: NDArray[np.int64]
    triangles: NDArray[np.uint32]


class SceneDistance(NamedTuple):
    """A pair of instances, and how far apart they are.

    - ``a``: the number of the instance in whose frame the points are given.
    - ``b``: the number of the other instance.
    - ``nearest``: the answer of `Mesh.distance`.
    """

    a: int
    b: int
    nearest: Distance


class SceneSignedDistance(NamedTuple):
    """The pair of instances with the least signed distance.

    - ``a``: the number of the instance in whose frame points, normal and translation are given.
    - ``b``: the number of the other instance.
    - ``nearest``: the answer of `Mesh.signed_distance`.
    """

    a: int
    b: int
    nearest: SignedDistance


class SceneNearPairs(NamedTuple):
    """The pairs of instances that overlap or are near each other, in their order.

    - ``pairs``: numbers of instances, A and B, shape (K, 2).
    - ``distance``: the signed distances as numbers, between both bounds: the distance or, where two overlap, ``nearest.lower``. Shape
      (K,).
    - ``nearest``: the answers of `Mesh.signed_distance`, arrays of K elements or rows, with points and directions in A's frame.
    """

    pairs: NDArray[np.int64]
    distance: Floats
    nearest: SignedDistance


class SceneDistances(NamedTuple):
    """Pairs of instances, and how far apart they are.

    - ``pairs``: numbers of instances, A and B, shape (K, 2).
    - ``nearest``: the answers of `Mesh.distance`, arrays of K elements or rows, with points in A's frame.
    """

    pairs: NDArray[np.int64]
    nearest: Distance


class ScenePenetrations(NamedTuple):
    """Pairs of instances, and how deep they overlap.

    - ``pairs``: numbers of instances, A and B, shape (K, 2).
    - ``depth``: the answers of `Mesh.penetration`, arrays of K elements or rows, in A's frame.
    """

    pairs: NDArray[np.int64]
    depth: Penetration


class SceneClashes(NamedTuple):
    """Pairs of instances that clash, and how.

    - ``pairs``: numbers of instances, A and B, shape (K, 2).
    - ``clash``: the answers of `Mesh.clash`, arrays of K elements or rows, in A's frame. Boxes of magnitudes alone are in the world and
      along its axes.
    """

    pairs: NDArray[np.int64]
    clash: Clash


class SceneMotionAnswer(NamedTuple):
    """Whether the paths of instances are free.

    - ``kind``: a `MotionKind`.
    - ``free_until``: before this time, from 0 to 1, certainly no pair is within the clearance. 1 if the paths are free.
    - ``at``: for HIT, the earliest time found at which a pair is within the clearance; for NEAR, the time of the first
      undecided pose; else NaN.
    - ``a``: the number of an instance of that pair: the one that stands still or, if both move, the first one. None if
      the paths are free.
    - ``b``: the number of the other instance.
    - ``nearest``: the distance of the pair at that time, with points in A's frame.
    """

    kind: MotionKind
    free_until: float
    at: float
    a: int | None
    b: int | None
    nearest: Distance | None


class SceneClosestPoint(NamedTuple):
    """The point of all instances that is closest to a point. After N queries, each field has N elements or rows.

    - ``instance``: the number of the instance; -1 if nothing is found. Shape () or (N,).
    - ``closest``: the answer of `Mesh.closest_points`, in the world.
    """

    instance: Any
    closest: ClosestPoint


class SceneRayHit(NamedTuple):
    """Where a ray hits an instance. After N queries, each field has N elements or rows.

    - ``instance``: the number of the instance; -1 if nothing is hit. Shape () or (N,).
    - ``hit``: the answer of `Mesh.first_hits`, in the world.
    """

    instance: Any
    hit: RayHit


class _Names(np.ndarray[Any, np.dtype[Any]]):
    """An array of numbers that have names. It prints the names, and its elements are members of the enumeration.
    Results of computations with it are plain arrays."""

    kind: ClassVar[type[_Named]]

    def __getitem__(self, key: Any) -> Any:
        found = super().__getitem__(key)
        return self.kind(int(found)) if isinstance(found, np.integer) else found

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, **keywords: Any) -> Any:
        def plain(value: Any) -> Any:
            return value.view(np.ndarray) if isinstance(value, _Names) else value

        if "out" in keywords:
            keywords["out"] = tuple(map(plain, keywords["out"]))
        return getattr(ufunc, method)(*map(plain, inputs), **keywords)

    def _printed(self) -> str:
        members = {int(member): member.name for member in self.kind}
        numbers = self.view(np.ndarray)
        if numbers.dtype.kind not in "iu":
            return np.array2string(numbers, separator=", ")
        names: Any = {"int_kind": lambda number: members.get(int(number), str(number))}
        return np.array2string(numbers, separator=", ", formatter=names)

    def __str__(self) -> str:
        return self._printed()

    def __repr__(self) -> str:
        return f"{self.kind.__name__}({self._printed()})"


class _Relations(_Names):
    kind = Relation


class _Sides(_Names):
    kind = Side


class _MotionKinds(_Names):
    kind = MotionKind


class _RegionKinds(_Names):
    kind = RegionKind


class _SelfContactKinds(_Names):
    kind = SelfContactKind


class _ClashClasses(_Names):
    kind = ClashClass


_ARRAYS: dict[type[_Named], type[_Names]] = {
    array.kind: array
    for array in (_Relations, _Sides, _MotionKinds, _RegionKinds, _SelfContactKinds, _ClashClasses)
}


def named(kind: type[_Named], found: Any) -> Any:
    """The name of a number, or an array of the numbers of N answers that prints their names."""
    return kind(found) if type(found) is int else found.view(_ARRAYS[kind])


def clash_of(found: tuple[Any, ...]) -> Clash:
    """What the compiled module tells of clashes."""
    kind, relation, distance, point, depth, shared = found
    magnitudes = None if shared is None else Intersection(*shared)
    return Clash(named(ClashClass, kind), named(Relation, relation), distance, point, Penetration(*depth), magnitudes)


def regions_of(found: tuple[Any, ...]) -> ContactRegions:
    """What the compiled module tells of contact regions."""
    triangles, kind, *rest = found
    return ContactRegions(triangles, named(RegionKind, kind), *rest)


def patches_of(found: tuple[Any, ...]) -> Patches:
    """What the compiled module tells of patches."""
    regions: Any = regions_of(found[-2])
    return Patches(*found[:-2] + (regions, *found[-1]))
