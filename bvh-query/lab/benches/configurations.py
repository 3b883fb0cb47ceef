"""Times configurations of robots beside Pinocchio with Coal, and compares the pairs in contact, pair by pair.

    pip install pin example-robot-data mujoco, and the module cbvh
    RAYON_NUM_THREADS=1 taskset -c 0 python configurations.py [ROBOT ...] [--mjcf FILE ...] [--visual] [--rows 2000]

Robots are those of example-robot-data, with the pairs of their SRDF, and models of MuJoCo, such as those of
mujoco-menagerie. A model of MuJoCo becomes a URDF that both sides read: its hinges and slides, and the geoms that collide or
are seen, meshes as they are and not as their hulls. Of its pairs, those are asked that MuJoCo asks and that do not touch in
most configurations. All times are CPU time; cbvh takes all configurations in one call, Pinocchio one per call from Python.
"""

import argparse
import importlib.metadata
import itertools
import pathlib
import tempfile
import time

import mujoco
import numpy as np
import pinocchio

import cbvh

ROBOTS = {
    "pr2": ("pr2_description/urdf/pr2.urdf", "pr2_description/srdf/pr2.srdf"),
    "xarm7": ("xarm_description/urdf/xarm7.urdf", "xarm_description/srdf/xarm7.srdf"),
    "solo12": ("solo_description/robots/solo12.urdf", "solo_description/srdf/solo.srdf"),
    "go2": ("go2_description/urdf/go2.urdf", "go2_description/srdf/go2.srdf"),
    "talos": ("talos_data/robots/talos_reduced.urdf", "talos_data/srdf/talos.srdf"),
    "panda": ("panda_description/urdf/panda.urdf", "panda_description/srdf/panda.srdf"),
}


def files_of(robot):
    share = importlib.metadata.distribution("example-robot-data").locate_file("cmeel.prefix/share")
    folder = pathlib.Path(str(share)) / "example-robot-data" / "robots"
    urdf, srdf = ROBOTS[robot]
    return folder / urdf, folder / srdf, [str(share)]


def origin(position, matrix):
    """The URDF's element of a pose."""
    roll, pitch, yaw = pinocchio.rpy.matrixToRpy(np.asarray(matrix, dtype=float).reshape(3, 3))
    numbers = lambda values: " ".join(repr(float(value)) for value in values)
    return f'<origin xyz="{numbers(position)}" rpy="{numbers((roll, pitch, yaw))}"/>'


def matrix_of(quaternion):
    matrix = np.empty(9)
    mujoco.mju_quat2Mat(matrix, quaternion)
    return matrix


def shapes_of(model, geom, folder):
    """A geom as the URDF's elements, each with its height on the geom's axis. Writes the mesh of a geom into `folder`.

    Pinocchio reads no capsules: they are a cylinder and two spheres. Planes and the like are left out.
    """
    kind, size = mujoco.mjtGeom(model.geom_type[geom]), [float(value) for value in model.geom_size[geom]]
    if kind == mujoco.mjtGeom.mjGEOM_MESH:
        mesh = model.mesh(model.geom_dataid[geom])
        file = folder / f"mesh{model.geom_dataid[geom]}.obj"
        if not file.exists():
            vertices, faces = (of[at[0] : at[0] + count[0]] for of, at, count in (
                (model.mesh_vert, mesh.vertadr, mesh.vertnum), (model.mesh_face, mesh.faceadr, mesh.facenum)))  # fmt: skip
            lines = ["v %.9g %.9g %.9g" % tuple(vertex) for vertex in vertices]
            lines += ["f %d %d %d" % tuple(face) for face in faces + 1]
            file.write_text("\n".join(lines) + "\n")
        return [(f'<mesh filename="{file}"/>', 0)]
    if kind == mujoco.mjtGeom.mjGEOM_SPHERE:
        return [(f'<sphere radius="{size[0]!r}"/>', 0)]
    if kind in (mujoco.mjtGeom.mjGEOM_CAPSULE, mujoco.mjtGeom.mjGEOM_CYLINDER):
        ends = (-size[1], size[1]) if kind == mujoco.mjtGeom.mjGEOM_CAPSULE else ()
        cylinder = (f'<cylinder radius="{size[0]!r}" length="{2 * size[1]!r}"/>', 0)
        return [cylinder, *((f'<sphere radius="{size[0]!r}"/>', end) for end in ends)]
    if kind == mujoco.mjtGeom.mjGEOM_BOX:
        return [(f'<box size="{" ".join(repr(2 * side) for side in size)}"/>', 0)]
    return []


