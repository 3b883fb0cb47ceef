/** Meshes, and all queries about one mesh or a pair. */

import * as answers from "./answers.js";
import type {
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
    OpenEdges,
    Patches,
    Penetration,
    Penetrations,
    RayHits,
    Relation,
    SelfContacts,
    Separation,
    Separations,
    SignedDistance,
    SignedDistances,
} from "./answers.js";
import {
    bytes,
    described,
    flag,
    float,
    floats,
    instance,
    integer,
    integers,
    most,
    text,
    type Bytes,
    type Integers,
    type Numbers,
} from "./arguments.js";
import { call, Handle, raw } from "./module.js";
import { Motion, onePath } from "./motion.js";

/** How a mesh is baked. Values have the names of the command `cbvh bake`. The baker chooses what is left out. */
export interface BakeOptions {
    /** The layout of the tree. */
    profile?: string;
    /** How triangles are stored: "f32", "packed" or "quantized". */
    triangles?: string;
    /** With triangles "quantized", how far a vertex may move, in mesh units. */
    maxError?: number;
    /** How coordinates are rounded: "f32" rounds each to the nearest float32 number, ties to even, so that coordinates which are
     * equal in two meshes stay equal. "none" by default. */
    round?: string;
    /** Moves each vertex to the first vertex within this distance of it, in mesh units, which closes seams that are open by rounding
     * errors. At most the diagonal of the mesh's box. 0 by default, which leaves vertices where they are. */
    weld?: number;
    /** The time spent on a better tree: "quick", about half of the time for queries that take about 1.1 times as long, or "default". */
    effort?: string;
    /** Whether triangles keep their numbers from the input; else the baker numbers them in its own order. True by default. */
    ids?: boolean;
    /** Whether the file states which objects are closed, which queries about the inside need. True by default. */
    topology?: boolean;
    /** The radius of the mesh in mesh units, as of `rounded`, which the file then states. 0 by default. */
    radius?: number;
    /** Whether the mesh is solid, as by `solid`, which the file then states. False by default. */
    solid?: boolean;
    /** Whether a file's points without a position are left out, those with a coordinate that is NaN or infinite. They are
     * refused by default. */
    dropNan?: boolean;
    /** A function that is called with each warning: what the reader of a file did that its author may not expect. */
    onWarning?: (warning: string) => void;
    /** A function that is called with the name of each stage when the stage begins. */
    onStage?: (stage: string) => void;
}

/** How far a distance may exceed the least one. More saves time; `lower` is still a certified bound. */
export interface DistanceOptions {
    /** The allowed fraction of the least distance. 0 by default. */
    relErr?: number;
    /** A length in mesh units that is allowed as well. 0 by default. */
    absErr?: number;
}

/** When the search for a depth ends; in any case when it has tried all it knows. */
export interface PenetrationOptions {
    /** When the upper bound exceeds the lower one by no more than this part of it: above 0. 0.01 by default. */
    relativeGap?: number;
    /** When it is known whether the depth exceeds this length, in mesh units. */
    tolerance?: number;
}

/** What counts as a clash. Lengths are in mesh units. */
export interface ClashOptions {
    /** Parts at most this far apart are near. 0, the default, looks for no near parts. */
    clearance?: number;
    /** Parts at most this far apart, or at most this deep in each other, are touching; by default a millionth of the largest side of
     * both parts. */
    tolerance?: number;
    /** The search for a depth ends when the upper bound exceeds the lower one by no more than this part of it: above 0. 0.1 by
     * default. */
    relativeGap?: number;
    /** The most visits of nodes and triangles that the search for the depth of a pair may make, from 0 to 2^32 - 1. 2^20 by
     * default. */
    visits?: number;
    /** Whether to measure what closed parts have in common, as `Mesh.intersection` does, and to divide overlapping ones into piercing and
     * protruding ones. False by default. */
    magnitudes?: boolean;
}

/** How contacts are joined into patches. */
export interface PatchOptions {
    /** How far apart points of two contacts may be that belong together, in mesh units, beyond their errors. Meshes with a
     * radius, whose contacts are points, need more than 0. 0 by default. */
    tolerance?: number;
    /** The number of contacts that are considered, the first ones in ascending order; all by default. */
    maxContacts?: number;
    /** The largest number of contact points of each patch, as simulators use them; 0, none, by default. The deepest one comes
     * first, then those that most enlarge the outline of the chosen ones, as long as they do by more than a 256th: four for a
     * box on a floor, and about 16 at most for a round outline. */
    maxPoints?: number;
}

