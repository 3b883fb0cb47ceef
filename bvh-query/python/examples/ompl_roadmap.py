"""OMPL grows a roadmap for an arm without a check, and cbvh then checks all of its states and edges in two calls.

    pip install ompl scipy example-robot-data
    python examples/ompl_roadmap.py

OMPL checks one state or edge at a time. Its PRM is therefore told that all are valid, and `PlannerData` hands out the
roadmap. `Robot.collide` checks the states and `Robot.is_free` the edges, each in one call, on all cores; the validators of
`ompl_arm.py` give the same answers one by one. For a single path, fewer edges are enough: lazy planning checks those of the
shortest path in one call, and tries the next one without the edges that are not free.
"""

import time

import numpy as np
from ompl import base, geometric, util
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from _cell import arm_in_cell
from ompl_arm import ARM, GOAL, GROUP, START, Certified, Checker, state_of

MILESTONES = 300


class Unchecked(base.MotionValidator):
    """Accepts each motion."""

    def checkMotion(self, start, end):
        return True


def grow(information):
    """The states of a roadmap, of which the first two are start and goal, and its edges as pairs of numbers of states."""
    problem = base.ProblemDefinition(information)
    problem.setStartAndGoalStates(state_of(information, START), state_of(information, GOAL))
    planner = geometric.PRM(information)
    planner.setProblemDefinition(problem)
    planner.setup()
    planner.growRoadmapPtc(base.PlannerTerminationCondition(lambda: planner.milestoneCount() >= MILESTONES))
    planner.solve(0.0)  # Adds start and goal with their edges.
    data = base.PlannerData(information)
    planner.getPlannerData(data)
    assert data.isStartVertex(0) and data.isGoalVertex(1)
    states = [information.cloneState(data.getVertex(number).getState()) for number in range(data.numVertices())]
    return states, np.array([(i, j) for i in range(len(states)) for j in data.getEdges(i) if i < j])


def shortest(q, edges):
    """The edges of the shortest path between the first two states."""
    lengths = np.linalg.norm(q[edges[:, 0]] - q[edges[:, 1]], axis=1)
    graph = csr_array((lengths, edges.T), shape=(len(q), len(q)))
    before = dijkstra(graph, directed=False, indices=0, return_predecessors=True)[1]
    path, at = [], 1
    while at != 0:
        assert before[at] >= 0, "expected a path in the roadmap, found none"
        path.append(tuple(sorted((int(before[at]), at))))
        at = int(before[at])
    return path[::-1]


def plan_lazily(robot, q, edges):
    """The shortest path whose edges are all free, and whether each edge that was checked for it is free."""
    known = {}
    while True:
        path = shortest(q, np.array([edge for edge in map(tuple, edges.tolist()) if known.get(edge, True)]))
        unknown = [edge for edge in path if edge not in known]
        if not unknown:
            return path, known
        i, j = np.transpose(unknown)
        known.update(zip(unknown, robot.is_free(q[i], q[j]).tolist()))


def main():
    util.setLogLevel(util.LOG_WARN)
    util.RNG.setSeed(3)
    robot = arm_in_cell(ARM)
    checker = Checker(robot, GROUP)
    information = base.SpaceInformation(checker.space())
    information.setStateValidityChecker(lambda state: True)
    unchecked, certified = Unchecked(information), Certified(information, checker)
    information.setMotionValidator(unchecked)
    information.setup()
    states, edges = grow(information)

    # The whole roadmap, for many paths.
    q = np.array([checker.q(state) for state in states])
    start = time.perf_counter()
    is_valid = ~robot.collide(q, parallel=True)
    edges = edges[is_valid[edges].all(axis=1)]
    i, j = edges.T
    is_free = robot.is_free(q[i], q[j], parallel=True)
    seconds = time.perf_counter() - start
    print(f"{is_valid.sum()} of {len(q)} states are valid, and {is_free.sum()} of {len(edges)} edges between them are free")
    start = time.perf_counter()
    assert is_valid.tolist() == [checker.is_valid(state) for state in states]
    assert is_free.tolist() == [certified.checkMotion(states[i], states[j]) for i, j in edges]
    print(f"  in {seconds:.2f} s by two calls, and in {time.perf_counter() - start:.2f} s one by one")

    # One path.
    best = shortest(q, edges[is_free])
    path, known = plan_lazily(robot, q, edges)
    assert path == best
    every = dict(zip(map(tuple, edges.tolist()), is_free.tolist()))
    assert all(every[edge] == free for edge, free in known.items())
    print(f"lazily, {len(known)} edges are checked for the same path of {len(path)} edges")
    assert len(known) < len(edges)


if __name__ == "__main__":
    main()
