# %% [markdown]
# A robot in its cell: what touches, what is nearest, and until when a motion is free.
#
#     python examples/robot_in_cell.py [PICTURE]
#
# The cells run one after the other, in a notebook or as a program, which writes a picture. It needs matplotlib.

# %%
import pathlib
import sys
import xml.etree.ElementTree as ElementTree

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

import cbvh

HERE = pathlib.Path(__file__).resolve().parent
URDF = HERE.parents[2] / "testdata" / "robot" / "robot.urdf"
PICTURE = pathlib.Path(sys.argv[1]) if len(sys.argv) > 1 else HERE / "robot_in_cell.png"

# %%
# The robot, and what stands around it. The meshes of neighbours meet at their joints, and are not checked.
robot = cbvh.Robot.from_urdf(URDF)
for pair in zip(robot.links, robot.links[1:]):
    robot.allow(*pair)
OBSTACLES = {
    "table": ((1.1, 1.1, 0.02), (0, 0, -0.03)),
    "shelf": ((0.4, 0.8, 0.02), (0.55, 0, 0.45)),
    "post": ((0.05, 0.05, 1.2), (0.35, 0.5, 0.6)),
}
for name, (sides, place) in OBSTACLES.items():
    pose = np.eye(4)
    pose[:3, 3] = place
    robot.add_obstacle(cbvh.box(sides), pose, name=name)
robot.allow("base", "table")  # It stands there,
robot.allow("base", "upper_arm")  # and these always are 4 cm apart.

# %%
# A motion in joint space, which ends in the shelf, and the distance along it.
start, goal = robot.q(waist=2.0, shoulder=0.7, elbow=1.0), robot.q(waist=-0.6, shoulder=0.9, elbow=0.9)
found = robot.motion(start, goal)
print(f"{found.kind.name} of {' and '.join(found.bodies)}, certainly free until {found.free_until:.6f}")
times = np.linspace(0, 1, 301)
along = start + times[:, None] * (goal - start)
distance = robot.distance(along)
touching = robot.collide(along)
assert not touching[times < found.free_until].any() and robot.collide(found.joints)


# %%
# The triangles of the links, to draw them.
def read_obj(path):
    lines = [line.split() for line in path.read_text().splitlines()]
    vertices = [[float(field) for field in line[1:4]] for line in lines if line[:1] == ["v"]]
    faces = [[int(field.split("/")[0]) - 1 for field in line[1:4]] for line in lines if line[:1] == ["f"]]
    return np.array(vertices)[np.array(faces)]


def numbers(element, name, default):
    return np.array([float(field) for field in element.get(name, default).split()])


shapes = {}
for link in ElementTree.parse(URDF).getroot().findall("link"):
    mesh, origin = link.find("collision/geometry/mesh"), link.find("collision/origin")
    triangles = read_obj(URDF.parent / mesh.get("filename")) * numbers(mesh, "scale", "1 1 1")
    if origin is not None:
        pitch = numbers(origin, "rpy", "0 0 0")[1]
        turn = np.array([[np.cos(pitch), 0, np.sin(pitch)], [0, 1, 0], [-np.sin(pitch), 0, np.cos(pitch)]])
        triangles = triangles @ turn.T + numbers(origin, "xyz", "0 0 0")
    shapes[link.get("name")] = triangles


def draw(axes, triangles, color, alpha):
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    light = 0.6 + 0.4 * np.abs(normals @ [0.4, -0.5, 0.77])
    shaded = np.clip(light[:, None] * matplotlib.colors.to_rgb(color), 0, 1)
    axes.add_collection3d(Poly3DCollection(triangles, facecolors=np.column_stack([shaded, np.full(len(shaded), alpha)])))


# %%
figure = plt.figure(figsize=(11, 5.2), layout="constrained")
place, course = figure.add_subplot(1, 2, 1, projection="3d"), figure.add_subplot(1, 2, 2)
for name, (sides, middle) in OBSTACLES.items():
    vertices, faces = cbvh.box(sides).arrays()
    is_touched = any(name in pair for pair in robot.pairs_in_contact(found.joints))
    draw(place, vertices[faces] + middle, "crimson" if is_touched else "silver", 0.5)
for q, alpha in ((start, 0.25), (start + 0.5 * (found.joints - start), 0.25), (found.joints, 1.0)):
    touched = {body for pair in robot.pairs_in_contact(q) for body in pair}
    for link, pose in zip(robot.links, robot.link_poses(q)):
        color = "crimson" if link in touched else "steelblue"
        draw(place, shapes[link] @ pose[:3, :3].T + pose[:3, 3], color, alpha)
place.set(xlim=(-0.5, 0.7), ylim=(-0.6, 0.6), zlim=(0, 1.2), title="The robot on its way, and what touches")
place.set_box_aspect((1, 1, 1), zoom=1.35)
place.view_init(elev=22, azim=-62)
place.set_axis_off()
course.plot(times, distance.distance, color="navy", label="distance of the nearest two bodies")
shade = {"color": "crimson", "alpha": 0.2, "label": "contact"}
course.fill_between(times, 0, distance.distance.max(), where=touching, step="mid", **shade)
course.axvline(found.free_until, color="black", linewidth=0.9, linestyle="--", label="certainly free until")
names = [" and ".join(bodies) for bodies in distance.bodies]
changes = [0, *(k for k in range(1, len(names)) if names[k] != names[k - 1]), len(names)]
for first, last in zip(changes, changes[1:]):
    if last - first > 12:
        middle = (first + last) // 2
        at = times[middle], distance.distance[middle] + 0.01
        course.annotate(names[middle], at, rotation=90, ha="center", va="bottom", fontsize=8)
course.set(xlabel="time", ylabel="metres", xlim=(0, 1), ylim=(0, 1.9 * distance.distance.max()))
course.legend(loc="upper right")
course.set_title("What is nearest during the motion")
figure.savefig(PICTURE, dpi=72)
print(f"{PICTURE.name}: {PICTURE.stat().st_size} bytes")
