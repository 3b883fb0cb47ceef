"""Coal: a BVHModel of OBBRSS volumes per mesh, without security margin and break distance, so that answers are about the meshes.

    pip install numpy coal
"""

import coal
from serve import rows, serve

IDENTITY = coal.Transform3s.Identity()
ALL_CONTACTS = 100_000


def mesh(corners, triangles):
    model = coal.BVHModelOBBRSS()
    model.beginModel(len(triangles), len(corners))
    model.addVertices(corners)
    for t in triangles.tolist():
        model.addTriangle(*(corners[i] for i in t))
    model.endModel()
    return model


def collided(a, b, question, count):
    request = coal.CollisionRequest()
    request.num_max_contacts, request.security_margin, request.break_distance = count, 0.0, 0.0
    request.enable_contact = count > 1
    result = coal.CollisionResult()
    coal.collide(a, IDENTITY, b, coal.Transform3s(*rows(question)), request, result)
    return result


def collide(a, b, question):
    return {"answer": bool(collided(a, b, question, 1).isCollision())}


def contacts(a, b, question):
    found = collided(a, b, question, ALL_CONTACTS)
    return {"answer": sorted({(c.b1, c.b2) for c in (found.getContact(i) for i in range(found.numContacts()))})}


def distance(a, b, question):
    request, result = coal.DistanceRequest(), coal.DistanceResult()
    request.enable_signed_distance = False
    return {"answer": max(float(coal.distance(a, IDENTITY, b, coal.Transform3s(*rows(question)), request, result)), 0.0)}


def timed_collide(a, b, pose):
    return coal.collide(a, IDENTITY, b, pose, ONE, coal.CollisionResult())


def timed_distance(a, b, pose):
    return coal.distance(a, IDENTITY, b, pose, coal.DistanceRequest(), coal.DistanceResult())


ONE = coal.CollisionRequest()
ONE.num_max_contacts, ONE.security_margin, ONE.break_distance, ONE.enable_contact = 1, 0.0, 0.0, False

serve(
    "Coal", coal.__version__, "BVHModelOBBRSS, security_margin 0, break_distance 0", mesh,
    {"collide": collide, "contacts": contacts, "distance": distance},
    {"collide": (coal.Transform3s, timed_collide, bool), "distance": (coal.Transform3s, timed_distance, lambda d: max(d, 0.0))},
    coordinates="f64", placement="f64", features=["open", "concave", "nested", "overlapping parts", "degenerate", "range"], distance_error=1e-6, error_unit="size",
)  # fmt: skip
