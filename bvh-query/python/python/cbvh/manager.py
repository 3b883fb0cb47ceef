"""A collision manager for users of trimesh: the methods, arguments and return values of
`trimesh.collision.CollisionManager`.

It uses `Scene` and needs neither trimesh nor FCL. It differs in the following:

- Meshes are surfaces, whether convex or not. A mesh that is inside another without touching it does not collide with
  it, unless that is a primitive of trimesh, which is solid, or has ``solid=True``.
- ``Sphere`` and ``Capsule`` of ``trimesh.primitives`` are exact, and have the one triangle 0. ``Box`` has the triangles of
  trimesh. ``Cylinder`` is a polyhedron around it, 0.002 of the radius larger, and not one inside it. An ``Extrusion`` is a
  mesh. Their transforms must be rigid. A primitive counts as it is when it is added or queried.
- A ``PointCloud`` is its points, and answers name their numbers. ``radius``, here and for any mesh, is added on all sides.
- Contact is exact. Contacts are all pairs of triangles that touch, each once, with the number of a triangle of each object;
  FCL finds one contact of two convex meshes, without these numbers. The points are where the two triangles meet.
- The depth of a contact is that of the two objects, if both are closed and not flat: the length of a translation that
  separates them (`Mesh.penetration`). For nearly all convex meshes, this is the shortest one. The normal is its direction.
  For other objects, both are estimates for the contact's patch (`Mesh.patches`).
- A normal is the direction in which the second object has to move: the one that is asked about, the one of the other
  manager, or the one that is last in alphabetical order. FCL has no such order among the objects of one manager. Where
  several translations are equally short, as of cubes in the same place, it is one of them.
- Distances are negative if insides meet, as they are for convex meshes in trimesh: less the depth. Among objects that are
  not closed, they are 0 if these touch.
- A primitive also touches what is all inside it. That contact has the number -1 in place of triangles.
- `add_object` returns None, not an object of FCL.
- If there is no pair of objects, a distance is infinite, and the names and the data are None.
- A manager can be pickled and copied. Its meshes are baked, so that nothing is baked again.
"""

from __future__ import annotations

import functools
import hashlib
import threading
import weakref
from collections import OrderedDict
from typing import Any, Hashable, Iterable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _cbvh
from ._answers import Floats
from ._baking import bake
from ._mesh import Mesh
from ._poses import relative
from ._scene import Scene
from ._shapes import cylinder, sphere

EXTERNAL = "__external"
"""The name in answers of an object that is not in the manager, as in trimesh."""

# The groups of a manager's own objects, and of those that they are asked about with.
_OWN, _OTHERS = 1, 2
# What other libraries call half-spaces.
_HALF_SPACES = {"Halfspace", "HalfSpace", "Plane"}
# How much longer than the shortest one a translation may be, as a part, where bounds can tell: less than tests allow.
_GAP = 1e-6
# How many baked meshes are kept that nothing else holds.
_KEPT = 16


class _Geometry:
    """A mesh, and whether it has an inside, as soon as that is known."""

    __slots__ = ("mesh", "_has_inside", "__weakref__")

    def __init__(self, mesh: Mesh) -> None:
        self.mesh = mesh
        self._has_inside: bool | None = None

    @property
    def has_inside(self) -> bool:
        if self._has_inside is None:
            try:
                closed = self.mesh.solid()
                self._has_inside = closed.radius > 0 or bool(np.all(np.ptp(closed.bounds, axis=0) > 0))
            except _cbvh.FormatError:
                raise
            except ValueError:
                self._has_inside = False
        return self._has_inside


_Names = dict[int, Hashable]
_OtherNames = dict[int, tuple[Hashable, _Geometry]]

_baked: weakref.WeakValueDictionary[bytes, _Geometry] = weakref.WeakValueDictionary()
_recent: OrderedDict[bytes, _Geometry] = OrderedDict()
_baking = threading.Lock()


