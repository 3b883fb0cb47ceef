/** What tests expect, in browsers and Node alike. */

export function ok(condition, what) {
    if (!condition) {
        throw new Error(`expected ${what}`);
    }
}

/** Equal to the last bit: NaN is NaN, and 0 is not -0. */
export function equal(found, expected, what = "") {
    const [a, b] = [found, expected].map((value) => (ArrayBuffer.isView(value) ? [...value] : value));
    if (typeof a === "object" && typeof b === "object" && a !== null && b !== null) {
        const keys = new Set([...Object.keys(a), ...Object.keys(b)]);
        keys.forEach((key) => equal(a[key], b[key], `${what}.${key}`));
    } else if (!Object.is(a, b)) {
        throw new Error(`${what}: expected ${String(b)}, found ${String(a)}`);
    }
}

/** Returns the message of the error, which must be one that the package makes. */
export function refused(work) {
    let found;
    try {
        found = work();
    } catch (error) {
        ok(error instanceof Error && !(error instanceof WebAssembly.RuntimeError), `an Error, found ${error}`);
        ok(!/unreachable|null pointer|recursive|cbvh:/.test(error.message), `a clear message, found ${error.message}`);
        return error.message;
    }
    throw new Error(`expected an error, found ${JSON.stringify(found)}`);
}

/** Numbers that are the same in every run. */
export function random(seed) {
    let state = BigInt(seed);
    const next = () => {
        state = (state * 6364136223846793005n + 1442695040888963407n) & 0xffff_ffff_ffff_ffffn;
        return Number(state >> 33n) / 2 ** 31;
    };
    return {
        from: (low, high) => low + (high - low) * next(),
        below: (count) => Math.floor(count * next()),
        numbers: (count, low, high) => Float64Array.from({ length: count }, () => low + (high - low) * next()),
    };
}
