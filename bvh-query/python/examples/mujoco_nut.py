"""A nut runs down a bolt by its weight alone, in MuJoCo with contacts of cbvh, of hulls, and of MuJoCo's signed distances.

    pip install mujoco
    python examples/mujoco_nut.py [seconds]

The threads are meshes, M10 with a play of 0.06 mm up and down. There is no friction but oil, in which the nut makes about a turn in
a second. Its flanks rest on one long patch around the bolt, or on a hundred small ones that come and go as facets pass each other.
Contact points of all these patches carry the nut, too (`PointContact`), but take longer to find than the curves, from which the
gradient of the volume follows directly (`VolumeContact`). That gradient changes smoothly, however patches join and part, and is that
of an energy. Nut and bolt have facets of different sizes, or all would pass each other at once.
"""

import sys

import mujoco
import numpy as np

import cbvh
from _contacts import PointContact, VolumeContact, model_of, simulate

# In metres, from root to root.
PITCH, PLAY = 1.5e-3, 1e-4
HEIGHTS, RADII = np.array([(0, 0.25, 0.78, 0.97), (4.08, 4.08, 5.0, 5.0)]) * 1e-3
ROWS = len(HEIGHTS)


def mesh(labels, place):
    """Vertices and faces of triangles whose corners are labels."""
    numbers = {label: number for number, label in enumerate(dict.fromkeys(label for face in labels for label in face))}
    return np.array([place(*label) for label in numbers]), np.array([[numbers[label] for label in face] for face in labels])


def thread(turns, columns):
    """The triangles of a thread, outward, and its lower and upper boundary. A label is a column along the helix and a row."""
    label = lambda c, k: (c, k) if k < ROWS else (c + columns, 0)
    last = columns * turns
    faces = []
    for c in range(last):
        for k in range(ROWS):
            corners = label(c, k), label(c + 1, k), label(c + 1, k + 1), label(c, k + 1)
            faces += [corners[:3], (corners[0], *corners[2:])]
    step = lambda c: [label(c, k) for k in range(ROWS, -1, -1)]
    return faces, [(c, 0) for c in range(columns)] + step(0), [(c, 0) for c in range(last, last + columns)] + step(last)


def place(columns, wider, rings):
    """Where labels are: points of the thread, or of rings around the axis, which have negative rows."""

    def point(column, row):
        angle = 2 * np.pi * column / columns
        radius, height = rings[row](angle) if row < 0 else (RADII[row] + wider, HEIGHTS[row] + PITCH * column / columns)
        return radius * np.cos(angle), radius * np.sin(angle), height

    return point


def bolt(turns, columns):
    """A thread with a centre at either end."""
    faces, bottom, top = thread(turns, columns)
    faces += [(q, p, (0, -1)) for p, q in zip(bottom, bottom[1:])] + [(p, q, (0, -2)) for p, q in zip(top, top[1:])]
    return mesh(faces, place(columns, 0.0, {-1: lambda _: (0, 0), -2: lambda _: (0, PITCH * (turns + 1))}))


def nut(turns, columns):
    """A thread from inside, in a hexagon."""
    faces, bottom, top = thread(turns, columns)
    faces = [face[::-1] for face in faces]
    for row, loop in ((-1, bottom), (-2, top[::-1])):
        for p, q in zip(loop, loop[1:]):
            outer_p, outer_q = (p[0] % columns, row), (q[0] % columns, row)
            faces += [(p, q, outer_q)] + [(p, outer_q, outer_p)] * (outer_p != outer_q)
    for c in range(columns):
        low, high = [((c, row), ((c + 1) % columns, row)) for row in (-1, -2)]
        faces += [(*low, high[1]), (low[0], *high[::-1])]
    hexagon = lambda angle: 8e-3 / np.cos((angle + np.pi / 6) % (np.pi / 3) - np.pi / 6)
    return mesh(faces, place(columns, PLAY, {-1: lambda a: (hexagon(a), 0.0), -2: lambda a: (hexagon(a), PITCH * (turns + 1))}))


class Turns:
    """Counts the turns about the vertical of the quaternion in qpos[3:7]."""

    def __init__(self):
        self.angle = self.last = 0.0

    def __call__(self, data):
        w, x, y, z = data.qpos[3:7]
        # Of a quaternion about the vertical, up to a half turn about another axis.
        angle = 2 * np.arctan2(z, w) if w * w + z * z > 0.5 else 2 * np.arctan2(-y, x)
        self.angle += (angle - self.last + np.pi) % (2 * np.pi) - np.pi
        self.last = angle


