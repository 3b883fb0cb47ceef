"""Paths: motions between poses, screws and polylines, and the protocol for your own paths."""

from __future__ import annotations

import operator
from typing import Any, Iterable, Protocol

import numpy as np
from numpy.typing import ArrayLike

from . import _cbvh
from ._answers import Floats


class Path(Protocol):
    """A path: any object with these two methods. `Motion` and `Polyline` are paths, and you can define your own.

    Both methods are called with Python's lock, on the thread of the query. An exception ends the query, which
    raises it.
    """

    def pose(self, t: float, /) -> ArrayLike:
        """The pose of the body at a time from 0 to 1 (body to world), shape (4, 4). The same time must always give the
        same pose, to the bit."""

    def sagitta(self, radius: float, t0: float, t1: float, /) -> float:
        """A bound, in mesh units, of how far the path departs from a straight line between two times.

        Take any point that moves with the body and is at most ``radius`` mesh units from the origin of its frame.
        Compare it with a point that moves on a straight line, at a constant speed, from its place at ``t0`` to its
        place at ``t1``. The bound must be no less than the distance between the two at any time from ``t0`` to ``t1``.
        An eighth of the greatest acceleration times the square of the time is enough.

        The bound must hold for poses as computed, with all rounding. Answers are only as certain as this bound, and the
        smaller it is, the less work they take. Infinity means that nothing is known; if it is returned for every
        interval, the query ends with a ValueError. The query also ends with a ValueError if `pose` departs
        further in the middle of an interval.
        """


class _Own:
    """The common part of the library's paths, `Motion` and `Polyline`."""

    __slots__ = ("_paths",)

    _paths: _cbvh.Paths

    def pose(self, t: ArrayLike) -> Floats:
        """The poses of the body (body to world) at times ``t`` from 0 to 1. ``t`` has shape () or (T,), and the poses
        have shape (4, 4) or (T, 4, 4).

        Times before 0 and NaN count as 0, times after 1 as 1. For N motions, N comes first in the shape.
        """
        rows = self._paths.poses(t)
        return rows.reshape((() if self._paths.is_one() else (self._paths.count(),)) + np.shape(t) + (4, 4))

    def sagitta(self, radius: float, t0: float, t1: float) -> Any:
        """The bound of `Path.sagitta`, in mesh units: a float or, for N motions, an array of shape (N,)."""
        return self._paths.sagittas(radius, t0, t1)


class Motion(_Own):
    """One motion or N motions at a constant rate, over times from 0 to 1. Made by `between` and `screw`.

    N motions have a length, and ``motions[i]`` is one of them.
    """

    __slots__ = ("_screw",)

    def __init__(self, paths: _cbvh.Paths, screw: tuple[Any, ...] | None = None) -> None:
        if not isinstance(paths, _cbvh.Paths):
            found = type(paths).__name__
            raise TypeError(f"expected cbvh.Motion.between or cbvh.Motion.screw to make a motion, found {found}")
        # What makes a screw is kept for pickling; all else is told by the first and the last poses.
        self._paths, self._screw = paths, screw

    @staticmethod
    def between(start: ArrayLike, end: ArrayLike) -> Motion:
        """Interpolates in SE(3), as planners do: the origin of the body's frame moves on a line, and the body turns
        about one axis by the shorter angle (slerp), both at a constant rate.

        ``start`` and ``end`` are poses (body to world) of shape (4, 4) or (N, 4, 4); one start or end serves N of the
        other. Raises ValueError for poses that are half a turn apart, to within 2e-9 radians.
        """
        return Motion(_cbvh.Paths.between(start, end))

    @staticmethod
    def screw(
        start: ArrayLike, point: ArrayLike, direction: ArrayLike, angle: float, shift: float = 0.0
    ) -> Motion:
        """A screw motion from a pose: a rotation by ``angle`` radians, any number of turns, about the axis through
        ``point`` with ``direction`` (of any length), and a shift by ``shift`` mesh units along it.

        ``start`` (body to world) has shape (4, 4); ``point`` and ``direction``, in the world, have shape (3,).
        """
        copied = _cbvh.copied_numbers
        arrays = copied(start, "start"), copied(point, "point"), copied(direction, "direction")
        return Motion(_cbvh.Paths.screw(*arrays, angle, shift), (*arrays, angle, shift))

    def _ends(self) -> Floats:
        """The first and the last pose of one motion of `between`, which tell all of it, shape (2, 4, 4)."""
        if self._screw is not None:
            raise ValueError("motion: expected one of Motion.between, found a screw, which its ends do not tell")
        if not self._paths.is_one():
            raise ValueError(f"motion: expected one motion, found {len(self)}; take one of them, such as motions[0]")
        return self.pose([0.0, 1.0])

    def __reduce__(self) -> tuple[Any, ...]:
        if self._screw is not None:
            return (Motion.screw, self._screw)
        return (Motion.between, (self.pose(0.0), self.pose(1.0)))

    def __len__(self) -> int:
        if self._paths.is_one():
            raise TypeError("this is one motion, which has no length")
        return self._paths.count()

    def __bool__(self) -> bool:
        return True

    def __getitem__(self, number: int) -> Motion:
        length = len(self)
        try:
            number = operator.index(number)
        except TypeError:
            raise TypeError(f"motion: expected a number, found {type(number).__name__}") from None
        if not -length <= number < length:
            raise IndexError(f"motion: expected a number from {-length} to {length - 1}, found {number}")
        return Motion(self._paths.path(number % length))

    def __repr__(self) -> str:
        return "<cbvh.Motion>" if self._paths.is_one() else f"<cbvh.Motion: {self._paths.count()} motions>"


class Polyline(_Own):
    """A path through poses, with `Motion.between` from each to the next. These motions all take the same time."""

    __slots__ = ("_knots",)

    def __init__(self, poses: ArrayLike) -> None:
        """``poses`` (body to world) have shape (N, 4, 4), with N of at least 2."""
        self._knots = _cbvh.copied_numbers(poses, "poses")
        self._paths = _cbvh.Paths.through(self._knots)

    def __reduce__(self) -> tuple[Any, ...]:
        return (Polyline, (self._knots,))

    def __repr__(self) -> str:
        return f"<cbvh.Polyline: {len(self._knots)} poses>"


def read_path(path: Any, name: str) -> Any:
    """One path, as the compiled module takes it."""
    if isinstance(path, _Own):
        if not path._paths.is_one():
            raise ValueError(f"{name}: expected one path, found {path._paths.count()} motions")
        return path._paths
    missing = [method for method in ("pose", "sagitta") if not callable(getattr(path, method, None))]
    if missing or isinstance(path, type):
        expected = "expected a cbvh.Motion, a cbvh.Polyline or an object with methods pose and sagitta"
        raise TypeError(f"{name}: {expected}, found {type(path).__name__}")
    return path


def read_paths(motion: Any) -> tuple[list[Any], bool]:
    """One path or many, as the compiled module takes them, and whether it is one."""
    if isinstance(motion, _Own):
        return [motion._paths], motion._paths.is_one()
    is_path = callable(getattr(motion, "pose", None))
    if isinstance(motion, Iterable) and not is_path and not isinstance(motion, (str, bytes, np.ndarray)):
        return [read_path(path, f"motion[{number}]") for number, path in enumerate(motion)], False
    return [read_path(motion, "motion")], True
