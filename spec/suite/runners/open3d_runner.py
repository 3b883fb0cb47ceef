"""Open3D: a RaycastingScene, which is Embree in single precision, asked about many rays or points in one call. Timed questions only.

    pip install numpy open3d-cpu
"""

from importlib.metadata import PackageNotFoundError, version

import numpy as np
import open3d
from serve import cores, serve

Tensor = open3d.core.Tensor


def mesh(corners, triangles):
    scene = open3d.t.geometry.RaycastingScene()
    scene.add_triangles(Tensor(corners.astype(np.float32)), Tensor(triangles.astype(np.uint32)))
    return scene


def parameters(found):
    at = found["t_hit"].numpy().astype(float)
    return np.where(np.isfinite(at), at, -1.0)


try:
    number = version("open3d-cpu")
except PackageNotFoundError:
    number = version("open3d")

serve(
    "Open3D", number, "RaycastingScene", mesh, {},
    batches={
        "ray": (Tensor, lambda a, rays: a.cast_rays(rays), parameters),
        "hit": (Tensor, lambda a, rays: a.test_occlusions(rays), lambda found: found.numpy()),
        "closest": (Tensor, lambda a, points: a.compute_distance(points), lambda found: found.numpy()),
        "side": (Tensor, lambda a, points: a.compute_occupancy(points), lambda found: 2.0 * found.numpy() - 1.0),
    },
    threads=cores(), prepare=lambda a: a.cast_rays(Tensor(np.ones((1, 6), np.float32))),
    coordinates="f32", placement="f32", features=[], distance_error=1e-5, error_unit="size",
)  # fmt: skip
