"""MuJoCo's geoms in a cbvh scene, as the meshes that they are: MuJoCo takes their convex hulls for contact.

    pip install mujoco
    python examples/mujoco_scene.py

A ball falls into a cup, and a rod goes through a ring. MuJoCo reports contact as soon as they are inside the hulls. The
poses of its `mj_forward` are those of the scene here, whose answers are about the triangles. Where all shapes are convex,
both agree.
"""

import itertools

import mujoco
import numpy as np

import cbvh
from _cell import open_box, ring

numbers = lambda array: " ".join(map(str, np.asarray(array).ravel()))
asset = lambda name, mesh: f'<mesh name="{name}" vertex="{numbers(mesh[0])}" face="{numbers(mesh[1])}"/>'
MODEL = f"""<mujoco><asset>{asset("cup", open_box(0.2, 0.2, 0.2, 0.01))}{asset("ring", ring(0.2, 0.02))}</asset><worldbody>
<geom name="floor" type="plane" size="2 2 0.1"/>
<geom name="cup" type="mesh" mesh="cup" pos="0 0 0.001"/>
<geom name="ring" type="mesh" mesh="ring" pos="1 0 0.5" euler="90 0 0"/>
<body name="ball"><freejoint/><geom name="ball" type="sphere" size="0.03"/></body>
<body name="rod"><freejoint/><geom name="rod" type="capsule" size="0.01 0.3"/></body>
<body name="brick"><freejoint/><geom name="brick" type="box" size="0.05 0.1 0.02"/></body>
</worldbody></mujoco>"""


def shape_of(model, geom):
    """A geom as a cbvh mesh in the geom's frame."""
    kind, size = mujoco.mjtGeom(model.geom_type[geom]), model.geom_size[geom]
    if kind == mujoco.mjtGeom.mjGEOM_MESH:
        mesh = model.mesh(model.geom_dataid[geom])
        vertices, faces = mesh.vertadr[0], mesh.faceadr[0]
        return cbvh.bake(
            model.mesh_vert[vertices : vertices + mesh.vertnum[0]], model.mesh_face[faces : faces + mesh.facenum[0]]
        )
    if kind == mujoco.mjtGeom.mjGEOM_SPHERE:
        return cbvh.sphere(size[0])
    if kind == mujoco.mjtGeom.mjGEOM_CAPSULE:
        return cbvh.capsule(size[0], 2 * size[1])
    if kind == mujoco.mjtGeom.mjGEOM_BOX:
        return cbvh.box(2 * size)
    if kind == mujoco.mjtGeom.mjGEOM_CYLINDER:
        return cbvh.cylinder(size[0], 2 * size[1])
    assert kind == mujoco.mjtGeom.mjGEOM_PLANE, f"no shape for {kind.name}"
    return cbvh.ground()


def scene_of(model):
    """A scene with all geoms, named as they are, and the pairs that MuJoCo does not ask about allowed."""
    scene = cbvh.Scene()
    for geom in range(model.ngeom):
        scene.add(shape_of(model, geom), name=model.geom(geom).name)
    for a, b in itertools.combinations(range(model.ngeom), 2):
        bodies = model.geom_bodyid[[a, b]]
        if model.body_weldid[bodies[0]] == model.body_weldid[bodies[1]]:
            scene.set_allowed(model.geom(a).name, model.geom(b).name)
    return scene


def place(scene, model, data):
    """Moves all instances to where mj_forward has put the geoms."""
    for geom in range(model.ngeom):
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = data.geom_xmat[geom].reshape(3, 3), data.geom_xpos[geom]
        scene.set_pose(model.geom(geom).name, pose)


def both(scene, model, data):
    """The pairs in contact that MuJoCo reports, and those of the scene."""
    mujoco.mj_forward(model, data)
    place(scene, model, data)
    hulls = {frozenset(model.geom(geom).name for geom in contact.geom) for contact in data.contact if contact.dist <= 0}
    return hulls, {frozenset(scene.name(number) for number in pair) for pair in scene.pairs_in_contact()}


model = mujoco.MjModel.from_xml_string(MODEL)
data, scene = mujoco.MjData(model), scene_of(model)
free = {"ball": 0, "rod": 7, "brick": 14}


def put(name, position, quaternion=(1, 0, 0, 0)):
    data.qpos[free[name] : free[name] + 7] = *position, *quaternion


# The ball is in the middle of the cup, and the rod in that of the ring: they touch nothing.
put("ball", (0, 0, 0.1))
put("rod", (1, 0, 0.5), (np.sqrt(0.5), np.sqrt(0.5), 0, 0))
put("brick", (-1, 0, 0.5))
hulls, triangles = both(scene, model, data)
assert hulls == {frozenset(pair) for pair in (("cup", "ball"), ("ring", "rod"))} and not triangles
print("in the middle of a cup and of a ring: MuJoCo reports", sorted(map(sorted, hulls)), "and the scene none")



def rod_pierces_brick():
    """Whether a point of the rod's axis is inside the brick."""
    (rod, brick), z = (data.geom(name) for name in ("rod", "brick")), np.linspace(-0.3, 0.3, 2001)
    points = rod.xpos + z[:, None] * rod.xmat.reshape(3, 3)[:, 2]
    return (np.abs((points - brick.xpos) @ brick.xmat.reshape(3, 3)) <= model.geom("brick").size).all(axis=1).any()


# Anywhere: both agree about convex geoms, except that MuJoCo passes over a few rods that pierce the brick. What touches a
# mesh also touches its hull.
rng, convex, hollow, passed_over = np.random.default_rng(1), 0, [0, 0], 0
for _ in range(2000):
    for name in free:
        middle = [(0, 0, 0.1), (1, 0, 0.5)][rng.integers(2)]
        quaternion = rng.normal(size=4)
        put(name, rng.normal(middle, 0.12), quaternion / np.linalg.norm(quaternion))
    hulls, triangles = both(scene, model, data)
    is_hollow = lambda pair: bool(pair & {"cup", "ring"})
    if frozenset({"rod", "brick"}) in triangles - hulls:
        assert rod_pierces_brick()
        hulls.add(frozenset({"rod", "brick"}))
        passed_over += 1
    assert {pair for pair in hulls if not is_hollow(pair)} == {pair for pair in triangles if not is_hollow(pair)}
    assert triangles <= hulls
    convex += sum(not is_hollow(pair) for pair in hulls)
    hollow[0] += sum(map(is_hollow, hulls))
    hollow[1] += sum(map(is_hollow, triangles))
print(f"in 2,000 random poses: {convex} contacts of convex geoms, of which MuJoCo passes over {passed_over}; with cup and ring")
print(f"{hollow[0]} contacts of their hulls, of which {hollow[1]} are contacts of the triangles")
assert 0 < hollow[1] < hollow[0]
