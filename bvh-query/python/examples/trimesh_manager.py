"""A trimesh user's code, moved from python-fcl to cbvh: another manager, the same calls, the same answers.

    pip install trimesh python-fcl
    python examples/trimesh_manager.py

`ask` is the user's code, and takes either manager. Robots of testdata stand between walls and move; others are asked
about. Without python-fcl, trimesh has no manager to compare with, and cbvh answers alone.
"""

import pathlib
import time

import numpy as np
import trimesh

import cbvh

TESTDATA = pathlib.Path(__file__).resolve().parents[3] / "testdata"


def load(name):
    """A mesh of testdata. Both managers hold its vertices as they are."""
    return trimesh.load_mesh(TESTDATA / name, process=False)


def places(seed, count):
    """Transforms of robots between the walls, shape (count, 4, 4)."""
    numbers = np.random.default_rng(seed)
    transforms = np.array([trimesh.transformations.random_rotation_matrix(numbers.random(3)) for _ in range(count)])
    transforms[:, :3, 3] = numbers.uniform([-2800, -2800, 200], [2800, 2800, 2800], (count, 3))
    return transforms


def ask(make_manager, walls, robot):
    """Asks all that managers answer. Returns what was asked and the answers."""
    answers = []
    manager, visitors = make_manager(), make_manager()
    manager.add_object("walls", walls)
    for number, transform in enumerate(places(1, 6)):
        manager.add_object(f"robot {number}", robot, transform)
    for number, transform in enumerate(places(2, 4)):
        visitors.add_object(f"visitor {number}", robot, transform)
    for number, transform in enumerate(places(3, 30)):
        manager.set_transform(f"robot {number % 6}", transform)
        answers.append(("in_collision_internal", manager.in_collision_internal(return_names=True)))
        answers.append(("min_distance_internal", manager.min_distance_internal()))
        answers.append(("in_collision_other", manager.in_collision_other(visitors, return_names=True)))
        answers.append(("min_distance_other", manager.min_distance_other(visitors)))
    manager.remove_object("robot 0")
    for transform in places(4, 100):
        found, names, contacts = manager.in_collision_single(robot, transform, return_names=True, return_data=True)
        answers.append(("in_collision_single", (found, names)))
        answers.append(("names of contacts", {name for contact in contacts for name in contact.names}))
        distance, name = manager.min_distance_single(robot, transform, return_name=True)
        # Of several that touch, any may be named.
        answers.append(("min_distance_single", distance))
        answers.append(("the nearest", None if found else name))
    return answers


def is_same(answer, expected):
    """Distances agree to a millionth, and what touches is 0 apart for cbvh, less for FCL. All else is equal."""
    if isinstance(answer, float):
        return abs(answer - max(expected, 0.0)) <= 1e-6 * answer
    return answer == expected


def main():
    walls, robot = load("fclenv.obj"), load("fclrob.obj")
    start = time.perf_counter()
    answers = ask(cbvh.CollisionManager, walls, robot)
    seconds = time.perf_counter() - start
    touching = sum(answer[0] for question, answer in answers if question == "in_collision_single")
    print(f"cbvh: {len(answers)} answers in {seconds:.2f} s; a robot collides in {touching} of 100 places")
    assert 0 < touching < 100
    try:
        trimesh.collision.CollisionManager()
    except ValueError as error:
        print(f"not compared: {error}")
        return
    start = time.perf_counter()
    expected = ask(trimesh.collision.CollisionManager, walls, robot)
    print(f"python-fcl: the same calls in {time.perf_counter() - start:.2f} s")
    differing = [(*row, other) for row, (_, other) in zip(answers, expected) if not is_same(row[1], other)]
    for question, answer, other in differing:
        print(f"{question}: cbvh answers {answer}, python-fcl {other}")
    print(f"{len(answers) - len(differing)} of {len(answers)} answers agree")
    assert len(answers) == len(expected) and not differing


if __name__ == "__main__":
    main()
