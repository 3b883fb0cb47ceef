/**
 * Meshes and scenes that live in a worker, and whose queries answer with promises, so that a page never waits.
 *
 * Nothing is listed here: methods of `Mesh`, `Scene` and `Motion` are forwarded by name, and their types follow. `serve` is the
 * other end.
 */

import { Mesh } from "./mesh.js";
import type { ModuleSource, setTimeLimit } from "./module.js";
import { Motion } from "./motion.js";
import type { nearestPose, pose, relative } from "./poses.js";
import { Scene } from "./scene.js";
import type * as shapes from "./shapes.js";

/** A value as the page has it: a mesh, a scene or a motion is one that lives in the worker. */
export type Remote<T> = T extends Mesh
    ? RemoteMesh
    : T extends Scene
      ? RemoteScene
      : T extends Motion
        ? RemoteMotion
        : T extends ReadonlyMap<infer K, infer V>
          ? ReadonlyMap<K, Remote<V>>
          : T;

/** A method that answers later, or the promise of a property. */
export type Later<T> = T extends (...values: infer A) => infer R
    ? (...values: { [I in keyof A]: Remote<A[I]> }) => Promise<Remote<R>>
    : Promise<T>;

/** All methods and properties of a class, which answer later. */
export type AllLater<T> = { readonly [K in Exclude<keyof T, `_${string}` | symbol | "prototype">]: Later<T[K]> };

/** A {@link Mesh} in a worker. */
export interface RemoteMesh extends AllLater<Mesh> {}
/** A {@link Scene} in a worker. */
export interface RemoteScene extends AllLater<Scene> {}
/** A {@link Motion} in a worker. */
export interface RemoteMotion extends AllLater<Motion> {}

/** The functions of the package that make meshes and poses, which answer later. */
export type RemoteFunctions = AllLater<
    typeof shapes & {
        nearestPose: typeof nearestPose;
        pose: typeof pose;
        relative: typeof relative;
        memoryBytes: () => number;
        setTimeLimit: typeof setTimeLimit;
    }
>;

/** What carries messages: a worker, or a port of a `MessageChannel`. */
export type Port = Pick<MessagePort, "postMessage" | "addEventListener"> & { start?(): void };

/** @internal The message that asks. `target` is the number of what is asked; 0 for classes and functions. */
export interface Question {
    id: number;
    target: number;
    /** "init", "free", or the path of a function or a property. */
    name: string;
    values: unknown[];
}

/** @internal The message that answers, or calls a function of the page. */
export type Answer =
    | { id: number; value?: unknown; error?: { name: string; message: string } }
    | { call: number; values: unknown[] };

/** @internal What stands in messages for a mesh, a scene or a motion in the worker. */
export interface Held {
    cbvhHeld: number;
    kind: keyof typeof classes;
}

const classes = { Mesh, Scene, Motion };
const functions = ["box", "capsule", "cloud", "cone", "cylinder", "ground", "heightField", "sphere"];
functions.push("memoryBytes", "nearestPose", "pose", "relative", "setTimeLimit");

/** Tells a worker to free what the page no longer has. */
const unused = new FinalizationRegistry<() => void>((free) => free());

/** @internal What the page has of an object in a worker. */
class RemoteObject {
    constructor(
        readonly _worker: CbvhWorker,
        readonly _id: number,
    ) {
        unused.register(this, () => _worker._ask(_id, "free", []).catch(() => {}), this);
    }

    free(): Promise<void> {
        unused.unregister(this);
        return this._worker._ask(this._id, "free", []) as Promise<void>;
    }
}

function workerOfPackage(): Port {
    if (typeof Worker === "undefined") {
        throw new Error(
            "port: expected a port to a worker that calls `serve`, found none, and no class Worker to start one",
        );
    }
    return new Worker(new URL("./worker.js", import.meta.url), { type: "module" });
}

/** A class with the methods and properties of another one, which ask the worker. `fields`: properties that its objects have. */
function forwarding(of: { prototype: object }, fields: string[] = []): typeof RemoteObject {
    const made = class extends RemoteObject {};
    for (const name of fields) {
        Object.defineProperty(made.prototype, name, {
            get(this: RemoteObject) {
                return this._worker._ask(this._id, name, []);
            },
        });
    }
    for (let from = of.prototype; from !== Object.prototype; from = Object.getPrototypeOf(from)) {
        for (const [name, known] of Object.entries(Object.getOwnPropertyDescriptors(from))) {
            if (name.startsWith("_") || name === "constructor" || name in made.prototype) {
                continue;
            }
            const method = function (this: RemoteObject, ...values: unknown[]): Promise<unknown> {
                return this._worker._ask(this._id, name, values);
            };
            Object.defineProperty(made.prototype, name, known.get ? { get: method } : { value: method });
        }
    }
    return made;
}

const remotes = { Mesh: forwarding(Mesh), Scene: forwarding(Scene), Motion: forwarding(Motion, ["count"]) };

/**
 * A worker with a module of its own, and the package as seen from outside it: `worker.Mesh.bake(…)`, `worker.box(…)` and
 * `worker.Motion.between(…)` are those of the package, and return promises, as do all methods and properties of what they make.
 *
 * A worker answers one query after the other, in the order in which they were asked, and with the same bits as the package. For
 * more cores, start more workers, and send each of them the meshes (`await mesh.bytes()`). Arguments are copied to the worker;
 * answers are moved out of it.
 */
