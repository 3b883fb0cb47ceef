"""Times cbvh beside python-fcl, coal and trimesh, from Python, on the same poses in one run.

    python compare.py pairs.txt --meshes MESHES --poses POSES [--presets d0sep,d1] [--limit 50] [--only bunny,fcl]

A line of ``pairs.txt`` is NAME A B: meshes as OBJ in the folder MESHES. ``POSES/NAME_PRESET.txt`` has a pose of B in
the frame of A per line, 12 numbers row by row. pip install trimesh python-fcl coal; libraries that are missing are left
out.

How each is asked, one pose per call: all poses once untimed, so that everything is in caches, then up to three times
with each call timed alone, of which the least counts:

- cbvh: ``a.collide(b, pose)`` and ``a.distance(b, pose)``, baked with default options. "cbvh, all at once" is one
  call with all poses, on one core, divided by their number.
- fcl: BVHModel (OBBRSS), ``fcl.collide`` with one contact at most and none described, ``fcl.distance`` with nearest
  points.
- coal: BVHModelOBBRSS, ``coal.collide`` and ``coal.distance`` with the same, and with break_distance 0.
- trimesh: a CollisionManager with both meshes, ``set_transform`` and ``in_collision_internal`` or
  ``min_distance_internal``.

The figures are medians over the poses of a preset, in microseconds, with what Python costs. Ratios are to "cbvh".
"differ" counts poses with another answer: of contact, or a distance off by more than a millionth of it and of 1e-9 of
the size of A. fcl, coal and trimesh answer 0 or less for the distance where meshes meet, which counts as 0.
"""

from __future__ import annotations

import argparse
import importlib
import pathlib
import time
from typing import Any, Callable, Iterator

import numpy as np

Ask = Callable[[np.ndarray], Any]


def read_obj(path: pathlib.Path) -> tuple[np.ndarray, np.ndarray]:
    """Vertices, rounded to float32 so that all libraries hold the same mesh, and triangles."""
    vertices, faces = [], []
    for line in path.read_text().splitlines():
        fields = line.split()
        if fields[:1] == ["v"]:
            vertices.append([float(field) for field in fields[1:4]])
        elif fields[:1] == ["f"]:
            corners = [int(field.split("/")[0]) for field in fields[1:]]
            corners = [corner - 1 if corner > 0 else len(vertices) + corner for corner in corners]
            faces += [[corners[0], *corners[k : k + 2]] for k in range(1, len(corners) - 1)]
    return np.array(vertices, np.float32).astype(np.float64), np.array(faces, np.int64)


def read_poses(path: pathlib.Path, limit: int) -> np.ndarray:
    rows = [line.split("#")[0].split() for line in path.read_text().splitlines()]
    numbers = np.array([row for row in rows if row][:limit], dtype=float)
    poses = np.tile(np.eye(4), (len(numbers), 1, 1))
    poses[:, :3] = numbers.reshape(-1, 3, 4)
    return poses


def with_cbvh(a: tuple[Any, Any], b: tuple[Any, Any]) -> tuple[Ask, Ask]:
    import cbvh

    mesh_a, mesh_b = cbvh.bake(*a), cbvh.bake(*b)
    return lambda pose: mesh_a.collide(mesh_b, pose), lambda pose: mesh_a.distance(mesh_b, pose).distance


def with_fcl(a: tuple[Any, Any], b: tuple[Any, Any]) -> tuple[Ask, Ask]:
    import fcl

    def placed(vertices: np.ndarray, faces: np.ndarray) -> Any:
        model = fcl.BVHModel()
        model.beginModel(len(vertices), len(faces))
        model.addSubModel(vertices, faces)
        model.endModel()
        return fcl.CollisionObject(model, fcl.Transform())

    object_a, object_b = placed(*a), placed(*b)

    def collide(pose: np.ndarray) -> bool:
        object_b.setTransform(fcl.Transform(pose[:3, :3], pose[:3, 3]))
        request = fcl.CollisionRequest(num_max_contacts=1, enable_contact=False)
        return fcl.collide(object_a, object_b, request, fcl.CollisionResult()) > 0

    def distance(pose: np.ndarray) -> float:
        object_b.setTransform(fcl.Transform(pose[:3, :3], pose[:3, 3]))
        return fcl.distance(object_a, object_b, fcl.DistanceRequest(enable_nearest_points=True), fcl.DistanceResult())

    return collide, distance


