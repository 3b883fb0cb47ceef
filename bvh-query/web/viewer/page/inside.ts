/** The inside of a file: bytes by kind, levels, boxes and k-DOPs of a level, pages as colours, and what a question visits. */

import {
    BufferAttribute,
    BufferGeometry,
    Color,
    DoubleSide,
    Group,
    LineBasicMaterial,
    LineSegments,
    Mesh,
    MeshBasicMaterial,
} from "three";
import type { Polyhedra, Slabs } from "../worker/polyhedra.js";
import type { Handlers } from "../worker/worker.js";
import type { App } from "./app.js";
import type { Body } from "./bodies.js";
import { distinct, heat } from "./colours.js";
import { bytesOf, countOf, fact, fill, h, milliseconds } from "./dom.js";
import { describe, messageOf } from "./errors.js";
import { part } from "./panel.js";

type Contents = ReturnType<Handlers["contents"]>;
type Visits = ReturnType<Handlers["visits"]>;
type Paint = "plain" | "pages" | "packets" | "visits";

/** More nodes than this are not drawn. */
const MAX_NODES = 20_000;
/** The colours of sections in the bar, as CSS. */
const SECTION_COLOURS: Record<string, string> = {
    header: "#94a3b8",
    objects: "#64748b",
    nodes: "#3b82f6",
    leaves: "#f59e0b",
    ids: "#10b981",
    duplicates: "#14b8a6",
    provenance: "#a78bfa",
    instances: "#f472b6",
    topology: "#fb7185",
    "between sections": "#cbd5e1",
};

/** The place in the scale of heat: nothing, opened but not tested, or tested. */
const heatOf = (tested: number, most: number, isMet: boolean): number =>
    tested > 0 ? 0.4 + (0.6 * Math.log1p(tested)) / Math.log1p(most) : isMet ? 0.2 : 0;