def _geometry(mesh: Any, radius: float = 0.0, solid: bool = False) -> _Geometry:
    """A mesh as it is, or baked from its vertices and faces: each content once, as long as anybody holds it."""
    geometry = _of_radius_0(mesh)
    if solid and not geometry.mesh.is_solid:
        geometry = _Geometry(geometry.mesh.solid())
    if _cbvh.number(radius, "radius") == 0:
        return geometry
    return _Geometry(geometry.mesh.rounded(geometry.mesh.radius + radius))


def _of_radius_0(mesh: Any) -> _Geometry:
    if isinstance(mesh, Mesh):
        return _Geometry(mesh)
    kind, module, is_solid = type(mesh).__name__, type(mesh).__module__, False
    try:
        if module.startswith("trimesh.primitives") and kind != "Extrusion":
            numbers, is_solid = mesh.primitive, True
            pose = _cbvh.copied_numbers(numbers.transform, "transform of the mesh")
            _cbvh.check_pose(pose, "transform of the mesh")
            if kind == "Sphere":
                return _Geometry(sphere(float(numbers.radius), pose[:3, 3]))
            if kind == "Capsule":
                axis, centre = pose[:3, 2] * numbers.height / 2, pose[:3, 3]
                segment = Mesh(_cbvh.segment_core(list(centre - axis), list(centre + axis)))
                return _Geometry(segment.rounded(float(numbers.radius)))
            if kind == "Cylinder":
                mesh = cylinder(float(numbers.radius), float(numbers.height))
        vertices = np.asarray(mesh.vertices, dtype=np.float64)
        if kind == "PointCloud" and module.startswith("trimesh."):
            faces = np.repeat(np.arange(len(vertices))[:, None], 3, axis=1)
        else:
            faces = np.asarray(mesh.faces)
    except AttributeError:
        expected = "expected a cbvh.Mesh or an object with vertices and faces"
        remedy = "; of a half-space, make a cbvh.ground that reaches far enough" if kind in _HALF_SPACES else ""
        raise TypeError(f"mesh: {expected}, found {kind}{remedy}") from None
    if kind == "Cylinder" and is_solid:
        vertices = vertices @ pose[:3, :3].T + pose[:3, 3]
    if faces.ndim != 2 or vertices.ndim != 2 or faces.dtype.kind not in "iu":
        bake(vertices, faces)  # Its error names what is wrong.
    faces = np.asarray(faces, dtype=np.int64)
    digest = hashlib.blake2b(repr((vertices.shape, faces.shape, is_solid)).encode())
    for array in (vertices, faces):
        digest.update(np.ascontiguousarray(array).data)
    key = digest.digest()
    with _baking:
        geometry = _baked.get(key)
        if geometry is None:
            baked = bake(vertices, faces)
            geometry = _Geometry(baked.solid() if is_solid else baked)
            _baked[key] = geometry
        _recent[key] = geometry
        _recent.move_to_end(key)
        if len(_recent) > _KEPT:
            _recent.popitem(last=False)
    return geometry


def _transform(transform: ArrayLike | None) -> Floats:
    """A pose. A rotation that is rounded, as of float32, is replaced by the nearest one."""
    if transform is None:
        return np.eye(4)
    pose = _cbvh.copied_numbers(transform, "transform")
    if pose.shape != (4, 4):
        raise ValueError(f"transform: expected shape (4, 4), found {pose.shape}")
    error = np.max(np.abs(pose[:3, :3] @ pose[:3, :3].T - np.eye(3)))
    # Half of what a scene takes; and what is off by more than 2^-16 is no rounded rotation, which the scene says.
    if 2.0**-24 < error < 2.0**-16:
        u, _, v = np.linalg.svd(pose[:3, :3])
        pose[:3, :3] = u @ v
    _cbvh.check_pose(pose, "transform")
    return pose


