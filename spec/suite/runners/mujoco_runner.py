"""MuJoCo: contact and distance of convex meshes by its own GJK, without margin. Meshes become their convex hulls.

    pip install numpy mujoco

It is asked only about convex meshes, which it recognises, and answers for solids: so a mesh inside another one touches it.
"""

import mujoco
import numpy as np
from serve import Refused, rows, serve

FAR = 1e10


def mesh(corners, triangles):
    closed = np.unique(np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1), axis=0, return_counts=True)[1]
    normals = np.cross(corners[triangles[:, 1]] - corners[triangles[:, 0]], corners[triangles[:, 2]] - corners[triangles[:, 0]])
    above = np.einsum("tk,tvk->tv", normals, corners[None] - corners[triangles[:, 0]][:, None])
    if len(triangles) < 4 or (closed != 2).any() or (above > 0).any():
        raise Refused("not a closed convex mesh")
    return corners, triangles


def model_of(a, b):
    spec = mujoco.MjSpec()
    for name, (corners, triangles) in (("a", a), ("b", b)):
        spec.add_mesh(name=name, uservert=corners.ravel().tolist(), userface=triangles.ravel().tolist())
        body = spec.worldbody.add_body(name=name)
        body.add_freejoint()
        body.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname=name, mass=1.0)
    return spec.compile()


MODELS = {}


def distance(a, b, question):
    key = id(a), id(b)
    if key not in MODELS:
        try:
            MODELS[key] = model_of(a, b)
        except ValueError as reason:
            raise Refused(str(reason)) from reason
    model = MODELS[key]
    data = mujoco.MjData(model)
    rotation, translation = rows(question)
    quaternion = np.zeros(4)
    mujoco.mju_mat2Quat(quaternion, rotation.ravel())
    data.qpos[:] = [0, 0, 0, 1, 0, 0, 0, *translation, *quaternion]
    mujoco.mj_kinematics(model, data)
    return {"answer": max(float(mujoco.mj_geomDistance(model, data, 0, 1, FAR, None)), 0.0)}


serve(
    "MuJoCo", mujoco.__version__, "mj_geomDistance of mesh geoms", mesh, {"distance": distance},
    coordinates="f32", placement="f64", features=[], distance_error=1e-6, error_unit="size",
)  # fmt: skip
