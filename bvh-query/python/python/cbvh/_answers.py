"""What questions answer with: enumerations and named tuples of numbers and arrays."""

from __future__ import annotations

import enum
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


class Relation(enum.IntEnum):
    """How two meshes lie."""

    TOUCHING = 0
    """Their surfaces have a point in common."""
    APART = 1
    """They have nothing in common, insides included."""
    A_IN_B = 2
    """All of the first mesh is inside the second."""
    B_IN_A = 3
    """All of the second mesh is inside the first."""
    MIXED = 4
    """Some parts of a mesh are inside the other and some are not, or some of each mesh are."""
    UNDEFINED = 5
    """A mesh that is not closed would have to contain something."""


class Side(enum.IntEnum):
    """Where a point is with regard to a mesh."""

    OUTSIDE = 0
    INSIDE = 1
    ON = 2
    UNDEFINED = 3
    """The point is not on the surface, and the mesh has no inside: it is not closed."""


class MotionKind(enum.IntEnum):
    """Whether a way is free."""

    FREE = 0
    """At no time are the meshes within the clearance."""
    HIT = 1
    """At the time `at`, they are."""
    NEAR = 2
    """They come nearer than the clearance and the tolerance, and in no pose looked at within the clearance."""


class Distance(NamedTuple):
    """The least distance of two meshes. After N questions, each field has N elements or rows."""

    distance: Any
    """The distance in mesh units: 0 where they touch. Shape () or (N,)."""
    lower: Any
    """A certain lower bound of the least distance of the meshes."""
    upper: Any
    """A certain upper bound of it."""
    point_a: Floats
    """The closest point of the first mesh, in its frame. Shape (3,) or (N, 3)."""
    point_b: Floats
    """The closest point of the second mesh, in the frame of the first."""
    object_a: Any
    """The number of the first mesh's object in its file."""
    triangle_a: Any
    """The number of its triangle in the input, or of its place in a file without ids."""
    object_b: Any
    triangle_b: Any


class MotionAnswer(NamedTuple):
    """Whether a way is free, and where it ends if it is not. After N questions, each field has N elements or rows."""

    kind: Any
    """A `MotionKind` or, of N, their numbers, shape (N,)."""
    free_until: Any
    """Before this time, from 0 to 1, the meshes certainly are not within the clearance. 1 where the way is free."""
    at: Any
    """Of a hit, a time at which they are, the earliest one found; of NEAR, that of the first undecided pose; else
    NaN."""
    distance: Distance
    """Their distance at the time `at`, where the way is not free: 0 where they touch. Else its numbers are NaN and
    0."""


class ClosestPoint(NamedTuple):
    """The point of a mesh that is closest to a point. After N questions, each field has N elements or rows."""

    found: Any
    """Whether there is one within the distance asked for. Else the numbers are NaN and 0. Shape () or (N,)."""
    distance: Any
    """The distance in mesh units."""
    lower: Any
    """A certain lower bound of the least distance."""
    upper: Any
    """A certain upper bound of it."""
    point: Floats
    """The closest point, in the frame of the question. Shape (3,) or (N, 3)."""
    object: Any
    """The number of the object in the file."""
    triangle: Any
    """The number of the triangle in the input, or of its place in a file without ids."""


class RayHit(NamedTuple):
    """Where a ray hits a mesh. After N questions, each field has N elements or rows."""

    found: Any
    """Whether it hits. Else the numbers are NaN and 0. Shape () or (N,)."""
    t: Any
    """The parameter: the hit is at origin + t * direction."""
    lower: Any
    """A certain lower bound of the parameter."""
    upper: Any
    """A certain upper bound of it."""
    point: Floats
    """The hit, in the frame of the question. Shape (3,) or (N, 3)."""
    object: Any
    """The number of the object in the file."""
    triangle: Any
    """The number of the triangle in the input, or of its place in a file without ids."""


class SceneRelations(NamedTuple):
    """Pairs of instances, and how they lie."""

    pairs: NDArray[np.int64]
    """Numbers of instances, A and B, shape (K, 2)."""
    relations: NDArray[np.uint8]
    """Numbers of `Relation`, shape (K,)."""


class SceneContacts(NamedTuple):
    """Pairs of triangles in contact, in ascending order of the pairs of instances."""

    pairs: NDArray[np.int64]
    """Numbers of instances, A and B, shape (K, 2)."""
    triangles: NDArray[np.uint32]
    """Object and triangle of A, object and triangle of B, shape (K, 4)."""


class SceneDistance(NamedTuple):
    """A pair of instances, and how far apart they are."""

    a: int
    """The number of the instance whose frame the points are in."""
    b: int
    """The number of the other instance."""
    distance: Distance
    """The answer of `Mesh.distance`."""


class SceneMotion(NamedTuple):
    """Whether the ways of instances are free."""

    kind: MotionKind
    free_until: float
    """Before this time, from 0 to 1, certainly no pair is within the clearance. 1 where the ways are free."""
    at: float
    """Of a hit, a time at which a pair is, the earliest one found; of NEAR, that of the first undecided pose; else
    NaN."""
    nearest: SceneDistance | None
    """The pair, and its distance at that time; A is the one that stands still or, if both move, the first one. None
    where the ways are free."""


class SceneClosestPoint(NamedTuple):
    """The point of all instances that is closest to a point. After N questions, each field has N elements or rows."""

    instance: Any
    """The number of the instance; -1 where nothing is found. Shape () or (N,)."""
    closest: ClosestPoint
    """The answer of `Mesh.closest_points`, in the world."""


class SceneRayHit(NamedTuple):
    """Where a ray hits an instance. After N questions, each field has N elements or rows."""

    instance: Any
    """The number of the instance; -1 where nothing is hit. Shape () or (N,)."""
    hit: RayHit
    """The answer of `Mesh.first_hits`, in the world."""


Number = TypeVar("Number", bound=enum.IntEnum)


def named(kind: type[Number], found: Any) -> Any:
    """The name of a number, or the numbers of N answers as they are."""
    return kind(found) if type(found) is int else found


_SIGNS = np.array([1.0, -1.0, 1.0, np.nan])


def signed(distances: Any, sides: Any) -> Any:
    """Distances, negative inside and NaN where there is no inside."""
    return distances * (_SIGNS[sides].item() if type(sides) is int else _SIGNS[sides])