class _Contacts:
    """All contacts of two objects, A and B. What is known of them is computed when it is first needed."""

    def __init__(
        self,
        names: tuple[Hashable, Hashable],
        geometries: tuple[_Geometry, _Geometry],
        poses: Floats,
        is_swapped: bool,
    ) -> None:
        self.names, self._geometries = names, geometries
        # Normals point from A to B, unless A is the second one for callers.
        self._sign = -1.0 if is_swapped else 1.0
        self._rotation, self._translation = poses[0, :3, :3], poses[0, :3, 3]
        self._question = (geometries[0].mesh, geometries[1].mesh, relative(poses[0], poses[1]))

    @functools.cached_property
    def points(self) -> Floats:
        """A point in the world of each contact, shape (K, 3); if no triangles touch, one point."""
        a, b, pose = self._question
        regions = a.contact_regions(b, pose)
        points: Floats = np.nansum(regions.points, axis=1) / regions.point_count[:, None]
        if len(points) == 0:
            points = a.distance(b, pose).point_a[None]
        placed: Floats = points @ self._rotation.T + self._translation
        return placed

    @functools.cached_property
    def depths(self) -> tuple[Floats, Floats]:
        """The depth of each contact, shape (K,), and the normals in the world, shape (K, 3). One row alone serves all."""
        a, b, pose = self._question
        if all(geometry.has_inside for geometry in self._geometries):
            found = a.penetration(b, pose, relative_gap=_GAP)
            depths, normals = np.array([found.upper]), found.translation[None] / (found.upper or 1.0)
        else:
            patches = a.patches(b, pose)
            # The order of the contacts in that of the patches.
            order = np.lexsort(patches.regions.triangles.T[::-1])
            of_contact = np.repeat(np.arange(len(patches.depth)), patches.contact_count)[order]
            depths, normals = patches.depth[of_contact], patches.normal[of_contact]
            if len(order) == 0:
                depths, normals = np.zeros(1), np.zeros((1, 3))
        return depths, self._sign * normals @ self._rotation.T


class ContactData:
    """Two triangles of two objects that touch."""

    __slots__ = ("names", "_of", "_number", "_triangles")

    def __init__(self, of: _Contacts, number: int, triangles: tuple[int, int]) -> None:
        self.names = set(of.names)
        """The names of the two objects."""
        self._of, self._number, self._triangles = of, number, triangles

    def index(self, name: Hashable) -> int:
        """The number of the triangle of the object with this name; -1 if one object is all inside the other."""
        for of, triangle in zip(self._of.names, self._triangles):
            if of == name:
                return triangle
        raise KeyError(f"name: expected one of {sorted(self.names, key=str)}, found {name!r}")

    @property
    def point(self) -> Floats:
        """The middle of what both triangles have in common, in the world, shape (3,).

        The first access to it computes the points of all contacts of the two objects.
        """
        point: Floats = self._of.points[self._number]
        return point

    @property
    def depth(self) -> float:
        """How deep the objects are in each other, in mesh units: how far the second has to move along `normal`. The first
        access computes it, which may take milliseconds."""
        depths, _ = self._of.depths
        return float(depths[self._number % len(depths)])

    @property
    def normal(self) -> Floats:
        """The direction in which the second object has to move, in the world, shape (3,); 0 if none is known. See
        `cbvh.manager` for which one is the second."""
        _, normals = self._of.depths
        normal: Floats = normals[self._number % len(normals)]
        return normal


class DistanceData:
    """The least distance of two objects. Where it is not above 0, the points and triangles are those of one contact."""

    __slots__ = ("names", "distance", "_rows")

    def __init__(self, rows: dict[Hashable, tuple[int, Floats]], distance: float) -> None:
        self.names = set(rows)
        """The names of the two objects."""
        self.distance = distance
        """The distance in mesh units; where insides meet, less the depth."""
        self._rows = rows

    def index(self, name: Hashable) -> int:
        """The number of the closest triangle of the object with this name."""
        return self._rows[name][0]

    def point(self, name: Hashable) -> Floats:
        """The closest point of the object with this name, in the world, shape (3,)."""
        return self._rows[name][1]


