"""trimesh: closest points, sides by signed rays, and rays by its own triangle tests, without merging or repairing the meshes.

    pip install numpy scipy rtree trimesh

Its tests of ray and triangle have a tolerance, and it has no rule for a point on the surface, so it claims neither boundary case.
Timed questions about rays and sides use Embree, as trimesh does where embreex is installed. Closest points are not timed: at up to half a
millisecond for each, 16,384 take seconds.
"""

import numpy as np
import trimesh
from serve import Refused, finite, serve


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


def origins_and_directions(rays):
    return rays[:, :3].astype(float), rays[:, 3:].astype(float)


def first_hits(a, rays):
    origins, directions = rays
    points, hitting, _ = a.ray.intersects_location(origins, directions, multiple_hits=False)
    at = np.full(len(origins), -1.0)
    at[hitting] = np.maximum(0.0, np.einsum("ij,ij->i", points - origins[hitting], directions[hitting]) / np.einsum("ij,ij->i", directions[hitting], directions[hitting]))
    return at


def sides(a, points):
    if not a.is_watertight:
        raise Refused("not a closed mesh")
    return a.contains(points)


serve(
    "trimesh", trimesh.__version__, "process=False, ray_triangle with rtree", mesh,
    {"closest": closest, "side": side, "ray": ray},
    batches={
        "ray": (origins_and_directions, first_hits, lambda at: at),
        "hit": (origins_and_directions, lambda a, rays: a.ray.intersects_any(*rays), lambda found: found),
        "side": (lambda points: points.astype(float), sides, lambda inside: np.where(inside, 1.0, -1.0)),
    },
    prepare=lambda a: a.ray.intersects_any(*np.ones((2, 1, 3))),
    coordinates="f64", placement="f64", features=["open", "concave"], distance_error=1e-6, error_unit="size",
)  # fmt: skip
