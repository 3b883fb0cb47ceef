"""How deep two shapes overlap, and where: a ring on a block, pushed apart by the shortest way.

    python examples/depth.py

The translation that an answer gives is tried, and nothing shorter than its lower bound may separate the shapes.
"""

import numpy as np

import cbvh


def ring(radius, thickness, columns=48, rows=24):
    """The vertices and faces of a torus around the z-axis."""
    u, v = np.meshgrid(*(2 * np.pi * np.arange(count) / count for count in (columns, rows)), indexing="ij")
    reach = radius + thickness * np.cos(v)
    vertices = np.stack([reach * np.cos(u), reach * np.sin(u), thickness * np.sin(v)], axis=-1).reshape(-1, 3)
    at = lambda i, j: (i % columns) * rows + j % rows
    cells = [(at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)) for i in range(columns) for j in range(rows)]
    return vertices, [face for a, b, c, d in cells for face in ((a, b, c), (a, c, d))]


def moved(pose, translation):
    pose = pose.copy()
    pose[:3, 3] += translation
    return pose


torus, block = cbvh.bake(*ring(1.0, 0.3)), cbvh.box([0.5, 0.5, 4.0])

# The block stands upright and cuts into the ring from outside; in the second pose it is in the middle of the tube; in the
# third it lies across the ring and meets it twice; in the fourth it stands in the hole, without contact.
poses = np.tile(np.eye(4), (4, 1, 1))
poses[:, :3, 3] = [[1.5, 0, 0], [1.0, 0, 0], [0, 0, 0.25], [0, 0, 0]]
poses[2, :3, :3] = [[0, 0, 1], [0, 1, 0], [-1, 0, 0]]

depth = torus.penetration(block, poses, parallel=True)
for number, (pose, lower, upper, translation) in enumerate(zip(poses, depth.lower, depth.upper, depth.translation)):
    print(f"pose {number}: depth from {lower:.4f} to {upper:.4f}, moving the block by {np.round(translation, 4)}")
    assert lower <= upper
    assert torus.relation(block, moved(pose, translation)) == cbvh.Relation.APART
    if lower > 0:
        for way in np.random.default_rng(number).normal(size=(100, 3)):
            shorter = moved(pose, 0.999 * lower * way / np.linalg.norm(way))
            assert torus.relation(block, shorter) != cbvh.Relation.APART

    patches = torus.patches(block, pose)
    for center, normal, length, deep in zip(patches.center, patches.normal, patches.length, patches.depth):
        print(f"  a patch around {np.round(center, 3)}, pushed along {np.round(normal, 3)}, {length:.3f} long, {deep:.3f} deep")
    assert (len(patches.depth) > 0) == torus.collide(block, pose)

# Sideways, the first block leaves the ring where the ring's widest part ends; the last one is free already.
out = torus.separation(block, poses, [1, 0, 0])
print(f"along x: {np.round(out.upper, 4)}")
np.testing.assert_allclose(out.upper, [0.05, 0.55, 3.3, 0], atol=1e-6)
assert np.all(depth.upper <= out.upper + 1e-9) and depth.upper[3] == 0
