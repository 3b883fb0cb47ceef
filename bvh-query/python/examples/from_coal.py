"""A Coal user's code beside its port to cbvh: the same queries of the same poses, with the same results.

    pip install coal
    python examples/from_coal.py

| Coal | cbvh |
|---|---|
| a `BVHModelOBBRSS`, filled and built at each start | `bake` or, once for all starts, `bake_files` and `open` |
| two transforms | the pose of b in the frame of a (body to world): `cbvh.relative(pose_a, pose_b)`, or N at once |
| `collide` | `a.collide(b, poses)` |
| `collide` with a `security_margin` | `a.within(b, poses, margin)` |
| `collide` with many contacts | `a.contacts(b, poses)`: all pairs of triangles that touch |
| `distance`, `getNearestPoint1` and 2 | `a.distance(b, poses)`, `point_a` and `point_b`, in the frame of a |
"""

import pathlib
import time

import coal
import numpy as np

import cbvh

TESTDATA = pathlib.Path(__file__).resolve().parents[3] / "testdata"


def read_obj(path):
    """Vertices and faces. Both libraries hold these numbers as they are."""
    lines = [line.split() for line in path.read_text().splitlines()]
    vertices = [[float(field) for field in line[1:4]] for line in lines if line[:1] == ["v"]]
    faces = [[int(field.split("/")[0]) - 1 for field in line[1:4]] for line in lines if line[:1] == ["f"]]
    return np.array(vertices), np.array(faces)


def random_poses(count):
    numbers = np.random.default_rng(7)
    poses = np.tile(np.eye(4), (count, 1, 1))
    for pose in poses:
        turn, _ = np.linalg.qr(numbers.normal(size=(3, 3)))
        pose[:3, :3] = turn * np.linalg.det(turn)
        pose[:3, 3] = numbers.uniform([-2800, -2800, 200], [2800, 2800, 2800])
    return poses


class WithCoal:
    def __init__(self, a, b):
        self.a, self.b = self.model(*a), self.model(*b)

    def model(self, vertices, faces):
        model = coal.BVHModelOBBRSS()
        model.beginModel(len(faces), len(vertices))
        model.addVertices(vertices)
        model.addTriangles(faces)
        model.endModel()
        return model

    def asked(self, function, request, new_result, poses):
        for pose in poses:
            place, result = coal.Transform3s(pose[:3, :3], pose[:3, 3]), new_result()
            function(self.a, coal.Transform3s(), self.b, place, request, result)
            yield result

    def within(self, poses, margin):
        request = coal.CollisionRequest()
        request.security_margin, request.num_max_contacts = margin, 1
        return [result.isCollision() for result in self.asked(coal.collide, request, coal.CollisionResult, poses)]

    def collide(self, poses):
        return self.within(poses, 0.0)

    def contacts(self, poses):
        request = coal.CollisionRequest()
        request.num_max_contacts = 1_000_000
        results = self.asked(coal.collide, request, coal.CollisionResult, poses)
        return [sorted((contact.b1, contact.b2) for contact in result.getContacts()) for result in results]

    def distance(self, poses):
        results = self.asked(coal.distance, coal.DistanceRequest(), coal.DistanceResult, poses)
        return [(found.min_distance, *found.getNearestPoint1(), *found.getNearestPoint2()) for found in results]


class WithCbvh:
    def __init__(self, a, b):
        self.a, self.b = cbvh.bake(*a), cbvh.bake(*b)

    def collide(self, poses):
        return self.a.collide(self.b, poses)

    def within(self, poses, margin):
        return self.a.within(self.b, poses, margin)

    def contacts(self, poses):
        # Columns 0 and 2 are objects of a file, which has one here.
        return [list(map(tuple, rows[:, [1, 3]].tolist())) for rows in self.a.contacts(self.b, poses)]

    def distance(self, poses):
        found = self.a.distance(self.b, poses)
        return np.column_stack([found.distance, found.point_a, found.point_b])


def main():
    a, b = read_obj(TESTDATA / "fclenv.obj"), read_obj(TESTDATA / "fclrob.obj")
    old, new, poses = WithCoal(a, b), WithCbvh(a, b), random_poses(1000)
    for question, *arguments in (("collide",), ("within", 50.0), ("contacts",), ("distance",)):
        answers, times = [], []
        for library in (old, new):
            ask = getattr(library, question)
            ask(poses[:10], *arguments)
            start = time.perf_counter()
            answers.append(ask(poses, *arguments))
            times.append((time.perf_counter() - start) / len(poses) * 1e6)
        expected, found = answers
        if question == "distance":
            # Where they touch, the points are any that they have in common.
            expected, found = (np.where(rows[:, :1] > 0, rows, 0) for rows in (np.array(expected), found))
            is_same = np.all(np.abs(found - expected) <= 1e-9 * np.ptp(a[0], axis=0).max(), axis=1)
        else:
            is_same = np.array([one == other for one, other in zip(found, expected)])
        of_coal, of_cbvh = times
        print(f"{question}: {is_same.sum()} of {len(poses)} agree; coal {of_coal:.1f}, cbvh {of_cbvh:.1f} us per pose")
        assert is_same.all() and len(found) == len(expected) == len(poses)


if __name__ == "__main__":
    main()
