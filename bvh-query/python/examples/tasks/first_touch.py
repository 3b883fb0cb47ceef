"""When does a moving body first touch, and how far may it go?

It prints:

    HIT: free until 0.386574030, touching at 0.386574119
    triangle of the room: 36  point: [ 995.5   -372.334 2987.5  ]
    touching there: False  gap: 2.4e-04
    with a clearance: 0.276075
    turning: HIT 0.300994
"""

import cbvh

room = cbvh.bake_files("testdata/fclenv.obj", "room.cbvh")
robot = cbvh.bake_files("testdata/fclrob.obj", "robot.cbvh")

fall = cbvh.Motion.between(cbvh.pose([500, 0, 5000]), cbvh.pose([500, 0, -400]))
hit = room.motion(robot, fall)
print(f"{hit.kind}: free until {hit.free_until:.9f}, touching at {hit.at:.9f}")
print("triangle of the room:", hit.nearest.triangle_a, " point:", hit.nearest.point_a.round(3))

# The last pose that is certainly free, and the gap that is left there.
last = fall.pose(hit.free_until)
print("touching there:", room.collide(robot, last), " gap:", f"{room.distance(robot, last).distance:.1e}")

# Stop 100 mesh units before the room.
print("with a clearance:", round(room.motion(robot, fall, clearance=100).free_until, 6))

# A screw: ten turns about z while the robot sinks. `Polyline` and paths of your own work the same way.
screw = cbvh.Motion.screw(cbvh.pose([500, 0, 5000]), [500, 0, 0], [0, 0, 1], 62.8, -5400)
print("turning:", room.motion(robot, screw).kind, round(room.motion(robot, screw).free_until, 6))
