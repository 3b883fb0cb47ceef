/** Scenes: many placed meshes, and queries over all pairs of them that may meet. */

import * as answers from "./answers.js";
import type {
    Distances,
    SceneClashes,
    SceneClosestPoints,
    SceneContacts,
    SceneDistance,
    SceneMotionAnswer,
    SceneRayHits,
    SceneRelations,
    SceneSignedDistance,
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
    text,
    type Bytes,
    type Integers,
    type Numbers,
} from "./arguments.js";
import {
    clashLimits,
    depthLimits,
    limits,
    Mesh,
    onePose,
    untils,
    type ClashOptions,
    type MotionOptions,
    type PenetrationOptions,
} from "./mesh.js";
import { call, Handle, raw } from "./module.js";
import { Motion, onePath } from "./motion.js";

/** An instance of a scene: its number or its name. */
export type Instance = number | string;

/** What an instance is called, and which pairs it takes part in. */
export interface InstanceOptions {
    /** A name that no other instance of the scene has. */
    name?: string;
    /** The groups that the instance is in, one bit for each of 32. All by default. */
    member?: number;
    /** The groups that it meets. Queries are about two instances if each is in a group that the other meets. */
    meets?: number;
}

const ALL_GROUPS = 0xffff_ffff;

/**
 * Many placed meshes, and queries over all pairs that may meet.
 *
 * An instance is a mesh with its pose in the world. `add` returns its number, which is never given again. Arguments may name
 * an instance by its name instead, if it has one; answers have numbers. The first instance of a pair is A. A query is about
 * all pairs of instances whose groups meet and whose contact is not allowed. Answers are in the order of the pairs, and each is
 * that of `Mesh` for the pose of B in A's frame, to the bit.
 */
export class Scene extends Handle<raw.Scene> {
    /** An empty scene. */
    constructor();
    /** @internal */
    constructor(opened?: raw.Scene);
    constructor(opened?: raw.Scene) {
        super(opened ?? call(() => new raw.Scene()), "Scene");
    }

    /** Opens the bytes of a file that `cbvh bake --scene` made, with its instances in their order. */
    static open(file: Bytes): Scene {
        const array = bytes(file, "bytes");
        return new Scene(call(() => raw.Scene.open(array)));
    }

