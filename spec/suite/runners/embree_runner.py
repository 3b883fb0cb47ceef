"""Embree through embreex and trimesh: rays and segments in single precision, with the robust flag.

    pip install numpy scipy rtree trimesh embreex
"""

from importlib.metadata import version

import numpy as np
from embreex import rtcore_scene
from embreex.mesh_construction import TriangleMesh
from serve import finite, serve


def mesh(corners, triangles):
    scene = rtcore_scene.EmbreeScene(robust=True)
    TriangleMesh(scene, corners[triangles].astype(np.float32))
    return scene


def ray(a, question):
    origin, direction = (finite(question[key], (1, 3)).astype(np.float32) for key in ("origin", "direction"))
    found = a.run(origin, direction, output=True)
    if found["primID"][0] < 0:
        return {"answer": False}
    return {"answer": True, "t": float(found["tfar"][0])}


def segment(a, question):
    start, end = (finite(question[key], (1, 3)) for key in ("from", "to"))
    found = a.run(start.astype(np.float32), (end - start).astype(np.float32), np.ones(1, np.float32), query="OCCLUDED")
    return {"answer": int(found[0]) >= 0}


def origins_and_directions(rays):
    return np.ascontiguousarray(rays[:, :3]), np.ascontiguousarray(rays[:, 3:])


def first_hits(a, rays):
    return a.run(*rays, output=True)


def parameters(found):
    return np.where(found["primID"] < 0, -1.0, found["tfar"])


def any_hits(a, rays):
    return a.run(*rays, query="OCCLUDED")


serve(
    "Embree", version("embreex"), "robust scene, single precision", mesh, {"ray": ray, "segment": segment},
    batches={"ray": (origins_and_directions, first_hits, parameters), "hit": (origins_and_directions, any_hits, lambda found: np.asarray(found) >= 0)},
    prepare=lambda a: a.run(*np.ones((2, 1, 3), np.float32)),
    coordinates="f32", placement="f32", features=["open", "concave", "overlapping parts"], distance_error=1e-5, error_unit="size",
)  # fmt: skip
