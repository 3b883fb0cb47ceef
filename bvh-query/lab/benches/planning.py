"""Plans with OMPL's RRT-Connect among boxes and cylinders: certain edges beside states at intervals by Pinocchio with Coal.

    pip install pin ompl example-robot-data, and the module cbvh
    RAYON_NUM_THREADS=1 taskset -c 1 python planning.py EDGES ENDS [--seeds 10] [--patience 60] [--ways cbvh pairs tree fine]
    RAYON_NUM_THREADS=1 taskset -c 1 python planning.py EDGES ENDS --check PATHS [--step 0.001]

`src/scenes.rs` says what is in EDGES, and `planning.rs` what is in ENDS, and in PATHS, which it writes. The planner has its default range on
both sides, a fifth of the extent of the space, and the same seeds. A validator at intervals has OMPL's default as well, a
hundredth of the extent, or a thousandth. Pinocchio is called pair by pair, as most do, or with the tree of its broad phase. The
time of a run is CPU time, and so is the part of it in calls of cbvh or Pinocchio alone, without what calls them from OMPL.
"""

import argparse
import time
from collections import Counter

import coal
import numpy as np
import pinocchio
from ompl import base, geometric, util

import cbvh
from robots import Pinocchio, files_of

# A way asks cbvh for certain edges, or Pinocchio, pair by pair or with its tree, about states that are this part of the extent apart.
WAYS = {"cbvh": None, "pairs": 0.01, "tree": 0.01, "fine": 0.001}
# Of a cylinder's radius.
CYLINDER_ERROR = 0.001
# The joint after those that move: open fingers.
OPEN = 0.04


def pose_of(rows):
    """The pose of rows that were rounded to some digits: the nearest rotation."""
    pose = np.eye(4)
    pose[:3] = np.reshape(rows, (3, 4))
    u, _, v = np.linalg.svd(pose[:3, :3])
    pose[:3, :3] = u @ v
    return pose


def scenes_of(edges, ends):
    """For each scene its kind and number, its boxes and cylinders (poses and sizes), and the first joint values of both ends."""
    of_ends = {}
    with open(ends, encoding="ascii") as lines:
        for kind, number, *values in map(str.split, lines):
            of_ends[kind, number] = np.array(values, dtype=float).reshape(2, -1)
    with open(edges, encoding="ascii") as lines:
        for head in lines:
            kind, number, boxes, cylinders, configurations, others = head.split()
            rows = [np.array(next(lines).split(), dtype=float) for _ in range(int(boxes) + int(cylinders))]
            for _ in range(int(configurations) + int(others)):
                next(lines)
            yield ((kind, number), [(pose_of(row[:12]), row[12:]) for row in rows], of_ends[kind, number])


class Scene:
    """An arm among obstacles for cbvh and for Pinocchio."""

    def __init__(self, arm, name, obstacles, ends):
        self.name, self.size = name, ends.shape[1]
        self.robot, others = arm.copy(), []
        for number, (pose, sizes) in enumerate(obstacles):
            if len(sizes) == 3:
                mesh, shape = cbvh.box(2 * sizes), coal.Box(*(2 * sizes))
            else:
                mesh = cbvh.cylinder(*sizes, max_error=CYLINDER_ERROR * sizes[0])
                shape = coal.Cylinder(*sizes)
            self.robot.add_obstacle(mesh, pose, name=f"obstacle {number}")
            others.append((f"obstacle {number}", shape, pose))
        for end in ends:
            # A finger may touch what it grasps there.
            for pair in self.robot.pairs_in_contact(self.of_cbvh(end)):
                self.robot.allow(*pair)
        self.other = other = Pinocchio("panda", self.robot, others)
        self.tree = pinocchio.BroadPhaseManager_DynamicAABBTreeCollisionManager(
            other.model, other.geometry, other.results
        )
        self.places, self.ends = other.places, ends
        low, high = self.robot.limits[: self.size].T
        self.limits = np.transpose([np.minimum(low, ends.min(0)), np.maximum(high, ends.max(0))])

    def of_cbvh(self, values):
        return [*values, OPEN]

    def of_pinocchio(self, values):
        configuration = np.empty(self.other.model.nq)
        configuration[self.places] = [*values, OPEN]
        return configuration

    def pair_by_pair(self, configuration):
        of = self.other
        return pinocchio.computeCollisions(of.model, of.data, of.geometry, of.results, configuration, True)

    def with_tree(self, configuration):
        return pinocchio.computeCollisions(self.other.model, self.other.data, self.tree, configuration, True)


