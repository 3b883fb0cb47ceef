/** Poses: rows of a rotation, each followed by a component of the translation. */

export type Pose = Float64Array;
export type Point = readonly [number, number, number];

export const identity = (): Pose => Float64Array.of(1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0);

const at = (numbers: ArrayLike<number>, place: number) => numbers[place] ?? 0;

/** Turns a vector, without the translation. */
export const turn = (pose: Pose, v: ArrayLike<number>): Point =>
    [0, 4, 8].map(
        (row) => at(pose, row) * at(v, 0) + at(pose, row + 1) * at(v, 1) + at(pose, row + 2) * at(v, 2),
    ) as unknown as Point;

/** Moves a point. */
export function move(pose: Pose, p: ArrayLike<number>): Point {
    const [x, y, z] = turn(pose, p);
    return [x + at(pose, 3), y + at(pose, 7), z + at(pose, 11)];
}

/** The product: first `second`, then `first`. */
export function product(first: Pose, second: Pose): Pose {
    const made = new Float64Array(12);
    for (const row of [0, 4, 8]) {
        for (let column = 0; column < 4; column++) {
            let sum = column === 3 ? at(first, row + 3) : 0;
            for (let k = 0; k < 3; k++) {
                sum += at(first, row + k) * at(second, 4 * k + column);
            }
            made[row + column] = sum;
        }
    }
    return made;
}

export const position = (pose: Pose): Point => [at(pose, 3), at(pose, 7), at(pose, 11)];

/** The same rotation at another position. */
export function placedAt(pose: Pose, [x, y, z]: Point): Pose {
    const made = pose.slice();
    [made[3], made[7], made[11]] = [x, y, z];
    return made;
}

/** Makes the rotation of a quaternion x, y, z, w of about length 1. */
export function fromQuaternion(quaternion: readonly [number, number, number, number], [px, py, pz]: Point): Pose {
    const length = Math.hypot(...quaternion) || 1;
    const [x, y, z, w] = quaternion.map((value) => value / length) as [number, number, number, number];
    return Float64Array.of(
        ...[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w), px],
        ...[2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w), py],
        ...[2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y), pz],
    );
}

/** The quaternion of a rotation: x, y, z, w, with w at least 0. */
export function toQuaternion(pose: Pose): [number, number, number, number] {
    const m = (row: number, column: number) => at(pose, 4 * row + column);
    const [xx, yy, zz] = [m(0, 0), m(1, 1), m(2, 2)];
    // The largest component is computed first, so that no small one is divided by.
    const squares = [1 + xx - yy - zz, 1 - xx + yy - zz, 1 - xx - yy + zz, 1 + xx + yy + zz];
    const largest = squares.indexOf(Math.max(...squares));
    const double = Math.sqrt(squares[largest] ?? 1);
    const mixed = [
        [double * double, m(0, 1) + m(1, 0), m(0, 2) + m(2, 0), m(2, 1) - m(1, 2)],
        [m(0, 1) + m(1, 0), double * double, m(1, 2) + m(2, 1), m(0, 2) - m(2, 0)],
        [m(0, 2) + m(2, 0), m(1, 2) + m(2, 1), double * double, m(1, 0) - m(0, 1)],
        [m(2, 1) - m(1, 2), m(0, 2) - m(2, 0), m(1, 0) - m(0, 1), double * double],
    ];
    const found = (mixed[largest] ?? [0, 0, 0, 1]).map((value) => value / (2 * double));
    const sign = (found[3] ?? 1) < 0 ? -1 : 1;
    return found.map((value) => sign * value) as [number, number, number, number];
}

/** The axis and the angle of a rotation, in degrees from 0 to 180. */
export function axisAngle(pose: Pose): { axis: Point; angle: number } {
    const [x, y, z, w] = toQuaternion(pose);
    const sine = Math.hypot(x, y, z);
    if (sine < 1e-12) {
        return { axis: [0, 0, 1], angle: 0 };
    }
    return { axis: [x / sine, y / sine, z / sine], angle: (2 * Math.atan2(sine, w) * 180) / Math.PI };
}

/** The rotation about an axis of any length by an angle in degrees. */
export function fromAxisAngle(axis: ArrayLike<number>, degrees: number, at3: Point): Pose {
    const length = Math.hypot(at(axis, 0), at(axis, 1), at(axis, 2));
    const half = (degrees * Math.PI) / 360;
    const scale = length > 0 ? Math.sin(half) / length : 0;
    const [x, y, z] = [at(axis, 0) * scale, at(axis, 1) * scale, at(axis, 2) * scale];
    return fromQuaternion([x, y, z, length > 0 ? Math.cos(half) : 1], at3);
}

/** Writes numbers so that they parse back to the same bits. */
export const words = (numbers: ArrayLike<number>): string => Array.from(numbers, String).join(" ");

/** Reads numbers that are separated by spaces, commas or line ends. */
export const numbersOf = (text: string): number[] =>
    text
        .split(/[\s,;]+/)
        .filter((word) => word !== "")
        .map(Number);
