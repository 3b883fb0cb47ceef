"""How deep do two parts overlap, and which move takes them apart?

It prints:

    depth from 0.050000 to 0.050000, by the move [0.   0.   0.05]
    after the move: APART
    sideways: 0.122
    signed: [-0.05  -0.025  0.     0.025  0.05 ]
"""

import numpy as np

import cbvh

base = cbvh.bake_files("testdata/robot/base.obj", "base.cbvh")
link = cbvh.bake_files("testdata/robot/link.obj", "link.cbvh")
pose = cbvh.pose([0, 0, 0.2])  # the link in the frame of the base

# Certified bounds of the shortest translation after which the insides are disjoint, and one of the upper length.
deep = base.penetration(link, pose)
print(f"depth from {deep.lower:.6f} to {deep.upper:.6f}, by the move {deep.translation.round(6) + 0.0}")
pose[:3, 3] += deep.translation
print("after the move:", base.relation(link, pose))

# Along a direction of your choice.
pose = cbvh.pose([0, 0, 0.2])
print("sideways:", round(base.separation(link, pose, [1, 0, 0]).upper, 6))

# One number for parts that are apart or overlap: the distance, or minus the depth.
poses = cbvh.pose(np.linspace([0, 0, 0.2], [0, 0, 0.3], 5))
print("signed:", base.signed_distance(link, poses).upper.round(6) + 0.0)
