"""A collision manager for users of trimesh: the methods, arguments and return values of
`trimesh.collision.CollisionManager`.

It uses `Scene` and needs neither trimesh nor FCL. It differs in the following:

- Meshes are surfaces, whether convex or not. A mesh that is inside another without touching it does not collide with
  it, unless that is a primitive of trimesh, which is solid.
- ``Sphere`` and ``Capsule`` of ``trimesh.primitives`` are exact, and have the one triangle 0. ``Box`` has the triangles of
  trimesh. ``Cylinder`` is a polyhedron around it, 0.002 of the radius larger, and not one inside it. An ``Extrusion`` is a
  mesh. Their transforms must be rigid. A primitive counts as it is when it is added or asked about.
- A ``PointCloud`` is its points, and answers name their numbers. ``radius``, here and for any mesh, is added on all sides.
- Contact is exact, and distances are 0 if meshes touch. There is no penetration depth and no normal: answers do not
  have the attributes ``depth`` and ``normal``, and no distance is negative.
- Contacts are all pairs of triangles that touch, each once.
- `add_object` returns None, not an object of FCL.
- If there is no pair of objects, a distance is infinite, and the names and the data are None.
- A manager cannot be pickled or copied; a `Scene` can.
"""

from __future__ import annotations

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
from ._mesh import Mesh, _length
from ._poses import relative
from ._scene import Scene
from ._shapes import cylinder, sphere

EXTERNAL = "__external"
"""The name in answers of an object that is not in the manager, as in trimesh."""

# The groups of a manager's own objects, and of those that they are asked about with.
_OWN, _OTHERS = 1, 2
# What other libraries call half-spaces.
_HALF_SPACES = {"Halfspace", "HalfSpace", "Plane"}
# How many baked meshes are kept that nothing else holds.
_KEPT = 16


class _Geometry:
    """A mesh, and its arrays, as far as they are known."""

    __slots__ = ("mesh", "vertices", "faces", "__weakref__")

    def __init__(self, mesh: Mesh, vertices: Floats | None = None, faces: NDArray[Any] | None = None) -> None:
        self.mesh, self.vertices, self.faces = mesh, vertices, faces


_Names = dict[int, Hashable]
_OtherNames = dict[int, tuple[Hashable, _Geometry]]

_baked: weakref.WeakValueDictionary[bytes, _Geometry] = weakref.WeakValueDictionary()
_recent: OrderedDict[bytes, _Geometry] = OrderedDict()
_baking = threading.Lock()


def _geometry(mesh: Any, radius: float = 0.0) -> _Geometry:
    """A mesh as it is, or baked from its vertices and faces: each content once, as long as anybody holds it."""
    geometry = _of_radius_0(mesh)
    if _length(radius, "radius") == 0:
        return geometry
    return _Geometry(geometry.mesh.rounded(geometry.mesh.radius + radius), geometry.vertices, geometry.faces)


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
            # Callers may change their arrays.
            baked = bake(vertices, faces)
            geometry = _Geometry(baked.solid() if is_solid else baked, vertices.copy(), faces.copy())
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


class ContactData:
    """Two triangles of two objects that touch."""

    __slots__ = ("names", "_rows", "_point")

    def __init__(self, rows: list[tuple[Hashable, _Geometry, int, Floats]]) -> None:
        self.names = {row[0] for row in rows}
        """The names of the two objects."""
        self._rows = rows
        self._point: Floats | None = None

    def index(self, name: Hashable) -> int:
        """The number of the triangle of the object with this name."""
        for row in self._rows:
            if row[0] == name:
                return row[2]
        raise KeyError(f"name: expected one of {sorted(self.names, key=str)}, found {name!r}")

    @property
    def point(self) -> Floats:
        """A point in the world that both triangles have, to within rounding, shape (3,).

        It is computed at the first access. There is none for balls, for capsules, and for a `cbvh.Mesh`.
        """
        if self._point is None:
            meshes, poses = [], []
            for _, geometry, triangle, pose in self._rows:
                if geometry.vertices is None or geometry.faces is None:
                    raise AttributeError("point: expected objects with vertices and faces, found a cbvh.Mesh, a ball or a capsule")
                corners = bake(geometry.vertices[geometry.faces[triangle]], [[0, 1, 2]])
                meshes.append(corners.rounded(geometry.mesh.radius))
                poses.append(pose)
            found = meshes[0].distance(meshes[1], relative(*poses)).point_a
            self._point = poses[0][:3, :3] @ found + poses[0][:3, 3]
        return self._point


