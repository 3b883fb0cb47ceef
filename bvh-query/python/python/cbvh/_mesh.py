"""Meshes, and all queries about one mesh or a pair."""

from __future__ import annotations

import operator
import os
from typing import Any, Iterable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _cbvh
from ._answers import (
    Clash,
    ClosestPoint,
    Distance,
    Floats,
    Intersection,
    IntersectionSurface,
    MotionAnswer,
    MotionKind,
    OpenEdge,
    OpenEdges,
    Penetration,
    RayHit,
    Relation,
    SelfContactKind,
    SelfContacts,
    Separation,
    Side,
    SignedDistance,
    clash_of,
    named,
    patches_of,
    regions_of,
)
from ._motion import Motion, Path, read_paths
from ._view import View, called, limit, show


def _other(mesh: Mesh) -> _cbvh.Mesh:
    if not isinstance(mesh, Mesh):
        raise TypeError(f"other: expected a cbvh.Mesh, found {type(mesh).__name__}")
    return mesh._mesh


class Mesh:
    """A mesh in a ``.cbvh`` file: all objects of the file, or one. Made by `open` and `bake`.

    A mesh never changes, so threads may share it. Pickling a mesh that was opened from a file stores only the path, so
    that other processes map the same file. Pickling a mesh in memory stores its bytes.
    """

    __slots__ = ("_mesh", "_path", "_object")

    def __init__(self, mesh: _cbvh.Mesh, path: str | None = None, object: int | None = None) -> None:
        if not isinstance(mesh, _cbvh.Mesh):
            raise TypeError(f"expected cbvh.open or cbvh.bake to make a mesh, found {type(mesh).__name__}")
        self._mesh, self._path, self._object = mesh, path, object

    @staticmethod
    def from_bytes(data: bytes | bytearray | memoryview) -> Mesh:
        """Opens the bytes of a ``.cbvh`` file, which are copied."""
        return Mesh(_cbvh.Mesh.from_bytes(bytes(memoryview(data))))

    def __reduce__(self) -> tuple[Any, ...]:
        shape = (self._object, self.radius, self.is_solid)
        if self._path is not None:
            return (_unpickle, (self._path, *shape))
        return (_unpickle, (self._mesh.bytes(), *shape))

    def __copy__(self) -> Mesh:
        return self

    def __deepcopy__(self, memo: dict[int, Any]) -> Mesh:
        return self

    def __repr__(self) -> str:
        place = "in memory" if self._path is None else repr(self._path)
        object = "" if self._object is None else f", object {self._object}"
        radius = f", radius {self.radius:g}" if self.radius else ""
        solid = ", solid" if self.is_solid else ""
        return f"<cbvh.Mesh {place}{object}: {self.triangle_count} triangles{radius}{solid}>"

    @property
    def triangle_count(self) -> int:
        """The number of triangles, without exact duplicates."""
        return self._mesh.count()

    @property
    def triangles(self) -> Floats:
        """The corners of all triangles as they are stored, in mesh units: shape (T, 3, 3), float64.

        ``mesh.triangles[id]`` has the three corners of the triangle that answers call ``id``, in the order of the input
        or a cyclic permutation of it. A duplicate that was left out has the corners of the triangle that is stored for
        it. If this mesh does not have an id, its row is NaN: the id belongs to another object of the file, or is an
        empty place in a file without ids. Each access reads and checks the whole file and makes a new array. Raises
        ValueError for several objects of a file without ids, because their numbers are not unique.
        """
        return self._mesh.corners()

    @property
    def vertices(self) -> Floats:
        """The positions of all corners, each once, ascending by x, then y, then z, in mesh units: shape (V, 3),
        float64.

        Each access costs a sort. `arrays` returns `faces` as well and reads the file only once.
        """
        return self.arrays()[0]

    @property
    def faces(self) -> NDArray[np.int64]:
        """Three indices into `vertices` per triangle, shape (T, 3): ``mesh.vertices[mesh.faces[id]]`` is
        ``mesh.triangles[id]``. If this mesh does not have an id, its row is -1."""
        return self.arrays()[1]

    def arrays(self) -> tuple[Floats, NDArray[np.int64]]:
        """`vertices` and `faces`. If the mesh has all ids, `bake` takes both."""
        corners = self.triangles
        is_there = ~np.isnan(corners[:, 0, 0])
        vertices, numbers = np.unique(corners[is_there].reshape(-1, 3), axis=0, return_inverse=True)
        faces = np.full((len(corners), 3), -1, np.int64)
        faces[is_there] = numbers.reshape(-1, 3)
        return vertices, faces

    @property
    def bounds(self) -> Floats:
        """The lower and the upper corner of an axis-aligned box that contains all vertices, in mesh units, shape (2, 3).

        It is exact where each coordinate is the sum of the object's origin and a float32, and else wider by what float32 leaves
        out, usually some 1e-7 of its size. The radius is not part of it.
        """
        return self._mesh.bounds()

    @property
    def names(self) -> list[str]:
        """The names of all objects of the file."""
        return self._mesh.names()

    @property
    def nbytes(self) -> int:
        """The size of the file in bytes, which is all the memory that the mesh takes."""
        return self._mesh.size()

    def object(self, object: int | str) -> Mesh:
        """One object of the file, by number or name.

        Raises IndexError for a number that no object has, such as a negative one, and ValueError for a name that none or several
        have.
        """
        if isinstance(object, str):
            names = self.names
            if names.count(object) != 1:
                raise ValueError(f"object: expected one name of {names}, found {object!r}")
            object = names.index(object)
        try:
            number = operator.index(object)
        except TypeError:
            raise TypeError(f"object: expected a number or a name, found {type(object).__name__}") from None
        # A number that is too large for the compiled module names no object either.
        found = self._mesh.object(number if 0 <= number < 2**63 else -1)
        return Mesh(found, self._path, number)

    def rounded(self, radius: float) -> Mesh:
        """The same triangles with a radius in mesh units: all points at most that far from them.

        The radius replaces the one that the mesh has. Two shapes touch if their triangles are no farther apart than the sum of
        their radii, exactly, and their distance is that of the triangles less the sum, at least 0. The file stays the same, and
        is shared.
        """
        return Mesh(self._mesh.rounded(_cbvh.number(radius, "radius")), self._path, self._object)

    def solid(self) -> Mesh:
        """The same mesh as a solid: what is inside it touches it, at distance 0. Raises ValueError if it is not closed."""
        return Mesh(self._mesh.solid(), self._path, self._object)

    @property
    def radius(self) -> float:
        """How far the shape reaches from its triangles, in mesh units."""
        return self._mesh.radius()

    @property
    def max_move(self) -> float:
        """How far a vertex may be from the one that was given to the baker, in mesh units.

        It is 0 unless vertices were quantised, rounded or welded on purpose, or lay below 2^-180. Answers are about the mesh as
        it is stored.
        """
        return self._mesh.max_move()

    @property
    def is_solid(self) -> bool:
        """Whether what is inside touches the mesh."""
        return self._mesh.is_solid()

    def validate(self) -> None:
        """Checks all checksums and rules of the whole file. Queries check only the parts that they touch.

        Raises FormatError for the first rule that is broken.
        """
        self._mesh.validate()

    def tobytes(self) -> bytes:
        """The bytes of the file."""
        return self._mesh.bytes()

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes the file, with the radius and the solidity of this mesh. A file of that name is replaced when all is
        written."""
        self._mesh.save(os.fsdecode(path))

    def view(
        self,
        other: Mesh | None = None,
        pose: ArrayLike | None = None,
        motion: Motion | ArrayLike | None = None,
        path: str | os.PathLike[str] | None = None,
        *,
        within: float | None = None,
        clearance: float = 0.0,
        tolerance: float | None = None,
        max_bytes: int | None = None,
    ) -> View:
        """A page that shows this mesh, this mesh and another one, or a motion of the other one. A notebook shows it at once.

        ``pose``: of ``other`` in the frame of this mesh (body to world), shape (4, 4); None is the identity. ``motion``: one
        `Motion.between`, or its first and last pose, shape (2, 4, 4). ``within`` also shows whether both meshes are at most that
        far apart. If one of these is given and ``other`` is not, this mesh is shown twice. ``clearance`` and ``tolerance`` are
        those of `motion`, and need one. ``path``: where to save the page. `View.save` saves it later, and `View.open` shows it in the browser.

        The page is one HTML file with the meshes in it. ValueError if they have more than ``max_bytes``, by default 256 MiB.
        """
        a = (self._mesh, *called(self._path))
        b = None if other is None else (_other(other), *called(other._path))
        most = limit(max_bytes)
        if motion is not None:
            if pose is not None or within is not None:
                raise ValueError("motion: expected no pose or within beside it")
            ends = motion._ends() if isinstance(motion, Motion) else motion
            return show(_cbvh.Page.motion(a, b, ends, clearance, tolerance, most), path)
        if clearance != 0 or tolerance is not None:
            raise ValueError("clearance and tolerance: expected a motion beside them, found none")
        if other is None and pose is None and within is None:
            return show(_cbvh.Page.file(a, most), path)
        return show(_cbvh.Page.pair(a, b, pose, within, most), path)

    def collide(self, other: Mesh, poses: ArrayLike, *, parallel: bool = False) -> Any:
        """Do the surfaces touch? Exact: bool, or an array of bool of shape (N,).

        ``poses``: of ``other`` in the frame of this mesh (body to world), shape (4, 4) or (N, 4, 4).
        """
        return _cbvh.collide((self._mesh, _other(other), poses, parallel))

    def within(self, other: Mesh, poses: ArrayLike, d: float, *, parallel: bool = False) -> Any:
        """Are they at most ``d`` mesh units apart? Exact: bool, or an array of bool of shape (N,).

        ``poses``: of ``other`` in the frame of this mesh (body to world), shape (4, 4) or (N, 4, 4).
        """
        return _cbvh.within((self._mesh, _other(other), poses, parallel), d)

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
        ``lower`` is then the certified bound. They cannot be combined with ``parallel``.
        """
        return Distance(*_cbvh.distance((self._mesh, _other(other), poses, parallel), rel_err, abs_err))

    def relation(self, other: Mesh, poses: ArrayLike, *, parallel: bool = False) -> Any:
        """Do they touch and, if not, is one inside the other? A `Relation`, or an array of their numbers as uint8, shape
        (N,).

        ``poses``: of ``other``, mesh B, in the frame of this mesh, A (body to world), shape (4, 4) or (N, 4, 4).
        """
        return named(Relation, _cbvh.relation((self._mesh, _other(other), poses, parallel)))

    def contacts(self, other: Mesh, poses: ArrayLike, *, parallel: bool = False) -> Any:
        """All pairs of triangles that touch, exactly, in ascending order.

        An array of uint32 of shape (K, 4) for one pose, or a list of N of them. The columns are object and triangle of
        this mesh, and object and triangle of ``other``. Triangles are numbered as in the input.

        ``poses``: of ``other`` in the frame of this mesh (body to world), shape (4, 4) or (N, 4, 4).
        """
        return _cbvh.contacts((self._mesh, _other(other), poses, parallel))

    def penetration(
        self,
        other: Mesh,
        poses: ArrayLike,
        *,
        relative_gap: float = 0.01,
        tolerance: float | None = None,
        budget: int | None = None,
        parallel: bool = False,
    ) -> Penetration:
        """How deep do they overlap? Certified bounds of the length of the shortest translation of ``other`` after which the
        insides are disjoint, and such a translation.

        Both bounds are 0 if the meshes are apart. If they only touch, ``lower`` is 0 and ``upper`` some roundings. For convex
        meshes of one object and at most 4096 triangles, the bounds are as near each other as ``relative_gap`` asks for; for
        others, the bounds say how good they are.

        ``poses``: of ``other`` in the frame of this mesh (body to world), shape (4, 4) or (N, 4, 4). The search ends when
        ``upper`` exceeds ``lower`` by no more than ``relative_gap`` of it, a part above 0; when it is known whether the depth
        exceeds ``tolerance``, in mesh units; after ``budget`` visits of nodes and triangles per pose; or when it has tried
        all it knows. Raises ValueError if a mesh is not closed, or was baked without topology. Cost: some microseconds for
        convex meshes; for others, up to a millisecond for a hundred triangles, and some for large meshes.
        """
        asked = (self._mesh, _other(other), poses, parallel)
        return Penetration(*_cbvh.penetration(asked, relative_gap, tolerance, budget))

    def signed_distance(
        self,
        other: Mesh,
        poses: ArrayLike,
        *,
        relative_gap: float = 0.01,
        tolerance: float | None = None,
        budget: int | None = None,
        parallel: bool = False,
    ) -> SignedDistance:
        """How far apart are they or, below zero, how deep do they overlap? Certified bounds of one number: the distance of
        meshes that are apart, and minus the depth of those that overlap or contain each other.

        The distance is that of `distance`, and the depth that of `penetration`. If the meshes only touch, 0 lies between the
        bounds, which are some roundings apart. A mesh that is not closed, or a cloud or a segment without a radius, has no
        depth: ``is_signed`` is then False, and the number is 0 where the meshes touch. A translation of ``other`` changes the
        number by at most its length, but the points and the normal may jump from one closest place to another.

        ``poses``: of ``other`` in the frame of this mesh (body to world), shape (4, 4) or (N, 4, 4). ``relative_gap``,
        ``tolerance`` and ``budget`` end the search for a depth, as in `penetration`. Raises ValueError if a mesh was baked
        without topology, or if ``budget`` does not suffice to find out whether the meshes are apart. Cost: that of `distance`
        or, where the meshes overlap, of `penetration`.
        """
        asked = (self._mesh, _other(other), poses, parallel)
        return SignedDistance(*_cbvh.signed_distance(asked, relative_gap, tolerance, budget))

    def clash(
        self,
        other: Mesh,
        poses: ArrayLike,
        *,
        clearance: float = 0.0,
        tolerance: float | None = None,
        relative_gap: float = 0.1,
        visits: int | None = 1 << 20,
        magnitudes: bool = False,
        parallel: bool = False,
    ) -> Clash:
        """How do they lie: apart, near, touching, overlapping, one in the other, or twice in one place?

        Flush faces overlap or come apart by roundings in nearly all poses, so that a tolerance is part of the query: parts
        that are no farther apart and no deeper in each other, by the depth of `penetration`, are touching. Where a part fits another one
        without a gap, like a peg in its hole, the depth is mostly undecided. Parts need not be closed.

        ``poses``: of ``other`` in the frame of this mesh (body to world), shape (4, 4) or (N, 4, 4). ``clearance``: parts at
        most this far apart are near, in mesh units; 0 looks for no near parts. ``tolerance``: parts at most this far apart, or
        at most this deep in each other, are touching, in mesh units; None: a millionth of the largest side of both. The search for a depth ends when
        ``upper`` exceeds ``lower`` by no more than ``relative_gap`` of it, a part above 0, or after ``visits`` visits of nodes
        and triangles; None: no limit. ``magnitudes``: whether to measure what parts have in common, as `intersection` does, and to
        divide overlapping parts into piercing and protruding ones. Raises ValueError where the query is about the inside of a mesh that was baked without
        topology.
        """
        asked = (self._mesh, _other(other), poses, parallel)
        return clash_of(_cbvh.clash(asked, (clearance, tolerance, relative_gap, visits, magnitudes)))

    def intersection(self, other: Mesh, poses: ArrayLike, *, parallel: bool = False) -> Intersection:
        """How much do they have in common? The volume of the intersection, with a certified error, its box, the area of each surface
        in it, and how thick the meshes are where they pierce each other.

        A mesh is pierced where the other one passes all the way through it: the other one goes in through one part of its surface
        and out through another one, and the thickness is the least distance between two such parts. It is not pierced where the
        other one only reaches into it, or takes a corner of it along. A common face of flush meshes encloses nothing. Each place
        counts as often as the surfaces wind around it: where parts of one mesh overlap, unite them before baking. Radii are left
        out.

        ``poses``: of ``other`` in the frame of this mesh (body to world), shape (4, 4) or (N, 4, 4). Raises ValueError if a mesh is
        not closed, or was baked without topology. Cost: that of `contacts`, some 0.5 us for each of them, and some 0.1 us for each
        triangle in the box of the other mesh.
        """
        return Intersection(*_cbvh.intersection((self._mesh, _other(other), poses, parallel)))

    def intersection_surface(self, other: Mesh, poses: ArrayLike, *, parallel: bool = False) -> Any:
        """What bounds the part that they have in common? Polygons for those who draw it: the parts of this mesh's triangles inside
        ``other``, and then those of ``other``'s triangles inside this mesh. An `IntersectionSurface`, or a list of N.

        Points are rounded. Polygons that are next to each other have the same points, so that no gap is between them.

        ``poses``: of ``other`` in the frame of this mesh (body to world), shape (4, 4) or (N, 4, 4). Errors and cost are those of
        `intersection`.
        """
        found = _cbvh.intersection_surface((self._mesh, _other(other), poses, parallel))
        return [IntersectionSurface(*of) for of in found] if isinstance(found, list) else IntersectionSurface(*found)

    def separation(
        self, other: Mesh, poses: ArrayLike, direction: ArrayLike, *, parallel: bool = False
    ) -> Separation:
        """How far does ``other`` move along a direction until the insides are disjoint? A mesh inside another one moves until
        it is out.

        ``poses``: of ``other`` in the frame of this mesh (body to world), shape (4, 4) or (N, 4, 4). ``direction``: in the
        frame of this mesh, of any length but 0, shape (3,). Raises ValueError if a mesh is not closed, or was baked
        without topology.
        """
        return Separation(*_cbvh.separation((self._mesh, _other(other), poses, parallel), direction))

    def contact_regions(
        self, other: Mesh, poses: ArrayLike, *, limit: int | None = None, parallel: bool = False
    ) -> Any:
        """Where do the triangles in contact meet? Points, segments and polygons with certified errors, for the pairs of
        `contacts` in the same order: a `ContactRegions`, or a list of N.

        ``poses``: of ``other`` in the frame of this mesh (body to world), shape (4, 4) or (N, 4, 4). ``limit``: the greatest
        number of regions for a pose; None: all. Cost: that of `contacts`, and some 0.3 us for each region.
        """
        found = _cbvh.contact_regions((self._mesh, _other(other), poses, parallel), limit)
        return [regions_of(of) for of in found] if isinstance(found, list) else regions_of(found)

    def patches(
        self,
        other: Mesh,
        poses: ArrayLike,
        *,
        tolerance: float = 0.0,
        max_contacts: int | None = None,
        max_points: int | None = 0,
        parallel: bool = False,
    ) -> Any:
        """How do they push each other? Contacts joined into connected patches with a centre, a normal and an estimated depth
        each: a `Patches`, or a list of N.

        ``poses``: of ``other`` in the frame of this mesh (body to world), shape (4, 4) or (N, 4, 4). Two contacts belong
        together if they have a point in common, or points at most ``tolerance`` mesh units apart: a patch of rounded
        meshes, whose contacts are single points, needs one. ``max_contacts``: how many contacts are considered, the first
        ones in ascending order; None: all. Meshes need not be closed; the depth is 0 where a line of sight meets the
        outside of a surface or nothing. Cost: that of `contact_regions`, 0.3 us more for each contact, and some 10 us
        for each patch.

        ``max_points``: the largest number of contact points of each patch, as simulators use them; None: all that help.
        The deepest one comes first, then those that most enlarge the outline of the chosen ones, as long as they do by more
        than a 256th: four for a box on a floor, and about 16 at most for a round outline. Points change little where a pose
        does, unless another point becomes the better one. Cost: 8 us more for the patch of a box on a floor, some
        40 us for a round one, and twice that if more than eight points are wanted.
        """
        asked = (self._mesh, _other(other), poses, parallel)
        found = _cbvh.patches(asked, tolerance, max_contacts, max_points)
        return [patches_of(of) for of in found] if isinstance(found, list) else patches_of(found)

    def self_contacts(self, *, limit: int | None = None) -> SelfContacts:
        """All pairs of triangles of this mesh that have more in common than their common corners, exactly.

        ``limit``: the greatest number of pairs to return, the first ones; ``total`` counts all. The radius does not matter.
        Cost: 0.1 to 0.3 us per triangle of ordinary meshes.
        """
        triangles, kind, total = _cbvh.self_contacts(self._mesh, limit)
        return SelfContacts(triangles, named(SelfContactKind, kind), total)

    def open_edges(self) -> OpenEdges:
        """The edges that leave the mesh open, so that queries about what is inside have no answer; none if it is closed.

        Duplicates count with their orientation. Cost: about a third of a second per million triangles of an open mesh at
        the first call. Raises ValueError if the mesh was baked without topology.
        """
        [boundary, flipped, crowded, cracks], [nearest, widest, weld], listed, text = self._mesh.open_edges()
        edges = [
            OpenEdge(kind, number, np.array(triangles, np.uint32), np.array(ends), gap)
            for kind, number, triangles, ends, gap in listed
        ]
        return OpenEdges(boundary, flipped, crowded, edges, nearest, cracks, widest, weld, text)

    def motion(
        self,
        other: Mesh,
        motion: Path | Iterable[Path],
        *,
        clearance: float = 0.0,
        tolerance: float | None = None,
        parallel: bool = False,
    ) -> MotionAnswer:
        """Is the motion of ``other`` in the frame of this mesh free, and where does it end if it is not?

        ``motion`` is a `Motion`, a `Polyline` or a path of your own (`Path`). For N motions at once, or N paths in a
        list or another iterable, the answer has arrays of N elements. The answer is certain at every moment, not only
        at samples. ``clearance``: meshes that are at most this far apart, in mesh units, count as a hit. ``tolerance``:
        the width of the undecided range beyond the clearance, in mesh units; if the meshes come that near and do not
        hit, the answer may be NEAR. None: a millionth of the diagonal of the smaller object's box, radius included;
        between a point and a mesh, of the mesh's. ``parallel`` has no effect if a path is your own.
        """
        paths = read_paths(motion)
        found = _cbvh.motion(self._mesh, _other(other), paths, clearance, tolerance, parallel)
        kind, free_until, at, distance = found
        return MotionAnswer(named(MotionKind, kind), free_until, at, Distance(*distance))

    def is_free(
        self,
        other: Mesh,
        motion: Path | Iterable[Path],
        *,
        clearance: float = 0.0,
        tolerance: float | None = None,
        parallel: bool = False,
    ) -> Any:
        """Whether `motion` answers FREE: bool, or an array of bool of shape (N,). It takes less time than `motion`.

        Use it in planners. Arguments are those of `motion`.
        """
        return _cbvh.is_free(self._mesh, _other(other), read_paths(motion), clearance, tolerance, parallel)

    def closest_points(
        self,
        points: ArrayLike,
        *,
        within: float = np.inf,
        pose: ArrayLike | None = None,
        parallel: bool = False,
    ) -> ClosestPoint:
        """The points of the surface that are closest to ``points``, of shape (3,) or (N, 3).

        ``within``: the greatest distance to search, in mesh units. ``pose``: of this mesh in the frame of the points
        (body to world), shape (4, 4); None: the points are in the frame of the mesh.
        """
        return ClosestPoint(*_cbvh.closest_points((self._mesh, pose, parallel), points, within)[1])

    def sides(self, points: ArrayLike, *, pose: ArrayLike | None = None, parallel: bool = False) -> Any:
        """Which side of the surface each point is on, exactly: a `Side`, or an array of their numbers as int8, shape (N,).

        ``points`` have shape (3,) or (N, 3). ``pose``: of this mesh in the frame of the points (body to world).
        """
        return named(Side, _cbvh.sides((self._mesh, pose, parallel), points))

    def signed_point_distances(
        self,
        points: ArrayLike,
        *,
        within: float = np.inf,
        pose: ArrayLike | None = None,
        parallel: bool = False,
    ) -> Any:
        """Distances of points from the surface, negative inside: a float, or an array of shape (N,).

        NaN if the mesh has no inside, because it is not closed, or if the surface is farther away than ``within``. The
        surface is all triangles of the mesh: where closed parts of it overlap, the closest one may be inside, and the
        distance is less than that to the outside. ``points`` have shape (3,) or (N, 3). ``pose``: of this mesh in the frame of the points (body to world).
        """
        return _cbvh.signed_point_distances((self._mesh, pose, parallel), points, within)

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

        ``origins`` and ``directions`` have shape (3,) or (N, 3), and one of either serves N of the other. Directions
        may have any length, which is the unit of ``t``. ``until``: the greatest parameter, of shape () or (N,).
        ``pose``: of this mesh in the frame of the rays (body to world).
        """
        return RayHit(*_cbvh.first_hits((self._mesh, pose, parallel), origins, directions, until)[1])

    def any_hits(
        self,
        origins: ArrayLike,
        directions: ArrayLike,
        *,
        until: ArrayLike = np.inf,
        pose: ArrayLike | None = None,
        parallel: bool = False,
    ) -> Any:
        """Whether rays hit the surface, exactly: bool, or an array of shape (N,). Arguments are those of
        `first_hits`."""
        return _cbvh.any_hits((self._mesh, pose, parallel), origins, directions, until)

    def all_hits(
        self,
        origins: ArrayLike,
        directions: ArrayLike,
        *,
        until: ArrayLike = np.inf,
        pose: ArrayLike | None = None,
        parallel: bool = False,
    ) -> Any:
        """All hits of rays, in the exact order along each: a `RayHit` of arrays of K elements, or a list of N.

        Each parameter occurs once, with one triangle, however many triangles are hit at exactly that parameter. Arguments are those
        of `first_hits`. A mesh with a radius is one body, and its hits are where the ray enters and leaves it, in turns: at 0 if
        it starts inside, and without an exit if it ends there. A closed core is hollow also if it is solid. Parts of the ray
        inside are told apart if their bounds prove the gap between them.
        """
        found = _cbvh.all_hits((self._mesh, pose, parallel), origins, directions, until)
        return [RayHit(*hits) for hits in found] if isinstance(found, list) else RayHit(*found)

    def segment_hits(
        self, starts: ArrayLike, ends: ArrayLike, *, pose: ArrayLike | None = None, parallel: bool = False
    ) -> Any:
        """Whether closed segments meet the surface, exactly: bool, or an array of shape (N,).

        ``starts`` and ``ends`` have shape (3,) or (N, 3), and one of either serves N of the other. ``pose``: of this
        mesh in their frame (body to world).
        """
        return _cbvh.segment_hits((self._mesh, pose, parallel), starts, ends)

    def visible(
        self,
        points_a: ArrayLike,
        points_b: ArrayLike,
        *,
        margin: float = 0.0,
        pose: ArrayLike | None = None,
        parallel: bool = False,
    ) -> Any:
        """Whether points see each other past the surface: bool, or an array of shape (N,).

        ``points_a`` and ``points_b`` have shape (3,) or (N, 3), and one of either serves N of the other. Two points see each other
        if the segment between them, but for what is within ``margin`` mesh units of either, does not meet the surface. With a
        margin of 0 a point on the surface sees nothing, as the segment touches the surface there. For such points take a margin
        that is longer than their coordinates are off, such as a millionth of the size of the mesh, or move them off the surface.
        Points at most two margins apart see each other. ``pose``: of this mesh in the frame of the points (body to world).
        """
        return _cbvh.visible((self._mesh, pose, parallel), points_a, points_b, margin)


def open(path: str | os.PathLike[str], object: int | str | None = None) -> Mesh:
    """Maps a ``.cbvh`` file, or one object of it by number or name. Takes microseconds, whatever the size.

    The bytes of the file must not change while it is open. If they do, answers are undefined, and formally so is
    everything that the process does. If the file is truncated, the system ends the process as soon as a query needs
    the missing part. Replace a file by renaming another one over it, as `save` does. `Mesh.from_bytes` copies instead.
    A file that is already damaged raises FormatError. An ``object`` that the file does not have raises IndexError if it is a
    number, and ValueError if it is a name: see `Mesh.object`.
    """
    name = os.fsdecode(path)
    mesh = Mesh(_cbvh.Mesh.open(name), os.path.abspath(name))
    return mesh if object is None else mesh.object(object)


def _unpickle(data: bytes | str, object: int | None, radius: float, is_solid: bool) -> Mesh:
    mesh = open(data) if isinstance(data, str) else Mesh.from_bytes(data)
    mesh = mesh if object is None else mesh.object(object)
    # The file may state another radius.
    mesh = mesh if mesh.radius == radius else mesh.rounded(radius)
    return mesh.solid() if is_solid else mesh