def arm():
    """The arm, with the balls of its links, which are made once."""
    urdf, srdf, share = files_of("panda")
    robot = cbvh.Robot.from_urdf(urdf, [share], srdf)
    robot.is_free(*[[0.0] * len(robot.joints)] * 2)
    return robot


class Timed:
    """A question that counts how often it is asked, and CPU time in seconds."""

    def __init__(self, ask):
        self.ask, self.seconds, self.calls = ask, 0.0, 0

    def __call__(self, *of):
        start = time.process_time_ns()
        answer = self.ask(*of)
        self.seconds += 1e-9 * (time.process_time_ns() - start)
        self.calls += 1
        return answer


class Certified(base.MotionValidator):
    def __init__(self, information, scene, is_free):
        super().__init__(information)
        self.scene, self.is_free, self.joints = scene, is_free, range(scene.size)

    def checkMotion(self, start, end):
        a, b = (self.scene.of_cbvh(state[k] for k in self.joints) for state in (start, end))
        return self.is_free(a, b)


def plan(scene, way, seed, patience):
    """A path, or none, and milliseconds in all, in calls about states and edges, and how many of both there were."""
    joints = range(scene.size)
    space, bounds = base.RealVectorStateSpace(scene.size), base.RealVectorBounds(scene.size)
    for k, (low, high) in enumerate(scene.limits):
        bounds.setLow(k, low)
        bounds.setHigh(k, high)
    space.setBounds(bounds)
    setup = geometric.SimpleSetup(space)
    information = setup.getSpaceInformation()
    convert = scene.of_pinocchio if WAYS[way] else scene.of_cbvh
    ask = {"cbvh": scene.robot.collide, "pairs": scene.pair_by_pair}.get(way, scene.with_tree)
    collide, is_free = Timed(ask), Timed(scene.robot.is_free)
    setup.setStateValidityChecker(lambda state: not collide(convert([state[k] for k in joints])))
    certified = Certified(information, scene, is_free)
    if WAYS[way]:
        information.setStateValidityCheckingResolution(WAYS[way])
    else:
        information.setMotionValidator(certified)
    information.setup()
    start, goal = information.allocState(), information.allocState()
    for state, values in zip((start, goal), scene.ends):
        for k, value in enumerate(values):
            state[k] = value
    setup.setStartAndGoalStates(start, goal)
    # The generators of a planner are seeded when it is made.
    util.RNG.setSeed(seed)
    setup.setPlanner(geometric.RRTConnect(information))
    setup.setup()
    begin = time.process_time()
    setup.solve(patience)
    seconds = time.process_time() - begin
    path = None
    if setup.haveExactSolutionPath():
        path = np.array([[state[k] for k in joints] for state in setup.getSolutionPath().getStates()])
    asked = collide.seconds + is_free.seconds
    return path, (1e3 * seconds, 1e3 * asked, collide.calls, is_free.calls)


def free(scene, path):
    """Which edges of a path are certainly free."""
    whole = np.array([scene.of_cbvh(state) for state in path])
    return scene.robot.is_free(whole[:-1], whole[1:])


