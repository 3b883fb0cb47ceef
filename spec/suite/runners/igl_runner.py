"""libigl: distances of points from a mesh, and sides by generalised winding numbers.

    pip install numpy scipy libigl
"""

from importlib.metadata import version

import igl
import numpy as np
from serve import finite, serve


def mesh(corners, triangles):
    edges = np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    return corners, triangles, (np.unique(edges, axis=0, return_counts=True)[1] % 2 == 0).all()


def distance(a, question):
    squares = igl.point_mesh_squared_distance(finite(question["point"], (1, 3)), a[0], a[1])[0]
    return float(np.sqrt(np.asarray(squares).reshape(-1)[0]))


def closest(a, question):
    return {"answer": distance(a, question)}


def side(a, question):
    if distance(a, question) == 0.0:
        return {"answer": "on"}
    if not a[2]:
        return {"answer": "undefined"}
    turns = np.asarray(igl.winding_number(a[0], a[1], finite(question["point"], (1, 3)))).reshape(-1)[0]
    return {"answer": "inside" if abs(turns) > 0.5 else "outside"}


serve(
    "libigl", version("libigl"), "point_mesh_squared_distance, winding_number", mesh, {"closest": closest, "side": side},
    coordinates="f64", placement="f64", features=["open", "concave", "overlapping parts"], distance_error=1e-6, error_unit="size",
)  # fmt: skip
