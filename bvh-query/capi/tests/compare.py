"""Compares the answers of the C interface with those of the command, bit for bit.

    compare.py ANSWERS

ANSWERS is the program that `answers.c` makes, and the environment variable CBVH names the command. Questions are about
the bundled meshes and, if there is a folder `shared` beside the checkout, about the meshes, motions, probes and scenes
there.
"""

import array
import math
import os
import pathlib
import random
import struct
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[3]
TESTDATA, SHARED = ROOT / "testdata", ROOT.parent / "shared"
ANSWERS = sys.argv[1]
COMMAND = os.environ["CBVH"]
# What the command prints for the numbers of `cbvh_outcome`.
OUTCOMES = ["free", "hit", "near"]

CUBE_FACES = ["1 3 4 2", "5 6 8 7", "1 2 6 5", "3 7 8 4", "1 5 7 3", "2 4 8 6"]


def run(*command):
    """The standard output of a program, which must succeed."""
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"{' '.join(map(str, command))}: failed with {done.returncode}\n{done.stderr}")
    return done.stdout


def numbers_of(path, limit):
    """The first rows of a text file of numbers, without what follows a #."""
    rows = []
    with open(path) as file:
        for line in file:
            fields = line.split("#")[0].split()
            if fields:
                rows.append([float(field) for field in fields])
            if len(rows) == limit:
                break
    return rows


class Comparison:
    """A folder for files, and what was asked."""

    def __init__(self, folder):
        self.folder, self.questions, self.values = folder, 0, {}

    def bake(self, mesh, *options):
        baked = self.folder / f"{mesh.parent.name}-{mesh.stem}{'-'.join(options)}.cbvh"
        if not baked.exists():
            run(COMMAND, "bake", mesh, "-o", baked, "-q", *options)
        return baked

    def doubles(self, name, rows):
        path = self.folder / name
        path.write_bytes(array.array("d", [number for row in rows for number in row]).tobytes())
        return path

    def command(self, *arguments):
        """The answers of the command: the fields of each line but the time."""
        raw = self.folder / "raw.txt"
        run(COMMAND, *arguments, "--out", raw)
        lines = [line.split() for line in raw.read_text().splitlines()]
        return [line[:-1] for line in lines if line and not line[0].startswith("#")]

    def check(self, mode, of_command, *arguments):
        """Compares the answers of the C program with numbers."""
        lines = [line.split() for line in run(ANSWERS, mode, *arguments).splitlines()]
        expected = [[struct.pack(">d", number).hex() for number in row] for row in of_command]
        if lines != expected or not expected:
            wrong = [k for k in range(len(lines)) if k >= len(expected) or lines[k] != expected[k]]
            place = f"first question {wrong[0]}: {lines[wrong[0]]}" if wrong else f"{len(expected)} expected"
            sys.exit(f"{mode} {' '.join(map(str, arguments))}: {len(wrong)} of {len(lines)} answers differ, {place}")
        self.questions += len(lines)
        self.values.setdefault(mode, set()).update(number for row in lines for number in row)

    def pairs(self, meshes, poses, limit, within, *options):
        """All questions about two meshes."""
        files = [self.bake(mesh, *options) for mesh in meshes]
        numbers = self.doubles("poses", numbers_of(poses, limit))
        for mode in ("collide", "contacts", "distance", "within", "relation"):
            distance = ["--within", within] if mode == "within" else []
            found = self.command("query", *files, poses, "--mode", mode, "--limit", limit, *distance)
            self.check(mode, [[float(field) for field in line] for line in found], *files, numbers, within)

    def motions(self, meshes, motions, limit, clearance):
        files = [self.bake(mesh) for mesh in meshes]
        numbers = self.doubles("motions", numbers_of(motions, limit))
        found = self.command("motion", *files, motions, "--limit", limit, "--clearance", clearance)
        rows = [[float(OUTCOMES.index(line[0])), *map(float, line[1:] or [0, 0])] for line in found]
        self.check("motion", rows, *files, numbers, clearance)

    def probes(self, mesh, points, rays, segments, limit):
        file = self.bake(mesh)
        for mode, probes in (("closest", points), ("side", points), ("ray", rays), ("segment", segments)):
            numbers = self.doubles("probes", numbers_of(probes, limit))
            found = [float(line[0]) for line in self.command("probe", file, probes, "--mode", mode, "--limit", limit)]
            self.check(mode, [[number] for number in found], file, numbers)

    def scene(self, scene, frames, limit, within):
        """All questions about a scene in words, frame by frame."""
        meshes, names, files, worlds, moving, allowed = {}, [], [], [], [], []
        for line in scene.read_text().splitlines():
            word, *fields = line.split("#")[0].split() or [""]
            if word == "mesh":
                meshes[fields[0]] = self.bake(scene.parent / fields[1])
            elif word == "instance":
                names.append(fields[0])
                files.append(meshes[fields[1]])
                worlds.append([float(field) for field in fields[2:14]])
            elif word == "moving":
                moving += fields
            elif word == "allow":
                allowed.append([names.index(name) for name in fields])
        # The program gives poses to what moves in the order of instances.
        if sorted(moving, key=names.index) != moving:
            sys.exit(f"{scene}: expected what moves in the order of instances, found another order")
        lines = [f"{file} {int(name in moving)}" for name, file in zip(names, files)]
        lines += [f"allow {a} {b}" for a, b in allowed]
        words = self.folder / "scene.txt"
        words.write_text("\n".join(lines) + "\n")
        numbers = self.doubles("worlds", worlds), self.doubles("frames", numbers_of(frames, limit))
        for mode in ("collide", "pairs", "distance", "within"):
            distance = ["--within", within] if mode == "within" else []
            found = self.command("scene", scene, frames, "--mode", mode, "--limit", limit, *distance)
            self.check(f"scene-{mode}", [[float(line[0])] for line in found], words, *numbers, within)


