/**
 * Makes poses. A pose is rigid, and consists of twelve numbers: the rows of a rotation, each followed by a component of
 * the translation, in mesh units. N poses are 12 N numbers.
 */

import { floats, type Numbers } from "./arguments.js";
import { call, raw } from "./module.js";

/** The identity, as a pose. */
export const IDENTITY: readonly number[] = Object.freeze([1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0]);

/**
 * Makes poses from positions and quaternions.
 *
 * @param position N times 3 numbers, in mesh units.
 * @param quaternion N times 4 numbers x, y, z and w, of length 1 to within 2^-21; by default no rotation. This is the order
 * of three.js.
 */
export function pose(position: Numbers, quaternion?: Numbers): Float64Array {
    const positions = floats(position, "position");
    const turned = quaternion === undefined ? unturned(positions.length / 3) : floats(quaternion, "quaternion");
    return call(() => raw.posesOf(positions, turned));
}

function unturned(count: number): Float64Array {
    return Float64Array.from({ length: 4 * Math.floor(count) }, (_, place) => (place % 4 === 3 ? 1 : 0));
}

/**
 * Finds the poses nearest to rows that are nearly rigid, such as rounded ones or products of many. The result is rigid to
 * within 2^-40.
 *
 * @param rows N times 12 numbers: see {@link pose}.
 * @throws For reflections, scales, numbers that are not finite, and rows R that are not a rounded rotation: an entry of
 * R R^T - I exceeds 2^-6.
 */
export function nearestPose(rows: Numbers): Float64Array {
    const numbers = floats(rows, "rows");
    return call(() => raw.nearestPoses(numbers));
}

/** Makes the poses of B in A's frame from N poses of each in the world: the same bits as in scenes. */
export function relative(a: Numbers, b: Numbers): Float64Array {
    const [worldA, worldB] = [floats(a, "a"), floats(b, "b")];
    return call(() => raw.relativePoses(worldA, worldB));
}
