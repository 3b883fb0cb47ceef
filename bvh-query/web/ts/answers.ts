/** The types of answers. The answer to a question about N poses, points or rays has N elements or rows in each array. */

/** The relation of two meshes. `Relation[number]` is its name. */
export enum Relation {
    /** Their surfaces have a point in common. */
    TOUCHING = 0,
    /** They have nothing in common, insides included. */
    APART = 1,
    /** All of the first mesh is inside the second. */
    A_IN_B = 2,
    /** All of the second mesh is inside the first. */
    B_IN_A = 3,
    /** Some parts of a mesh are inside the other and some are not, or some of each mesh are. */
    MIXED = 4,
    /** The answer depends on the inside of a mesh that is not closed. */
    UNDEFINED = 5,
}

/** On which side of a mesh a point is. `Side[number]` is its name. */
export enum Side {
    /** Neither on the surface nor inside. */
    OUTSIDE = -1,
    /** On the surface. */
    ON = 0,
    /** Inside. */
    INSIDE = 1,
    /** Not on the surface, of a mesh that has no inside, because it is not closed. */
    UNDEFINED = 2,
}

/** Whether a path is free. `MotionKind[number]` is its name. */
export enum MotionKind {
    /** At no time are the meshes within the clearance. */
    FREE = 0,
    /** At the time `at`, they are within the clearance. */
    HIT = 1,
    /** At some time they are at most the clearance plus the tolerance apart, but within the clearance in no pose tested. */
    NEAR = 2,
}

/** The least distance of two meshes. */
export interface Distance {
    /** The distance in mesh units; 0 if they touch. */
    distance: number;
    /** A certified lower bound of the least distance. */
    lower: number;
    /** A certified upper bound of the least distance. */
    upper: number;
    /** The closest point of the first mesh, in its frame. */
    pointA: Float64Array;
    /** The closest point of the second mesh, in the frame of the first. */
    pointB: Float64Array;
    /** The number of the first mesh's object in its file. */
    objectA: number;
    /** The number of the triangle in the input or, in a file without ids, in the order of the baker. */
    triangleA: number;
    /** The number of the second mesh's object. */
    objectB: number;
    /** The number of the triangle in the second mesh. */
    triangleB: number;
}

/** N answers of the type `Distance`: numbers of length N, and points of length 3 N. */
export interface Distances {
    distance: Float64Array;
    lower: Float64Array;
    upper: Float64Array;
    pointA: Float64Array;
    pointB: Float64Array;
    objectA: Uint32Array;
    triangleA: Uint32Array;
    objectB: Uint32Array;
    triangleB: Uint32Array;
}

/** Whether a path is free, and where it ends if it is not. */
export interface MotionAnswer {
    kind: MotionKind;
    /** Before this time, from 0 to 1, the meshes certainly are not within the clearance. 1 if the path is free. */
    freeUntil: number;
    /** For HIT, the earliest time found at which they are within the clearance; for NEAR, that of the first undecided
     * pose; else NaN. */
    at: number;
    /** The distance of the meshes at that time; `undefined` if the path is free. */
    nearest: Distance | undefined;
}

/** N answers of the type `MotionAnswer`. Where a path is free, the numbers of `nearest` are NaN and 0. */
export interface MotionAnswers {
    /** Numbers of `MotionKind`. */
    kind: Uint8Array;
    freeUntil: Float64Array;
    at: Float64Array;
    nearest: Distances;
}

/** The points of a mesh that are closest to N points. */
export interface ClosestPoints {
    /** 1 where there is such a point within the given distance; else 0, and the numbers are NaN and 0. */
    found: Uint8Array;
    /** Distances in mesh units. */
    distance: Float64Array;
    /** Certified lower bounds of the least distances. */
    lower: Float64Array;
    /** Certified upper bounds of the least distances. */
    upper: Float64Array;
    /** The closest points, in the frame of the question: length 3 N. */
    point: Float64Array;
    /** Numbers of objects in the file. */
    object: Uint32Array;
    /** Numbers of triangles in the input or, in a file without ids, in the order of the baker. */
    triangle: Uint32Array;
}

