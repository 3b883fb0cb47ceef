"""Exact collision and distance queries between triangle meshes.

A mesh is baked once, from arrays or from a file, into a ``.cbvh`` file that is mapped into memory as it is:

>>> import cbvh, numpy as np
>>> tetrahedron = cbvh.bake([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
>>> pose = np.eye(4)
>>> pose[:3, 3] = [0, 0, 3]
>>> tetrahedron.collide(tetrahedron, pose)
False
>>> tetrahedron.distance(tetrahedron, pose).distance
2.0

**Poses** are arrays of shape (4, 4), for one question, or (N, 4, 4), for N questions. A pose maps *body to world*: a point
``x`` of the body stands at ``pose[:3, :3] @ x + pose[:3, 3]`` in the world. For two meshes, the world is the frame of
the first one. Rotations must be rigid to within 2^-20.

**Answers** to one question are plain values; answers to N questions are arrays of N elements or rows. Lengths are in mesh
units. Contact and insides are decided exactly: touching is contact, and the surface of a mesh is what collides.

**Threads.** While a question is asked, other threads of Python run, and any number of threads may ask at the same time.
``parallel=True`` divides the N questions of one call among all cores; the answers are the same bits.

Errors are exceptions: ``ValueError`` for arguments that mean nothing, ``OSError`` for files that the system refuses,
``FormatError`` for files that are damaged or no .cbvh files, ``BakeError`` for meshes that cannot be baked.
"""

from __future__ import annotations

import enum
import os
from typing import Any, NamedTuple, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _cbvh
from ._cbvh import BakeError, FormatError, __version__

__all__ = [
    "BakeError",
    "ClosestPoint",
    "Distance",
    "FormatError",
    "Mesh",
    "RayHit",
    "Relation",
    "Side",
    "bake",
    "bake_files",
    "open",
    "__version__",
]

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


def _numbers(value: ArrayLike, name: str, dtype: Any) -> NDArray[Any]:
    """An array of numbers as C-contiguous ``dtype``, without a copy where it is one already."""
    array = np.asarray(value)
    if array.dtype.kind not in "fiu" and array.size > 0:
        raise TypeError(f"{name}: expected numbers, found dtype {array.dtype}")
    return np.ascontiguousarray(array, dtype=dtype)


def _rows(value: ArrayLike, name: str, *row: int) -> tuple[Floats, bool]:
    """Rows of shape ``row``, and whether ``value`` is one row alone."""
    array = _numbers(value, name, np.float64)
    one = array.shape == row
    if not one and (array.ndim != len(row) + 1 or array.shape[1:] != row):
        shape = ", ".join(map(str, row))
        comma = "," if len(row) == 1 else ""
        raise ValueError(f"{name}: expected shape ({shape}{comma}) or (N, {shape}), found {array.shape}")
    return array.reshape(-1, *row), one


def _poses(value: ArrayLike, name: str = "poses") -> tuple[Floats, bool]:
    return _rows(value, name, 4, 4)


def _pose(value: ArrayLike | None) -> Floats:
    if value is None:
        return np.eye(4)
    pose, one = _poses(value, "pose")
    if not one:
        raise ValueError(f"pose: expected shape (4, 4), found {np.shape(value)}")
    return pose[0]


def _answer(kind: Any, fields: Sequence[NDArray[Any]], one: bool) -> Any:
    """A named tuple of arrays or, for one question, of its elements."""
    return kind(*(field[0] if field.ndim > 1 else field[0].item() for field in fields)) if one else kind(*fields)


def _other(mesh: Mesh) -> _cbvh.Mesh:
    if not isinstance(mesh, Mesh):
        raise TypeError(f"other: expected a cbvh.Mesh, found {type(mesh).__name__}")
    return mesh._mesh


