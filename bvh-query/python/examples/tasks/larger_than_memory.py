"""How is a mesh baked that is larger than memory? With a budget; the rest goes to scratch files.

It prints:

    25000084 bytes of STL, 27370176 bytes baked
    500000 triangles, 18.712846660954888 apart
"""

import os

import numpy as np

import cbvh

# A binary STL file of half a million triangles, 25 MB: waves on a grid. Yours may have hundreds of gigabytes.
x, y = np.meshgrid(np.arange(501.0), np.arange(501.0))
grid = np.stack([x, y, 5 * np.sin(x / 20) * np.cos(y / 30)], axis=-1).astype("<f4")
a, b, c, d = grid[:-1, :-1], grid[:-1, 1:], grid[1:, 1:], grid[1:, :-1]
corners = np.stack([a, b, c, a, c, d], axis=2).reshape(-1, 3, 3)
rows = np.zeros(len(corners), np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")]))
rows["corners"] = corners
with open("waves.stl", "wb") as file:
    file.write(bytes(80) + np.uint32(len(rows)).tobytes() + rows.tobytes())

# At most 192 MiB of memory for the process while it bakes. The bytes of the file are those of any other budget.
# Queries map the file, and read the parts that they need.
waves = cbvh.bake_files("waves.stl", "waves.cbvh", max_memory=192 << 20)
print(f"{os.path.getsize('waves.stl')} bytes of STL, {waves.nbytes} bytes baked")
print(waves.triangle_count, "triangles,", waves.distance(cbvh.sphere(1.0), cbvh.pose([250, 250, 20])).distance, "apart")
