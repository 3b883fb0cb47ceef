"""Scenes: many placed meshes, and queries over all pairs of them that may meet."""

from __future__ import annotations

import functools
import operator
import os
from typing import Any, Callable, Iterator, Mapping

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _cbvh
from ._answers import (
    ClosestPoint,
    Distance,
    Floats,
    MotionKind,
    Penetration,
    RayHit,
    Relation,
    SceneClashes,
    SceneClosestPoint,
    SceneContacts,
    SceneDistance,
    SceneDistances,
    SceneMotionAnswer,
    SceneNearPairs,
    ScenePenetrations,
    SceneRayHit,
    SceneRelations,
    SceneSignedDistance,
    Side,
    SignedDistance,
    clash_of,
    named,
)
from ._mesh import Mesh
from ._motion import Path, read_path
from ._view import View, called, limit, show

ALL_GROUPS = 0xFFFF_FFFF


def _groups(value: Any, name: str) -> int:
    """A set of groups as bits."""
    try:
        bits = operator.index(value)
    except TypeError:
        raise TypeError(f"{name}: expected 32 bits of groups, found {type(value).__name__}") from None
    if not 0 <= bits <= ALL_GROUPS:
        raise ValueError(f"{name}: expected 32 bits of groups, from 0 to {ALL_GROUPS:#x}, found {bits:#x}")
    return bits


