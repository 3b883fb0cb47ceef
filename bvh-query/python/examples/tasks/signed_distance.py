"""How far are points from a surface, with a sign? A grid, as for level sets or for labels of learning.

It prints:

    6542 of 32768 points are inside, the deepest 0.0460 deep
    largest error of a label: 6e-16
    in the band: 6976
    of length 1: True
"""

import numpy as np

import cbvh

link = cbvh.bake_files("testdata/robot/link.obj", "link.cbvh")

# Points in a box around the mesh, some 30,000 of them.
lower, upper = link.bounds + [[-0.02], [0.02]]
axes = [np.linspace(low, high, 32) for low, high in zip(lower, upper)]
points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)

# Negative inside. The side is decided exactly; the distance has certified bounds in `closest_points`.
field = link.signed_point_distances(points, parallel=True)
print(f"{(field < 0).sum()} of {field.size} points are inside, the deepest {-field.min():.4f} deep")
closest = link.closest_points(points, parallel=True)
print("largest error of a label:", f"{np.max(closest.upper - closest.lower):.0e}")

# Where only a band around the surface matters, the others are NaN, and cost less.
band = link.signed_point_distances(points, within=0.01, parallel=True)
print("in the band:", np.isfinite(band).sum())

# The gradient of the field is the direction from the closest point.
outward = (points - closest.point) / field[:, None]
print("of length 1:", np.allclose(np.linalg.norm(outward[field != 0], axis=1), 1))
