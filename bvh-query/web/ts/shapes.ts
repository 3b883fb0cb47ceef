/** Simple shapes: cores with a radius, solids and surfaces. Each is a `Mesh` at the origin of its frame. */

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

/** The faces of a box, counter-clockwise as seen from outside; bit 0 of a corner is its x, bit 1 its y, bit 2 its z. */
const BOX = [0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5, 0, 1, 5, 0, 5, 4, 2, 6, 7, 2, 7, 3, 0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6];

/** Makes a ball: a point with a radius. */
export function sphere(radius: number): Mesh {
    return rounded(Mesh.bake([0, 0, 0], [0, 0, 0]), radius);
}

/** Makes a capsule: a segment along z with a radius, its middle at the origin. */
export function capsule(radius: number, length: number): Mesh {
    const half = float(length, "length") / 2;
    if (!(half >= 0 && half < Number.POSITIVE_INFINITY)) {
        throw new RangeError(`length: expected a finite length of at least 0, found ${length}`);
    }
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
    const surface = Mesh.bake(corners, BOX);
    try {
        return rounded(surface.solid(), rounding);
    } finally {
        surface.free();
    }
}

/** How far a polyhedron around a circle may be larger, as a share of the radius, unless the caller says so. */
const ROUNDNESS = 0.002;

/** Makes a core solid, which is not needed afterwards. */
function solid(core: Mesh): Mesh {
    try {
        return core.solid();
    } finally {
        core.free();
    }
}

/** Makes a solid prism around a cylinder along z, its middle at the origin, at most `maxError` larger in mesh units. */
export function cylinder(radius: number, length: number, maxError = ROUNDNESS * radius): Mesh {
    const numbers = [float(radius, "radius"), float(length, "length"), float(maxError, "maxError")];
    return solid(Mesh.bakeShape("cylinder", numbers));
}

/** Makes a solid pyramid around a cone, its base at z = 0 and its apex at z = `height`: see `cylinder`. */
export function cone(radius: number, height: number, maxError = ROUNDNESS * radius): Mesh {
    return solid(Mesh.bakeShape("cone", [float(radius, "radius"), float(height, "height"), float(maxError, "maxError")]));
}

/** Makes the solid ground under z = 0: a box of these sides along x and y. Beyond its sides there is nothing. */
export function ground(sides: Numbers = [1000, 1000], thickness = 1): Mesh {
    const [x, y, ...more] = floats(sides, "sides");
    const lengths = [x as number, y as number, float(thickness, "thickness")];
    if (more.length > 0 || !lengths.every((length) => length > 0 && length < Number.POSITIVE_INFINITY)) {
        throw new RangeError(`sides: expected two finite lengths above 0, and such a thickness, found ${lengths}`);
    }
    const [right, back, down] = [lengths[0] as number / 2, lengths[1] as number / 2, -(lengths[2] as number)];
    const corners = Float64Array.from({ length: 24 }, (_, k) => {
        const upper = ((k / 3) >> k % 3) & 1;
        return [upper ? right : -right, upper ? back : -back, upper ? 0 : down][k % 3] as number;
    });
    return solid(Mesh.bake(corners, BOX));
}

/** Makes a surface over a grid of heights, row by row along y, each with `columns` columns along x, from the origin on.
 * `cell`: how far columns and rows are apart. */
export function heightField(heights: Numbers, columns: number, cell: Numbers): Mesh {
    const apart = floats(cell, "cell");
    if (apart.length !== 2 || !Number.isInteger(columns) || columns < 2) {
        throw new RangeError(`expected two or more columns and two sides of a cell, found ${columns} and ${apart}`);
    }
    return Mesh.bakeShape("heightField", [columns, ...apart], floats(heights, "heights"));
}
