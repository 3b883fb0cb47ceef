"""Forces of cbvh's contacts in MuJoCo. Not an example itself: mujoco_nut.py and mujoco_hook.py share it.

MuJoCo takes no contacts from outside. Its callback `mjcb_passive` may add to `qfrc_passive`, though, as the springs and dampers of a
model do. MuJoCo calls it in each step, after it has placed all bodies and before it integrates. Forces that are computed before
`mj_step` are those of the last step's poses; and `mjcb_control`, which is called at the same time, is for the user's controller.
"""

import time

import mujoco
import numpy as np


class Contact:
    """A mesh that stands still pushes one that moves. Subclasses say how."""

    def __init__(self, model, still, moving, body):
        self.still, self.moving, self.body = still, moving, model.body(body).id
        self.calls, self.seconds = 0, 0.0

    def __call__(self, model, data):
        began = time.perf_counter()
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = data.xmat[self.body].reshape(3, 3), data.xpos[self.body]
        center, velocity = data.xipos[self.body], np.zeros(6)
        mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_BODY, self.body, velocity, 0)
        force, torque = self.push(pose, center, velocity[3:], velocity[:3])
        mujoco.mj_applyFT(model, data, force, torque, center, self.body, data.qfrc_passive)
        self.calls, self.seconds = self.calls + 1, self.seconds + time.perf_counter() - began


class PointContact(Contact):
    """Each contact point of a patch is a spring and a damper along its normal.

    A point's share of the patch's area (m^2) times its depth (m) times `stiffness` (N/m^3) is its force, so a patch begins with none.
    `damping` (N s/m^3) takes the place of depth for the speed along the normal, as far as the point does not pull.
    """

    def __init__(self, model, still, moving, body, stiffness, damping):
        super().__init__(model, still, moving, body)
        self.stiffness, self.damping, self.deepest, self.most_points = stiffness, damping, 0.0, 0

    def push(self, pose, center, velocity, turning):
        patches = self.still.patches(self.moving, pose, max_points=4)
        if len(patches.points) == 0:
            return np.zeros(3), np.zeros(3)
        self.deepest = max(self.deepest, patches.point_depths.max())
        self.most_points = max(self.most_points, len(patches.points))
        of_patch = np.repeat(np.arange(len(patches.depth)), patches.point_count)
        share = (areas(patches) / np.maximum(patches.point_count, 1))[of_patch]
        arms, depths = patches.points - center, patches.point_depths
        speeds = ((velocity + np.cross(turning, arms)) * patches.point_normals).sum(axis=1)
        sizes = share * np.maximum(self.stiffness * depths - self.damping * speeds * (depths > 0), 0)
        forces = sizes[:, None] * patches.point_normals
        return forces.sum(axis=0), np.cross(arms, forces).sum(axis=0)


class VolumeContact(Contact):
    """A constant pressure (Pa) in all of the overlap, so that its energy is pressure times volume.

    Force and torque are the gradient of the volume, which the curves in which the surfaces meet give exactly, whatever their number:
    by Stokes' theorem, half the sum of p x q over their directed segments is the integral of the normal, and minus half the
    integral of |r|^2 dr that of r x normal. `damping` (s/m^3) raises the pressure as the volume grows.
    """

    def __init__(self, model, still, moving, body, pressure, damping):
        super().__init__(model, still, moving, body)
        self.pressure, self.damping, self.most_contacts = pressure, damping, 0

    def push(self, pose, center, velocity, turning):
        regions = self.still.contact_regions(self.moving, pose)
        self.most_contacts = max(self.most_contacts, len(regions.error))
        p, q = np.moveaxis(regions.points[regions.point_count == 2, :2] - center, 1, 0)
        area = np.cross(p, q).sum(axis=0) / 2
        squares = ((p * p).sum(axis=1) + (p * q).sum(axis=1) + (q * q).sum(axis=1)) / 3
        moment = -(squares[:, None] * (q - p)).sum(axis=0) / 2
        growth = -(area @ velocity + moment @ turning)
        pressure = self.pressure * max(0.0, 1 + self.damping * growth)
        return pressure * area, pressure * moment


def areas(patches):
    """The area of each patch, seen along its normal: that of what its directed curves bound, and of polygons."""
    regions = patches.regions
    of_patch = np.repeat(np.arange(len(patches.depth)), patches.contact_count)
    p, q = (regions.points[:, k] - patches.center[of_patch] for k in (0, 1))
    is_curve = regions.point_count == 2
    vectors = np.zeros((len(patches.depth), 3))
    np.add.at(vectors, of_patch[is_curve], np.cross(p[is_curve], q[is_curve]) / 2)
    return np.abs((vectors * patches.normal).sum(axis=1)) + patches.area


def model_of(still, moving, options, at, inertial, damping, turning_damping):
    """A model with a body that moves freely in a little oil. MuJoCo has the meshes as well, and their hulls collide if told to."""
    numbers = lambda array: " ".join(map(str, np.asarray(array).ravel()))
    mesh = lambda name, of: f'<mesh name="{name}" inertia="shell" vertex="{numbers(of[0])}" face="{numbers(of[1])}"/>'
    slides = "".join(f'<joint type="slide" axis="{axis}" damping="{damping}"/>' for axis in ("1 0 0", "0 1 0", "0 0 1"))
    return f"""<mujoco>{options}<asset>{mesh("still", still)}{mesh("moving", moving)}</asset><worldbody>
        <geom type="mesh" mesh="still"/><body name="moving" {at}>{inertial}
        {slides}<joint type="ball" damping="{turning_damping}"/><geom type="mesh" mesh="moving"/></body></worldbody></mujoco>"""


def simulate(xml, contact, seconds, each=lambda data: None):
    """Runs a model with contacts of its own, `contact(model)`, or with MuJoCo's if there are none. Returns what is left of it, the
    contact and the milliseconds for each step."""
    model = mujoco.MjModel.from_xml_string(xml)
    data, made = mujoco.MjData(model), contact and contact(model)
    if made:
        model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
    mujoco.set_mjcb_passive(made)
    steps, began = round(seconds / model.opt.timestep), time.perf_counter()
    for _ in range(steps):
        mujoco.mj_step(model, data)
        each(data)
    mujoco.set_mjcb_passive(None)
    return data, made, 1e3 * (time.perf_counter() - began) / steps
