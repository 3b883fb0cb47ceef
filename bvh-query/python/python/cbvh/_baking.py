"""Bakes meshes: arrays into memory, and files into files of any size."""

from __future__ import annotations

import operator
import os
import warnings
from typing import Any, Iterable, Sequence

import numpy as np
from numpy.typing import ArrayLike

from . import _cbvh
from ._mesh import Mesh, open


class BakeWarning(UserWarning):
    """The reader of a mesh file did something that the file's author may not expect."""


def _options(
    profile: str | None,
    triangles: str | None,
    max_error: float | None,
    round: str | None,
    weld: float,
    effort: str | None,
    ids: bool,
    topology: bool,
    radius: float,
    solid: bool,
    drop_nan: bool = False,
) -> dict[str, Any]:
    for name, text in (("profile", profile), ("triangles", triangles), ("round", round), ("effort", effort)):
        if text is not None and not isinstance(text, str):
            raise TypeError(f"{name}: expected a str or None, found {type(text).__name__}")
    for name, choice in (("ids", ids), ("topology", topology), ("solid", solid), ("drop_nan", drop_nan)):
        _bool(choice, name)
    if max_error is not None:
        if isinstance(max_error, (str, bytes)) or not hasattr(max_error, "__float__"):
            raise TypeError(f"max_error: expected a number, found {type(max_error).__name__}")
        max_error = float(max_error)
        if triangles != "quantized":
            raise ValueError(f'max_error: expected triangles="quantized" beside it, found {triangles!r}')
        if not 0 < max_error < np.inf:
            raise ValueError(f"max_error: expected a finite length above 0, found {max_error}")
    if isinstance(weld, (str, bytes)) or not hasattr(weld, "__float__"):
        raise TypeError(f"weld: expected a number, found {type(weld).__name__}")
    if not 0 <= float(weld) < np.inf:
        raise ValueError(f"weld: expected a finite length of at least 0, found {weld}")
    if isinstance(radius, (str, bytes)) or not hasattr(radius, "__float__"):
        raise TypeError(f"radius: expected a number, found {type(radius).__name__}")
    if not 0 <= float(radius) <= 2.0**118:
        raise ValueError(f"radius: expected a length from 0 to 2^118, found {radius}")
    return {
        "profile": profile,
        "triangles": triangles,
        "max_error": max_error,
        "round": round,
        "weld": float(weld),
        "effort": effort,
        "ids": bool(ids),
        "topology": bool(topology),
        "radius": float(radius),
        "solid": bool(solid),
        "drop_nan": bool(drop_nan),
    }


def _bool(value: Any, name: str) -> bool:
    if not isinstance(value, (bool, np.bool_)):
        raise TypeError(f"{name}: expected a bool, found {type(value).__name__}")
    return bool(value)


