"""Padding, as MoveIt has it: links that count as larger, and pairs that must keep a distance of their own.

    python examples/padding.py

A link's padding is the margin of its instance, and a pair may have a further one. All questions respect both, which is
checked here against the distances without padding. A link that MoveIt scales is another mesh.
"""

import pathlib
import tempfile

import numpy as np

import cbvh

TESTDATA = pathlib.Path(__file__).resolve().parents[3] / "testdata"
LINK_PADDING = {"base": 0.0, "forearm": 30.0, "gripper": 12.5}  # in mesh units
PAIR_PADDING = {("gripper", "walls"): 50.0}


def scene_of(walls, link, padded):
    scene = cbvh.Scene()
    scene.add(walls, name="walls")
    for name in LINK_PADDING:
        scene.add(link, name=name)
    # Links that are joined may touch.
    scene.set_allowed("base", "forearm")
    if padded:
        for name, padding in LINK_PADDING.items():
            scene.set_margin(name, padding)
        for pair, padding in PAIR_PADDING.items():
            scene.set_pair_margin(*pair, padding)
    return scene


def padding_of(a, b):
    of_pair = PAIR_PADDING.get((a, b), 0.0) + PAIR_PADDING.get((b, a), 0.0)
    return LINK_PADDING.get(a, 0.0) + LINK_PADDING.get(b, 0.0) + of_pair


with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
    walls = cbvh.bake_files(TESTDATA / "fclenv.obj", f"{folder}/walls.cbvh")
    link = cbvh.bake_files(TESTDATA / "fclrob.obj", f"{folder}/link.cbvh")

numbers = np.random.default_rng(3)
plain, padded = scene_of(walls, link, False), scene_of(walls, link, True)
touching = {"plain": 0, "padded": 0}
for _ in range(300):
    for name in LINK_PADDING:
        turn, _ = np.linalg.qr(numbers.normal(size=(3, 3)))
        pose = np.eye(4)
        pose[:3, :3] = turn * np.linalg.det(turn)
        pose[:3, 3] = numbers.uniform([-2800, -2800, 200], [2800, 2800, 2800])
        plain.set_pose(name, pose)
        padded.set_pose(name, pose)
    # The distance of each pair, without padding.
    distances = plain.distances()
    pairs = [tuple(plain.name(id) for id in pair) for pair in distances.pairs]
    left = {pair: gap - padding_of(*pair) for pair, gap in zip(pairs, distances.nearest.distance)}
    close = {pair for pair, gap in left.items() if gap <= 0}

    # The same questions to the padded scene.
    assert {tuple(padded.name(id) for id in pair) for pair in padded.pairs_in_contact()} == close
    assert padded.collide() == bool(close)
    found = padded.distances()
    for pair, gap in zip(found.pairs, found.nearest.distance):
        expected = max(left[tuple(padded.name(id) for id in pair)], 0.0)
        assert abs(gap - expected) <= 1e-9 * (1 + expected)
    assert abs(padded.distance().nearest.distance - max(min(left.values()), 0.0)) <= 1e-9 * 3000
    touching["plain"] += plain.collide()
    touching["padded"] += padded.collide()

print(f"of 300 poses, {touching['plain']} touch without padding and {touching['padded']} with it")
assert 0 < touching["plain"] < touching["padded"] < 300
