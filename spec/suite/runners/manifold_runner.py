"""Manifold through manifold3d: the least gap of two solids, whether they share volume, and rays.

    pip install numpy manifold3d

Its meshes are closed solids in double precision. It has no question about surfaces, so it is asked for distances only.
"""

from importlib.metadata import version

import manifold3d
import numpy as np
from serve import Refused, rows, serve

SEARCH_LENGTH = 1e30


def mesh(corners, triangles):
    _, first, same = np.unique(corners, axis=0, return_index=True, return_inverse=True)
    solid = manifold3d.Manifold(manifold3d.Mesh64(vert_properties=corners[first], tri_verts=same.reshape(-1)[triangles].astype(np.uint64)))
    if solid.status() != manifold3d.Error.NoError:
        raise Refused(f"no solid: {solid.status()}")
    return solid


def distance(a, b, question):
    rotation, translation = rows(question)
    placed = b.transform(np.hstack([rotation, translation[:, None]]))
    return {"answer": float(a.min_gap(placed, SEARCH_LENGTH))}


serve(
    "Manifold", version("manifold3d"), "Mesh64, min_gap", mesh, {"distance": distance},
    coordinates="f64", placement="f64", features=["concave"], distance_error=1e-6, error_unit="size",
)  # fmt: skip