/** What counts as a hit, and how exactly time is searched. */
export interface MotionOptions {
    /** Meshes that are at most this far apart, in mesh units, count as a hit. 0, contact, by default. */
    clearance?: number;
    /** The width of the undecided range beyond the clearance, in mesh units; by default a millionth of the diagonal of the
     * smaller object's box, radius included. Between a point and a mesh, it is a millionth of the mesh's. */
    tolerance?: number;
}

/** Where the mesh is, and where rays end. */
export interface RayOptions {
    /** The greatest parameter, one for all rays or N numbers. Infinite by default. */
    until?: number | Numbers;
    /** The pose of the mesh in the frame of the rays; by default, the rays are in the frame of the mesh. */
    pose?: Numbers;
}

/** Checks the types of the options of a bake. */
function checked(options: BakeOptions): BakeOptions {
    const types: [keyof BakeOptions, string][] = [
        ["profile", "string"],
        ["triangles", "string"],
        ["maxError", "number"],
        ["round", "string"],
        ["weld", "number"],
        ["effort", "string"],
        ["ids", "boolean"],
        ["topology", "boolean"],
        ["radius", "number"],
        ["solid", "boolean"],
        ["dropNan", "boolean"],
        ["onWarning", "function"],
        ["onStage", "function"],
    ];
    for (const [name, type] of types) {
        if (options[name] !== undefined && typeof options[name] !== type) {
            throw new TypeError(`${name}: expected a ${type}, found ${described(options[name])}`);
        }
    }
    return options;
}

/** Reads a number, if there is one. */
const optional = (value: number | undefined, name: string) => (value === undefined ? undefined : float(value, name));

/** Reads the clearance and the tolerance. */
export function limits(options: MotionOptions): [number, number | undefined] {
    const { clearance = 0, tolerance } = options;
    return [float(clearance, "clearance"), optional(tolerance, "tolerance")];
}

/** Reads when the search for a depth ends. */
export function depthLimits(options: PenetrationOptions): [number?, number?] {
    return [optional(options.relativeGap, "relativeGap"), optional(options.tolerance, "tolerance")];
}

/** Reads what counts as a clash. */
export function clashLimits(
    options: ClashOptions,
): [number, number | undefined, number | undefined, number | undefined, boolean] {
    const { clearance = 0, tolerance, relativeGap, visits, magnitudes = false } = options;
    const [depth, gap] = [optional(tolerance, "tolerance"), optional(relativeGap, "relativeGap")];
    const most = visits === undefined ? undefined : integer(visits, "visits");
    return [float(clearance, "clearance"), depth, gap, most, flag(magnitudes, "magnitudes")];
}

/** Reads the greatest parameters of rays. */
export function untils(until: number | Numbers = Number.POSITIVE_INFINITY): Float64Array {
    return typeof until === "number" ? Float64Array.of(until) : floats(until, "until");
}

/** Reads one pose. */
export function onePose(value: Numbers, name = "pose"): Float64Array {
    const numbers = floats(value, name);
    if (numbers.length !== 12) {
        throw new TypeError(`${name}: expected 12 numbers, found ${numbers.length}`);
    }
    return numbers;
}

const placed = (value: Numbers | undefined) => (value === undefined ? undefined : onePose(value));

/**
 * A mesh in the bytes of a `.cbvh` file: all objects of the file, or one. It never changes.
 *
 * Queries whose names end in `Each` are about N poses or paths, and answer with arrays; so do those about points and rays.
 * A pose is that of the other mesh in the frame of this one: see `pose`.
 */
export class Mesh extends Handle<raw.Mesh> {
    private constructor(made: raw.Mesh) {
        super(made, "Mesh");
    }

    /** @internal */
    static _of(made: raw.Mesh): Mesh {
        return new Mesh(made);
    }

    /** Opens the bytes of a `.cbvh` file, which are copied. Only the header and the object table are read, whatever the size
     * of the file. */
    static open(file: Bytes): Mesh {
        const array = bytes(file, "bytes");
        return new Mesh(call(() => raw.Mesh.open(array)));
    }

