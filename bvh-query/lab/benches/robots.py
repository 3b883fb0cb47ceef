"""Times certain edges of robots beside Pinocchio with Coal and states at intervals, and checks the answers of both.

    pip install pin ompl example-robot-data, and the module cbvh
    RAYON_NUM_THREADS=1 taskset -c 0 python robots.py [ARM ...] [--edges 20000] [--timed 300] [--runs 11] [--planners RRTConnect PRM]

The arms and their cell are those of the examples (`python/examples/_cell.py`). Pinocchio has the same boxes and meshes, and
the same pairs. An edge is straight between two free configurations; every second one is a tenth as long. A validator at
intervals looks at states as OMPL's does: so many that two are at most a share of the extent of the space apart, the far end
first, and then halves of halves. Misses are counted with the states that cbvh refuses, which are compared with Pinocchio's.
"""

import argparse
import pathlib
import sys
import time

import coal
import numpy as np
import pinocchio
from ompl import base, geometric, util

import cbvh

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "python" / "examples"))
from _cell import arm_in_cell, cell, files_of  # noqa: E402

SHARES = (0.01, 0.001)
# What RRT-Connect plans from and to: a hand in the hoop, and one in the shelf or the bin.
ENDS = {
    "panda": ([1.43, -1.55, -0.11, -0.93, -2.6, 0.21, 1.79, 0.02], [2.87, -0.69, 2.81, -1.28, 1.65, 0.86, 0.34, 0.02]),
    "xarm7": ([-1.36, 1.01, -1.42, 2.89, -2.37, 0.32, 1.32], [1.47, 1.53, -1.55, 3.01, -0.38, -0.91, -0.09]),
    "ur5": ([1.93, -2.18, -0.84, -0.37, -0.73, 3.06], [0.15, -1.27, 1.46, -1.09, -2.33, 2.84]),
}


class Pinocchio:
    """The arm among obstacles for Pinocchio, those of the cell unless given, with the pairs that the robot of cbvh asks about."""

    def __init__(self, arm, robot, obstacles=None):
        urdf, _, share = files_of(arm)
        self.model = model = pinocchio.buildModelFromUrdf(str(urdf), mimic=True)
        self.data = model.createData()
        kind = pinocchio.GeometryType.COLLISION
        self.geometry = of = pinocchio.buildGeomFromUrdf(model, str(urdf), kind, package_dirs=[share])
        body = [model.frames[part.parentFrame].name for part in of.geometryObjects]
        for name, shape, pose in self.cell() if obstacles is None else obstacles:
            of.addGeometryObject(pinocchio.GeometryObject(name, 0, pinocchio.SE3(pose), shape))
            body.append(name)
        asked = {frozenset(pair) for pair in robot.pairs}
        for a in range(len(body)):
            for b in range(a + 1, len(body)):
                if frozenset((body[a], body[b])) in asked:
                    of.addCollisionPair(pinocchio.CollisionPair(a, b))
        assert {frozenset((body[pair.first], body[pair.second])) for pair in of.collisionPairs} == asked
        self.results = of.createData()
        for request in self.results.collisionRequests:
            request.break_distance = request.security_margin = 0.0
        self.places = [model.joints[model.getJointId(name)].idx_q for name in robot.joints]
        assert model.nq == len(self.places)

    @classmethod
    def cell(cls):
        return [(name, coal.Box(*of) if len(of) == 3 else cls.mesh(*of), pose) for name, of, pose in cell()]

    @staticmethod
    def mesh(vertices, faces):
        mesh = coal.BVHModelOBBRSS()
        mesh.beginModel(len(faces), len(vertices))
        mesh.addVertices(np.asarray(vertices, dtype=float))
        for face in faces.tolist():
            mesh.addTriangle(*np.asarray(vertices)[face])
        mesh.endModel()
        return mesh

    def collide(self, q):
        configuration = np.empty(len(q))
        configuration[self.places] = q
        return pinocchio.computeCollisions(self.model, self.data, self.geometry, self.results, configuration, True)


def halves(count):
    """The numbers from 1 to count - 1, the middle first, as OMPL asks about them."""
    order, todo = [], [(1, count - 1)]
    for first, last in todo:
        if first <= last:
            middle = (first + last) // 2
            order.append(middle)
            todo += [(first, middle - 1), (middle + 1, last)]
    return order


