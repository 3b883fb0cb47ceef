"""Runs python-fcl's own tests, its example and a program of its README on cbvh.

A module `fcl` is made here of the counterparts that the book names for users of FCL (spec/book/src/migrate/fcl-coal.md). It has
the names that those programs use, and no more. The argument is a checkout of python-fcl, because its wheels do not contain these
files. The example also runs with python-fcl, which must be installed, and both have to print the same, but for what `alike` names.
"""

import contextlib
import io
import pathlib
import re
import runpy
import sys
import types
import unittest

import numpy as np

import cbvh

# How far numbers of the example may differ: cones and cylinders are 0.002 of the radius larger here, and the largest radius is 5.
ROUNDNESS = 0.002 * 5.0


class Transform:
    """A pose. A quaternion of FCL has its real part first, and need not have length 1."""

    def __init__(self, *parts):
        self.matrix = np.eye(4)
        for part in parts:
            if isinstance(part, Transform):
                self.matrix = part.matrix.copy()
                continue
            part = np.asarray(part, float)
            if part.shape == (3,):
                self.matrix[:3, 3] = part
            else:
                self.matrix[:3, :3] = rotation(part)


def rotation(part):
    """The rotation of a quaternion or a matrix, rounded ones included."""
    if part.shape == (4,):
        part = part / np.linalg.norm(part)
        return cbvh.pose([0, 0, 0], [*part[1:], part[0]])[:3, :3]
    whole = np.eye(4)
    whole[:3, :3] = part
    return cbvh.nearest_pose(whole)[:3, :3]


class Geometry:
    """A mesh of cbvh, and where its origin is in the frame of FCL's shape."""

    def __init__(self, mesh=None, lifted=0.0):
        self.mesh, self.at = mesh, cbvh.pose([0, 0, lifted])

    # The calls that fill FCL's BVHModel.
    def beginModel(self, *counts):
        pass

    def addSubModel(self, vertices, faces):
        self.mesh = cbvh.bake(vertices, faces)

    def endModel(self):
        pass


class CollisionObject:
    def __init__(self, geometry, transform=None):
        self.geometry, self.pose = geometry, Transform(transform or Transform()).matrix

    def setTranslation(self, translation):
        self.pose[:3, 3] = translation

    def setRotation(self, matrix):
        self.pose[:3, :3] = rotation(np.asarray(matrix, float))

    def setQuatRotation(self, quaternion):
        self.setRotation(rotation(np.asarray(quaternion, float)))

    def setTransform(self, transform):
        self.pose = transform.matrix.copy()

    @property
    def placed(self):
        return self.pose @ self.geometry.at


class Fields(types.SimpleNamespace):
    """Requests and results, whose fields these programs read and write."""


def request(**fields):
    known = {"num_max_contacts": 1, "enable_contact": False, "enable_nearest_points": False, "enable_signed_distance": False}
    return Fields(**(known | fields))


def data(make_request, make_result):
    return lambda request=None, result=None: Fields(
        request=request or make_request(), result=result or make_result(), done=False
    )


def collide(a, b, asked, result):
    pose = cbvh.relative(a.placed, b.placed)
    of = a.geometry.mesh, b.geometry.mesh
    if of[0].collide(of[1], pose):
        # A solid in another solid touches it without a pair of triangles.
        found = max(len(of[0].contacts(of[1], pose)), 1)
        room = asked.num_max_contacts - len(result.contacts)
        result.contacts += [Fields(o1=a.geometry, o2=b.geometry) for _ in range(min(found, room))]
        result.is_collision = True
    return len(result.contacts)


def distance(a, b, asked, result):
    pose = cbvh.relative(a.placed, b.placed)
    found = a.geometry.mesh.signed_distance(b.geometry.mesh, pose, relative_gap=1e-6)
    length = found.lower if found.upper <= 0 else found.upper
    if length < 0 and not asked.enable_signed_distance:
        length = -1.0
    if length < result.min_distance:
        result.min_distance = length
        points = np.array([found.point_a, found.point_b])
        result.nearest_points = list(points @ a.placed[:3, :3].T + a.placed[:3, 3])
    return length


def continuous_collide(a, end_a, b, end_b, asked, result):
    """The first contact on the way. Of two bodies that both turn, the relative motion is another one than FCL's."""
    starts = cbvh.relative(a.placed, b.placed)
    ends = cbvh.relative(end_a.matrix @ a.geometry.at, end_b.matrix @ b.geometry.at)
    answer = a.geometry.mesh.motion(b.geometry.mesh, cbvh.Motion.between(starts, ends))
    result.is_collide = answer.kind == cbvh.MotionKind.HIT
    result.time_of_contact = answer.at if result.is_collide else 1.0
    return result.time_of_contact


