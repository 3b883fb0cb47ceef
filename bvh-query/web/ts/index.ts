/**
 * Exact collision and distance queries between triangle meshes.
 *
 * @module
 */

export type {
    ClosestPoints,
    Distance,
    Distances,
    MotionAnswer,
    MotionAnswers,
    RayHits,
    SceneClosestPoints,
    SceneContacts,
    SceneDistance,
    SceneMotionAnswer,
    SceneRayHits,
    SceneRelations,
} from "./answers.js";
export { MotionKind, Relation, Side } from "./answers.js";
export type { Bytes, Integers, Numbers } from "./arguments.js";
export type { BakeOptions, DistanceOptions, MotionOptions, RayOptions } from "./mesh.js";
export { Mesh } from "./mesh.js";
export type { ModuleSource } from "./module.js";
export { init, initSync, memoryBytes } from "./module.js";
export { Motion } from "./motion.js";
export { IDENTITY, nearestPose, pose, relative } from "./poses.js";
export type { Instance, InstanceOptions } from "./scene.js";
export { Scene } from "./scene.js";
export { box, capsule, cloud, cone, cylinder, ground, heightField, sphere } from "./shapes.js";
