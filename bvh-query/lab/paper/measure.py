"""Measures what paper.md of the notebook tells, and writes it as JSON: memory, bounds and times of five meshes in every layout.

Each mesh is asked about itself, in poses found from a seed: turned at random, it comes from a random direction until the gap is a
given part of the diagonal of its box. `cbvh query --bench` asks cbvh. compare.py asks Coal and FCL, and pqp.cpp asks PQP; each
runs in a process of its own. All answers are compared with those of cbvh.
"""

from __future__ import annotations

import argparse
import ctypes
import datetime
import importlib
import json
import multiprocessing
import pathlib
import platform
import re
import subprocess
import sys
from importlib import metadata
from typing import Any

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT / "bvh-query/python"))
import compare  # noqa: E402
import meshes  # noqa: E402
import predictors  # noqa: E402

PROFILES = ["dop6-u8", "dop6-f16", "dop14-u8", "dop14-f32", "dop26-u4", "dop26-u8-wide"]
TRIANGLES = ["f32", "packed"]
MODES = ["collide", "distance"]
GAPS = {"touching": 1e-6, "near": 1e-2, "far": 5e-2}  # of the diagonal of the mesh's box
LIBRARIES = {"coal": (compare.with_coal, "coal"), "fcl": (compare.with_fcl, "python-fcl")}
SEED = 1
SECONDS = 20.0  # for each question to another library
ROUNDS = 3  # in which all layouts take turns
PASSES = 3  # through the poses in each round


class Command:
    """The command cbvh, and the folder in which it works."""

    def __init__(self, path: str, folder: pathlib.Path) -> None:
        self.path, self.folder = path, folder

    def run(self, *arguments: Any) -> str:
        return subprocess.run([self.path, *map(str, arguments)], check=True, capture_output=True, text=True).stdout

    def bake(self, name: str, profile: str, triangles: str) -> pathlib.Path:
        file = self.folder / f"{name}.{profile}.{triangles}.cbvh"
        options = ("--profile", profile, "--triangles", triangles, "--no-ids", "--no-topology", "--quiet")
        self.run("bake", self.folder / f"{name}.obj", "-o", file, *options)
        return file

    def isa(self) -> str:
        still, mesh = self.folder / "still.txt", ROOT / "testdata/fclrob.obj"
        still.write_text("1 0 0 0  0 1 0 0  0 0 1 0\n")
        return json.loads(self.run("query", mesh, mesh, still, "--bench"))["isa"]

    def distances(self, file: pathlib.Path, poses: np.ndarray) -> np.ndarray:
        asked = self.folder / "asked.txt"
        np.savetxt(asked, poses.reshape(len(poses), 12), "%.17g")
        return np.array(self.run("query", file, file, asked, "--mode", "distance").split(), float)


