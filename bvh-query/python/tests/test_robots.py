"""Tests of robots: kinematics in numpy, questions about meshes pair by pair, samples of motions, misuse and threads."""

import concurrent.futures
import copy
import importlib.metadata
import itertools
import math
import pathlib
import pickle
import tempfile
import threading
import unittest
import warnings
import xml.etree.ElementTree as ElementTree

import numpy as np

import cbvh
from cbvh import MotionKind
from common import TESTDATA, check_errors, cube, shifts

URDF = TESTDATA / "robot" / "robot.urdf"
NEIGHBOURS = [("base", "turret"), ("turret", "upper_arm"), ("upper_arm", "forearm"), ("forearm", "hand")]

# All kinds of joints, with joints before those that they hang from, an axis that is not of length 1, and two shapes of a link.
KINDS = """<robot name="kinds">
<link name="foot"><collision><geometry><box size="0.3 0.2 0.1"/></geometry></collision>
<collision><origin xyz="0 0 0.2" rpy="0.3 0 0"/><geometry><capsule radius="0.05" length="0.2"/></geometry></collision></link>
<link name="a"><collision><origin xyz="0.1 0 0"/><geometry><sphere radius="0.05"/></geometry></collision></link>
<link name="b"><collision><geometry><cylinder radius="0.05" length="0.2"/></geometry></collision></link>
<link name="c"/><link name="d"/><link name="e"/><link name="f"/><link name="g"/>
<joint name="follow" type="prismatic"><parent link="b"/><child link="c"/><origin xyz="0 0 0.3"/><axis xyz="0 1 0"/>
<mimic joint="slide" multiplier="-2" offset="0.1"/></joint>
<joint name="turn" type="continuous"><parent link="foot"/><child link="a"/><origin xyz="0.1 0.2 0.3" rpy="0.1 -0.7 2"/>
<axis xyz="1 2 -2"/></joint>
<joint name="slide" type="prismatic"><parent link="a"/><child link="b"/><origin rpy="1 0 0"/><axis xyz="0 0 1"/>
<limit lower="-0.1" upper="0.4" effort="1" velocity="1"/></joint>
<joint name="glue" type="fixed"><parent link="b"/><child link="d"/><origin xyz="0 0.2 0" rpy="0 0 1"/></joint>
<joint name="again" type="revolute"><parent link="d"/><child link="e"/><axis xyz="0 1 0"/>
<limit lower="-1" upper="2" effort="1" velocity="1"/><mimic joint="follow" multiplier="0.5" offset="1"/></joint>
<joint name="plane" type="planar"><parent link="foot"/><child link="f"/><origin xyz="0 0 1" rpy="0.2 0 0"/></joint>
<joint name="float" type="floating"><parent link="e"/><child link="g"/><origin xyz="1 0 0" rpy="0 0.5 0"/></joint>
</robot>"""


def turned(axis, angle):
    """The rotation about an axis of length 1, after Rodrigues."""
    x, y, z = axis
    across = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + math.sin(angle) * across + (1 - math.cos(angle)) * across @ across


def placed(rotation=np.eye(3), translation=(0, 0, 0)):
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = rotation, translation
    return pose


def numbers(element, name, default):
    return np.array([float(n) for n in element.get(name).split()] if element is not None and element.get(name) else default)


def origin_of(element):
    origin = element.find("origin")
    roll, pitch, yaw = numbers(origin, "rpy", [0, 0, 0])
    rotation = turned((0, 0, 1), yaw) @ turned((0, 1, 0), pitch) @ turned((1, 0, 0), roll)
    return placed(rotation, numbers(origin, "xyz", [0, 0, 0]))


class Kinematics:
    """Where the links of a URDF file are: what robots are compared with."""

    def __init__(self, path):
        self.root = ElementTree.parse(path).getroot()
        self.joints = {joint.get("name"): joint for joint in self.root.findall("joint")}
        self.moved_by = {joint.find("child").get("link"): joint for joint in self.joints.values()}

    def value(self, joint, values):
        mimic = joint.find("mimic")
        if mimic is None:
            return values[joint.get("name")]
        leader = self.value(self.joints[mimic.get("joint")], values)
        return float(mimic.get("multiplier", 1)) * leader + float(mimic.get("offset", 0))

    def pose(self, link, values):
        """The pose of a link in the world, given joint values by name."""
        joint = self.moved_by.get(link)
        if joint is None:
            return np.eye(4)
        name, kind = joint.get("name"), joint.get("type")
        here = self.pose(joint.find("parent").get("link"), values) @ origin_of(joint)
        if kind == "fixed":
            return here
        if kind == "planar":
            x, y, theta = (values[f"{name}/{part}"] for part in ("x", "y", "theta"))
            return here @ placed(turned((0, 0, 1), theta), (x, y, 0))
        if kind == "floating":
            x, y, z, *quaternion = (values[f"{name}/{part}"] for part in ("x", "y", "z", "qx", "qy", "qz", "qw"))
            return here @ cbvh.pose([x, y, z], np.array(quaternion) / np.linalg.norm(quaternion))
        axis = numbers(joint.find("axis"), "xyz", [1, 0, 0])
        axis = axis / np.linalg.norm(axis)
        value = self.value(joint, values)
        return here @ (placed(translation=value * axis) if kind == "prismatic" else placed(turned(axis, value)))


def read_obj(path):
    lines = [line.split() for line in path.read_text().splitlines()]
    vertices = np.array([[float(n) for n in line[1:4]] for line in lines if line[:1] == ["v"]])
    faces = np.array([[int(n.split("/")[0]) - 1 for n in line[1:4]] for line in lines if line[:1] == ["f"]])
    return vertices, faces


def meshes_of(kinematics):
    """For each link of the test's robot its mesh, and where that is in the link."""
    meshes = {}
    for link in kinematics.root.findall("link"):
        collision = link.find("collision")
        mesh = collision.find("geometry/mesh")
        vertices, faces = read_obj(URDF.parent / mesh.get("filename"))
        meshes[link.get("name")] = cbvh.bake(vertices * numbers(mesh, "scale", [1, 1, 1]), faces), origin_of(collision)
    return meshes


def cell():
    """The arm among obstacles, with something in its hand, and the same by hand: name, link, mesh, pose."""
    robot = cbvh.Robot.from_urdf(URDF)
    for a, b in NEIGHBOURS:
        robot.allow(a, b)
    others = [
        ("pillar", None, cbvh.box([0.1, 0.1, 1.5]), shifts([0.45, 0, 0.75])[0]),
        ("shelf", None, cbvh.box([0.4, 1.0, 0.02]), shifts([-0.5, 0, 0.9])[0]),
        ("ball", None, cbvh.sphere(0.1), shifts([0, 0.5, 0.5])[0]),
        ("tool", "hand", cbvh.box([0.02, 0.02, 0.2]), shifts([0, 0, 0.2])[0]),
    ]
    for name, link, mesh, pose in others:
        if link is None:
            robot.add_obstacle(mesh, pose, name=name)
        else:
            robot.attach(mesh, link, pose, name=name, may_touch=["forearm"])
    of_links = [(name, name, mesh, pose) for name, (mesh, pose) in meshes_of(Kinematics(URDF)).items()]
    return robot, of_links + others


def random_rows(robot, seed, count, reach=1.0):
    limits = np.clip(robot.limits, -math.pi, math.pi)
    return reach * np.random.default_rng(seed).uniform(limits[:, 0], limits[:, 1], (count, len(limits)))


