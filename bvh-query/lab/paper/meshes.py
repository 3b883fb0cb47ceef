"""Gets the five meshes of paper.md of the notebook, the nearest to those of the paper that anyone can get, and writes them as OBJ.

Robots come from PyPI and from a git repository, the space station from another one. Each is merged into one mesh, at zero
configuration, with its coordinates rounded to f32. What cannot be had is left out, with a message.
"""

from __future__ import annotations

import pathlib
import struct
import subprocess
import sys
import tempfile
import zipfile
from typing import Iterator
from xml.etree import ElementTree

import numpy as np

Mesh = tuple[np.ndarray, np.ndarray]
ROBOTS = "cmeel.prefix/share/example-robot-data/robots"
ROBOT_DATA = "example-robot-data==6.0.0"
HAND = "gymnasium_robotics/envs/assets"
PIP = ["-m", "pip", "download", "--quiet", "--disable-pip-version-check", "--no-deps", "--only-binary", ":all:"]
CLONE = ["git", "clone", "--quiet", "--depth", "1", "--filter=blob:none", "--sparse"]
# What each mesh is, its terms, where it comes from (a package of PyPI, or a git repository and folders of it), and its main file.
SOURCES = {
    "station": (
        "Skylab by Shrox, from Celestia",
        "CC BY 4.0",
        ("https://github.com/CelestiaProject/CelestiaContent", "extras-standard/skylab"),
        "extras-standard/skylab/models/skylab.3ds",
    ),
    "hand": ("Shadow hand", "Apache-2.0", ("gymnasium-robotics==1.4.2",), f"{HAND}/hand/reach.xml"),
    "walker": ("Talos, a biped", "Apache-2.0", (ROBOT_DATA,), f"{ROBOTS}/talos_data/robots/talos_full_v2.urdf"),
    "dog": ("Unitree A1", "MPL-2.0", (ROBOT_DATA,), f"{ROBOTS}/a1_description/urdf/a1.urdf"),
    "nao": (
        "NAO V4.0",
        "BSD-2-Clause",
        ("https://github.com/jrl-umi3218/nao_description", "meshes", "urdf"),
        "urdf/nao.urdf",
    ),
}


def fetched(source: tuple[str, ...], folder: pathlib.Path) -> pathlib.Path:
    """Returns the folder with the files of a source, which is fetched first if it is not there."""
    address, *parts = source
    place = folder / address.split("/")[-1]
    if not place.exists():
        with tempfile.TemporaryDirectory(dir=folder) as scratch:
            made = pathlib.Path(scratch) / "made"
            if parts:
                subprocess.run([*CLONE, address, made], check=True)
                subprocess.run(["git", "-C", made, "sparse-checkout", "set", *parts], check=True)
            else:
                subprocess.run([sys.executable, *PIP, "-d", scratch, address], check=True)
                (wheel,) = pathlib.Path(scratch).glob("*.whl")
                zipfile.ZipFile(wheel).extractall(made)
            made.rename(place)
    return place


