"""Arms of example-robot-data in a cell of boxes and meshes. Not an example itself: some examples share it."""

import importlib.metadata
import pathlib

import numpy as np

import cbvh

ARMS = {
    "panda": ("panda_description/urdf/panda.urdf", "panda_description/srdf/panda.srdf"),
    "xarm7": ("xarm_description/urdf/xarm7.urdf", "xarm_description/srdf/xarm7.srdf"),
    "ur5": ("ur_description/urdf/ur5_robot.urdf", "ur_description/srdf/ur5.srdf"),
}


def files_of(arm):
    """The URDF and SRDF of an arm, and a folder in which its meshes are found."""
    share = importlib.metadata.distribution("example-robot-data").locate_file("cmeel.prefix/share")
    folder = pathlib.Path(str(share)) / "example-robot-data" / "robots"
    urdf, srdf = ARMS[arm]
    return folder / urdf, folder / srdf, str(share)


def at(x, y, z, axis=2, turn=0.0):
    """A pose that turns about an axis of the coordinates, 0 to 2."""
    pose, i, j = np.eye(4), (axis + 1) % 3, (axis + 2) % 3
    pose[i, i], pose[i, j], pose[j, i], pose[j, j] = np.cos(turn), -np.sin(turn), np.sin(turn), np.cos(turn)
    pose[:3, 3] = x, y, z
    return pose


def ring(radius, thickness, columns=96, rows=24):
    """The vertices and faces of a torus around the z-axis."""
    u, v = np.meshgrid(*(2 * np.pi * np.arange(count) / count for count in (columns, rows)), indexing="ij")
    reach = radius + thickness * np.cos(v)
    vertices = np.stack([reach * np.cos(u), reach * np.sin(u), thickness * np.sin(v)], axis=-1).reshape(-1, 3)
    i, j = np.meshgrid(np.arange(columns), np.arange(rows), indexing="ij")
    corner = lambda i, j: ((i % columns) * rows + j % rows).ravel()
    a, b, c, d = corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)
    return vertices, np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])


def open_box(x, y, z, wall):
    """The vertices and faces of a box without a lid, its floor on z = 0: what a convex hull closes."""
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    outer, inner = corners * [x / 2, y / 2], corners * [x / 2 - wall, y / 2 - wall]
    rings = [(outer, 0), (outer, z), (inner, z), (inner, wall)]
    vertices = np.array([[*corner, height] for ring, height in rings for corner in ring], dtype=float)
    sides = [(4 * k + i, 4 * k + (i + 1) % 4, 4 * k + 4 + (i + 1) % 4, 4 * k + 4 + i) for k in range(3) for i in range(4)]
    faces = [face for a, b, c, d in [*sides, (3, 2, 1, 0), (12, 13, 14, 15)] for face in ((a, b, c), (a, c, d))]
    return vertices, np.array(faces)


def cell():
    """What stands around an arm: names, sides of boxes or arrays of meshes, and poses."""
    things = [("table", (1.8, 1.8, 0.04), at(0, 0, -0.04))]
    for name, z in (("board 1", 0.25), ("board 2", 0.75)):
        things.append((name, (0.4, 0.9, 0.02), at(0.65, 0, z)))
    for number, (x, y) in enumerate([(0.47, 0.44), (0.47, -0.44), (-0.4, 0.4), (-0.4, -0.4)]):
        things.append((f"post {number + 1}", (0.02, 0.02, 1.2), at(x, y, 0.6)))
    things.append(("wire", (0.004, 0.004, 0.5), at(0.45, 0, 0.5)))
    things.append(("bin", open_box(0.3, 0.4, 0.2, 0.01), at(0, 0.55, -0.02)))
    things.append(("hoop", ring(0.25, 0.015), at(0, -0.5, 0.5, 0, np.pi / 2)))
    return things


def shape_of(thing):
    """A box is solid, a mesh a surface."""
    return cbvh.box(thing) if len(thing) == 3 else cbvh.bake(*thing)


def arm_in_cell(arm, things=None):
    """A robot with the pairs that its SRDF disables, among the things of the cell."""
    urdf, srdf, share = files_of(arm)
    robot = cbvh.Robot.from_urdf(urdf, [share], srdf)
    for name, thing, pose in cell() if things is None else things:
        robot.add_obstacle(shape_of(thing), pose, name=name)
    return robot