class Describing(unittest.TestCase):
    """What the files say."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def write(self, name, text):
        (self.folder / name).write_text(text)
        return self.folder / name

    def test_links_are_where_numpy_has_them(self):
        for path in (URDF, self.write("kinds.urdf", KINDS)):
            robot, kinematics = cbvh.Robot.from_urdf(path), Kinematics(path)
            rows = np.random.default_rng(1).uniform(-2, 2, (50, len(robot.joints)))
            found = robot.link_poses(rows)
            self.assertEqual(found.shape, (50, len(robot.links), 4, 4))
            for row, poses in zip(rows, found):
                values = dict(zip(robot.joints, row))
                for link, pose in zip(robot.links, poses):
                    np.testing.assert_allclose(pose, kinematics.pose(link, values), atol=1e-14)
            self.assertTrue(np.array_equal(robot.link_poses(rows[3]), found[3]))

    def test_joints_have_a_name_for_each_number(self):
        robot = cbvh.Robot.from_urdf(self.write("kinds.urdf", KINDS))
        planar, floating = ["plane/x", "plane/y", "plane/theta"], [f"float/{of}" for of in "x y z qx qy qz qw".split()]
        self.assertEqual(robot.joints, ["turn", "slide", *planar, *floating])
        self.assertEqual(robot.limits.shape, (12, 2))
        self.assertEqual(robot.limits[:3].tolist(), [[-math.inf, math.inf], [-0.1, 0.4], [-math.inf, math.inf]])
        self.assertEqual(robot.limits[8:].tolist(), [[-1, 1]] * 4)
        self.assertEqual((robot.name, robot.links[0], len(robot.links)), ("kinds", "foot", 8))
        self.assertEqual(repr(robot), "<Robot 'kinds': 12 joint values, 8 links>")
        q = robot.q({"turn": 0.5}, slide=0.25)
        self.assertEqual(q.tolist(), [0.5, 0.25] + 9 * [0.0] + [1.0])
        robot.collide(q)
        # Of links that nothing moves against each other, and of links without shapes, there are no pairs.
        self.assertEqual(robot.pairs, [("foot", "a"), ("foot", "b"), ("a", "b")])
        for base, more in (("planar", 3), ("floating", 7)):
            moving = cbvh.Robot.from_urdf(self.folder / "kinds.urdf", base=base)
            self.assertEqual(moving.joints[more:], robot.joints)
            self.assertTrue(all(name.startswith("base/") for name in moving.joints[:more]))

    def test_a_base_moves_the_robot(self):
        robot = cbvh.Robot.from_urdf(URDF)
        row = random_rows(robot, 1, 1)[0]
        still = robot.link_poses(row)
        planar = cbvh.Robot.from_urdf(URDF, base="planar").link_poses([0.3, -2, 0.7, *row])
        np.testing.assert_allclose(planar, placed(turned((0, 0, 1), 0.7), (0.3, -2, 0)) @ still, atol=1e-14)
        quaternion = np.array([0.1, -0.5, 0.3, 0.8])
        floating = cbvh.Robot.from_urdf(URDF, base="floating").link_poses([0.3, -2, 1, *quaternion, *row])
        pose = cbvh.pose([0.3, -2, 1], quaternion / np.linalg.norm(quaternion))
        np.testing.assert_allclose(floating, pose @ still, atol=1e-14)

    def test_primitives_are_solid_and_exact(self):
        robot = cbvh.Robot.from_urdf(self.write("kinds.urdf", KINDS), cylinder_error=1e-4)
        q, kinematics = robot.q(), Kinematics(self.folder / "kinds.urdf")
        values = dict(zip(robot.joints, q))
        robot.allow("foot", "b")
        robot.allow("foot", "a")
        # The ball of a, 0.1 off its link, whose distance from what a box holds follows by hand.
        robot.allow("a", "b")
        robot.add_obstacle(cbvh.sphere(0.01), name="probe")
        for _ in range(20):
            at = np.random.default_rng(2).uniform(-1, 1, 3)
            robot.set_pose("probe", shifts(at)[0])
            centre = (kinematics.pose("a", values) @ shifts([0.1, 0, 0])[0])[:3, 3]
            self.assertLessEqual(robot.distance(q).distance, np.linalg.norm(at - centre) - 0.06 + 1e-12)
        robot.set_pose("probe", np.eye(4))  # Deep inside the box of the foot.
        self.assertIn(("foot", "probe"), robot.pairs_in_contact(q))
        self.assertEqual(robot.distance(q).distance, 0)

    def test_srdf_disables_pairs_and_names_states(self):
        srdf = self.write(
            "arm.srdf",
            """<robot name="small_arm">
            <group name="arm"><chain base_link="base" tip_link="forearm"/></group>
            <group name="wrist"><joint name="wrist"/></group>
            <group name="all"><group name="arm"/><group name="wrist"/></group>
            <group_state name="up" group="arm"><joint name="shoulder" value="-0.5"/><joint name="elbow" value="0.25"/></group_state>
            <group_state name="rest" group="wrist"><joint name="wrist" value="1"/></group_state>
            <disable_collisions link1="base" link2="turret" reason="Adjacent"/>
            <disable_collisions link1="hand" link2="base" reason="Never"/>
            <disable_collisions link1="hand" link2="of another robot" reason="Never"/>
            </robot>""",
        )
        robot, bare = cbvh.Robot.from_urdf(URDF, srdf=srdf), cbvh.Robot.from_urdf(URDF)
        self.assertEqual(set(bare.pairs) - set(robot.pairs), {("base", "turret"), ("base", "hand")})
        self.assertEqual(len(bare.pairs), 10)
        arm = ["waist", "shoulder", "elbow"]
        self.assertEqual(robot.groups, {"arm": arm, "wrist": ["wrist"], "all": [*arm, "wrist"]})
        states = {"arm": {"up": {"shoulder": -0.5, "elbow": 0.25}}, "wrist": {"rest": {"wrist": 1.0}}}
        self.assertEqual(robot.states, states)
        q = robot.q(robot.states["arm"]["up"], **robot.states["wrist"]["rest"])
        self.assertEqual(q.tolist(), [0, -0.5, 0.25, 1])
        self.assertEqual((bare.groups, bare.states), ({}, {}))
        (warning,) = robot.warnings
        self.assertIn("arm.srdf: line 9, <disable_collisions>: the robot has no link 'of another robot'", warning)
        self.assertEqual((bare.warnings, copy.copy(robot).warnings), ([], [warning]))

    def test_warnings_of_urdf_and_meshes(self):
        (self.folder / "line.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 1 2\n")
        urdf = self.write(
            "two.urdf",
            """<robot name="two"><link name="a"><visual><geometry><mesh filename="line.obj"/></geometry></visual></link>
            <link name="b"/><joint name="j" type="revolute"><parent link="a"/><child link="b"/>
            <limit lower="1" upper="-1"/><mimic joint="gone"/></joint></robot>""",
        )
        robot = cbvh.Robot.from_urdf(urdf)
        of_joint = ["mimics 'gone', which the robot does not have", "lower limit 1 above the upper limit -1"]
        for warning, text in zip(robot.warnings, [*of_joint, "no link has a <collision>"], strict=True):
            self.assertIn(text, warning)
        visual = cbvh.Robot.from_urdf(urdf, geometry="visual")
        self.assertIn("line.obj: line 5: left out 1 face", visual.warnings[2])
        self.assertEqual((len(visual.warnings), visual.joints, visual.limits.tolist()), (3, ["j"], [[-np.inf, np.inf]]))
        self.assertEqual(pickle.loads(pickle.dumps(visual)).warnings, visual.warnings)

    def test_packages_and_a_cache(self):
        package = self.folder / "ros" / "my_arm"
        (package / "meshes").mkdir(parents=True)
        for name in ("base", "link", "hand"):
            (package / "meshes" / f"{name}.obj").write_text((URDF.parent / f"{name}.obj").read_text())
        text = URDF.read_text().replace('filename="', 'filename="package://my_arm/meshes/')
        path = self.write("arm.urdf", text)
        with self.assertRaises(ValueError) as caught:
            cbvh.Robot.from_urdf(path)
        self.assertIn("package://my_arm/meshes/base.obj", str(caught.exception))
        expected = cbvh.Robot.from_urdf(URDF).distance([0.1, 0.2, 0.3, 0.4])
        for folders in ([self.folder / "ros"], str(self.folder / "ros"), [package]):
            for _ in range(2):
                robot = cbvh.Robot.from_urdf(path, folders, cache=self.folder / "cache")
                found = robot.distance([0.1, 0.2, 0.3, 0.4])
                self.assertEqual((found.distance, found.bodies), (expected.distance, expected.bodies))
        self.assertTrue(any((self.folder / "cache").iterdir()))

    def test_meshes_elsewhere_are_read_if_that_is_allowed(self):
        text = URDF.read_text().replace('filename="', f'filename="{URDF.parent}/')
        path = self.write("arm.urdf", text)
        with self.assertRaises(ValueError) as caught:
            cbvh.Robot.from_urdf(path)
        self.assertIn("or set allow_outside", str(caught.exception))
        for options in ({"allow_outside": True}, {"package_dirs": [URDF.parent]}):
            self.assertEqual(len(cbvh.Robot.from_urdf(path, **options).links), 5)

    def test_the_axis_of_collada_counts_only_if_it_is_applied(self):
        dae = (
            '<COLLADA><asset><unit meter="0.01"/><up_axis>Y_UP</up_axis></asset><library_geometries><geometry id="g"><mesh>'
            '<source id="s"><float_array id="a">100 0 200 300 0 200 100 100 200</float_array><technique_common>'
            '<accessor source="#a"/></technique_common></source><vertices id="v"><input semantic="POSITION" source="#s"/>'
            '</vertices><triangles><input semantic="VERTEX" source="#v"/><p>0 1 2</p></triangles></mesh></geometry>'
            "</library_geometries></COLLADA>"
        )
        (self.folder / "up.dae").write_text(dae, encoding="utf-8")
        mesh = '<collision><geometry><mesh filename="up.dae"/></geometry></collision>'
        urdf = self.write("up.urdf", f'<robot name="up"><link name="base">{mesh}</link></robot>')
        for applied, touching in ((False, [1.1, 0.1, 2]), (True, [1.1, -2, 0.1])):
            robot = cbvh.Robot.from_urdf(urdf, apply_up_axis=applied)
            robot.add_obstacle(cbvh.sphere(0.001), name="probe")
            for point in ([1.1, 0.1, 2], [1.1, -2, 0.1]):
                robot.set_pose("probe", shifts(point)[0])
                self.assertEqual(bool(robot.pairs_in_contact(robot.q())), point == touching)
        mesh = cbvh.bake_files(self.folder / "up.dae", self.folder / "up.cbvh")
        np.testing.assert_allclose(mesh.bounds, [[1, -2, 0], [3, -2, 1]], atol=1e-12)

    def test_robots_without_joints(self):
        path = self.write(
            "post.urdf",
            '<robot name="post"><link name="post"><collision><geometry><box size="1 1 1"/></geometry></collision></link></robot>',
        )
        robot = cbvh.Robot.from_urdf(path)
        self.assertEqual((robot.joints, robot.pairs, robot.limits.shape), ([], [], (0, 2)))
        self.assertIs(robot.collide([]), False)
        self.assertIs(robot.is_free([], []), True)
        nearest = robot.distance([])
        self.assertEqual((nearest.distance, nearest.bodies), (math.inf, None))
        bodies, signed = robot.signed_distance([])
        self.assertEqual((bodies, signed.lower, signed.upper, signed.is_signed), (None, math.inf, math.inf, False))
        self.assertTrue(np.isnan(signed.normal).all() and signed.point_a.shape == (3,))
        robot.add_obstacle(cbvh.sphere(0.5), shifts([1.5, 0, 0])[0], name="ball")
        self.assertEqual(robot.pairs, [("post", "ball")])
        for parallel in (False, True):
            self.assertEqual(robot.collide(np.zeros((3, 0)), parallel=parallel).tolist(), [False] * 3)
            self.assertEqual(robot.distance(np.zeros((3, 0)), parallel=parallel).distance.tolist(), [0.5] * 3)
            bodies, signed = robot.signed_distance(np.zeros((3, 0)), parallel=parallel)
            self.assertEqual(bodies, [("post", "ball")] * 3)
            np.testing.assert_allclose(signed.lower, [0.5] * 3, rtol=1e-12)
            self.assertEqual(robot.is_free(np.zeros((3, 0)), [], parallel=parallel).tolist(), [True] * 3)
        robot.set_pose("ball", shifts([1, 0, 0])[0])
        self.assertIs(robot.collide([]), True)
        self.assertIs(robot.is_free([], []), False)
        self.assertEqual(robot.motion([], []).kind, MotionKind.HIT)

    def test_a_block_passes_through_another_one(self):
        block = '<collision><geometry><box size="{}"/></geometry></collision>'
        path = self.write(
            "slide.urdf",
            f'<robot name="slide"><link name="foot"/><link name="rail">{block.format("2 4 4")}</link>'
            f'<link name="cart">{block.format("1 1 1")}</link>'
            '<joint name="up" type="fixed"><parent link="foot"/><child link="rail"/><origin xyz="1 2 3" rpy="0.3 -0.7 2"/></joint>'
            '<joint name="x" type="prismatic"><parent link="rail"/><child link="cart"/><origin xyz="0 0.25 0"/>'
            '<limit lower="-9" upper="9" effort="1" velocity="1"/></joint></robot>',
        )
        robot, x = cbvh.Robot.from_urdf(path), np.arange(-24, 25) / 8
        rail = robot.link_poses([0])[1]
        of_cart = np.sign(x)[:, None] * rail[:3, 0]
        bodies, found = robot.signed_distance(x[:, None])
        self.assertEqual(set(bodies), {("rail", "cart")})
        np.testing.assert_allclose(found.lower, np.abs(x) - 1.5, atol=1e-9)
        is_clear = (x != 0) & (np.abs(x) != 1.5)
        np.testing.assert_allclose(found.normal[is_clear], of_cart[is_clear], atol=1e-9)
        # A post is always 0.75 from the rail. A margin of the cart makes the other number less.
        robot.add_obstacle(cbvh.box([1, 1, 1]), rail @ shifts((0, -3.25, 0))[0], name="post")
        robot.set_margin("cart", 0.0625)
        number, is_cart = np.minimum(np.abs(x) - 1.5625, 0.75), np.abs(x) < 2.3125
        for parallel in (False, True):
            bodies, found = robot.signed_distance(x[:, None], relative_gap=1e-6, parallel=parallel)
            self.assertEqual([of == ("rail", "cart") for of in bodies], is_cart.tolist())
            self.assertEqual(set(bodies), {("rail", "cart"), ("rail", "post")})
            self.assertTrue(np.all(found.lower <= number + 1e-12) and np.all(number - 1e-12 <= found.upper))
            np.testing.assert_allclose(found.upper, found.lower, atol=1e-6)
            normals = np.where(is_cart[:, None], of_cart, -rail[:3, 1])
            np.testing.assert_allclose(found.normal[x != 0], normals[x != 0], atol=1e-9)
            np.testing.assert_allclose(np.sum(found.normal * (found.point_b - found.point_a), axis=1), number, atol=1e-6)
            in_rail = (found.point_a - rail[:3, 3]) @ rail[:3, :3]
            np.testing.assert_allclose(np.where(is_cart, np.abs(in_rail[:, 0]), -in_rail[:, 1] / 2), 1, atol=1e-6)
            np.testing.assert_allclose(np.linalg.norm(found.translation, axis=1), np.maximum(-found.lower, 0), atol=1e-9)
            self.assertTrue(found.is_signed.all() and not found.is_spent.any())
        # What is not closed has no depth.
        corners, faces = cube()
        robot.attach(cbvh.bake(corners, faces[2:]), "cart", name="open", may_touch=["cart"])
        robot.allow("rail", "cart")
        bodies, found = robot.signed_distance([1])
        self.assertEqual((bodies, found.lower, found.is_signed, found.translation.tolist()), (("rail", "open"), 0, False, [0, 0, 0]))

class Asking(unittest.TestCase):
    """Answers beside those about meshes."""

    def test_near_pairs_are_those_of_meshes(self):
        robot, bodies = cell()
        rows, kinematics, margin = random_rows(robot, 5, 60), Kinematics(URDF), 0.15
        of = {name: (link, mesh, pose) for name, link, mesh, pose in bodies}

        def of_meshes(row):
            values = dict(zip(robot.joints, row))
            world = {n: (kinematics.pose(link, values) if link else np.eye(4)) @ pose for n, (link, _, pose) in of.items()}
            for a, b in robot.pairs:
                found = of[a][1].signed_distance(of[b][1], cbvh.relative(world[a], world[b]))
                yield (a, b), world[a], found

        compared = {"bodies": 0, "overlapping": 0, "slopes": 0}
        for row in rows:
            found = robot.near_pairs(row, margin)
            expected = [(pair, world, of_pair) for pair, world, of_pair in of_meshes(row) if of_pair.upper <= margin]
            self.assertEqual([(pair.a, pair.b) for pair in found], [pair for pair, *_ in expected])
            for pair, (_, world, of_pair) in zip(found, expected):
                overlaps = of_pair.lower < 0
                # A search for a depth ends within one per cent.
                tolerance = 0.02 * abs(of_pair.lower) if overlaps else 1e-9
                np.testing.assert_allclose([pair.lower, pair.upper], [of_pair.lower, of_pair.upper], rtol=0, atol=tolerance)
                self.assertTrue(pair.lower <= pair.distance <= pair.upper and isinstance(pair.distance, float))
                self.assertEqual((pair.gradient.shape, pair.is_signed), ((4,), of_pair.is_signed))
                compared["bodies"] += 1
                compared["overlapping"] += overlaps
                if not 1e-3 < pair.distance:
                    continue
                for point, there in [(pair.point_a, of_pair.point_a), (pair.point_b, of_pair.point_b)]:
                    np.testing.assert_allclose(point, world[:3, :3] @ there + world[:3, 3], atol=1e-8)
                np.testing.assert_allclose(pair.normal * pair.distance, pair.point_b - pair.point_a, atol=1e-9)
                for number in range(4):
                    step = np.zeros(4)
                    step[number] = 1e-6
                    before, after = (
                        next(of_pair.lower for bodies, _, of_pair in of_meshes(moved) if bodies == (pair.a, pair.b))
                        for moved in (row - step, row + step)
                    )
                    # The nearest points jump hardly ever.
                    if abs(after - 2 * pair.distance + before) < 1e-10:
                        self.assertAlmostEqual(pair.gradient[number], (after - before) / 2e-6, delta=1e-6)
                        compared["slopes"] += 1
        self.assertTrue(compared["bodies"] > 60 and compared["overlapping"] > 10 and compared["slopes"] > 150, compared)

        for parallel in (False, True):
            many = robot.near_pairs(rows, margin, parallel=parallel)
            single = [(number, pair) for number, row in enumerate(rows) for pair in robot.near_pairs(row, margin)]
            self.assertEqual(many.row.tolist(), [number for number, _ in single])
            for name in cbvh.NearPair._fields:
                column = [getattr(pair, name) for _, pair in single]
                np.testing.assert_array_equal(np.array(getattr(many, name)), np.array(column))
        self.assertEqual((many.gradient.shape, many.point_a.shape), ((len(single), 4), (len(single), 3)))
        self.assertEqual((many.row.dtype, many.is_signed.dtype), (np.int64, np.bool_))

        none = robot.near_pairs(np.zeros((0, 4)), margin)
        self.assertEqual((none.row.shape, none.a, none.gradient.shape, none.normal.shape), ((0,), [], (0, 4), (0, 3)))
        # Those that are near are the pairs that are asked about.
        self.assertEqual([(pair.a, pair.b) for pair in robot.near_pairs(rows[0], 99)], robot.pairs)
        robot.allow("upper_arm", "pillar")
        robot.remove("ball")
        self.assertEqual([(pair.a, pair.b) for pair in robot.near_pairs(rows[0], 99)], robot.pairs)
        wrong = [-1, -1e-300, math.nan, math.inf, -math.inf]
        check_errors(
            self,
            [(ValueError, "margin: expected a finite distance of at least 0", robot.near_pairs, rows[0], bad) for bad in wrong]
            + [(ValueError, "margin: expected a finite distance", robot.near_pairs, np.zeros((0, 4)), bad) for bad in wrong]
            + [
                (TypeError, "margin: expected a number", robot.near_pairs, rows[0], "far"),
                (ValueError, "q: expected shape (4,) or (N, 4)", robot.near_pairs, rows[0][:3], 1),
                (ValueError, "relative_gap", lambda: robot.near_pairs(rows[0], 1, relative_gap=0)),
                (ValueError, "tolerance", lambda: robot.near_pairs(rows[:0], 1, tolerance=-1)),
                (ValueError, "joint elbow: expected a finite value", robot.near_pairs, [0, 0, math.nan, 0], 1),
            ],
        )

    def test_derivatives_of_all_kinds_of_joints(self):
        # Points where the robot stands in the frames of numpy, moved by one joint value at a time.
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "kinds.urdf"
            path.write_text(KINDS.replace('<link name="g"/>', '<link name="g"><collision><geometry><sphere radius="0.05"/></geometry></collision></link>'))
            robot = cbvh.Robot.from_urdf(path)
        random, compared = np.random.default_rng(6), 0
        places = [robot.joints.index(f"float/q{axis}") for axis in "xyzw"]
        for _ in range(20):
            q = random.uniform(-0.5, 0.5, len(robot.joints))
            q[places] = random.normal(size=4) * random.uniform(0.5, 2)
            for pair in robot.near_pairs(q, 9.0):
                alone = robot.copy()
                for a, b in robot.pairs:
                    if (a, b) != (pair.a, pair.b):
                        alone.allow(a, b)
                if pair.distance < 1e-3:
                    continue
                steps = 1e-6 * np.eye(len(q))
                before, after = (alone.distance(moved).distance for moved in (q - steps, q + steps))
                smooth = np.abs(before - 2 * pair.distance + after) < 1e-10
                np.testing.assert_allclose(pair.gradient[smooth], ((after - before) / 2e-6)[smooth], atol=1e-6)
                self.assertAlmostEqual(np.dot(pair.gradient[places], q[places]), 0, delta=1e-12)
                compared += smooth.sum()
        self.assertGreater(compared, 1000)

    def test_pairs_are_those_of_meshes(self):
        robot, bodies = cell()
        self.assertEqual(robot.joints, ["waist", "shoulder", "elbow", "wrist"])
        rows, kinematics = random_rows(robot, 2, 300), Kinematics(URDF)
        of = {name: (link, mesh, pose) for name, link, mesh, pose in bodies}
        standing = {name for name, link, *_ in bodies if link is None}
        allowed = {frozenset(pair) for pair in [*NEIGHBOURS, ("hand", "tool"), ("forearm", "tool")]}
        pairs = [
            pair
            for pair in itertools.combinations(of, 2)
            # The base does not move either, but obstacles may stand in it.
            if not set(pair) <= standing and frozenset(pair) not in allowed
        ]
        self.assertEqual({frozenset(pair) for pair in robot.pairs}, {frozenset(pair) for pair in pairs})
        touching, nearest = robot.pairs_in_contact(rows), robot.distance(rows)
        overlapping, signed = robot.signed_distance(rows)
        for number, row in enumerate(rows):
            values = dict(zip(robot.joints, row))
            world = {n: (kinematics.pose(link, values) if link else np.eye(4)) @ pose for n, (link, _, pose) in of.items()}
            poses = {pair: cbvh.relative(world[pair[0]], world[pair[1]]) for pair in robot.pairs}
            expected = [(a, b) for (a, b), pose in poses.items() if of[a][1].collide(of[b][1], pose)]
            self.assertEqual(touching[number], expected)
            least = min(of[a][1].distance(of[b][1], pose).distance for (a, b), pose in poses.items())
            self.assertAlmostEqual(nearest.distance[number], least, delta=1e-12)
            self.assertLessEqual(nearest.lower[number], nearest.distance[number])
            self.assertLessEqual(nearest.distance[number], nearest.upper[number])
            apart = np.linalg.norm(np.subtract(*nearest.points[number]))
            self.assertAlmostEqual(apart, least, delta=1e-9)
            a, b = nearest.bodies[number]
            self.assertAlmostEqual(of[a][1].distance(of[b][1], poses[a, b]).distance, least, delta=1e-12)
            deepest = min(of[a][1].signed_distance(of[b][1], pose).lower for (a, b), pose in poses.items())
            self.assertAlmostEqual(signed.lower[number], deepest, delta=1e-9)
            a, b = overlapping[number]
            self.assertAlmostEqual(of[a][1].signed_distance(of[b][1], poses[a, b]).lower, deepest, delta=1e-9)
            free = world[b].copy()
            free[:3, 3] += 1.000001 * signed.translation[number]
            self.assertEqual(of[a][1].relation(of[b][1], cbvh.relative(world[a], free)), cbvh.Relation.APART)
        collide = robot.collide(rows)
        self.assertEqual(collide.tolist(), [bool(pairs) for pairs in touching])
        self.assertTrue(30 < collide.sum() < 270)

    def test_one_or_many_serial_or_parallel(self):
        robot, _ = cell()
        rows = random_rows(robot, 3, 100)
        ends = rows + random_rows(robot, 4, 100, 0.2)
        answers = {}
        for parallel in (False, True):
            kinds = {"parallel": parallel}
            distance = robot.distance(rows, **kinds)
            bodies, signed = robot.signed_distance(rows, **kinds)
            answers[parallel] = (
                robot.collide(rows, **kinds).tolist(),
                robot.pairs_in_contact(rows, **kinds),
                [np.asarray(of).tolist() for of in distance],
                robot.is_free(rows, ends, **kinds).tolist(),
                bodies,
                [of.tolist() for of in signed],
            )
        self.assertEqual(*answers.values())
        collide, pairs, (distance, lower, upper, bodies, points), free, overlapping, signed = answers[False]
        self.assertEqual((len(collide), np.shape(points)), (100, (100, 2, 3)))
        self.assertTrue(10 < sum(free) < 90)
        for number, (row, end) in enumerate(zip(rows.tolist(), ends)):
            self.assertIs(robot.collide(row), collide[number])
            self.assertEqual(robot.pairs_in_contact(row), pairs[number])
            one = robot.distance(tuple(row))
            self.assertEqual((one.distance, one.lower, one.upper), (distance[number], lower[number], upper[number]))
            self.assertEqual((list(one.bodies), one.points.tolist()), (bodies[number], points[number]))
            self.assertIs(robot.is_free(row, end), free[number])
            one = robot.signed_distance(row)
            self.assertEqual((one.bodies, [np.asarray(of).tolist() for of in one.nearest]),
                             (overlapping[number], [of[number] for of in signed]))
            self.assertEqual({type(of) for of in (one.nearest.lower, one.nearest.upper)}, {float})
        # One row serves all of the other argument, and arrays may be of any kind.
        first = [robot.is_free(rows[0], end) for end in ends]
        self.assertEqual(robot.is_free(rows[0], ends).tolist(), first)
        self.assertEqual(robot.is_free(ends, rows[0]).tolist(), [robot.is_free(end, rows[0]) for end in ends])
        strided = np.asfortranarray(np.repeat(rows, 2, axis=0))[::2]
        self.assertEqual(robot.collide(strided).tolist(), collide)
        self.assertEqual(robot.collide(np.zeros((1, 4), dtype=int)).shape, (1,))
        none = np.zeros((0, 4))
        for parallel in (False, True):
            self.assertEqual(robot.collide(none, parallel=parallel).shape, (0,))
            self.assertEqual(robot.pairs_in_contact(none, parallel=parallel), [])
            self.assertEqual(robot.distance(none, parallel=parallel).points.shape, (0, 2, 3))
            bodies, signed = robot.signed_distance(none, parallel=parallel)
            self.assertEqual((bodies, signed.lower.shape, signed.point_a.shape), ([], (0,), (0, 3)))
            self.assertEqual(robot.is_free(none, none, parallel=parallel).shape, (0,))
        self.assertEqual(robot.link_poses(none).shape, (0, 5, 4, 4))

    def test_motions_are_free_at_all_samples(self):
        robot, _ = cell()
        starts, times = random_rows(robot, 5, 120), np.linspace(0, 1, 401)[:, None]
        reach = np.where(np.arange(120) % 3, 0.3, 1.0)[:, None]
        ends = starts + reach * (random_rows(robot, 6, 120) - starts)
        free = robot.is_free(starts, ends)
        self.assertTrue(30 < free.sum() < 90)
        for start, end, is_free in zip(starts, ends, free):
            along = start + times * (end - start)
            found = robot.motion(start, end)
            self.assertEqual(found.kind == MotionKind.FREE, is_free)
            touching = robot.collide(along)
            self.assertFalse(touching[times[:, 0] < found.free_until].any())
            if is_free:
                self.assertFalse(touching.any())
                self.assertEqual((found.free_until, found.bodies, found.distance), (1.0, None, math.inf))
                self.assertTrue(math.isnan(found.touching_at) and found.joints.size == 0)
                continue
            self.assertEqual((found.kind, found.distance), (MotionKind.HIT, 0.0))
            self.assertLessEqual(found.free_until, found.touching_at)
            np.testing.assert_allclose(found.joints, start + found.touching_at * (end - start), atol=1e-14)
            self.assertIn(found.bodies, robot.pairs_in_contact(found.joints))

    def test_clearances_of_motions(self):
        robot, _ = cell()
        starts, times = random_rows(robot, 7, 40), np.linspace(0, 1, 101)[:, None]
        ends = starts + random_rows(robot, 8, 40, 0.1)
        free = robot.is_free(starts, ends, clearance=0.02)
        self.assertTrue(5 < free.sum() < 35)
        self.assertTrue((robot.is_free(starts, ends) >= free).all())
        for start, end, is_free in zip(starts, ends, free):
            gaps = robot.distance(start + times * (end - start)).distance
            self.assertTrue(not is_free or gaps.min() > 0.02)
            # Within the clearance at no sample, nor nearly.
            self.assertTrue(is_free or gaps.min() < 0.03)
        # With a tolerance of 5 cm it is the gap that decides, and the kind says so.
        gap = robot.distance(starts[free][0])
        near = robot.motion(starts[free][0], starts[free][0], clearance=gap.distance - 1e-3, tolerance=0.05)
        self.assertIn(near.kind, (MotionKind.FREE, MotionKind.NEAR))

    def test_what_is_between_samples_is_found(self):
        robot = cbvh.Robot.from_urdf(URDF)
        for a, b in NEIGHBOURS:
            robot.allow(a, b)
        name = robot.add_obstacle(cbvh.box([0.6, 1e-6, 0.6]), shifts([0.3, 0.00213, 0.8])[0])
        self.assertEqual(name, "obstacle 1")
        start, end = np.array([-0.5, 1.2, 0, 0]), np.array([0.5, 1.2, 0, 0])
        self.assertFalse(robot.is_free(start, end))
        hit, path = robot.motion(start, end), [start, start, end, start]
        self.assertEqual(hit.bodies[1], "obstacle 1")
        number, found = robot.first_hit(path)
        self.assertEqual((number, found.kind, found.touching_at, found.bodies), (1, hit.kind, hit.touching_at, hit.bodies))
        self.assertIsNone(robot.first_hit(path[:2]))
        robot.remove(name)
        self.assertTrue(robot.is_free(start, end))
        self.assertIsNone(robot.first_hit(path, parallel=True))

    def test_polynomials(self):
        robot, _ = cell()
        rng, kinds = np.random.default_rng(9), set()
        times = np.linspace(0, 1, 301)
        for _ in range(40):
            coefficients = rng.normal(size=(4, 4)) * [1.0, 0.3, 0.3, 0.2]
            along = sum(np.outer(times**power, coefficients[:, power]) for power in range(4))
            found = robot.motion_along(coefficients)
            kinds.add(found.kind)
            touching = robot.collide(along)
            self.assertFalse(touching[times < found.free_until].any())
            self.assertEqual(bool(touching.any()) and found.kind == MotionKind.FREE, False)
            if found.kind == MotionKind.HIT:
                expected = sum(coefficients[:, power] * found.touching_at**power for power in range(4))
                np.testing.assert_allclose(found.joints, expected, atol=1e-13)
                self.assertTrue(robot.collide(found.joints))
        self.assertEqual(kinds, {MotionKind.FREE, MotionKind.HIT})
        q = random_rows(robot, 1, 1)[0]
        self.assertEqual(robot.motion_along(q[:, None]).kind == MotionKind.FREE, not robot.collide(q))
        # Out to where there are no poses and back again: that is not certainly free.
        far = np.zeros((4, 3))
        far[0] = [0, 1e300, -1e300]
        try:
            self.assertNotEqual(robot.motion_along(far).kind, MotionKind.FREE)
        except ValueError:
            pass

    def test_turns_of_a_floating_base(self):
        robot = cbvh.Robot.from_urdf(URDF, base="floating")
        for a, b in itertools.combinations(robot.links, 2):
            robot.allow(a, b)
        robot.add_obstacle(cbvh.sphere(0.05), shifts([0, 0.9, 0])[0], name="ball")
        # The arm stands up along z. It turns about x by 1.56 rad one way or the other: away from the ball, or towards it.
        for sign, is_free in ((1, True), (-1, False)):
            end = robot.q({"base/qx": sign * math.sin(0.78), "base/qw": math.cos(0.78)})
            self.assertEqual(robot.is_free(robot.q(), end), is_free)
            end[3:7] *= -1  # The same rotation.
            self.assertEqual(robot.is_free(robot.q(), end), is_free)


class Changing(unittest.TestCase):
    """Obstacles, attached objects, margins and allowed pairs."""

    def setUp(self):
        self.robot, self.q = cbvh.Robot.from_urdf(URDF), np.zeros(4)

    def test_allowed_pairs_are_not_asked_about(self):
        robot, q = self.robot, self.q
        self.assertEqual(len(robot.pairs), 10)
        touching = robot.pairs_in_contact(q)
        self.assertTrue(touching)
        for a, b in touching:
            robot.allow(b, a)
        self.assertFalse(robot.collide(q))
        self.assertEqual(robot.pairs_in_contact(q), [])
        robot.allow(*touching[0], allowed=False)
        self.assertEqual(robot.pairs_in_contact(q), touching[:1])
        for a, b in robot.pairs:
            robot.allow(a, b)
        self.assertEqual(robot.pairs, [])
        nearest = robot.distance(q)
        self.assertEqual((nearest.distance, nearest.lower, nearest.upper, nearest.bodies), (math.inf,) * 3 + (None,))
        self.assertTrue(np.isnan(nearest.points).all() and nearest.points.shape == (2, 3))

    def test_pairs_that_nearly_always_touch(self):
        found = self.robot.allow_frequent(200, 0.99)
        self.assertEqual(found, cbvh.Robot.from_urdf(URDF).allow_frequent(200, 0.99))
        self.assertTrue(found)
        for pair, share in found:
            self.assertIn(pair, NEIGHBOURS)
            self.assertTrue(0.99 <= share <= 1)
            self.assertNotIn(pair, self.robot.pairs)

    def test_obstacles_come_move_and_go(self):
        robot, q = self.robot, self.q
        for a, b in robot.pairs:
            robot.allow(a, b)
        wall = cbvh.box([0.1, 1, 2])
        self.assertEqual(robot.add_obstacle(wall, shifts([0.5, 0, 1])[0]), "obstacle 1")
        self.assertEqual(robot.add_obstacle(wall, shifts([9, 0, 1])[0], name="far"), "far")
        self.assertEqual(robot.add_obstacle(wall, shifts([8, 0, 1])[0]), "obstacle 2")
        gap = robot.distance(q)
        self.assertEqual(gap.bodies[1], "obstacle 1")
        robot.set_margin("obstacle 1", gap.distance * 0.75)
        self.assertAlmostEqual(robot.distance(q).distance, gap.distance * 0.25, delta=1e-12)
        robot.set_margin(gap.bodies[0], gap.distance * 0.26)
        self.assertTrue(robot.collide(q))
        self.assertFalse(robot.is_free(q, q))
        robot.set_margin("obstacle 1", 0)
        robot.set_margin(gap.bodies[0], 0)
        self.assertEqual(robot.distance(q).distance, gap.distance)
        before = robot.copy()
        robot.set_pose("obstacle 1", shifts([0.1, 0, 1])[0])
        self.assertTrue(robot.collide(q))
        self.assertFalse(before.collide(q))
        robot.remove("obstacle 1")
        self.assertFalse(robot.collide(q))
        self.assertEqual(before.distance(q).distance, gap.distance)
        self.assertEqual(robot.add_obstacle(cbvh.sphere(1)), "obstacle 1")
        self.assertTrue(robot.collide(q))

    def test_attached_objects_move_with_their_link(self):
        robot, rows = self.robot, random_rows(self.robot, 1, 100)
        for a, b in robot.pairs:
            robot.allow(a, b)
        pose, hand = shifts([0, 0.05, 0.3])[0], robot.links.index("hand")
        self.assertEqual(robot.attach(cbvh.sphere(0.02), "hand", pose, may_touch=["forearm"]), "attached 1")
        self.assertEqual(set(robot.pairs), {(link, "attached 1") for link in ("base", "turret", "upper_arm")})
        robot.add_obstacle(cbvh.sphere(0.3), shifts([0.5, 0, 0.5])[0], name="ball")
        for link in ("base", "turret", "upper_arm", "forearm", "hand"):
            robot.allow(link, "ball")
            if link not in ("forearm", "hand"):
                robot.allow(link, "attached 1")
        for pose in (pose, shifts([0.1, 0, 0.2])[0]):
            robot.set_pose("attached 1", pose)
            centres = (robot.link_poses(rows)[:, hand] @ pose)[:, :3, 3]
            expected = np.maximum(np.linalg.norm(centres - [0.5, 0, 0.5], axis=1) - 0.32, 0)
            np.testing.assert_allclose(robot.distance(rows).distance, expected, atol=1e-12)
            self.assertEqual(robot.collide(rows).tolist(), (expected == 0).tolist())
        robot.remove("attached 1")
        self.assertEqual(robot.pairs, [])

    def test_threads_share_a_robot(self):
        robot, _ = cell()
        rows = random_rows(robot, 3, 50)
        expected = robot.collide(rows).tolist(), robot.distance(rows).distance.tolist()
        robot.add_obstacle(cbvh.sphere(0.1), shifts([50, 0, 0])[0], name="moving")
        stop = threading.Event()

        def change():
            number = 0
            while not stop.is_set():
                number += 1
                robot.set_pose("moving", shifts([50 + number % 7, 0, 0])[0])
                robot.add_obstacle(cbvh.sphere(0.1), shifts([90, 0, 0])[0], name=f"passing {number}")
                robot.remove(f"passing {number}")

        def ask(thread):
            for _ in range(10):
                found = robot.collide(rows).tolist(), robot.distance(rows, parallel=thread % 2 == 0).distance.tolist()
                if found != expected:
                    return False
            return True

        with concurrent.futures.ThreadPoolExecutor(5) as pool:
            changing = pool.submit(change)
            try:
                self.assertTrue(all(pool.map(ask, range(4))))
            finally:
                stop.set()
            changing.result()


TURNING = """<robot name="turning"><link name="root"/>
<link name="arm"><collision><origin xyz="1 0 0"/><geometry><sphere radius="0.1"/></geometry></collision></link>
<link name="limited"/><link name="geared"/><link name="half"/>
<joint name="turn" type="continuous"><parent link="root"/><child link="arm"/><axis xyz="0 0 1"/></joint>
<joint name="limited" type="revolute"><parent link="root"/><child link="limited"/>
<limit lower="-6.3" upper="6.3" effort="1" velocity="1"/></joint>
<joint name="geared" type="continuous"><parent link="root"/><child link="geared"/></joint>
<joint name="half" type="continuous"><parent link="root"/><child link="half"/><mimic joint="geared" multiplier="0.5"/></joint>
</robot>"""


class Turning(unittest.TestCase):
    """The short way of joints that turn without limits."""

    def setUp(self):
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "turning.urdf"
            path.write_text(TURNING)
            self.robot = cbvh.Robot.from_urdf(path, base="planar")

    def test_the_short_way_is_free_where_the_long_one_is_not(self):
        robot = self.robot
        robot.add_obstacle(cbvh.sphere(0.3), shifts([1, 0, 0])[0])
        start, goal = robot.q(turn=3.0, limited=3, geared=3), robot.q(turn=-3.0, limited=-3, geared=-3)
        self.assertFalse(robot.is_free(start, goal))
        self.assertEqual(robot.motion(start, goal).kind, MotionKind.HIT)
        near = robot.nearest_turns(start, goal)
        self.assertTrue(robot.is_free(start, near))
        self.assertEqual(robot.motion(start, near).kind, MotionKind.FREE)
        changed = near != goal
        self.assertEqual([name for name, is_changed in zip(robot.joints, changed) if is_changed], ["turn"])
        self.assertEqual(robot.collide(near), robot.collide(goal))

    def test_rows(self):
        robot, rng = self.robot, np.random.default_rng(1)
        starts, goals = rng.uniform(-50, 50, (2, 40, len(robot.joints)))
        near = robot.nearest_turns(starts, goals)
        self.assertEqual(near.shape, goals.shape)
        turns = [name in ("base/theta", "turn") for name in robot.joints]
        self.assertTrue((np.abs(near - starts)[:, turns] <= math.pi * (1 + 1e-9)).all())
        self.assertTrue((near == goals)[:, np.logical_not(turns)].all())
        np.testing.assert_allclose(np.exp(1j * near[:, turns]), np.exp(1j * goals[:, turns]), atol=1e-13)
        np.testing.assert_allclose(robot.link_poses(near), robot.link_poses(goals), atol=1e-12)
        self.assertTrue((robot.nearest_turns(starts, near) == near).all())
        self.assertEqual(robot.nearest_turns(starts[0], goals[0]).tolist(), near[0].tolist())
        for one, many in (((starts[0], goals), goals), ((starts, goals[0]), starts)):
            rows = [robot.nearest_turns(*row) for row in zip(*np.broadcast_arrays(*one))]
            np.testing.assert_array_equal(robot.nearest_turns(*one), rows)
        self.assertEqual(robot.nearest_turns(starts[:0], goals[:0]).shape, (0, len(robot.joints)))
        check_errors(
            self,
            [
                (ValueError, "q1: expected 40 rows, as q0, found 39", robot.nearest_turns, starts, goals[1:]),
                (ValueError, "q0: expected shape", robot.nearest_turns, starts[:, 1:], goals),
                (ValueError, "joint turn: expected an angle within", robot.nearest_turns, robot.q(), robot.q(turn=2e9)),
                (ValueError, "joint turn: expected a finite", robot.nearest_turns, robot.q(), robot.q(turn=math.nan)),
            ],
        )


class Inside(unittest.TestCase):
    """Bodies inside others, which do not touch them unless they are solid."""

    def setUp(self):
        self.robot, self.q = cbvh.Robot.from_urdf(URDF), np.zeros(4)
        for a, b in self.robot.pairs:
            self.robot.allow(a, b)
        self.room = cbvh.bake(*cube(9))

    def warned(self, ask):
        """The words of the warnings while a question is asked."""
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            ask()
        self.assertTrue(all(of.category is cbvh.InsideWarning and of.filename == __file__ for of in caught))
        return [str(of.message) for of in caught]

    def test_a_robot_in_a_room_is_told_apart_from_a_free_one(self):
        robot, q = self.robot, self.q
        inside = [(link, "room") for link in robot.links]
        robot.add_obstacle(self.room, name="room", solid=False)
        self.assertEqual(self.warned(lambda: robot.collide(q)), [])
        self.assertFalse(robot.collide(q))
        self.assertTrue(robot.is_free(q, q))
        self.assertEqual(robot.pairs_inside(q), inside)
        rows = random_rows(robot, 1, 20)
        for parallel in (False, True):
            self.assertEqual(robot.pairs_inside(rows, parallel=parallel), [robot.pairs_inside(row) for row in rows])
        robot.make_solid("room")
        self.assertTrue(robot.collide(q))
        self.assertFalse(robot.is_free(q, q))
        self.assertEqual(robot.pairs_inside(q), [])
        robot.remove("room")
        robot.add_obstacle(self.room, name="room", solid=True)
        self.assertEqual(robot.pairs_in_contact(q), inside)
        robot.remove("room")
        # An obstacle inside a link, and one inside what is attached.
        robot.add_obstacle(cbvh.sphere(1e-3), robot.link_poses(q)[2] @ shifts([0, 0, 0.1])[0], name="pea")
        self.assertEqual(robot.pairs_inside(q), [("pea", "upper_arm")])
        robot.make_solid("upper_arm")
        self.assertEqual(robot.pairs_in_contact(q), [("upper_arm", "pea")])
        robot.remove("pea")
        for solid in (False, True):
            name = robot.attach(cbvh.bake(*cube(3)), "hand", solid=solid)
            robot.add_obstacle(cbvh.sphere(0.01), robot.link_poses(q)[4] @ shifts([1, 0, 0])[0], name="pea")
            self.assertEqual((robot.collide(q), (("pea", name) in robot.pairs_inside(q))), (solid, not solid))
            robot.remove("pea")
            robot.remove(name)

    def test_a_start_inside_an_obstacle_warns_once(self):
        q = self.q
        asked = {
            "collide": lambda robot: robot.collide(q),
            "is_free": lambda robot: robot.is_free([q, q + 1], [q, q]),
            "motion": lambda robot: robot.motion(q, q),
            "first_hit": lambda robot: robot.first_hit([q, q]),
            "motion_along": lambda robot: robot.motion_along(q[:, None]),
        }
        for name, ask in asked.items():
            with self.subTest(name):
                robot = self.robot.copy()
                robot.add_obstacle(cbvh.bake(*cube(0.1)), shifts([7, 0, 0])[0])
                self.assertEqual(self.warned(lambda: ask(robot)), [])
                robot.add_obstacle(self.room, name="room")
                robot.add_obstacle(cbvh.bake(*cube(20)), name="hall")
                again = pickle.loads(pickle.dumps(robot))
                words = [
                    f"{link} is inside the surface of {outer}, which it does not touch; add {outer} with solid=True"
                    for link in robot.links
                    for outer in ("room", "hall")
                ]
                for one in (robot, robot.copy(), again):
                    with self.subTest(one):
                        found = self.warned(lambda: ask(one))
                        self.assertEqual([message.split(" if it is")[0] for message in found], words)
                        self.assertEqual(self.warned(lambda: ask(one)), [])
        # Nothing is said of what is solid, open, or baked without what tells; and questions without rows look at nothing.
        robot = self.robot
        vertices, faces = cube(9)
        robot.add_obstacle(cbvh.bake(vertices, faces[1:]), name="open")
        robot.add_obstacle(cbvh.bake(vertices, faces, topology=False), name="unknown")
        robot.add_obstacle(self.room, name="full", solid=True)
        self.assertEqual(self.warned(lambda: robot.collide(np.zeros((0, 4)))), [])
        self.assertEqual(self.warned(lambda: robot.collide(q)), [])
        check_errors(
            self,
            [
                (ValueError, "topology", robot.pairs_inside, q),
                (ValueError, "open: expected closed objects", robot.make_solid, "open"),
                (ValueError, "topology", robot.make_solid, "unknown"),
                (KeyError, "'nothing'", robot.make_solid, "nothing"),
                (ValueError, "closed", lambda: robot.add_obstacle(cbvh.bake(vertices, faces[1:]), solid=True)),
                (ValueError, "closed", lambda: robot.attach(cbvh.bake(vertices, faces[1:]), "hand", solid=True)),
            ],
        )

    def test_the_margin_of_a_link_is_not_that_of_what_is_attached(self):
        robot, q = self.robot, self.q
        robot.attach(cbvh.sphere(0.1), "hand", shifts([0, 0, 0.3])[0], name="tool")
        for link in robot.links[:-1]:
            robot.allow(link, "tool")
        robot.add_obstacle(cbvh.sphere(0.1), robot.link_poses(q)[4] @ shifts([0, 0, 0.7])[0])
        gap = robot.distance(q)
        self.assertAlmostEqual(gap.distance, 0.2, delta=1e-6)
        robot.set_margin("hand", 0.05)
        self.assertEqual(robot.distance(q).distance, gap.distance)
        robot.set_margin("tool", 0.05)
        self.assertAlmostEqual(robot.distance(q).distance, gap.distance - 0.05, delta=1e-12)


class Copies(unittest.TestCase):
    """Copies and pickles give the same answers."""

    def changed(self, folder):
        """A robot after all kinds of changes; its files are gone when it is asked."""
        urdf, srdf = folder / "kinds.urdf", folder / "kinds.srdf"
        mesh = '<link name="c"><collision><geometry><mesh filename="hand.obj" scale="0.001 0.001 0.001"/></geometry></collision></link>'
        text = KINDS.replace('<link name="c"/>', mesh).replace('<link name="d"/>', mesh.replace('"c"', '"d"'))
        urdf.write_text(text)
        (folder / "hand.obj").write_text((URDF.parent / "hand.obj").read_text())
        srdf.write_text(
            '<robot name="kinds"><group name="g"><joint name="slide"/></group><group_state name="s" group="g">'
            '<joint name="slide" value="0.2"/></group_state><disable_collisions link1="foot" link2="c"/></robot>'
        )
        robot = cbvh.Robot.from_urdf(urdf, srdf=srdf, base="floating", cylinder_error=1e-2)
        mapped = cbvh.bake(*cube(0.3))
        mapped.save(folder.parent / "mapped.cbvh")
        self.mapped = cbvh.open(folder.parent / "mapped.cbvh")
        robot.add_obstacle(self.mapped, name="gone")
        robot.add_obstacle(self.mapped, shifts([0.5, 0, 0.5])[0], name="crate")
        robot.attach(cbvh.capsule(0.02, 0.3), "d", cbvh.pose([0.1, 0.2, 0.3], [0.5, -0.5, 0.5, 0.5]), may_touch=["b"])
        robot.add_obstacle(cbvh.bake(*cube(0.5)).rounded(0.01), name="box", solid=True)
        robot.remove("gone")
        robot.set_pose("box", shifts([0, 0.9, 0.3])[0])
        for name, margin in (("foot", 0.01), ("c", 0.1 / 3), ("attached 1", 0.02), ("box", 1e-3)):
            robot.set_margin(name, margin)
        robot.make_solid("crate")
        robot.make_solid("c")
        robot.allow("foot", "c", allowed=False)
        robot.allow("a", "b")
        return robot

    def answers(self, robot):
        rng = np.random.default_rng(4)
        rows, ends = rng.uniform(-1, 1, (2, 60, len(robot.joints)))
        ends = rows + 0.1 * (ends - rows)
        distance = robot.distance(rows)
        return (
            (robot.name, robot.joints, robot.links, robot.groups, robot.states, robot.pairs, robot.limits.tolist()),
            robot.link_poses(rows).tolist(),
            robot.pairs_in_contact(rows),
            robot.pairs_inside(rows),
            [np.asarray(of).tolist() for of in (distance.distance, distance.lower, distance.upper, distance.points)],
            distance.bodies,
            robot.is_free(rows, ends).tolist(),
            [tuple(map(repr, robot.motion(*edge))) for edge in zip(rows[:10], ends)],
        )

    def test_copies_and_pickles_give_the_same_answers(self):
        with tempfile.TemporaryDirectory() as above:
            folder = pathlib.Path(above) / "robot"
            folder.mkdir()
            robot = self.changed(folder)
            for file in folder.iterdir():
                file.unlink()
            expected = self.answers(robot)
            self.assertTrue(5 < sum(map(bool, expected[2])) < 55)
            once = pickle.loads(pickle.dumps(robot))
            others = {
                "copy": robot.copy(),
                "copy.copy": copy.copy(robot),
                "deepcopy": copy.deepcopy({"robot": [robot]})["robot"][0],
                "pickle": once,
                "pickle of a pickle": pickle.loads(pickle.dumps(once, protocol=2)),
            }
            for name, other in others.items():
                with self.subTest(name):
                    self.assertIsNot(other, robot)
                    self.assertEqual(self.answers(other), expected)
            # Each is a robot of its own, which can be changed as the first one can.
            for other in others.values():
                other.set_margin("c", 0)
                other.set_pose("attached 1", np.eye(4))
                other.remove("crate")
            self.assertEqual(self.answers(robot), expected)
            changed = [self.answers(other) for other in others.values()]
            self.assertNotEqual(changed[0], expected)
            self.assertTrue(all(answers == changed[0] for answers in changed))

    def test_a_mesh_is_pickled_once_and_a_file_as_its_path(self):
        with tempfile.TemporaryDirectory() as above:
            robot = cbvh.Robot.from_urdf(URDF)
            size = len(pickle.dumps(robot))
            big = cbvh.bake(np.random.default_rng(1).normal(size=(3000, 3)), np.arange(3000).reshape(-1, 3))
            for place in range(5):
                robot.add_obstacle(big, shifts([place, 0, 0])[0], solid=False)
            added = len(pickle.dumps(robot)) - size
            self.assertTrue(big.nbytes < added < 1.2 * big.nbytes + 2000)
            path = pathlib.Path(above) / "big.cbvh"
            big.save(path)
            robot.add_obstacle(cbvh.open(path), solid=False)
            self.assertLess(len(pickle.dumps(robot)) - size - added, 2000)
            # A mesh that two links have is there once.
            for name in ("base", "link", "hand"):
                (pathlib.Path(above) / f"{name}.obj").write_text((URDF.parent / f"{name}.obj").read_text())
            text = URDF.read_text().replace('scale="0.8 0.8 0.8"', "").replace('scale="0.5 0.5 0.3"', "")
            (pathlib.Path(above) / "twins.urdf").write_text(text)
            twins = cbvh.Robot.from_urdf(pathlib.Path(above) / "twins.urdf")
            self.assertLess(len(pickle.dumps(twins)), size - 2000)
            self.assertEqual(self.answers_of(pickle.loads(pickle.dumps(twins))), self.answers_of(twins))

    def answers_of(self, robot):
        return robot.pairs_in_contact(random_rows(robot, 1, 30))


class Misuse(unittest.TestCase):
    """Errors say what is wrong."""

    def test_files(self):
        with tempfile.TemporaryDirectory() as folder:
            folder = pathlib.Path(folder)

            def of(text, **options):
                path = folder / "robot.urdf"
                path.write_text(text)
                return cbvh.Robot.from_urdf(path, **options)

            link = '<link name="a"/>'
            mesh = '<link name="a"><collision><geometry><mesh filename="{}"/></geometry></collision></link>'
            shape = '<robot><link name="a"><collision><geometry><{}/></geometry></collision></link></robot>'
            (folder / "broken.obj").write_text("v 1 2\n")
            check_errors(
                self,
                [
                    (TypeError, "from_urdf", cbvh.Robot),
                    (FileNotFoundError, "nothing.urdf", cbvh.Robot.from_urdf, folder / "nothing.urdf"),
                    (FileNotFoundError, "no.srdf", lambda: cbvh.Robot.from_urdf(URDF, srdf=folder / "no.srdf")),
                    (ValueError, "robot.urdf", of, "this is no XML"),
                    (ValueError, "expected", of, "<scene/>"),
                    (ValueError, "another link", of, f"<robot>{link}{link}</robot>"),
                    (ValueError, "one link that no joint moves", of, f'<robot>{link}<link name="b"/></robot>'),
                    (ValueError, "absent.obj", of, f"<robot>{mesh.format('absent.obj')}</robot>"),
                    (cbvh.BakeError, "broken.obj", of, f"<robot>{mesh.format('broken.obj')}</robot>"),
                    (ValueError, "base: expected one of fixed, planar, floating", lambda: of("", base="free")),
                    (ValueError, "geometry: expected one of collision, visual", lambda: of("", geometry="both")),
                    (ValueError, "NaN", lambda: of(KINDS, cylinder_error=math.nan)),
                    (TypeError, "cylinder_error: expected a number", lambda: of(KINDS, cylinder_error="1")),
                    (TypeError, "allow_outside: expected a bool", lambda: of(KINDS, allow_outside="no")),
                    (ValueError, "line 1, link a, <sphere>: expected a length of at least 0", of, shape.format('sphere radius="-1"')),
                    (ValueError, "link a, <capsule>: expected", of, shape.format('capsule radius="1" length="-1"')),
                ],
            )

    def test_arguments(self):
        robot, _ = cell()
        q, ball = np.zeros(4), cbvh.sphere(0.1)
        none = [0, 0, math.nan, 0]
        check_errors(
            self,
            [
                (ValueError, "q: expected shape (4,) or (N, 4), found (3,)", robot.collide, [0, 0, 0]),
                (ValueError, "found (2, 2, 4)", robot.pairs_in_contact, np.zeros((2, 2, 4))),
                (ValueError, "found (4, 3)", robot.link_poses, np.zeros((4, 3))),
                (ValueError, "q1: expected shape", robot.is_free, q, [1]),
                (ValueError, "q1: expected 2 rows, as q0, found 3", robot.is_free, np.zeros((2, 4)), np.zeros((3, 4))),
                (ValueError, "joint elbow: expected a finite value, found NaN", robot.collide, none),
                (ValueError, "row 1: joint elbow: expected a finite value, found NaN", robot.distance, [q, none]),
                (ValueError, "row 1: joint elbow", robot.near_pairs, [q, none, none], 0.1),
                (ValueError, "row 2: joint elbow", robot.is_free, [q, q, none], [q, q, q]),
                (ValueError, "row 0: joint elbow", lambda: robot.is_free([q, q], [none, q], parallel=True)),
                (ValueError, "elbow", robot.link_poses, none),
                (ValueError, "elbow", robot.is_free, q, none),
                (ValueError, "row 1: joint elbow", lambda: robot.collide([q, none], parallel=True)),
                (ValueError, "clearance", lambda: robot.is_free(q, q, clearance=-1)),
                (ValueError, "clearance", lambda: robot.motion(q, q, clearance=math.inf)),
                (ValueError, "tolerance", lambda: robot.is_free(q, q, tolerance=math.nan)),
                (ValueError, "joint elbow: expected a finite value, found NaN", robot.signed_distance, none),
                (ValueError, "relative_gap: expected a finite part above 0", lambda: robot.signed_distance(q, relative_gap=0)),
                (ValueError, "tolerance: expected a finite depth", lambda: robot.signed_distance(np.zeros((0, 4)), tolerance=-1)),
                (TypeError, "tolerance: expected a number, found str", lambda: robot.signed_distance(q, tolerance="x")),
                (ValueError, "one configuration each", robot.motion, [q], q),
                (ValueError, "coefficients: expected shape (4, degree + 1)", robot.motion_along, np.zeros((3, 2))),
                (ValueError, "coefficients: expected shape (4, degree + 1)", robot.motion_along, np.zeros((4, 0))),
                (TypeError, "q: expected numbers, found dtype <U1", robot.collide, ["a", "b", "c", "d"]),
                (TypeError, "q: expected numbers, found dtype complex128", robot.distance, q * 1j),
                (TypeError, "q1: expected numbers, found dtype complex128", robot.is_free, q, q * 1j),
                (TypeError, "coefficients: expected numbers", robot.motion_along, np.zeros((4, 2)) * 1j),
                (TypeError, "clearance: expected a number, found str", lambda: robot.is_free(q, q, clearance="1")),
                (TypeError, "tolerance: expected a number, found str", lambda: robot.motion(q, q, tolerance="1")),
                (TypeError, "elbow: expected a number, found str", lambda: robot.q(elbow="1")),
                (TypeError, "allowed: expected a bool, found str", robot.allow, "hand", "base", "no"),
                (ValueError, "path: expected at least two configurations, found 1", robot.first_hit, [q]),
                (ValueError, "path: expected at least two configurations, found 1", robot.first_hit, q),
                (ValueError, "path: expected at least two configurations, found 0", robot.first_hit, np.zeros((0, 4))),
                (ValueError, "samples: expected a whole number of at least 1, found -1", robot.allow_frequent, -1),
                (ValueError, "samples: expected a whole number of at least 1, found 0", robot.allow_frequent, 0),
                (TypeError, "share: expected a number, found str", robot.allow_frequent, 1, "1"),
                *((ValueError, "share: expected a part above 0", robot.allow_frequent, 1, share) for share in (math.nan, 2, 0, -1)),
                (KeyError, "'elbo'", robot.q, {"elbo": 1}),
                (KeyError, "'finger'; there are base, turret", robot.allow, "hand", "finger"),
                (KeyError, "'finger'", robot.attach, ball, "finger"),
                (KeyError, "'finger'", lambda: robot.attach(ball, "hand", may_touch=["finger"])),
                (KeyError, "'hand'; there are pillar", robot.remove, "hand"),
                (KeyError, "'hand'", robot.set_pose, "hand", np.eye(4)),
                (KeyError, "'cup'", robot.set_margin, "cup", 1),
                (ValueError, "pillar", lambda: robot.add_obstacle(ball, name="pillar")),
                (ValueError, "hand", lambda: robot.attach(ball, "hand", name="hand")),
                (ValueError, "pose", robot.add_obstacle, ball, np.eye(3)),
                (ValueError, "scaled by 2", robot.add_obstacle, ball, np.diag([2.0, 2, 2, 1])),
                (ValueError, "margin: expected a finite distance of at least 0, found -1", robot.set_margin, "pillar", -1),
                (TypeError, "margin: expected a number, found str", robot.set_margin, "pillar", "1"),
            ],
        )
        # Nothing of that has changed anything.
        names = {name for pair in robot.pairs for name in pair}
        self.assertEqual(names, {"base", "turret", "upper_arm", "forearm", "hand", "pillar", "shelf", "ball", "tool"})
        moving = cbvh.Robot.from_urdf(URDF, base="floating")
        with self.assertRaises(ValueError) as caught:
            moving.collide(np.zeros(11))
        self.assertIn("quaternion", str(caught.exception))


try:
    ROBOTS = pathlib.Path(
        str(importlib.metadata.distribution("example-robot-data").locate_file("cmeel.prefix/share/example-robot-data/robots"))
    )
except importlib.metadata.PackageNotFoundError:
    ROBOTS = None


@unittest.skipIf(ROBOTS is None, "example-robot-data is not installed")
class RealRobots(unittest.TestCase):
    """Robots of example-robot-data, with their own semantics, links and meshes."""

    FILES = {
        "panda": ("panda_description/urdf/panda.urdf", "panda_description/srdf/panda.srdf", 9),
        "xarm7": ("xarm_description/urdf/xarm7.urdf", "xarm_description/srdf/xarm7.srdf", 7),
        "pr2": ("pr2_description/urdf/pr2.urdf", "pr2_description/srdf/pr2.srdf", None),
        "talos": ("talos_data/robots/talos_reduced.urdf", "talos_data/srdf/talos.srdf", None),
    }

    def test_kinematics_and_motions(self):
        for name, (urdf, srdf, _) in self.FILES.items():
            with self.subTest(name):
                robot = cbvh.Robot.from_urdf(ROBOTS / urdf, srdf=ROBOTS / srdf)
                rows, kinematics = random_rows(robot, 1, 20), Kinematics(ROBOTS / urdf)
                for row, poses in zip(rows, robot.link_poses(rows)):
                    values = dict(zip(robot.joints, row))
                    for link, pose in zip(robot.links, poses):
                        np.testing.assert_allclose(pose, kinematics.pose(link, values), atol=1e-12)
                ends = rows + random_rows(robot, 2, 20, 0.1)
                free, touching = robot.is_free(rows, ends), robot.pairs_in_contact(rows)
                self.assertEqual(robot.collide(rows).tolist(), [bool(pairs) for pairs in touching])
                distance = robot.distance(rows)
                self.assertEqual((distance.distance == 0).tolist(), [bool(pairs) for pairs in touching])
                for row, end, is_free in zip(rows, ends, free):
                    along = row + np.linspace(0, 1, 101)[:, None] * (end - row)
                    self.assertFalse(is_free and robot.collide(along).any())

    def test_disabled_pairs_are_not_asked_about(self):
        for name, (urdf, srdf, _) in self.FILES.items():
            with self.subTest(name):
                robot = cbvh.Robot.from_urdf(ROBOTS / urdf, srdf=ROBOTS / srdf)
                root = ElementTree.parse(ROBOTS / srdf).getroot()
                disabled = {frozenset([of.get("link1"), of.get("link2")]) for of in root.findall("disable_collisions")}
                self.assertTrue(robot.pairs)
                self.assertFalse(disabled & {frozenset(pair) for pair in robot.pairs})


if __name__ == "__main__":
    unittest.main()
