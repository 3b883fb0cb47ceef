/** The meshes on the stage: geometry that is shared by all instances of a file, and bodies that are placed. */

import {
    BackSide,
    BufferAttribute,
    BufferGeometry,
    CapsuleGeometry,
    DataTexture,
    DoubleSide,
    FrontSide,
    Group,
    LinearFilter,
    LineBasicMaterial,
    LineSegments,
    Mesh,
    MeshMatcapMaterial,
    Quaternion,
    RGBAFormat,
    type Side,
    SRGBColorSpace,
    Vector3,
} from "three";
import type { FileSummary } from "../worker/files.js";
import type { Asker } from "./asker.js";
import { identity, type Pose } from "./pose.js";
import type { Stage } from "./stage.js";

/** How a ball is lit, from which the light on each triangle is looked up: a key light, a weak one, and a dark rim. */
function litBall(strength: number): DataTexture {
    const side = 128;
    const pixels = new Uint8Array(4 * side * side);
    const unit = (x: number, y: number, z: number) => {
        const length = Math.hypot(x, y, z);
        return [x / length, y / length, z / length] as const;
    };
    const [key, fill] = [unit(-0.45, 0.65, 0.75), unit(0.8, -0.25, 0.5)];
    for (let row = 0; row < side; row++) {
        for (let column = 0; column < side; column++) {
            let [x, y] = [(2 * column) / (side - 1) - 1, (2 * row) / (side - 1) - 1];
            const radius = Math.hypot(x, y);
            if (radius > 0.995) {
                [x, y] = [(x * 0.995) / radius, (y * 0.995) / radius];
            }
            const z = Math.sqrt(1 - x * x - y * y);
            const lit = (light: readonly [number, number, number]) =>
                Math.max(x * light[0] + y * light[1] + z * light[2], 0);
            const shine = Math.max(2 * lit(key) * z - key[2], 0) ** 24;
            const rim = (1 - z) ** 3;
            const shade = 0.62 * lit(key) + 0.2 * lit(fill) + 0.14 * shine - 0.1 * rim;
            const light = 0.3 + 0.5 * (1 - strength) + strength * shade;
            const level = Math.round(255 * Math.min(Math.max(light, 0), 1) ** 0.92);
            pixels.set([level, level, Math.min(255, level + 4), 255], 4 * (row * side + column));
        }
    }
    const texture = new DataTexture(pixels, side, side, RGBAFormat);
    texture.colorSpace = SRGBColorSpace;
    texture.minFilter = texture.magFilter = LinearFilter;
    texture.needsUpdate = true;
    return texture;
}

let ball: DataTexture | undefined;
let paleBall: DataTexture | undefined;

/** A material that looks lit. */
export function material(
    colour: number,
    options: { transparent?: boolean; opacity?: number } = {},
): MeshMatcapMaterial {
    ball ??= litBall(1);
    return new MeshMatcapMaterial({ color: colour, matcap: ball, flatShading: true, side: DoubleSide, ...options });
}

/** More boxes than this are not drawn in place of a large mesh. */
const MAX_BOXES = 30_000;

/** A file, as it is drawn. */
export class Shown {
    readonly geometry = new BufferGeometry();
    /** The number of triangles before each page; none of a large mesh. */
    pageStarts: Uint32Array = new Uint32Array();
    /** The level whose boxes are drawn in place of triangles. */
    boxLevel: number | undefined;
    /** Whether the triangles of the file are drawn, and not something in their place. */
    hasTriangles = false;
    #smooth: BufferAttribute | undefined;
    #facing: Side = DoubleSide;

    private constructor(
        readonly summary: FileSummary,
        readonly centre: Float64Array,
    ) {}

    /** Reads the triangles of a file or, of a large one, the boxes of a level of its tree. */
    static async of(summary: FileSummary, asker: Asker): Promise<Shown> {
        const { number, bounds } = summary;
        const [x0 = 0, y0 = 0, z0 = 0, x1 = 0, y1 = 0, z1 = 0] = bounds;
        if (summary.drawn) {
            const { positions: stored, centre, pageStarts } = await asker.ask("triangles", number);
            const shown = new Shown(summary, centre);
            const positions = capsuleOf(stored, summary.radius) ?? stored;
            shown.hasTriangles = positions === stored;
            shown.geometry.setAttribute("position", new BufferAttribute(positions, 3));
            shown.pageStarts = pageStarts;
            shown.#facing = summary.closed === true ? outside(positions) : DoubleSide;
            shown.geometry.computeBoundingSphere();
            shown.geometry.computeBoundingBox();
            return shown;
        }
        const shown = new Shown(summary, Float64Array.of((x0 + x1) / 2, (y0 + y1) / 2, (z0 + z1) / 2));
        for (let level = 3; ; level++) {
            const boxes = await asker.ask("level", number, level, MAX_BOXES + 1, "boxes");
            const isTooMany = boxes.count > MAX_BOXES;
            if (!isTooMany || level === 3) {
                shown.geometry.setAttribute("position", new BufferAttribute(boxes.positions, 3));
                shown.boxLevel = level;
            }
            const isLast = boxes.triangles.every((count) => count > 0);
            if (isTooMany || isLast || boxes.count > MAX_BOXES / 3) {
                break;
            }
        }
        shown.geometry.computeBoundingSphere();
        shown.geometry.computeBoundingBox();
        return shown;
    }

