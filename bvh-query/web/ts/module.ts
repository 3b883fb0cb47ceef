/** Loads the WebAssembly module, and guards every call of it. */

import { float } from "./arguments.js";
import start, * as raw from "./raw/cbvh.js";

export { raw };

/** Where the module comes from: its URL, a response with it, its bytes, or the compiled module. */
export type ModuleSource = string | URL | Response | BufferSource | WebAssembly.Module;

/** A module with a function that returns a vector. It is invalid where there is no SIMD. */
const SIMD_PROBE = new Uint8Array([
    0, 97, 115, 109, 1, 0, 0, 0, 1, 5, 1, 96, 0, 1, 123, 3, 2, 1, 0, 10, 8, 1, 6, 0, 65, 0, 253, 15, 11,
]);

let loading: Promise<void> | undefined;
let memory: WebAssembly.Memory | undefined;
let broken: Error | undefined;

function checkSupport(): void {
    if (typeof WebAssembly !== "object") {
        throw new Error("cbvh: expected WebAssembly, found none; is it switched off in this browser?");
    }
    if (!WebAssembly.validate(SIMD_PROBE)) {
        const since = "Chrome 91, Firefox 89, Safari 16.4 and Node 16.4 have it";
        throw new Error(`cbvh: expected WebAssembly with SIMD, found it without; ${since}`);
    }
}

async function load(source: ModuleSource): Promise<void> {
    checkSupport();
    if (typeof source === "string" || source instanceof URL) {
        const response = await fetch(source);
        if (!response.ok) {
            throw new Error(`cbvh: expected the module at ${response.url}, found status ${response.status}`);
        }
        source = response;
    }
    ({ memory } = await start({ module_or_path: source }));
}

/**
 * Loads the module. Everything else needs it: `await init()` first. Each page and each worker loads a module of its own.
 * Later calls do nothing.
 *
 * @param source The module; by default the file beside this package's code. A worker can be sent the compiled module, and a
 * page that is a single file can contain the bytes.
 * @throws If there is no WebAssembly with SIMD, or no module at the URL. It may then be called again.
 */
export function init(source: ModuleSource = new URL("./raw/cbvh_bg.wasm", import.meta.url)): Promise<void> {
    loading ??= load(source).catch((error: unknown) => {
        loading = undefined;
        throw error;
    });
    return loading;
}

/**
 * Loads the module from its bytes or from the compiled module, and blocks meanwhile. Some browsers refuse this outside
 * workers. Later calls do nothing.
 *
 * @throws If there is no WebAssembly with SIMD, or while `init` is loading the module.
 */
export function initSync(source: BufferSource | WebAssembly.Module): void {
    checkSupport();
    if (memory === undefined) {
        if (loading !== undefined) {
            // What `init` loads would replace this module, and with it the memory of all objects made meanwhile.
            throw new Error("cbvh: expected no init under way, found one; await it instead");
        }
        ({ memory } = raw.initSync({ module: source }));
        loading = Promise.resolve();
    }
}

/** Calls the module. A trap, as when memory runs out, may leave the module's memory in any state. Every later call is
 * therefore refused. */
export function call<T>(work: () => T): T {
    if (memory === undefined) {
        throw new Error("cbvh: expected a loaded module, found none; await init() first");
    }
    if (broken !== undefined) {
        throw broken;
    }
    try {
        return work();
    } catch (error) {
        if (error instanceof WebAssembly.RuntimeError) {
            const found = "found no more of it, or a defect of the library";
            broken = new Error(`cbvh: expected memory for the answer, ${found}; start again in a new worker or page`, {
                cause: error,
            });
            throw broken;
        }
        throw error;
    }
}

/** The number of bytes that the module's memory has at present, 0 before it is loaded. It grows, and never shrinks. */
export function memoryBytes(): number {
    return memory?.buffer.byteLength ?? 0;
}

/**
 * Limits the time of each call from now on, in this page or worker. The queries of a call that takes longer end, within a millisecond
 * or so, with an error that says that they were stopped. Bakes, `Mesh.openEdges` and `Mesh.validate` have no limit.
 *
 * @param milliseconds The most that a call may take, also one about N poses; by default there is no limit.
 */
export function setTimeLimit(milliseconds: number = Number.POSITIVE_INFINITY): void {
    const limit = float(milliseconds, "milliseconds");
    call(() => raw.setTimeLimit(limit));
}

/** The base class of objects that own something in the module's memory. */
export abstract class Handle<Raw extends { free(): void }> {
    #raw: Raw | undefined;
    readonly #kind: string;

    protected constructor(raw: Raw, kind: string) {
        this.#raw = raw;
        this.#kind = kind;
    }

    /** @internal */
    _raw(name: string): Raw {
        if (this.#raw === undefined) {
            throw new Error(`${name}: expected a ${this.#kind} in use, found one that was freed`);
        }
        return this.#raw;
    }

    /**
     * Frees the memory now. The memory of an object that is never freed returns when the engine collects the object, which
     * may be long after the last reference is gone. Freeing twice does nothing.
     */
    free(): void {
        const held = this.#raw;
        this.#raw = undefined;
        if (held !== undefined && broken === undefined) {
            call(() => held.free());
        }
    }

    /** Frees the memory at the end of a block: `using mesh = Mesh.open(bytes)`. */
    declare [Symbol.dispose]: () => void;
}

// Not all browsers have the symbol.
if (Symbol.dispose !== undefined) {
    Handle.prototype[Symbol.dispose] = Handle.prototype.free;
}