    #call<T>(work: (scene: raw.Scene) => T): T {
        const scene = this._raw("scene");
        return call(() => work(scene));
    }

    /** Finds the number of an instance. */
    #number(value: Instance, name: string): number {
        if (typeof value !== "string") {
            return integer(value, name);
        }
        const found = this.#call((scene) => scene.find(value));
        if (found === undefined) {
            throw new Error(`${name}: expected an instance of the scene, found ${JSON.stringify(value)}`);
        }
        return found;
    }

    /** Finds the numbers of instances. */
    #numbers(values: readonly Instance[] | Integers, name: string): Uint32Array {
        if (Array.isArray(values)) {
            return Uint32Array.from(values as Instance[], (value) => this.#number(value, name));
        }
        return integers(values as Integers, name);
    }

    /**
     * Adds an instance, and returns its number. The scene keeps the mesh, which may be freed.
     *
     * @param pose Twelve numbers, the identity by default. It must be rigid to within 2^-23.
     */
    add(mesh: Mesh, pose?: Numbers | null, options: InstanceOptions = {}): number {
        const { name, member = ALL_GROUPS, meets = ALL_GROUPS } = options;
        const added = instance(mesh, Mesh, "Mesh", "mesh")._raw("mesh");
        const at = pose === undefined || pose === null ? undefined : onePose(pose);
        const called = name === undefined ? undefined : text(name, "name");
        const groups: [number, number] = [integer(member, "member"), integer(meets, "meets")];
        return this.#call((scene) => scene.add(added, at, called, ...groups));
    }

    /** Replaces the mesh of an instance, such as a cloud of points that a camera sees again and again. All else stays. */
    setMesh(id: Instance, mesh: Mesh): void {
        const number = this.#number(id, "id");
        const next = instance(mesh, Mesh, "Mesh", "mesh")._raw("mesh");
        this.#call((scene) => scene.setMesh(number, next));
    }

    /**
     * Attaches an instance to a parent, with which it moves from then on: a part to the gripper that holds it.
     *
     * The scene keeps the pose of the child in the parent's frame, from which the pose in the world is computed each time
     * that the parent moves, so that nothing adds up. `setPose` of the child changes what is kept. In a motion, the child
     * follows the path of its parent, unless it has a path of its own. A gripper usually touches what it holds: allow this
     * pair with `setAllowed`. The parent must not be the child itself or move with it.
     */
    attach(child: Instance, parent: Instance): void {
        const [first, second] = [this.#number(child, "child"), this.#number(parent, "parent")];
        this.#call((scene) => scene.attach(first, second));
    }

    /** Detaches an instance from its parent, if it has one. It stays where it is. */
    detach(child: Instance): void {
        const number = this.#number(child, "child");
        this.#call((scene) => scene.detach(number));
    }

    /** Returns what an instance is attached to, or `undefined`. */
    parent(child: Instance): number | undefined {
        const number = this.#number(child, "child");
        return this.#call((scene) => scene.parent(number));
    }

    /** Removes an instance, and forgets which of its contacts were allowed. What is attached to it stays where it is. */
    remove(id: Instance): void {
        const number = this.#number(id, "id");
        this.#call((scene) => scene.remove(number));
    }

    /** Moves an instance, and those that are attached to it. */
    setPose(id: Instance, pose: Numbers): void {
        this.setPoses([id], onePose(pose));
    }

    /** Moves N instances, and those that are attached to them and not given. If an instance is given twice, the last pose
     * counts. If an argument is wrong, none moves. */
    setPoses(ids: readonly Instance[] | Integers, poses: Numbers): void {
        const [numbers, array] = [this.#numbers(ids, "ids"), floats(poses, "poses")];
        this.#call((scene) => scene.setPoses(numbers, array));
    }

    /** Returns the poses of instances in the world, by default of all in their order: 12 numbers for each. */
    poses(ids?: readonly Instance[] | Integers): Float64Array {
        const numbers = ids === undefined ? this.instances() : this.#numbers(ids, "ids");
        return this.#call((scene) => scene.poses(numbers));
    }

    /** Puts an instance into groups: see {@link InstanceOptions}. What is left out stays. */
    setGroups(id: Instance, groups: { member?: number; meets?: number }): void {
        const number = this.#number(id, "id");
        const known = this.groups(number);
        const member = integer(groups.member ?? known.member, "member");
        const meets = integer(groups.meets ?? known.meets, "meets");
        this.#call((scene) => scene.setGroups(number, member, meets));
    }

    /** Returns the groups that an instance is in, and those that it meets. */
    groups(id: Instance): { member: number; meets: number } {
        const number = this.#number(id, "id");
        const [member, meets] = this.#call((scene) => scene.groups(number)) as Uint32Array;
        return { member: member as number, meets: meets as number };
    }

    /** Allows two instances to touch or, with `false`, no longer. Queries about all pairs leave out pairs that may touch. */
    setAllowed(a: Instance, b: Instance, allowed = true): void {
        const [first, second, chosen] = [this.#number(a, "a"), this.#number(b, "b"), flag(allowed, "allowed")];
        this.#call((scene) => scene.setAllowed(first, second, chosen));
    }

    /** Returns the pairs that may touch: 2 K numbers of instances. */
    allowed(): Uint32Array {
        return this.#call((scene) => scene.allowed());
    }

    /** Gives an instance a margin in mesh units, which is added to the radius of its mesh in every query. 0 at first. */
    setMargin(id: Instance, margin: number): void {
        const [number, length] = [this.#number(id, "id"), float(margin, "margin")];
        this.#call((scene) => scene.setMargin(number, length));
    }

    /** Returns the margin of an instance. */
    margin(id: Instance): number {
        const number = this.#number(id, "id");
        return this.#call((scene) => scene.margin(number));
    }

    /** Gives a pair of instances a further margin in mesh units. 0 at first. */
    setPairMargin(a: Instance, b: Instance, margin: number): void {
        const [first, second, length] = [this.#number(a, "a"), this.#number(b, "b"), float(margin, "margin")];
        this.#call((scene) => scene.setPairMargin(first, second, length));
    }

    /** Returns the margin that a pair has of its own. */
    pairMargin(a: Instance, b: Instance): number {
        const [first, second] = [this.#number(a, "a"), this.#number(b, "b")];
        return this.#call((scene) => scene.pairMargin(first, second));
    }

    /** Returns the number of the instance with a name, or `undefined` if there is none. */
    find(name: string): number | undefined {
        const called = text(name, "name");
        return this.#call((scene) => scene.find(called));
    }

    /** Returns the name of an instance, or `undefined` if it has none. */
    name(id: Instance): string | undefined {
        const number = this.#number(id, "id");
        return this.#call((scene) => scene.name(number));
    }

    /** Returns the mesh of an instance, as a new object. It shares the bytes, and is freed separately. */
    mesh(id: Instance): Mesh {
        const number = this.#number(id, "id");
        return Mesh._of(this.#call((scene) => scene.mesh(number)));
    }

    /** Returns the numbers of all instances, in their order. */
    instances(): Uint32Array {
        return this.#call((scene) => scene.instances());
    }

    /** Whether the scene reuses earlier results about each pair. This affects no answer, and saves time if instances move
     * little from query to query. Off at first. */
    setTracking(tracking: boolean): void {
        const chosen = flag(tracking, "tracking");
        this.#call((scene) => scene.setTracking(chosen));
    }

    /** Whether any pair touches, exactly. */
    collide(): boolean {
        return this.#call((scene) => scene.collide());
    }

    /** Whether any pair is at most `d` mesh units apart, exactly. */
    within(d: number): boolean {
        const limit = float(d, "d");
        return this.#call((scene) => scene.within(limit));
    }

    /** All pairs that touch, exactly: 2 K numbers of instances. */
    pairsInContact(): Uint32Array {
        return this.#call((scene) => scene.pairsInContact());
    }

    /** All pairs that are at most `d` mesh units apart, exactly: 2 K numbers of instances. */
    pairsWithin(d: number): Uint32Array {
        const limit = float(d, "d");
        return this.#call((scene) => scene.pairsWithin(limit));
    }

    /** All pairs that touch or of which one is inside the other, wholly or in part, with their relations. */
    relations(): SceneRelations {
        const [pairs, relations] = this.#call((scene) => scene.relations());
        return { pairs, relations } as SceneRelations;
    }

    /**
     * All pairs that are near each other, touch, overlap, contain each other or are duplicates, with how they lie. Pairs that are
     * apart are left out. Options are those of `Mesh.clash`.
     */
    clashes(options: ClashOptions = {}): SceneClashes {
        const limits = clashLimits(options);
        const [pairs, clash] = this.#call((scene) => scene.clashes(...limits));
        return { pairs: pairs as Uint32Array, clash: answers.clashes(clash as unknown[]) };
    }

    /** All pairs of triangles that touch, exactly. */
    contacts(): SceneContacts {
        const [pairs, triangles] = this.#call((scene) => scene.contacts());
        return { pairs, triangles } as SceneContacts;
    }

    /** The nearest pair and its distance, or `undefined` if there are no pairs. */
    distance(): SceneDistance | undefined {
        const [pair, nearest] = this.#call((scene) => scene.distance());
        return pairOf(pair as Uint32Array, nearest as unknown[]);
    }

    /**
     * The pair that overlaps most, by its lower bound, or else the nearest pair, and its signed distance: the distance, or minus the
     * depth. `undefined` if there are no pairs. A pair of which one is inside the other overlaps, if both are closed. The signed
     * distance of every other pair is at least that lower bound, but for roundings of distances. The options are those of
     * `Mesh.signedDistance`. It takes the time of `relations`, and of a depth for each pair that overlaps; where none does, that of
     * `distance`.
     */
    signedDistance(options: PenetrationOptions = {}): SceneSignedDistance | undefined {
        const limits = depthLimits(options);
        const [pair, nearest] = this.#call((scene) => scene.signedDistance(...limits));
        const [a, b] = pair as Uint32Array;
        if (a === undefined || b === undefined) {
            return undefined;
        }
        return { a, b, nearest: answers.onlySignedDistance(answers.signedDistances(nearest as unknown[])) };
    }

    /**
     * How far apart pairs of instances are, pair by pair.
     *
     * @param pairs 2 K numbers or names of instances, of any pairs.
     */
    distances(pairs: readonly Instance[] | Integers): Distances {
        const numbers = this.#numbers(pairs, "pairs");
        return answers.distances(this.#call((scene) => scene.distances(numbers)));
    }

    /** Reads instances and their paths. */
    #moving(paths: ReadonlyMap<Instance, Motion>): [Uint32Array, Uint8Array, Float64Array[]] {
        if (!(paths instanceof Map)) {
            throw new TypeError(`paths: expected a Map of instances to paths, found ${described(paths)}`);
        }
        const entries = [...paths] as [Instance, Motion][];
        const numbers = entries.map(([id]) => this.#number(id, "paths"));
        if (new Set(numbers).size < numbers.length) {
            throw new TypeError("paths: expected one path for each instance, found two for one");
        }
        const motions = entries.map(([id, motion]) => {
            const name = `paths[${id}]`;
            return onePath(instance(motion, Motion, "Motion", name), name);
        });
        const kinds = Uint8Array.from(motions, (motion) => motion._kind);
        return [Uint32Array.from(numbers), kinds, motions.map((motion) => motion._numbers)];
    }

    /**
     * Are the paths of some instances free, while they move in the world at the same time and the others stand still? The
     * answer is certain at every moment.
     *
     * @param paths The path of each moving instance in the world. Its present pose does not matter, and does not change.
     */
    motion(paths: ReadonlyMap<Instance, Motion>, options: MotionOptions = {}): SceneMotionAnswer {
        const [moving, limit] = [this.#moving(paths), limits(options)];
        const [kind, freeUntil, at, pair, nearest] = this.#call((scene) => scene.motion(...moving, ...limit));
        return { kind, freeUntil, at, pair: pairOf(pair, nearest) };
    }

    /** Whether `motion` answers FREE. It takes less time than `motion`. */
    isFree(paths: ReadonlyMap<Instance, Motion>, options: MotionOptions = {}): boolean {
        const [moving, limit] = [this.#moving(paths), limits(options)];
        return this.#call((scene) => scene.isFree(...moving, ...limit));
    }

    /** The points of all instances that are closest to N points in the world, 3 N numbers. */
    closestPoints(points: Numbers, options: { within?: number } = {}): SceneClosestPoints {
        const { within = Number.POSITIVE_INFINITY } = options;
        const [array, limit] = [floats(points, "points"), float(within, "within")];
        const [of, closest] = this.#call((scene) => scene.closestPoints(array, limit));
        return { instance: of as Int32Array, closest: answers.closest(closest as unknown[]) };
    }

    /**
     * On which side of the instances N points in the world are, exactly: numbers of `Side`. A point is INSIDE if it is inside
     * any instance; else ON if it is on a surface; else UNDEFINED if it is in the box of an instance that has no inside; else
     * OUTSIDE.
     */
    sides(points: Numbers): Int8Array {
        const array = floats(points, "points");
        return this.#call((scene) => scene.sides(array));
    }

    /** Distances of N points in the world from the closest surface, negative inside any instance. NaN if the side is UNDEFINED,
     * or if no instance is within `within`. */
    signedPointDistances(points: Numbers, options: { within?: number } = {}): Float64Array {
        const { within = Number.POSITIVE_INFINITY } = options;
        const [array, limit] = [floats(points, "points"), float(within, "within")];
        return this.#call((scene) => scene.signedPointDistances(array, limit));
    }

    #rays<T>(
        origins: Numbers,
        directions: Numbers,
        until: number | Numbers | undefined,
        ask: (scene: raw.Scene, rays: raw.Rays) => T,
    ): T {
        const [from, along] = [floats(origins, "origins"), floats(directions, "directions")];
        const limits = untils(until);
        return this.#call((scene) => ask(scene, new raw.Rays(from, along, limits)));
    }

    /** Where N rays in the world first hit an instance. Arguments are those of `Mesh.firstHits`. */
    firstHits(origins: Numbers, directions: Numbers, options: { until?: number | Numbers } = {}): SceneRayHits {
        return answers.sceneHits(
            this.#rays(origins, directions, options.until, (scene, rays) => scene.firstHits(rays)),
        );
    }

    /** Whether N rays in the world hit any instance, exactly: 1 or 0 for each. */
    anyHits(origins: Numbers, directions: Numbers, options: { until?: number | Numbers } = {}): Uint8Array {
        return this.#rays(origins, directions, options.until, (scene, rays) => scene.anyHits(rays));
    }

    /** All hits of N rays in the world, in the exact order along each. Each parameter occurs once, however many instances are
     * hit at exactly that parameter. */
    allHits(origins: Numbers, directions: Numbers, options: { until?: number | Numbers } = {}): SceneRayHits[] {
        const hits = this.#rays(origins, directions, options.until, (scene, rays) => scene.allHits(rays));
        return hits.map(answers.sceneHits);
    }

    /** Whether N closed segments in the world meet any instance, exactly: 1 or 0 for each. */
    segmentHits(starts: Numbers, ends: Numbers): Uint8Array {
        return this.visible(starts, ends).map((sees) => 1 - sees);
    }

    /** Whether the points of N pairs in the world see each other past all instances: see `Mesh.visible`. */
    visible(starts: Numbers, ends: Numbers, options: { margin?: number } = {}): Uint8Array {
        const [from, to] = [floats(starts, "starts"), floats(ends, "ends")];
        return this.#call((scene) => scene.visible(from, to, options.margin ?? 0));
    }
}

/** Makes the answer about a pair, or `undefined` if there is no pair. */
function pairOf(pair: Uint32Array, nearest: unknown[]): SceneDistance | undefined {
    const [a, b] = pair;
    if (a === undefined || b === undefined) {
        return undefined;
    }
    return { a, b, nearest: answers.onlyDistance(answers.distances(nearest)) };
}
