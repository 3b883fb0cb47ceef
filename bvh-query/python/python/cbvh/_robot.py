"""Robots: queries in joint space, about a URDF among obstacles."""

from __future__ import annotations

import os
import sys
import warnings
from typing import Any, Iterable, Literal, Mapping, NamedTuple, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _cbvh
from ._answers import Floats, MotionKind, SignedDistance
from ._mesh import Mesh

Paths = Iterable["str | os.PathLike[str]"]


class RobotDistance(NamedTuple):
    """The nearest two bodies, or those of each of N configurations."""

    distance: Any
    """How far apart they are: a number, or an array of shape (N,). Infinite if no pairs are checked."""
    lower: Any
    """A lower bound of the exact distance."""
    upper: Any
    """An upper bound of it."""
    bodies: Any
    """Their names, or a list of those."""
    points: Any
    """The nearest points of both in the world, shape (2, 3) or (N, 2, 3)."""


class RobotSignedDistance(NamedTuple):
    """The two bodies with the least signed distance, or those of each of N configurations."""

    bodies: Any
    """Their names, or a list of those. None if no pairs are checked."""
    nearest: SignedDistance
    """How far apart they are or, below zero, how deep they overlap: what `Mesh.signed_distance` answers, but with points, normal
    and translation in the world. If no pairs are checked, the bounds are infinite, and the other numbers NaN."""


class NearPair(NamedTuple):
    """Two bodies that overlap or are near each other: see `Robot.near_pairs`."""

    a: str
    """The name of the first body."""
    b: str
    """The name of the second body."""
    distance: float
    """The signed distance: the distance or, where they overlap, ``lower``."""
    lower: float
    """A certified lower bound of the signed distance."""
    upper: float
    """A certified upper bound of it."""
    point_a: Floats
    """The closest point of A in the world or, where they overlap, the one that B touches where it comes free. Shape (3,)."""
    point_b: Floats
    """The closest point of B in the world or, where they overlap, the one that comes to ``point_a``."""
    normal: Floats
    """The direction in which B moves away from A, in the world, at unit length; 0 where none is known. Shape (3,)."""
    gradient: Floats
    """The derivative of ``distance`` by each joint value, in the order of `Robot.joints`. Shape (n,)."""
    is_signed: bool
    """Whether both bodies have an inside, and so a depth where they overlap."""


class NearPairs(NamedTuple):
    """The near pairs of N configurations, K in all: first those of the first configuration. See `NearPair` for the fields."""

    row: NDArray[np.int64]
    """The configuration of each pair, from 0. Shape (K,)."""
    a: list[str]
    b: list[str]
    distance: Floats
    """Shape (K,), like the bounds."""
    lower: Floats
    upper: Floats
    point_a: Floats
    """Shape (K, 3), like ``point_b`` and ``normal``."""
    point_b: Floats
    normal: Floats
    gradient: Floats
    """Shape (K, n)."""
    is_signed: NDArray[np.bool_]
    """Shape (K,)."""


class RobotMotion(NamedTuple):
    """How a motion in joint space ends."""

    kind: MotionKind
    free_until: float
    """Before this time certainly nothing comes within the clearance. 1 if the motion is free."""
    touching_at: float
    """The time of the hit, or of the first undecided configuration; NaN if the motion is free."""
    joints: Floats
    """The joint values at that time."""
    bodies: tuple[str, str] | None
    """The two bodies that come near."""
    distance: float
    """Their distance at that time."""


class InsideWarning(UserWarning):
    """A body starts inside a closed obstacle that is not solid, so that it does not touch it: see `Robot.add_obstacle`."""


