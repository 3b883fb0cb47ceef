"""Prints the README's tables: cbvh beside Coal and FCL, on the same poses. `tables` installs what this needs and pins it.

The meshes are FCL's test pair of testdata, and balls with bumps (radius about 1, as in cbvh_testkit::ball). The poses follow from a
seed: B is turned at random, and moved along a random direction until it just touches A (collide), until the gap is 1 % of the size
of A (distance), or until it is halfway in (contacts). All libraries get the same 64-bit numbers, one pose per call.

A figure is the median over the poses of the least of three timed calls, in microseconds, of calls from Python; the last line says
what such a call costs. compare.py, whose code asks the libraries, says how each is asked.
"""

from __future__ import annotations

import argparse
import importlib
import importlib.metadata
import pathlib
import platform
import sys
from typing import Any, Callable

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "bvh-query/python"))
import cbvh  # noqa: E402
import compare  # noqa: E402

Mesh = tuple[np.ndarray, np.ndarray]
SEED = 1
MAX_CONTACTS = 2**31 - 1


def ball(triangles: int) -> Mesh:
    """A closed ball with bumps, as cbvh_testkit::ball makes it."""
    rows = max(2, round((1 + (1 + triangles) ** 0.5) / 2))
    columns = 2 * rows
    polar = np.pi * np.arange(1, rows)[:, None] / rows
    around = 2 * np.pi * np.arange(columns)[None, :] / columns
    bump = 1 + 0.1 * np.sin(5 * polar) * np.cos(7 * around)
    inner = bump[..., None] * np.stack(
        np.broadcast_arrays(np.sin(polar) * np.cos(around), np.sin(polar) * np.sin(around), np.cos(polar)), -1
    )
    vertices = np.concatenate([[[0, 0, 1]], inner.reshape(-1, 3), [[0, 0, -1]]])
    at = lambda row, column: 1 + (row - 1) * columns + column % columns  # noqa: E731
    row, column = (grid.ravel() for grid in np.mgrid[1 : rows - 1, 0:columns])
    a, b, c, d = at(row, column), at(row, column + 1), at(row + 1, column), at(row + 1, column + 1)
    ring, zero = np.arange(columns), np.zeros(columns, int)
    caps = [(zero, at(1, ring), at(1, ring + 1)), (zero + len(vertices) - 1, at(rows - 1, ring + 1), at(rows - 1, ring))]
    faces = np.concatenate([np.stack(corners, -1) for corners in [*caps, (a, c, b), (b, c, d)]])
    return vertices.astype(np.float32).astype(np.float64), faces.astype(np.int64)


def poses(a: Mesh, b: Mesh, count: int) -> dict[str, np.ndarray]:
    """Poses of B in the frame of A, for each question."""
    random = np.random.default_rng(SEED)
    mesh_a, mesh_b = cbvh.bake(*a), cbvh.bake(*b)
    low, high = a[0].min(0), a[0].max(0)
    size = float(np.linalg.norm(high - low))
    reach = size + float(np.linalg.norm(np.ptp(b[0], axis=0)))
    middle_a, middle_b = (low + high) / 2, (b[0].min(0) + b[0].max(0)) / 2
    found: dict[str, list[np.ndarray]] = {"collide": [], "distance": [], "contacts": []}
    while len(found["collide"]) < count:
        rotation, upper = np.linalg.qr(random.normal(size=(3, 3)))
        rotation *= np.sign(np.diag(upper))
        rotation[:, 0] *= np.sign(np.linalg.det(rotation))
        direction = random.normal(size=3)
        direction /= np.linalg.norm(direction)

        def placed(along: float) -> np.ndarray:
            pose = np.eye(4)
            pose[:3, :3] = rotation
            pose[:3, 3] = middle_a - rotation @ middle_b + along * direction
            return pose

        def outermost(gap: float) -> float:
            near, far = 0.0, reach
            for _ in range(52):
                middle = (near + far) / 2
                if mesh_a.distance(mesh_b, placed(middle)).distance > gap:
                    far = middle
                else:
                    near = middle
            return near

        touching = outermost(0.0)
        if touching > 0:
            found["collide"].append(placed(touching))
            found["distance"].append(placed(outermost(0.01 * size)))
            found["contacts"].append(placed(touching / 2))
    return {mode: np.array(all_poses) for mode, all_poses in found.items()}


