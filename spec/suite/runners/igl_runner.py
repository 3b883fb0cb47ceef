"""libigl: distances of points from a mesh, and sides by generalised winding numbers. Timed questions are about its AABB tree.

    pip install numpy scipy libigl
"""

from importlib.metadata import version

import igl
import numpy as np
from serve import cores, finite, serve


class Mesh:
    """Corners and triangles, with a tree for timed questions."""

    def __init__(self, corners, triangles):
        self.corners, self.triangles, self.tree = corners, triangles, None

    def build(self):
        self.tree = igl.AABB()
        self.tree.init(self.corners, self.triangles)

    def is_closed(self):
        edges = np.sort(self.triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
        return (np.unique(edges, axis=0, return_counts=True)[1] % 2 == 0).all()


def distance(a, question):
    squares = igl.point_mesh_squared_distance(finite(question["point"], (1, 3)), a.corners, a.triangles)[0]
    return float(np.sqrt(np.asarray(squares).reshape(-1)[0]))


def closest(a, question):
    return {"answer": distance(a, question)}


def side(a, question):
    if distance(a, question) == 0.0:
        return {"answer": "on"}
    if not a.is_closed():
        return {"answer": "undefined"}
    turns = np.asarray(igl.winding_number(a.corners, a.triangles, finite(question["point"], (1, 3)))).reshape(-1)[0]
    return {"answer": "inside" if abs(turns) > 0.5 else "outside"}


def origins_and_directions(rays):
    return rays[:, :3].astype(float, order="F"), rays[:, 3:].astype(float, order="F")


def first_hits(a, rays):
    return a.tree.intersect_ray_first(a.corners, a.triangles, *rays)


def parameters(found):
    triangles, at = (np.asarray(of).reshape(-1) for of in found[:2])
    return np.where((triangles >= 0) & np.isfinite(at), at, -1.0)


def squares(a, points):
    return a.tree.squared_distance(a.corners, a.triangles, points)


serve(
    "libigl", version("libigl"), "point_mesh_squared_distance, winding_number; timed: AABB", Mesh, {"closest": closest, "side": side},
    batches={
        "ray": (origins_and_directions, first_hits, parameters),
        "closest": (lambda points: points.astype(float, order="F"), squares, lambda found: np.sqrt(np.asarray(found[0]).reshape(-1))),
    },
    threads=cores(), prepare=Mesh.build,
    coordinates="f64", placement="f64", features=["open", "concave", "overlapping parts"], distance_error=1e-6, error_unit="size",
)  # fmt: skip