class Mesh:
    """A mesh in a ``.cbvh`` file: all objects of the file, or one. Made by `open` and `bake`.

    It is never changed, so threads may share it. Pickling one that was opened from a file stores the path alone, so that
    other processes map the same file; pickling one in memory stores its bytes.
    """

    __slots__ = ("_mesh", "_path", "_object")

    def __init__(self, mesh: _cbvh.Mesh, path: str | None = None, object: int | None = None) -> None:
        self._mesh, self._path, self._object = mesh, path, object

    @staticmethod
    def from_bytes(data: bytes) -> Mesh:
        """Opens the bytes of a ``.cbvh`` file."""
        return Mesh(_cbvh.Mesh.from_bytes(data))

    def __reduce__(self) -> tuple[Any, ...]:
        if self._path is not None:
            return (open, (self._path, self._object))
        return (_unpickle, (self._mesh.bytes(), self._object))

    def __repr__(self) -> str:
        place = "in memory" if self._path is None else repr(self._path)
        object = "" if self._object is None else f", object {self._object}"
        return f"<cbvh.Mesh {place}{object}: {self.triangles} triangles>"

    @property
    def triangles(self) -> int:
        """The number of triangles, without exact duplicates."""
        return self._mesh.triangles()

    @property
    def names(self) -> list[str]:
        """The names of all objects of the file."""
        return self._mesh.names()

    @property
    def nbytes(self) -> int:
        """The bytes of the file, which are all the memory that the mesh takes."""
        return self._mesh.size()

    def object(self, object: int | str) -> Mesh:
        """One object of the file, by number or name."""
        if isinstance(object, str):
            names = self.names
            if names.count(object) != 1:
                raise ValueError(f"object: expected one name of {names}, found {object!r}")
            object = names.index(object)
        return Mesh(self._mesh.object(object), self._path, object)

    def check(self) -> None:
        """Checks all checksums and rules of the whole file, which questions check only where they go.

        Raises FormatError for the first rule that is broken.
        """
        self._mesh.check()

    def tobytes(self) -> bytes:
        """The bytes of the file."""
        return self._mesh.bytes()

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes the file. A file of that name is replaced when all is written."""
        temporary = f"{os.fspath(path)}.{os.getpid()}.tmp"
        try:
            with _open_file(temporary, "xb") as file:
                file.write(self.tobytes())
            os.replace(temporary, path)
        except BaseException:
            if os.path.exists(temporary):
                os.remove(temporary)
            raise

    def collide(self, other: Mesh, poses: ArrayLike, *, parallel: bool = False) -> Any:
        """Do the surfaces touch? Exact: bool, or an array of bool of shape (N,).

        ``poses``: of ``other`` in the frame of this mesh (body to world), shape (4, 4) or (N, 4, 4).
        """
        rows, one = _poses(poses)
        found = _cbvh.collide(self._mesh, _other(other), rows, parallel)
        return bool(found[0]) if one else found

    def within(self, other: Mesh, poses: ArrayLike, d: float, *, parallel: bool = False) -> Any:
        """Are they at most ``d`` mesh units apart? Exact: bool, or an array of bool of shape (N,).

        ``poses``: of ``other`` in the frame of this mesh (body to world), shape (4, 4) or (N, 4, 4).
        """
        rows, one = _poses(poses)
        found = _cbvh.within(self._mesh, _other(other), rows, d, parallel)
        return bool(found[0]) if one else found

    def distance(
        self,
        other: Mesh,
        poses: ArrayLike,
        *,
        rel_err: float = 0.0,
        abs_err: float = 0.0,
        parallel: bool = False,
    ) -> Distance:
        """How far apart are they? The least distance, a pair of closest points, and their triangles.

        ``poses``: of ``other`` in the frame of this mesh (body to world), shape (4, 4) or (N, 4, 4). ``rel_err`` and
        ``abs_err`` let the answer exceed the least distance by a fraction of it or by a length, which saves time;
        ``lower`` is what is certain. They cannot be combined with ``parallel``.
        """
        rows, one = _poses(poses)
        if rel_err == 0 and abs_err == 0:
            return _answer(Distance, _cbvh.distance(self._mesh, _other(other), rows, parallel), one)
        if parallel:
            raise ValueError("parallel: expected False with rel_err or abs_err, found True")
        return _answer(Distance, _cbvh.distance_with(self._mesh, _other(other), rows, rel_err, abs_err), one)

    def relation(self, other: Mesh, poses: ArrayLike, *, parallel: bool = False) -> Any:
        """Do they touch and, if not, is one inside the other? A `Relation`, or an array of their numbers, shape (N,).

        ``poses``: of ``other``, mesh B, in the frame of this mesh, A (body to world), shape (4, 4) or (N, 4, 4).
        """
        rows, one = _poses(poses)
        found = _cbvh.relation(self._mesh, _other(other), rows, parallel)
        return Relation(int(found[0])) if one else found

    def contacts(self, other: Mesh, poses: ArrayLike, *, parallel: bool = False) -> Any:
        """All pairs of triangles that touch, exactly, in ascending order.

        An array of uint32 of shape (K, 4) for one pose, or a list of N of them. The columns are object and triangle of
        this mesh, and object and triangle of ``other``. Triangles are numbered as in the input.

        ``poses``: of ``other`` in the frame of this mesh (body to world), shape (4, 4) or (N, 4, 4).
        """
        rows, one = _poses(poses)
        starts, pairs = _cbvh.contacts(self._mesh, _other(other), rows, parallel)
        return pairs if one else np.split(pairs, starts[1:-1]) if len(rows) else []

    def closest_points(
        self,
        points: ArrayLike,
        *,
        within: float = np.inf,
        pose: ArrayLike | None = None,
        parallel: bool = False,
    ) -> ClosestPoint:
        """The points of the surface that are closest to ``points``, of shape (3,) or (N, 3).

        ``within``: look no farther, in mesh units. ``pose``: of this mesh in the frame of the points (body to world),
        shape (4, 4); None: they are in the frame of the mesh.
        """
        rows, one = _rows(points, "points", 3)
        return _answer(ClosestPoint, _cbvh.closest_points(self._mesh, rows, within, _pose(pose), parallel), one)

    def sides(self, points: ArrayLike, *, pose: ArrayLike | None = None, parallel: bool = False) -> Any:
        """Which side of the surface each point is on, exactly: a `Side`, or an array of their numbers, shape (N,).

        ``points`` have shape (3,) or (N, 3). ``pose``: of this mesh in the frame of the points (body to world).
        """
        rows, one = _rows(points, "points", 3)
        found = _cbvh.sides(self._mesh, rows, _pose(pose), parallel)
        return Side(int(found[0])) if one else found

    def signed_distances(
        self, points: ArrayLike, *, pose: ArrayLike | None = None, parallel: bool = False
    ) -> Any:
        """Distances of points from the surface, negative inside: a float, or an array of shape (N,).

        NaN where the mesh has no inside, because it is not closed. ``points`` have shape (3,) or (N, 3). ``pose``: of this
        mesh in the frame of the points (body to world).
        """
        rows, one = _rows(points, "points", 3)
        placed = _pose(pose)
        distances = _cbvh.closest_points(self._mesh, rows, np.inf, placed, parallel)[1]
        sides = _cbvh.sides(self._mesh, rows, placed, parallel)
        signs = np.array([1.0, -1.0, 1.0, np.nan])[sides]
        return (distances * signs)[0].item() if one else distances * signs

    def _rays(self, origins: ArrayLike, directions: ArrayLike, until: ArrayLike) -> tuple[Any, ...]:
        starts, one = _rows(origins, "origins", 3)
        ways, _ = _rows(directions, "directions", 3)
        ends = np.broadcast_to(_numbers(until, "until", np.float64), (len(starts),))
        return (self._mesh, starts, ways, np.ascontiguousarray(ends)), one

    def first_hits(
        self,
        origins: ArrayLike,
        directions: ArrayLike,
        *,
        until: ArrayLike = np.inf,
        pose: ArrayLike | None = None,
        parallel: bool = False,
    ) -> RayHit:
        """Where rays first hit the surface: which triangle, and at which parameter.

        ``origins`` and ``directions`` have shape (3,) or (N, 3); directions of any length are the unit of ``t``. ``until``:
        the greatest parameter, of shape () or (N,). ``pose``: of this mesh in the frame of the rays (body to world).
        """
        rays, one = self._rays(origins, directions, until)
        return _answer(RayHit, _cbvh.first_hits(*rays, _pose(pose), parallel), one)

    def any_hits(
        self,
        origins: ArrayLike,
        directions: ArrayLike,
        *,
        until: ArrayLike = np.inf,
        pose: ArrayLike | None = None,
        parallel: bool = False,
    ) -> Any:
        """Whether rays hit the surface, exactly: bool, or an array of shape (N,). Arguments are those of `first_hits`."""
        rays, one = self._rays(origins, directions, until)
        found = _cbvh.any_hits(*rays, _pose(pose), parallel)
        return bool(found[0]) if one else found

    def all_hits(
        self,
        origins: ArrayLike,
        directions: ArrayLike,
        *,
        until: ArrayLike = np.inf,
        pose: ArrayLike | None = None,
        parallel: bool = False,
    ) -> Any:
        """All triangles that rays hit, in the exact order along each: a `RayHit` of arrays of K elements, or a list of N.

        Arguments are those of `first_hits`.
        """
        rays, one = self._rays(origins, directions, until)
        starts, hits = _cbvh.all_hits(*rays, _pose(pose), parallel)
        if one:
            return RayHit(*hits)
        parts = [np.split(field, starts[1:-1]) for field in hits]
        return [RayHit(*fields) for fields in zip(*parts)] if len(starts) > 1 else []

    def meet_segments(
        self, starts: ArrayLike, ends: ArrayLike, *, pose: ArrayLike | None = None, parallel: bool = False
    ) -> Any:
        """Whether closed segments meet the surface, exactly: bool, or an array of shape (N,).

        ``starts`` and ``ends`` have shape (3,) or (N, 3). ``pose``: of this mesh in their frame (body to world).
        """
        first, one = _rows(starts, "starts", 3)
        last, _ = _rows(ends, "ends", 3)
        found = _cbvh.meet_segments(self._mesh, first, last, _pose(pose), parallel)
        return bool(found[0]) if one else found


_open_file = open


def open(path: str | os.PathLike[str], object: int | str | None = None) -> Mesh:
    """Maps a ``.cbvh`` file, or one object of it by number or name. Takes microseconds, whatever the size."""
    mesh = Mesh(_cbvh.Mesh.open(os.fspath(path)), os.path.abspath(path))
    return mesh if object is None else mesh.object(object)


def _unpickle(data: bytes, object: int | None) -> Mesh:
    mesh = Mesh.from_bytes(data)
    return mesh if object is None else mesh.object(object)


def _options(
    profile: str | None,
    triangles: str | None,
    max_error: float | None,
    effort: str | None,
    ids: bool,
    topology: bool,
) -> dict[str, Any]:
    return {
        "profile": profile,
        "triangles": triangles,
        "max_error": max_error,
        "effort": effort,
        "ids": ids,
        "topology": topology,
    }


def bake(
    vertices: ArrayLike,
    faces: ArrayLike,
    *,
    profile: str | None = None,
    triangles: str | None = None,
    max_error: float | None = None,
    effort: str | None = None,
    ids: bool = True,
    topology: bool = True,
) -> Mesh:
    """Bakes a mesh in memory.

    ``vertices`` have shape (V, 3), in any unit of length; ``faces`` have shape (F, 3), three numbers of vertices each.
    ``profile``, ``triangles``, ``max_error`` and ``effort`` are those of ``cbvh bake``; None lets the baker choose. Without
    ``ids`` triangles are numbered in an order of the baker's; without ``topology`` there are no answers about insides.
    Baking takes about a microsecond a triangle. `Mesh.save` writes the result.
    """
    points = _numbers(vertices, "vertices", np.float64)
    numbers = np.asarray(faces)
    for array, name, per in ((points, "vertices", "V"), (numbers, "faces", "F")):
        if array.ndim != 2 or array.shape[1] != 3:
            raise ValueError(f"{name}: expected shape ({per}, 3), found {array.shape}")
    if numbers.dtype.kind not in "iu":
        raise TypeError(f"faces: expected integers, found dtype {numbers.dtype}")
    if numbers.size and not 0 <= numbers.min() <= numbers.max() < len(points):
        found = f"{numbers.min()} to {numbers.max()}"
        raise ValueError(f"faces: expected numbers from 0 to {len(points) - 1}, found {found}")
    options = _options(profile, triangles, max_error, effort, ids, topology)
    return Mesh(_cbvh.bake(points, np.ascontiguousarray(numbers, dtype=np.uint32), options))


def bake_files(
    inputs: str | os.PathLike[str] | Sequence[str | os.PathLike[str]],
    output: str | os.PathLike[str],
    *,
    profile: str | None = None,
    triangles: str | None = None,
    max_error: float | None = None,
    effort: str | None = None,
    ids: bool = True,
    topology: bool = True,
    max_memory: int | None = None,
    force: bool = False,
) -> Mesh:
    """Bakes mesh files (OBJ, STL, PLY, glTF) into a ``.cbvh`` file, and opens it.

    Nothing is done if the file is up to date, unless ``force``. ``max_memory``: stay within so many bytes; the rest goes to
    scratch files, so that a mesh may be larger than memory. The other options are those of `bake`.
    """
    files = [inputs] if isinstance(inputs, (str, os.PathLike)) else list(inputs)
    options = _options(profile, triangles, max_error, effort, ids, topology)
    _cbvh.bake_files([os.fspath(file) for file in files], os.fspath(output), options, max_memory, force)
    return open(output)
