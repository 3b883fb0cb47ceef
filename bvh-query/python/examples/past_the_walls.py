# %% [markdown]
# A robot moves past walls: where it comes near, where it touches, and how far every place is from them.
#
#     python examples/past_the_walls.py [PICTURE]
#
# The cells run one after the other, in a notebook or as a program, which writes a picture. It needs matplotlib.

# %%
import pathlib
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

import cbvh

HERE = pathlib.Path(__file__).resolve().parent
TESTDATA = HERE.parents[2] / "testdata"
PICTURE = pathlib.Path(sys.argv[1]) if len(sys.argv) > 1 else HERE / "past_the_walls.png"


# %%
# Bake the meshes in memory. The arrays are kept to draw outlines.
def read_obj(path):
    lines = [line.split() for line in path.read_text().splitlines()]
    vertices = [[float(field) for field in line[1:4]] for line in lines if line[:1] == ["v"]]
    faces = [[int(field.split("/")[0]) - 1 for field in line[1:4]] for line in lines if line[:1] == ["f"]]
    return np.array(vertices), np.array(faces)


environment, robot_arrays = read_obj(TESTDATA / "fclenv.obj"), read_obj(TESTDATA / "fclrob.obj")
walls, robot = cbvh.bake(*environment), cbvh.bake(*robot_arrays)

# %%
# A motion past the walls, and the distance along it. It turns by a third of a circle.
HEIGHT = 1000.0


def placed(x, y, angle):
    pose = np.eye(4)
    pose[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    pose[:3, 3] = [x, y, HEIGHT]
    return pose


motion = cbvh.Motion.between(placed(250, -2250, 0.2), placed(-1300, 2000, 2.3))
times = np.linspace(0, 1, 1001)
poses = motion.pose(times)
found = walls.distance(robot, poses)
touching = walls.collide(robot, poses)

# %%
# Whether the motion is free is a question of its own: its answer holds at every moment, not at samples.
answer = walls.motion(robot, motion)
clear = walls.motion(robot, motion, clearance=100.0)
print(f"contact: {answer.kind.name}, certainly free until {answer.free_until:.6f}")
print(f"100 from the walls: {clear.kind.name}, certainly farther until {clear.free_until:.6f}")

# %%
# All pairs of triangles in contact, while it touches, and the distance of a slice of the world from the walls.
contacts = [len(rows) for rows in walls.contacts(robot, poses)]
xs, ys = np.linspace(-3300, 1300, 230), np.linspace(-3300, 3300, 330)
grid = np.stack([*np.meshgrid(xs, ys), np.full((len(ys), len(xs)), HEIGHT)], axis=-1)
distances = walls.closest_points(grid.reshape(-1, 3), parallel=True).distance.reshape(grid.shape[:2])


# %%
# Where triangles cut the plane of the slice, as segments.
def outline(vertices, faces, height):
    segments = []
    for a, b, c in vertices[faces]:
        cuts = []
        for p, q in ((a, b), (b, c), (c, a)):
            if (p[2] - height) * (q[2] - height) < 0:
                cuts.append(p[:2] + (height - p[2]) / (q[2] - p[2]) * (q - p)[:2])
        if len(cuts) == 2:
            segments.append(cuts)
    return segments


# %%
figure, (place, course) = plt.subplots(1, 2, figsize=(11, 5.6), width_ratios=(1, 1.15), layout="constrained")
image = place.pcolormesh(xs, ys, distances, cmap="YlGnBu_r", vmin=0, rasterized=True)
place.contour(xs, ys, distances, levels=[100, 300, 600, 1000], colors="white", linewidths=0.6)
figure.colorbar(image, ax=place, label="distance from the walls, mesh units", pad=0.02)
for segment in outline(*environment, HEIGHT):
    place.plot(*np.transpose(segment), color="black", linewidth=1.2)
for number in range(0, len(times), 200):
    rotation, shift = poses[number, :2, :2], poses[number, :2, 3]
    vertices, faces = robot_arrays
    for triangle in vertices[faces]:
        color = "crimson" if touching[number] else "darkorange"
        place.fill(*(rotation @ triangle[:, :2].T + shift[:, None]), color=color, linewidth=0, alpha=0.8)
place.plot(*poses[:, :2, 3].T, color="black", linewidth=0.8, linestyle=":")
place.set(aspect="equal", xlabel="x", ylabel="y", title="The robot during its motion, and a slice of the walls")
course.plot(times, found.distance, color="navy", label="distance")
shade = {"color": "crimson", "alpha": 0.2, "label": "contact"}
course.fill_between(times, 0, found.distance.max(), where=touching, step="mid", **shade)
course.axvline(answer.free_until, color="black", linewidth=0.9, linestyle="--", label="certainly free until")
course.set(xlabel="time", ylabel="mesh units", xlim=(0, 1), ylim=(0, 1.4 * found.distance.max()))
pairs = course.twinx()
pairs.plot(times, contacts, color="crimson", linewidth=0.8)
pairs.set_ylabel("pairs of triangles in contact", color="crimson")
pairs.set_ylim(0, None)
course.legend(loc="upper left")
course.set_title("How far apart they are during the motion")
figure.savefig(PICTURE, dpi=72)
print(f"{PICTURE.name}: {PICTURE.stat().st_size} bytes")