seconds = float(sys.argv[1]) if len(sys.argv) > 1 else 10.0
threads = bolt(16, 48), nut(2, 30)
files = [cbvh.bake(*mesh) for mesh in threads]
assert not any(file.open_edges().edges for file in files)
xml = model_of(
    *threads,
    '<option timestep="0.0005"/>',
    f'pos="0 0 {12 * PITCH}"',
    '<inertial pos="0 0 0.0022" mass="0.01" diaginertia="2.5e-7 2.5e-7 4.7e-7"/>',
    damping=0.02,
    turning_damping=3.8e-6,
)



def run_down(name, contact, seconds):
    """Lets the nut run down, and checks that it follows the thread."""
    turns = Turns()
    data, made, each = simulate(xml, contact, seconds, turns)
    down, along = -data.qpos[2], -PITCH * turns.angle / (2 * np.pi)
    turned, more = -turns.angle / (2 * np.pi), down - along
    print(f"{name}: in {seconds} s the nut makes {turned:.2f} turns and comes down by {1e3 * down:.3f} mm, {1e6 * more:.0f} um more")
    print(f"  than its thread; {each:.2f} ms for a step, of which {1e3 * made.seconds / made.calls:.2f} for contacts")
    # It starts in the middle of its play, and the weight takes it to the lower end.
    assert 0 < more < 6e-5
    assert np.hypot(*data.qpos[:2]) < PLAY and down > 0.8 * PITCH * (seconds - 1)
    return made


print(f"{' and '.join(str(len(mesh[1])) for mesh in threads)} triangles")
# 6 kPa carry the weight of 0.1 N on 16 of the 60 square millimetres of the flanks.
made = run_down("volume", lambda model: VolumeContact(model, *files, "moving", 6e3, 1e5), seconds)
print(f"  and up to {made.most_contacts} pairs of triangles in contact")
made = run_down("points", lambda model: PointContact(model, *files, "moving", 1e9, 2e5), min(seconds, 0.5))
print(f"  and up to {made.most_points} points, {1e6 * made.deepest:.0f} um deep")

# The hull of the bolt has no thread, and that of the nut no hole.
data, _, each = simulate(xml, None, 0.2)
print(f"MuJoCo's hulls: in 0.2 s the nut moves {1e3 * data.qpos[2]:.1f} mm up, to the top of the bolt; {each:.3f} ms for a step")
assert data.qpos[2] > 5e-3

# Nut and bolt of MuJoCo's plug-in are not meshes but distance functions, with a pitch of a twelfth; their size is about a metre.
PLUGIN = """<mujoco><option timestep="0.002" sdf_iterations="10" sdf_initpoints="20"/><extension>
<plugin plugin="mujoco.sdf.nut"><instance name="nut"><config key="radius" value="0.26"/></instance></plugin>
<plugin plugin="mujoco.sdf.bolt"><instance name="bolt"><config key="radius" value="0.255"/></instance></plugin></extension>
<asset><mesh name="nut"><plugin instance="nut"/></mesh><mesh name="bolt"><plugin instance="bolt"/></mesh></asset>
<default><geom type="sdf" friction="0.01" solref="0.01 1" solimp="0.95 0.99 0.0001"/></default><worldbody>
<body pos="0 0 {height}" euler="180 0 0"><joint type="free" damping="30"/><geom mesh="nut"><plugin instance="nut"/></geom></body>
<body euler="180 0 0"><geom mesh="bolt"><plugin instance="bolt"/></geom></body></worldbody></mujoco>"""

height = 0.75
turns, path = Turns(), []
model = PLUGIN.format(height=height)
data, _, each = simulate(model, None, 10.0, lambda data: (turns(data), path.append((turns.angle / (2 * np.pi), data.qpos[2]))))
(turned, low), (half_turned, half_low) = path[-1], path[len(path) // 2]
print(f"MuJoCo's plug-in, its own nut and bolt: in 10 s {abs(turned):.2f} turns, {height - low:.3f} m down; in the last 5 s")
print(f"  {abs(half_low - low) / abs(turned - half_turned):.4f} m for a turn, expected {1 / 12:.4f}; {each:.2f} ms for a step")
assert low < height - 0.1