class Manager:
    """Objects of a scene. A scene of two groups serves questions of a manager about others."""

    def __init__(self):
        self.objects = []

    def registerObjects(self, objects):
        self.objects += objects

    def getObjects(self):
        return list(self.objects)

    def setup(self):
        """Scenes are made for each question, so that nothing needs an update."""

    def update(self, changed):
        self.setup()

    def pairs(self, others):
        """A scene and its objects by number: of all pairs of this manager, or of pairs with others."""
        scene, of = cbvh.Scene(), {}
        groups = [(self.objects, (1, 1 if others is None else 2)), (others or [], (2, 1))]
        for objects, (member, meets) in groups:
            for one in objects:
                of[scene.add(one.geometry.mesh, one.placed, member=member, meets=meets)] = one
        return scene, of

    def asked(self, arguments):
        """What stands before the data and the callback: nothing, an object or a manager."""
        *other, kept, _ = arguments
        if not other:
            return None, kept
        return (other[0].objects if isinstance(other[0], Manager) else [other[0]]), kept

    def collide(self, *arguments):
        others, kept = self.asked(arguments)
        scene, of = self.pairs(others)
        for a, b in scene.pairs_in_contact():
            collide(of[a], of[b], kept.request, kept.result)

    def distance(self, *arguments):
        others, kept = self.asked(arguments)
        scene, of = self.pairs(others)
        found = scene.signed_distance(relative_gap=1e-6)
        if found is not None:
            distance(of[found.a], of[found.b], kept.request, kept.result)


def module():
    """The module `fcl` on cbvh."""
    result = lambda: Fields(is_collision=False, contacts=[])
    nearest = lambda: Fields(min_distance=sys.float_info.max, nearest_points=[None, None])
    fcl = types.ModuleType("fcl")
    vars(fcl).update(
        Box=lambda x, y, z: Geometry(cbvh.box([x, y, z])),
        Sphere=lambda radius: Geometry(cbvh.sphere(radius)),
        Capsule=lambda radius, length: Geometry(cbvh.capsule(radius, length)),
        Cylinder=lambda radius, length: Geometry(cbvh.cylinder(radius, length)),
        Cone=lambda radius, length: Geometry(cbvh.cone(radius, length), -length / 2),
        Convex=lambda vertices, count, faces: Geometry(cbvh.convex_hull(vertices)),
        BVHModel=Geometry,
        Transform=Transform,
        CollisionObject=CollisionObject,
        CollisionRequest=request,
        CollisionResult=result,
        CollisionData=data(request, result),
        DistanceRequest=request,
        DistanceResult=nearest,
        DistanceData=data(request, nearest),
        ContinuousCollisionRequest=request,
        ContinuousCollisionResult=lambda: Fields(is_collide=False, time_of_contact=1.0),
        DynamicAABBTreeCollisionManager=Manager,
        defaultCollisionCallback=None,
        defaultDistanceCallback=None,
        collide=collide,
        distance=distance,
        continuousCollide=continuous_collide,
    )
    return fcl


def example(path):
    """What a program prints, as lines."""
    said = io.StringIO()
    with contextlib.redirect_stdout(said):
        runpy.run_path(str(path))
    return said.getvalue().splitlines()


def numbers(line):
    return [float(number) for number in re.findall(r"-?\d+(?:\.\d*)?(?:e[+-]?\d+)?", line)]


def alike(ours, theirs):
    """The lines of two outputs of the example that differ, as messages.

    Lines of contacts name addresses, and there are as many as pairs of triangles or as FCL's contacts; so with their number, which
    is only 0 in both or in none. Several pairs of points may be equally near or deep, so that their lines are not compared.
    """
    kept = [[line for line in lines if not line.startswith(("\tO1:", "["))] for lines in (ours, theirs)]
    if len(kept[0]) != len(kept[1]):
        yield f"expected {len(kept[1])} lines, found {len(kept[0])}"
    for our, their in zip(*kept):
        found, expected = numbers(our), numbers(their)
        if "contacts:" in our:
            found, expected = np.minimum(found, 1), np.minimum(expected, 1)
        words = re.sub(r"[-\d.e+]+$", "", our) == re.sub(r"[-\d.e+]+$", "", their)
        if not words or len(found) != len(expected) or not np.allclose(found, expected, rtol=0, atol=ROUNDNESS):
            yield f"expected {their}, found {our}"


def readme(checkout):
    """The whole program of the README, and what it says that it prints."""
    text = (checkout / "README.md").read_text(encoding="utf-8")
    (program,) = [block for block in re.findall(r"```python\n(.*?)```", text, re.DOTALL) if "geom_id_to_name" in block]
    return program, re.findall(r"^>>> (.*)$", text, re.MULTILINE)


def main(checkout):
    checkout = pathlib.Path(checkout)
    theirs = example(checkout / "examples/example.py")
    for name in [name for name in sys.modules if name.split(".")[0] == "fcl"]:
        del sys.modules[name]
    sys.modules["fcl"] = module()
    wrong = list(alike(example(checkout / "examples/example.py"), theirs))
    print(f"the example: {len(theirs)} lines of python-fcl, {len(wrong)} of which differ")
    program, expected = readme(checkout)
    said = io.StringIO()
    with contextlib.redirect_stdout(said):
        exec(compile(program, "README.md", "exec"), {})
    if said.getvalue().splitlines() != expected:
        wrong.append(f"README.md: expected {expected}, found {said.getvalue()}")
    print("\n".join(wrong))
    tests = unittest.defaultTestLoader.discover(str(checkout / "tests"))
    result = unittest.TextTestRunner(verbosity=2).run(tests)
    return 0 if not wrong and result.wasSuccessful() and result.testsRun >= 15 else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
