"""How do threads and processes share a mesh?

It prints:

    [278, 272, 280, 276, 262, 293, 303, 299] in all: 2263
    the same answers: True
"""

from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor

import numpy as np

import cbvh


def count_in_contact(pair, poses):
    """How many poses touch. Meshes of files are pickled by path: processes map the same file, which is in memory once."""
    room, robot = pair
    return int(room.collide(robot, poses).sum())


if __name__ == "__main__":
    pair = cbvh.bake_files("testdata/fclenv.obj", "room.cbvh"), cbvh.bake_files("testdata/fclrob.obj", "robot.cbvh")
    places = np.random.default_rng(1).uniform([-2500, -2500, -400], [2500, 2500, 2000], (8, 500, 3))
    shares = [cbvh.pose(share) for share in places]

    alone = [count_in_contact(pair, share) for share in shares]
    with ThreadPoolExecutor(4) as pool:  # queries run beside other threads of Python
        threads = list(pool.map(count_in_contact, [pair] * 8, shares))
    with ProcessPoolExecutor(2) as pool:
        processes = list(pool.map(count_in_contact, [pair] * 8, shares))
    print(alone, "in all:", sum(alone))
    print("the same answers:", alone == threads == processes)
