"""OMPL plans paths for a rigid body, and each edge of a path is certified: free at every moment, not at samples.

    pip install ompl
    python examples/ompl_planner.py

The checker of states asks `Mesh.within`, and the validator of motions asks `Mesh.is_free`. RRT-Connect brings the
robot of testdata from one end of its environment to the other. All edges of a path are then checked again in one call,
and compared with the states that OMPL interpolates. The same is done with OMPL's own validator, which looks at states at intervals, and
may accept edges that come too near to a wall.
"""

import pathlib
import tempfile
import time

import numpy as np
from ompl import base, geometric, util

import cbvh

TESTDATA = pathlib.Path(__file__).resolve().parents[3] / "testdata"
# The box of the robot's positions, how far its corners are from its origin, and how near it may come, in mesh units.
LOW, HIGH, SIZE, CLEARANCE = [-3000, -3000, 0], [3000, 3000, 3000], 890, 9
PATHS = 3


def pose_of(state):
    """The pose of a state (body to world), shape (4, 4)."""
    turn = state.rotation()
    quaternion = np.array([turn.x, turn.y, turn.z, turn.w])
    return cbvh.pose([state.getX(), state.getY(), state.getZ()], quaternion / np.linalg.norm(quaternion))


class Certified(base.MotionValidator):
    """Accepts a motion if the robot stays farther from the walls than the clearance at every moment."""

    def __init__(self, information, walls, robot):
        super().__init__(information)
        self.walls, self.robot = walls, robot

    def checkMotion(self, start, end):
        try:
            # The origin moves on a line, and the rotation is a slerp over the shorter arc: just what OMPL interpolates.
            motion = cbvh.Motion.between(pose_of(start), pose_of(end))
        except ValueError:
            return False  # Half a turn apart: neither arc is shorter.
        return self.walls.is_free(self.robot, motion, clearance=CLEARANCE)


def valid_ends(information):
    """Two valid states at opposite ends of the box."""
    ends, sampler, state = [], information.allocStateSampler(), information.allocState()
    while len(ends) < 2:
        sampler.sampleUniform(state)
        share = (state.getX() - LOW[0]) / (HIGH[0] - LOW[0])
        if (share > 0.9 if ends else share < 0.1) and information.isValid(state):
            ends.append(information.cloneState(state))
    return ends


def plan(setup, walls, robot):
    """Plans a path. Returns how many edges it has, how many of them are free at every moment, and how long it took."""
    setup.clear()
    start = time.perf_counter()
    setup.solve(60.0)
    assert setup.haveExactSolutionPath(), "expected a path, found none within a minute"
    setup.simplifySolution()
    seconds = time.perf_counter() - start
    path = setup.getSolutionPath()
    states = path.getStates()
    poses = np.array([pose_of(state) for state in states])
    edges = cbvh.Motion.between(poses[:-1], poses[1:])
    # All edges in one call, and then one by one, as the validator checks them.
    is_free = walls.is_free(robot, edges, clearance=CLEARANCE)
    assert is_free.tolist() == [walls.is_free(robot, edge, clearance=CLEARANCE) for edge in edges]
    # OMPL interpolates what was asked about, and its states on free edges are farther from walls than the clearance.
    state = setup.getStateSpace().allocState()
    for number, t in np.ndindex(len(edges), 101):
        setup.getStateSpace().interpolate(states[number], states[number + 1], t / 100, state)
        off = np.abs(edges[number].pose(t / 100) - pose_of(state))
        assert np.all(off <= 1e-12 * np.array([1, 1, 1, max(HIGH)]))
        assert not (is_free[number] and walls.within(robot, pose_of(state), CLEARANCE))
    return len(edges), is_free.sum(), seconds


def main(folder):
    util.setLogLevel(util.LOG_WARN)
    util.RNG.setSeed(2)
    walls = cbvh.bake_files(TESTDATA / "fclenv.obj", folder / "walls.cbvh")
    robot = cbvh.bake_files(TESTDATA / "fclrob.obj", folder / "robot.cbvh")
    space, box = base.SE3StateSpace(), base.RealVectorBounds(3)
    for axis in range(3):
        box.setLow(axis, LOW[axis])
        box.setHigh(axis, HIGH[axis])
    space.setBounds(box)
    space.setSubspaceWeight(1, SIZE)  # A distance of states is a sum of a length and an angle.
    setup = geometric.SimpleSetup(space)
    information = setup.getSpaceInformation()
    setup.setStateValidityChecker(lambda state: not walls.within(robot, pose_of(state), CLEARANCE))
    information.setup()
    sampled, certified = information.getMotionValidator(), Certified(information, walls, robot)
    planner = geometric.RRTConnect(information)
    planner.setRange(4 * SIZE)
    setup.setPlanner(planner)
    setup.setStartAndGoalStates(*valid_ends(information))
    for name, validator in (("certified", certified), ("at intervals", sampled)):
        information.setMotionValidator(validator)
        edges, free, seconds = np.sum([plan(setup, walls, robot) for _ in range(PATHS)], axis=0)
        print(f"{name}: {PATHS} paths in {seconds:.1f} s; {free:.0f} of {edges:.0f} edges are free at every moment")
        assert validator is sampled or free == edges > 0


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as place:
        main(pathlib.Path(place))
