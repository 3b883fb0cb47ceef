"""What sensors see: the rays of a lidar, and which parts of a floor two cameras cover, as a picture.

    python examples/sensors.py [PICTURE]

A scan is one call of `first_hits`, and the map of each camera is one of `visible`. Both must agree: what a ray hits is visible.
"""

import pathlib
import sys
import tempfile

import matplotlib
import numpy as np

import cbvh

matplotlib.use("agg")
from matplotlib import pyplot  # noqa: E402
from matplotlib.colors import ListedColormap  # noqa: E402
from PIL import Image  # noqa: E402

HERE = pathlib.Path(__file__).resolve().parent
TESTDATA = HERE.parents[2] / "testdata"
PICTURE = pathlib.Path(sys.argv[1]) if len(sys.argv) > 1 else HERE / "sensors.png"

with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
    room = cbvh.bake_files(TESTDATA / "fclenv.obj", f"{folder}/room.cbvh")
    robot = cbvh.bake_files(TESTDATA / "fclrob.obj", f"{folder}/robot.cbvh")
scene = cbvh.Scene()
scene.parallel = True
scene.add(room, name="room")
scene.add(robot, cbvh.pose([0, -1500, 430.0]), name="robot")

# The lidar turns below the table top, among legs of the table, of chairs and of the robot.
lidar = np.array([-1000.0, 200, 300])
azimuth = np.linspace(0, 2 * np.pi, 2880, endpoint=False)
scan = scene.first_hits(lidar, np.stack([np.cos(azimuth), np.sin(azimuth), 0 * azimuth], axis=-1))
hits, of_robot = scan.hit.point[scan.hit.found], scan.instance[scan.hit.found] == 1  # a few leave by gaps between walls
assert scene.visible(lidar, hits, margin=0.01).all()

# Two cameras under the ceiling, and points just above the floor.
cameras = np.array([[-2700.0, -2700, 2500], [800, 2700, 2500]])
x, y = np.meshgrid(np.linspace(-2975, 975, 159), np.linspace(-2975, 2975, 239))
floor = np.stack([x.ravel(), y.ravel(), np.full(x.size, 5.0)], axis=1)
seen = np.array([scene.visible(camera, floor, margin=1.0) for camera in cameras])
for camera, row in zip(cameras, seen):
    print(f"the camera at {camera} sees {row.mean():.1%} of the floor")
print(f"both together see {seen.any(axis=0).mean():.1%}")

# What stands on a place, as seen from above: the height of the first thing below the ceiling.
down = scene.first_hits(np.column_stack([floor[:, :2], np.full(len(floor), 2400.0)]), [0, 0, -1])
height = down.hit.point[:, 2].reshape(x.shape)

picture, (left, right) = pyplot.subplots(1, 2, figsize=(8, 5.4), sharey=True, layout="constrained")
extent = (-3000, 1000, -3000, 3000)
for axes in (left, right):
    axes.contour(x, y, height, levels=[100], colors="black", linewidths=0.7)
    axes.set(aspect="equal", xlabel="x", xlim=extent[:2], ylim=extent[2:])
left.set_ylabel("y")
left.fill(*hits[:, :2].T, color="#fff3b0")
for chosen, color, name in ((~of_robot, "#1f5f8b", "hits of the room"), (of_robot, "#d62839", "hits of the robot")):
    left.scatter(*hits[chosen, :2].T, s=4, color=color, linewidths=0, label=name)
left.plot(*lidar[:2], "k^", label="lidar")
left.set_title(f"A level scan of {len(azimuth)} rays", fontsize=10)
colors = ["#6b6b6b", "#7fb3d5", "#f5c97a", "#fdfdf5"]
right.imshow((seen[0] + 2 * seen[1].astype(int)).reshape(x.shape), origin="lower", extent=extent, cmap=ListedColormap(colors))
for number, (camera, color) in enumerate(zip(cameras, ["#1f5f8b", "#c27a00"]), 1):
    right.plot(*camera[:2], "o", color=color, markeredgecolor="white", markersize=9, label=f"camera {number}")
right.set_title("The floor: seen by both (white), by none (grey)", fontsize=10)
for axes in (left, right):
    axes.legend(loc="lower right", fontsize=8)
# Few colours, so that the file is small.
picture.set_dpi(90)
picture.canvas.draw()
pixels = Image.fromarray(np.asarray(picture.canvas.buffer_rgba())).convert("RGB")
pixels.quantize(128, Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE).save(PICTURE, optimize=True)
print(f"wrote {PICTURE}")