def with_coal(a: tuple[Any, Any], b: tuple[Any, Any]) -> tuple[Ask, Ask]:
    import coal

    def model(vertices: np.ndarray, faces: np.ndarray) -> Any:
        made = coal.BVHModelOBBRSS()
        made.beginModel(len(faces), len(vertices))
        made.addVertices(vertices)
        made.addTriangles(faces)
        made.endModel()
        return made

    model_a, model_b, still = model(*a), model(*b), coal.Transform3s()

    def collide(pose: np.ndarray) -> bool:
        request = coal.CollisionRequest(coal.CollisionRequestFlag.NO_REQUEST, 1)
        request.break_distance = 0.0
        place = coal.Transform3s(pose[:3, :3], pose[:3, 3])
        return coal.collide(model_a, still, model_b, place, request, coal.CollisionResult()) > 0

    def distance(pose: np.ndarray) -> float:
        place = coal.Transform3s(pose[:3, :3], pose[:3, 3])
        return coal.distance(model_a, still, model_b, place, coal.DistanceRequest(True), coal.DistanceResult())

    return collide, distance


def with_trimesh(a: tuple[Any, Any], b: tuple[Any, Any]) -> tuple[Ask, Ask]:
    import trimesh

    manager = trimesh.collision.CollisionManager()
    for name, mesh in (("a", a), ("b", b)):
        manager.add_object(name, trimesh.Trimesh(*mesh, process=False))

    def collide(pose: np.ndarray) -> bool:
        manager.set_transform("b", pose)
        return manager.in_collision_internal()

    def distance(pose: np.ndarray) -> float:
        manager.set_transform("b", pose)
        return manager.min_distance_internal()

    return collide, distance


def timed(ask: Ask, poses: np.ndarray, budget: float) -> tuple[list[Any], list[int]]:
    """Answers, and the least nanoseconds of each pose in up to three rounds, until the budget in seconds is used up."""
    end = time.perf_counter() + budget
    answers = [ask(pose) for pose in poses]
    best: list[int] = []
    for _ in range(3):
        times = []
        for pose in poses:
            start = time.perf_counter_ns()
            ask(pose)
            times.append(time.perf_counter_ns() - start)
        best = [min(both) for both in zip(best, times)] if best else times
        if time.perf_counter() > end:
            break
    return answers, best


def compare(a: Any, b: Any, poses: np.ndarray, libraries: dict[str, tuple[Ask, Ask]], budget: float) -> Iterator[str]:
    """A row of the table for each mode and library."""
    import cbvh

    size = float(np.linalg.norm(np.ptp(a[0], axis=0)))
    for mode, place in (("collide", 0), ("distance", 1)):
        own, own_median = np.zeros(0), 0.0
        for name, asks in libraries.items():
            answers, times = timed(asks[place], poses, budget)
            found, median = np.maximum(np.array(answers, float), 0), float(np.median(times)) / 1e3
            if name == "cbvh":
                own, own_median = found, median
            off = np.abs(found - own[: len(found)])
            differ = int(np.sum(off > 1e-6 * own[: len(found)] + 1e-9 * size if place else off > 0))
            yield f"{mode} | {name} | {len(times)} | {median:.1f} | {median / own_median:.2f} | {differ}"
        mesh_a, mesh_b = cbvh.bake(*a), cbvh.bake(*b)
        ask = (mesh_a.collide, mesh_a.distance)[place]
        ask(mesh_b, poses)
        mean = float("inf")
        for _ in range(3):
            start = time.perf_counter()
            ask(mesh_b, poses)
            mean = min(mean, (time.perf_counter() - start) / len(poses) * 1e6)
        yield f"{mode} | cbvh, all at once, mean | {len(poses)} | {mean:.1f} | {mean / own_median:.2f} | 0"


def main() -> None:
    assert __doc__ is not None
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("pairs", type=pathlib.Path)
    parser.add_argument("--meshes", type=pathlib.Path, required=True)
    parser.add_argument("--poses", type=pathlib.Path, required=True)
    parser.add_argument("--presets", default="d0sep,d1")
    parser.add_argument("--limit", type=int, default=50)
    parser.add_argument("--budget", type=float, default=10.0, help="seconds per library, mode and preset")
    parser.add_argument("--only", help="names of pairs, with commas")
    arguments = parser.parse_args()
    every = {"cbvh": with_cbvh, "fcl": with_fcl, "coal": with_coal, "trimesh": with_trimesh}
    print("pair | preset | mode | library | poses | median us | times cbvh | differ", flush=True)
    print("|".join(["---"] * 8), flush=True)
    for line in arguments.pairs.read_text().splitlines():
        name, *files = line.split("#")[0].split() or [""]
        if not name or arguments.only and name not in arguments.only.split(","):
            continue
        meshes = {file: read_obj(arguments.meshes / file) for file in files}
        a, b = (meshes[file] for file in files)
        libraries = {}
        for library, make in every.items():
            try:
                importlib.import_module(library)
            except ImportError:
                continue
            libraries[library] = make(a, b)
        for preset in arguments.presets.split(","):
            poses = read_poses(arguments.poses / f"{name}_{preset}.txt", arguments.limit)
            for row in compare(a, b, poses, libraries, arguments.budget):
                print(f"{name} | {preset} | {row}", flush=True)


if __name__ == "__main__":
    main()
