"""Is a robot's configuration free: of itself, of obstacles, and with a tool?

It prints:

    joints: ['waist', 'shoulder', 'elbow', 'wrist']
    touching: True [('forearm', 'post'), ('hand', 'post')]
    4568 of 5000 are free
"""

import numpy as np

import cbvh

# Pairs that may touch: those of an SRDF file (srdf="arm.srdf"), or those that touch in a tenth of random configurations.
arm = cbvh.Robot.from_urdf("testdata/robot/robot.urdf")
arm.allow_frequent(share=0.1)
print("joints:", arm.joints)

arm.add_obstacle(cbvh.box([0.1, 0.1, 1.0]), cbvh.pose([0.5, 0, 0.5]), name="post")
arm.attach(cbvh.capsule(0.01, 0.1), "hand", cbvh.pose([0, 0, 0.1]), name="tool", may_touch=["hand"])
arm.set_margin("post", 0.02)

q = arm.q(shoulder=0.8, elbow=0.3)
print("touching:", arm.collide(q), arm.pairs_in_contact(q))

# Thousands of configurations in one call, within the limits of the joints.
lower, upper = arm.limits.T
many = np.random.default_rng(1).uniform(np.maximum(lower, -np.pi), np.minimum(upper, np.pi), (5000, len(arm.joints)))
print(f"{(~arm.collide(many, parallel=True)).sum()} of {len(many)} are free")
