/** The scene that the worker holds: instances, frames, and which pairs touch. */

import { Scene } from "../../ts/scene.js";
import { file } from "./files.js";

/** An instance of the scene. */
export interface PlacedInstance {
    name: string;
    file: number;
    pose: Float64Array;
    margin: number;
    moving: boolean;
    member: number;
    meets: number;
}

/** What is shown of a frame. */
export interface FrameAnswer {
    /** Numbers of instances: two for each pair that touches. */
    touching: Uint32Array;
    /** The nearest pair: its instances, distance, and closest points in the world. */
    nearest: { a: number; b: number; distance: number; pointA: Float64Array; pointB: Float64Array } | undefined;
    took: number;
}

let scene: Scene | undefined;

function current(): Scene {
    if (scene === undefined) {
        throw new Error("scene: expected one that was made, found none");
    }
    return scene;
}

/** Makes the scene. Groups select the pairs that are asked about. */
export function make(
    instances: PlacedInstance[],
    allowed: [number, number][],
    pairMargins: [number, number, number][],
): void {
    scene?.free();
    scene = new Scene();
    for (const { file: number, pose, margin, member, meets } of instances) {
        scene.setMargin(scene.add(file(number).mesh, pose, { member, meets }), margin);
    }
    for (const [a, b] of allowed) {
        scene.setAllowed(a, b);
    }
    for (const [a, b, margin] of pairMargins) {
        scene.setPairMargin(a, b, margin);
    }
}

/** Moves instances and asks about all pairs. */
export function frame(instances: Uint32Array, poses: Float64Array): FrameAnswer {
    const scene = current();
    const began = performance.now();
    scene.setPoses(instances, poses);
    const touching = scene.pairsInContact();
    const found = scene.distance();
    const took = performance.now() - began;
    const nearest = found && {
        a: found.a,
        b: found.b,
        distance: found.nearest.distance,
        pointA: found.nearest.pointA,
        pointB: found.nearest.pointB,
    };
    return { touching, nearest, took };
}

/** The first instance that a ray in the world hits. */
export function hit(origin: Float64Array, direction: Float64Array) {
    const { instance, hit } = current().firstHits(origin, direction);
    return {
        instance: instance[0] ?? -1,
        t: hit.t[0] ?? 0,
        point: hit.point,
        object: hit.object,
        triangle: hit.triangle,
    };
}
