"""Makes poses: from positions and quaternions, and of one body in the frame of another."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from . import _cbvh
from ._arrays import Floats, broadcast_rows, read_poses, read_rows


def pose(position: ArrayLike, quaternion: ArrayLike = (0.0, 0.0, 0.0, 1.0)) -> Floats:
    """Poses (body to world) from positions of the body's origin and rotations as quaternions: shape (4, 4) or (N, 4,
    4).

    ``position`` has shape (3,) or (N, 3), in mesh units; ``quaternion`` has shape (4,) or (N, 4), the real part last,
    as in SciPy, ROS and OMPL, and length 1 to within 2^-21. One of either serves N of the other.
    """
    positions, one_position = read_rows(position, "position", 3)
    quaternions, one_quaternion = read_rows(quaternion, "quaternion", 4)
    positions, quaternions = broadcast_rows((positions, one_position), (quaternions, one_quaternion))
    poses = _cbvh.poses_of(positions, quaternions)
    return np.asarray(poses[0]) if one_position and one_quaternion else poses


def relative(a: ArrayLike, b: ArrayLike) -> Floats:
    """Poses of B in A's frame, as questions about two meshes take them, from the poses of both in the world: shape (4,
    4) or (N, 4, 4).

    ``a`` and ``b`` (body to world) have shape (4, 4) or (N, 4, 4); one of either serves N of the other. It is what
    scenes do, to the bit.
    """
    poses_a, one_a = read_poses(a, "a")
    poses_b, one_b = read_poses(b, "b")
    poses_a, poses_b = broadcast_rows((poses_a, one_a), (poses_b, one_b))
    poses = _cbvh.relative_poses(poses_a, poses_b)
    return np.asarray(poses[0]) if one_a and one_b else poses
