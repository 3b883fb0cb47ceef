/** Where joint values put the frames of a robot: the poses of the robot library, but for roundings. */

import { Quaternion } from "three";
import type { ContentJoint } from "./content.js";
import { fromAxisAngle, fromQuaternion, identity, type Pose, placedAt, product } from "./pose.js";

type Four = [number, number, number, number];

const degrees = (radians: number): number => (180 * radians) / Math.PI;

/** The poses of all frames in the world: its own, then those that the joints move. */
export function framesOf(joints: ContentJoint[], values: number[]): Pose[] {
    const frames = [identity()];
    for (const joint of joints) {
        const parent = frames[joint.parent] ?? identity();
        frames.push(product(product(parent, Float64Array.from(joint.origin)), motionOf(joint, values)));
    }
    return frames;
}

/** The pose of what a joint moves, in the frame of the joint. */
function motionOf({ kind, axis, value, factor, offset }: ContentJoint, values: number[]): Pose {
    const [x = 0, y = 0, z = 0, ...quaternion] = values.slice(value, value + 7);
    const by = factor * x + offset;
    switch (kind) {
        case "turn":
            return fromAxisAngle(axis, degrees(by), [0, 0, 0]);
        case "slide":
            return placedAt(identity(), [by * axis[0], by * axis[1], by * axis[2]]);
        case "planar":
            return fromAxisAngle([0, 0, 1], degrees(z), [x, y, 0]);
        case "floating":
            return fromQuaternion(quaternion as Four, [x, y, z]);
    }
}

/** The joint values at a time from 0 to 1 of a straight motion. A quaternion turns about one axis, the shorter way. */
export function between(joints: ContentJoint[], start: number[], goal: number[], time: number): number[] {
    const values = start.map((from, k) => from + time * ((goal[k] ?? from) - from));
    for (const { kind, value } of joints) {
        if (kind === "floating") {
            const of = (all: number[]) => new Quaternion(...(all.slice(value + 3, value + 7) as Four)).normalize();
            values.splice(value + 3, 4, ...of(start).slerp(of(goal), time).toArray());
        }
    }
    return values;
}
