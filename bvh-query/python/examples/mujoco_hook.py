"""A ring falls onto a hook and stays there, in MuJoCo with contact points of cbvh. Hulls push it off.

    pip install mujoco
    python examples/mujoco_hook.py [seconds]

The ring swings on one or two small patches, whose contact points are springs (`PointContact`). There is no friction.
"""

import sys

import numpy as np

import cbvh
from _cell import ring
from _contacts import PointContact, model_of, simulate

# In metres: the radii of the hook's arc and of its wire, and of the ring's.
ARC, WIRE, RING, THICKNESS = 15e-3, 4e-3, 20e-3, 3e-3


def middle_line():
    """The middle of the wire: down, around and up again."""
    arc = np.linspace(0, np.pi, 65)
    around = np.stack([-ARC * np.cos(arc), 0 * arc, -ARC * np.sin(arc)], axis=1)
    return np.concatenate([[(-ARC, 0, z) for z in np.linspace(40e-3, 2e-3, 20)], around, [(ARC, 0, z) for z in (4e-3, 8e-3)]])


def tube(path, radius, rows=32):
    """The vertices and faces of a closed tube around a path in the plane of x and z."""
    along = np.gradient(path, axis=0)
    along /= np.linalg.norm(along, axis=1)[:, None]
    across, angle = np.cross(along, (0, 1, 0))[:, None], 2 * np.pi * np.arange(rows)[:, None] / rows
    points = path[:, None] + radius * (np.cos(angle) * across + np.sin(angle) * (0, 1, 0))
    count, k = len(path), np.arange(rows)
    corner = lambda i, j: i * rows + j % rows
    end = np.full(rows, count * rows)
    faces = [(corner(0, k), corner(0, k + 1), end), (corner(count - 1, k + 1), corner(count - 1, k), end + 1)]
    for i in range(count - 1):
        a, b, c, d = corner(i, k), corner(i + 1, k), corner(i + 1, k + 1), corner(i, k + 1)
        faces += [(a, b, c), (a, c, d)]
    return np.concatenate([points.reshape(-1, 3), path[[0, -1]]]), np.concatenate([np.stack(face, axis=1) for face in faces])


def volume(vertices, faces):
    corners = vertices[faces]
    return np.einsum("ij,ij->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6


def hangs(data):
    """Whether the middle of the wire goes through the ring, an odd number of times."""
    local = (middle_line() - data.body("moving").xpos) @ data.body("moving").xmat.reshape(3, 3)
    crossings = np.flatnonzero(np.diff(np.sign(local[:, 2])))
    share = local[crossings, 2] / (local[crossings, 2] - local[crossings + 1, 2])
    places = local[crossings] + share[:, None] * (local[crossings + 1] - local[crossings])
    return np.count_nonzero(np.hypot(places[:, 0], places[:, 1]) < RING) % 2 == 1


seconds = float(sys.argv[1]) if len(sys.argv) > 1 else 10.0
meshes = tube(middle_line(), WIRE), ring(RING, THICKNESS)
files = [cbvh.bake(*mesh) for mesh in meshes]
assert all(volume(*mesh) > 0 for mesh in meshes) and not any(file.open_edges().edges for file in files)
xml = model_of(
    *meshes,
    '<option timestep="0.0005"/>',
    'pos="0.004 0.003 -0.026" euler="20 90 0"',
    '<inertial pos="0 0 0" mass="0.05" diaginertia="1e-5 1e-5 2e-5"/>',
    damping=0.01,
    turning_damping=1e-6,
)

# About 40 um deep, where the facets are within 26 um of the shapes.
data, contact, each = simulate(xml, lambda model: PointContact(model, *files, "moving", 1.5e11, 6e7), seconds)
bottom = -ARC + WIRE - RING + THICKNESS
x, y, z = data.body("moving").xpos
print(f"{' and '.join(str(len(mesh[1])) for mesh in meshes)} triangles, up to {contact.most_points} contact points")
print(f"after {seconds} s, the ring is {1e3 * x:.2f}, {1e3 * y:.2f}, {1e3 * (z - bottom):.2f} mm from where it hangs at rest; it was at")
print(f"  most {1e6 * contact.deepest:.0f} um in the hook; {each:.2f} ms for a step, of which {1e3 * contact.seconds / contact.calls:.2f} for contacts")
assert hangs(data) and contact.deepest < 2e-4
# It has lost what it fell from, and cannot be deeper than it is in the hook.
assert -2e-4 < z - bottom < 2e-3

data, _, each = simulate(xml, None, 1.0)
x, y, z = data.body("moving").xpos
print(f"MuJoCo's hulls: after 1 s the ring is {1e3 * np.linalg.norm((x, y, z - bottom)):.0f} mm away; {each:.3f} ms for a step")
assert np.linalg.norm((x, y, z - bottom)) > 0.1
