"""FCL through python-fcl: a BVHModel of OBBRSS volumes per mesh, exact triangle tests without a tolerance, all contacts asked for.

    pip install numpy python-fcl
"""

from importlib.metadata import version

import fcl
from serve import rows, serve

IDENTITY = fcl.Transform()
ALL_CONTACTS = 100_000


def mesh(corners, triangles):
    model = fcl.BVHModel()
    model.beginModel(len(corners), len(triangles))
    model.addSubModel(corners, triangles)
    model.endModel()
    return model


def placed(a, b, question):
    return fcl.CollisionObject(a, IDENTITY), fcl.CollisionObject(b, fcl.Transform(*rows(question)))


def collide(a, b, question):
    return {"answer": fcl.collide(*placed(a, b, question), fcl.CollisionRequest(), fcl.CollisionResult()) > 0}


def contacts(a, b, question):
    result = fcl.CollisionResult()
    request = fcl.CollisionRequest(num_max_contacts=ALL_CONTACTS, enable_contact=True)
    fcl.collide(*placed(a, b, question), request, result)
    # One pair of triangles may have several contact points.
    return {"answer": sorted({(int(c.b1), int(c.b2)) for c in result.contacts})}


def distance(a, b, question):
    return {"answer": max(fcl.distance(*placed(a, b, question), fcl.DistanceRequest(), fcl.DistanceResult()), 0.0)}


def timed_collide(a, b, pose):
    return fcl.collide(fcl.CollisionObject(a, IDENTITY), fcl.CollisionObject(b, pose), fcl.CollisionRequest(), fcl.CollisionResult())


def timed_distance(a, b, pose):
    return fcl.distance(fcl.CollisionObject(a, IDENTITY), fcl.CollisionObject(b, pose), fcl.DistanceRequest(), fcl.DistanceResult())


serve(
    "FCL", version("python-fcl"), "BVHModel, OBBRSS, default requests", mesh,
    {"collide": collide, "contacts": contacts, "distance": distance},
    {"collide": (fcl.Transform, timed_collide, lambda count: count > 0), "distance": (fcl.Transform, timed_distance, lambda d: max(d, 0.0))},
    coordinates="f64", placement="f64", features=["open", "concave", "nested", "overlapping parts", "degenerate", "range"], distance_error=1e-6, error_unit="size",
)  # fmt: skip
