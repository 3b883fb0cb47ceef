/** The types of answers. The answer to a query about N poses, points or rays has N elements or rows in each array. */

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

/** What two triangles have in common. `RegionKind[number]` is its name. */
export enum RegionKind {
    /** They touch in one point. */
    POINT = 0,
    /** They meet in a segment: they cross, or an edge touches. */
    SEGMENT = 1,
    /** They overlap in one plane, in a convex polygon. */
    POLYGON = 2,
}

/** How two triangles of one mesh meet, by the corners that they have in common. `SelfContactKind[number]` is its name. */
export enum SelfContactKind {
    /** They have no corner in common, and touch or cross. */
    CROSSING = 0,
    /** They have one corner in common, and another point. */
    AT_CORNER = 1,
    /** They have two corners in common, lie in one plane, and overlap beyond that edge. */
    FOLDED = 2,
    /** They have the same corners, in any order. */
    DUPLICATE = 3,
}

/** How far the other mesh moves along a direction until interiors are disjoint, in mesh units. */
export interface Separation {
    /** Interiors meet at all shorter moves along the direction. */
    lower: number;
    /** The length of `translation`. */
    upper: number;
    /** A move of the other mesh along the direction, after which interiors are disjoint. */
    translation: Float64Array;
}

/** N answers of the type `Separation`: numbers of length N, and translations of length 3 N. */
export interface Separations {
    lower: Float64Array;
    upper: Float64Array;
    translation: Float64Array;
}

/** How deep two meshes overlap, in mesh units. */
export interface Penetration {
    /** No shorter translation makes interiors disjoint. */
    lower: number;
    /** The length of `translation`. */
    upper: number;
    /** A translation of the other mesh, after which interiors are disjoint. */
    translation: Float64Array;
    /** A point in both meshes, in the frame of the first, where `lower` is above 0. */
    point: Float64Array;
    /** The radii of two balls about the point, one inside each mesh, which prove `lower`: it is their sum, but for roundings. Both are
     * 0 where the meshes or parts of them are known to be convex, which proves more. */
    radii: Float64Array;
    /** Whether the search made all the visits that it may make. Only `clash` limits them. */
    isSpent: boolean;
}

/** N answers of the type `Penetration`: numbers of length N, translations and points of length 3 N, radii of length 2 N, and 1
 * or 0 for `isSpent`. */
export interface Penetrations {
    lower: Float64Array;
    upper: Float64Array;
    translation: Float64Array;
    point: Float64Array;
    radii: Float64Array;
    isSpent: Uint8Array;
}

/** How far apart two meshes are or, below zero, how deep they overlap, in mesh units. */
export interface SignedDistance {
    /** The signed distance is at least this. */
    lower: number;
    /** The signed distance is at most this. */
    upper: number;
    /** The direction in which the other mesh moves away from the first, at length 1, in the frame of the first: from the closest point
     * on the first to that on the other or, where they overlap, along `translation`. 0 where none is known, as for meshes that
     * touch and have no depth. */
    normal: Float64Array;
    /** The closest point on the first mesh, in its frame, or, where they overlap, the one that the other touches after the
     * translation. */
    pointA: Float64Array;
    /** The closest point on the other mesh, in the frame of the first, or, where they overlap, the one that touches `pointA` after the
     * translation. */
    pointB: Float64Array;
    /** Where they overlap, a translation of the other mesh, in the frame of the first, after which interiors are disjoint. Its length
     * is -`lower`, but for roundings. Else 0. */
    translation: Float64Array;
    /** Whether both meshes have an inside: they are closed, and have a radius or triangles with area. If not, they have no depth, and
     * the number is their distance, 0 where they touch. */
    isSigned: boolean;
    /** Whether the search for a depth made all the visits that it may make. Only `clash` limits them. */
    isSpent: boolean;
}

/** N answers of the type `SignedDistance`: numbers of length N, normals, points and translations of length 3 N, and 1 or 0 for
 * `isSigned` and `isSpent`. */
export interface SignedDistances {
    lower: Float64Array;
    upper: Float64Array;
    normal: Float64Array;
    pointA: Float64Array;
    pointB: Float64Array;
    translation: Float64Array;
    isSigned: Uint8Array;
    isSpent: Uint8Array;
}

