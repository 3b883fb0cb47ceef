"""Makes poses: from positions and quaternions, and of one body in the frame of another."""

from __future__ import annotations

from numpy.typing import ArrayLike

from . import _cbvh
from ._answers import Floats


def pose(position: ArrayLike, quaternion: ArrayLike = (0.0, 0.0, 0.0, 1.0)) -> Floats:
    """Poses (body to world) from positions of the body's origin and rotations as quaternions: shape (4, 4) or (N, 4,
    4).

    ``position`` has shape (3,) or (N, 3), in mesh units; ``quaternion`` has shape (4,) or (N, 4), the real part last,
    as in SciPy, ROS and OMPL (python-fcl, trimesh and Eigen's constructor have it first), and length 1 to within 2^-21. One of either serves N of the other.
    """
    return _cbvh.poses_of(position, quaternion)


def nearest_pose(matrix: ArrayLike) -> Floats:
    """The nearest poses to matrices that are not quite rigid, as of rounded numbers or of products of many: shape (4, 4) or
    (N, 4, 4).

    ``matrix`` (body to world) has shape (4, 4) or (N, 4, 4). The rotation is the one that is nearest in the sum of squares of
    entries, the polar factor; the translation, in mesh units, stays. It is rigid to within 2^-40, as everything in this
    module takes it. Raises ValueError, which says what is wrong, for a reflection, a scale, a last row other than 0 0 0 1,
    numbers that are not finite, and a matrix R that is no rounded rotation: an entry of R R^T - I above 2^-6.
    """
    return _cbvh.nearest_poses(matrix)


def relative(a: ArrayLike, b: ArrayLike) -> Floats:
    """Poses of B in A's frame, as questions about two meshes take them, from the poses of both in the world: shape (4,
    4) or (N, 4, 4).

    ``a`` and ``b`` (body to world) have shape (4, 4) or (N, 4, 4); one of either serves N of the other. It is what
    scenes do, to the bit.
    """
    return _cbvh.relative_poses(a, b)
