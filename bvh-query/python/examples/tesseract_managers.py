"""Tesseract's contact managers beside a cbvh scene: the same geometry, names and poses, and who finds which contacts.

    pip install tesseract-robotics
    python examples/tesseract_managers.py

The objects are a bin and a hoop as meshes, and a ball and a brick. Tesseract has managers of Bullet and of FCL, and the
wheel has their plugins. Bullet and the scene find the same contacts, none of them in the middle of the bin and of the hoop.
FCL's manager passes over balls that touch meshes.
"""

import collections
import pathlib

import numpy as np
import tesseract_robotics
from tesseract_robotics import tesseract_collision as collision, tesseract_common as common, tesseract_geometry as geometry

import cbvh
from _cell import at, open_box, ring

BIN, HOOP, POSES = open_box(0.3, 0.4, 0.2, 0.01), ring(0.25, 0.03), 500
MANAGERS = ("BulletDiscreteBVHManager", "FCLDiscreteBVHManager")


def tesseract_mesh(vertices, faces):
    points = common.VectorVector3d()
    for vertex in vertices:
        points.append(vertex)
    # The number of corners before each face.
    return geometry.Mesh(points, np.insert(faces, 0, 3, axis=1).ravel().astype(np.int32))


def managers(objects):
    """Tesseract's managers, with the objects."""
    libraries = pathlib.Path(tesseract_robotics.__file__).parents[1] / "tesseract_robotics.libs"
    names = [path.stem.removeprefix("lib") for path in libraries.glob("libtesseract_collision_*_factories*")]
    plugins = {name: {"class": f"{name}Factory"} for name in MANAGERS}
    # YAML reads JSON, which is what Python prints here.
    discrete = {"default": MANAGERS[0], "plugins": plugins}
    config = {"search_paths": [str(libraries)], "search_libraries": names, "discrete_plugins": discrete}
    locator = common.GeneralResourceLocator()
    factory = collision.ContactManagersPluginFactory(str({"contact_manager_plugins": config}), locator)
    for name in MANAGERS:
        manager = factory.createDiscreteContactManager(name)
        for of, shape in objects.items():
            shapes, poses = geometry.GeometriesConst(), common.VectorIsometry3d()
            shapes.append(shape)
            poses.append(common.Isometry3d(np.eye(4)))
            manager.addCollisionObject(of, 0, shapes, poses)
        manager.setActiveCollisionObjects(list(objects))
        yield name, manager, (factory, locator)


def pairs_of(manager):
    results, flat = collision.ContactResultMap(), collision.ContactResultVector()
    manager.contactTest(results, collision.ContactRequest(collision.ContactTestType_CLOSEST))
    results.flattenCopyResults(flat)
    return {frozenset(contact.link_names) for contact in flat if contact.distance <= 0}


both = {
    "bin": (tesseract_mesh(*BIN), cbvh.bake(*BIN)),
    "hoop": (tesseract_mesh(*HOOP), cbvh.bake(*HOOP)),
    "ball": (geometry.Sphere(0.05), cbvh.sphere(0.05)),
    "brick": (geometry.Box(0.1, 0.2, 0.04), cbvh.box([0.1, 0.2, 0.04])),
}
scene = cbvh.Scene()
for name, (_, mesh) in both.items():
    scene.add(mesh, name=name)
others = list(managers({name: shape for name, (shape, _) in both.items()}))

# First in the middle of the bin and of the hoop, and then anywhere.
fixed = {"bin": at(0, 0, 0), "hoop": at(0, 0, 0.6), "ball": at(0, 0, 0.1), "brick": at(0, 0, 0.6)}
rng, found = np.random.default_rng(1), collections.Counter()
for number in range(POSES + 1):
    poses = fixed
    if number:
        turn = lambda: at(*rng.normal(0, 0.15, 3), rng.integers(3), rng.uniform(0, 2 * np.pi))
        poses = {name: turn() @ turn() for name in both}
    for name, pose in poses.items():
        scene.set_pose(name, pose)
    contacts = {frozenset(scene.name(of) for of in pair) for pair in scene.pairs_in_contact()}
    found["contacts"] += len(contacts)
    for name, manager, _ in others:
        for of, pose in poses.items():
            manager.setCollisionObjectsTransform(of, common.Isometry3d(pose))
        theirs = pairs_of(manager)
        assert number or not theirs | contacts, "in the middle of a bin and of a hoop there is no contact"
        assert theirs <= contacts and (theirs == contacts or name == MANAGERS[1])
        found[name] += len(theirs)
        assert all("ball" in pair for pair in contacts - theirs)

print(f"{POSES} poses of {len(both)} objects, {found['contacts']} contacts")
for name in MANAGERS:
    print(f"{name}: finds {found[name]} of them, and no others")
