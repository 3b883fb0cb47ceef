"""Is one part inside another, without touching it?

It prints:

    touching: [False  True False]  relation: [B_IN_A, TOUCHING, APART]
    solid:    [ True  True False]  distance: [0.   0.   1.95]
    points: [INSIDE, ON, OUTSIDE]
    open: UNDEFINED
    3 edges have one triangle; the nearest gap is 2.00e0, and no crack
"""

import numpy as np

import cbvh

tank = cbvh.bake(*cbvh.box([2, 2, 2]).arrays())  # a surface, as a mesh file has it
pump = cbvh.bake_files("testdata/robot/link.obj", "pump.cbvh")
poses = cbvh.pose([[0, 0, 0], [1, 0, 0], [3, 0, 0]])  # in the tank, through its wall, beside it

# A mesh is its surface, so the first pose is no contact. `relation` tells which one is inside.
print("touching:", tank.collide(pump, poses), " relation:", tank.relation(pump, poses))

# Of a solid, the inside counts as contact, at distance 0.
solid = tank.solid()
print("solid:   ", solid.collide(pump, poses), " distance:", solid.distance(pump, poses).distance.round(3))

# Points are inside, on the surface or outside, exactly.
print("points:", tank.sides([[0, 0, 0], [1, 0.3, 0.3], [np.nextafter(1, 2), 0, 0]]))

# Only closed meshes have an inside. A mesh says what keeps it open.
open_tank = cbvh.bake(tank.vertices, tank.faces[1:])
print("open:", open_tank.relation(pump, poses[0]))
print(open_tank.open_edges())
