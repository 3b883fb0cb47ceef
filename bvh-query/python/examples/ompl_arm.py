"""OMPL plans for an arm in a cell, and each edge of a path is certified: free at every moment, not at samples.

    pip install ompl example-robot-data
    python examples/ompl_arm.py

`cbvh.Robot` answers OMPL's two questions: whether a state is valid, and whether a motion is. RRT-Connect and PRM plan with
both. Then OMPL's own validator, which looks at states at intervals of 1 % and 0.1 % of the extent of the space, checks
random edges: it accepts some that touch, and for each of them a configuration in contact is shown. `Robot.is_free` checks
all of these edges in one call, with the answers that the validator gives one by one.
"""

import numpy as np
from ompl import base, geometric, util

import cbvh
from _cell import arm_in_cell

ARM, GROUP = "panda", "arm"
# From over the bin, past posts and shelf, to the other side.
START, GOAL = [1.96, 0.46, -0.03, -1.29, -0.47, 2.19, 0.78], [-0.63, -0.18, 0.16, -1.09, -0.29, 2.08, 0.78]
EDGES = 1000


class Checker:
    """Checks states of OMPL: the joint values of a group, while the others keep theirs."""

    def __init__(self, robot, group):
        self.robot, self.still = robot, robot.q()
        self.places = [robot.joints.index(name) for name in robot.groups[group]]

    def space(self):
        """The box of the joints' limits."""
        space = base.RealVectorStateSpace(len(self.places))
        bounds = base.RealVectorBounds(len(self.places))
        for place, (low, high) in enumerate(np.clip(self.robot.limits[self.places], -np.pi, np.pi)):
            bounds.setLow(place, low)
            bounds.setHigh(place, high)
        space.setBounds(bounds)
        return space

    def q(self, state):
        q = self.still.copy()
        q[self.places] = [state[k] for k in range(len(self.places))]
        return q

    def is_valid(self, state):
        return not self.robot.collide(self.q(state))


class Certified(base.MotionValidator):
    """Accepts a motion if nothing touches at any moment."""

    def __init__(self, information, checker):
        super().__init__(information)
        self.checker = checker

    def checkMotion(self, start, end):
        return self.checker.robot.is_free(self.checker.q(start), self.checker.q(end))


def state_of(information, values):
    state = information.allocState()
    for place, value in enumerate(values):
        state[place] = value
    return state


def plan(setup, planner, start, goal):
    """Plans and shortens a path. Returns its configurations as OMPL's states."""
    setup.setPlanner(planner)
    setup.clear()
    setup.setStartAndGoalStates(start, goal)
    setup.solve(60.0)
    assert setup.haveExactSolutionPath(), "expected a path, found none within a minute"
    setup.simplifySolution()
    return setup.getSolutionPath().getStates()


def main():
    util.setLogLevel(util.LOG_WARN)
    util.RNG.setSeed(1)
    robot = arm_in_cell(ARM)
    checker = Checker(robot, GROUP)
    setup = geometric.SimpleSetup(checker.space())
    setup.setStateValidityChecker(checker.is_valid)
    information = setup.getSpaceInformation()
    discrete, certified = information.getMotionValidator(), Certified(information, checker)
    information.setMotionValidator(certified)
    information.setup()

    start, goal = state_of(information, START), state_of(information, GOAL)
    for planner in (geometric.RRTConnect(information), geometric.PRM(information)):
        q = np.array([checker.q(state) for state in plan(setup, planner, start, goal)])
        assert robot.is_free(q[:-1], q[1:]).all()
        print(f"{planner.getName()}: {len(q) - 1} edges, all of them certainly free")

    # Edges between valid states, half of them long, half short.
    rng, (low, high) = np.random.default_rng(1), np.clip(robot.limits[checker.places], -np.pi, np.pi).T
    starts = rng.uniform(low, high, (4 * EDGES, len(low)))
    ends = rng.uniform(low, high, starts.shape)
    ends[::2] = starts[::2] + 0.1 * (ends[::2] - starts[::2])
    edges = [(state_of(information, start), state_of(information, end)) for start, end in zip(starts, ends)]
    edges = [edge for edge in edges if all(map(information.isValid, edge))][:EDGES]
    # All of them in one call, on all cores, and then one by one, as OMPL does it.
    q0, q1 = (np.array([checker.q(edge[end]) for edge in edges]) for end in (0, 1))
    is_free = robot.is_free(q0, q1, parallel=True)
    assert is_free.tolist() == [certified.checkMotion(*edge) for edge in edges]
    for share in (0.01, 0.001):
        information.setStateValidityCheckingResolution(share)
        information.setup()
        accepted = np.array([discrete.checkMotion(*edge) for edge in edges])
        # What is certainly free is free at all states in between.
        assert accepted[is_free].all()
        missed = np.flatnonzero(accepted & ~is_free)
        for number in missed:
            found = robot.motion(*map(checker.q, edges[number]))
            assert found.kind != cbvh.MotionKind.FREE
            # A configuration in contact, or one with a gap below the tolerance, which OMPL would have to hit by chance.
            assert robot.distance(found.joints).distance <= (0 if found.kind == cbvh.MotionKind.HIT else 1e-5)
        print(f"states at {share:.1%} of the extent: of {EDGES} edges, {(~is_free).sum()} touch, and {len(missed)} of these pass")
        assert share < 0.01 or len(missed)


if __name__ == "__main__":
    main()
