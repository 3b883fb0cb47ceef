"""Bullet through pybullet: rays and closest points of concave triangle meshes in single precision, without a margin of its own.

    pip install numpy pybullet
"""

import pybullet
from serve import Refused, finite, serve

pybullet.connect(pybullet.DIRECT)


def mesh(corners, triangles):
    shape = pybullet.createCollisionShape(
        pybullet.GEOM_MESH, vertices=corners.tolist(), indices=triangles.ravel().tolist(), flags=pybullet.GEOM_FORCE_CONCAVE_TRIMESH
    )
    if shape < 0:
        raise Refused("no shape")
    return shape


def hit(a, start, end):
    body = pybullet.createMultiBody(0, a)
    try:
        return pybullet.rayTest(start.tolist(), end.tolist())[0]
    finally:
        pybullet.removeBody(body)


def segment(a, question):
    start, end = (finite(question[key], 3) for key in ("from", "to"))
    return {"answer": hit(a, start, end)[0] >= 0}


serve(
    "Bullet", str(pybullet.getAPIVersion()), "concave triangle mesh, rayTest", mesh, {"segment": segment},
    coordinates="f32", placement="f32", features=["open", "concave", "overlapping parts"], distance_error=1e-5, error_unit="size",
)  # fmt: skip