    /** Which sides of triangles are seen: of a closed mesh, only the outer ones. */
    get facing(): Side {
        return this.#facing;
    }

    get positions(): Float32Array {
        return this.geometry.getAttribute("position").array as Float32Array;
    }

    get triangles(): number {
        return this.positions.length / 9;
    }

    /** Whether the drawn order has a triangle of this number. */
    has(place: number): boolean {
        return Number.isInteger(place) && place >= 0 && place < this.triangles;
    }

    /** The nine coordinates of a triangle, less the centre. */
    triangle(place: number): Float32Array {
        return this.positions.subarray(9 * place, 9 * place + 9);
    }

    /** Normals that run over edges flatter than 40 degrees. They are computed when they are first needed. */
    get normals(): BufferAttribute {
        this.#smooth ??= new BufferAttribute(smoothNormals(this.positions), 3, true);
        return this.#smooth;
    }
}

/** The triangles of a capsule or a ball: of a file with one triangle that is a segment or a point, and has a radius. */
function capsuleOf(stored: Float32Array, radius: number): Float32Array | undefined {
    const [a, b, c] = [0, 3, 6].map((at) => new Vector3().fromArray(stored, at)) as [Vector3, Vector3, Vector3];
    const [p, q] = a.equals(b) ? [a, c] : [a, b];
    if (stored.length !== 9 || radius <= 0 || !(c.equals(p) || c.equals(q))) {
        return undefined;
    }
    const way = q.clone().sub(p);
    const turn = new Quaternion().setFromUnitVectors(new Vector3(0, 1, 0), way.clone().normalize());
    const capsule = new CapsuleGeometry(radius, way.length(), 8, 32).toNonIndexed();
    const { x, y, z } = p.add(q).divideScalar(2);
    return capsule.applyQuaternion(turn).translate(x, y, z).getAttribute("position").array as Float32Array;
}

/** The side of triangles that is outside of a closed mesh: the sign of its volume tells. */
function outside(positions: Float32Array): Side {
    let volume = 0;
    for (let at = 0; at < positions.length; at += 9) {
        const p = (k: number) => positions[at + k] ?? 0;
        volume += p(0) * (p(4) * p(8) - p(5) * p(7));
        volume += p(1) * (p(5) * p(6) - p(3) * p(8));
        volume += p(2) * (p(3) * p(7) - p(4) * p(6));
    }
    return volume < 0 ? BackSide : FrontSide;
}

/** Computes normals at corners: the mean of those of the triangles there, by area, that are not across a sharp edge. */
function smoothNormals(positions: Float32Array): Int8Array {
    const corners = positions.length / 3;
    const flat = new Float32Array(positions.length / 3);
    for (let at = 0; at < positions.length; at += 9) {
        const p = (k: number) => positions[at + k] ?? 0;
        const [ux, uy, uz] = [p(3) - p(0), p(4) - p(1), p(5) - p(2)];
        const [vx, vy, vz] = [p(6) - p(0), p(7) - p(1), p(8) - p(2)];
        flat.set([uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx], at / 3);
    }
    // Corners at the same place are linked through a table of hashes.
    const size = 2 ** Math.ceil(Math.log2(corners * 1.5 + 16));
    const table = new Int32Array(size).fill(-1);
    const [next, first] = [new Int32Array(corners).fill(-1), new Int32Array(corners)];
    const bits = new Uint32Array(positions.buffer, positions.byteOffset, positions.length);
    for (let corner = 0; corner < corners; corner++) {
        const [x, y, z] = [bits[3 * corner] ?? 0, bits[3 * corner + 1] ?? 0, bits[3 * corner + 2] ?? 0];
        let slot = (Math.imul(x, 0x9e3779b1) ^ Math.imul(y, 0x85ebca6b) ^ Math.imul(z, 0xc2b2ae35)) >>> 0;
        slot = (slot ^ (slot >>> 15)) & (size - 1);
        for (;;) {
            const known = table[slot] ?? -1;
            if (known < 0) {
                table[slot] = corner;
                first[corner] = corner;
                break;
            }
            if (bits[3 * known] === x && bits[3 * known + 1] === y && bits[3 * known + 2] === z) {
                first[corner] = known;
                next[corner] = next[known] ?? -1;
                next[known] = corner;
                break;
            }
            slot = (slot + 1) & (size - 1);
        }
    }
    const made = new Int8Array(positions.length);
    const cosine = Math.cos((40 * Math.PI) / 180);
    for (let corner = 0; corner < corners; corner++) {
        const own = 3 * Math.floor(corner / 3);
        const [a, b, c] = [flat[own] ?? 0, flat[own + 1] ?? 0, flat[own + 2] ?? 0];
        const length = Math.hypot(a, b, c);
        let [x, y, z] = [0, 0, 0];
        for (let other = first[corner] ?? -1; other >= 0; other = next[other] ?? -1) {
            const at = 3 * Math.floor(other / 3);
            const [p, q, r] = [flat[at] ?? 0, flat[at + 1] ?? 0, flat[at + 2] ?? 0];
            if (a * p + b * q + c * r >= cosine * length * Math.hypot(p, q, r)) {
                [x, y, z] = [x + p, y + q, z + r];
            }
        }
        const sum = Math.hypot(x, y, z) || 1;
        made.set([(127 * x) / sum, (127 * y) / sum, (127 * z) / sum], 3 * corner);
    }
    return made;
}

