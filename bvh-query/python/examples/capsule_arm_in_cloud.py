"""An arm of capsules moves through the cloud of points that a depth camera sees.

    python examples/capsule_arm_in_cloud.py

Each point counts as a ball as large as the noise of the camera. The answers are checked with numpy, point by point.
"""

import time

import numpy as np

import cbvh

NOISE = 0.005  # metres, like all lengths here
RADII, LENGTHS = [0.07, 0.06, 0.05, 0.04], [0.30, 0.35, 0.30, 0.15]


def camera_frame(numbers, rows=96, columns=128):
    """Points that a camera at the origin sees of a table with boxes, in its frame: x right, y down, z ahead."""
    v, u = np.mgrid[-0.6:0.6 : rows * 1j, -0.8:0.8 : columns * 1j]
    rays = np.stack([u, v, np.ones_like(u)], axis=-1).reshape(-1, 3)
    depth = np.full(len(rays), 3.0)
    depth[rays[:, 1] > 0.1] = np.minimum(depth, 0.5 / np.maximum(rays[:, 1], 0.1))[rays[:, 1] > 0.1]
    for left, right, top, ahead in [(-0.6, -0.3, 0.0, 1.3), (0.1, 0.25, 0.1, 1.1), (0.35, 0.7, -0.2, 1.6)]:
        seen = (rays[:, 0] * ahead > left) & (rays[:, 0] * ahead < right) & (rays[:, 1] * ahead > top)
        depth = np.where(seen, np.minimum(depth, ahead), depth)
    return rays * (depth * (1 + numbers.normal(0, 0.002, len(depth))))[:, None]


def link_poses(joints):
    """Poses of the capsules, whose segments lie along z: each joint turns about the x of its link, the first about y, too."""
    pose, poses = np.eye(4), []
    pose[:3, :3], pose[:3, 3] = [[1, 0, 0], [0, 0, -1], [0, 1, 0]], [0, 0.45, 0.7]  # On the table, upright.
    turn, *bends = joints
    c, s = np.cos(turn), np.sin(turn)
    pose[:3, :3] = pose[:3, :3] @ [[c, -s, 0], [s, c, 0], [0, 0, 1]]
    for bend, length in zip(bends, LENGTHS):
        c, s = np.cos(bend), np.sin(bend)
        pose[:3, :3] = pose[:3, :3] @ [[1, 0, 0], [0, c, -s], [0, s, c]]
        middle = pose.copy()
        middle[:3, 3] += middle[:3, 2] * length / 2
        poses.append(middle)
        pose[:3, 3] += pose[:3, 2] * length
    return np.array(poses)


def gaps_by_numpy(poses, points):
    """How far each link is from the nearest ball: the distances of points from a segment, less the radii."""
    gaps = []
    for pose, radius, length in zip(poses, RADII, LENGTHS):
        along = np.clip((points - pose[:3, 3]) @ pose[:3, 2], -length / 2, length / 2)
        away = np.linalg.norm(points - pose[:3, 3] - along[:, None] * pose[:3, 2], axis=1)
        gaps.append(away.min() - radius - NOISE)
    return np.array(gaps)


numbers = np.random.default_rng(1)
points = camera_frame(numbers).astype(np.float32).astype(float)
# What the camera sees of the arm's own base is not an obstacle.
points = points[np.linalg.norm(points - [0, 0.45, 0.7], axis=1) > 0.15]

start = time.perf_counter()
cloud = cbvh.cloud(points, NOISE)
print(f"{len(points)} points became a shape in {1000 * (time.perf_counter() - start):.1f} ms")

# Links are asked about with the cloud, not with each other.
scene = cbvh.Scene()
scene.add(cloud, name="cloud", member=1, meets=2)
links = [
    scene.add(cbvh.capsule(radius, length), name=f"link {number}", member=2, meets=1)
    for number, (radius, length) in enumerate(zip(RADII, LENGTHS))
]

ways = np.linspace([-1.2, -0.1, -0.5, -0.7, -0.3], [1.2, -0.3, -0.6, -0.8, -0.5], 200)
touching, elapsed, expected = [], 0.0, []
for joints in ways:
    poses = link_poses(joints)
    start = time.perf_counter()
    scene.set_poses(links, poses)
    found = scene.distance()
    touched = {scene.name(link) for pair in scene.pairs_in_contact() for link in pair} - {"cloud"}
    elapsed += time.perf_counter() - start
    gaps = gaps_by_numpy(poses, points)
    assert touched == {f"link {number}" for number in np.flatnonzero(gaps <= 0)}
    assert abs(found.nearest.distance - max(gaps.min(), 0)) < 1e-6
    touching.append(bool(touched))

print(f"the arm touches the cloud in {sum(touching)} of {len(ways)} poses, {1e6 * elapsed / len(ways):.0f} us per pose")
assert 0 < sum(touching) < len(ways)

# Is the way free between two poses, at every moment? Each link moves from one pose to the next.
free = []
for one, two in zip(ways, ways[1:]):
    paths = {link: cbvh.Motion.between(a, b) for link, a, b in zip(links, link_poses(one), link_poses(two))}
    free.append(scene.is_free(paths))
assert not any(np.array(free) & (np.array(touching)[1:] | np.array(touching)[:-1]))
print(f"{sum(free)} of {len(free)} motions between them are free")
