"""Do two meshes touch, and where?

It prints:

    touching: True
    60 pairs; triangles of the room: [12 14]
    all within [ -484.  -2237.    -14.5] and [  916.  -1342.1    -5.5]
"""

import numpy as np

import cbvh

# Baked once; the second run of a program only opens the files.
room = cbvh.bake_files("testdata/fclenv.obj", "room.cbvh")
robot = cbvh.bake_files("testdata/fclrob.obj", "robot.cbvh")

# The pose of the robot in the frame of the room: the columns of a rotation, and the translation in mesh units.
pose = [[0.6, -0.8, 0, 300], [0.8, 0.6, 0, -1600], [0, 0, 1, -430], [0, 0, 0, 1]]
print("touching:", room.collide(robot, pose))

# One row per pair of triangles: object and triangle of the room, object and triangle of the robot.
contacts = room.contacts(robot, pose)
print(f"{len(contacts)} pairs; triangles of the room: {np.unique(contacts[:, 1])}")

# What the pairs have in common: points, segments and polygons, in the frame of the room.
regions = room.contact_regions(robot, pose)
points = regions.points[~np.isnan(regions.points).any(axis=2)]
print("all within", points.min(axis=0).round(1), "and", points.max(axis=0).round(1))
