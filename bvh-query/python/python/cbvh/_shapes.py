"""Simple shapes: balls, capsules, boxes, cylinders, cones, hulls, grounds, height fields, clouds of points and voxels.

Each is a `Mesh`, alone at the origin of its frame, and goes wherever a mesh goes. Round ones are a few triangles without area
and a radius, which is exact; cylinders and cones are polyhedra around them, and say how much larger they are.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from . import _cbvh
from ._mesh import Mesh

# How much larger a polyhedron may be by default, as a fraction of the radius.
_ROUNDNESS = 0.002


def _numbers(values: ArrayLike, name: str, count: int) -> list[float]:
    numbers = _cbvh.copied_numbers(values, name)
    if numbers.shape != (count,):
        raise ValueError(f"{name}: expected shape ({count},), found {numbers.shape}")
    found: list[float] = numbers.tolist()
    return found


def _length(value: Any, name: str) -> float:
    """A length that may be 0."""
    length = _cbvh.number(value, name)
    if not 0 <= length < np.inf:
        raise ValueError(f"{name}: expected a finite length of at least 0, found {length}")
    return length


def sphere(radius: float, centre: ArrayLike = (0.0, 0.0, 0.0)) -> Mesh:
    """A ball: a point with a radius."""
    return Mesh(_cbvh.cloud_core(_numbers(centre, "centre", 3), "centre")).rounded(radius)


def capsule(radius: float, length: float) -> Mesh:
    """A segment along z with a radius, its middle at the origin. ``length``: between the centres of its caps."""
    half = _length(length, "length") / 2
    return Mesh(_cbvh.segment_core([0.0, 0.0, -half], [0.0, 0.0, half])).rounded(radius)


def box(sides: ArrayLike, *, rounding: float = 0.0) -> Mesh:
    """A solid box, its middle at the origin. ``rounding``: the radius of its edges and corners, within the sides."""
    lengths, rounding = _numbers(sides, "sides", 3), _length(rounding, "rounding")
    if 0 < min(lengths) <= 2 * rounding:
        raise ValueError(f"rounding: expected less than half of each side, found {rounding} beside {min(lengths)}")
    core = [length - 2 * rounding for length in lengths]
    return Mesh(_cbvh.block_core(core)).solid().rounded(rounding)


def ground(sides: ArrayLike = (1000.0, 1000.0), thickness: float = 1.0) -> Mesh:
    """The solid ground under z = 0: a box of these sides along x and y. Beyond its sides there is nothing."""
    return Mesh(_cbvh.ground_core(_numbers(sides, "sides", 2), _cbvh.number(thickness, "thickness"))).solid()


def cylinder(radius: float, length: float, *, max_error: float | None = None) -> Mesh:
    """A solid prism around a cylinder along z, its middle at the origin, at most ``max_error`` larger in mesh units; by
    default 0.002 of the radius."""
    radius = _cbvh.number(radius, "radius")
    error = _ROUNDNESS * radius if max_error is None else _cbvh.number(max_error, "max_error")
    return Mesh(_cbvh.cylinder_core(radius, _cbvh.number(length, "length"), error)[0]).solid()


def cone(radius: float, height: float, *, max_error: float | None = None) -> Mesh:
    """A solid pyramid around a cone, its base at z = 0 and its apex at z = ``height``: see `cylinder`."""
    radius = _cbvh.number(radius, "radius")
    error = _ROUNDNESS * radius if max_error is None else _cbvh.number(max_error, "max_error")
    return Mesh(_cbvh.cone_core(radius, _cbvh.number(height, "height"), error)[0]).solid()


def height_field(heights: ArrayLike, cell: ArrayLike) -> Mesh:
    """A surface over a grid: ``heights`` of shape (rows, columns), rows along y, columns along x, from the origin on.
    ``cell``: how far columns and rows are apart."""
    grid = _cbvh.copied_numbers(heights, "heights")
    if grid.ndim != 2:
        raise ValueError(f"heights: expected shape (rows, columns), found {grid.shape}")
    if not np.isfinite(grid).all():
        raise ValueError("heights: expected finite numbers, found others")
    return Mesh(_cbvh.height_field_core(grid, _numbers(cell, "cell", 2)))


def cloud(points: ArrayLike, radius: float = 0.0) -> Mesh:
    """Points, each a ball of this radius. ``points`` has shape (N, 3). Triangle ``i`` of answers is point ``i``."""
    return Mesh(_cbvh.cloud_core(points, "points")).rounded(radius)


def convex_hull(points: ArrayLike) -> Mesh:
    """The solid convex hull of points of shape (N, 3), decided exactly. Its vertices are some of the points. Every point is
    inside it or on it. Raises ValueError if all points are in one plane or if a coordinate is not finite."""
    return Mesh(_cbvh.convex_hull_core(points)).solid()


def voxels(cells: ArrayLike, side: float) -> Mesh:
    """The surface of full cells of a grid, without faces between two full cells. ``cells`` has shape (N, 3), int: cell
    (i, j, k) is the cube from (i, j, k) times the side on. Or it is an array of bool of shape (I, J, K), and those cells
    are full where it is true. Use `Mesh.solid` if what is inside counts."""
    grid = np.asarray(cells)
    if grid.ndim == 3 and grid.dtype == bool:
        grid = np.argwhere(grid)
    if grid.ndim != 2 or grid.shape[1] != 3 or grid.dtype.kind not in "iu":
        expected = "expected integers of shape (N, 3) or bool of shape (I, J, K)"
        raise ValueError(f"cells: {expected}, found {grid.dtype} of shape {grid.shape}")
    if grid.size and (grid.min() < -(2**31) or grid.max() >= 2**31):
        raise ValueError("cells: expected numbers of 32 bits")
    return Mesh(_cbvh.voxels_core(np.ascontiguousarray(grid, np.int32), _cbvh.number(side, "side")))


def octree(cells: Any, sizes: ArrayLike | None = None) -> Mesh:
    """The surface of full cells of an octree, without what two of them have in common.

    ``cells`` is a tree of pyoctomap, whose occupied leaves are full, small and large ones. Or it has the middles of cells,
    shape (N, 3), and ``sizes`` their sides, shape (N,). Sides are the least one times powers of two, and corners are at
    multiples of the side, as in an octree whose middle is at the origin. Middles may be off by a tenth of the least side,
    as float32 numbers are. Use `Mesh.solid` if what is inside counts."""
    least = None
    if hasattr(cells, "begin_leafs"):
        if sizes is not None:
            raise ValueError("sizes: expected None beside a tree, which has those of its leaves")
        leaves = [(*leaf.getCoordinate(), leaf.getSize()) for leaf in cells.begin_leafs() if cells.isNodeOccupied(leaf)]
        numbers, least = np.array(leaves, np.float64).reshape(-1, 4), float(cells.getResolution())
        middles, sides = numbers[:, :3], numbers[:, 3]
    elif sizes is None:
        raise TypeError(f"cells: expected a tree of pyoctomap or middles with sizes, found {type(cells).__name__} alone")
    else:
        middles, sides = _cbvh.copied_numbers(cells, "cells"), _cbvh.copied_numbers(sizes, "sizes")
    if middles.ndim != 2 or middles.shape[1] != 3 or sides.shape != middles.shape[:1]:
        found = f"found {middles.shape} and {sides.shape}"
        raise ValueError(f"cells: expected middles of shape (N, 3) and sizes of shape (N,), {found}")
    if not (np.all(sides > 0) and np.all(np.isfinite(sides)) and np.all(np.isfinite(middles))):
        raise ValueError("cells: expected finite middles and finite sizes above 0, found others")
    if least is None:
        least = float(sides.min()) if len(sides) else 1.0
    # A size and the corner of each cell, in sides of the finest ones.
    exact = np.column_stack([(middles - sides[:, None] / 2) / least, sides / least])
    rows = np.round(exact)
    off = np.abs(exact - rows).max(axis=1, initial=0.0)
    if np.any(np.abs(rows) >= 2**31):
        raise ValueError("cells: expected less than 2^31 of the least sides from the origin and as size, found more")
    if np.any(off > 0.1):
        number = int(np.argmax(off))
        raise ValueError(
            f"cells: expected corners at multiples of the least size, {least:g}, found cell {number} off by {off[number]:.2g}"
            " of it; subtract the origin of the octree from the middles, and put the mesh there"
        )
    return Mesh(_cbvh.octree_core(np.ascontiguousarray(rows, np.int64), least))