class DistanceData:
    """The least distance of two objects."""

    __slots__ = ("names", "distance", "_rows")

    def __init__(self, rows: dict[Hashable, tuple[int, Floats]], distance: float) -> None:
        self.names = set(rows)
        """The names of the two objects."""
        self.distance = distance
        """The distance in mesh units, 0 where they touch."""
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

    def add_object(
        self, name: Hashable, mesh: Any, transform: ArrayLike | None = None, *, radius: float = 0.0
    ) -> None:
        """Adds an object. It replaces one of the same name. ``transform`` (body to world): None is the identity.
        ``radius``: how much it is larger on all sides, in mesh units; that of the balls for a cloud of points."""
        geometry, pose = _geometry(mesh, radius), _transform(transform)
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
    ) -> Any:
        """Whether an object collides with any object of the manager.

        The answer is a bool. With ``return_names`` or ``return_data`` it is a tuple, which also has the set of names of
        the objects that it collides with, or a list of `ContactData`, in which the object is called ``"__external"``.
        """
        others = [(EXTERNAL, _geometry(mesh, radius), _transform(transform))]
        found, pairs, data = self._collisions_with(others, return_names, return_data)
        return _asked(found, {own for own, _ in pairs}, data, return_names, return_data)

    def in_collision_internal(self, return_names: bool = False, return_data: bool = False) -> Any:
        """Whether any two objects of the manager collide.

        Names are a set of pairs, in alphabetical order in each.
        """
        with self._lock:
            found, pairs, data = self._collisions(self._among, self._among_names, {}, return_names, return_data)
        return _asked(found, {_sorted(pair) for pair in pairs}, data, return_names, return_data)

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
    ) -> Any:
        """The least distance of an object from the manager's, in mesh units.

        With ``return_name``, the name of the closest follows, and with ``return_data`` a `DistanceData`.
        """
        others = [(EXTERNAL, _geometry(mesh, radius), _transform(transform))]
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
        return _asked(distance, names and _sorted(names), data, return_names, return_data)

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
        contacts = scene.contacts()
        names, data = set(), []
        poses = {number: scene.pose(number) for number in np.unique(contacts.pairs).tolist()}
        for (a, b), (_, triangle_a, _, triangle_b) in zip(contacts.pairs.tolist(), contacts.triangles.tolist()):
            names.add(_ordered(a, b, own, others)[0])
            rows = []
            for number, triangle in ((a, triangle_a), (b, triangle_b)):
                name, geometry = others[number] if number in others else (own[number], self._objects[own[number]][2])
                rows.append((name, geometry, triangle, poses[number]))
            data.append(ContactData(rows))
        return bool(data), names, data

    def _nearest(
        self, scene: Scene, own: _Names, others: _OtherNames
    ) -> tuple[float, tuple[Hashable, Hashable] | None, DistanceData | None]:
        """The least distance in a scene; names, first of own objects, then of others; and what is known of it."""
        least = scene.distance()
        if least is None:
            return float("inf"), None, None
        found, pose = least.nearest, scene.pose(least.a)
        names, is_swapped = _ordered(least.a, least.b, own, others)
        points = [pose[:3, :3] @ point + pose[:3, 3] for point in (found.point_a, found.point_b)]
        rows = list(zip((found.triangle_a, found.triangle_b), points))
        return found.distance, names, DistanceData(dict(zip(names, rows[::-1] if is_swapped else rows)), found.distance)


def _manager(manager: Any) -> CollisionManager:
    if not isinstance(manager, CollisionManager):
        raise TypeError(f"other_manager: expected a cbvh.CollisionManager, found {type(manager).__name__}")
    return manager


class _Added:
    """Objects that are in a scene for one question."""

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
    """The names of a pair, those of others last, and whether that swaps them."""
    if a in others:
        return (own[b], others[a][0]), True
    return (own[a], others[b][0] if b in others else own[b]), False


def _sorted(names: tuple[Hashable, Hashable]) -> tuple[Hashable, Hashable]:
    """A pair of names in alphabetical order."""
    first, second = sorted(names, key=str)
    return first, second


def _asked(answer: Any, names: Any, data: Any, return_names: bool, return_data: bool) -> Any:
    """An answer alone, or a tuple with what is asked for besides."""
    more = [value for value, is_asked in ((names, return_names), (data, return_data)) if is_asked]
    return (answer, *more) if more else answer
