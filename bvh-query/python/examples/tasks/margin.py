"""Does a robot keep a safety margin? One margin for a query, or one for each body.

It prints:

    within 60: False  within 60.5: True
    padded by 60.5, it touches: True  left: 0.0
    margins of 40 and 20: False  left: 0.5
    half a unit more: True
"""

import cbvh

room = cbvh.bake_files("testdata/fclenv.obj", "room.cbvh")
robot = cbvh.bake_files("testdata/fclrob.obj", "robot.cbvh")
pose = [[0.6, -0.8, 0, 300], [0.8, 0.6, 0, -1600], [0, 0, 1, -500], [0, 0, 0, 1]]

# A threshold for a query. A gap of exactly that size counts.
print("within 60:", room.within(robot, pose, 60), " within 60.5:", room.within(robot, pose, 60.5))

# A robot that is larger by its padding, with round edges. Nothing is baked again.
padded = robot.rounded(60.5)
print("padded by 60.5, it touches:", room.collide(padded, pose), " left:", room.distance(padded, pose).distance)

# Margins of the bodies of a scene, and of one pair: they add up.
scene = cbvh.Scene()
scene.add(room, name="room")
scene.add(robot, pose, name="robot")
scene.set_margin("robot", 40)
scene.set_pair_margin("room", "robot", 20)
print("margins of 40 and 20:", scene.collide(), " left:", scene.distance().nearest.distance)
scene.set_margin("room", 0.5)
print("half a unit more:", scene.collide())
