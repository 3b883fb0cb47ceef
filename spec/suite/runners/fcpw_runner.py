"""FCPW: a vectorized tree in single precision, asked about many rays or points in one call. Timed questions only.

    pip install numpy fcpw

Its Python module does not return whether rays of one call hit anything at all, so that is not asked.
"""

from importlib.metadata import version

import fcpw
import numpy as np
from serve import cores, serve

FARTHEST = np.finfo(np.float32).max


def mesh(corners, triangles):
    scene = fcpw.scene_3D()
    scene.set_object_count(1)
    scene.set_object_vertices(np.asfortranarray(corners, np.float32), 0)
    scene.set_object_triangles(np.asfortranarray(triangles, np.int32), 0)
    scene.build(fcpw.aggregate_type.bvh_surface_area, True, False, True)
    return scene


def arrays(probes):
    """Returns columns of three numbers as FCPW takes them, a limit for each row, and room for the answers."""
    columns = [np.asfortranarray(probes[:, k : k + 3]) for k in range(0, probes.shape[1], 3)]
    return *columns, np.full(len(probes), FARTHEST, np.float32), fcpw.interaction_3D_list()


def first_hits(a, probes):
    a.intersect(*probes, False)
    return probes[-1]


def closest(a, probes):
    a.find_closest_points(*probes)
    return probes[-1]


def distances(found):
    return [interaction.d for interaction in found]


def parameters(found):
    return [interaction.d if interaction.primitive_index >= 0 else -1.0 for interaction in found]


def lists(points):
    return fcpw.float_3D_list(list(points)), fcpw.uint32_list()


def sides(a, points):
    a.contains(*points)
    return points[1]


serve(
    "FCPW", version("fcpw"), "bvh_surface_area, vectorized", mesh, {},
    batches={
        "ray": (arrays, first_hits, parameters),
        "closest": (arrays, closest, distances),
        "side": (lists, sides, lambda inside: [1.0 if x else -1.0 for x in inside]),
    },
    threads=cores(),
    coordinates="f32", placement="f32", features=[], distance_error=1e-5, error_unit="size",
)  # fmt: skip
