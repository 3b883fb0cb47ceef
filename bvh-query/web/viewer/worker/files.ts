/** The files that the worker holds: their meshes, and where their triangles are drawn. */

import { Mesh } from "../../ts/mesh.js";
import * as raw from "../../ts/raw/cbvh.js";

/** More triangles than this are drawn as boxes of the tree. */
const MAX_DRAWN_TRIANGLES = 2_500_000;

/** What the page knows of a file before it draws it. */
export interface FileSummary {
    number: number;
    name: string;
    bytes: number;
    triangles: number;
    /** The lower and the upper corner of the box. */
    bounds: Float64Array;
    /** The names of the objects. */
    objects: string[];
    /** The radius of the shape. */
    radius: number;
    solid: boolean;
    /** Whether all objects are closed; `undefined` if the file does not say so. */
    closed: boolean | undefined;
    /** Whether there are few enough triangles to draw each of them. */
    drawn: boolean;
}

/** The triangles of a file as they are drawn: in the order of the file, less the centre. */
export interface Triangles {
    centre: Float64Array;
    positions: Float32Array;
    /** The number of the triangles before each page, and that of all. */
    pageStarts: Uint32Array;
}

/** Where a triangle is stored. */
export interface Place {
    object: number;
    id: number;
    page: number;
    packet: number;
}

/** An open file. */
export class LoadedFile {
    readonly centre: Float64Array;
    #ids: Uint32Array | undefined;
    #packets: Uint16Array = new Uint16Array();
    #slots: Uint8Array = new Uint8Array();
    #pageStarts: Uint32Array = new Uint32Array();
    #duplicates: Uint32Array = new Uint32Array();
    /** The place of each id in the drawn order, plus one; one list for each object if the file has no ids. */
    #places: Uint32Array[] | undefined;
    /** Whether all objects of the mesh are closed; `undefined` if the file does not say so. */
    readonly closed: boolean | undefined;
    /** The page of the file at which the mesh begins. */
    readonly #firstPage: number;

    constructor(
        readonly number: number,
        readonly name: string,
        readonly mesh: Mesh,
    ) {
        const [x0 = 0, y0 = 0, z0 = 0, x1 = 0, y1 = 0, z1 = 0] = mesh.bounds;
        this.centre = Float64Array.of((x0 + x1) / 2, (y0 + y1) / 2, (z0 + z1) / 2);
        const [first = 0, end = 0] = raw.objectNumbers(this.raw) as Uint32Array;
        const objects = this.objects().slice(first, end);
        const closed = objects.map((object) => object.closed);
        this.closed = closed.includes(undefined) ? undefined : closed.every((one) => one === true);
        this.#firstPage = objects[0]?.firstPage ?? 0;
    }

    get raw(): raw.Mesh {
        return this.mesh._raw("mesh");
    }

    summary(): FileSummary {
        const { number, name, mesh } = this;
        return {
            number,
            name,
            bytes: mesh.byteLength,
            triangles: mesh.triangleCount,
            bounds: mesh.bounds,
            objects: mesh.names,
            radius: mesh.radius,
            solid: mesh.isSolid,
            closed: this.closed,
            drawn: mesh.triangleCount <= MAX_DRAWN_TRIANGLES,
        };
    }

    /** All objects of the file, as it states them. */
    objects() {
        const [profiles, encodings, numbers] = raw.objects(this.raw) as [string[], string[], Float64Array];
        const { names } = this.mesh;
        return profiles.map((profile, object) => {
            const of = (place: number) => numbers[10 * object + place] ?? 0;
            const closed = of(9);
            return {
                name: names[object] ?? "",
                profile,
                encoding: encodings[object] ?? "",
                inputTriangles: of(0),
                triangles: of(1),
                degenerate: of(2),
                duplicates: of(3),
                treelets: of(4),
                packets: of(5),
                pages: of(6),
                firstPage: of(7),
                slabs: of(8),
                closed: closed < 0 ? undefined : closed === 1,
            };
        });
    }

    /** The sections of the file, with the version of the format. */
    sections() {
        const [version, headerBytes, names, starts, lengths] = raw.sections(this.raw) as [
            string,
            number,
            string[],
            Float64Array,
            Float64Array,
        ];
        const sections = names.map((name, k) => ({ name, start: starts[k] ?? 0, bytes: lengths[k] ?? 0 }));
        return { version, headerBytes, sections };
    }

    /** Reads and checks all triangles. */
    triangles(): Triangles {
        const { centre } = this;
        const [x = 0, y = 0, z = 0] = centre;
        const [positions, ids, packets, slots, pageStarts, duplicates] = raw.storedTriangles(this.raw, x, y, z) as [
            Float32Array,
            Uint32Array,
            Uint16Array,
            Uint8Array,
            Uint32Array,
            Uint32Array,
        ];
        this.#ids = ids;
        this.#packets = packets;
        this.#slots = slots;
        this.#pageStarts = pageStarts;
        this.#duplicates = duplicates;
        this.#places = undefined;
        return { centre: centre.slice(), positions, pageStarts: pageStarts.slice() };
    }

