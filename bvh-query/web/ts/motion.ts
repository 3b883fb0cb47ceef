/** Paths: motions between two poses, screws, and motions through many poses. */

import { float, floats, type Numbers } from "./arguments.js";
import { call, raw } from "./module.js";

const BETWEEN = 0;
const SCREW = 1;
const THROUGH = 2;

/** One path or N paths of a body, over times from 0 to 1. A `Motion` holds plain numbers, and need not be freed. */
export class Motion {
    /** The number of paths. */
    readonly count: number;

    private constructor(
        /** @internal */ readonly _kind: number,
        /** @internal */ readonly _numbers: Float64Array,
    ) {
        this.count = call(() => raw.pathCount(_kind, _numbers));
    }

    /**
     * Makes N motions that interpolate as planners do: the origin of the body's frame moves on a line, and the body turns
     * about one axis by the shorter angle, both at a constant rate.
     *
     * @param start N poses of 12 numbers.
     * @param end As many poses.
     * @throws For poses that are half a turn apart, to within 2e-9 radians.
     */
    static between(start: Numbers, end: Numbers): Motion {
        const [starts, ends] = [floats(start, "start"), floats(end, "end")];
        if (starts.length !== ends.length) {
            throw new TypeError(`end: expected as many numbers as start, ${starts.length}, found ${ends.length}`);
        }
        if (starts.length % 12 !== 0) {
            throw new TypeError(`start: expected 12 numbers for each, found ${starts.length} numbers in all`);
        }
        const both = new Float64Array(2 * starts.length);
        for (let place = 0; place < starts.length; place += 12) {
            both.set(starts.subarray(place, place + 12), 2 * place);
            both.set(ends.subarray(place, place + 12), 2 * place + 12);
        }
        return new Motion(BETWEEN, both);
    }

    /**
     * Makes a screw motion from a pose: a rotation by `angle` radians, which may be many turns, about the axis through
     * `point` in `direction` (of any length), and a shift by `shift` mesh units along the axis.
     */
    static screw(start: Numbers, point: Numbers, direction: Numbers, angle: number, shift = 0): Motion {
        const lengths: [Numbers, string, number][] = [
            [start, "start", 12],
            [point, "point", 3],
            [direction, "direction", 3],
        ];
        const parts = lengths.map(([value, name, length]) => {
            const part = floats(value, name);
            if (part.length !== length) {
                throw new TypeError(`${name}: expected ${length} numbers, found ${part.length}`);
            }
            return [...part];
        });
        const rest = [float(angle, "angle"), float(shift, "shift")];
        return new Motion(SCREW, Float64Array.from([...parts.flat(), ...rest]));
    }

    /** Makes a path through N poses, at least 2: {@link Motion.between} from each to the next, for equal times. */
    static through(poses: Numbers): Motion {
        return new Motion(THROUGH, Float64Array.from(floats(poses, "poses")));
    }

    /**
     * Returns the poses of the body at T times: T poses of 12 numbers or, for N paths, N times T. Times before 0 and NaN
     * count as 0, times after 1 as 1.
     */
    poses(times: Numbers): Float64Array {
        const array = floats(times, "times");
        return call(() => raw.pathPoses(this._kind, this._numbers, array));
    }
}

/** Checks that these are not several paths. */
export function onePath(motion: Motion, name: string): Motion {
    if (motion.count !== 1) {
        throw new TypeError(`${name}: expected one path, found ${motion.count}`);
    }
    return motion;
}
