"""Pinocchio and cbvh on the same URDF and SRDF: the same contacts and distances, pair by pair.

    pip install pin example-robot-data
    python examples/from_pinocchio.py

Pinocchio asks Coal, whose requests count contact up to a distance of 0.001 unless `break_distance` is 0. A geometry of
Pinocchio is one shape of a link; a body of cbvh is a link with all its shapes, and the distance of two links is the least
one of their shapes. `computeDistances` computes the distances of all pairs, and `Robot.near_pairs` those up to a margin.
Positive distances are compared: where meshes overlap, Coal's distance is 0, and that of cbvh is minus the depth.
"""

import time

import numpy as np
import pinocchio

import cbvh
from _cell import ARMS, files_of

CONFIGURATIONS, MEASURED = 1000, 200
# In metres. Coal's iterations for primitives, GJK, end within a millionth.
MARGIN, TOLERANCE = 0.05, 1e-6


def configuration_of(model, names, q):
    """Joint values of cbvh as Pinocchio's configuration: joints without limits are a cosine and a sine there."""
    configuration = pinocchio.neutral(model)
    for name, value in zip(names, q):
        joint = model.joints[model.getJointId(name)]
        configuration[joint.idx_q : joint.idx_q + joint.nq] = [value] if joint.nq == 1 else [np.cos(value), np.sin(value)]
    return configuration


def timed(answer, inputs):
    """The answers, and the milliseconds that each takes on average."""
    start = time.perf_counter()
    answers = [answer(of) for of in inputs]
    return answers, 1000 * (time.perf_counter() - start) / len(inputs)


def compare(arm):
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

    # Distances, and how long each library takes for them.
    def distances(configuration):
        pinocchio.computeDistances(model, data, geometry, results, configuration)
        least = dict.fromkeys(links, np.inf)
        for pair, result in zip(links, results.distanceResults):
            least[pair] = min(least[pair], result.min_distance)
        return least

    rows = rows[:MEASURED]
    theirs, milliseconds = timed(distances, [configuration_of(model, robot.joints, q) for q in rows])
    ours, of_all = timed(lambda q: robot.near_pairs(q, 9.0), rows)  # No two links are 9 m apart.
    near, of_near = timed(lambda q: robot.near_pairs(q, MARGIN), rows)
    compared = 0
    for q, expected, found, some in zip(rows, theirs, ours, near):
        found = {tuple(sorted((pair.a, pair.b))): pair.distance for pair in found}
        inside = {tuple(sorted(pair)) for pair in robot.pairs_inside(q)}
        assert found.keys() == expected.keys()
        for pair, distance in found.items():
            if distance > 0:
                assert abs(distance - expected[pair]) <= TOLERANCE
                compared += 1
            else:
                # A link inside another one overlaps it here. For Coal it is apart from that one's surface.
                assert expected[pair] <= 0 or pair in inside
        assert [pair.distance for pair in some] == [distance for distance in found.values() if distance <= MARGIN]
    print(f"{arm}: the same {compared} distances; per configuration, Pinocchio takes {milliseconds:.2f} ms, and cbvh", end=" ")
    print(f"{of_all:.2f} ms with depths and derivatives, or {of_near:.2f} ms up to {100 * MARGIN:.0f} cm")
    assert compared


for arm in ARMS:
    compare(arm)
