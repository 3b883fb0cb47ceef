"""A small trajectory optimiser pulls an arm out of a shelf, with the signed distances of near pairs and their derivatives.

    pip install scipy example-robot-data
    python examples/optimise_trajectory.py

The straight path goes through the upper board. The cost of a path is how much it bends, and how much nearer than a margin
any two bodies are at some moments, which `Robot.near_pairs` tells. scipy's L-BFGS-B lowers the cost within the limits of
the joints. A path of low cost may still touch something between those moments. `Robot.motion` finds where it does, this
moment joins the others, and scipy goes on, until `Robot.is_free` certifies each edge: free at every moment.
"""

import time

import numpy as np
from scipy.optimize import minimize

import cbvh
from _cell import arm_in_cell

ARM, GROUP = "panda", "arm"
# From between the boards of the shelf to above it.
START, GOAL = [0.23, 0.2, 0.18, -2.06, 0.08, 3.6, 1.16], [-0.63, -0.18, 0.16, -1.09, -0.29, 2.08, 0.78]
# The margin is in metres. Nearness weighs this many times as much as bending, in square radians per square metre.
EDGES, MARGIN, WEIGHT, ROUNDS = 16, 0.05, 100, 20


class Optimiser:
    """The cost of a path of a group of joints: an array with one row for each end of an edge."""

    def __init__(self, robot, group):
        self.robot, self.still = robot, robot.q()
        self.places = [robot.joints.index(name) for name in robot.groups[group]]
        self.limits = robot.limits[self.places]
        self.second_differences = np.diff(np.eye(EDGES + 1), n=2, axis=0)
        # The weights of the rows of a path at each moment: at first the middles and the ends of the edges.
        self.moments = np.zeros((0, EDGES + 1))
        for edge, t in np.ndindex(EDGES, 2):
            self.add_moment(edge, (t + 1) / 2)

    def add_moment(self, edge, t):
        row = np.zeros(EDGES + 1)
        row[edge : edge + 2] = 1 - t, t
        self.moments = np.vstack([self.moments, row])

    def q(self, path):
        """Configurations of the robot, whose other joints stand still."""
        q = np.tile(self.still, (len(path), 1))
        q[:, self.places] = path
        return q

    def cost(self, path):
        """The cost of a path, and its derivative by each number of it."""
        bend = self.second_differences @ path
        near = self.robot.near_pairs(self.q(self.moments @ path), MARGIN, parallel=True)
        lack = MARGIN - near.distance
        slope = np.zeros((len(self.moments), len(self.places)))
        np.add.at(slope, near.row, -2 * lack[:, None] * near.gradient[:, self.places])
        cost = np.sum(bend**2) + WEIGHT * np.sum(lack**2)
        return cost, 2 * self.second_differences.T @ bend + WEIGHT * self.moments.T @ slope

    def lower(self, path):
        """A path of lower cost between the same ends, within the limits of the joints."""

        def with_ends(inner):
            return np.vstack([path[0], inner.reshape(-1, len(self.places)), path[-1]])

        def cost(inner):
            cost, slope = self.cost(with_ends(inner))
            return cost, slope[1:-1].ravel()

        bounds = np.tile(self.limits, (EDGES - 1, 1))
        found = minimize(cost, path[1:-1].ravel(), jac=True, method="L-BFGS-B", bounds=bounds, options={"maxiter": 100})
        return with_ends(found.x)

    def check_derivative(self, path, tolerance):
        """Compares the derivative with central differences along random directions."""
        cost, slope = self.cost(path)
        assert cost > 0, "expected a path near something"
        for direction in np.random.default_rng(1).normal(size=(3, *path.shape)):
            direction /= np.linalg.norm(direction)
            before, after = (self.cost(path + step * direction)[0] for step in (-1e-6, 1e-6))
            off = abs((after - before) / 2e-6 - np.sum(slope * direction)) / np.linalg.norm(slope)
            assert off <= tolerance, f"expected at most {tolerance} of the slope, found {off}"


def main():
    robot = arm_in_cell(ARM)
    robot.allow("panda_link0", "table")  # It stands there, nearer than the margin.
    optimiser = Optimiser(robot, GROUP)
    path = np.linspace(START, GOAL, EDGES + 1)
    q = optimiser.q(path)
    is_free = robot.is_free(q[:-1], q[1:])
    first, found = robot.first_hit(q)
    assert not is_free.all() and robot.collide(found.joints)
    print(f"straight: {np.sum(~is_free)} of {EDGES} edges are not free; first, {' and '.join(found.bodies)} touch")

    # The edges before that hit are free. Depths have derivatives, too, but are found within one per cent.
    optimiser.check_derivative(np.linspace(path[0], path[first], EDGES + 1), 1e-6)
    optimiser.check_derivative(path, 2e-3)

    start = time.perf_counter()
    for number in range(1, ROUNDS + 1):
        path = optimiser.lower(path)
        q = optimiser.q(path)
        is_free = robot.is_free(q[:-1], q[1:])
        print(f"round {number}: {len(optimiser.moments)} moments, {np.sum(~is_free)} edges are not free")
        if is_free.all():
            break
        for edge in np.flatnonzero(~is_free):
            found = robot.motion(q[edge], q[edge + 1])
            assert found.kind != cbvh.MotionKind.FREE
            optimiser.add_moment(edge, found.touching_at)
    seconds = time.perf_counter() - start

    assert is_free.all()
    assert np.all(path[[0, -1]] == [START, GOAL])
    assert np.all((optimiser.limits[:, 0] <= path) & (path <= optimiser.limits[:, 1]))
    # What is certain at every moment holds at samples.
    t = np.linspace(0, 1, 51)[:, None, None]
    gap = robot.distance(((1 - t) * q[:-1] + t * q[1:]).reshape(-1, len(robot.joints))).distance.min()
    assert gap > 0
    print(f"all edges are certainly free after {seconds:.1f} s; at samples, bodies are at least {1000 * gap:.1f} mm apart")


if __name__ == "__main__":
    main()