/** A mesh that is placed on the stage. */
export class Body {
    readonly group = new Group();
    readonly mesh: Mesh<BufferGeometry, MeshMatcapMaterial>;
    pose: Pose = identity();
    #wires: LineSegments | undefined;

    constructor(
        readonly name: string,
        readonly shown: Shown,
        readonly stage: Stage,
        colour: number,
        /** What is added to the radius in questions. */
        readonly margin = 0,
    ) {
        // It shares the positions, and has colours of its own.
        const geometry = new BufferGeometry();
        geometry.setAttribute("position", shown.geometry.getAttribute("position"));
        geometry.boundingBox = shown.geometry.boundingBox;
        geometry.boundingSphere = shown.geometry.boundingSphere;
        this.mesh = new Mesh(geometry, material(colour));
        this.mesh.material.side = shown.facing;
        this.group.add(this.mesh);
        stage.scene.add(this.group);
        this.setPose(this.pose);
    }

    get file(): number {
        return this.shown.summary.number;
    }

    /** As the worker takes it. */
    get side(): { file: number; margin: number } {
        return { file: this.file, margin: this.margin };
    }

    setPose(pose: Pose): void {
        this.pose = pose;
        this.stage.place(this.group, pose, this.shown.centre);
    }

    setColour(colour: number): void {
        if (this.isPainted) {
            return;
        }
        this.mesh.material.color.setHex(colour);
        this.stage.draw();
    }

    /** Draws a colour for each corner, or one colour. */
    paint(colours: BufferAttribute | undefined, colour: number): void {
        const { geometry, material } = this.mesh;
        if (colours === undefined) {
            geometry.deleteAttribute("color");
        } else {
            geometry.setAttribute("color", colours);
        }
        // Colours that mean something are shaded less.
        paleBall ??= litBall(0.45);
        material.matcap = colours === undefined ? (ball ?? null) : paleBall;
        material.vertexColors = colours !== undefined;
        material.color.setHex(colours === undefined ? colour : 0xffffff);
        material.needsUpdate = true;
        this.stage.draw();
    }

    get isPainted(): boolean {
        return this.mesh.material.vertexColors;
    }

    setOpacity(opacity: number): void {
        const { material } = this.mesh;
        if (material.opacity === opacity) {
            return;
        }
        material.opacity = opacity;
        material.transparent = opacity < 1;
        material.depthWrite = opacity > 0.9;
        // Through what is transparent, the far side is seen as well.
        material.side = opacity < 1 ? DoubleSide : this.shown.facing;
        material.needsUpdate = true;
        this.mesh.renderOrder = opacity < 1 ? 1 : 0;
        this.stage.draw();
    }

    /** Smooths over edges, or shows each triangle flat. */
    setSmooth(smooth: boolean): void {
        const { geometry, material } = this.mesh;
        const isSmooth = smooth && this.shown.boxLevel === undefined;
        if (isSmooth) {
            geometry.setAttribute("normal", this.shown.normals);
        } else {
            geometry.deleteAttribute("normal");
        }
        material.flatShading = !isSmooth;
        material.needsUpdate = true;
        this.stage.draw();
    }

    /** Shows the edges of triangles. */
    setEdges(shown: boolean, colour: number): void {
        if (!shown) {
            this.#wires?.removeFromParent();
            this.#wires = undefined;
            this.stage.draw();
            return;
        }
        if (this.#wires === undefined) {
            const { positions } = this.shown;
            const wires = new BufferGeometry();
            wires.setAttribute("position", this.shown.geometry.getAttribute("position"));
            const corners = positions.length / 3;
            const index = new Uint32Array(2 * corners);
            for (let corner = 0; corner < corners; corner++) {
                index[2 * corner] = corner;
                index[2 * corner + 1] = corner % 3 === 2 ? corner - 2 : corner + 1;
            }
            wires.setIndex(new BufferAttribute(index, 1));
            const lines = new LineBasicMaterial({ color: colour, transparent: true, opacity: 0.28 });
            this.#wires = new LineSegments(wires, lines);
            this.group.add(this.#wires);
        }
        this.stage.draw();
    }

    set isVisible(visible: boolean) {
        this.group.visible = visible;
        this.stage.draw();
    }

    get isVisible(): boolean {
        return this.group.visible;
    }

    remove(): void {
        this.#wires?.geometry.dispose();
        this.mesh.geometry.dispose();
        this.group.removeFromParent();
        this.mesh.material.dispose();
    }
}