/** How two parts of an assembly lie. `ClashClass[number]` is its name. */
export enum ClashClass {
    /** Their surfaces are farther apart than the clearance and the tolerance, and neither is inside the other. */
    APART = 0,
    /** Their surfaces are farther apart than the tolerance, but at most the clearance. */
    NEAR = 1,
    /** Their surfaces are at most the tolerance apart, or they have points in common and their depth is at most the tolerance. */
    TOUCHING = 2,
    /** Their depth exceeds the tolerance. */
    OVERLAPPING = 3,
    /** One is wholly inside the other. */
    CONTAINED = 4,
    /** Both are the same part in the same place, to within the tolerance. */
    DUPLICATED = 5,
    /** They have points in common, and the tolerance lies between the bounds that were found for their depth. */
    UNDECIDED = 6,
    /** They have points in common, and one is not closed, so that they have no depth. */
    INTERSECTING = 7,
    /** Their depth exceeds the tolerance, and one passes through the other. If magnitudes are computed, parts that overlap are this
     * or `PROTRUDING`. */
    PIERCING = 8,
    /** Their depth exceeds the tolerance, and neither passes through the other. */
    PROTRUDING = 9,
}

/** What two meshes have in common, in mesh units. Only the error of the volume is certified; all other numbers are rounded. */
export interface Intersection {
    /** The volume of the intersection. */
    volume: number;
    /** The volume is off by at most this. */
    volumeError: number;
    /** The area of the first mesh's surface inside the other. */
    areaA: number;
    /** The area of the other mesh's surface inside the first. */
    areaB: number;
    /** The least coordinates of the intersection and then the largest, in the frame of the first mesh: length 6; `undefined` if it is
     * empty. */
    bounds: Float64Array | undefined;
    /** How thick the first mesh is where the other passes through it; `undefined` if it does so nowhere. */
    piercedA: number | undefined;
    /** How thick the other mesh is where the first passes through it. */
    piercedB: number | undefined;
}

/** N answers of the type `Intersection`: numbers of length N, and boxes of length 6 N. What there is not is NaN. */
export interface Intersections {
    volume: Float64Array;
    volumeError: Float64Array;
    areaA: Float64Array;
    areaB: Float64Array;
    bounds: Float64Array;
    piercedA: Float64Array;
    piercedB: Float64Array;
}

/** The boundary of what two meshes have in common: P polygons, each of which lies in one triangle. */
export interface IntersectionSurface {
    /** The corners of all polygons, loop by loop, in the frame of the first mesh: three numbers for each. */
    points: Float64Array;
    /** The number of corners of each loop. Seen from outside, an outline goes around counterclockwise and holes clockwise, unless the
     * mesh is turned inside out. */
    loops: Uint32Array;
    /** The number of loops of each polygon, its outline and then its holes: length P. */
    polygons: Uint32Array;
}

/** How two parts of an assembly lie, and by how much. Lengths are in mesh units. */
export interface Clash {
    /** How they lie. */
    kind: ClashClass;
    /** Whether they touch and, if not, whether one is inside the other. */
    relation: Relation;
    /** For near parts, and for touching ones without a common point: how far apart their surfaces are. Infinite for parts that are
     * apart, and 0 for all others. */
    distance: number;
    /** A point of the clash in the frame of the first mesh: between the closest points, in both parts, or in contact. 0 for parts
     * that are apart. */
    point: Float64Array;
    /** For parts that touch, overlap or are undecided: the bounds of their depth, both 0 without a common point. Parts that are not
     * closed have none. */
    depth: Penetration | undefined;
    /** For closed parts that overlap, are undecided, contain each other or are duplicated, if magnitudes were computed: what they have
     * in common. */
    magnitudes: Intersection | undefined;
}

/** N answers of the type `Clash`. Where there is no depth, the numbers of `depth` are NaN and 0, and where nothing is measured, those of
 * `magnitudes` are NaN. */
