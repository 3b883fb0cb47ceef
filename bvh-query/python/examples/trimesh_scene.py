"""A scene of trimesh in cbvh: each geometry is baked once, however often it is placed.

    pip install trimesh networkx scipy
    python examples/trimesh_scene.py

Nodes of the graph are instances, with the names and poses that they have there. Scenes come from glTF, COLLADA and others.
Transforms with a scale are baked into their mesh. With python-fcl, the contacts are compared with those of
`trimesh.collision`.
"""

import importlib.util
import itertools

import numpy as np
import trimesh

import cbvh


def scene_of(scene):
    """All nodes with a geometry, as instances of a cbvh scene."""
    placed, meshes = cbvh.Scene(), {}
    for node in scene.graph.nodes_geometry:
        transform, geometry = scene.graph[node]
        # A pose is rigid. What else there is in the transform goes into the mesh.
        rotation, scale = polar(transform[:3, :3])
        key = geometry, tuple((scale.round(12) + 0.0).ravel())
        if key not in meshes:
            mesh = scene.geometry[geometry]
            meshes[key] = cbvh.bake(mesh.vertices @ scale.T, mesh.faces)
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = rotation, transform[:3, 3]
        placed.add(meshes[key], cbvh.nearest_pose(pose), name=node)
    return placed, meshes


def polar(matrix):
    """A rotation, and what is to be done before it."""
    u, _, v = np.linalg.svd(matrix)
    turn = np.diag([1, 1, np.sign(np.linalg.det(u @ v))])
    rotation = u @ turn @ v
    return rotation, rotation.T @ matrix


rng, scene = np.random.default_rng(1), trimesh.Scene()
scene.geometry = {"board": trimesh.creation.box((2, 0.5, 0.05)), "ring": trimesh.creation.torus(0.4, 0.05)}
for number in range(4):
    lifted = trimesh.transformations.translation_matrix((0, 0, 0.4 * number))
    scene.graph.update(f"board {number + 1}", "world", matrix=lifted, geometry="board")
for number in range(24):
    pose = trimesh.transformations.random_rotation_matrix(rng.random(3))
    pose[:3, 3] = rng.uniform((-1, -0.4, -0.3), (1, 0.4, 1.5))
    pose[:3, :3] *= [0.3, 0.5][number % 2]
    scene.graph.update(f"ring {number + 1}", "world", matrix=pose, geometry="ring")

placed, meshes = scene_of(scene)
assert len(placed) == 28 and len(meshes) == 3  # A board, and rings of two sizes.
contacts = {tuple(sorted(placed.name(of) for of in pair)) for pair in placed.pairs_in_contact()}
print(f"{len(placed)} nodes of {len(meshes)} meshes, {len(contacts)} contacts")

# The same from all triangles in the world, pair by pair.
world = {}
for node in scene.graph.nodes_geometry:
    transform, geometry = scene.graph[node]
    world[node] = scene.geometry[geometry].copy().apply_transform(transform)
whole = {node: cbvh.bake(mesh.vertices, mesh.faces) for node, mesh in world.items()}
pairs = itertools.combinations(sorted(whole), 2)
assert contacts == {(a, b) for a, b in pairs if whole[a].collide(whole[b], np.eye(4))}
assert contacts

if importlib.util.find_spec("fcl") is None:
    print("python-fcl is not installed: not compared with trimesh.collision")
else:
    # Not with `scene_to_collision`, which takes transforms with a scale for rigid ones.
    manager = trimesh.collision.CollisionManager()
    for node, mesh in world.items():
        manager.add_object(node, mesh)
    _, names = manager.in_collision_internal(return_names=True)
    assert contacts == {tuple(sorted(pair)) for pair in names}
    print("the same contacts as those of trimesh.collision")