class Scene:
    """Many placed meshes, and queries over all pairs that may meet.

    An instance is a mesh with its pose in the world (body to world). `add` returns its number, which is never given
    again. The number of an instance that was removed raises KeyError. Arguments may name an instance by its name
    instead, if it has one; answers have numbers. Iterating over a scene gives the numbers of its instances in their
    order. The first instance of a pair is A. A query is about all pairs of instances whose groups meet and whose
    contact is not allowed. Answers are in the order of the pairs, and each is that of `Mesh` for the pose of B in A's
    frame, to the bit.

    **Threads** may share a scene. A query is about the scene as it is when the query begins. Other threads run
    meanwhile: they may run queries, or change poses, margins and meshes, and nobody waits for a query. The first change
    during a query copies the tables of the scene (2 us for 60 instances, 0.3 ms for 10,000), and no mesh. Changes that
    belong together can be seen one by one, except those of `set_poses`: to query all or none of them, make them in a
    `copy`, and let other threads query that one. A copy takes a microsecond.
    Pickling keeps instances, numbers, names, poses, groups, margins, attachments and allowed pairs. Each mesh is pickled
    once, as by itself.
    An instance that is added later may have another place in the order than in the scene that was pickled.

    >>> import cbvh, numpy as np
    >>> vertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
    >>> tetrahedron = cbvh.bake(vertices, [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    >>> pose = np.eye(4)
    >>> pose[:3, 3] = [0, 0, 3]
    >>> scene = cbvh.Scene()
    >>> floor, part = scene.add(tetrahedron, name="floor"), scene.add(tetrahedron, pose, name="part")
    >>> scene.distance().nearest.distance
    2.0
    >>> scene.set_pose(part, np.eye(4))
    >>> scene.pairs_in_contact().tolist()
    [[0, 1]]
    """

    __slots__ = ("_scene",)

    def __init__(self) -> None:
        """An empty scene."""
        self._scene = _cbvh.Scene()

    @staticmethod
    def open(path: str | os.PathLike[str]) -> Scene:
        """Opens a file of ``cbvh bake --scene``: its instances, in their order. Reads only its tables, whatever its
        size. The file is mapped, and its bytes must not change while it is open: see `cbvh.open`."""
        name = os.fsdecode(path)
        whole = os.path.abspath(name)
        scene = Scene.__new__(Scene)
        scene._scene = _cbvh.Scene.open(name, lambda mesh, object: Mesh(mesh, whole, object))
        return scene

    def copy(self) -> Scene:
        """A scene with the same instances and numbers. Meshes are shared."""
        other = Scene.__new__(Scene)
        other._scene = self._scene.copy()
        return other

    def __copy__(self) -> Scene:
        return self.copy()

    def __deepcopy__(self, memo: dict[int, Any]) -> Scene:
        # Meshes never change.
        return self.copy()

    def __reduce__(self) -> tuple[Any, ...]:
        # Nobody changes a copy while it is read.
        scene = self.copy()
        poses = scene.poses()
        rows = [
            (number, scene.mesh(number), scene.name(number), scene.groups(number), poses[place], scene.margin(number))
            for place, number in enumerate(scene)
        ]
        parents = [(number, found) for number in scene if (found := scene._scene.parent(number)) is not None]
        pairs = (scene.allowed(), scene._scene.pair_margins(), parents)
        return (_scene_of, (rows, pairs, scene._scene.next(), scene._scene.switches()))

    def __repr__(self) -> str:
        return f"<cbvh.Scene: {len(self)} instances>"

    def add(
        self,
        mesh: Mesh,
        pose: ArrayLike | None = None,
        *,
        name: str | None = None,
        member: int = ALL_GROUPS,
        meets: int = ALL_GROUPS,
        solid: bool = False,
    ) -> int:
        """Adds an instance, and returns its number.

        ``pose`` (body to world) has shape (4, 4); None is the identity. It must be rigid to within 2^-23. ``name``: a
        name that no other instance has. ``member`` are the groups that the instance is in, and ``meets`` those that it
        meets, one bit for each of 32. Queries are about two instances if each is in a group that the other meets.
        ``solid`` makes what is inside touch the instance, as `Mesh.solid` does; ValueError if the mesh is not closed.
        Without it, what is wholly inside a mesh does not touch it, and `relations` tells of it.
        """
        if not isinstance(mesh, Mesh):
            raise TypeError(f"mesh: expected a cbvh.Mesh, found {type(mesh).__name__}")
        mesh = mesh.solid() if solid else mesh
        if name is not None and not isinstance(name, str):
            raise TypeError(f"name: expected a str or None, found {type(name).__name__}")
        groups = [_groups(member, "member"), _groups(meets, "meets")]
        return self._scene.add(mesh._mesh, mesh, pose, name, groups, None)

    def remove(self, id: int | str) -> None:
        """Removes an instance, and its permissions to touch others. What is attached to it stays where it is."""
        self._scene.remove(self._number(id, "id"))

    def set_mesh(self, id: int | str, mesh: Mesh) -> None:
        """Replaces the mesh of an instance, such as a cloud of points that a camera sees again and again. Everything else
        stays: its number, name, pose, groups, margins, permissions and attachments."""
        if not isinstance(mesh, Mesh):
            raise TypeError(f"mesh: expected a cbvh.Mesh, found {type(mesh).__name__}")
        self._scene.set_mesh(self._number(id, "id"), mesh._mesh, mesh)

    def attach(self, child: int | str, parent: int | str) -> None:
        """Attaches an instance to a parent, with which it moves from then on: a part to the gripper that holds it.

        If the child was attached to another parent, it no longer is. The scene keeps the pose of the child in the
        parent's frame. The pose in the world is always that of the parent times the one that is kept, so that nothing
        adds up over many moves. `set_pose` of the child changes what is kept. In a `motion`, the child follows the path
        of its parent, unless it has a path of its own. Permissions to touch do not change: a gripper usually touches
        what it holds, so allow this pair (`set_allowed`), and forbid it again after `detach`. ValueError if the parent is
        the child itself or moves with it.
        """
        self._scene.attach(self._number(child, "child"), self._number(parent, "parent"), None)

    def detach(self, child: int | str) -> None:
        """Detaches an instance from its parent, if it has one. It stays where it is."""
        self._scene.detach(self._number(child, "child"))

    def parent(self, child: int | str) -> int | None:
        """The number of the instance that an instance is attached to, or None."""
        found = self._scene.parent(self._number(child, "child"))
        return None if found is None else found[0]

    def set_pose(self, id: int | str, pose: ArrayLike) -> None:
        """Moves an instance, and those that are attached to it. ``pose`` (body to world) has shape (4, 4), and must be
        rigid to within 2^-23. If one that follows has no valid pose there, nothing moves."""
        self._scene.set_pose(self._number(id, "id"), pose)

    def set_poses(self, ids: ArrayLike, poses: ArrayLike) -> None:
        """Moves many instances: ``ids`` (numbers or names) of shape (N,), ``poses`` (body to world) of shape (N, 4, 4).
        If an instance is given twice, the last pose counts; otherwise the order does not matter. Those that are attached
        to one of them and not given follow. If an argument is wrong, no instance moves."""
        self._scene.set_poses(self._ids(ids), poses)

    def set_groups(self, id: int | str, *, member: int | None = None, meets: int | None = None) -> None:
        """Puts an instance into groups: see `add`. None leaves them as they are."""
        number = self._number(id, "id")
        known = self._scene.groups(number)
        groups = [_groups(known[0] if member is None else member, "member")]
        groups.append(_groups(known[1] if meets is None else meets, "meets"))
        self._scene.set_groups(number, groups)

    def groups(self, id: int | str) -> tuple[int, int]:
        """The groups that an instance is in, and those that it meets."""
        return self._scene.groups(self._number(id, "id"))

    def set_allowed(self, a: int | str, b: int | str, allowed: bool = True) -> None:
        """Allows two instances to touch, such as neighbours on a robot, or forbids it again. No query is about an
        allowed pair."""
        self._scene.set_allowed(self._number(a, "a"), self._number(b, "b"), bool(allowed))

    def allowed(self) -> NDArray[np.int64]:
        """The pairs that may touch, shape (K, 2)."""
        return self._scene.allowed()

    def set_margin(self, id: int | str, margin: float) -> None:
        """Gives an instance a margin in mesh units, which is added to the radius of its mesh in every query. 0 at first.
        What is attached to the instance has a margin of its own."""
        self._scene.set_margin(self._number(id, "id"), _cbvh.number(margin, "margin"))

    def margin(self, id: int | str) -> float:
        """The margin of an instance."""
        return self._scene.margin(self._number(id, "id"))

    def set_pair_margin(self, a: int | str, b: int | str, margin: float) -> None:
        """Gives a pair of instances a further margin in mesh units. 0 at first."""
        self._scene.set_pair_margin(self._number(a, "a"), self._number(b, "b"), _cbvh.number(margin, "margin"))

    def find(self, name: str) -> int | None:
        """The number of the instance with a name, or None."""
        if not isinstance(name, str):
            raise TypeError(f"name: expected a str, found {type(name).__name__}")
        return self._scene.find(name)

    def name(self, id: int | str) -> str | None:
        """The name of an instance, or None."""
        return self._scene.name(self._number(id, "id"))

    def mesh(self, id: int | str) -> Mesh:
        """The mesh of an instance."""
        found: Mesh = self._scene.mesh(self._number(id, "id"))
        return found

    def pose(self, id: int | str) -> Floats:
        """The pose of an instance (body to world), shape (4, 4)."""
        return self._scene.pose(self._number(id, "id"))

    def poses(self, ids: ArrayLike | None = None) -> Floats:
        """The poses (body to world) of instances, shape (N, 4, 4); of all, in their order, if ``ids`` is None."""
        return self._scene.poses(self._scene.ids() if ids is None else self._ids(ids))

    def _number(self, value: Any, name: str) -> int:
        """The number of an instance, given by number or name."""
        if isinstance(value, str):
            found = self._scene.find(value)
            if found is None:
                raise KeyError(f"{name}: expected an instance of the scene, found {value!r}")
            return found
        try:
            number = operator.index(value)
        except TypeError:
            expected = "expected the number or the name of an instance"
            raise TypeError(f"{name}: {expected}, found {type(value).__name__}") from None
        if not 0 <= number < 2**63:
            raise KeyError(f"{name}: expected an instance of the scene, found {number}")
        return number

    def _ids(self, ids: Any, name: str = "ids", shape: tuple[int, ...] = ()) -> NDArray[np.int64]:
        """Numbers of instances, given by numbers or names, of shape (N,) and what each row has besides."""
        array = np.asarray(ids, None if isinstance(ids, np.ndarray) else object)
        if array.ndim == 1 + len(shape) and array.shape[1:] == shape or array.size == 0 and array.ndim == 1:
            if array.dtype.kind in "iu":
                return np.require(array, np.int64, ["C", "ALIGNED"])
            if array.dtype.kind in "OU":
                numbers = [self._number(value, name) for value in array.ravel().tolist()]
                return np.array(numbers, np.int64).reshape(-1, *shape)
        expected = f"(N, {shape[0]})" if shape else "(N,)"
        found = f"found dtype {array.dtype} of shape {array.shape}"
        raise ValueError(f"{name}: expected numbers or names of instances of shape {expected}, {found}")

    def __len__(self) -> int:
        return self._scene.count()

    def __iter__(self) -> Iterator[int]:
        return iter(self._scene.ids().tolist())

    def __contains__(self, id: object) -> bool:
        if isinstance(id, str):
            return self._scene.find(id) is not None
        return isinstance(id, (int, np.integer)) and 0 <= int(id) < 2**63 and self._scene.has(int(id))

    def __bool__(self) -> bool:
        return True

    @property
    def parallel(self) -> bool:
        """Whether a query uses all cores, or as many as the environment variable ``RAYON_NUM_THREADS`` says. Answers
        have the same bits. False by default."""
        return self._scene.switches()[0]

    @parallel.setter
    def parallel(self, parallel: bool) -> None:
        self._scene.set_switches(_cbvh.flag(parallel, "parallel"), self._scene.switches()[1])

    @property
    def tracking(self) -> bool:
        """Whether the scene reuses earlier results about each pair. This affects no answer, and saves time if instances
        move little from query to query. False by default."""
        return self._scene.switches()[1]

    @tracking.setter
    def tracking(self, tracking: bool) -> None:
        self._scene.set_switches(self._scene.switches()[0], _cbvh.flag(tracking, "tracking"))

    def view(self, path: str | os.PathLike[str] | None = None, *, max_bytes: int | None = None) -> View:
        """A page that shows the scene as it is, and which pairs touch. A notebook shows it at once, and ``path`` says where to
        save it. A mesh that many instances have is in the page once. ValueError if the meshes have more than ``max_bytes``, by
        default 256 MiB."""
        scene = self.copy()
        files = {number: called(scene.mesh(number)._path) for number in scene}
        return show(_cbvh.Page.scene(scene._scene, files, limit(max_bytes)), path)

    def collide(self) -> bool:
        """Whether any pair touches, exactly."""
        return _cbvh.scene_collide(self._scene)

    def within(self, d: float) -> bool:
        """Whether any pair is at most ``d`` mesh units apart, exactly."""
        return _cbvh.scene_within(self._scene, d)

    def pairs_in_contact(self) -> NDArray[np.int64]:
        """All pairs that touch, exactly: numbers of instances, shape (K, 2)."""
        return _cbvh.scene_pairs_in_contact(self._scene)

    def pairs_within(self, d: float) -> NDArray[np.int64]:
        """All pairs that are at most ``d`` mesh units apart, exactly: numbers of instances, shape (K, 2)."""
        return _cbvh.scene_pairs_within(self._scene, d)

    def relations(self) -> SceneRelations:
        """All pairs that touch, or of which one is inside the other, wholly or in part, with their relations. Also those whose boxes
        in the world meet and whose relation is UNDEFINED, because a mesh is not closed."""
        pairs, relations = _cbvh.scene_relations(self._scene)
        return SceneRelations(pairs, named(Relation, relations))

    def clashes(
        self,
        *,
        clearance: float = 0.0,
        tolerance: float | None = None,
        relative_gap: float = 0.1,
        visits: int | None = 1 << 20,
        magnitudes: bool = False,
    ) -> SceneClashes:
        """All pairs that are near each other, touch, overlap, contain each other or are duplicates, with how they lie. Pairs
        that are apart are left out. Arguments are those of `Mesh.clash`. The boxes of ``magnitudes`` are in the world, along its
        axes."""
        pairs, clash = _cbvh.scene_clashes(self._scene, (clearance, tolerance, relative_gap, visits, magnitudes))
        return SceneClashes(pairs, clash_of(clash))

    def contacts(self) -> SceneContacts:
        """All pairs of triangles that touch, exactly."""
        return SceneContacts(*_cbvh.scene_contacts(self._scene))

    def distance(self) -> SceneDistance | None:
        """The nearest pair and its distance, or None if there are no pairs. Points are in A's frame."""
        return _nearest(_cbvh.scene_distance(self._scene))

    def signed_distance(
        self, *, relative_gap: float = 0.01, tolerance: float | None = None
    ) -> SceneSignedDistance | None:
        """The pair that overlaps most, by its lower bound, or else the nearest pair, and its signed distance: the distance, or
        minus the depth. None if there are no pairs. A pair of which one is inside the other overlaps, if both are closed.

        The signed distance of every other pair is at least the lower bound of this one, but for roundings of distances. Of equal
        pairs, the answer is the first. Points, normal and translation are in A's frame. ``relative_gap`` and ``tolerance`` end
        the search for each depth, as in `Mesh.signed_distance`. Raises ValueError if an option is wrong, or if a mesh in question
        was baked without topology. Cost: that of `relations`, and a depth for each pair that overlaps; where none does, that of
        `distance`.
        """
        found = _cbvh.scene_signed_distance(self._scene, relative_gap, tolerance)
        if found is None:
            return None
        a, b, nearest = found
        return SceneSignedDistance(a, b, SignedDistance(*nearest))

    def near_pairs(self, margin: float, *, relative_gap: float = 0.01, tolerance: float | None = None) -> SceneNearPairs:
        """All pairs that overlap or are at most ``margin`` mesh units apart, with their signed distances: the distance, or minus the
        depth.

        It is decided exactly which pairs are at most that far apart. A pair of which one is inside the other overlaps, if both are
        closed. Points, normals and translations are in A's frame. ``relative_gap`` and ``tolerance`` end the search for each depth,
        as in `Mesh.signed_distance`. Raises ValueError if a number is wrong, or if a mesh in question was baked without topology.
        Cost: that of `pairs_within`, and a distance or a depth for each pair that is near.
        """
        pairs, distance, nearest = _cbvh.scene_near_pairs(self._scene, margin, relative_gap, tolerance)
        return SceneNearPairs(pairs, distance, SignedDistance(*nearest))

    def distances(
        self, pairs: ArrayLike | None = None, *, within: float | None = None, parallel: bool = False
    ) -> SceneDistances:
        """How far apart pairs of instances are, pair by pair, with certified bounds and closest points.

        ``pairs``: numbers or names of instances, shape (K, 2). These may be any pairs. None: all pairs whose groups
        meet and whose contact is not allowed, in their order or, with ``within``, those of them that are at most so
        many mesh units apart. Each answer is that of `Mesh.distance` for the pose of B in A's frame, to the bit.
        Without either argument, the cost grows with the square of the number of instances.
        """
        if pairs is not None and within is not None:
            raise ValueError("within: expected None beside pairs, found a distance")
        # Nobody moves a copy while it is read.
        scene = self.copy()
        if pairs is not None:
            rows = scene._ids(pairs, "pairs", (2,)).reshape(-1, 2)
        else:
            rows = scene._asked() if within is None else scene.pairs_within(within)
        return SceneDistances(rows, Distance(*scene._of_pairs(rows, lambda a, b, at: a.distance(b, at, parallel=parallel))))

    def penetrations(
        self,
        pairs: ArrayLike | None = None,
        *,
        relative_gap: float = 0.01,
        tolerance: float | None = None,
        budget: int | None = None,
        parallel: bool = False,
    ) -> ScenePenetrations:
        """How deep pairs of instances overlap, pair by pair, with translations of B in A's frame that separate them.

        ``pairs``: numbers or names of instances, shape (K, 2). These may be any pairs. None: the pairs of `relations`, which
        touch or of which one is inside the other, wholly or in part. Each answer is that of `Mesh.penetration` for the
        pose of B in A's frame, and the other arguments are those of that. Raises ValueError if a mesh of a pair is not
        closed.
        """
        scene = self.copy()
        rows = scene.relations().pairs if pairs is None else scene._ids(pairs, "pairs", (2,)).reshape(-1, 2)

        def ask(a: Mesh, b: Mesh, poses: Floats) -> Penetration:
            return a.penetration(
                b, poses, relative_gap=relative_gap, tolerance=tolerance, budget=budget, parallel=parallel
            )

        return ScenePenetrations(rows, Penetration(*scene._of_pairs(rows, ask)))

    def _of_pairs(
        self, rows: NDArray[np.int64], ask: Callable[[Mesh, Mesh, Floats], tuple[Any, ...]]
    ) -> list[NDArray[Any]]:
        """The parts of the answers about pairs of instances of a scene that nobody changes."""
        places, inverse = np.unique(rows, return_inverse=True)
        of_rows: NDArray[Any] = inverse.reshape(-1, 2)
        poses, meshes = self.poses(places), [self.mesh(number) for number in places.tolist()]
        relative_poses = _cbvh.relative_poses(poses[of_rows[:, 0]], poses[of_rows[:, 1]])
        # One query per pair of meshes and margins, of which a scene has few.
        of_pair = {(a, b): margin for a, b, margin in self._scene.pair_margins()}
        margins = [self.margin(number) for number in places.tolist()]
        numbers: dict[tuple[Mesh, float], int] = {}
        kinds = np.zeros(rows.shape, np.int64)
        for row, (pair, (a, b)) in enumerate(zip(rows.tolist(), of_rows.tolist())):
            further = of_pair.get((min(pair), max(pair)), 0.0)
            for side, key in enumerate(((meshes[a], margins[a] + further), (meshes[b], margins[b]))):
                kinds[row, side] = numbers.setdefault(key, len(numbers))
        shapes = [mesh.rounded(mesh.radius + margin) if margin else mesh for mesh, margin in numbers]
        # The answer to no query tells the parts, and the other arguments are checked.
        empty = _empty()
        parts = [np.zeros((len(rows), *part.shape[1:]), part.dtype) for part in ask(empty, empty, relative_poses[:0])]
        for a, b in np.unique(kinds, axis=0).tolist():
            chosen = np.flatnonzero((kinds == [a, b]).all(axis=1))
            for part, found in zip(parts, ask(shapes[a], shapes[b], relative_poses[chosen])):
                part[chosen] = found
        return parts

    def _asked(self) -> NDArray[np.int64]:
        """All pairs that are checked, in their order, shape (K, 2)."""
        numbers = self._scene.ids()
        groups = np.array([self._scene.groups(number) for number in numbers.tolist()], np.int64).reshape(-1, 2)
        allowed = {(min(pair), max(pair)) for pair in self.allowed().tolist()}
        pairs: list[tuple[int, int]] = []
        for place, (member, meets) in enumerate(groups.tolist()):
            others = groups[place + 1 :]
            does = (others[:, 1] & member != 0) & (others[:, 0] & meets != 0)
            a = int(numbers[place])
            found = numbers[place + 1 :][does].tolist()
            pairs += [(a, b) for b in found if (min(a, b), max(a, b)) not in allowed]
        return np.array(pairs, np.int64).reshape(-1, 2)

    def closest_points(
        self, points: ArrayLike, *, within: float = np.inf, instances: ArrayLike | None = None
    ) -> SceneClosestPoint:
        """The points of instances that are closest to ``points`` in the world, of shape (3,) or (N, 3).

        ``within``: the greatest distance to search, in mesh units. ``instances``: numbers or names of the instances to
        search, shape (K,); None: all.
        """
        scene = self._scene if instances is None else self._scene.only(self._ids(instances, "instances"))
        found_of, found = _cbvh.closest_points(scene, points, within)
        return SceneClosestPoint(found_of, ClosestPoint(*found))

    def sides(self, points: ArrayLike) -> Any:
        """On which side of the instances points in the world are, exactly: a `Side`, or an array of their numbers,
        shape (N,).

        A point is INSIDE if it is inside any instance; else ON if it is on a surface; else UNDEFINED if it is in the
        box of an instance that has no inside; else OUTSIDE.
        """
        return named(Side, _cbvh.sides(self._scene, points))

    def signed_point_distances(self, points: ArrayLike, *, within: float = np.inf) -> Any:
        """Distances of points in the world from the closest surface, negative inside any instance: a float, or shape
        (N,).

        NaN if the side is UNDEFINED, or if no instance is within ``within``.
        """
        return _cbvh.signed_point_distances(self._scene, points, within)

    def first_hits(self, origins: ArrayLike, directions: ArrayLike, *, until: ArrayLike = np.inf) -> SceneRayHit:
        """Where rays in the world first hit an instance. Arguments are those of `Mesh.first_hits`."""
        return _hits(_cbvh.first_hits(self._scene, origins, directions, until))

    def any_hits(self, origins: ArrayLike, directions: ArrayLike, *, until: ArrayLike = np.inf) -> Any:
        """Whether rays in the world hit any instance, exactly: bool, or an array of shape (N,)."""
        return _cbvh.any_hits(self._scene, origins, directions, until)

    def all_hits(self, origins: ArrayLike, directions: ArrayLike, *, until: ArrayLike = np.inf) -> Any:
        """All hits of rays in the world, in the exact order along each: a `SceneRayHit` of arrays, or a list of N.

        Each parameter occurs once, however many instances are hit at exactly that parameter. An instance with a radius or a
        margin is a body of its own, which the ray enters and leaves: see `Mesh.all_hits`.
        """
        found = _cbvh.all_hits(self._scene, origins, directions, until)
        return [_hits(of_ray) for of_ray in found] if isinstance(found, list) else _hits(found)

    def segment_hits(self, starts: ArrayLike, ends: ArrayLike) -> Any:
        """Whether closed segments in the world meet any instance, exactly: bool, or an array of shape (N,)."""
        return _cbvh.segment_hits(self._scene, starts, ends)

    def visible(self, points_a: ArrayLike, points_b: ArrayLike, *, margin: float = 0.0) -> Any:
        """Whether points in the world see each other past all instances: bool, or an array of shape (N,). Arguments are those of
        `Mesh.visible`."""
        return _cbvh.visible(self._scene, points_a, points_b, margin)

    def motion(
        self, paths: Mapping[int | str, Path], *, clearance: float = 0.0, tolerance: float | None = None
    ) -> SceneMotionAnswer:
        """Are the paths of some instances free, while they move in the world at the same time and the others stand
        still?

        ``paths`` maps the number or name of each moving instance to a `Motion`, a `Polyline` or a path of your own
        (body to world). The query is about all pairs with at least one moving instance. ``clearance`` and
        ``tolerance`` are those of `Mesh.motion`. The present pose of a moving instance does not matter, and does not
        change. What is attached to a moving instance moves with it, unless it has a path of its own.
        """
        numbers, ways = self._ways(paths)
        kind, until, at, found = _cbvh.scene_motion(self._scene, numbers, ways, clearance, tolerance)
        a, b, nearest = _nearest(found) or (None, None, None)
        return SceneMotionAnswer(MotionKind(kind), until, at, a, b, nearest)

    def is_free(
        self, paths: Mapping[int | str, Path], *, clearance: float = 0.0, tolerance: float | None = None
    ) -> bool:
        """Whether `motion` answers FREE. It takes less time than `motion`, and has the same arguments."""
        numbers, ways = self._ways(paths)
        return _cbvh.scene_is_free(self._scene, numbers, ways, clearance, tolerance)

    def _ways(self, paths: Mapping[int | str, Path]) -> tuple[list[int], list[Any]]:
        """The numbers of instances, and their paths as the compiled module takes them."""
        if not isinstance(paths, Mapping):
            raise TypeError(f"paths: expected a mapping of instances to paths, found {type(paths).__name__}")
        items = list(paths.items())
        numbers = [self._number(number, "paths") for number, _ in items]
        if len(set(numbers)) < len(numbers):
            raise ValueError("paths: expected one path per instance, found two for one")
        return numbers, [read_path(path, f"paths[{number!r}]") for number, path in items]


