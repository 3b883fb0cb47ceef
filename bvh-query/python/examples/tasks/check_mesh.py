"""Is a mesh fit for queries about its inside? Open edges, self-contacts, seams.

It prints:

    a cube: no edge is open
    without a face: 3 edges have one triangle; the nearest gap is 1.00e0, and no crack
    loose triangles: 36 edges have one triangle; the nearest gap is 1.08e-9: bake with --weld 1e-8
    welded: no edge is open  moved by at most 2e-09
    two cubes: 18 pairs of triangles meet, the first CROSSING, [ 2 16]
"""

import numpy as np

import cbvh

cube = cbvh.box([1, 1, 1])
vertices, faces = cube.arrays()
print("a cube:", cube.open_edges())

# A hole.
print("without a face:", cbvh.bake(vertices, faces[1:]).open_edges())

# A seam: every triangle has corners of its own, which rounding has moved.
loose = vertices[faces].reshape(-1, 3) + np.random.default_rng(1).uniform(-1e-9, 1e-9, (3 * len(faces), 3))
numbers = np.arange(3 * len(faces)).reshape(-1, 3)
found = cbvh.bake(loose, numbers).open_edges()
print("loose triangles:", found)
welded = cbvh.bake(loose, numbers, weld=found.proposed_weld)
print("welded:", welded.open_edges(), " moved by at most", f"{welded.max_move:.0e}")

# A second cube that cuts into the first one.
both = cbvh.bake(np.concatenate([vertices, vertices + 0.7]), np.concatenate([faces, faces + len(vertices)]))
meets = both.self_contacts()
print(f"two cubes: {meets.total} pairs of triangles meet, the first {meets.kind[0]}, {meets.triangles[0, 1::2]}")
