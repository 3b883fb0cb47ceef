/** What two meshes have in common, as triangles for the stage and as facts. */

import { ShapeUtils, Vector2 } from "three";
import type { Intersection, IntersectionSurface } from "../../ts/answers.js";
import { exact, fact, h, short } from "./dom.js";

/** A corner of a loop in the plane of its polygon, and its place among all points. */
class Corner extends Vector2 {
    constructor(
        x: number,
        y: number,
        readonly place: number,
    ) {
        super(x, y);
    }
}

/** The axes of the plane into which a loop is projected, so that it goes around counterclockwise there: those across the longest part of its
 * normal, which is the sum of the cross products of its edges. */
function axesAcross(points: Float64Array, first: number, count: number): [number, number] {
    const sums = [0, 0, 0];
    for (let k = 0; k < count; k++) {
        const [p, q] = [3 * (first + k), 3 * (first + ((k + 1) % count))];
        for (let axis = 0; axis < 3; axis++) {
            const [u, v] = [(axis + 1) % 3, (axis + 2) % 3];
            // From the first corner, so that little is lost where coordinates are large.
            const of = (place: number, along: number) =>
                (points[place + along] ?? 0) - (points[3 * first + along] ?? 0);
            sums[axis] = (sums[axis] ?? 0) + of(p, u) * of(q, v) - of(p, v) * of(q, u);
        }
    }
    const lengths = sums.map(Math.abs);
    const longest = lengths.indexOf(Math.max(...lengths));
    const [u, v] = [(longest + 1) % 3, (longest + 2) % 3];
    return (sums[longest] ?? 0) < 0 ? [v, u] : [u, v];
}

/** Divides polygons into triangles with the same outside: three places of points for each. */
export function trianglesOf({ points, loops, polygons }: IntersectionSurface): number[] {
    const triangles: number[] = [];
    let [loop, first] = [0, 0];
    for (const count of polygons) {
        if (count === 1 && loops[loop] === 3) {
            triangles.push(first, first + 1, first + 2);
            first += 3;
        } else {
            const [u, v] = axesAcross(points, first, loops[loop] ?? 0);
            const outlines: Corner[][] = [];
            for (const length of loops.subarray(loop, loop + count)) {
                const corner = (_: unknown, k: number) =>
                    new Corner(points[3 * (first + k) + u] ?? 0, points[3 * (first + k) + v] ?? 0, first + k);
                outlines.push(Array.from({ length }, corner));
                first += length;
            }
            const [outline = [], ...holes] = outlines;
            // This removes a last corner that equals the first one, so that corners are counted after it.
            const faces = ShapeUtils.triangulateShape(outline, holes);
            const corners = outlines.flat();
            triangles.push(...faces.flatMap((face) => face.map((k) => corners[k]?.place ?? 0)));
        }
        loop += count;
    }
    return triangles;
}

/** Facts about what two meshes have in common. */
export function sharedFacts({ volume, bounds, piercedA, piercedB }: Intersection): (HTMLElement | false)[] {
    const sides = bounds === undefined ? [] : [0, 1, 2].map((k) => (bounds[k + 3] ?? 0) - (bounds[k] ?? 0));
    return [
        fact("volume in both", exact(volume)),
        sides.length > 0 &&
            fact("its box", h("span", { class: "number", title: sides.join(" ") }, sides.map(short).join(" × "))),
        ...piercedFacts([piercedA, piercedB]),
    ];
}

/** Says how thick meshes are where they are pierced. */
export const piercedFacts = (pierced: readonly (number | null | undefined)[]): HTMLElement[] =>
    pierced.flatMap((thickness, k) =>
        typeof thickness === "number" ? [fact(`${k === 0 ? "A" : "B"} is pierced`, exact(thickness))] : [],
    );