    /**
     * Bakes a mesh.
     *
     * Answers are exact for the numbers that are given, which are stored as they are. Vertices move only if that is asked for, with
     * `round`, `weld` or triangles "quantized"; `maxMove` states by how much.
     *
     * @param vertices 3 V numbers, in any unit of length.
     * @param faces 3 F vertex numbers; by default, every three vertices are a triangle.
     */
    static bake(vertices: Numbers, faces?: Integers | null, options: BakeOptions = {}): Mesh {
        const points = floats(vertices, "vertices");
        const corners = faces === undefined || faces === null ? undefined : integers(faces, "faces");
        const chosen = checked(options);
        return new Mesh(call(() => raw.bake(points, corners, chosen)));
    }

    /** @internal Bakes a shape of the library, from its numbers and a list of further ones. */
    static bakeShape(kind: string, numbers: number[], list: Float64Array = new Float64Array()): Mesh {
        return new Mesh(call(() => raw.bakeShape(kind, Float64Array.from(numbers), list)));
    }

    /**
     * Bakes the bytes of a mesh file. All its objects become one.
     *
     * @param name The name of the file. Its extension tells the format: .obj, .stl, .ply, .glb, .gltf with all its
     * buffers inside, or .dae (COLLADA, which becomes metres with z pointing up); .xyz, .pcd, or .ply without faces for points. With any other extension, the content tells the format.
     */
    static bakeFile(name: string, file: Bytes, options: BakeOptions = {}): Mesh {
        const [title, array, chosen] = [text(name, "name"), bytes(file, "bytes"), checked(options)];
        return new Mesh(call(() => raw.bakeFile(title, array, chosen)));
    }

    /** Returns a copy of the bytes of the file, to save them. They state the radius of this mesh, and that it is solid. */
    bytes(): Uint8Array {
        return this.#call((mesh) => mesh.bytes());
    }

    /** The size of the file in bytes, which is about all the memory that the mesh takes. */
    get byteLength(): number {
        return this.#call((mesh) => mesh.size());
    }

    /** The number of triangles, without exact duplicates. */
    get triangleCount(): number {
        return this.#call((mesh) => mesh.count());
    }

    /** The lower and the upper corner of the axis-aligned box of all vertices: 6 numbers. */
    get bounds(): Float64Array {
        return this.#call((mesh) => mesh.bounds());
    }

    /** The names of all objects of the file. */
    get names(): string[] {
        return this.#call((mesh) => mesh.names());
    }

    /**
     * Returns the same triangles with a radius in mesh units: all points at most that far from them. It replaces the radius that
     * the mesh has. Two shapes touch if their triangles are no farther apart than the sum of their radii, exactly, and their
     * distance is that of the triangles less the sum, at least 0. The new mesh shares the bytes, and is freed separately.
     */
    rounded(radius: number): Mesh {
        const length = float(radius, "radius");
        return new Mesh(this.#call((mesh) => mesh.rounded(length)));
    }

    /** Returns the same mesh as a solid: what is inside it touches it, at distance 0. It must be closed. */
    solid(): Mesh {
        return new Mesh(this.#call((mesh) => mesh.solid()));
    }

    /** How far the shape reaches from its triangles, in mesh units. */
    get radius(): number {
        return this.#call((mesh) => mesh.radius());
    }

    /**
     * How far a vertex may be from the one that was given to the baker, in mesh units: 0 unless vertices were quantised, rounded
     * or welded on purpose, or lay below 2^-180. Answers are about the mesh as it is stored.
     */
    get maxMove(): number {
        return this.#call((mesh) => mesh.maxMove());
    }

    /** Whether what is inside touches the mesh. */
    get isSolid(): boolean {
        return this.#call((mesh) => mesh.isSolid());
    }

    /** Returns one object of the file, by number or name. It shares the bytes, and is freed separately. */
    object(object: number | string): Mesh {
        return new Mesh(
            this.#call((mesh) => {
                if (typeof object !== "string") {
                    return mesh.object(float(object, "object"));
                }
                const numbers = mesh.names().flatMap((name, number) => (name === object ? [number] : []));
                if (numbers.length !== 1) {
                    const found = `found ${numbers.length} named ${JSON.stringify(object)}`;
                    throw new Error(`object: expected one object of this name, ${found}`);
                }
                return mesh.object(numbers[0] as number);
            }),
        );
    }

