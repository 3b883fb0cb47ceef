"""How does a program keep many meshes baked? A folder beside the folder of meshes.

It prints:

    base: 124 triangles, 13376 bytes
    hand: 116 triangles, 12992 bytes
    link: 188 triangles, 16064 bytes
    closest of all: link
"""

import pathlib
from concurrent.futures import ThreadPoolExecutor

import cbvh

MESHES, BAKED = pathlib.Path("testdata/robot"), pathlib.Path("baked")
BAKED.mkdir(exist_ok=True)


def load(mesh):
    """Bakes a mesh if it has changed since the last run, and maps the result, whose bytes are read when they are used."""
    return cbvh.bake_files(mesh, BAKED / f"{mesh.stem}.cbvh")


# The command does the same: cbvh bake testdata/robot -o baked
paths = sorted(MESHES.glob("*.obj"))
with ThreadPoolExecutor() as pool:
    meshes = dict(zip((path.stem for path in paths), pool.map(load, paths)))
for name, mesh in meshes.items():
    print(f"{name}: {mesh.triangle_count} triangles, {mesh.nbytes} bytes")

# Later, and in other programs, without the meshes.
again = {path.stem: cbvh.open(path) for path in sorted(BAKED.glob("*.cbvh"))}
print("closest of all:", min(again, key=lambda name: again[name].closest_points([0, 0, 1]).distance))