/** Where N rays hit a mesh. */
export interface RayHits {
    /** 1 where the ray hits; else 0, and the numbers are NaN and 0. */
    found: Uint8Array;
    /** Parameters: a hit is at origin + t * direction. */
    t: Float64Array;
    /** Certified lower bounds of the parameters. */
    lower: Float64Array;
    /** Certified upper bounds of the parameters. */
    upper: Float64Array;
    /** The hits, in the frame of the question: length 3 N. */
    point: Float64Array;
    /** Numbers of objects in the file. */
    object: Uint32Array;
    /** Numbers of triangles in the input or, in a file without ids, in the order of the baker. */
    triangle: Uint32Array;
}

/** The points of all instances that are closest to N points. */
export interface SceneClosestPoints {
    /** Numbers of instances, -1 where nothing is found. */
    instance: Int32Array;
    /** The answers of `Mesh.closestPoints`, in the world. */
    closest: ClosestPoints;
}

/** Where N rays hit instances. */
export interface SceneRayHits {
    /** Numbers of instances, -1 where nothing is hit. */
    instance: Int32Array;
    /** The answers of `Mesh.firstHits`, in the world. */
    hit: RayHits;
}

/** Pairs of instances, and their relations. */
export interface SceneRelations {
    /** Numbers of instances, A and B of each pair: length 2 K. */
    pairs: Uint32Array;
    /** Numbers of `Relation`. */
    relations: Uint8Array;
}

/** Pairs of triangles in contact. */
export interface SceneContacts {
    /** Numbers of instances, A and B of each pair of triangles: length 2 K. */
    pairs: Uint32Array;
    /** Object and triangle of A, object and triangle of B: length 4 K. */
    triangles: Uint32Array;
}

/** A pair of instances, and how far apart they are. */
export interface SceneDistance {
    /** The number of the instance in whose frame the points are given. */
    a: number;
    /** The number of the other instance. */
    b: number;
    /** The answer of `Mesh.distance`. */
    nearest: Distance;
}

/** Whether the paths of instances are free. */
export interface SceneMotionAnswer {
    kind: MotionKind;
    /** Before this time, from 0 to 1, certainly no pair is within the clearance. 1 if the paths are free. */
    freeUntil: number;
    /** For HIT, the earliest time found at which a pair is within the clearance; for NEAR, that of the first undecided
     * poses; else NaN. */
    at: number;
    /** That pair, and its distance at that time; `undefined` if the paths are free. A is the instance that stands still or,
     * if both move, the first in the scene. */
    pair: SceneDistance | undefined;
}

/** Names the parts of an answer, which are in the order of the type's fields. */
export const distances = (parts: unknown[]): Distances => {
    const [distance, lower, upper, pointA, pointB, objectA, triangleA, objectB, triangleB] = parts;
    return { distance, lower, upper, pointA, pointB, objectA, triangleA, objectB, triangleB } as Distances;
};

export const motions = ([kind, freeUntil, at, nearest]: unknown[]): MotionAnswers =>
    ({ kind, freeUntil, at, nearest: distances(nearest as unknown[]) }) as MotionAnswers;

export const closest = ([found, distance, lower, upper, point, object, triangle]: unknown[]): ClosestPoints =>
    ({ found, distance, lower, upper, point, object, triangle }) as ClosestPoints;

export const hits = ([found, t, lower, upper, point, object, triangle]: unknown[]): RayHits =>
    ({ found, t, lower, upper, point, object, triangle }) as RayHits;

export const sceneHits = ([instance, of]: unknown[]): SceneRayHits =>
    ({ instance, hit: hits(of as unknown[]) }) as SceneRayHits;

/** Takes the only element of an answer with one distance. */
export function onlyDistance(of: Distances): Distance {
    const { pointA, pointB, ...rest } = of;
    const numbers = Object.entries(rest).map(([name, values]) => [name, values[0]]);
    return { ...(Object.fromEntries(numbers) as Omit<Distance, "pointA" | "pointB">), pointA, pointB };
}