export interface Clashes {
    /** Numbers of `ClashClass`. */
    kind: Uint8Array;
    /** Numbers of `Relation`. */
    relation: Uint8Array;
    distance: Float64Array;
    /** Length 3 N. */
    point: Float64Array;
    depth: Penetrations;
    /** `undefined` unless they were computed. */
    magnitudes: Intersections | undefined;
}

/** Where K pairs of triangles in contact meet, in the frame of the first mesh and in mesh units. */
export interface ContactRegions {
    /** Object and triangle of the first mesh, object and triangle of the second: length 4 K. */
    triangles: Uint32Array;
    /** Numbers of `RegionKind`, decided exactly. */
    kind: Uint8Array;
    /** The number of points of each region, from 1 to 6. */
    count: Uint8Array;
    /**
     * One point, the two ends of a segment, or the corners of a polygon. Those of region `k` begin at `18 * k`, and numbers
     * after the last point are 0: length 18 K. Where two planes cross, the ends follow the cross product of `normalA` and
     * `normalB`, so that the segments of closed meshes form directed loops. Corners go counterclockwise around a polygon, seen
     * from where `normalA` points to.
     */
    points: Float64Array;
    /** Unit normals of the first mesh's triangles, 0 without area; between two meshes with a radius whose triangles are apart,
     * the direction from one to the other: length 3 K. */
    normalA: Float64Array;
    /** The same of the second mesh. */
    normalB: Float64Array;
    /** Certified bounds: each point is at most this far from the exact one. */
    error: Float64Array;
    /** The sums of the radii less the distances of the triangles; 0 for meshes without radii. */
    overlap: Float64Array;
    /** The number of all contacts, which is larger than K if the query was about the first ones only. */
    total: number;
}

/** P groups of contacts that belong together. Numbers are in mesh units, rounded, and not certified. */
export interface Patches {
    /** The place of the first contact of each patch in `regions`. */
    first: Uint32Array;
    /** The number of contacts of each patch. */
    count: Uint32Array;
    /** The mean of the polygons by area, if triangles face each other in one plane; else of the curves by length; else of the
     * points: length 3 P. */
    center: Float64Array;
    /** The directions in which this mesh pushes the other one, at length 1; 0 if the normals of the contacts cancel: length 3 P. */
    normal: Float64Array;
    /** The lengths of the curves in which the surfaces meet. */
    length: Float64Array;
    /** The areas of what triangles in one plane have in common. */
    area: Float64Array;
    /** Estimates of how far the other mesh has to move along the normal to leave this one there. */
    depth: Float64Array;
    /** The contacts of the first patch, of the second one, and so on. */
    regions: ContactRegions;
    /** The place of the first contact point of each patch in `points`, of which each point has 3 numbers. */
    firstPoint: Uint32Array;
    /** The number of contact points of each patch; 0 without `maxPoints`. */
    pointCount: Uint32Array;
    /** Q contact points, those of the first patch, of the second one, and so on: the middles between both surfaces on lines along
     * the patch's normal, or points of the curve in which they meet: length 3 Q. */
    points: Float64Array;
    /** The directions in which this mesh pushes the other one at each point, at length 1. They are those of the surfaces where the
     * lines meet them, so points of a curved patch have different ones: length 3 Q. */
    pointNormals: Float64Array;
    /** How deep the meshes overlap at each point along its normal, at least 0. For meshes with a radius, it is about their cores:
     * minus the gap between these where they are apart. So a radius serves as the margin of a simulator. If the radii are a
     * part of the bodies, add their sum. */
    pointDepths: Float64Array;
}

/** K pairs of triangles of one mesh that meet where they should not. */
export interface SelfContacts {
    /** Object and triangle of the first one, object and triangle of the second: length 4 K. */
    triangles: Uint32Array;
    /** Numbers of `SelfContactKind`. */
    kind: Uint8Array;
}

/** How many triangles an open edge has: "boundary" one, "flipped" two that face opposite ways, "crowded" more that do not cancel. */
export type OpenEdgeKind = "boundary" | "flipped" | "crowded";

/** An edge that leaves an object open. */
export interface OpenEdge {
    kind: OpenEdgeKind;
    /** The number of the object in the file. */
    object: number;
    /** The ids of its triangles, or their places in a file without ids: the smallest numbers, at most four. */
    triangles: Uint32Array;
    /** Both ends in mesh units, in the direction in which more triangles traverse the edge. */
    from: Float64Array;
    to: Float64Array;
    /** For an edge of one triangle, how near another open edge is; `undefined` if that is not known. */
    gap: number | undefined;
}