def without_absent_meshes(file):
    """The model's specification without the geoms and meshes whose files are missing."""
    specification = mujoco.MjSpec.from_file(str(file))
    folder = pathlib.Path(file).parent / specification.meshdir
    absent = {mesh.name or pathlib.Path(mesh.file).stem for mesh in specification.meshes if not (folder / mesh.file).exists()}
    for geom in list(specification.geoms):
        if geom.meshname in absent:
            specification.delete(geom)
    for mesh in list(specification.meshes):
        if (mesh.name or pathlib.Path(mesh.file).stem) in absent:
            specification.delete(mesh)
    return specification


def files_of_mjcf(file, folder, visual):
    """Writes a model of MuJoCo as a URDF and an SRDF into `folder`."""
    model = without_absent_meshes(file).compile()
    name_of = [f"link{body}" for body in range(model.nbody)]
    text = ['<robot name="mjcf">']
    for body in range(model.nbody):
        text.append(f'<link name="{name_of[body]}">')
        for geom in np.flatnonzero(model.geom_bodyid == body):
            collides = bool(model.geom_contype[geom] or model.geom_conaffinity[geom])
            matrix = matrix_of(model.geom_quat[geom])
            for shape, height in shapes_of(model, geom, folder) if collides != visual else []:
                pose = origin(model.geom_pos[geom] + height * matrix[2::3], matrix)
                text.append(f"<collision>{pose}<geometry>{shape}</geometry></collision>")
        text.append("</link>")
        if body == 0:
            continue
        joints = [j for j in np.flatnonzero(model.jnt_bodyid == body) if model.jnt_type[j] >= int(mujoco.mjtJoint.mjJNT_SLIDE)]
        # A joint turns about a point of its body: there and back again.
        parent, at, matrix = name_of[model.body_parentid[body]], model.body_pos[body], matrix_of(model.body_quat[body])
        for joint in joints:
            child, place = f"{name_of[body]}.{joint}", model.jnt_pos[joint]
            kind = "prismatic" if model.jnt_type[joint] == int(mujoco.mjtJoint.mjJNT_SLIDE) else "revolute"
            low, high = model.jnt_range[joint] if model.jnt_limited[joint] else (-np.pi, np.pi)
            axis = " ".join(repr(float(value)) for value in model.jnt_axis[joint])
            text.append(f'<link name="{child}"/><joint name="joint{joint}" type="{kind}">')
            text.append(f'{origin(at + matrix.reshape(3, 3) @ place, matrix)}<parent link="{parent}"/><child link="{child}"/>')
            text.append(f'<axis xyz="{axis}"/><limit lower="{low}" upper="{high}" effort="1" velocity="1"/></joint>')
            parent, at, matrix = child, -place, np.eye(3)
        text.append(f'<joint name="fixed{body}" type="fixed">{origin(at, matrix)}<parent link="{parent}"/><child link="{name_of[body]}"/></joint>')
    urdf, srdf = folder / "robot.urdf", folder / "robot.srdf"
    urdf.write_text("\n".join([*text, "</robot>"]))

    # The pairs that MuJoCo does not ask about: links joined without a joint, parents and children, excluded pairs.
    excluded = {(int(signature) >> 16, int(signature) & 0xFFFF) for signature in model.exclude_signature}
    weld, above = model.body_weldid, model.body_weldid[model.body_parentid[model.body_weldid]]
    disabled = [
        f'<disable_collisions link1="{name_of[a]}" link2="{name_of[b]}" reason="mjcf"/>'
        for a, b in itertools.combinations(range(model.nbody), 2)
        if weld[a] == weld[b] or above[a] == weld[b] or above[b] == weld[a] or {(a, b), (b, a)} & excluded
    ]
    srdf.write_text("\n".join(['<robot name="mjcf">', *disabled, "</robot>"]))
    return urdf, srdf, [str(folder)]