def placed(origin: ElementTree.Element | None) -> np.ndarray:
    """The matrix of an `origin` of a URDF file."""
    told = {} if origin is None else origin.attrib
    place, turn = ([float(x) for x in told.get(name, "0 0 0").split()] for name in ("xyz", "rpy"))
    (sr, sp, sy), (cr, cp, cy) = np.sin(turn), np.cos(turn)
    matrix = np.eye(4)
    matrix[:3, :3] = [
        [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
        [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
        [-sp, cp * sr, cp * cr],
    ]
    matrix[:3, 3] = place
    return matrix


def of_urdf(path: pathlib.Path) -> Iterator[Mesh]:
    """The visual meshes of a robot. At zero configuration, joints only place their links."""
    import trimesh

    robot, root = ElementTree.parse(path).getroot(), path.parents[1]
    joints = {joint.find("child").get("link"): joint for joint in robot.iterfind("joint")}

    def link_placed(name: str) -> np.ndarray:
        joint = joints.get(name)
        return np.eye(4) if joint is None else link_placed(joint.find("parent").get("link")) @ placed(joint.find("origin"))

    for link in robot.iterfind("link"):
        for visual in link.iterfind("visual"):
            mesh = visual.find("geometry/mesh")
            if mesh is None:
                print(f"{path.name}: skipped a visual of {link.get('name')} that is no mesh", file=sys.stderr)
                continue
            parts = mesh.get("filename").removeprefix("package://").split("/")
            tails = ["/".join(parts[k:]) for k in range(len(parts))]
            file = next(base / tail for tail in tails for base in (root.parent, root) if (base / tail).is_file())
            loaded = trimesh.load(file, force="mesh", process=False)
            scale = np.array([float(x) for x in (mesh.get("scale") or "1 1 1").split()])
            matrix = link_placed(link.get("name")) @ placed(visual.find("origin"))
            yield loaded.vertices * scale @ matrix[:3, :3].T + matrix[:3, 3], loaded.faces


def of_mujoco(path: pathlib.Path) -> Iterator[Mesh]:
    """The visual meshes of a model of MuJoCo, which are those that take no part in contacts."""
    import mujoco

    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    for geom in range(model.ngeom):
        mesh = model.geom_dataid[geom]
        if model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_MESH and model.geom_contype[geom] == 0:
            vertices = model.mesh_vert[model.mesh_vertadr[mesh] :][: model.mesh_vertnum[mesh]]
            faces = model.mesh_face[model.mesh_faceadr[mesh] :][: model.mesh_facenum[mesh]]
            yield vertices @ data.geom_xmat[geom].reshape(3, 3).T + data.geom_xpos[geom], faces


def of_3ds(path: pathlib.Path) -> Iterator[Mesh]:
    """The meshes of a 3DS file: chunks of a number, a length and contents, some of which are chunks again."""
    data = path.read_bytes()

    def meshes(at: int, end: int, vertices: list[np.ndarray]) -> Iterator[Mesh]:
        while at + 6 <= end:
            kind, length = struct.unpack_from("<HI", data, at)
            inside, count = at + 6, struct.unpack_from("<H", data, min(at + 6, end - 2))[0]
            if kind in (0x4D4D, 0x3D3D, 0x4100):  # the file, the model, a mesh
                yield from meshes(inside, at + length, [])
            elif kind == 0x4000:  # an object, after its name
                yield from meshes(data.index(b"\0", inside) + 1, at + length, [])
            elif kind == 0x4110:
                vertices.append(np.frombuffer(data, "<f4", 3 * count, inside + 2).reshape(-1, 3))
            elif kind == 0x4120:
                yield vertices[0], np.frombuffer(data, "<u2", 4 * count, inside + 2).reshape(-1, 4)[:, :3]
            at += length

    yield from meshes(0, len(data), [])


READERS = {".urdf": of_urdf, ".xml": of_mujoco, ".3ds": of_3ds}


def merged(parts: Iterator[Mesh]) -> Mesh:
    """One mesh of all parts, in f32, with equal vertices made one."""
    corners = np.concatenate([np.asarray(vertices, np.float32)[faces] for vertices, faces in parts]) + np.float32(0)
    vertices, faces = np.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
    return vertices, faces.reshape(-1, 3)


def all_meshes(folder: pathlib.Path, only: list[str] | None) -> dict[str, dict]:
    """Writes NAME.obj for each mesh that can be had, and returns what each one is."""
    folder.mkdir(parents=True, exist_ok=True)
    found = {}
    for name, (what, terms, source, main) in SOURCES.items():
        if only and name not in only:
            continue
        try:
            vertices, faces = merged(READERS[pathlib.Path(main).suffix](fetched(source, folder) / main))
        except (OSError, ImportError, StopIteration, subprocess.CalledProcessError) as error:
            print(f"{name}: skipped, {what} cannot be had here: {error}", file=sys.stderr)
            continue
        with (folder / f"{name}.obj").open("w") as file:
            np.savetxt(file, vertices, "v %.17g %.17g %.17g")  # exactly the f32, also for those who read f64
            np.savetxt(file, faces + 1, "f %d %d %d")
        found[name] = {"what": what, "terms": terms, "source": source[0], "triangles": len(faces)}
    return found
