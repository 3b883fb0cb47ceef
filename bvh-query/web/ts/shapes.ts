/** Simple shapes: cores with a radius, and boxes. Each is a `Mesh` at the origin of its frame. */

import { float, floats, type Numbers } from "./arguments.js";
import { Mesh } from "./mesh.js";

/** Rounds a core, which is not needed afterwards. */
function rounded(core: Mesh, radius: number): Mesh {
    try {
        return core.rounded(radius);
    } finally {
        core.free();
    }
}

/** Makes a ball: a point with a radius. */
export function sphere(radius: number): Mesh {
    return rounded(Mesh.bake([0, 0, 0], [0, 0, 0]), radius);
}

/** Makes a capsule: a segment along z with a radius, its middle at the origin. */
export function capsule(radius: number, length: number): Mesh {
    const half = float(length, "length") / 2;
    return rounded(Mesh.bake([0, 0, -half, 0, 0, half], [0, 1, 1]), radius);
}

/** Makes a ball of this radius around each point. Triangle `i` of answers is point `i`. */
export function cloud(points: Numbers, radius = 0): Mesh {
    const numbers = floats(points, "points");
    const faces = Uint32Array.from(numbers, (_, corner) => Math.floor(corner / 3));
    return rounded(Mesh.bake(numbers, faces), radius);
}

/** Makes a solid box, its middle at the origin, with edges and corners of this radius within its sides. */
export function box(sides: Numbers, rounding = 0): Mesh {
    const numbers = floats(sides, "sides");
    const half = numbers.map((side) => side / 2 - float(rounding, "rounding"));
    if (half.length !== 3 || !half.every((length) => length > 0 && length < Number.POSITIVE_INFINITY)) {
        throw new RangeError(`sides: expected three finite lengths above 0 and twice the rounding, found ${numbers}`);
    }
    const corners = Float64Array.from({ length: 24 }, (_, k) => {
        const axis = k % 3;
        return (((k / 3) >> axis) & 1 ? 1 : -1) * (half[axis] as number);
    });
    // Counter-clockwise as seen from outside; bit 0 of a corner is its x, bit 1 its y, bit 2 its z.
    const faces = [
        0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5, 0, 1, 5, 0, 5, 4, 2, 6, 7, 2, 7, 3, 0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6,
    ];
    const surface = Mesh.bake(corners, faces);
    try {
        return rounded(surface.solid(), rounding);
    } finally {
        surface.free();
    }
}
