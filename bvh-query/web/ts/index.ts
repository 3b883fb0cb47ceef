/**
 * Exact collision and distance queries between triangle meshes.
 *
 * @module
 */

export type {
    Clash,
    Clashes,
    ClosestPoints,
    ContactRegions,
    Distance,
    Distances,
    Intersection,
    IntersectionSurface,
    Intersections,
    MotionAnswer,
    MotionAnswers,
    OpenEdge,
    OpenEdgeKind,
    OpenEdges,
    Patches,
    Penetration,
    Penetrations,
    RayHits,
    SceneClashes,
    SceneClosestPoints,
    SceneContacts,
    SceneDistance,
    SceneMotionAnswer,
    SceneRayHits,
    SceneRelations,
    SceneSignedDistance,
    SelfContacts,
    Separation,
    Separations,
    SignedDistance,
    SignedDistances,
} from "./answers.js";
export { ClashClass, MotionKind, RegionKind, Relation, SelfContactKind, Side } from "./answers.js";
export type { Bytes, Integers, Numbers } from "./arguments.js";
export type {
    BakeOptions,
    ClashOptions,
    DistanceOptions,
    MotionOptions,
    PatchOptions,
    PenetrationOptions,
    RayOptions,
} from "./mesh.js";
export { Mesh } from "./mesh.js";
export type { ModuleSource } from "./module.js";
export { init, initSync, memoryBytes, setTimeLimit } from "./module.js";
export { Motion } from "./motion.js";
export { IDENTITY, nearestPose, pose, relative } from "./poses.js";
export type {
    AllLater,
    Later,
    Port,
    Remote,
    RemoteFunctions,
    RemoteMesh,
    RemoteMotion,
    RemoteScene,
} from "./remote.js";
export { CbvhWorker } from "./remote.js";
export type { Instance, InstanceOptions } from "./scene.js";
export { Scene } from "./scene.js";
export { serve } from "./serve.js";
export { box, capsule, cloud, cone, cylinder, ground, heightField, sphere } from "./shapes.js";