@functools.cache
def _empty() -> Mesh:
    """A mesh that no query is about."""
    return Mesh(_cbvh.cloud_core([[0, 0, 0]], "points"))


def _hits(found: tuple[Any, tuple[Any, ...]]) -> SceneRayHit:
    instances, hits = found
    return SceneRayHit(instances, RayHit(*hits))


def _nearest(found: tuple[int, int, tuple[Any, ...]] | None) -> SceneDistance | None:
    """A pair and its distance, if there is a pair."""
    if found is None:
        return None
    a, b, distance = found
    return SceneDistance(a, b, Distance(*distance))


def _scene_of(
    rows: list[tuple[int, Mesh, str | None, tuple[int, int], Floats, float]],
    pairs: tuple[NDArray[np.int64], list[tuple[int, int, float]], list[tuple[int, tuple[int, Floats]]]],
    next: int,
    switches: tuple[bool, bool],
) -> Scene:
    """A scene as it was pickled."""
    scene = Scene()
    for number, mesh, name, groups, pose, margin in rows:
        scene._scene.add(mesh._mesh, mesh, pose, name, list(groups), number)
        scene.set_margin(number, margin)
    allowed, margins, parents = pairs
    for a, b in allowed.tolist():
        scene.set_allowed(a, b)
    for a, b, margin in margins:
        scene.set_pair_margin(a, b, margin)
    for child, (parent, kept) in parents:
        scene._scene.attach(child, parent, kept)
    scene._scene.skip_to(next)
    scene._scene.set_switches(*switches)
    return scene
