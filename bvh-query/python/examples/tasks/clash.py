"""Which parts of an assembly clash, and by how much?

It prints:

    base, upright: PROTRUDING, 0.0500 to 0.0500 deep, 3.810e-04 in common
    base, beside: NEAR, 0.0707 apart
    base, across: NEAR, 0.0900 apart
    upright, beside: NEAR, 0.0573 apart
    upright, across: PIERCING, 0.0669 to 0.0702 deep, 2.821e-04 in common
    beside, across: NEAR, 0.0663 apart
"""

import numpy as np

import cbvh

base = cbvh.bake_files("testdata/robot/base.obj", "base.cbvh")
link = cbvh.bake_files("testdata/robot/link.obj", "link.cbvh")
assembly = cbvh.Scene()  # or `cbvh.Scene.open` of a file that `cbvh bake --scene` made from glTF or COLLADA
assembly.add(base, name="base")
assembly.add(link, cbvh.pose([0, 0, 0.2]), name="upright")
assembly.add(link, cbvh.pose([0.15, 0, 0.3]), name="beside")
assembly.add(link, cbvh.pose([0, 0.1, 0.35], [np.sqrt(0.5), 0, 0, np.sqrt(0.5)]), name="across")

pairs, found = assembly.clashes(clearance=0.1, magnitudes=True)
for number, (a, b) in enumerate(pairs):
    print(f"{assembly.name(a)}, {assembly.name(b)}: {found.kind[number]}", end="")
    if found.kind[number] == cbvh.ClashClass.NEAR:
        print(f", {found.distance[number]:.4f} apart")
    else:
        print(f", {found.depth.lower[number]:.4f} to {found.depth.upper[number]:.4f} deep", end="")
        print(f", {found.magnitudes.volume[number]:.3e} in common")
