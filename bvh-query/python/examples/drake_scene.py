"""Drake's geometry in a cbvh scene, as the meshes that they are: for contact by points, Drake takes their convex hulls.

    pip install drake
    python examples/drake_scene.py

The arm of testdata stands in Drake's `SceneGraph`, with a bin over its foot. A `QueryObject` has the poses, which are those
of `cbvh.Robot` as well. Drake's `ComputePointPairPenetration` reports whatever is in the bin.
"""

import pathlib
import tempfile

import numpy as np
from pydrake.geometry import Box, Capsule, Cylinder, Mesh, Role, Sphere
from pydrake.math import RigidTransform
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, CoulombFriction
from pydrake.systems.framework import DiagramBuilder

import cbvh
from _cell import at, open_box

URDF = pathlib.Path(__file__).resolve().parents[3] / "testdata" / "robot" / "robot.urdf"


def shape_of(shape, folder):
    """A shape of Drake as a cbvh mesh."""
    if isinstance(shape, Mesh):
        source, scale = pathlib.Path(shape.source().path()), np.asarray(shape.scale3()).ravel()
        baked = cbvh.bake_files(source, folder / f"{source.stem}.cbvh")
        vertices, faces = baked.arrays()
        return cbvh.bake(vertices * scale, faces)
    if isinstance(shape, Sphere):
        return cbvh.sphere(shape.radius())
    if isinstance(shape, Capsule):
        return cbvh.capsule(shape.radius(), shape.length())
    if isinstance(shape, Cylinder):
        return cbvh.cylinder(shape.radius(), shape.length())
    assert isinstance(shape, Box), f"no shape for {shape}"
    return cbvh.box(shape.size())


def write_obj(path, vertices, faces):
    lines = ["v {} {} {}\n".format(*vertex) for vertex in vertices] + ["f {} {} {}\n".format(*face) for face in faces + 1]
    path.write_text("".join(lines))


def main(folder):
    write_obj(folder / "bin.obj", *open_box(0.7, 0.7, 0.7, 0.02))
    builder = DiagramBuilder()
    plant, graph = AddMultibodyPlantSceneGraph(builder, 0.0)
    Parser(plant).AddModels(str(URDF))
    plant.WeldFrames(plant.world_frame(), plant.GetFrameByName("base"))
    friction = CoulombFriction(0.5, 0.5)
    plant.RegisterCollisionGeometry(
        plant.world_body(), RigidTransform(at(0, 0, -0.05)), Mesh(str(folder / "bin.obj")), "bin", friction
    )
    plant.Finalize()
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    inside = plant.GetMyMutableContextFromRoot(context)
    query = lambda: plant.get_geometry_query_input_port().Eval(inside)

    # Each geometry is an instance. Pairs that Drake does not ask about are allowed to touch.
    inspector, scene = query().inspector(), cbvh.Scene()
    ids = sorted(inspector.GetAllGeometryIds(Role.kProximity), key=lambda id: id.get_value())
    number_of = {id: scene.add(shape_of(inspector.GetShape(id), folder)) for id in ids}
    asked = {frozenset((number_of[a], number_of[b])) for a, b in inspector.GetCollisionCandidates()}
    for a in scene:
        for b in scene:
            if a < b and frozenset((a, b)) not in asked:
                scene.set_allowed(a, b)

    robot, rng = cbvh.Robot.from_urdf(URDF), np.random.default_rng(1)
    low, high = robot.limits.T
    hulls = triangles = 0
    for _ in range(500):
        q = rng.uniform(low, high)
        plant.SetPositions(inside, q)
        for link, pose in zip(robot.links, robot.link_poses(q)):
            expected = plant.EvalBodyPoseInWorld(inside, plant.GetBodyByName(link)).GetAsMatrix4()
            assert np.allclose(pose, expected, atol=1e-12)
        for id, number in number_of.items():
            scene.set_pose(number, cbvh.nearest_pose(query().GetPoseInWorld(id).GetAsMatrix4()))
        theirs = {frozenset((number_of[of.id_A], number_of[of.id_B])) for of in query().ComputePointPairPenetration()}
        ours = {frozenset(pair) for pair in scene.pairs_in_contact().tolist()}
        # What touches has hulls that touch, to the tolerance of Drake's hulls.
        assert ours <= theirs
        hulls, triangles = hulls + len(theirs), triangles + len(ours)
    print(f"{len(ids)} geometries, 500 configurations: {hulls} contacts of hulls, of which {triangles} are of the meshes")
    assert 0 < triangles < hulls / 2


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as place:
        main(pathlib.Path(place))