class CollisionManager:
    """Named objects, and whether they collide or how far apart they are, as `trimesh.collision.CollisionManager` asks.

    An object is a `Mesh`, or anything with ``vertices`` and ``faces``, such as a ``trimesh.Trimesh``, or a ``PointCloud``
    or a primitive of trimesh. Each distinct mesh is baked once. Transforms map body to world, shape (4, 4), and are rigid. The module `cbvh.manager` states what
    differs from trimesh.
    """

    def __init__(self) -> None:
        """A manager without objects."""
        self._lock = threading.RLock()
        # Pairs of objects, and pairs of an object and another one.
        self._among, self._against = Scene(), Scene()
        self._objects: dict[Hashable, tuple[int, int, _Geometry]] = {}
        self._among_names: _Names = {}
        self._against_names: _Names = {}

    def __reduce__(self) -> tuple[Any, ...]:
        return (_manager_of, ([(name, geometry.mesh, pose) for name, geometry, pose in self._placed()],))

    def add_object(
        self,
        name: Hashable,
        mesh: Any,
        transform: ArrayLike | None = None,
        *,
        radius: float = 0.0,
        solid: bool = False,
    ) -> None:
        """Adds an object. It replaces one of the same name. ``transform`` (body to world): None is the identity.
        ``radius``: how much it is larger on all sides, in mesh units; that of the balls for a cloud of points.
        ``solid``: what is inside collides with it as well; ValueError if the mesh is not closed."""
        geometry, pose = _geometry(mesh, radius, solid), _transform(transform)
        hash(name)  # Raises TypeError where it cannot be a name.
        with self._lock:
            among = self._among.add(geometry.mesh, pose)
            against = self._against.add(geometry.mesh, pose, member=_OWN, meets=_OTHERS)
            if name in self._objects:
                self.remove_object(name)
            self._objects[name] = (among, against, geometry)
            self._among_names[among] = self._against_names[against] = name

    def remove_object(self, name: Hashable) -> None:
        """Removes an object. Raises ValueError if there is none of that name."""
        with self._lock:
            among, against, _ = self._object(name)
            del self._objects[name], self._among_names[among], self._against_names[against]
            self._among.remove(among)
            self._against.remove(against)

    def set_transform(self, name: Hashable, transform: ArrayLike) -> None:
        """Moves an object. Raises ValueError if there is none of that name."""
        pose = _transform(transform)
        with self._lock:
            among, against, _ = self._object(name)
            self._among.set_pose(among, pose)
            self._against.set_pose(against, pose)

    def in_collision_single(
        self,
        mesh: Any,
        transform: ArrayLike | None = None,
        return_names: bool = False,
        return_data: bool = False,
        *,
        radius: float = 0.0,
        solid: bool = False,
    ) -> Any:
        """Whether an object collides with any object of the manager.

        The answer is a bool. With ``return_names`` or ``return_data`` it is a tuple, which also has the set of names of
        the objects that it collides with, or a list of `ContactData`, in which the object is called ``"__external"``.
        """
        others = [(EXTERNAL, _geometry(mesh, radius, solid), _transform(transform))]
        found, pairs, data = self._collisions_with(others, return_names, return_data)
        return _asked(found, {own for own, _ in pairs}, data, return_names, return_data)

    def in_collision_internal(self, return_names: bool = False, return_data: bool = False) -> Any:
        """Whether any two objects of the manager collide.

        Names are a set of pairs, in alphabetical order in each.
        """
        with self._lock:
            found, pairs, data = self._collisions(self._among, self._among_names, {}, return_names, return_data)
        return _asked(found, pairs, data, return_names, return_data)

    def in_collision_other(
        self, other_manager: CollisionManager, return_names: bool = False, return_data: bool = False
    ) -> Any:
        """Whether any object collides with any of another manager.

        Names are a set of pairs: first of this manager, then of the other.
        """
        others = _manager(other_manager)._placed()
        found, pairs, data = self._collisions_with(others, return_names, return_data)
        return _asked(found, pairs, data, return_names, return_data)

    def min_distance_single(
        self,
        mesh: Any,
        transform: ArrayLike | None = None,
        return_name: bool = False,
        return_data: bool = False,
        *,
        radius: float = 0.0,
        solid: bool = False,
    ) -> Any:
        """The least distance of an object from the manager's, in mesh units.

        With ``return_name``, the name of the closest follows, and with ``return_data`` a `DistanceData`.
        """
        others = [(EXTERNAL, _geometry(mesh, radius, solid), _transform(transform))]
        distance, names, data = self._distance_to(others)
        return _asked(distance, names and names[0], data, return_name, return_data)

    def min_distance_internal(
        self, name: Hashable | None = None, return_names: bool = False, return_data: bool = False
    ) -> Any:
        """The least distance of any two objects or, with ``name``, of that object from the others, in mesh units.

        Names are a pair, in alphabetical order.
        """
        with self._lock:
            if name is None:
                distance, names, data = self._nearest(self._among, self._among_names, {})
            else:
                _, against, _ = self._object(name)
                self._against.set_groups(against, member=_OTHERS, meets=_OWN)
                try:
                    distance, names, data = self._nearest(self._against, self._against_names, {})
                finally:
                    self._against.set_groups(against, member=_OWN, meets=_OTHERS)
        return _asked(distance, names, data, return_names, return_data)

    def min_distance_other(
        self, other_manager: CollisionManager, return_names: bool = False, return_data: bool = False
    ) -> Any:
        """The least distance of any object from any of another manager, in mesh units.

        Names are a pair: first of this manager, then of the other.
        """
        distance, names, data = self._distance_to(_manager(other_manager)._placed())
        return _asked(distance, names, data, return_names, return_data)

    def _object(self, name: Hashable) -> tuple[int, int, _Geometry]:
        try:
            return self._objects[name]
        except KeyError:
            raise ValueError(f"name: expected that of an object of the manager, found {name!r}") from None

    def _placed(self) -> list[tuple[Hashable, _Geometry, Floats]]:
        """Names, meshes and poses of all objects."""
        with self._lock:
            return [(name, of[2], self._among.pose(of[0])) for name, of in self._objects.items()]

    def _collisions_with(
        self, others: Iterable[tuple[Hashable, _Geometry, Floats]], return_names: bool, return_data: bool
    ) -> tuple[bool, set[tuple[Hashable, Hashable]], list[ContactData]]:
        with self._lock, _Added(self._against, others) as added:
            return self._collisions(self._against, self._against_names, added, return_names, return_data)

    def _distance_to(
        self, others: Iterable[tuple[Hashable, _Geometry, Floats]]
    ) -> tuple[float, tuple[Hashable, Hashable] | None, DistanceData | None]:
        with self._lock, _Added(self._against, others) as added:
            return self._nearest(self._against, self._against_names, added)

    def _collisions(
        self, scene: Scene, own: _Names, others: _OtherNames, return_names: bool, return_data: bool
    ) -> tuple[bool, set[tuple[Hashable, Hashable]], list[ContactData]]:
        """Whether any pair of a scene touches; names, first of own objects, then of others; and contacts."""
        if not (return_names or return_data):
            return scene.collide(), set(), []
        if not return_data:
            pairs = [_ordered(a, b, own, others)[0] for a, b in scene.pairs_in_contact().tolist()]
            return bool(pairs), set(pairs), []
        contacts, names, data = scene.contacts(), set(), []
        triangles: dict[tuple[int, int], list[tuple[int, int]]] = {}
        for (a, b), (_, of_a, _, of_b) in zip(contacts.pairs.tolist(), contacts.triangles.tolist()):
            triangles.setdefault((a, b), []).append((of_a, of_b))
        for a, b in scene.pairs_in_contact().tolist():
            pair, is_swapped = _ordered(a, b, own, others)
            names.add(pair)
            geometries = (self._geometry_of(a, own, others), self._geometry_of(b, own, others))
            found = _Contacts(pair[::-1] if is_swapped else pair, geometries, scene.poses([a, b]), is_swapped)
            of_pair = triangles.get((a, b), [(-1, -1)])
            data += [ContactData(found, number, both) for number, both in enumerate(of_pair)]
        return bool(data), names, data

    def _geometry_of(self, number: int, own: _Names, others: _OtherNames) -> _Geometry:
        return others[number][1] if number in others else self._objects[own[number]][2]

    def _nearest(
        self, scene: Scene, own: _Names, others: _OtherNames
    ) -> tuple[float, tuple[Hashable, Hashable] | None, DistanceData | None]:
        """The least distance in a scene; names, first of own objects, then of others; and what is known of it."""
        least = scene.distance()
        if least is None:
            return float("inf"), None, None
        a, b, found = least
        distance = found.distance
        if distance == 0:
            for pair in scene.pairs_in_contact().tolist():
                of_a, of_b = (self._geometry_of(one, own, others) for one in pair)
                if of_a.has_inside and of_b.has_inside:
                    at = relative(*scene.poses(pair))
                    number = of_a.mesh.signed_distance(of_b.mesh, at, relative_gap=_GAP)
                    # Where they only touch, the translation is some roundings long, and 0 is between the bounds.
                    if number.upper < 0 and number.lower < distance:
                        (a, b), distance = pair, number.lower
                        found = of_a.mesh.distance(of_b.mesh, at)
        pose = scene.pose(a)
        names, is_swapped = _ordered(a, b, own, others)
        points = [pose[:3, :3] @ point + pose[:3, 3] for point in (found.point_a, found.point_b)]
        rows = list(zip((int(found.triangle_a), int(found.triangle_b)), points))
        return distance, names, DistanceData(dict(zip(names, rows[::-1] if is_swapped else rows)), distance)


