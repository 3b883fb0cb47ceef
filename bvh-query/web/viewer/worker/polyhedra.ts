/** Makes polyhedra from the slabs of nodes: half-spaces cut a box, one after the other. */

/** How many numbers a node has: the lower ends of 13 slabs, the upper ends, a direction of its own, and both ends there. */
export const NODE_NUMBERS = 31;

type Point = [number, number, number];

/** A face of a polyhedron: its corners, counterclockwise from outside, and whether a turning slab made it. */
interface Face {
    corners: Point[];
    turning: boolean;
}

const dot = (a: readonly number[], b: readonly number[]) =>
    (a[0] ?? 0) * (b[0] ?? 0) + (a[1] ?? 0) * (b[1] ?? 0) + (a[2] ?? 0) * (b[2] ?? 0);

function box(node: Float32Array): Face[] {
    const end = (axis: number, upper: number) => node[13 * upper + axis] ?? 0;
    const faces: Face[] = [];
    for (let axis = 0; axis < 3; axis++) {
        const [u, v] = [(axis + 1) % 3, (axis + 2) % 3];
        for (let side = 0; side < 2; side++) {
            const corner = (first: number, second: number) => {
                const point: Point = [0, 0, 0];
                point[axis] = end(axis, side);
                point[u] = end(u, first);
                point[v] = end(v, second);
                return point;
            };
            const around = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
            faces.push({ corners: side === 1 ? around : around.reverse(), turning: false });
        }
    }
    return faces;
}

/** Cuts a polyhedron: what is left has `dot(normal, point) <= limit`. */
function cut(faces: Face[], normal: readonly number[], limit: number, tolerance: number, turning: boolean): Face[] {
    const height = (point: Point) => dot(normal, point) - limit;
    if (faces.every((face) => face.corners.every((corner) => height(corner) <= tolerance))) {
        return faces;
    }
    const left: Face[] = [];
    const rim: Point[] = [];
    for (const face of faces) {
        const corners: Point[] = [];
        face.corners.forEach((corner, place) => {
            const next = face.corners[(place + 1) % face.corners.length] ?? corner;
            const [here, there] = [height(corner), height(next)];
            if (here <= tolerance) {
                corners.push(corner);
                if (here >= -tolerance) {
                    rim.push(corner);
                }
            }
            if ((here < -tolerance && there > tolerance) || (here > tolerance && there < -tolerance)) {
                const share = here / (here - there);
                const at = corner.map((value, axis) => value + share * ((next[axis] ?? 0) - value)) as Point;
                corners.push(at);
                rim.push(at);
            }
        });
        if (corners.length >= 3) {
            left.push({ corners, turning: face.turning });
        }
    }
    const cap = around(rim, normal, tolerance);
    if (cap.length >= 3) {
        left.push({ corners: cap, turning });
    }
    return left;
}

/** Orders the corners of a convex polygon counterclockwise around a normal, and removes equal ones. */
function around(points: Point[], normal: readonly number[], tolerance: number): Point[] {
    if (points.length < 3) {
        return [];
    }
    const centre = [0, 1, 2].map((axis) => points.reduce((sum, p) => sum + (p[axis] ?? 0), 0) / points.length);
    const [x = 0, y = 0, z = 0] = normal;
    const least = Math.abs(x) <= Math.abs(y) && Math.abs(x) <= Math.abs(z) ? 0 : Math.abs(y) <= Math.abs(z) ? 1 : 2;
    const axis = [0, 1, 2].map((k) => (k === least ? 1 : 0));
    const u = cross(axis, normal);
    const v = cross(normal, u);
    const angle = (p: Point) => {
        const offset = p.map((value, k) => value - (centre[k] ?? 0));
        return Math.atan2(dot(v, offset) / Math.sqrt(dot(v, v)), dot(u, offset) / Math.sqrt(dot(u, u)));
    };
    const sorted = points.map((point) => ({ point, angle: angle(point) })).sort((a, b) => a.angle - b.angle);
    const near = (a: Point, b: Point) => a.every((value, k) => Math.abs(value - (b[k] ?? 0)) <= 4 * tolerance);
    const kept: Point[] = [];
    for (const { point } of sorted) {
        const last = kept[kept.length - 1];
        if (last === undefined || !near(last, point)) {
            kept.push(point);
        }
    }
    const [first, last] = [kept[0], kept[kept.length - 1]];
    if (kept.length > 1 && first !== undefined && last !== undefined && near(first, last)) {
        kept.pop();
    }
    return kept;
}

