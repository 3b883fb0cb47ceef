"""A planner that takes links for balls, and the exact check after the fact: what the balls miss, and what they refuse.

    python examples/balls_of_links.py

Planners on GPUs often stand each link in with some balls. The arm of testdata gets balls in a URDF of its own, so that
both robots have the same joints and obstacles. Paths that the balls call free are asked about again with the meshes.
"""

import pathlib
import tempfile
import xml.etree.ElementTree as ElementTree

import numpy as np

import cbvh

ROBOT = pathlib.Path(__file__).resolve().parents[3] / "testdata" / "robot" / "robot.urdf"
NEIGHBOURS = [("base", "turret"), ("turret", "upper_arm"), ("upper_arm", "forearm"), ("forearm", "hand")]
BALLS = 6  # per link


def numbers(text):
    return np.array([float(field) for field in text.split()])


def balls_of(path, scale):
    """Balls along the longest side of a mesh: each goes through the corners of its slice in the mean."""
    lines = [line.split() for line in path.read_text().splitlines()]
    vertices = np.array([[float(field) for field in line[1:4]] for line in lines if line[:1] == ["v"]]) * scale
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    axis = np.argmax(high - low)
    for number in range(BALLS):
        centre = (low + high) / 2
        centre[axis] = low[axis] + (number + 0.5) / BALLS * (high - low)[axis]
        nearest = np.sort(np.linalg.norm(vertices - centre, axis=1))[: len(vertices) // BALLS + 1]
        yield centre, nearest.mean()


def with_balls(urdf):
    """The same URDF, with balls instead of meshes."""
    root = ElementTree.parse(urdf).getroot()
    for link in root.findall("link"):
        for collision in link.findall("collision"):
            mesh = collision.find("geometry/mesh")
            link.remove(collision)
            origin = collision.find("origin")
            rotation, shift = np.eye(3), np.zeros(3)
            if origin is not None:
                roll, pitch, yaw = numbers(origin.get("rpy", "0 0 0"))
                assert roll == yaw == 0
                rotation = np.array([[np.cos(pitch), 0, np.sin(pitch)], [0, 1, 0], [-np.sin(pitch), 0, np.cos(pitch)]])
                shift = numbers(origin.get("xyz", "0 0 0"))
            for centre, radius in balls_of(urdf.parent / mesh.get("filename"), numbers(mesh.get("scale", "1 1 1"))):
                ball = ElementTree.SubElement(link, "collision")
                ElementTree.SubElement(ball, "origin", xyz=" ".join(map(repr, (rotation @ centre + shift).tolist())))
                ElementTree.SubElement(ElementTree.SubElement(ball, "geometry"), "sphere", radius=repr(float(radius)))
    return ElementTree.tostring(root)


def in_cell(urdf):
    """The robot among things that are thinner than its balls."""
    robot = cbvh.Robot.from_urdf(urdf)
    for pair in NEIGHBOURS:
        robot.allow(*pair)
    for name, sides, place in (
        ("shelf", [0.4, 1.0, 0.02], [0.6, 0, 0.6]),
        ("post", [0.03, 0.03, 1.5], [-0.3, 0.3, 0.75]),
        ("wire", [0.004, 0.004, 1.5], [0.3, -0.4, 0.75]),
    ):
        pose = np.eye(4)
        pose[:3, 3] = place
        robot.add_obstacle(cbvh.box(sides), pose, name=name)
    return robot


with tempfile.TemporaryDirectory() as folder:
    path = pathlib.Path(folder) / "balls.urdf"
    path.write_bytes(with_balls(ROBOT))
    balls, meshes = in_cell(path), in_cell(ROBOT)
assert balls.joints == meshes.joints

rng = np.random.default_rng(1)
low, high = meshes.limits.T
rows = rng.uniform(low, high, (20_000, len(low)))
by_balls, exact = balls.collide(rows, parallel=True), meshes.collide(rows, parallel=True)
missed, refused = (exact & ~by_balls).sum(), (by_balls & ~exact).sum()
print(f"{len(rows)} configurations: {exact.sum()} touch; the balls miss {missed} of these, and refuse {refused} that are free")
assert missed and refused

# Edges that are free for the balls at every moment, and certainly not for the meshes.
starts = rows[~by_balls][:1000]
ends = np.clip(starts + rng.normal(0, 0.3, starts.shape), low, high)
passed = balls.is_free(starts, ends, parallel=True)
certain = meshes.is_free(starts[passed], ends[passed], parallel=True)
print(f"{passed.sum()} edges are free for the balls, and {(~certain).sum()} of these touch")
for start, end in zip(starts[passed][~certain], ends[passed][~certain]):
    found = meshes.motion(start, end)
    if found.kind == cbvh.MotionKind.HIT:
        assert found.bodies in meshes.pairs_in_contact(found.joints)