def at_intervals(start, end, step):
    """The states of an edge that a validator looks at."""
    count = max(int(np.ceil(np.linalg.norm(end - start) / step)), 1)
    return np.array([end] + [start + k / count * (end - start) for k in halves(count)])


def timed(ask, edges):
    """CPU time of each question in microseconds, and the answers. Other work on the machine does not count."""
    times, answers = [], []
    for edge in edges:
        begin = time.process_time()
        answers.append(ask(*edge))
        times.append(1e6 * (time.process_time() - begin))
    return np.array(times), np.array(answers)


def edges_of(robot, low, high, count):
    rng = np.random.default_rng(1)
    starts, ends = rng.uniform(low, high, (2, 8 * count, len(low)))
    ends[1::2] = starts[1::2] + 0.1 * (ends[1::2] - starts[1::2])
    free = ~(robot.collide(starts) | robot.collide(ends))
    kept = np.sort(np.concatenate([np.flatnonzero(free[parity::2])[: count // 2] * 2 + parity for parity in (0, 1)]))
    return starts[kept], ends[kept], kept % 2 == 1


def measure_edges(robot, other, low, high, options):
    extent = np.linalg.norm(high - low)
    starts, ends, is_short = edges_of(robot, low, high, options.edges)
    print(f"  {len(starts)} edges; extent {extent:.2f}; pairs {len(robot.pairs)}")
    begin = time.process_time()
    free = np.array([robot.is_free(start, end) for start, end in zip(starts, ends)])
    print(f"  cbvh, all edges: mean {1e6 * (time.process_time() - begin) / len(starts):.0f} us")
    for share in SHARES:
        passed = np.array([not robot.collide(at_intervals(a, b, share * extent)).any() for a, b in zip(starts, ends)])
        assert passed[free].all(), "a free edge touches"
        for name, of in (("long", ~is_short), ("short", is_short)):
            missed = (passed & ~free & of).sum()
            print(f"  {name} edges, states at {share:.1%}: {(~free & of).sum()} not free of {of.sum()}, {missed} missed")

    # Timed beside Pinocchio, in turns.
    chosen = np.random.default_rng(2).permutation(len(starts))[: options.timed]
    edges = [(starts[k], ends[k]) for k in chosen]
    ways = {"cbvh, certain": lambda a, b: robot.is_free(a, b)}
    for share in SHARES:
        step = share * extent
        ways[f"Pinocchio, {share:.1%}"] = lambda a, b, step=step: not any(map(other.collide, at_intervals(a, b, step)))
        ways[f"cbvh, {share:.1%}"] = lambda a, b, step=step: not robot.collide(at_intervals(a, b, step)).any()
    ways["the states alone, 0.1%"] = lambda a, b: len(at_intervals(a, b, SHARES[1] * extent)) > 0
    short, found = is_short[chosen], {}
    for way, ask in ways.items():
        rounds = [timed(ask, edges) for _ in range(3)]
        times, found[way] = np.min([times for times, _ in rounds], axis=0), rounds[0][1]
        cells = [f"{np.median(times[of]):.0f} ({times[of].mean():.0f})" for of in (~short & free[chosen], ~short & ~free[chosen], short)]
        print(f"  {way}: us, median (mean): long and free {cells[0]}, long and not free {cells[1]}, short {cells[2]}")
    for share in SHARES:
        differ = (found[f"Pinocchio, {share:.1%}"] != found[f"cbvh, {share:.1%}"]).sum()
        print(f"  answers of Pinocchio and of cbvh at {share:.1%} that differ: {differ}")

    # Free edges at 20,000 states each, and what stops the others.
    wrong, looked = 0, np.flatnonzero(free)[:: max(free.sum() // options.proved, 1)][: options.proved]
    for k in looked:
        wrong += any(other.collide(starts[k] + t * (ends[k] - starts[k])) for t in np.linspace(0, 1, 20_000))
    print(f"  {len(looked)} free edges at 20,000 states each by Pinocchio: {wrong} touch")
    kinds, wrong = {}, 0
    for k in np.flatnonzero(~free)[:2000]:
        motion = robot.motion(starts[k], ends[k])
        kinds[motion.kind.name] = kinds.get(motion.kind.name, 0) + 1
        if motion.kind == cbvh.MotionKind.HIT:
            # The first moment found, at which shapes hardly touch: Coal may need some more.
            times = np.minimum(motion.touching_at + np.array([0, 1e-9, 1e-8, 1e-7, 1e-6, 1e-5, 1e-4]), 1)
            along = starts[k] + times[:, None] * (ends[k] - starts[k])
            wrong += not (robot.collide(motion.joints) and any(map(other.collide, along)))
        else:
            wrong += not motion.distance < 4e-6
    print(f"  edges not free, by kind {kinds}: {wrong} without a touching state by both, or a gap below the tolerance")


class Certified(base.MotionValidator):
    def __init__(self, information, robot):
        super().__init__(information)
        self.robot, self.size = robot, len(robot.joints)

    def checkMotion(self, start, end):
        a, b = ([state[k] for k in range(self.size)] for state in (start, end))
        return self.robot.is_free(a, b)


def measure_paths(arm, robot, other, low, high, planner, options):
    size, seconds, free = len(low), {}, {}
    ways = {"cbvh, certain": None} | {f"Pinocchio, {share:.1%}": share for share in SHARES}
    for _ in range(options.runs):
        for way, share in ways.items():
            space, bounds = base.RealVectorStateSpace(size), base.RealVectorBounds(size)
            for k in range(size):
                bounds.setLow(k, low[k])
                bounds.setHigh(k, high[k])
            space.setBounds(bounds)
            setup = geometric.SimpleSetup(space)
            information = setup.getSpaceInformation()
            collide = other.collide if share else robot.collide
            setup.setStateValidityChecker(lambda state: not collide(np.array([state[k] for k in range(size)])))
            if share:
                information.setStateValidityCheckingResolution(share)
            else:
                certified = Certified(information, robot)
                information.setMotionValidator(certified)
            information.setup()
            start, goal = information.allocState(), information.allocState()
            for state, values in zip((start, goal), ENDS[arm]):
                for k, value in enumerate(values):
                    state[k] = value
            setup.setStartAndGoalStates(start, goal)
            setup.setPlanner(getattr(geometric, planner)(information))
            begin = time.process_time()
            setup.solve(options.patience)
            if not setup.haveExactSolutionPath():
                continue
            planned = time.process_time() - begin
            setup.simplifySolution()
            q = np.array([[state[k] for k in range(size)] for state in setup.getSolutionPath().getStates()])
            seconds.setdefault(way, []).append((planned, time.process_time() - begin))
            free.setdefault(way, []).append(robot.is_free(q[:-1], q[1:]).all())
    for way in ways:
        found = len(seconds.get(way, []))
        if found == 0:
            print(f"  {planner}, {way}: no path within {options.patience:.0f} s in {options.runs} runs")
            continue
        planned, whole = np.median(seconds[way], axis=0)
        print(f"  {planner}, {way}: {planned:.2f} s planned, {whole:.2f} s with shortening, in {found} of {options.runs} runs; "
              f"{sum(free[way])} of these paths are certainly free")  # fmt: skip


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("arms", nargs="*", default=list(ENDS))
    for name, number in (("edges", 20_000), ("timed", 300), ("runs", 11), ("proved", 50)):
        parser.add_argument(f"--{name}", type=int, default=number)
    parser.add_argument("--patience", type=float, default=60.0, help="seconds that a planner may take")
    parser.add_argument("--planners", nargs="*", default=["RRTConnect", "PRM"])
    options = parser.parse_args()
    util.setLogLevel(util.LOG_WARN)
    for arm in options.arms:
        robot = arm_in_cell(arm)
        other, limits = Pinocchio(arm, robot), np.clip(robot.limits, -np.pi, np.pi)
        print(arm)
        if options.edges:
            measure_edges(robot, other, limits[:, 0], limits[:, 1], options)
        for planner in options.planners if options.runs else []:
            measure_paths(arm, robot, other, limits[:, 0], limits[:, 1], planner, options)
        sys.stdout.flush()


if __name__ == "__main__":
    main()