def contacts(name: str, a: Mesh, b: Mesh) -> Callable[[np.ndarray], int]:
    """Returns what lists all contacts, and answers with their number."""
    if name == "cbvh":
        mesh_a, mesh_b = cbvh.bake(*a), cbvh.bake(*b)
        return lambda pose: len(mesh_a.contacts(mesh_b, pose))
    if name == "coal":
        import coal

        models = []
        for vertices, faces in (a, b):
            model = coal.BVHModelOBBRSS()
            model.beginModel(len(faces), len(vertices))
            model.addVertices(vertices)
            model.addTriangles(faces)
            model.endModel()
            models.append(model)

        def ask(pose: np.ndarray) -> int:
            request = coal.CollisionRequest(coal.CollisionRequestFlag.CONTACT, MAX_CONTACTS)
            request.break_distance = 0.0
            place, result = coal.Transform3s(pose[:3, :3], pose[:3, 3]), coal.CollisionResult()
            coal.collide(models[0], coal.Transform3s(), models[1], place, request, result)
            return int(result.numContacts())

        return ask
    import fcl

    objects = []
    for vertices, faces in (a, b):
        model = fcl.BVHModel()
        model.beginModel(len(vertices), len(faces))
        model.addSubModel(vertices, faces)
        model.endModel()
        objects.append(fcl.CollisionObject(model, fcl.Transform()))

    def ask_fcl(pose: np.ndarray) -> int:
        objects[1].setTransform(fcl.Transform(pose[:3, :3], pose[:3, 3]))
        request = fcl.CollisionRequest(num_max_contacts=MAX_CONTACTS, enable_contact=True)
        result = fcl.CollisionResult()
        fcl.collide(objects[0], objects[1], request, result)
        return len(result.contacts)

    return ask_fcl


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--poses", type=int, default=100, help="poses per question")
    parser.add_argument("--only", help="names of pairs, with commas: fcl, small, large")
    arguments = parser.parse_args()
    fcl_pair = [compare.read_obj(ROOT / f"testdata/{name}.obj") for name in ("fclenv", "fclrob")]
    pairs = {
        "fcl": ("FCL's test pair", fcl_pair),
        "small": ("balls with bumps", [ball(10_000), ball(10_000)]),
        "large": ("balls with bumps", [ball(200_000), ball(200_000)]),
    }
    made = {"cbvh": compare.with_cbvh, "coal": compare.with_coal, "fcl": compare.with_fcl}
    for name, package in (("coal", "coal"), ("fcl", "python-fcl")):
        try:
            importlib.import_module(name)
        except ImportError:
            del made[name]
            print(f"{name}: skipped, pip install {package}", file=sys.stderr)
    packages = {"cbvh": "cbvh", "coal": "coal", "fcl": "python-fcl"}
    versions = ", ".join(f"{packages[name]} {importlib.metadata.version(packages[name])}" for name in made)
    print(f"Median microseconds per query over {arguments.poses} poses, on one core of {platform.machine()}: {versions}\n")
    titles = [f"{mode}{'' if name == 'cbvh' else ' ' + name}" for mode in ("collide", "distance", "contacts") for name in made]
    print("| mesh A, mesh B | triangles | " + " | ".join(titles) + " |", flush=True)
    print("|" + "---|" * (len(titles) + 2), flush=True)
    differ, overhead = 0, 0.0
    for key, (title, (a, b)) in pairs.items():
        if arguments.only and key not in arguments.only.split(","):
            continue
        asked, size = poses(a, b, arguments.poses), float(np.linalg.norm(np.ptp(a[0], axis=0)))
        cells = []
        for mode in asked:
            own = np.zeros(0)
            for name, make in made.items():
                ask = contacts(name, a, b) if mode == "contacts" else make(a, b)[mode == "distance"]
                answers, times = compare.timed(ask, asked[mode], 60.0)
                cells.append(f"{np.median(times) / 1e3:.1f}")
                found = np.maximum(np.array(answers, float), 0)
                if name == "cbvh":
                    own = found
                elif mode != "contacts":
                    # Of contacts, other libraries report other numbers per pair of triangles.
                    off = np.abs(found - own)
                    differ += int(np.sum(off > (1e-6 * own + 1e-9 * size if mode == "distance" else 0)))
        print(f"| {title} | {len(a[1]):,} and {len(b[1]):,} | " + " | ".join(cells) + " |", flush=True)
        far = np.eye(4)
        far[:3, 3] = 100 * size
        overhead = float(np.median(compare.timed(compare.with_cbvh(a, b)[0], np.array([far] * 100), 1.0)[1])) / 1e3
    print(f"\nA call of cbvh from Python costs {overhead:.1f}. Answers that differ from those of cbvh: {differ}")


if __name__ == "__main__":
    main()