class Pinocchio:
    def __init__(self, robot, urdf, dirs):
        self.model = pinocchio.buildModelFromUrdf(str(urdf), mimic=True)
        self.data = self.model.createData()
        kind = pinocchio.GeometryType.COLLISION
        self.geometry = pinocchio.buildGeomFromUrdf(self.model, str(urdf), kind, package_dirs=dirs)
        body = [self.model.frames[part.parentFrame].name for part in self.geometry.geometryObjects]
        asked = {frozenset(pair) for pair in robot.pairs}
        for a, b in itertools.combinations(range(len(body)), 2):
            if frozenset((body[a], body[b])) in asked:
                self.geometry.addCollisionPair(pinocchio.CollisionPair(a, b))
        self.links = [frozenset((body[pair.first], body[pair.second])) for pair in self.geometry.collisionPairs]
        assert set(self.links) == asked, set(self.links) ^ asked
        self.results = self.geometry.createData()
        for request in self.results.collisionRequests:
            request.break_distance = request.security_margin = 0.0
        self.names = list(robot.joints)

    def configuration(self, row):
        configuration = pinocchio.neutral(self.model)
        for name, value in zip(self.names, row):
            joint = self.model.joints[self.model.getJointId(name)]
            numbers = [value] if joint.nq == 1 else [np.cos(value), np.sin(value)]
            configuration[joint.idx_q : joint.idx_q + joint.nq] = numbers
        return configuration

    def collide(self, configuration, stop):
        return pinocchio.computeCollisions(self.model, self.data, self.geometry, self.results, configuration, stop)

    def pairs_in_contact(self, configuration):
        self.collide(configuration, False)
        return {pair for pair, result in zip(self.links, self.results.collisionResults) if result.isCollision()}


def seconds(ask, rounds):
    """CPU seconds of the best round."""
    times = []
    for _ in range(rounds):
        begin = time.process_time()
        ask()
        times.append(time.process_time() - begin)
    return min(times)


def measure(name, urdf, srdf, dirs, options, allow_frequent):
    robot = cbvh.Robot.from_urdf(urdf, dirs, srdf)
    allowed = robot.allow_frequent() if allow_frequent else []
    other, limits = Pinocchio(robot, urdf, dirs), np.clip(robot.limits, -np.pi, np.pi)
    rows = np.random.default_rng(1).uniform(limits[:, 0], limits[:, 1], (options.rows, len(limits)))
    configurations = [other.configuration(row) for row in rows]
    differ, contacts = 0, 0
    for found, configuration in zip(robot.pairs_in_contact(rows), configurations):
        expected = other.pairs_in_contact(configuration)
        differ += len({frozenset(pair) for pair in found} ^ expected)
        contacts += len(expected)
    ways = []
    for of_robot, stop in ((robot.collide, True), (robot.pairs_in_contact, False)):
        both = [seconds(lambda: of_robot(rows), options.rounds), seconds(lambda: [other.collide(q, stop) for q in configurations], options.rounds)]
        ours, theirs = (1e6 * value / len(rows) for value in both)
        ways.append(f"{ours:.2f} | {theirs:.1f} | {theirs / ours:.1f}")
    kinematics = seconds(lambda: [pinocchio.forwardKinematics(other.model, other.data, q) for q in configurations], options.rounds)
    print(f"| {name} | {len(robot.pairs)} | {' | '.join(ways)} | {differ} of {contacts} | {len(allowed)} allowed, kinematics {1e6 * kinematics / len(rows):.2f}", flush=True)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("robots", nargs="*")
    parser.add_argument("--mjcf", nargs="*", default=[], type=pathlib.Path)
    parser.add_argument("--visual", action="store_true", help="the geoms that are seen, instead of those that collide")
    parser.add_argument("--rows", type=int, default=2000)
    parser.add_argument("--rounds", type=int, default=3)
    options = parser.parse_args()
    for robot in options.robots or ([] if options.mjcf else list(ROBOTS)):
        measure(robot, *files_of(robot), options, False)
    for file in options.mjcf:
        with tempfile.TemporaryDirectory() as folder:
            files = files_of_mjcf(file, pathlib.Path(folder), options.visual)
            measure(file.stem + (" (seen)" if options.visual else ""), *files, options, True)


if __name__ == "__main__":
    main()