export class CbvhWorker {
    readonly Mesh: AllLater<Pick<typeof Mesh, "open" | "bake" | "bakeFile">>;
    readonly Motion: AllLater<Pick<typeof Motion, "between" | "screw" | "through">>;
    /** `make` makes an empty scene. */
    readonly Scene: AllLater<Pick<typeof Scene, "open">> & { make(): Promise<RemoteScene> };

    readonly #port: Port;
    readonly #waiting = new Map<
        number,
        { resolve(value: unknown): void; reject(error: Error): void; calls: number[] }
    >();
    readonly #calls = new Map<number, (...values: unknown[]) => void>();
    #next = 1;
    #ended: Error | undefined;

    private constructor(port: Port) {
        this.#port = port;
        port.addEventListener("message", (event) => this.#hear((event as MessageEvent<Answer>).data));
        const failed = (event: Event): void => {
            const found = (event as ErrorEvent).message ?? event.type;
            this.#end(new Error(`cbvh: expected a worker that answers, found an error: ${found}`));
        };
        port.addEventListener("messageerror", failed);
        (port as Worker).addEventListener("error", failed);
        port.start?.();
        const asking =
            (name: string) =>
            (...values: unknown[]) =>
                this._ask(0, name, values);
        const group = (of: string, names: string[]) =>
            Object.fromEntries(names.map((name) => [name, asking(`${of}.${name}`)]));
        this.Mesh = group("Mesh", ["open", "bake", "bakeFile"]) as never;
        this.Motion = group("Motion", ["between", "screw", "through"]) as never;
        this.Scene = group("Scene", ["open", "make"]) as never;
        Object.assign(this, Object.fromEntries(functions.map((name) => [name, asking(name)])));
    }

    /**
     * Starts a worker, and resolves when it has loaded the module.
     *
     * @param source The module, as for `init`; by default the file beside this package's code.
     * @param port The worker, or a port that leads to one; it must call `serve`. By default a `Worker` of this package's `worker.js`.
     * @throws If the worker cannot be started, or for the reasons of `init`.
     */
    static async start(
        source?: Exclude<ModuleSource, Response>,
        port: Port = workerOfPackage(),
    ): Promise<CbvhWorker & RemoteFunctions> {
        const worker = new CbvhWorker(port);
        // The worker's own address is another one, and an object of class URL cannot be sent.
        const isAddress = typeof source === "string" || source instanceof URL;
        try {
            await worker._ask(0, "init", [isAddress ? new URL(source, globalThis.location?.href).href : source]);
        } catch (error) {
            worker.terminate();
            throw error;
        }
        return worker as CbvhWorker & RemoteFunctions;
    }

    /** Ends the worker at once, in the middle of a query, too. All its memory is freed, and queries without an answer fail. */
    terminate(): void {
        this.#end(new Error("cbvh: expected a worker in use, found one that was terminated"));
    }

    #end(error: Error): void {
        this.#ended ??= error;
        const port = this.#port as Partial<Worker & MessagePort>;
        (port.terminate ?? port.close)?.call(port);
        for (const { reject } of this.#waiting.values()) {
            reject(this.#ended);
        }
        this.#waiting.clear();
        this.#calls.clear();
    }

    /** @internal */
    _ask(target: number, name: string, values: unknown[]): Promise<unknown> {
        if (this.#ended !== undefined) {
            return Promise.reject(this.#ended);
        }
        return new Promise((resolve, reject) => {
            const id = this.#next++;
            const calls: number[] = [];
            const question: Question = { id, target, name, values: values.map((value) => this.#sent(value, calls)) };
            // Throws if a value cannot be sent, which rejects.
            this.#port.postMessage(question);
            this.#waiting.set(id, { resolve, reject, calls });
        });
    }

    /** An argument as it is sent. The numbers of functions are added to `calls`. */
    #sent(value: unknown, calls: number[]): unknown {
        if (value instanceof RemoteObject) {
            if (value._worker !== this) {
                throw new TypeError("expected an object of this worker, found one of another worker");
            }
            return { cbvhHeld: value._id };
        }
        if (typeof value === "function") {
            const number = this.#next++;
            calls.push(number);
            this.#calls.set(number, value as () => void);
            return { cbvhCall: number };
        }
        if (value instanceof Map) {
            return new Map([...value].map(([key, of]) => [key, this.#sent(of, calls)]));
        }
        if (typeof value === "object" && value !== null && Object.getPrototypeOf(value) === Object.prototype) {
            return Object.fromEntries(Object.entries(value).map(([key, of]) => [key, this.#sent(of, calls)]));
        }
        return value;
    }

    #hear(answer: Answer): void {
        if ("call" in answer) {
            this.#calls.get(answer.call)?.(...answer.values);
            return;
        }
        const waiting = this.#waiting.get(answer.id);
        this.#waiting.delete(answer.id);
        for (const number of waiting?.calls ?? []) {
            this.#calls.delete(number);
        }
        if (answer.error !== undefined) {
            const kinds: Record<string, ErrorConstructor> = { TypeError, RangeError };
            waiting?.reject(new (kinds[answer.error.name] ?? Error)(answer.error.message));
            return;
        }
        const held = answer.value as Held | null | undefined;
        const isHeld = typeof held === "object" && held !== null && "cbvhHeld" in held;
        waiting?.resolve(isHeld ? new remotes[held.kind](this, held.cbvhHeld) : answer.value);
    }
}
