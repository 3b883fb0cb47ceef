/** The worker: holds the WebAssembly module, and answers what the page asks. */

import { init, memoryBytes } from "../../ts/module.js";
import * as raw from "../../ts/raw/cbvh.js";
import * as files from "./files.js";
import * as pairs from "./pairs.js";
import { polyhedra, type Slabs } from "./polyhedra.js";
import * as scenes from "./scenes.js";

let tell: (stage: string) => void = () => {};

/** Reads base64. New browsers have a function for it, which takes a tenth of the time. */
function fromBase64(text: string): Uint8Array<ArrayBuffer> {
    const native = (Uint8Array as { fromBase64?: (text: string) => Uint8Array<ArrayBuffer> }).fromBase64;
    if (native !== undefined) {
        return native.call(Uint8Array, text);
    }
    const letters = atob(text);
    const bytes = new Uint8Array(letters.length);
    for (let place = 0; place < letters.length; place++) {
        bytes[place] = letters.charCodeAt(place);
    }
    return bytes;
}

/** Unpacks what is embedded in the page: base64 of gzip. */
async function unpack(text: string): Promise<Uint8Array> {
    const stream = new Blob([fromBase64(text)]).stream().pipeThrough(new DecompressionStream("gzip"));
    return new Uint8Array(await new Response(stream).arrayBuffer());
}

/** What the page can ask. */
const handlers = {
    start: async (module: ArrayBuffer) => {
        await init(module);
    },
    openEmbedded: async (name: string, packed: string) => files.add(name, await unpack(packed), tell),
    open: (name: string, bytes: ArrayBuffer) => files.add(name, new Uint8Array(bytes), tell),
    openPart: files.addPart,
    bytes: (file: number) => files.file(file).mesh.bytes(),
    triangles: (file: number) => files.file(file).triangles(),
    place: (file: number, triangle: number) => files.file(file).place(triangle),
    openEdges: (file: number) => files.file(file).mesh.openEdges(),
    validate: (file: number) => files.file(file).mesh.validate(),
    packets: (file: number) => files.file(file).packetNumbers(),

    near: pairs.near,
    deep: pairs.deep,
    visits: pairs.visits,
    motion: pairs.motion,
    motionPoses: pairs.motionPoses,
    speed: pairs.speed,
    between: pairs.between,

    contents: (file: number) => {
        const of = files.file(file);
        const [lengths, counts] = raw.levelCounts(of.raw) as [Uint32Array, Float64Array];
        return { ...of.sections(), objects: of.objects(), levelLengths: lengths, levelCounts: counts };
    },
    level: (file: number, level: number, most: number, slabs: Slabs) => {
        const of = files.file(file);
        const nodes = raw.levelNodes(of.raw, level, most) as Parameters<typeof polyhedra>[0];
        return polyhedra(nodes, of.centre, slabs, raw.directions());
    },

    firstHit: (file: number, origin: Float64Array, direction: Float64Array, pose?: Float64Array) => {
        const { mesh } = files.file(file);
        const hits = mesh.firstHits(origin, direction, { pose });
        return {
            hits,
            places: files.file(file).placesOf(hits.object, hits.triangle),
        };
    },
    points: (number: number, points: Float64Array, pose?: Float64Array) => {
        const { mesh, closed } = files.file(number);
        const sides = closed !== undefined ? mesh.sides(points, { pose }) : undefined;
        return { closest: mesh.closestPoints(points, { pose }), sides };
    },
    rays: (file: number, origins: Float64Array, directions: Float64Array, pose?: Float64Array) =>
        files.file(file).mesh.firstHits(origins, directions, { pose }),

    makeScene: scenes.make,
    frame: scenes.frame,
    sceneHit: scenes.hit,

    memory: () => memoryBytes(),
};

export type Handlers = typeof handlers;

/** What the page sends, and what comes back. */
export interface Question {
    number: number;
    name: keyof Handlers;
    parts: unknown[];
}
export type Reply =
    | { number: number; answer: unknown }
    | { number: number; error: string }
    | { number: number; stage: string };

/** Lists the buffers of an answer, which are sent without a copy. */
function buffers(value: unknown, found: Set<ArrayBuffer> = new Set()): Set<ArrayBuffer> {
    if (ArrayBuffer.isView(value)) {
        if (value.buffer instanceof ArrayBuffer) {
            found.add(value.buffer);
        }
    } else if (typeof value === "object" && value !== null) {
        Object.values(value).forEach((part) => {
            buffers(part, found);
        });
    }
    return found;
}

self.onmessage = async ({ data }: MessageEvent<Question>) => {
    const { number, name, parts } = data;
    const send = (reply: Reply, moved: Transferable[] = []) => self.postMessage(reply, { transfer: moved });
    tell = (stage) => send({ number, stage });
    try {
        const handler = handlers[name] as (...parts: unknown[]) => unknown;
        const answer = await handler(...parts);
        send({ number, answer }, [...buffers(answer)]);
    } catch (error) {
        send({ number, error: error instanceof Error ? error.message : String(error) });
    }
};