def random_pose(source, reach, offset):
    """Twelve numbers: a random rotation, of a quaternion, and a translation."""
    q = [source.gauss(0, 1) for _ in range(4)]
    length = math.sqrt(sum(x * x for x in q))
    x, y, z, w = (c / length for c in q)
    rotation = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    return [n for row, at in zip(rotation, offset) for n in (*row, at + source.uniform(-reach, reach))]


def write_rows(path, rows):
    path.write_text("".join(" ".join(map(repr, row)) + "\n" for row in rows))
    return path


def bundled(comparison):
    """Questions about the meshes of FCL's tests, some of every outcome."""
    source, offset = random.Random(7), (300, -1600, -500)
    folder, meshes = comparison.folder, [TESTDATA / "fclenv.obj", TESTDATA / "fclrob.obj"]
    poses = write_rows(folder / "poses.txt", [random_pose(source, 1200, offset) for _ in range(200)])
    for triangles in ("f32", "packed"):
        comparison.pairs(meshes, poses, 200, 200.0, "--triangles", triangles)
    rows = [random_pose(source, 1200, offset) + random_pose(source, 1200, offset) for _ in range(40)]
    for clearance in (0.0, 3.0):
        comparison.motions(meshes, write_rows(folder / "motions.txt", rows), 40, clearance)
    points = [[source.uniform(-60, 60) for _ in range(3)] for _ in range(200)]
    rays = [[*point, *(source.gauss(0, 1) for _ in range(3))] for point in points]
    segments = [[*one, *other] for one, other in zip(points, reversed(points))]
    files = [write_rows(folder / f"{name}.txt", rows) for name, rows in zip("prs", (points, rays, segments))]
    comparison.probes(meshes[1], *files, 200)
    # Neither of these meshes is closed: points are inside and outside a cube.
    corners = "".join(f"v {k & 1} {k >> 1 & 1} {k >> 2}\n" for k in range(8))
    cube = folder / "cube.obj"
    cube.write_text(corners + "".join(f"f {face}\n" for face in CUBE_FACES))
    for file, rows in zip(files, (points, rays, segments)):
        write_rows(file, [[number / 50 for number in row] for row in rows])
    comparison.probes(cube, *files, 200)
    instances = ["mesh a fclenv.obj", "mesh b fclrob.obj", "instance wall a 1 0 0 0 0 1 0 0 0 0 1 0"]
    worlds = [[" ".join(map(repr, random_pose(source, 1200, offset))) for _ in range(3)] for _ in range(20)]
    instances += [f"instance robot{k} b {world}" for k, world in enumerate(worlds[0])]
    instances += ["moving robot0 robot1 robot2", "allow robot0 robot1"]
    for mesh in meshes:
        (folder / mesh.name).write_bytes(mesh.read_bytes())
    (folder / "cell.scene").write_text("\n".join(instances) + "\n")
    (folder / "frames.txt").write_text("".join(" ".join(row) + "\n" for row in worlds))
    comparison.scene(folder / "cell.scene", folder / "frames.txt", 20, 400.0)
    for mode in ("collide", "contacts", "distance", "within", "relation", "motion", "closest", "side", "ray", "segment",
                 "scene-collide", "scene-pairs", "scene-distance", "scene-within"):
        if len(comparison.values[mode]) < 2:
            sys.exit(f"{mode}: expected questions with several answers, found one answer to all")


def shared(comparison):
    """All poses of each open pair in all modes, and questions about motions, probes and a scene."""
    for line in (SHARED / "poses" / "pairs.txt").read_text().splitlines():
        pair, *meshes = line.split()
        for poses in sorted((SHARED / "poses").glob(f"{pair}_*.txt")):
            comparison.pairs([SHARED / "meshes" / mesh for mesh in meshes], poses, 100, 0.05)
    for pair, *meshes in (("fcl", "fclenv", "fclrob"), ("bunny", "bunny", "bunny")):
        for kind in ("short", "slide", "spin", "long"):
            files = [SHARED / "meshes" / f"{mesh}.obj" for mesh in meshes]
            comparison.motions(files, SHARED / "motions" / f"{pair}_{kind}.txt", 10, 0.0)
    for mesh in ("apollo", "bunny", "nao"):
        probes = [SHARED / "probes" / f"{mesh}_{kind}.txt" for kind in ("points", "rays", "segments")]
        comparison.probes(SHARED / "meshes" / f"{mesh}.obj", *probes, 100)
    comparison.scene(SHARED / "scenes" / "arm.scene", SHARED / "scenes" / "arm_frames.txt", 10, 0.05)


def main():
    with tempfile.TemporaryDirectory() as name:
        comparison = Comparison(pathlib.Path(name))
        bundled(comparison)
        print(f"bundled meshes: {comparison.questions} answers with the bits of the command")
        if not SHARED.exists():
            print(f"shared meshes: skipped, there is no folder {SHARED}")
            return
    with tempfile.TemporaryDirectory() as name:
        comparison = Comparison(pathlib.Path(name))
        shared(comparison)
        print(f"shared meshes: {comparison.questions} answers with the bits of the command")


if __name__ == "__main__":
    main()
