"""Which gradients does an optimiser need, to push a robot out of obstacles?

It prints:

    step 0: {'forearm, post': -0.0689, 'hand, post': -0.0163}
    step 1: {'forearm, post': -0.0057, 'hand, post': 0.0323}
    step 2: {'forearm, post': 0.0278}
    step 3: {}
    free: True at [0.293 0.89  0.334 0.   ]
"""

import cbvh

arm = cbvh.Robot.from_urdf("testdata/robot/robot.urdf")
arm.allow_frequent(share=0.1)
for other in ["turret", "upper_arm"]:
    arm.allow("base", other)  # always near each other
arm.add_obstacle(cbvh.box([0.1, 0.1, 1.0]), cbvh.pose([0.5, 0, 0.5]), name="post")

MARGIN = 0.05  # metres that each pair keeps
q = arm.q(waist=0.05, shoulder=0.8, elbow=0.3)
for step in range(100):
    # All pairs nearer than the margin: the distance, or minus the depth where they overlap, with certified bounds, and
    # its derivative by each joint value.
    near = arm.near_pairs(q, MARGIN)
    print(f"step {step}:", {f"{pair.a}, {pair.b}": round(pair.distance, 4) for pair in near})
    if not near:
        break
    for pair in near:
        q = q + (1.05 * MARGIN - pair.distance) * pair.gradient / (pair.gradient @ pair.gradient) / len(near)
print("free:", not arm.collide(q), "at", q.round(3))
