"""Paths: motions between poses, screws and polylines, and what paths of the caller's own have to be."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike

from . import _cbvh
from ._arrays import Floats, broadcast_rows, read_numbers, read_pose, read_poses


class Path(Protocol):
    """What a path of your own has to be: any object with these two methods. `Motion` and `Polyline` are paths.

    Both are called with Python's lock, on the thread of the question. An exception ends the question, and is raised by
    it.
    """

    def pose(self, t: float, /) -> ArrayLike:
        """Where the body is at a time from 0 to 1 (body to world), shape (4, 4). The same time gives the same pose, to
        the bit."""

    def sagitta(self, radius: float, t0: float, t1: float, /) -> float:
        """A bound, in mesh units, of how far the path departs from a straight one between two times.

        That is how far any point at most ``radius`` mesh units from the origin of the body's frame is, at any time from
        ``t0`` to ``t1``, from where it would be if it went straight, at a constant rate, from its place at ``t0`` to
        that at ``t1``: at most an eighth of the greatest acceleration times the square of the time. It must hold for
        poses as computed, with all rounding. Answers are only as certain as this bound, and the smaller it is, the less
        work they take. Infinity says that nothing is known; on every interval, the question ends with an error.
        """


class _Own:
    """Paths of the library: what `Motion` and `Polyline` have in common."""

    __slots__ = ("_paths", "_one", "_made")

    _paths: _cbvh.Paths
    _one: bool
    _made: tuple[Any, ...]

    def pose(self, t: ArrayLike) -> Floats:
        """Where the body is at ``t``, from 0 to 1, of shape () or (T,): poses (body to world) of shape (4, 4) or (T, 4,
        4).

        Times before 0 and NaN count as 0, times after 1 as 1. Of N motions, the poses have N in front of their shape.
        """
        times = read_numbers(t, "t", np.float64)
        if times.ndim > 1:
            raise ValueError(f"t: expected shape () or (T,), found {times.shape}")
        rows = self._paths.poses(times.reshape(-1))
        return rows.reshape((() if self._one else (self._paths.count(),)) + times.shape + (4, 4))

    def sagitta(self, radius: float, t0: float, t1: float) -> Any:
        """The bound that `Path.sagitta` states, in mesh units: a float or, of N motions, an array of shape (N,)."""
        found = self._paths.sagittas(radius, t0, t1)
        return found[0].item() if self._one else found

    def __reduce__(self) -> tuple[Any, ...]:
        return self._made


class Motion(_Own):
    """Motions at a constant rate, over times from 0 to 1: one, or N at once. Made by `between` and `screw`.

    N motions have a length, and ``motions[i]`` is one of them.
    """

    __slots__ = ()

    def __init__(self, paths: _cbvh.Paths, one: bool, made: tuple[Any, ...]) -> None:
        self._paths, self._one, self._made = paths, one, made

    @staticmethod
    def between(start: ArrayLike, end: ArrayLike) -> Motion:
        """What planners call interpolation in SE(3): the origin of the body's frame moves on a line, and the body turns
        about one axis the shorter way (slerp), both at a constant rate.

        ``start`` and ``end`` are poses (body to world) of shape (4, 4) or (N, 4, 4); one start or end serves N of the
        other. Raises ValueError for poses that are half a turn apart, to within 2e-9 radians.
        """
        starts, one_start = read_poses(start, "start")
        ends, one_end = read_poses(end, "end")
        starts, ends = broadcast_rows((starts, one_start), (ends, one_end))
        one = one_start and one_end
        made = (Motion.between, (start, end) if one else (starts, ends))
        return Motion(_cbvh.Paths.between(starts, ends), one, made)

    @staticmethod
    def screw(
        start: ArrayLike, point: ArrayLike, direction: ArrayLike, angle: float, shift: float = 0.0
    ) -> Motion:
        """A screw motion from a pose: a rotation by ``angle`` radians, any number of turns, about the axis through
        ``point`` with ``direction`` (of any length), and a shift by ``shift`` mesh units along it.

        ``start`` (body to world) has shape (4, 4); ``point`` and ``direction``, in the world, have shape (3,).
        """
        placed = read_pose(start, "start")
        vectors = []
        for value, name in ((point, "point"), (direction, "direction")):
            vector = read_numbers(value, name, np.float64)
            if vector.shape != (3,):
                raise ValueError(f"{name}: expected shape (3,), found {vector.shape}")
            vectors.append(vector)
        paths = _cbvh.Paths.screw(placed, vectors[0].tolist(), vectors[1].tolist(), angle, shift)
        return Motion(paths, True, (Motion.screw, (placed, *vectors, angle, shift)))

    def __len__(self) -> int:
        if self._one:
            raise TypeError("this is one motion, which has no length")
        return self._paths.count()

    def __bool__(self) -> bool:
        return True

    def __getitem__(self, number: int) -> Motion:
        length = len(self)
        if not -length <= number < length:
            raise IndexError(f"motion: expected a number from {-length} to {length - 1}, found {number}")
        make, (starts, ends) = self._made
        number %= length
        return Motion(self._paths.one(number), True, (make, (starts[number], ends[number])))

    def __repr__(self) -> str:
        return "<cbvh.Motion>" if self._one else f"<cbvh.Motion: {self._paths.count()} motions>"


class Polyline(_Own):
    """A path through poses, with `Motion.between` from each to the next, all of which take the same time."""

    __slots__ = ()

    def __init__(self, poses: ArrayLike) -> None:
        """``poses`` (body to world) have shape (N, 4, 4), with N of at least 2."""
        rows, one = read_poses(poses)
        if one:
            raise ValueError("poses: expected shape (N, 4, 4) with N of at least 2, found (4, 4)")
        self._paths, self._one, self._made = _cbvh.Paths.through(rows), True, (Polyline, (rows,))

    def __repr__(self) -> str:
        return f"<cbvh.Polyline: {len(self._made[1][0])} poses>"


class _Called:
    """A caller's own path, as the compiled module calls it: checks shapes and numbers, and names the path."""

    __slots__ = ("_path",)

    def __init__(self, path: Path) -> None:
        self._path = path

    def pose(self, t: float) -> Floats:
        found = read_numbers(self._path.pose(t), f"path.pose({t})", np.float64)
        if found.shape != (4, 4):
            raise ValueError(f"path.pose({t}): expected shape (4, 4), found {found.shape}")
        return found

    def sagitta(self, radius: float, t0: float, t1: float) -> float:
        found = self._path.sagitta(radius, t0, t1)
        place = f"path.sagitta({radius}, {t0}, {t1})"
        try:
            length = float(found)
        except (TypeError, ValueError):
            raise TypeError(f"{place}: expected a number, found {found!r}") from None
        if not length >= 0.0:
            raise ValueError(f"{place}: expected a length of at least 0, found {length}")
        return length


def read_path(path: Any, name: str) -> Any:
    """One path, as the compiled module takes it."""
    if isinstance(path, _Own):
        if not path._one:
            raise ValueError(f"{name}: expected one path, found {path._paths.count()} motions")
        return path._paths
    missing = [method for method in ("pose", "sagitta") if not callable(getattr(path, method, None))]
    if missing or isinstance(path, type):
        expected = "expected a cbvh.Motion, a cbvh.Polyline or an object with methods pose and sagitta"
        raise TypeError(f"{name}: {expected}, found {type(path).__name__}")
    return _Called(path)


def read_paths(motion: Any) -> tuple[list[Any], bool]:
    """One path or many, as the compiled module takes them, and whether it is one."""
    if isinstance(motion, _Own):
        return [motion._paths], motion._one
    if isinstance(motion, (list, tuple)):
        return [read_path(path, f"motion[{number}]") for number, path in enumerate(motion)], False
    return [read_path(motion, "motion")], True