    /**
     * Returns the corners of all triangles as they are stored: 9 T numbers. Those of triangle `id` begin at `9 * id`. They
     * are NaN if no triangle has that id. Each call reads and checks the whole mesh.
     */
    triangles(): Float64Array {
        return this.#call((mesh) => mesh.triangles());
    }

    /** Checks every rule in the whole file. Queries check only the parts that they touch. */
    validate(): void {
        this.#call((mesh) => mesh.validate());
    }

    #call<T>(work: (mesh: raw.Mesh) => T): T {
        const mesh = this._raw("mesh");
        return call(() => work(mesh));
    }

    /** Asks about another mesh in N poses. */
    #pair<T>(other: Mesh, poses: Numbers, ask: (a: raw.Mesh, b: raw.Mesh, poses: Float64Array) => T): T {
        const [a, b] = [this._raw("mesh"), instance(other, Mesh, "Mesh", "other")._raw("other")];
        const array = floats(poses, "poses");
        return call(() => ask(a, b, array));
    }

    /** Do the surfaces touch? Exact. */
    collide(other: Mesh, pose: Numbers): boolean {
        return this.collideEach(other, onePose(pose))[0] === 1;
    }

    /** `collide` for N poses: 1 or 0 for each. */
    collideEach(other: Mesh, poses: Numbers): Uint8Array {
        return this.#pair(other, poses, raw.collide);
    }

    /** Are they at most `d` mesh units apart? Exact. */
    within(other: Mesh, pose: Numbers, d: number): boolean {
        return this.withinEach(other, onePose(pose), d)[0] === 1;
    }

    /** `within` for N poses: 1 or 0 for each. */
    withinEach(other: Mesh, poses: Numbers, d: number): Uint8Array {
        const limit = float(d, "d");
        return this.#pair(other, poses, (a, b, array) => raw.within(a, b, array, limit));
    }

    /** How far apart are they? The least distance, a pair of closest points, and their triangles. */
    distance(other: Mesh, pose: Numbers, options: DistanceOptions = {}): Distance {
        return answers.onlyDistance(this.distanceEach(other, onePose(pose), options));
    }

    /** `distance` for N poses. */
    distanceEach(other: Mesh, poses: Numbers, options: DistanceOptions = {}): Distances {
        const { relErr = 0, absErr = 0 } = options;
        const [relative, absolute] = [float(relErr, "relErr"), float(absErr, "absErr")];
        return answers.distances(this.#pair(other, poses, (a, b, array) => raw.distance(a, b, array, relative, absolute)));
    }

    /** Do they touch and, if not, is one inside the other? */
    relation(other: Mesh, pose: Numbers): Relation {
        return this.relationEach(other, onePose(pose))[0] as Relation;
    }

    /** `relation` for N poses: numbers of `Relation`. */
    relationEach(other: Mesh, poses: Numbers): Uint8Array {
        return this.#pair(other, poses, raw.relation);
    }

    /**
     * All pairs of triangles that touch, exactly, in ascending order: 4 K numbers, which are object and triangle of this mesh,
     * and object and triangle of `other`. Triangles are numbered as in the input.
     */
    contacts(other: Mesh, pose: Numbers): Uint32Array {
        return this.contactsEach(other, onePose(pose))[0] as Uint32Array;
    }

    /** `contacts` for N poses: an array for each. */
    contactsEach(other: Mesh, poses: Numbers): Uint32Array[] {
        return this.#pair(other, poses, raw.contacts);
    }

    /**
     * Where do these triangles meet? The contacts of `contacts`, in the same order, with the points, curves and polygons that
     * both triangles have in common.
     *
     * @param options `limit`: the number of contacts to answer, the first ones; all by default.
     */
    contactRegions(other: Mesh, pose: Numbers, options: { limit?: number } = {}): ContactRegions {
        const [at, limit] = [onePose(pose), most(options.limit, "limit")];
        const [parts, total] = this.#pair(other, at, (a, b) => raw.contactRegions(a, b, at, limit));
        return answers.regions(parts, total);
    }

    /**
     * The same contacts, joined into connected patches, each with a centre, a normal and an estimated depth and, on request,
     * contact points for simulators. It takes some microseconds more for each patch, and some tens for its points.
     */
    patches(other: Mesh, pose: Numbers, options: PatchOptions = {}): Patches {
        const { tolerance = 0, maxContacts, maxPoints = 0 } = options;
        const [at, apart, limit] = [onePose(pose), float(tolerance, "tolerance"), most(maxContacts, "maxContacts")];
        const points = most(maxPoints, "maxPoints");
        return answers.patches(this.#pair(other, at, (a, b) => raw.patches(a, b, at, apart, limit, points)));
    }

    /**
     * How far does `other` move along a direction until interiors are disjoint? A mesh inside the other one moves until it is
     * out. All numbers are 0 if the meshes are apart. Both bounds are certain. They agree to some roundings, unless surfaces
     * only slide along each other on a part of the way: `lower` ends there. Both meshes must be closed.
     *
     * @param direction 3 numbers in the frame of this mesh, of any length.
     */
    separation(other: Mesh, pose: Numbers, direction: Numbers): Separation {
        return answers.onlyBounds(this.separationEach(other, onePose(pose), direction));
    }

    /** `separation` for N poses and a direction for each: 3 N numbers. */
    separationEach(other: Mesh, poses: Numbers, directions: Numbers): Separations {
        const ways = floats(directions, "directions");
        return answers.separations(this.#pair(other, poses, (a, b, array) => raw.separation(a, b, array, ways)));
    }

    /**
     * How deep do they overlap? Certified bounds of the length of the shortest translation of `other` after which interiors are
     * disjoint, and such a translation. All numbers are 0 if the meshes are apart. For convex meshes of one object and at most 4096
     * triangles, the bounds are as near each other as the options ask for, down to some roundings; for others, `lower` is mostly more
     * than two thirds of the depth. It takes some microseconds for such convex meshes, and up to some milliseconds for others. Both meshes
     * must be closed.
     */
    penetration(other: Mesh, pose: Numbers, options: PenetrationOptions = {}): Penetration {
        return answers.onlyPenetration(this.penetrationEach(other, onePose(pose), options));
    }

    /** `penetration` for N poses. */
    penetrationEach(other: Mesh, poses: Numbers, options: PenetrationOptions = {}): Penetrations {
        const limits = depthLimits(options);
        return answers.penetrations(this.#pair(other, poses, (a, b, array) => raw.penetration(a, b, array, ...limits)));
    }

    /**
     * How far apart are they or, below zero, how deep do they overlap? Certified bounds of the distance where they are apart, and of
     * minus the depth of `penetration` where they overlap or one is inside the other, with a direction and two points. Where they
     * touch, 0 is between the bounds, which are some roundings apart. The options are those of the depth. Meshes need not be
     * closed: see `isSigned`. It takes the time of `distance` and of `sides` for a few points or, where they overlap, that of
     * `penetration`.
     */
    signedDistance(other: Mesh, pose: Numbers, options: PenetrationOptions = {}): SignedDistance {
        return answers.onlySignedDistance(this.signedDistanceEach(other, onePose(pose), options));
    }

    /** `signedDistance` for N poses. */
    signedDistanceEach(other: Mesh, poses: Numbers, options: PenetrationOptions = {}): SignedDistances {
        const limits = depthLimits(options);
        return answers.signedDistances(this.#pair(other, poses, (a, b, array) => raw.signedDistance(a, b, array, ...limits)));
    }

    /**
     * How do they lie: apart, near, touching, overlapping, one in the other, or twice in one place? Flush faces overlap or come
     * apart by roundings in nearly all poses, so that a tolerance is part of the query: parts that are no farther apart and no
     * deeper in each other, by the depth of `penetration`, are touching. Meshes need not be closed.
     */
    clash(other: Mesh, pose: Numbers, options: ClashOptions = {}): Clash {
        return answers.onlyClash(this.clashEach(other, onePose(pose), options));
    }

    /** `clash` for N poses. */
    clashEach(other: Mesh, poses: Numbers, options: ClashOptions = {}): Clashes {
        const limits = clashLimits(options);
        return answers.clashes(this.#pair(other, poses, (a, b, array) => raw.clash(a, b, array, ...limits)));
    }

    /**
     * How much do closed meshes have in common? The volume of the intersection, with a certified error, its box, the area of each
     * surface in it, and how thick the meshes are where they pierce each other.
     *
     * A mesh is pierced where the other one passes all the way through it: the other one goes in through one part of its surface and out
     * through another one, and the thickness is the least distance between two such parts. It is not pierced where the other one only
     * reaches into it, or takes a corner of it along. A common face of flush meshes encloses nothing. Each place counts as often as the
     * surfaces wind around it: where parts of one mesh overlap, unite them before baking. Radii are left out. Throws if a mesh is not
     * closed, or was baked without topology.
     */
    intersection(other: Mesh, pose: Numbers): Intersection {
        return answers.onlyIntersection(this.intersectionEach(other, onePose(pose)));
    }

    /** `intersection` for N poses. */
    intersectionEach(other: Mesh, poses: Numbers): Intersections {
        return answers.intersections(this.#pair(other, poses, (a, b, array) => raw.intersection(a, b, array)));
    }

    /**
     * What bounds the part that closed meshes have in common? Polygons for those who draw it: the parts of this mesh's triangles inside
     * the other one, and then those of the other mesh's triangles inside this one. Points are rounded. Polygons that are next to each
     * other have the same points, so that no gap is between them.
     */
    intersectionSurface(other: Mesh, pose: Numbers): IntersectionSurface {
        return answers.intersectionSurface(
            this.#pair(other, onePose(pose), (a, b, array) => raw.intersectionSurface(a, b, array)),
        );
    }

    /**
     * Which triangles of this mesh meet where they should not? All pairs, in ascending order, that have more in common than
     * their common corners and what is between these, exactly. A radius does not matter.
     */
    selfContacts(): SelfContacts {
        return answers.selfContacts(this.#call((mesh) => raw.selfContacts(mesh)));
    }

    /**
     * Which edges leave this mesh open, so that queries about what is inside have no answer? None if it is closed. Duplicates count
     * with their orientation. Throws if the mesh was baked without topology.
     */
    openEdges(): OpenEdges {
        return answers.openEdges(this.#call((mesh) => mesh.openEdges()));
    }

    /**
     * Is the motion of `other` in the frame of this mesh free, and where does it end if it is not? The answer is certain at
     * every moment, not only at samples.
     */
    motion(other: Mesh, motion: Motion, options: MotionOptions = {}): MotionAnswer {
        const { kind, freeUntil, at, nearest } = this.motionEach(
            other,
            onePath(instance(motion, Motion, "Motion", "motion"), "motion"),
            options,
        );
        const end = kind[0] === answers.MotionKind.FREE ? undefined : answers.onlyDistance(nearest);
        return { kind: kind[0] as number, freeUntil: freeUntil[0] as number, at: at[0] as number, nearest: end };
    }

    /** `motion` for N paths. */
    motionEach(other: Mesh, motion: Motion, options: MotionOptions = {}): MotionAnswers {
        const { _kind: kind, _numbers: numbers } = instance(motion, Motion, "Motion", "motion");
        const limit = limits(options);
        return answers.motions(this.#pair(other, numbers, (a, b) => raw.motion(a, b, kind, numbers, ...limit)));
    }

    /** Whether `motion` answers FREE. It takes less time than `motion`: use it in planners. */
    isFree(other: Mesh, motion: Motion, options: MotionOptions = {}): boolean {
        return this.isFreeEach(other, onePath(instance(motion, Motion, "Motion", "motion"), "motion"), options)[0] === 1;
    }

    /** `isFree` for N paths: 1 or 0 for each. */
    isFreeEach(other: Mesh, motion: Motion, options: MotionOptions = {}): Uint8Array {
        const { _kind: kind, _numbers: numbers } = instance(motion, Motion, "Motion", "motion");
        const limit = limits(options);
        return this.#pair(other, numbers, (a, b) => raw.isFree(a, b, kind, numbers, ...limit));
    }

    /**
     * The points of the surface that are closest to N points.
     *
     * @param points 3 N numbers.
     * @param options `within`: the greatest distance to search, in mesh units, infinite by default. `pose`: of this mesh in
     * the frame of the points; by default, the points are in the frame of the mesh.
     */
    closestPoints(points: Numbers, options: { within?: number; pose?: Numbers } = {}): ClosestPoints {
        const { within = Number.POSITIVE_INFINITY } = options;
        const [array, limit, pose] = [floats(points, "points"), float(within, "within"), placed(options.pose)];
        return answers.closest(this.#call((mesh) => raw.closestPoints(mesh, pose, array, limit)));
    }

    /** Which side of the surface each of N points is on, exactly: numbers of `Side`. */
    sides(points: Numbers, options: { pose?: Numbers } = {}): Int8Array {
        const [array, pose] = [floats(points, "points"), placed(options.pose)];
        return this.#call((mesh) => raw.sides(mesh, pose, array));
    }

    /**
     * Distances of N points from the surface, negative inside; NaN if the mesh has no inside, because it is not closed, or if
     * the surface is farther away than `within`. The surface is all triangles of the mesh: where closed parts of it overlap,
     * the closest one may be inside, and the distance is less than that to the outside. Options are those of
     * `closestPoints`.
     */
    signedPointDistances(points: Numbers, options: { within?: number; pose?: Numbers } = {}): Float64Array {
        const { within = Number.POSITIVE_INFINITY } = options;
        const [array, limit, pose] = [floats(points, "points"), float(within, "within"), placed(options.pose)];
        return this.#call((mesh) => raw.signedPointDistances(mesh, pose, array, limit));
    }

    /** Asks about N rays. */
    #rays<T>(
        origins: Numbers,
        directions: Numbers,
        options: RayOptions,
        ask: (mesh: raw.Mesh, pose: Float64Array | undefined, rays: raw.Rays) => T,
    ): T {
        const [pose, until] = [placed(options.pose), untils(options.until)];
        const [from, along] = [floats(origins, "origins"), floats(directions, "directions")];
        return this.#call((mesh) => ask(mesh, pose, new raw.Rays(from, along, until)));
    }

    /**
     * Where N rays first hit the surface.
     *
     * @param origins 3 N numbers.
     * @param directions 3 N numbers. Directions may have any length, which is the unit of `t`.
     */
    firstHits(origins: Numbers, directions: Numbers, options: RayOptions = {}): RayHits {
        return answers.hits(this.#rays(origins, directions, options, raw.firstHits));
    }

    /** Whether N rays hit the surface, exactly: 1 or 0 for each. */
    anyHits(origins: Numbers, directions: Numbers, options: RayOptions = {}): Uint8Array {
        return this.#rays(origins, directions, options, raw.anyHits);
    }

    /** All triangles that N rays hit, in the exact order along each: an answer for each ray, with an element for each hit. A mesh with
     * a radius is one body, and its hits are where the ray enters and leaves it, in turns: at 0 if it starts inside, and without
     * an exit if it ends there. A closed core is hollow also if it is solid. */
    allHits(origins: Numbers, directions: Numbers, options: RayOptions = {}): RayHits[] {
        return this.#rays(origins, directions, options, raw.allHits).map(answers.hits);
    }

    /** Whether N closed segments meet the surface, exactly: 1 or 0 for each. Starts and ends are 3 N numbers each. */
    segmentHits(starts: Numbers, ends: Numbers, options: { pose?: Numbers } = {}): Uint8Array {
        return this.visible(starts, ends, options).map((sees) => 1 - sees);
    }

    /**
     * Whether the points of N pairs see each other past the surface: 1 or 0 for each. Starts and ends are 3 N numbers each.
     *
     * They do if the segment between them, but for what is within `margin` of either, does not meet the surface. With a margin of
     * 0, a point on the surface sees nothing, as the segment touches the surface there. For such points, take a margin that is
     * longer than their coordinates are off, such as a millionth of the size of the mesh. Points at most two margins apart see
     * each other.
     */
    visible(starts: Numbers, ends: Numbers, options: { margin?: number; pose?: Numbers } = {}): Uint8Array {
        const [from, to, pose] = [floats(starts, "starts"), floats(ends, "ends"), placed(options.pose)];
        return this.#call((mesh) => raw.visible(mesh, pose, from, to, options.margin ?? 0));
    }
}
