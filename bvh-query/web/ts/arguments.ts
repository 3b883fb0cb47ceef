/** Converts arguments to the arrays that the module takes. The module decides which numbers are valid. */

/** Numbers, row after row: any array of numbers. A `Float64Array` is passed as it is, others are converted. */
export type Numbers =
    | Float64Array
    | Float32Array
    | Int8Array
    | Uint8Array
    | Int16Array
    | Uint16Array
    | Int32Array
    | Uint32Array
    | readonly number[];

/** Numbers of vertices or instances. */
export type Integers = Uint32Array | Uint16Array | Uint8Array | Int32Array | readonly number[];

/** The bytes of a file. */
export type Bytes = Uint8Array | ArrayBuffer;

/** What an argument is, in words. */
export function described(value: unknown): string {
    if (value === null || value === undefined) {
        return String(value);
    }
    if (typeof value !== "object") {
        return `a ${typeof value}`;
    }
    return value.constructor?.name ?? "an object";
}

function wrong(name: string, expected: string, found: string): TypeError {
    return new TypeError(`${name}: expected ${expected}, found ${found}`);
}

/** Reads a value whose memory may be gone: a buffer may have been sent to a worker, or made too short. */
function present<T>(read: () => T, name: string): T {
    try {
        return read();
    } catch {
        throw wrong(name, "an array with its memory", "one whose buffer was transferred or shrunk");
    }
}

/** Checks an array of numbers. */
function listed(value: unknown, name: string): ArrayLike<number> {
    if (Array.isArray(value)) {
        const place = value.findIndex((element) => typeof element !== "number");
        if (place >= 0) {
            throw wrong(`${name}[${place}]`, "a number", described(value[place]));
        }
        // It is complete: `findIndex` visits holes.
        return value as number[];
    }
    const isList = ArrayBuffer.isView(value) && !(value instanceof DataView);
    if (!isList || value instanceof BigInt64Array || value instanceof BigUint64Array) {
        throw wrong(name, "an array of numbers", described(value));
    }
    const list = value as Float64Array;
    present(() => list.values(), name);
    return list;
}

/** Reads an array of numbers. */
export function floats(value: Numbers, name: string): Float64Array {
    const list = listed(value, name);
    return list instanceof Float64Array ? list : Float64Array.from(list);
}

/** Reads an array of numbers from 0 to 2^32 - 1. */
export function integers(value: Integers, name: string): Uint32Array {
    const list = listed(value, name);
    if (list instanceof Uint32Array) {
        return list;
    }
    const integers = Uint32Array.from(list);
    for (let place = 0; place < integers.length; place++) {
        if (integers[place] !== list[place]) {
            throw wrong(`${name}[${place}]`, "a whole number from 0 to 2^32 - 1", String(list[place]));
        }
    }
    return integers;
}

function typed<T>(value: T, type: string, name: string): T {
    if (typeof value !== type) {
        throw wrong(name, `a ${type}`, described(value));
    }
    return value;
}

/** Reads one number. */
export const float = (value: number, name: string): number => typed(value, "number", name);

/** Reads a string. */
export const text = (value: string, name: string): string => typed(value, "string", name);

/** Reads a boolean. */
export const flag = (value: boolean, name: string): boolean => typed(value, "boolean", name);

/** Reads one number from 0 to 2^32 - 1. */
export function integer(value: number, name: string): number {
    if (float(value, name) >>> 0 !== value) {
        throw wrong(name, "a whole number from 0 to 2^32 - 1", String(value));
    }
    return value;
}

/** Reads the greatest number of something, which there need not be. */
export const most = (value: number | undefined, name: string): number =>
    value === undefined ? 2 ** 32 - 1 : integer(value, name);

/** Reads the bytes of a file. */
export function bytes(value: Bytes, name: string): Uint8Array {
    if (value instanceof Uint8Array) {
        present(() => value.values(), name);
        return value;
    }
    if (!(value instanceof ArrayBuffer)) {
        throw wrong(name, "a Uint8Array or an ArrayBuffer", described(value));
    }
    return present(() => new Uint8Array(value), name);
}

/** Reads an object of a class. `kind` is the name of the class, which bundlers may change. */
export function instance<T>(value: T, type: { prototype: T }, kind: string, name: string): T {
    if (!(value instanceof (type as unknown as new () => T))) {
        throw wrong(name, `a ${kind}`, described(value));
    }
    return value;
}
