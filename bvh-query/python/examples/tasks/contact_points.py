"""Which forces does a contact give a simulator? Few points per contact, each with a normal and a depth.

It prints:

    points: [[-0.2, -0.2], [-0.2, 0.2], [0.2, -0.2], [0.2, 0.2]]
    depth: [0.00123 0.00123 0.00123 0.00123]  at rest: True
    as deep as its weight asks for: True
"""

import numpy as np

import cbvh

table, box = cbvh.box([2, 1, 0.2]), cbvh.box([0.4, 0.4, 0.4])
HEIGHT, STIFFNESS, DAMPING, MASS, STEP = 0.3, 4000.0, 120.0, 2.0, 0.002

# A box falls onto a table, whose top is at 0.1. Its spin is left out, to keep this short.
position, velocity = np.array([0.0, 0.0, HEIGHT + 0.05]), np.zeros(3)
for step in range(1000):
    force = np.array([0, 0, -9.81 * MASS])
    # Mesh a pushes mesh b along the normals, which are in the frame of a. At most four points of a patch: the deepest,
    # and those that span most of it.
    found = table.patches(box, cbvh.pose(position), max_points=4)
    for normal, depth in zip(found.point_normals, found.point_depths):
        force = force + max(0.0, STIFFNESS * depth - DAMPING * (velocity @ normal)) * normal
    velocity = velocity + STEP * force / MASS
    position = position + STEP * velocity

print("points:", sorted(found.points[:, :2].round(3).tolist()))
print("depth:", found.point_depths.round(5), " at rest:", bool(abs(velocity[2]) < 1e-9))
print("as deep as its weight asks for:", np.isclose(found.point_depths[0], 9.81 * MASS / STIFFNESS / 4))
