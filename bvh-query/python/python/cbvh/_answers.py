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


class Distance(NamedTuple):
    """The least distance of two meshes. After N questions, each field has N elements or rows.

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


class MotionAnswer(NamedTuple):
    """Whether a path is free, and where it ends if it is not. After N questions, each field has N elements or rows.

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
    """The point of a mesh that is closest to a point. After N questions, each field has N elements or rows.

    - ``found``: whether there is such a point within the given distance. If not, the numbers are NaN and 0. Shape () or
      (N,).
    - ``distance``: the distance in mesh units.
    - ``lower``: a certified lower bound of the least distance.
    - ``upper``: a certified upper bound of it.
    - ``point``: the closest point, in the frame of the question. Shape (3,) or (N, 3).
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
    """Where a ray hits a mesh. After N questions, each field has N elements or rows.

    - ``found``: whether it hits. If not, the numbers are NaN and 0. Shape () or (N,).
    - ``t``: the parameter: the hit is at origin + t * direction.
    - ``lower``: a certified lower bound of the parameter.
    - ``upper``: a certified upper bound of it.
    - ``point``: the hit, in the frame of the question. Shape (3,) or (N, 3).
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


class SceneDistances(NamedTuple):
    """Pairs of instances, and how far apart they are.

    - ``pairs``: numbers of instances, A and B, shape (K, 2).
    - ``nearest``: the answers of `Mesh.distance`, arrays of K elements or rows, with points in A's frame.
    """

    pairs: NDArray[np.int64]
    nearest: Distance


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
    """The point of all instances that is closest to a point. After N questions, each field has N elements or rows.

    - ``instance``: the number of the instance; -1 if nothing is found. Shape () or (N,).
    - ``closest``: the answer of `Mesh.closest_points`, in the world.
    """

    instance: Any
    closest: ClosestPoint


class SceneRayHit(NamedTuple):
    """Where a ray hits an instance. After N questions, each field has N elements or rows.

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


_ARRAYS: dict[type[_Named], type[_Names]] = {Relation: _Relations, Side: _Sides, MotionKind: _MotionKinds}


def named(kind: type[_Named], found: Any) -> Any:
    """The name of a number, or an array of the numbers of N answers that prints their names."""
    return kind(found) if type(found) is int else found.view(_ARRAYS[kind])
