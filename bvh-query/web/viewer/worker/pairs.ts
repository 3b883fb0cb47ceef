/** Questions about two meshes: what is shown at once, and what takes longer. */

import type { Distance, Intersection, IntersectionSurface, Penetration, Relation } from "../../ts/answers.js";
import type { Mesh } from "../../ts/mesh.js";
import { Motion } from "../../ts/motion.js";
import { pose as poseOf, relative } from "../../ts/poses.js";
import * as raw from "../../ts/raw/cbvh.js";
import { file } from "./files.js";

/** One side of a question: a file, and what is added to its radius. */
export interface Side {
    file: number;
    margin?: number;
}

/** What is shown of each pose at once. */
export interface NearAnswer {
    distance: Distance;
    /** `undefined` if a file does not state which objects are closed. */
    relation: Relation | undefined;
    /** Whether they are at most `within` apart, if that was asked. */
    within: boolean | undefined;
    /** The number of pairs of triangles in contact. */
    contacts: number;
    /** The triangles in contact, by their places in the drawn order. */
    touchingA: Uint32Array;
    touchingB: Uint32Array;
    /** How long the library took for the distance, and for everything, in milliseconds. */
    distanceTook: number;
    took: number;
}

/** What is shown a moment later. */
export interface DeepAnswer {
    /** How deep they overlap, or why there is no such number. */
    depth: Penetration | string;
    /** Centres and normals of contact patches, the longest first, and the number of all. */
    centres: Float64Array;
    normals: Float64Array;
    patches: number;
    /** The curves in which triangles meet: ends of segments, 6 numbers for each. */
    curves: Float64Array;
    shared: Shared | undefined;
    took: number;
}

/** What two closed meshes have in common: its measures, and its boundary. */
export interface Shared {
    measures: Intersection;
    surface: IntersectionSurface;
}

/** More contacts than this are not joined into patches. */
const MAX_JOINED_CONTACTS = 40_000;
/** More patches than this are not shown. */
const MAX_SHOWN_PATCHES = 60;

/** What meshes of more triangles than this have in common is not measured. */
const MAX_MEASURED_TRIANGLES = 200_000;

/** Asks about two shapes, which may have margins. */
function withShapes<T>(a: Side, b: Side, ask: (a: Mesh, b: Mesh) => T): T {
    const made: Mesh[] = [];
    const [first, second] = [a, b].map(({ file: number, margin = 0 }) => {
        const { mesh } = file(number);
        if (margin === 0) {
            return mesh;
        }
        const rounded = mesh.rounded(mesh.radius + margin);
        made.push(rounded);
        return rounded;
    }) as [Mesh, Mesh];
    try {
        return ask(first, second);
    } finally {
        made.forEach((mesh) => {
            mesh.free();
        });
    }
}

const message = (error: unknown) => (error instanceof Error ? error.message : String(error));

export function near(a: Side, b: Side, pose: Float64Array, within?: number): NearAnswer {
    return withShapes(a, b, (first, second) => {
        const began = performance.now();
        const distance = first.distance(second, pose);
        const distanceTook = performance.now() - began;
        const pairs = distance.distance === 0 ? first.contacts(second, pose) : new Uint32Array();
        const isStated = [a, b].every((side) => file(side.file).closed !== undefined);
        const relation = isStated ? first.relation(second, pose) : undefined;
        const took = performance.now() - began;
        const column = (place: number) =>
            Uint32Array.from({ length: pairs.length / 4 }, (_, k) => pairs[4 * k + place] ?? 0);
        return {
            distance,
            relation,
            within: within === undefined ? undefined : first.within(second, pose, within),
            contacts: pairs.length / 4,
            touchingA: file(a.file).placesOf(column(0), column(1)),
            touchingB: file(b.file).placesOf(column(2), column(3)),
            distanceTook,
            took,
        };
    });
}

/** Measures what two meshes have in common; `undefined` if there is nothing, if that is not known, or if it would take long. A radius has no
 * part in it. */
function sharedOf(a: Mesh, b: Mesh, pose: Float64Array, areClosed: boolean): Shared | undefined {
    if (!areClosed || a.triangleCount + b.triangleCount > MAX_MEASURED_TRIANGLES || a.radius + b.radius > 0) {
        return undefined;
    }
    const measures = a.intersection(b, pose);
    return measures.volume > measures.volumeError ? { measures, surface: a.intersectionSurface(b, pose) } : undefined;
}