export class Inside {
    readonly #page: HTMLElement;
    readonly #contents = h("div");
    readonly #choice = h("select", { class: "field", "aria-label": "File" });
    readonly #level = h("input", {
        type: "range",
        min: "0",
        max: "1",
        step: "1",
        value: "0",
        "aria-label": "Level of the tree",
    });
    readonly #levelText = h("output", { class: "number" }, "none");
    readonly #slabs = h(
        "select",
        { class: "field", "aria-label": "Shape of nodes" },
        h("option", { value: "none" }, "Nothing"),
        h("option", { value: "boxes" }, "Boxes"),
        h("option", { value: "fixed" }, "k-DOPs, fixed slabs"),
        h("option", { value: "all" }, "k-DOPs with turning slabs"),
    );
    readonly #paint = h(
        "select",
        { class: "field", "aria-label": "Colours of triangles" },
        h("option", { value: "plain" }, "One colour"),
        h("option", { value: "pages" }, "Pages"),
        h("option", { value: "packets" }, "Leaf packets"),
        h("option", { value: "visits" }, "What a question visits"),
    );
    readonly #question = h(
        "select",
        { class: "field", "aria-label": "Question" },
        h("option", { value: "distance" }, "distance"),
        h("option", { value: "collide" }, "collide"),
        h("option", { value: "contacts" }, "contacts"),
    );
    readonly #visitsBox = h("div");
    readonly #nodesBox = h("div", { class: "muted" });
    readonly #group = new Group();
    #polyhedra: Polyhedra | undefined;
    #known = new Map<number, Contents>();
    #visits: Visits | undefined;
    #isShown = false;
    #asked = 0;
    #painted: Paint = "plain";

    constructor(readonly app: App) {
        app.stage.scene.add(this.#group);
        this.#page = app.panel.add("inside", "Inside", (shown) => {
            this.#isShown = shown;
            this.#group.visible = shown;
            void this.#show();
        });
        this.#choice.addEventListener("change", () => void this.#show());
        this.#level.addEventListener("input", () => void this.#drawLevel());
        this.#slabs.addEventListener("change", () => void this.#drawLevel());
        this.#paint.addEventListener("change", () => void this.#repaint());
        this.#question.addEventListener("change", () => void this.#repaint());
        app.pair.onAnswer.push(() => {
            if (this.#isShown && this.#paint.value === "visits" && !app.handles.isDragging) {
                void this.#repaint();
            }
            this.#placeGroup();
        });
        const row = (title: string, ...children: HTMLElement[]) =>
            h("div", { class: "fields" }, h("span", { class: "fields-title" }, title), ...children);
        this.#page.append(
            row("file", this.#choice),
            part(
                "Nodes of the tree",
                row("draw", this.#slabs),
                row("level", this.#level, this.#levelText),
                this.#nodesBox,
            ),
            part("Colours of triangles", row("by", this.#paint), this.#visitsBox),
            this.#contents,
        );
    }

    #bodies(): Body[] {
        return this.app.bodies;
    }

    #body(): Body | undefined {
        return this.#bodies()[Number(this.#choice.value)] ?? this.#bodies()[0];
    }

    /** Adopts the files on the stage. */
    offer(): void {
        this.#known.clear();
        this.#visits = undefined;
        this.#clearNodes();
        const bodies = this.#bodies();
        const seen = new Set<number>();
        fill(
            this.#choice,
            ...bodies.flatMap((body, k) => {
                if (seen.has(body.file)) {
                    return [];
                }
                seen.add(body.file);
                return [h("option", { value: String(k) }, `${body.name}: ${body.shown.summary.name}`)];
            }),
        );
        this.#paint.value = "plain";
        this.#slabs.value = "none";
        this.#paint.options[3]?.toggleAttribute("disabled", !this.app.pair.isComplete);
        if (this.#isShown) {
            void this.#show();
        }
    }

    async #show(): Promise<void> {
        if (!this.#isShown) {
            await this.#repaint();
            return;
        }
        const body = this.#body();
        if (body === undefined) {
            return;
        }
        try {
            const known = this.#known.get(body.file) ?? (await this.app.asker.ask("contents", body.file));
            this.#known.set(body.file, known);
            this.#showContents(body, known);
            await this.#drawLevel();
            await this.#repaint();
        } catch (error) {
            fill(this.#contents, describe(body.shown.summary.name, messageOf(error)));
        }
    }

    #showContents(body: Body, contents: Contents): void {
        const { summary } = body.shown;
        const depth = Math.max(...contents.levelLengths);
        this.#level.max = String(depth);
        if (this.#level.dataset.file !== String(body.file)) {
            this.#level.dataset.file = String(body.file);
            this.#level.value = String(Math.min(3, depth));
        }
        const parts = contents.sections.map(({ name, bytes }) => ({ name, bytes }));
        const first = Math.min(...contents.sections.map(({ start }) => start), summary.bytes);
        const known = parts.reduce((sum, { bytes }) => sum + bytes, 0);
        const head = { name: "header", bytes: Math.min(first, 64 + 32 * contents.sections.length) };
        const gaps = { name: "between sections", bytes: summary.bytes - known - head.bytes };
        const all = [head, ...parts, gaps].filter(({ bytes }) => bytes > 0);
        const triangles = Math.max(summary.triangles, 1);
        const colour = (name: string) => SECTION_COLOURS[name] ?? "#8b949e";
        const bar = h(
            "div",
            { class: "bar", role: "img", "aria-label": "Bytes by kind" },
            ...all.map(({ name, bytes }) =>
                h("span", {
                    style: `flex:${bytes} 0 0;background:${colour(name)}`,
                    title: `${name}: ${bytesOf(bytes)}`,
                }),
            ),
        );
        const cells = (tag: "td" | "th", ...texts: (string | HTMLElement)[]) => texts.map((text) => h(tag, {}, text));
        const table = h(
            "table",
            {},
            h("thead", {}, h("tr", {}, ...cells("th", "kind", "bytes", "per triangle", "share"))),
            h(
                "tbody",
                {},
                ...all.map(({ name, bytes }) =>
                    h(
                        "tr",
                        {},
                        h("td", {}, h("i", { class: "swatch", style: `background:${colour(name)}` }), name),
                        ...cells(
                            "td",
                            countOf(bytes),
                            (bytes / triangles).toFixed(2),
                            `${((100 * bytes) / summary.bytes).toFixed(1)} %`,
                        ),
                    ),
                ),
            ),
        );
        let before = 0;
        const objects = contents.objects.map((object, number) => {
            const levels = contents.levelLengths[number] ?? 0;
            const counts = contents.levelCounts.subarray(4 * before, 4 * (before + levels));
            before += levels;
            const rows = Array.from({ length: levels }, (_, level) => {
                const [treelets = 0, children = 0, packets = 0, inPackets = 0] = counts.subarray(
                    4 * level,
                    4 * level + 4,
                );
                return h(
                    "tr",
                    {},
                    ...cells(
                        "td",
                        String(level),
                        countOf(treelets),
                        treelets > 0 ? (children / treelets).toFixed(2) : "",
                        countOf(packets),
                        packets > 0 ? (inPackets / packets).toFixed(2) : "",
                    ),
                );
            });
            const closed = object.closed === undefined ? "not stated" : object.closed ? "yes" : "no";
            return h(
                "details",
                { open: contents.objects.length === 1 },
                h("summary", {}, object.name === "" ? `object ${number}` : object.name),
                h(
                    "dl",
                    { class: "facts" },
                    fact("profile", object.profile),
                    fact("triangles as", object.encoding),
                    fact("triangles", countOf(object.triangles)),
                    object.duplicates > 0 && fact("exact duplicates", countOf(object.duplicates)),
                    object.degenerate > 0 && fact("without area", countOf(object.degenerate)),
                    fact("closed", closed),
                    fact("pages", countOf(object.pages)),
                    fact("treelets", countOf(object.treelets)),
                    fact("leaf packets", countOf(object.packets)),
                    fact("depth", String(levels)),
                ),
                h(
                    "table",
                    {},
                    h(
                        "thead",
                        {},
                        h("tr", {}, ...cells("th", "level", "treelets", "children", "packets", "triangles")),
                    ),
                    h("tbody", {}, ...rows),
                ),
            );
        });
        const check = h(
            "button",
            { type: "button", class: "button", click: () => void this.#validate(body) },
            "Check the whole file",
        );
        fill(
            this.#contents,
            part(
                "Bytes",
                h("p", { class: "muted" }, `${bytesOf(summary.bytes)}, format ${contents.version}`),
                bar,
                table,
                check,
            ),
            part(
                contents.objects.length === 1 ? "Object" : `${contents.objects.length} objects`,
                ...objects.slice(0, 200),
            ),
        );
    }

    async #validate(body: Body): Promise<void> {
        const { name } = body.shown.summary;
        try {
            await this.app.asker.ask("validate", body.file);
            this.app.messages.say(`${name} keeps all rules of the format.`);
        } catch (error) {
            this.app.messages.say(describe(name, messageOf(error)), "error");
        }
    }

    #clearNodes(): void {
        for (const child of [...this.#group.children]) {
            child.removeFromParent();
            if (child instanceof Mesh || child instanceof LineSegments) {
                (child.geometry as BufferGeometry).dispose();
                (child.material as MeshBasicMaterial).dispose();
            }
        }
        this.#polyhedra = undefined;
    }

    #placeGroup(): void {
        const body = this.#body();
        if (body !== undefined) {
            this.app.stage.place(this.#group, body.pose, body.shown.centre);
        }
    }

    async #drawLevel(): Promise<void> {
        const body = this.#body();
        const slabs = this.#slabs.value;
        const level = this.#level.valueAsNumber;
        this.#levelText.textContent = slabs === "none" ? "–" : String(level);
        if (body === undefined || !this.#isShown) {
            return;
        }
        const number = ++this.#asked;
        if (slabs === "none") {
            this.#clearNodes();
            fill(this.#nodesBox);
            this.app.stage.draw();
            return;
        }
        const found = await this.app.asker.ask("level", body.file, level, MAX_NODES + 1, slabs as Slabs);
        if (number !== this.#asked) {
            return;
        }
        this.#clearNodes();
        if (found.count > MAX_NODES) {
            fill(this.#nodesBox, `More than ${countOf(MAX_NODES)} nodes, which are not drawn. Choose a level above.`);
            this.app.stage.draw();
            return;
        }
        this.#polyhedra = found;
        const leaves = found.triangles.reduce((sum, count) => sum + (count > 0 ? 1 : 0), 0);
        const turning = found.turning.includes(1) ? ". Faces of turning slabs are amber" : "";
        fill(this.#nodesBox, `${countOf(found.count)} nodes, ${countOf(leaves)} of which are leaf packets${turning}.`);
        const geometry = new BufferGeometry();
        geometry.setAttribute("position", new BufferAttribute(found.positions, 3));
        const colours = this.#nodeColours(found);
        geometry.setAttribute("color", new BufferAttribute(colours.faces, 3, true));
        const faces = new Mesh(
            geometry,
            new MeshBasicMaterial({
                vertexColors: true,
                transparent: true,
                opacity: Math.max(0.05, Math.min(0.22, 4 / Math.sqrt(found.count))),
                depthWrite: false,
                side: DoubleSide,
            }),
        );
        faces.renderOrder = 3;
        const lines = new BufferGeometry();
        lines.setAttribute("position", new BufferAttribute(found.edges, 3));
        lines.setAttribute("color", new BufferAttribute(colours.edges, 3, true));
        const edges = new LineSegments(
            lines,
            new LineBasicMaterial({ vertexColors: true, transparent: true, opacity: 0.8 }),
        );
        edges.renderOrder = 4;
        this.#group.add(faces, edges);
        this.#placeGroup();
    }

    /** Colours of nodes: by number or, with visits, by how often they were opened or tested. */
    #nodeColours(found: Polyhedra): { faces: Uint8Array; edges: Uint8Array } {
        const faces = new Uint8Array(found.positions.length);
        const edges = new Uint8Array(found.edges.length);
        const colour = new Color();
        const amber = new Color(this.app.stage.palette.b);
        const box = new Color(this.app.stage.palette.box);
        const counts = this.#paint.value === "visits" ? this.#countsOfNodes(found) : undefined;
        const most = counts === undefined ? 1 : Math.max(1, ...counts);
        const put = (to: Uint8Array, start: number, end: number, of: Color) => {
            const { r, g, b } = of;
            for (let k = start; k < end; k++) {
                to.set([255 * r, 255 * g, 255 * b], 3 * k);
            }
        };
        for (let node = 0; node < found.count; node++) {
            const count = counts?.[node] ?? 0;
            if (counts !== undefined) {
                heat(heatOf(count, most, count > 0), colour);
            } else if (found.count <= 400) {
                distinct(node, colour);
            } else {
                colour.copy(box);
            }
            const [start = 0, end = 0] = [found.starts[node], found.starts[node + 1]];
            put(faces, start, end, colour);
            for (let k = start; k < end; k++) {
                if (found.turning[k] === 1) {
                    put(faces, k, k + 1, amber);
                }
            }
            put(edges, found.edgeStarts[node] ?? 0, found.edgeStarts[node + 1] ?? 0, colour);
        }
        return { faces, edges };
    }

    #countsOfNodes(found: Polyhedra): Uint32Array {
        const body = this.#body();
        const side = body === this.app.pair.b ? this.#visits?.b : this.#visits?.a;
        const counts = new Uint32Array(found.count);
        if (side === undefined) {
            return counts;
        }
        const table = (rows: Uint32Array) => {
            const made = new Map<number, number>();
            for (let k = 0; k < rows.length; k += 3) {
                made.set((rows[k] ?? 0) * 65536 + (rows[k + 1] ?? 0), rows[k + 2] ?? 0);
            }
            return made;
        };
        const [treelets, packets] = [table(side.treelets), table(side.packets)];
        for (let node = 0; node < found.count; node++) {
            const key = (found.places[2 * node] ?? 0) * 65536 + (found.places[2 * node + 1] ?? 0);
            counts[node] = ((found.triangles[node] ?? 0) > 0 ? packets : treelets).get(key) ?? 0;
        }
        return counts;
    }

    /** Paints the triangles of all bodies. */
    async #repaint(): Promise<void> {
        const paint = this.#isShown ? (this.#paint.value as Paint) : "plain";
        if (paint === "plain" && this.#painted === "plain") {
            return;
        }
        this.#painted = paint;
        fill(this.#visitsBox);
        const { pair } = this.app;
        if (paint === "visits" && pair.a !== undefined && pair.b !== undefined) {
            const began = performance.now();
            this.#visits = await this.app.asker.ask(
                "visits",
                pair.a.side,
                pair.b.side,
                pair.pose,
                this.#question.value,
            );
            this.#showVisits(this.#visits, performance.now() - began);
        }
        const known = new Map<number, BufferAttribute>();
        for (const body of this.#bodies()) {
            if (paint === "plain" || body.shown.boxLevel !== undefined) {
                body.paint(undefined, this.app.colourOf(body));
                continue;
            }
            // What is counted differs between both sides of a question, even if they are one file.
            const colours =
                (paint === "visits" ? undefined : known.get(body.file)) ?? (await this.#coloursOf(body, paint));
            known.set(body.file, colours);
            body.paint(colours, this.app.colourOf(body));
        }
        if (this.#polyhedra !== undefined) {
            const { faces, edges } = this.#nodeColours(this.#polyhedra);
            const [drawn, lines] = this.#group.children as [Mesh, LineSegments];
            drawn.geometry.setAttribute("color", new BufferAttribute(faces, 3, true));
            lines.geometry.setAttribute("color", new BufferAttribute(edges, 3, true));
        }
        this.app.stage.draw();
    }

    async #coloursOf(body: Body, paint: Paint): Promise<BufferAttribute> {
        const { shown } = body;
        const colours = new Uint8Array(9 * shown.triangles);
        const colour = new Color();
        let last = -1;
        let rgb = [0, 0, 0];
        const put = (triangle: number, key: number, make: () => void) => {
            if (key !== last) {
                make();
                rgb = [Math.round(255 * colour.r), Math.round(255 * colour.g), Math.round(255 * colour.b)];
                last = key;
            }
            const [r = 0, g = 0, b = 0] = rgb;
            colours.set([r, g, b, r, g, b, r, g, b], 9 * triangle);
        };
        if (paint === "pages") {
            for (let page = 0; page + 1 < shown.pageStarts.length; page++) {
                for (
                    let triangle = shown.pageStarts[page] ?? 0;
                    triangle < (shown.pageStarts[page + 1] ?? 0);
                    triangle++
                ) {
                    put(triangle, page, () => distinct(page, colour));
                }
            }
        } else if (paint === "packets") {
            const numbers = await this.app.asker.ask("packets", body.file);
            numbers.forEach((number, triangle) => {
                put(triangle, number, () => distinct(number, colour));
            });
        } else {
            const side = body === this.app.pair.b ? this.#visits?.b : this.#visits?.a;
            const { tested = new Uint32Array(), opened = new Uint32Array() } = side ?? {};
            let most = 1;
            for (const count of tested) {
                most = Math.max(most, count);
            }
            for (let triangle = 0; triangle < shown.triangles; triangle++) {
                const count = tested[triangle] ?? 0;
                const key = count > 0 ? count + 1 : (opened[triangle] ?? 0) > 0 ? 1 : 0;
                put(triangle, key, () => heat(heatOf(count, most, key > 0), colour));
            }
        }
        return new BufferAttribute(colours, 3, true);
    }

    #showVisits(visits: Visits, took: number): void {
        const sum = (rows: Uint32Array) => {
            let total = 0;
            for (let k = 2; k < rows.length; k += 3) {
                total += rows[k] ?? 0;
            }
            return `${countOf(rows.length / 3)} of them, ${countOf(total)} times`;
        };
        fill(
            this.#visitsBox,
            h("div", { class: "fields" }, h("span", { class: "fields-title" }, "question"), this.#question),
            h(
                "div",
                { class: "heat-scale" },
                h("span", {}, "not met"),
                h("span", { class: "heat-bar" }),
                h("span", {}, "tested most"),
            ),
            h(
                "dl",
                { class: "facts" },
                fact("node tests", `${countOf(visits.nodeTests)} of up to 16 pairs`),
                fact("packet tests", `${countOf(visits.packetTests)} of up to 16 pairs of triangles`),
                fact("exact tests", countOf(visits.exactTests)),
                fact("A: treelets", sum(visits.a.treelets)),
                fact("B: treelets", sum(visits.b.treelets)),
                fact("A: packets", sum(visits.a.packets)),
                fact("B: packets", sum(visits.b.packets)),
                fact("recorded in", milliseconds(took)),
            ),
        );
    }

    /** Draws what a link names. */
    restore(values: { draw?: string; level?: string; paint?: string }): void {
        if (values.draw !== undefined) {
            this.#slabs.value = values.draw;
        }
        if (values.paint !== undefined) {
            this.#paint.value = values.paint;
        }
        const file = this.#body()?.file;
        if (values.level !== undefined && file !== undefined) {
            this.#level.dataset.file = String(file);
            this.#level.max = values.level;
            this.#level.value = values.level;
        }
    }

    get state(): { draw: string; level: string; paint: string } {
        return { draw: this.#slabs.value, level: this.#level.value, paint: this.#paint.value };
    }
}
