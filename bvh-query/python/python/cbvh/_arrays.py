"""Reads the arrays that callers give: numbers, rows and poses, as the compiled module takes them."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]


def read_numbers(value: ArrayLike, name: str, dtype: Any) -> NDArray[Any]:
    """An array of numbers as contiguous and aligned ``dtype``, without a copy where it is one already."""
    array = np.asarray(value)
    if array.dtype.kind not in "fiu" and array.size > 0:
        raise TypeError(f"{name}: expected numbers, found dtype {array.dtype}")
    # np.require does the same and takes a microsecond. np.ascontiguousarray gives numbers alone a dimension.
    array = np.asarray(array, dtype=dtype, order="C")
    return array if array.flags.aligned else array.copy()


def read_rows(value: ArrayLike, name: str, *row: int) -> tuple[Floats, bool]:
    """Rows of shape ``row``, and whether ``value`` is one row alone."""
    array = read_numbers(value, name, np.float64)
    one = array.shape == row
    if not one and (array.ndim != len(row) + 1 or array.shape[1:] != row):
        shape = ", ".join(map(str, row))
        comma = "," if len(row) == 1 else ""
        raise ValueError(f"{name}: expected shape ({shape}{comma}) or (N, {shape}), found {array.shape}")
    return array.reshape(-1, *row), one


def broadcast_rows(a: tuple[Floats, bool], b: tuple[Floats, bool]) -> tuple[Floats, Floats]:
    """Two arrays of rows, of which one row alone serves all rows of the other."""
    (rows_a, one_a), (rows_b, one_b) = a, b
    if one_a and not one_b:
        rows_a = np.repeat(rows_a, len(rows_b), axis=0)
    elif one_b and not one_a:
        rows_b = np.repeat(rows_b, len(rows_a), axis=0)
    return rows_a, rows_b


def read_poses(value: ArrayLike, name: str = "poses") -> tuple[Floats, bool]:
    """Poses, and whether they are one pose alone."""
    return read_rows(value, name, 4, 4)


def read_pose(value: ArrayLike | None, name: str = "pose") -> Floats:
    """One pose; None is the identity."""
    if value is None:
        return np.eye(4)
    pose, one = read_poses(value, name)
    if not one:
        raise ValueError(f"{name}: expected shape (4, 4), found {np.shape(value)}")
    found: Floats = pose[0]
    return found


def read_rays(
    origins: ArrayLike, directions: ArrayLike, until: ArrayLike
) -> tuple[tuple[Floats, Floats, Floats], bool]:
    """Rays of shape (N, 3), (N, 3) and (N,), and whether they are one ray alone."""
    starts, one = read_rows(origins, "origins", 3)
    ways, _ = read_rows(directions, "directions", 3)
    if len(ways) != len(starts):
        raise ValueError(f"directions: expected as many directions as origins, {len(starts)}, found {len(ways)}")
    ends = read_numbers(until, "until", np.float64)
    if ends.shape not in ((), (len(starts),)):
        raise ValueError(f"until: expected shape () or ({len(starts)},), found {ends.shape}")
    return (starts, ways, np.ascontiguousarray(np.broadcast_to(ends, (len(starts),)))), one
