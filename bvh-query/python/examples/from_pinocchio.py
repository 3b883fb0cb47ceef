"""Pinocchio and cbvh on the same URDF and SRDF: the same pairs touch, pair by pair.

    pip install pin example-robot-data
    python examples/from_pinocchio.py

Pinocchio asks Coal, whose requests count contact up to a distance of 0.001 unless `break_distance` is 0. A geometry of
Pinocchio is one shape of a link; a body of cbvh is a link with all its shapes.
"""

import numpy as np
import pinocchio

import cbvh
from _cell import ARMS, files_of

CONFIGURATIONS = 1000


def configuration_of(model, names, q):
    """Joint values of cbvh as Pinocchio's configuration: joints without limits are a cosine and a sine there."""
    configuration = pinocchio.neutral(model)
    for name, value in zip(names, q):
        joint = model.joints[model.getJointId(name)]
        configuration[joint.idx_q : joint.idx_q + joint.nq] = [value] if joint.nq == 1 else [np.cos(value), np.sin(value)]
    return configuration


for arm in ARMS:
    urdf, srdf, share = files_of(arm)

    # Pinocchio. Mimic joints follow only if it is told so.
    model = pinocchio.buildModelFromUrdf(str(urdf), mimic=True)
    data = model.createData()
    geometry = pinocchio.buildGeomFromUrdf(model, str(urdf), pinocchio.GeometryType.COLLISION, package_dirs=[share])
    geometry.addAllCollisionPairs()
    pinocchio.removeCollisionPairs(model, geometry, str(srdf))
    results = geometry.createData()
    for request in results.collisionRequests:
        request.break_distance = request.security_margin = 0.0
    link_of = [model.frames[part.parentFrame].name for part in geometry.geometryObjects]
    links = [tuple(sorted((link_of[pair.first], link_of[pair.second]))) for pair in geometry.collisionPairs]

    # cbvh.
    robot = cbvh.Robot.from_urdf(urdf, [share], srdf)
    assert {tuple(sorted(pair)) for pair in robot.pairs} == set(links)

    limits = np.clip(robot.limits, -np.pi, np.pi)
    rows = np.random.default_rng(1).uniform(limits[:, 0], limits[:, 1], (CONFIGURATIONS, len(limits)))
    touching = 0
    for q, pairs in zip(rows, robot.pairs_in_contact(rows)):
        pinocchio.computeCollisions(model, data, geometry, results, configuration_of(model, robot.joints, q), False)
        expected = {pair for pair, result in zip(links, results.collisionResults) if result.isCollision()}
        assert {tuple(sorted(pair)) for pair in pairs} == expected
        touching += len(expected)
    print(f"{arm}: {len(robot.pairs)} pairs of links; the same {touching} contacts in {CONFIGURATIONS} configurations")
    assert touching
