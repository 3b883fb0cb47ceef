"""Bakes meshes: arrays into memory, and files into files of any size."""

from __future__ import annotations

import os
from typing import Any, Sequence

import numpy as np
from numpy.typing import ArrayLike

from . import _cbvh
from ._mesh import Mesh, open


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
    ``profile``, ``triangles``, ``max_error`` and ``effort`` are those of ``cbvh bake``; None lets the baker choose.
    Without ``ids`` triangles are numbered in an order of the baker's; without ``topology`` there are no answers about
    insides. Baking takes about a microsecond a triangle. `Mesh.save` writes the result.
    """
    points, numbers = np.asarray(vertices), np.asarray(faces)
    for array, name, per in ((points, "vertices", "V"), (numbers, "faces", "F")):
        if array.ndim != 2 or array.shape[1] != 3:
            raise ValueError(f"{name}: expected shape ({per}, 3), found {array.shape}")
    if numbers.dtype.kind not in "iu":
        raise TypeError(f"faces: expected integers, found dtype {numbers.dtype}")
    if numbers.size and not 0 <= numbers.min() <= numbers.max() < len(points):
        found = f"{numbers.min()} to {numbers.max()}"
        raise ValueError(f"faces: expected numbers from 0 to {len(points) - 1}, found {found}")
    options = _options(profile, triangles, max_error, effort, ids, topology)
    return Mesh(_cbvh.bake(points, np.require(numbers, np.uint32, ["C", "ALIGNED"]), options))


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

    Nothing is done if the file is up to date, unless ``force``. ``max_memory``: stay within so many bytes; the rest
    goes to scratch files, so that a mesh may be larger than memory. The other options are those of `bake`. The
    environment variable ``RAYON_NUM_THREADS`` tells how many threads bake; without it, as many as there are cores.
    Raises OSError if the system refuses a file, and BakeError if a mesh cannot be baked.
    """
    files = [inputs] if isinstance(inputs, (str, os.PathLike)) else list(inputs)
    options = _options(profile, triangles, max_error, effort, ids, topology)
    _cbvh.bake_files([os.fspath(file) for file in files], os.fspath(output), options, max_memory, force)
    return open(output)