class Robot:
    """A robot among obstacles, with queries by the values of its joints.

    A body is a link, an obstacle or an attached object. Queries are about all pairs of bodies that can move against each
    other, but for those whose contact is allowed: by `allow`, or by the SRDF. Links that only fixed joints connect, and
    obstacles among themselves, are never checked. Links are surfaces, if they are meshes, and primitives are solid.

    An array of joint values ``q`` has shape (n,) for one configuration, or (N, n) for N of them, in the order of `joints`.
    Angles are in radians, lengths in metres. Answers are certain, and the same bits on all systems. ``parallel=True`` divides
    N configurations among all cores. Threads may share a robot: a query is about the robot as it is when the query
    begins. A robot can be copied and pickled. A pickle holds all of it: links, obstacles, attached objects, margins and allowed
    pairs, and no file of the robot is read again. A mesh that was opened from a file is pickled as its path, like any `Mesh`.

    >>> robot = cbvh.Robot.from_urdf("panda.urdf", srdf="panda.srdf")       # doctest: +SKIP
    >>> robot.add_obstacle(cbvh.box([1, 1, 0.02]), name="table")            # doctest: +SKIP
    >>> robot.is_free(robot.states["arm"]["home"], goal)                    # doctest: +SKIP
    True
    """

    __slots__ = ("_robot", "_unseen")
    _robot: _cbvh.Robot
    # The surfaces among obstacles that no query has been about, which then warns of what is inside.
    _unseen: frozenset[str]

    def __init__(self) -> None:
        raise TypeError("Robot: use Robot.from_urdf")

    @classmethod
    def _of(cls, robot: _cbvh.Robot, unseen: frozenset[str] = frozenset()) -> Robot:
        self = object.__new__(cls)
        self._robot, self._unseen = robot, unseen
        return self

    @classmethod
    def from_urdf(
        cls,
        path: str | os.PathLike[str],
        package_dirs: Paths = (),
        srdf: str | os.PathLike[str] | None = None,
        *,
        geometry: Literal["collision", "visual"] = "collision",
        base: Literal["fixed", "planar", "floating"] = "fixed",
        cylinder_error: float = 1e-3,
        apply_up_axis: bool = False,
        cache: str | os.PathLike[str] | None = None,
        allow_outside: bool = False,
    ) -> Robot:
        """Reads a URDF file and bakes the shapes of all links: OBJ, STL, PLY, glTF and COLLADA meshes, and primitives.

        ``package://`` paths are looked for in ``package_dirs``, in ``ROS_PACKAGE_PATH`` and in the folders above the file.
        Pairs of links that ``srdf`` disables are not checked. A ``base`` that moves adds joint values: ``base/x``,
        ``base/y`` and ``base/theta``, or ``base/x`` to ``base/z`` and a quaternion, ``base/qx`` to ``base/qw``. A cylinder is a
        prism around it, wider by at most ``cylinder_error`` of its radius. ``apply_up_axis`` turns COLLADA meshes so that the
        axis that they declare to point up becomes z; rviz, MoveIt, Gazebo and Pinocchio leave them as they are. Their unit is always
        applied. ``cache`` names a folder for baked meshes.

        Meshes must be in the folder above that of the file or below it, in its package, in a package that a ``package://`` path
        names, or in ``package_dirs``; ``allow_outside=True`` lets the file name any, and glTF meshes any buffers. What is read
        otherwise than may have been meant is in `warnings`.

        Raises ValueError for a description that is not as it should be, FileNotFoundError and BakeError for its meshes.
        """
        for name, value, known in (
            ("geometry", geometry, ("collision", "visual")),
            ("base", base, ("fixed", "planar", "floating")),
        ):
            if value not in known:
                raise ValueError(f"{name}: expected one of {', '.join(known)}, found {value!r}")
        if isinstance(package_dirs, (str, os.PathLike)):
            package_dirs = [package_dirs]
        return cls._of(
            _cbvh.Robot.from_urdf(
                os.fspath(path),
                [os.fspath(folder) for folder in package_dirs],
                None if srdf is None else os.fspath(srdf),
                geometry == "visual",
                base,
                _cbvh.number(cylinder_error, "cylinder_error"),
                _cbvh.flag(apply_up_axis, "apply_up_axis"),
                None if cache is None else os.fspath(cache),
                _cbvh.flag(allow_outside, "allow_outside"),
            )
        )

    def copy(self) -> Robot:
        """A robot of its own with the same obstacles. It shares all meshes."""
        return self._of(self._robot.copy(), self._unseen)

    def __copy__(self) -> Robot:
        return self.copy()

    def __deepcopy__(self, memo: dict[int, Any]) -> Robot:
        # Meshes never change.
        return self.copy()

    def __reduce__(self) -> tuple[Any, ...]:
        texts, (cores, links), others, margins, allowed = self._robot.parts()
        rows = [
            (name, mesh.solid() if is_solid and not mesh.is_solid else mesh, link, np.reshape(pose, (4, 4)))
            for name, mesh, is_solid, link, pose in others
        ]
        return (_robot_of, (texts, [Mesh(core) for core in cores], links, rows, margins, allowed, self._unseen))

    @property
    def name(self) -> str:
        """The name of the robot."""
        return self._robot.name()

    @property
    def joints(self) -> list[str]:
        """The names of the joint values, in the order of ``q``, which is that of the URDF file.

        A planar joint has three, ``NAME/x``, ``NAME/y`` and ``NAME/theta``, a floating one seven, ``NAME/x`` to ``NAME/z`` and
        ``NAME/qx`` to ``NAME/qw``. Fixed joints and those that mimic others have none.
        """
        return self._robot.joints()

    @property
    def limits(self) -> NDArray[np.float64]:
        """The lower and upper limit of each joint value, shape (n, 2), infinite where there is none. A lower limit above the upper
        one is none, with a warning. No query checks them."""
        return np.array(self._robot.limits(), dtype=np.float64).reshape(-1, 2)

    @property
    def links(self) -> list[str]:
        """The names of the links, each after the link that it hangs from."""
        return self._robot.links()

    @property
    def warnings(self) -> list[str]:
        """What was read otherwise than its author may have meant, one line each, which begins with the file and the line there or
        the link. Among them are a robot without shapes (see ``geometry``), mimic joints without a joint to follow, limits that are
        the wrong way round, names in the SRDF that the robot does not have, and what the readers of meshes left out."""
        return self._robot.warnings()

    @property
    def groups(self) -> dict[str, list[str]]:
        """The joint values of each group of the SRDF."""
        joints = self.joints
        return {name: [joints[place] for place in places] for name, places in self._robot.groups()}

    @property
    def states(self) -> dict[str, dict[str, dict[str, float]]]:
        """The named configurations of the SRDF: for each group and name, values by the names of joints. See `q`."""
        joints = self.joints
        states: dict[str, dict[str, dict[str, float]]] = {}
        for group, name, values in self._robot.states():
            states.setdefault(group, {})[name] = {joints[place]: value for place, value in values}
        return states

    def q(self, values: Mapping[str, float] | None = None, **more: float) -> NDArray[np.float64]:
        """Joint values by name; 0 for all others, and no rotation for a floating joint."""
        joints = self.joints
        q = np.array([1.0 if name.endswith("/qw") else 0.0 for name in joints])
        for name, value in {**(values or {}), **more}.items():
            if name not in joints:
                raise KeyError(f"expected the name of a joint value, found {name!r}")
            q[joints.index(name)] = _cbvh.number(value, name)
        return q

    @property
    def pairs(self) -> list[tuple[str, str]]:
        """The pairs of bodies that are checked."""
        return [(a, b) for a, b in self._robot.pairs()]

    def allow(self, a: str, b: str, allowed: bool = True) -> None:
        """Allows contact between two bodies, so that they are not checked; or checks them again."""
        self._robot.allow(a, b, _cbvh.flag(allowed, "allowed"))

    def allow_frequent(self, samples: int = 1000, share: float = 0.95) -> list[tuple[tuple[str, str], float]]:
        """Allows contact between pairs that collide in nearly every configuration, and returns them with their shares.

        These are the pairs that touch in at least ``share``, above 0 and at most 1, of so many random configurations within the
        joints' limits, as in MoveIt's assistant. A joint value without limits is taken between -pi and pi. The configurations are
        the same each time.
        """
        found = self._robot.allow_frequent(samples, share)
        return [((a, b), part) for (a, b), part in found]

    def add_obstacle(
        self,
        mesh: Mesh,
        pose: ArrayLike | None = None,
        name: str | None = None,
        *,
        solid: bool | None = None,
    ) -> str:
        """Adds an obstacle: a mesh or a shape that stands in the world, at a pose of shape (4, 4). Returns its name.

        ``solid=True`` makes what is inside touch it, as `Mesh.solid` does; ValueError if the mesh is not closed. Otherwise a mesh
        is its surface, and what is wholly inside does not touch it, as in a room. By default, `InsideWarning` tells of what is
        inside: `collide`, `is_free` and `motion` look once for each obstacle, when they are first called after it was added, at
        the first configuration that they are given. That takes as long as `pairs_inside`. ``solid=False`` says that the mesh is
        meant as a shell, and nobody looks. Shapes such as `box` are solid anyway.
        """
        name = self._free_name("obstacle") if name is None else name
        mesh = mesh.solid() if solid else mesh
        self._robot.add_obstacle(name, mesh._mesh, mesh, pose)
        if solid is None and not mesh.is_solid:
            self._unseen |= {name}
        return name

    def _look_inside(self, q: NDArray[np.float64]) -> None:
        """Warns of what is inside obstacles that were added since the last call, in one configuration."""
        unseen, self._unseen = self._unseen, frozenset()
        try:
            found = self._robot.pairs_inside(np.ascontiguousarray(q[None]), False)[0]
        except (ValueError, KeyError):
            return  # Without an answer, there is nothing to warn of; `pairs_inside` says why.
        for inner, outer in found:
            if outer in unseen:
                warnings.warn(
                    f"{inner} is inside the surface of {outer}, which it does not touch; add {outer} with solid=True if it is"
                    " full, or with solid=False if it is a shell",
                    InsideWarning,
                    stacklevel=_level_of_caller(),
                )

    def attach(
        self,
        mesh: Mesh,
        link: str,
        pose: ArrayLike | None = None,
        name: str | None = None,
        may_touch: Sequence[str] = (),
        *,
        solid: bool = False,
    ) -> str:
        """Attaches a mesh to a link, at a pose in the link's frame. It may touch that link and those of ``may_touch``.

        The link's margin does not apply to what is attached, which has a margin of its own, 0 at first: see `set_margin`.
        ``solid``: see `add_obstacle`.
        """
        name = self._free_name("attached") if name is None else name
        mesh = mesh.solid() if solid else mesh
        self._robot.attach(name, mesh._mesh, mesh, link, pose, list(may_touch))
        return name

    def _free_name(self, kind: str) -> str:
        number = 0
        while True:
            number += 1
            name = f"{kind} {number}"
            try:
                self._robot.set_margin(name, 0.0)
            except KeyError:
                return name

    def remove(self, name: str) -> None:
        """Removes an obstacle or an attached object."""
        self._robot.remove(name)

    def set_pose(self, name: str, pose: ArrayLike) -> None:
        """Moves an obstacle, or an attached object in the frame of its link."""
        self._robot.set_pose(name, pose)

    def set_margin(self, name: str, margin: float) -> None:
        """Sets how near others may come to a body: a link, an obstacle or an attached object. Nearer counts as contact, and
        distances are less by it. The margin is that of this body alone: what is attached to a link does not get the link's."""
        self._robot.set_margin(name, _cbvh.number(margin, "margin"))

    def make_solid(self, name: str) -> None:
        """Makes a body a solid: what is inside touches it from now on, also inside the mesh of a link. ValueError if its
        mesh is not closed."""
        self._robot.make_solid(name)

    def _rows(self, q: ArrayLike, name: str = "q") -> tuple[NDArray[np.float64], bool]:
        rows = _cbvh.copied_numbers(q, name)
        count = len(self.joints)
        if rows.ndim not in (1, 2) or rows.shape[-1] != count:
            raise ValueError(f"{name}: expected shape ({count},) or (N, {count}), found {rows.shape}")
        return np.atleast_2d(rows), rows.ndim == 1

    def link_poses(self, q: ArrayLike) -> NDArray[np.float64]:
        """The poses of all links in the world, in the order of `links`: shape (links, 4, 4) or (N, links, 4, 4)."""
        rows, one = self._rows(q)
        poses = self._robot.link_poses(rows).reshape(len(rows), len(self.links), 4, 4)
        return poses[0] if one else poses

    def collide(self, q: ArrayLike, *, parallel: bool = False) -> Any:
        """Whether any two bodies touch: a bool, or an array of shape (N,). What is inside a surface does not touch it: see
        `pairs_inside`."""
        rows, one = self._rows(q)
        found = self._robot.collide(rows, parallel)
        if self._unseen and len(rows):
            self._look_inside(rows[0])
        return bool(found[0]) if one else found

    def pairs_in_contact(self, q: ArrayLike, *, parallel: bool = False) -> Any:
        """The names of the bodies that touch: a list of pairs, or a list of N lists."""
        rows, one = self._rows(q)
        found = [[(a, b) for a, b in pairs] for pairs in self._robot.pairs_in_contact(rows, parallel)]
        return found[0] if one else found

    def pairs_inside(self, q: ArrayLike, *, parallel: bool = False) -> Any:
        """The names of the bodies that are inside others without touching them, each with the body around it: a list of pairs,
        or a list of N lists.

        `collide` does not find them, and a motion within is free, because a mesh is its surface. If the outer body is meant to be
        full, add it with ``solid=True``, or call `make_solid`. A body counts if a connected part of it is inside a mesh of the other
        one. A mesh that is not closed has nothing inside. ValueError if a file was baked without topology.
        """
        rows, one = self._rows(q)
        found = [[(inner, outer) for inner, outer in pairs] for pairs in self._robot.pairs_inside(rows, parallel)]
        return found[0] if one else found

    def nearest_turns(self, q0: ArrayLike, q1: ArrayLike) -> NDArray[np.float64]:
        """The goal q1 with whole turns added or taken away, so that each joint that turns without limits goes the short way from
        q0: by at most half a turn. The robot is in the same place, but for the rounding of the angle.

        Motions are straight in joint values, so that a continuous joint from 3.0 to -3.0 goes 6 radians the long way round. MoveIt
        and OMPL (``SO2StateSpace``) interpolate the short way:

        >>> robot.is_free(start, robot.nearest_turns(start, goal))              # doctest: +SKIP
        True

        The values of continuous joints, of revolute ones without limits, and ``NAME/theta`` turn so. Other values stay as they are,
        and so do those of joints which another joint mimics by sliding or by another multiple than a whole number. One row serves
        all rows of the other argument. The shape is that of a configuration, or (N, n).
        """
        from_, to, one = self._ends(q0, q1)
        nearest = self._robot.nearest_turns(from_, to).reshape(to.shape)
        return nearest[0] if one else nearest

    def _ends(self, q0: ArrayLike, q1: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64], bool]:
        """The starts and ends of motions, and whether it is one motion alone."""
        (from_, one), (to, other) = self._rows(q0, "q0"), self._rows(q1, "q1")
        if len(from_) != len(to) and not (one or other):
            raise ValueError(f"q1: expected {len(from_)} rows, as q0, found {len(to)}")
        from_, to = np.broadcast_arrays(from_, to)
        return np.ascontiguousarray(from_), np.ascontiguousarray(to), one and other

    def distance(self, q: ArrayLike, *, parallel: bool = False) -> RobotDistance:
        """The nearest two bodies, how far apart they are, and where; with arrays for N configurations."""
        rows, one = self._rows(q)
        found = self._robot.distance(rows, parallel)
        numbers = np.array([of[1] for of in found]).reshape(-1, 3)
        points = np.array([of[3] for of in found]).reshape(-1, 2, 3)
        bodies = [tuple(of[2]) if of[0] else None for of in found]
        if one:
            distance, lower, upper = numbers[0].tolist()
            return RobotDistance(distance, lower, upper, bodies[0], points[0])
        return RobotDistance(numbers[:, 0], numbers[:, 1], numbers[:, 2], bodies, points)

    def signed_distance(
        self,
        q: ArrayLike,
        *,
        relative_gap: float = 0.01,
        tolerance: float | None = None,
        parallel: bool = False,
    ) -> RobotSignedDistance:
        """The two bodies that overlap most or, where none do, the nearest ones, and their signed distance: the distance, or minus
        the depth; with arrays for N configurations.

        No other two bodies have a lower one, but for roundings and for how far the bounds of depths are apart. A body inside
        another one overlaps it, unless one of them is not closed. ``relative_gap`` and ``tolerance`` end the search for each
        depth, as in `Mesh.signed_distance`. Raises ValueError if an option is wrong, or if a mesh in question was baked without
        topology. Cost: that of `distance`, and a depth for each pair that overlaps.
        """
        rows, one = self._rows(q)
        names, parts = self._robot.signed_distance(rows, one, relative_gap, tolerance, parallel)
        bodies = [None if of is None else tuple(of) for of in names]
        return RobotSignedDistance(bodies[0] if one else bodies, SignedDistance(*parts))

    def near_pairs(
        self,
        q: ArrayLike,
        margin: float,
        *,
        relative_gap: float = 0.01,
        tolerance: float | None = None,
        parallel: bool = False,
    ) -> Any:
        """The bodies that overlap or are at most ``margin`` apart, in the order of `pairs`: a list of `NearPair` or, for N
        configurations, `NearPairs` with arrays. Planners that optimise a path use them as constraints or costs.

        It is decided exactly which bodies are at most that far apart. The distances are signed, as those of `signed_distance` are, and
        ``gradient`` is the derivative of ``distance`` by each joint value:

        >>> for pair in robot.near_pairs(q, 0.05):                              # doctest: +SKIP
        ...     q += (0.05 - pair.distance) * pair.gradient

        Where several points are equally near, as on parallel faces, the distance has a bend, and the derivative is that of one of
        these pairs of points: a subgradient. Where bodies overlap, it is the derivative along the way out that was found, of ``lower``,
        which a lower ``relative_gap`` brings nearer to the depth. It is 0 where the normal is, as for bodies that touch and have no
        depth. A floating joint has one by each number of its quaternion, which is divided by its length first.

        ``relative_gap`` and ``tolerance`` end the search for each depth, as in `Mesh.signed_distance`. Raises ValueError if a number is
        wrong, or if a mesh in question was baked without topology. Cost: that of `pairs_in_contact`, and a distance or a depth for
        each pair that is near.
        """
        rows, one = self._rows(q)
        a, b, parts = self._robot.near_pairs(rows, margin, relative_gap, tolerance, parallel)
        row, *columns = parts
        if not one:
            return NearPairs(row, a, b, *columns)
        distance, lower, upper, point_a, point_b, normal, gradient, is_signed = columns
        numbers = zip(distance.tolist(), lower.tolist(), upper.tolist())
        rest = zip(point_a, point_b, normal, gradient, is_signed.tolist())
        return [NearPair(*names, *of, *more) for names, of, more in zip(zip(a, b), numbers, rest)]

    def is_free(
        self,
        q0: ArrayLike,
        q1: ArrayLike,
        *,
        clearance: float = 0.0,
        tolerance: float | None = None,
        parallel: bool = False,
    ) -> Any:
        """Whether the straight motion from q0 to q1 in joint space is certainly free, at every moment.

        False means that at some moment two bodies are within the clearance, or that their gap beyond it falls below the
        tolerance: a millionth of the size of the smaller one, unless another one is given. A floating joint turns about one
        axis, the shorter way. Other joints turn by the difference of their values, however long that way is: a continuous joint
        from 3.0 to -3.0 goes the long way round, unless q1 is what `nearest_turns` returns. A body that is inside a surface all the
        way without touching it is free: see `pairs_inside`. One row serves all rows of the other argument. A joint that turns by more
        than 16,384 radians is refused with ValueError.
        """
        from_, to, one = self._ends(q0, q1)
        free = self._robot.is_free(from_, to, clearance, tolerance, parallel)
        if self._unseen and len(from_):
            self._look_inside(from_[0])
        return bool(free[0]) if one else free

    def motion(
        self, q0: ArrayLike, q1: ArrayLike, *, clearance: float = 0.0, tolerance: float | None = None
    ) -> RobotMotion:
        """What touches first on the straight motion from q0 to q1, and when. See `is_free`, also for the way round."""
        (from_, one), (to, other) = self._rows(q0, "q0"), self._rows(q1, "q1")
        if not (one and other):
            raise ValueError("q0 and q1: expected one configuration each, found several")
        return self.motion_along(np.stack([from_[0], to[0] - from_[0]], axis=1), clearance=clearance, tolerance=tolerance)

    def first_hit(
        self, path: ArrayLike, *, clearance: float = 0.0, tolerance: float | None = None, parallel: bool = False
    ) -> tuple[int, RobotMotion] | None:
        """The first of the straight motions through the rows of ``path``, two or more, that is not free: its number, from 0, and its
        answer, which says what touches or comes near, and when. None if all are free. See `motion` for the answer, and `is_free` to
        learn of each motion whether it is free."""
        rows, _ = self._rows(path, "path")
        if len(rows) < 2:
            raise ValueError(f"path: expected at least two configurations, found {len(rows)}")
        keys: dict[str, Any] = {"clearance": clearance, "tolerance": tolerance}
        for number in np.flatnonzero(~self.is_free(rows[:-1], rows[1:], parallel=parallel, **keys)).tolist():
            found = self.motion(rows[number], rows[number + 1], **keys)
            if found.kind != MotionKind.FREE:
                return number, found
        return None

    def motion_along(
        self, coefficients: ArrayLike, *, clearance: float = 0.0, tolerance: float | None = None
    ) -> RobotMotion:
        """What touches first while each joint value follows a polynomial of time, from 0 to 1.

        ``coefficients`` has shape (n, degree + 1), the constants first: a piece of a spline, or of a trapezoidal profile.
        """
        of = _cbvh.copied_numbers(coefficients, "coefficients")
        count = len(self.joints)
        if of.ndim != 2 or of.shape[0] != count or of.shape[1] == 0:
            raise ValueError(f"coefficients: expected shape ({count}, degree + 1), found {of.shape}")
        kind, free_until, at, joints, bodies, distance = self._robot.motion(of, clearance, tolerance)
        if self._unseen:
            self._look_inside(of[:, 0])
        is_free = kind == 0
        return RobotMotion(
            MotionKind(kind),
            free_until,
            float("nan") if is_free else at,
            np.array(joints),
            None if is_free else (bodies[0], bodies[1]),
            distance,
        )

    def __repr__(self) -> str:
        return f"<Robot {self.name!r}: {len(self.joints)} joint values, {len(self.links)} links>"


def _level_of_caller() -> int:
    """The level of the first caller outside this file, for `warnings.warn`."""
    frame, level = sys._getframe(1), 1
    while frame.f_code.co_filename == __file__ and frame.f_back is not None:
        frame, level = frame.f_back, level + 1
    return level


def _robot_of(
    texts: tuple[tuple[str, str], tuple[str, str] | None, bool, str, list[str]],
    cores: list[Mesh],
    links: list[tuple[int, float, bool]],
    others: list[tuple[str, Mesh, str | None, Floats]],
    margins: list[tuple[str, float]],
    allowed: list[list[str]],
    unseen: frozenset[str],
) -> Robot:
    """A robot as it was pickled."""
    shapes = [(cores[number]._mesh, radius, is_solid) for number, radius, is_solid in links]
    bodies = [(name, mesh._mesh, mesh, link, pose) for name, mesh, link, pose in others]
    return Robot._of(_cbvh.Robot.of_parts(texts, shapes, bodies, margins, allowed), unseen)