/** Why a mesh is not closed. */
export interface OpenEdges {
    /** The number of edges of one triangle: the border of a hole, of a sheet, or of a crack. */
    boundary: number;
    /** The number of edges of two triangles that face opposite ways. */
    flipped: number;
    /** The number of edges of more than two triangles, which do not cancel. */
    crowded: number;
    /** The first eight of each kind. */
    edges: OpenEdge[];
    /** The least gap. The gap of an edge of one triangle is the distance within which a bake with `weld` may make it one with another
     * open edge, in mesh units. */
    nearestGap: number | undefined;
    /** The number of edges of one triangle whose gap is less than a hundredth of their length. */
    cracks: number;
    /** The greatest gap of a crack. */
    widestCrack: number | undefined;
    /** A distance for `weld` that should close all cracks. */
    proposedWeld: number | undefined;
    /** A sentence about them, with the remedy. */
    text: string;
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
    /** The closest points, in the frame of the query: length 3 N. */
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
    /** The hits, in the frame of the query: length 3 N. */
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

/** Pairs of instances that clash, and how. */
export interface SceneClashes {
    /** Numbers of instances, A and B of each pair: length 2 K. */
    pairs: Uint32Array;
    /** The answers of `Mesh.clash`, in A's frame. Boxes of magnitudes alone are in the world and along its axes. */
    clash: Clashes;
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

/** The pair of instances with the least signed distance. */
export interface SceneSignedDistance {
    /** The number of the instance in whose frame points, normal and translation are given. */
    a: number;
    /** The number of the other instance. */
    b: number;
    /** The answer of `Mesh.signedDistance`. */
    nearest: SignedDistance;
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

export const separations = ([lower, upper, translation]: unknown[]): Separations =>
    ({ lower, upper, translation }) as Separations;

export const penetrations = ([lower, upper, translation, point, radii, isSpent]: unknown[]): Penetrations =>
    ({ lower, upper, translation, point, radii, isSpent }) as Penetrations;

export const signedDistances = (parts: unknown[]): SignedDistances => {
    const [lower, upper, normal, pointA, pointB, translation, isSigned, isSpent] = parts;
    return { lower, upper, normal, pointA, pointB, translation, isSigned, isSpent } as SignedDistances;
};

export const intersections = (parts: unknown[]): Intersections => {
    const [volume, volumeError, areaA, areaB, bounds, piercedA, piercedB] = parts;
    return { volume, volumeError, areaA, areaB, bounds, piercedA, piercedB } as Intersections;
};

export const intersectionSurface = ([points, loops, polygons]: unknown[]): IntersectionSurface =>
    ({ points, loops, polygons }) as IntersectionSurface;

export const clashes = ([kind, relation, distance, point, depth, shared]: unknown[]): Clashes => {
    const magnitudes = shared === undefined ? undefined : intersections(shared as unknown[]);
    return { kind, relation, distance, point, depth: penetrations(depth as unknown[]), magnitudes } as Clashes;
};

export function regions(parts: unknown[], total: unknown): ContactRegions {
    const [triangles, kind, count, points, normalA, normalB, error, overlap] = parts;
    return { triangles, kind, count, points, normalA, normalB, error, overlap, total } as ContactRegions;
}

export function patches(parts: unknown[]): Patches {
    const [first, count, center, normal, length, area, depth, contacts, total, ...ofPoints] = parts;
    const [firstPoint, pointCount, points, pointNormals, pointDepths] = ofPoints;
    const ofContacts = regions(contacts as unknown[], total);
    const ofPatches = { first, count, center, normal, length, area, depth, regions: ofContacts };
    return { ...ofPatches, firstPoint, pointCount, points, pointNormals, pointDepths } as Patches;
}

export const selfContacts = ([triangles, kind]: unknown[]): SelfContacts => ({ triangles, kind }) as SelfContacts;

/** A number, or `undefined` for one that stands for none. */
const known = (value: number | undefined) => (Number.isNaN(value) ? undefined : value);

const OPEN_EDGE_KINDS: OpenEdgeKind[] = ["boundary", "flipped", "crowded"];

export function openEdges(of: unknown[]): OpenEdges {
    const [counts, numbers, triangles, places, text] = of as [Float64Array, Uint32Array, Uint32Array, Float64Array, string];
    const edges: OpenEdge[] = [];
    let first = 0;
    for (let number = 0; 3 * number < numbers.length; number++) {
        const [kind, object, count] = numbers.subarray(3 * number) as unknown as [number, number, number];
        const place = places.subarray(7 * number);
        edges.push({
            kind: OPEN_EDGE_KINDS[kind] as OpenEdgeKind,
            object,
            triangles: triangles.slice(first, first + count),
            from: place.slice(0, 3),
            to: place.slice(3, 6),
            gap: known(place[6]),
        });
        first += count;
    }
    const [boundary, flipped, crowded, cracks, nearest, widest, weld] = counts as unknown as number[];
    return {
        boundary: boundary as number,
        flipped: flipped as number,
        crowded: crowded as number,
        edges,
        nearestGap: known(nearest),
        cracks: cracks as number,
        widestCrack: known(widest),
        proposedWeld: known(weld),
        text,
    };
}

export const motions = ([kind, freeUntil, at, nearest]: unknown[]): MotionAnswers =>
    ({ kind, freeUntil, at, nearest: distances(nearest as unknown[]) }) as MotionAnswers;

export const closest = ([found, distance, lower, upper, point, object, triangle]: unknown[]): ClosestPoints =>
    ({ found, distance, lower, upper, point, object, triangle }) as ClosestPoints;

export const hits = ([found, t, lower, upper, point, object, triangle]: unknown[]): RayHits =>
    ({ found, t, lower, upper, point, object, triangle }) as RayHits;

export const sceneHits = ([instance, of]: unknown[]): SceneRayHits =>
    ({ instance, hit: hits(of as unknown[]) }) as SceneRayHits;

/** Takes the only element of the bounds of an answer. */
export const onlyBounds = <T extends { lower: Float64Array; upper: Float64Array }>(of: T) => ({
    ...of,
    lower: of.lower[0] as number,
    upper: of.upper[0] as number,
});

/** Takes the only element of an answer with one depth. */
export const onlyPenetration = (of: Penetrations): Penetration => ({ ...onlyBounds(of), isSpent: of.isSpent[0] === 1 });

/** Takes the only element of an answer with one signed distance. */
export const onlySignedDistance = (of: SignedDistances): SignedDistance => ({
    ...onlyBounds(of),
    isSigned: of.isSigned[0] === 1,
    isSpent: of.isSpent[0] === 1,
});

/** Takes the only element of an answer with one intersection. */
export function onlyIntersection({ bounds, piercedA, piercedB, ...of }: Intersections): Intersection {
    return {
        volume: of.volume[0] as number,
        volumeError: of.volumeError[0] as number,
        areaA: of.areaA[0] as number,
        areaB: of.areaB[0] as number,
        bounds: Number.isNaN(bounds[0]) ? undefined : bounds,
        piercedA: known(piercedA[0]),
        piercedB: known(piercedB[0]),
    };
}

/** Takes the only element of an answer with one clash. */
export function onlyClash({ kind, relation, distance, point, depth, magnitudes }: Clashes): Clash {
    const only = onlyPenetration(depth);
    const shared = magnitudes && onlyIntersection(magnitudes);
    return {
        kind: kind[0] as ClashClass,
        relation: relation[0] as Relation,
        distance: distance[0] as number,
        point,
        depth: Number.isNaN(only.lower) ? undefined : only,
        magnitudes: Number.isNaN(shared?.volume) ? undefined : shared,
    };
}

/** Takes the only element of an answer with one distance. */
export function onlyDistance(of: Distances): Distance {
    const { pointA, pointB, ...rest } = of;
    const numbers = Object.entries(rest).map(([name, values]) => [name, values[0]]);
    return { ...(Object.fromEntries(numbers) as Omit<Distance, "pointA" | "pointB">), pointA, pointB };
}
