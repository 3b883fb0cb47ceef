/** The end of a `CbvhWorker` in the worker: holds meshes, scenes and motions by number, and calls what messages name. */

import { Mesh } from "./mesh.js";
import { init, memoryBytes, type ModuleSource, setTimeLimit } from "./module.js";
import { Motion } from "./motion.js";
import { nearestPose, pose, relative } from "./poses.js";
import type { Answer, Held, Port, Question } from "./remote.js";
import { Scene } from "./scene.js";
import * as shapes from "./shapes.js";

type Work = (...values: unknown[]) => unknown;

/** What messages may call that is no method of an object. */
const known: Record<string, unknown> = {
    "Mesh.open": Mesh.open,
    "Mesh.bake": Mesh.bake,
    "Mesh.bakeFile": Mesh.bakeFile,
    "Motion.between": Motion.between,
    "Motion.screw": Motion.screw,
    "Motion.through": Motion.through,
    "Scene.open": Scene.open,
    "Scene.make": () => new Scene(),
    ...shapes,
    memoryBytes,
    nearestPose,
    pose,
    relative,
    setTimeLimit,
};

/** The buffers of an answer, which are copies that nothing else here has. */
function buffers(value: unknown, found = new Set<ArrayBuffer>()): Set<ArrayBuffer> {
    if (ArrayBuffer.isView(value)) {
        found.add(value.buffer as ArrayBuffer);
    } else if (typeof value === "object" && value !== null) {
        for (const part of Object.values(value)) {
            buffers(part, found);
        }
    }
    return found;
}

/**
 * Answers the messages of a `CbvhWorker` at the other end of a port. A worker of this package does it by itself; call it in a worker of
 * your own, such as one of Node: `serve(workerData.port)`.
 */
export function serve(port: Port, start: (source?: ModuleSource) => Promise<void> = init): void {
    const held = new Map<number, Mesh | Scene | Motion>();
    let next = 1;

    /** An argument as it was meant. */
    const meant = (value: unknown): unknown => {
        if (value instanceof Map) {
            return new Map([...value].map(([key, of]) => [key, meant(of)]));
        }
        if (typeof value !== "object" || value === null || Object.getPrototypeOf(value) !== Object.prototype) {
            return value;
        }
        if ("cbvhHeld" in value) {
            const found = held.get(value.cbvhHeld as number);
            if (found === undefined) {
                throw new Error("expected an object in use, found one that was freed");
            }
            return found;
        }
        if ("cbvhCall" in value) {
            const call = value.cbvhCall as number;
            return (...values: unknown[]) => port.postMessage({ call, values } satisfies Answer);
        }
        return Object.fromEntries(Object.entries(value).map(([key, of]) => [key, meant(of)]));
    };

    const answer = ({ target, name, values }: Question): unknown => {
        if (name === "free") {
            const found = held.get(target);
            held.delete(target);
            return found instanceof Motion ? undefined : found?.free();
        }
        const of: unknown = target === 0 ? known : meant({ cbvhHeld: target });
        const member = (of as Record<string, unknown>)[name];
        return typeof member === "function"
            ? (member as Work).apply(target === 0 ? undefined : of, values.map(meant))
            : member;
    };

    const sent = (value: unknown): unknown => {
        for (const [kind, of] of Object.entries({ Mesh, Scene, Motion })) {
            if (value instanceof of) {
                held.set(next, value);
                return { cbvhHeld: next++, kind: kind as Held["kind"] } satisfies Held;
            }
        }
        return value;
    };

    port.addEventListener("message", async (event) => {
        const question = (event as MessageEvent<Question>).data;
        try {
            const value =
                question.name === "init"
                    ? await start(question.values[0] as ModuleSource | undefined)
                    : sent(answer(question));
            port.postMessage({ id: question.id, value } satisfies Answer, [...buffers(value)]);
        } catch (error) {
            const { name, message } = error instanceof Error ? error : new Error(String(error));
            port.postMessage({ id: question.id, error: { name, message } } satisfies Answer);
        }
    });
    port.start?.();
}