def find_poses(command: Command, file: pathlib.Path, vertices: np.ndarray, count: int) -> dict[str, np.ndarray]:
    """Poses of a mesh in its own frame, [pose, row, column], for each gap: it comes nearer by as much as it is too far."""
    random = np.random.default_rng(SEED)
    low, high = vertices.min(0), vertices.max(0)
    size, middle, tried = float(np.linalg.norm(high - low)), (low + high) / 2, 2 * count
    rotations = np.linalg.qr(random.normal(size=(tried, 3, 3)))[0]
    rotations *= np.linalg.det(rotations)[:, None, None]
    directions = random.normal(size=(tried, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    along, found = np.full(tried, 1.1 * size), {}
    for name, gap in sorted(GAPS.items(), key=lambda named: -named[1]):
        for _ in range(100):
            moved = middle - rotations @ middle + along[:, None] * directions
            poses = np.concatenate([rotations, moved[:, :, None]], axis=2)
            beyond = command.distances(file, poses) - gap * size
            if np.max(beyond[along > 0]) < 1e-3 * gap * size:
                break
            along -= np.maximum(beyond, 0)
        # A direction along which the mesh goes through a hole of itself has no such pose.
        found[name] = poses[(beyond < 1e-3 * gap * size) & (along > 0)][:count]
    return found


def ask_cbvh(command: Command, files: dict[str, pathlib.Path], gaps: dict[str, pathlib.Path]) -> list[dict]:
    """Of each file, mode and gap: the least of the medians of all rounds, counts of tests, and a checksum of the answers."""
    best: dict[tuple, dict] = {}
    asked = ",".join(map(str, list(gaps.values()) * PASSES))
    for _ in range(ROUNDS):
        for layout, file in files.items():
            for mode in MODES:
                lines = command.run("query", file, file, asked, "--mode", mode, "--bench")
                for gap, line in zip(list(gaps) * PASSES, map(json.loads, lines.splitlines())):
                    row = {"layout": layout, "mode": mode, "gap": gap, "us": line["ns_median"] / 1e3}
                    row |= {"node_tests": line["node_tests"] / line["queries"], "answers": line["answers_xxh3"]}
                    if row["us"] < best.setdefault((layout, mode, gap), row)["us"]:
                        best[layout, mode, gap] = row
    for mode in MODES:
        for gap in gaps:
            answers = {row["answers"] for row in best.values() if (row["mode"], row["gap"]) == (mode, gap)}
            assert len(answers) == 1, f"layouts differ about {mode}, {gap}"
    for row in best.values():
        del row["answers"]
    return list(best.values())


def resident() -> int:
    """The bytes of this process in memory, without what it only keeps for later."""
    ctypes.CDLL(None).malloc_trim(0)
    return int(pathlib.Path("/proc/self/statm").read_text().split()[1]) * 4096


def ask_library(name: str, mesh: pathlib.Path, gaps: dict[str, np.ndarray]) -> tuple[float, list[dict]]:
    """The bytes per triangle that a library takes, and its answers and nanoseconds for each mode and gap."""
    vertices, faces = compare.read_obj(mesh)
    importlib.import_module(name)
    before = resident()
    asks = LIBRARIES[name][0]((vertices, faces), (vertices, faces))
    taken = (resident() - before) / (2 * len(faces))
    rows = []
    for mode, ask in zip(MODES, asks):
        for gap, poses in gaps.items():
            square = np.tile(np.eye(4), (len(poses), 1, 1))
            square[:, :3] = poses
            answers, ns = compare.timed(ask, square, SECONDS)
            rows.append({"mode": mode, "gap": gap, "answers": [float(answer) for answer in answers], "ns": ns})
    return taken, rows


def ask_pqp(program: str, mesh: pathlib.Path, gaps: dict[str, pathlib.Path]) -> tuple[float, list[dict]]:
    vertices, faces = compare.read_obj(mesh)
    vertices[faces].tofile(mesh.with_suffix(".triangles"))
    told = subprocess.run([program, mesh.with_suffix(".triangles"), *gaps.values()], check=True, capture_output=True, text=True)
    rows = [json.loads(line) for line in told.stdout.splitlines()]
    name_of = {str(path): gap for gap, path in gaps.items()}
    return rows[0]["bytes"] / len(faces), [row | {"gap": name_of[row["poses"]]} for row in rows]


def ask_others(arguments: argparse.Namespace, mesh: pathlib.Path, poses: dict, files: dict, truth: dict) -> list[dict]:
    """The medians of each other library, and how many of its answers differ."""
    found, size = [], float(np.linalg.norm(np.ptp(compare.read_obj(mesh)[0], axis=0)))
    for name in (["pqp"] if arguments.pqp else []) + list(arguments.libraries):
        if name == "pqp":
            taken, rows = ask_pqp(arguments.pqp, mesh, files)
        else:
            with multiprocessing.get_context("spawn").Pool(1) as process:
                taken, rows = process.apply(ask_library, (name, mesh, poses))
        for row in rows:
            exact, answers = truth[row["gap"]], np.maximum(np.array(row["answers"]), 0)
            wrong = answers > 0 if row["mode"] == "collide" else np.abs(answers - exact) > 1e-6 * exact + 1e-9 * size
            told = {"library": name, "bytes": taken, "mode": row["mode"], "gap": row["gap"]}
            told |= {"us": float(np.median(row["ns"])) / 1e3, "differ": int(np.sum(wrong)), "poses": len(answers)}
            found.append(told)
    return found


def measure(command: Command, arguments: argparse.Namespace, name: str) -> dict:
    mesh = command.folder / f"{name}.obj"
    files = {f"{profile} {kind}": command.bake(name, profile, kind) for profile in PROFILES for kind in TRIANGLES}
    sizes = {}
    for layout, file in files.items():
        told = json.loads(command.run("dump", file, "--json"))
        sizes[layout] = {section["kind"]: section["bytes"] for section in told["sections"]}
        sizes[layout] |= {"file": told["file_bytes"], "triangles": told["objects"][0]["triangles"]}
    poses = find_poses(command, files["dop26-u8-wide f32"], compare.read_obj(mesh)[0], arguments.poses)
    places = {gap: command.folder / f"{name}.{gap}.txt" for gap in GAPS}
    truth = {}
    for gap, path in places.items():
        np.savetxt(path, poses[gap].reshape(-1, 12), "%.17g")
        truth[gap] = command.distances(files["dop14-f32 f32"], poses[gap])
    return {
        "sizes": sizes,
        "bounds": predictors.study(files["dop14-f32 f32"]),
        "times": ask_cbvh(command, files, places),
        "others": ask_others(arguments, mesh, poses, places, truth),
    }


def short(value: Any) -> Any:
    """The same with floats of five digits, which is what the measurement is good for."""
    if isinstance(value, dict):
        return {key: short(one) for key, one in value.items()}
    if isinstance(value, list):
        return [short(one) for one in value]
    return float(f"{value:.5g}") if isinstance(value, float) else value


def processor() -> str:
    names = [line.split(":")[1].strip() for line in open("/proc/cpuinfo") if line.startswith(("model name", "cpu family"))]
    return f"{names[1]}, family {names[0]}" if len(names) > 1 else platform.machine()


def main() -> None:
    assert __doc__ is not None
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cbvh", required=True, help="the command cbvh")
    parser.add_argument("--folder", type=pathlib.Path, required=True, help="where meshes and files are kept")
    parser.add_argument("--out", type=pathlib.Path, required=True, help="the JSON file to write")
    parser.add_argument("--pqp", help="the program that pqp.cpp makes")
    parser.add_argument("--poses", type=int, default=100, help="poses per gap")
    parser.add_argument("--only", help="names of meshes, with commas")
    arguments = parser.parse_args()
    command, versions = Command(arguments.cbvh, arguments.folder), {"pqp": "1.3"} if arguments.pqp else {}
    for name, (_, package) in LIBRARIES.items():
        try:
            versions[name] = metadata.version(package)
        except metadata.PackageNotFoundError:
            print(f"{name}: skipped, pip install {package}", file=sys.stderr)
    arguments.libraries = [name for name in LIBRARIES if name in versions]
    found = meshes.all_meshes(arguments.folder, arguments.only and arguments.only.split(","))
    for name, mesh in found.items():
        print(f"{name}: {mesh['triangles']:,} triangles", file=sys.stderr)
        mesh |= measure(command, arguments, name)
    told = {"date": datetime.date.today().isoformat(), "processor": processor(), "isa": command.isa(), "libraries": versions}
    text = json.dumps(short(told | {"meshes": found}), default=float)
    arguments.out.write_text(re.sub(r"\s(?=\{|\"(sizes|bounds|times|others)\")", "\n", text) + "\n")


if __name__ == "__main__":
    main()