def bake(
    vertices: ArrayLike,
    faces: ArrayLike,
    *,
    profile: str | None = None,
    triangles: str | None = None,
    max_error: float | None = None,
    round: str | None = None,
    weld: float = 0.0,
    effort: str | None = None,
    ids: bool = True,
    topology: bool = True,
    radius: float = 0.0,
    solid: bool = False,
) -> Mesh:
    """Bakes a mesh in memory.

    ``vertices`` have shape (V, 3), in any unit of length; ``faces`` have shape (F, 3), three numbers of vertices each.
    ``profile``, ``triangles``, ``max_error`` and ``effort`` are those of ``cbvh bake``; None lets the baker choose.
    ``weld`` closes seams that are open by rounding errors: each vertex goes to the position of the first vertex within this
    distance of it, in mesh units. Triangles that lose their area stay. BakeError if it exceeds the diagonal of the mesh's box.
    Without ``ids``, the baker numbers triangles in its own order. Without ``topology``, there are no answers about what
    is inside. ``radius`` and ``solid`` are those of `Mesh.rounded` and `Mesh.solid`, and stay in the file. Baking takes
    about a microsecond per triangle, half of that with ``effort="quick"``, after which queries take about 1.1 times as long. `Mesh.save` writes the result. ``round="f32"`` rounds each coordinate to the nearest float32
    number, ties to even, as games store them: coordinates that are equal in two meshes then stay equal.

    Answers are exact for the numbers that are given, which are stored as they are, float64 numbers too. Vertices move only if that
    is asked for: with ``round``, with ``weld``, or with ``triangles="quantized"`` by up to ``max_error``. Then answers are exact for
    the mesh as stored, and `Mesh.max_move` states by how much it differs.
    """
    points = _cbvh.copied_numbers(vertices, "vertices")
    try:
        numbers = np.asarray(faces)
    except ValueError as error:
        raise ValueError(f"faces: expected shape (F, 3), found what numpy refuses: {error}") from error
    for array, name, per in ((points, "vertices", "V"), (numbers, "faces", "F")):
        if array.ndim != 2 or array.shape[1] != 3:
            raise ValueError(f"{name}: expected shape ({per}, 3), found {array.shape}")
    if numbers.dtype.kind not in "iu":
        raise TypeError(f"faces: expected integers, found dtype {numbers.dtype}")
    if numbers.size and not 0 <= numbers.min() <= numbers.max() < len(points):
        found = f"{numbers.min()} to {numbers.max()}"
        raise ValueError(f"faces: expected numbers from 0 to {len(points) - 1}, found {found}")
    options = _options(profile, triangles, max_error, round, weld, effort, ids, topology, radius, solid)
    return Mesh(_cbvh.bake(points, np.require(numbers, np.uint32, ["C", "ALIGNED"]), options))


def bake_files(
    inputs: str | os.PathLike[str] | Sequence[str | os.PathLike[str]],
    output: str | os.PathLike[str],
    *,
    profile: str | None = None,
    triangles: str | None = None,
    max_error: float | None = None,
    round: str | None = None,
    weld: float = 0.0,
    effort: str | None = None,
    ids: bool = True,
    topology: bool = True,
    radius: float = 0.0,
    solid: bool = False,
    drop_nan: bool = False,
    max_memory: int | None = None,
    force: bool = False,
) -> Mesh:
    """Bakes mesh files (OBJ, STL, PLY, glTF, COLLADA) or points (XYZ, PCD, PLY) into a ``.cbvh`` file, and opens it.

    If the file is up to date, nothing is done, unless ``force``. ``max_memory``: the most bytes of memory; the rest
    goes to scratch files, so a mesh may be larger than memory. ``drop_nan``: leaves out points without a position, those
    with a coordinate that is NaN or infinite, which are otherwise refused. The other options are those of `bake`. The environment
    variable ``RAYON_NUM_THREADS`` sets the number of threads of the module, for bakes and for ``parallel=True``; the
    default is the number of cores. Warns with `BakeWarning` of what the readers did that the authors of the files may
    not expect, such as bytes, points or animations that they left out. Raises OSError if the system refuses a file, and BakeError
    if a mesh cannot be baked. After these, and after Ctrl-C or a `Stop`, the output is what it was before, and no other file is left.
    """
    if isinstance(inputs, (str, bytes, os.PathLike)):
        inputs = [inputs]
    elif not isinstance(inputs, Iterable):
        raise TypeError(f"inputs: expected a path or paths, found {type(inputs).__name__}")
    files = [os.fsdecode(file) for file in inputs]
    if not files:
        raise ValueError("inputs: expected at least one file, found none")
    options = _options(profile, triangles, max_error, round, weld, effort, ids, topology, radius, solid, drop_nan)
    if max_memory is not None:
        try:
            max_memory = operator.index(max_memory)
        except TypeError:
            raise TypeError(f"max_memory: expected bytes as an int, found {type(max_memory).__name__}") from None
        if max_memory < 0:
            raise ValueError(f"max_memory: expected bytes of at least 0, found {max_memory}")
        max_memory = min(max_memory, 2**64 - 1)
    for warning in _cbvh.bake_files(files, os.fsdecode(output), options, max_memory, _bool(force, "force")):
        warnings.warn(warning, BakeWarning, stacklevel=2)
    return open(output)