export function deep(a: Side, b: Side, pose: Float64Array): DeepAnswer {
    return withShapes(a, b, (first, second) => {
        const began = performance.now();
        let depth: Penetration | string;
        try {
            depth = first.penetration(second, pose);
        } catch (error) {
            depth = message(error);
        }
        const found = first.patches(second, pose, {
            tolerance: first.radius + second.radius > 0 ? 1e-3 * (first.radius + second.radius) : 0,
            maxContacts: MAX_JOINED_CONTACTS,
        });
        const order = Array.from(found.count, (_, k) => k).sort(
            (k, l) => (found.length[l] ?? 0) + (found.area[l] ?? 0) - (found.length[k] ?? 0) - (found.area[k] ?? 0),
        );
        const shown = order.slice(0, MAX_SHOWN_PATCHES);
        const rows = (of: Float64Array) => Float64Array.from(shown.flatMap((k) => [...of.subarray(3 * k, 3 * k + 3)]));
        const { regions } = found;
        const curves: number[] = [];
        regions.count.forEach((count, k) => {
            const at = (place: number) => regions.points.subarray(18 * k + 3 * place, 18 * k + 3 * place + 3);
            for (let place = 0; place < (count > 2 ? count : count - 1); place++) {
                curves.push(...at(place), ...at((place + 1) % count));
            }
        });
        const [centres, normals] = [rows(found.center), rows(found.normal)];
        const areClosed = [a, b].every((side) => file(side.file).closed === true);
        const shared = sharedOf(first, second, pose, areClosed);
        const took = performance.now() - began;
        return {
            depth,
            centres,
            normals,
            patches: found.count.length,
            curves: Float64Array.from(curves),
            shared,
            took,
        };
    });
}

/** What a question visits, spread to triangles, with the treelets that were opened. */
export function visits(a: Side, b: Side, pose: Float64Array, question: string) {
    return withShapes(a, b, (first, second) => {
        const [numbers, ofA, ofB] = raw.visits(first._raw("a"), second._raw("b"), pose, question) as [
            Float64Array,
            [Uint32Array, Uint32Array],
            [Uint32Array, Uint32Array],
        ];
        const [nodeTests = 0, packetTests = 0, exactTests = 0, steps = 0] = numbers;
        const side = ({ file: number }: Side, [treelets, packets]: [Uint32Array, Uint32Array]) => ({
            // How often the packet of each triangle was tested, and how often the treelet that has the packet was opened.
            tested: file(number).spread(packets, "packets"),
            opened: file(number).spread(treelets, "treelets"),
            treelets,
            packets,
        });
        return { nodeTests, packetTests, exactTests, steps, a: side(a, ofA), b: side(b, ofB) };
    });
}

/** Asks about a motion. */
export function motion(a: Side, b: Side, numbers: Float64Array, clearance: number, tolerance: number | undefined) {
    return withShapes(a, b, (first, second) => {
        const path = Motion.between(numbers.slice(0, 12), numbers.slice(12, 24));
        const began = performance.now();
        const answer = first.motion(second, path, { clearance, tolerance });
        return { ...answer, took: performance.now() - began };
    });
}

/** The poses of a motion at some times. */
export function motionPoses(numbers: Float64Array, times: Float64Array): Float64Array {
    return Motion.between(numbers.slice(0, 12), numbers.slice(12, 24)).poses(times);
}

/** How many questions a second the library answers here, in poses around one: the mesh turns about its own centre. */
export function speed(a: Side, b: Side, pose: Float64Array) {
    return withShapes(a, b, (first, second) => {
        const around = file(b.file).centre;
        const [x = 0, y = 0, z = 0] = around;
        const count = 64;
        const turned = Array.from({ length: count }, (_, k) => {
            const half = (Math.PI * k) / count;
            const turn = poseOf([0, 0, 0], [0, 0, Math.sin(half), Math.cos(half)]);
            const at = (row: number) => (turn[row] ?? 0) * x + (turn[row + 1] ?? 0) * y + (turn[row + 2] ?? 0) * z;
            [3, 7, 11].forEach((place, axis) => {
                turn[place] = (around[axis] ?? 0) - at(4 * axis);
            });
            return turn;
        });
        const product = (p: Float64Array, q: Float64Array) =>
            Float64Array.from({ length: 12 }, (_, at) => {
                const [row, column] = [at - (at % 4), at % 4];
                const sum = [0, 1, 2].reduce((s, k) => s + (p[row + k] ?? 0) * (q[4 * k + column] ?? 0), 0);
                return column === 3 ? sum + (p[row + 3] ?? 0) : sum;
            });
        const poses = turned.map((turn) => product(pose, turn));
        const measure = (ask: (pose: Float64Array) => void) => {
            poses.forEach(ask);
            const began = performance.now();
            let asked = 0;
            while (performance.now() - began < 300) {
                poses.forEach(ask);
                asked += count;
            }
            return (1000 * asked) / (performance.now() - began);
        };
        return {
            distance: measure((at) => first.distance(second, at)),
            collide: measure((at) => first.collide(second, at)),
        };
    });
}

/** The pose of B in A's frame, from those of both in the world. */
export const between = (a: Float64Array, b: Float64Array): Float64Array => relative(a, b);