    /** Where triangles are in the drawn order, given their objects and ids; those that are not drawn are left out. */
    placesOf(objects: ArrayLike<number>, ids: ArrayLike<number>): Uint32Array {
        if (this.#ids === undefined) {
            return new Uint32Array();
        }
        this.#places ??= this.#listPlaces(this.#ids);
        const found = new Set<number>();
        for (let k = 0; k < ids.length; k++) {
            const list = this.#places[this.#places.length > 1 ? (objects[k] ?? 0) : 0];
            const place = list?.[ids[k] ?? 0] ?? 0;
            if (place > 0) {
                found.add(place - 1);
            }
        }
        return Uint32Array.from(found);
    }

    #listPlaces(ids: Uint32Array): Uint32Array[] {
        const list = (start: number, end: number, more: Uint32Array) => {
            let most = 0;
            for (let k = start; k < end; k++) {
                most = Math.max(most, ids[k] ?? 0);
            }
            for (let k = 1; k < more.length; k += 2) {
                most = Math.max(most, more[k] ?? 0);
            }
            const places = new Uint32Array(most + 1);
            for (let k = start; k < end; k++) {
                places[ids[k] ?? 0] = k + 1;
            }
            for (let k = 0; k < more.length; k += 2) {
                places[more[k + 1] ?? 0] = places[more[k] ?? 0] ?? 0;
            }
            return places;
        };
        const hasIds = this.sections().sections.some((section) => section.name === "ids");
        if (hasIds) {
            return [list(0, ids.length, this.#duplicates)];
        }
        return this.objects().map(({ firstPage, pages }) =>
            list(this.#startOf(firstPage), this.#startOf(firstPage + pages), new Uint32Array()),
        );
    }

    /** The number of drawn triangles before a page of the file. */
    #startOf(page: number): number {
        const last = this.#pageStarts.length - 1;
        return this.#pageStarts[Math.min(Math.max(page - this.#firstPage, 0), last)] ?? 0;
    }

    /** The page of a drawn triangle. */
    #pageOf(place: number): number {
        let [low, high] = [0, this.#pageStarts.length - 1];
        while (high - low > 1) {
            const middle = (low + high) >> 1;
            if ((this.#pageStarts[middle] ?? 0) <= place) {
                low = middle;
            } else {
                high = middle;
            }
        }
        return this.#firstPage + low;
    }

    /** Says where a drawn triangle is stored. */
    place(place: number): Place {
        const page = this.#pageOf(place);
        const objects = this.objects();
        const object = objects.findIndex(({ firstPage, pages }) => page >= firstPage && page < firstPage + pages);
        return {
            object,
            id: this.#ids?.[place] ?? 0,
            page,
            packet: this.#packets[place] ?? 0,
        };
    }

    /**
     * Spreads counts to the triangles in the drawn order.
     *
     * @param rows Rows of page, number and count.
     * @param of What the numbers are: those of packets, or the slots of the treelets that have the packets.
     */
    spread(rows: Uint32Array, of: "packets" | "treelets"): Uint32Array {
        const numbers = of === "packets" ? this.#packets : this.#slots;
        const counts = new Uint32Array(numbers.length);
        for (let k = 0; k < rows.length; k += 3) {
            const [page = 0, number = 0, count = 0] = rows.subarray(k, k + 3);
            const end = this.#startOf(page + 1);
            for (let at = this.#startOf(page); at < end; at++) {
                if (numbers[at] === number) {
                    counts[at] = count;
                }
            }
        }
        return counts;
    }

    /** The number of each triangle's packet, counted through the file. */
    packetNumbers(): Uint32Array {
        const numbers = new Uint32Array(this.#packets.length);
        let [number, last, page] = [-1, -1, 0];
        for (let at = 0; at < numbers.length; at++) {
            const isNewPage = at >= (this.#pageStarts[page + 1] ?? Number.POSITIVE_INFINITY);
            while (at >= (this.#pageStarts[page + 1] ?? Number.POSITIVE_INFINITY)) {
                page++;
            }
            if (isNewPage || this.#packets[at] !== last) {
                number++;
                last = this.#packets[at] ?? 0;
            }
            numbers[at] = number;
        }
        return numbers;
    }
}

/** All files, by number. */
const files: LoadedFile[] = [];

/** Finds a file. */
export function file(number: number): LoadedFile {
    const found = files[number];
    if (found === undefined) {
        throw new Error(`file: expected a number below ${files.length}, found ${number}`);
    }
    return found;
}

/** Opens the bytes of a baked file, or bakes those of another one. */
export function add(name: string, bytes: Uint8Array, onStage: (stage: string) => void): FileSummary {
    const isBaked = [0x89, 0x63, 0x62, 0x76, 0x68].every((byte, place) => bytes[place] === byte);
    const mesh =
        isBaked || name.toLowerCase().endsWith(".cbvh") ? Mesh.open(bytes) : Mesh.bakeFile(name, bytes, { onStage });
    const added = new LoadedFile(files.length, name, mesh);
    files.push(added);
    return added.summary();
}

/** Opens an object of a file by itself, or all of it as solid. A number below 0 stands for all objects. */
export function addPart(number: number, object: number, solid: boolean): FileSummary {
    const { name, mesh } = file(number);
    const part = object < 0 ? mesh : mesh.object(object);
    const added = new LoadedFile(files.length, name, solid ? part.solid() : part);
    files.push(added);
    return added.summary();
}
