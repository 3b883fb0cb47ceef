"""Makes poses: from positions and quaternions, and of one body in the frame of another."""

from __future__ import annotations

from numpy.typing import ArrayLike

from . import _cbvh
from ._answers import Floats


def pose(position: ArrayLike, quaternion: ArrayLike = (0.0, 0.0, 0.0, 1.0)) -> Floats:
    """Poses (body to world) from positions of the body's origin and rotations as quaternions: shape (4, 4) or (N, 4,
    4).

    ``position`` has shape (3,) or (N, 3), in mesh units. ``quaternion`` has shape (4,) or (N, 4), and length 1 to
    within 2^-21. The real part is last, as in SciPy, ROS and OMPL (python-fcl, trimesh and Eigen's constructor have it
    first). One of either serves N of the other.
    """
    return _cbvh.poses_of(position, quaternion)


def nearest_pose(matrix: ArrayLike) -> Floats:
    """The nearest poses to matrices that are not quite rigid, such as rounded ones or products of many: shape (4, 4) or
    (N, 4, 4).

    ``matrix`` (body to world) has shape (4, 4) or (N, 4, 4). The rotation of the result is the nearest one in the sum
    of squares of entries, which is the polar factor. The translation, in mesh units, stays. The result is rigid to
    within 2^-40, which is enough for everything in this module. Raises ValueError for a reflection, a scale, a last row
    other than 0 0 0 1, numbers that are not finite, and a matrix R that is not a rounded rotation: an entry of R R^T -
    I exceeds 2^-6.
    """
    return _cbvh.nearest_poses(matrix)


def relative(a: ArrayLike, b: ArrayLike) -> Floats:
    """Poses of B in A's frame from the poses of both in the world: shape (4, 4) or (N, 4, 4). Queries about two
    meshes take such poses.

    ``a`` and ``b`` (body to world) have shape (4, 4) or (N, 4, 4); one of either serves N of the other. The result is
    that of scenes, to the bit.
    """
    return _cbvh.relative_poses(a, b)