def _manager_of(objects: list[tuple[Hashable, Mesh, Floats]]) -> CollisionManager:
    """A manager as it was pickled or copied."""
    manager = CollisionManager()
    for name, mesh, pose in objects:
        manager.add_object(name, mesh, pose)
    return manager


def _manager(manager: Any) -> CollisionManager:
    if not isinstance(manager, CollisionManager):
        raise TypeError(f"other_manager: expected a cbvh.CollisionManager, found {type(manager).__name__}")
    return manager


class _Added:
    """Objects that are in a scene for one query."""

    __slots__ = ("_scene", "_others", "_added")

    def __init__(self, scene: Scene, others: Iterable[tuple[Hashable, _Geometry, Floats]]) -> None:
        self._scene, self._others, self._added = scene, others, dict[int, tuple[Hashable, _Geometry]]()

    def __enter__(self) -> _OtherNames:
        try:
            for name, geometry, pose in self._others:
                number = self._scene.add(geometry.mesh, pose, member=_OTHERS, meets=_OWN)
                self._added[number] = (name, geometry)
        except BaseException:
            self.__exit__()
            raise
        return self._added

    def __exit__(self, *raised: Any) -> None:
        for number in self._added:
            self._scene.remove(number)


def _ordered(a: int, b: int, own: _Names, others: _OtherNames) -> tuple[tuple[Hashable, Hashable], bool]:
    """The names of a pair, and whether they are swapped: those of others last, and own ones in alphabetical order."""
    if a in others:
        return (own[b], others[a][0]), True
    if b in others:
        return (own[a], others[b][0]), False
    first, second = sorted((own[a], own[b]), key=str)
    return (first, second), first != own[a]


def _asked(answer: Any, names: Any, data: Any, return_names: bool, return_data: bool) -> Any:
    """An answer alone, or a tuple with what is asked for besides."""
    more = [value for value, is_asked in ((names, return_names), (data, return_data)) if is_asked]
    return (answer, *more) if more else answer
