"""Exact collision and distance queries between triangle meshes.

A mesh is baked once, from arrays or from a file, into a ``.cbvh`` file, which is then used in place:

>>> import cbvh, numpy as np
>>> tetrahedron = cbvh.bake([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
>>> pose = np.eye(4)
>>> pose[:3, 3] = [0, 0, 3]
>>> tetrahedron.collide(tetrahedron, pose)
False
>>> tetrahedron.distance(tetrahedron, pose).distance
2.0

**Poses** are arrays of shape (4, 4), for one query, or (N, 4, 4), for N queries. A pose maps *body to world*: a
point ``x`` of the body stands at ``pose[:3, :3] @ x + pose[:3, 3]`` in the world. For two meshes, the world is the
frame of the first one. Rotations must be rigid to within 2^-20, and those of scenes and of `relative` to within 2^-23.
Matrices with eight digits after the point are. `nearest_pose` makes a pose from a matrix that is less exact.

**Motions.** `Motion.between`, `Motion.screw`, `Polyline` and objects of your own (`Path`) are paths of a body.
`Mesh.motion` and `Mesh.is_free` tell whether a path is free; the answer is certain at every moment.

**Overlap.** `Mesh.penetration` bounds how deep closed meshes overlap, and gives a translation that separates them.
`Mesh.signed_distance` is one number for both: the distance of meshes that are apart, and minus the depth of others. Scenes
and robots have it for the pair whose number is the least, and `Scene.near_pairs` and `Robot.near_pairs` for all pairs that are near:
for robots with its derivative by each joint value, as planners that optimise need it.
`Mesh.clash` and `Scene.clashes` tell parts that touch from parts that overlap, are near, contain each other or are there twice.
`Mesh.intersection` measures what closed meshes have in common: volume, box, and how thick the one is where the other pierces it.
`Mesh.contact_regions` and `Mesh.patches` tell where and how surfaces meet, and `Mesh.self_contacts` where a mesh meets
itself.

**Scenes** are many placed meshes (`Scene`). `CollisionManager` has trimesh's interface for them.

**Robots** are read from URDF files, and take the values of their joints (`Robot`). A body that starts inside a
closed obstacle that is no solid does not touch it, and `InsideWarning` says so.

**Answers** to one query are plain values. Answers to N queries are arrays of N elements or rows, or lists of N
arrays if each query may have any number of results. Lengths are in mesh units. Contact and insides are decided
exactly. Touching is contact, and meshes are surfaces, unless they are made solid.

**Shapes.** `sphere`, `capsule`, `box`, `cylinder`, `cone`, `convex_hull`, `cloud`, `voxels`, `octree`, `height_field` and
`ground` make meshes of simple shapes, and `Mesh.rounded` gives any mesh a radius.

**Seeing.** `Mesh.view` and `Scene.view` make a page that shows meshes, which a notebook shows at once (`View`).

**Threads.** While a query runs, other threads of Python run, and any number of threads may run queries at the same time.
``parallel=True`` divides the N queries of one call among all cores; the answers are the same bits. A query is
about a `Scene` as it is when the query begins, and a path of your own is called on the thread of its query. Arrays
are copied before a query runs, so changing an array meanwhile does not affect answers. An interpreter without a global lock
enables the lock when it imports this module.

**Stopping.** In the block of a `Stop`, queries and bakes end when another thread sets its flag, or after a time. Ctrl-C ends those of the
main thread, within about a tenth of a second. A bake that is stopped leaves no file behind.

Errors are exceptions: ``ValueError`` for invalid arguments, ``TypeError`` for arguments of a wrong type, ``KeyError``
for instances that a scene does not have, ``OSError`` for files that the system refuses, ``FormatError`` for files that
are damaged or are not .cbvh files, ``BakeError`` for meshes that cannot be baked, ``StoppedError`` for queries and bakes that a
`Stop` ends.
"""

from ._answers import (
    Clash,
    ClashClass,
    ClosestPoint,
    ContactRegions,
    Distance,
    Intersection,
    IntersectionSurface,
    MotionAnswer,
    MotionKind,
    OpenEdge,
    OpenEdges,
    Patches,
    Penetration,
    RayHit,
    RegionKind,
    Relation,
    SceneClashes,
    SceneClosestPoint,
    SceneContacts,
    SceneDistance,
    SceneDistances,
    SceneMotionAnswer,
    SceneNearPairs,
    ScenePenetrations,
    SceneRayHit,
    SceneRelations,
    SceneSignedDistance,
    SelfContactKind,
    SelfContacts,
    Separation,
    Side,
    SignedDistance,
)
from ._baking import BakeWarning, bake, bake_files
from ._cbvh import BakeError, FormatError, StoppedError, __version__
from ._mesh import Mesh, _unpickle, open
from ._motion import Motion, Path, Polyline
from ._poses import nearest_pose, pose, relative
from ._robot import InsideWarning, NearPair, NearPairs, Robot, RobotDistance, RobotMotion, RobotSignedDistance, _robot_of
from ._scene import Scene, _scene_of
from ._shapes import box, capsule, cloud, cone, convex_hull, cylinder, ground, height_field, octree, sphere, voxels
from ._stopping import Stop
from ._view import View
from .manager import CollisionManager

__all__ = [
    "BakeError",
    "BakeWarning",
    "Clash",
    "ClashClass",
    "ClosestPoint",
    "CollisionManager",
    "ContactRegions",
    "Distance",
    "FormatError",
    "InsideWarning",
    "Intersection",
    "IntersectionSurface",
    "Mesh",
    "Motion",
    "MotionAnswer",
    "MotionKind",
    "NearPair",
    "NearPairs",
    "OpenEdge",
    "OpenEdges",
    "Patches",
    "Path",
    "Penetration",
    "Polyline",
    "RayHit",
    "RegionKind",
    "Relation",
    "Robot",
    "RobotDistance",
    "RobotMotion",
    "RobotSignedDistance",
    "Scene",
    "SceneClashes",
    "SceneClosestPoint",
    "SceneContacts",
    "SceneDistance",
    "SceneDistances",
    "SceneMotionAnswer",
    "SceneNearPairs",
    "ScenePenetrations",
    "SceneRayHit",
    "SceneRelations",
    "SceneSignedDistance",
    "SelfContactKind",
    "SelfContacts",
    "Separation",
    "Side",
    "SignedDistance",
    "Stop",
    "StoppedError",
    "View",
    "bake",
    "bake_files",
    "box",
    "capsule",
    "cloud",
    "cone",
    "convex_hull",
    "cylinder",
    "ground",
    "height_field",
    "nearest_pose",
    "octree",
    "open",
    "pose",
    "relative",
    "sphere",
    "voxels",
    "__version__",
]

# What is public belongs to this module, in pickles and in messages, whatever file it is in.
for _thing in (*(globals()[name] for name in __all__ if name != "__version__"), _unpickle, _robot_of, _scene_of):
    _thing.__module__ = __name__
del _thing