function cross(a: readonly number[], b: readonly number[]): Point {
    const [a0 = 0, a1 = 0, a2 = 0] = a;
    const [b0 = 0, b1 = 0, b2 = 0] = b;
    return [a1 * b2 - a2 * b1, a2 * b0 - a0 * b2, a0 * b1 - a1 * b0];
}

/** Which slabs bound a polyhedron. */
export type Slabs = "boxes" | "fixed" | "all";

function polyhedron(node: Float32Array, slabs: Slabs, directions: Float64Array): Face[] {
    let faces = box(node);
    if (slabs === "boxes") {
        return faces;
    }
    const size = Math.max(...[0, 1, 2].map((axis) => (node[13 + axis] ?? 0) - (node[axis] ?? 0)));
    // Ends of slabs are f32, whose steps are 2^-24 of the size: corners that are nearer than some of these are one.
    const tolerance = size * 2 ** -20;
    for (let slab = 3; slab < 13; slab++) {
        const [lo = 0, hi = 0] = [node[slab], node[13 + slab]];
        const direction = Array.from(directions.subarray(3 * slab, 3 * slab + 3));
        if (Number.isFinite(lo)) {
            faces = cut(faces, direction, hi, tolerance, false);
            const opposite = direction.map((component) => -component);
            faces = cut(faces, opposite, -lo, tolerance, false);
        }
    }
    const [x = 0, y = 0, z = 0, lo = 0, hi = 0] = node.subarray(26, 31);
    if (slabs === "all" && (x !== 0 || y !== 0 || z !== 0)) {
        faces = cut(faces, [x, y, z], hi, tolerance, true);
        faces = cut(faces, [-x, -y, -z], -lo, tolerance, true);
    }
    return faces;
}

/** The polyhedra of nodes, as triangles and as edges, less a centre. */
export interface Polyhedra {
    count: number;
    /** Three corners for each triangle. */
    positions: Float32Array;
    /** 1 for each corner on a face that a turning slab made. */
    turning: Uint8Array;
    /** Two ends for each edge. */
    edges: Float32Array;
    /** The number of corners of triangles before each node, and that of all. */
    starts: Uint32Array;
    /** The same of ends of edges. */
    edgeStarts: Uint32Array;
    /** Page, and slot or packet, of each node. */
    places: Uint32Array;
    /** The number of triangles of each packet, 0 for inner nodes. */
    triangles: Uint8Array;
}

/**
 * Makes the polyhedra of nodes, whose numbers are relative to the origins of their objects.
 *
 * @param directions The fixed directions of the format, three numbers for each.
 */
export function polyhedra(
    [numbers, objects, places, triangles, origins]: [Float32Array, Uint32Array, Uint32Array, Uint8Array, Float64Array],
    centre: Float64Array,
    slabs: Slabs,
    directions: Float64Array,
): Polyhedra {
    const [positions, turning, edges]: [number[], number[], number[]] = [[], [], []];
    const [starts, edgeStarts] = [new Uint32Array(objects.length + 1), new Uint32Array(objects.length + 1)];
    for (let k = 0; k < objects.length; k++) {
        const shift = [0, 1, 2].map((axis) => (origins[3 * (objects[k] ?? 0) + axis] ?? 0) - (centre[axis] ?? 0));
        for (const face of polyhedron(numbers.subarray(NODE_NUMBERS * k, NODE_NUMBERS * (k + 1)), slabs, directions)) {
            const corners = face.corners.map((corner) => corner.map((value, axis) => value + (shift[axis] ?? 0)));
            const count = corners.length;
            for (let place = 0; place < count; place++) {
                const [here, next] = [corners[place] ?? [], corners[(place + 1) % count] ?? []];
                // Two faces share an edge, in opposite directions: one of them draws it.
                if (here.reduce((order, value, axis) => order || value - (next[axis] ?? 0), 0) < 0) {
                    edges.push(...here, ...next);
                }
                if (place > 0 && place + 1 < count) {
                    positions.push(...(corners[0] ?? []), ...here, ...next);
                    turning.push(...Array<number>(3).fill(face.turning ? 1 : 0));
                }
            }
        }
        starts[k + 1] = positions.length / 3;
        edgeStarts[k + 1] = edges.length / 3;
    }
    return {
        count: objects.length,
        positions: Float32Array.from(positions),
        turning: Uint8Array.from(turning),
        edges: Float32Array.from(edges),
        starts,
        edgeStarts,
        places,
        triangles,
    };
}
