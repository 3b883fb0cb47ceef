"""trimesh: closest points, sides by signed rays, and rays by its own triangle tests, without merging or repairing the meshes.

    pip install numpy scipy rtree trimesh

Its tests of ray and triangle have a tolerance, and it has no rule for a point on the surface, so it claims neither boundary case.
"""

import numpy as np
import trimesh
from serve import finite, serve


def mesh(corners, triangles):
    return trimesh.Trimesh(corners, triangles, process=False, validate=False)


def closest(a, question):
    _, distances, _ = trimesh.proximity.closest_point(a, finite(question["point"], (1, 3)))
    return {"answer": float(distances[0])}


def side(a, question):
    point = finite(question["point"], (1, 3))
    if not a.is_watertight or not a.is_winding_consistent:
        return {"answer": "undefined"}
    if trimesh.proximity.closest_point(a, point)[1][0] == 0.0:
        return {"answer": "on"}
    return {"answer": "inside" if a.contains(point)[0] else "outside"}


def ray(a, question):
    origin, direction = finite(question["origin"], (1, 3)), finite(question["direction"], (1, 3))
    points, _, _ = trimesh.ray.ray_triangle.RayMeshIntersector(a).intersects_location(origin, direction)
    if len(points) == 0:
        return {"answer": False}
    return {"answer": True, "t": float(min((points - origin) @ direction[0]) / np.sum(direction**2))}


serve(
    "trimesh", trimesh.__version__, "process=False, ray_triangle with rtree", mesh,
    {"closest": closest, "side": side, "ray": ray},
    coordinates="f64", placement="f64", features=["open", "concave"], distance_error=1e-6, error_unit="size",
)  # fmt: skip