def touching(scene, start, end, step):
    """How many states of an edge touch for Pinocchio, and how many there are."""
    shares = np.linspace(0, 1, int(np.ceil(np.linalg.norm(end - start) / step)) + 1)
    states = [scene.of_pinocchio(start + share * (end - start)) for share in shares]
    return sum(map(scene.with_tree, states)), len(states)


def end_of(scene, path, step):
    """Whether a path is certainly free and, if it is not, whether any state of it touches for Pinocchio."""
    uncertain = np.flatnonzero(~free(scene, path))
    if len(uncertain) == 0:
        return "certain"
    is_touching = any(touching(scene, *path[k : k + 2], step)[0] for k in uncertain)
    return "touches" if is_touching else "uncertain"


def measure(options):
    found, ends = ({way: [] for way in options.ways} for _ in range(2))
    robot = arm()
    print("kind number: medians of ms in all (in calls; states, edges) of", ", ".join(found))
    for number, of in enumerate(scenes_of(options.edges, options.ends)):
        if number % options.every:
            continue
        scene = Scene(robot, *of)
        cells = []
        for way in found:
            rows = []
            for seed in range(1, options.seeds + 1):
                path, row = plan(scene, way, seed, options.patience)
                rows.append(row)
                ends[way].append("no path" if path is None else end_of(scene, path, options.step))
            found[way].append(rows)
            ms, asked, states, edges = np.median(rows, axis=0)
            cells.append(f"{ms:.2f} ({asked:.2f}; {states:.0f}, {edges:.0f})")
        print(f"{' '.join(scene.name)}: {', '.join(cells)}", flush=True)
    for way, rows in found.items():
        rows = np.array(rows)
        scenes = np.median(rows, axis=1)
        print(
            f"{way}: of all runs, median and mean {np.median(rows[..., 0]):.2f} {rows[..., 0].mean():.2f} ms, in calls "
            f"{np.median(rows[..., 1]):.3f} {rows[..., 1].mean():.3f}; of the medians of scenes {np.median(scenes[:, 0]):.2f} "
            f"{scenes[:, 0].mean():.2f}, in calls {np.median(scenes[:, 1]):.3f} {scenes[:, 1].mean():.3f}; "
            f"{rows[..., 2].mean():.0f} states and {rows[..., 3].mean():.0f} edges in the mean; {dict(Counter(ends[way]))}"
        )


def check(options):
    """Looks at states of paths with Pinocchio, and asks cbvh about their edges."""
    robot = arm()
    scenes = {name: Scene(robot, name, *of) for name, *of in scenes_of(options.edges, options.ends)}
    paths = touches = uncertain = states = 0
    with open(options.check, encoding="ascii") as lines:
        for head in lines:
            kind, number, seed, count = head.split()
            path = np.array([np.array(next(lines).split(), dtype=float) for _ in range(int(count))])
            if int(seed) > options.seeds:
                continue
            scene = scenes[kind, number]
            uncertain += not free(scene, path).all()
            assert np.array_equal(path[[0, -1]], scene.ends), "a path from start to goal"
            found = np.array([touching(scene, a, b, options.step) for a, b in zip(path[:-1], path[1:])])
            touches += (found[:, 0] > 0).sum()
            states += found[:, 1].sum()
            paths += 1
    print(f"{paths} paths, {states} states: {touches} edges touch, {uncertain} paths are not certain")


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("edges")
    parser.add_argument("ends")
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--ways", nargs="*", choices=list(WAYS), default=["cbvh", "pairs", "tree"])
    parser.add_argument("--every", type=int, default=1, help="the number of scenes from one to the next")
    parser.add_argument("--patience", type=float, default=60.0, help="seconds that a planner may take")
    parser.add_argument("--check", metavar="PATHS", help="checks these paths instead")
    parser.add_argument("--step", type=float, default=0.001, help="radians between the states that are checked")
    options = parser.parse_args()
    util.setLogLevel(util.LOG_NONE)
    if options.check:
        check(options)
    else:
        measure(options)


if __name__ == "__main__":
    main()
