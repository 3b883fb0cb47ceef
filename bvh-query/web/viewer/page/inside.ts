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
import type { Body } from "./bodies.js";
import { type Contents, describeContents } from "./breakdown.js";
import { distinct, heat } from "./colours.js";
import { countOf, fact, fill, h, milliseconds } from "./dom.js";
import { describe, messageOf } from "./errors.js";
import type { Look } from "./look.js";
import { Open } from "./open.js";
import type { Pair } from "./pair.js";
import { part } from "./panel.js";
import type { View } from "./view.js";

type Visits = ReturnType<Handlers["visits"]>;
type Paint = "plain" | "pages" | "packets" | "visits";

/** More nodes than this are not drawn. */
const MAX_NODES = 20_000;
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
    readonly #open: Open;
    #polyhedra: Polyhedra | undefined;
    #known = new Map<number, Contents>();
    #visits: Visits | undefined;
    #isShown = false;
    #asked = 0;
    #painted: Paint = "plain";

    constructor(
        readonly view: View,
        readonly pair: Pair,
        readonly look: Look,
    ) {
        view.stage.scene.add(this.#group);
        this.#open = new Open(view);
        this.#page = view.panel.add("inside", "Inside", (shown) => {
            this.#isShown = shown;
            this.#group.visible = shown;
            void this.#show();
        });
        this.#choice.addEventListener("change", () => void this.#show());
        this.#level.addEventListener("input", () => this.#try(() => this.#drawLevel()));
        this.#slabs.addEventListener("change", () => this.#try(() => this.#drawLevel()));
        this.#paint.addEventListener("change", () => this.#try(() => this.#repaint()));
        this.#question.addEventListener("change", () => this.#try(() => this.#repaint()));
        pair.onAnswer.push(() => {
            if (this.#isShown && this.#paint.value === "visits" && !view.handles.isDragging) {
                this.#try(() => this.#repaint());
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
            this.#open.element,
            this.#contents,
        );
    }

    /** Says why a question has no answer: a file may be damaged where nobody has looked yet. */
    #try(work: () => Promise<void>): void {
        work().catch((error: unknown) => {
            const name = this.#body()?.shown.summary.name ?? "";
            this.view.messages.say(describe(name, messageOf(error)), "error");
        });
    }

    #body(): Body | undefined {
        return this.view.bodies[Number(this.#choice.value)] ?? this.view.bodies[0];
    }

    /** Adopts the files on the stage. */
    offer(): void {
        this.#known.clear();
        this.#open.forget();
        this.#visits = undefined;
        this.#clearNodes();
        const bodies = this.view.bodies;
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
        this.#paint.options[3]?.toggleAttribute("disabled", !this.pair.isComplete);
        if (this.#isShown) {
            void this.#show();
        }
    }

    async #show(): Promise<void> {
        if (!this.#isShown) {
            this.#open.hide();
            this.#try(() => this.#repaint());
            return;
        }
        const body = this.#body();
        if (body === undefined) {
            return;
        }
        try {
            const known = this.#known.get(body.file) ?? (await this.view.asker.ask("contents", body.file));
            this.#known.set(body.file, known);
            this.#showContents(body, known);
            await this.#open.show(body);
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
        const check = h(
            "button",
            { type: "button", class: "button", click: () => void this.#validate(body) },
            "Check the whole file",
        );
        fill(this.#contents, ...describeContents(summary, contents, check));
    }

    async #validate(body: Body): Promise<void> {
        const { name } = body.shown.summary;
        try {
            await this.view.asker.ask("validate", body.file);
            this.view.messages.say(`${name} keeps all rules of the format.`);
        } catch (error) {
            this.view.messages.say(describe(name, messageOf(error)), "error");
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
            this.view.stage.place(this.#group, body.pose, body.shown.centre);
        }
        this.#open.place();
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
            this.view.stage.draw();
            return;
        }
        const found = await this.view.asker.ask("level", body.file, level, MAX_NODES + 1, slabs as Slabs);
        if (number !== this.#asked) {
            return;
        }
        this.#clearNodes();
        if (found.count > MAX_NODES) {
            fill(this.#nodesBox, `More than ${countOf(MAX_NODES)} nodes, which are not drawn. Choose a level above.`);
            this.view.stage.draw();
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
        const amber = new Color(this.view.stage.palette.b);
        const box = new Color(this.view.stage.palette.box);
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
        const side = body === this.pair.b ? this.#visits?.b : this.#visits?.a;
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
        const { pair } = this;
        if (paint === "visits" && pair.a !== undefined && pair.b !== undefined) {
            const began = performance.now();
            this.#visits = await this.view.asker.ask(
                "visits",
                pair.a.side,
                pair.b.side,
                pair.pose,
                this.#question.value,
            );
            this.#showVisits(this.#visits, performance.now() - began);
        }
        const known = new Map<number, BufferAttribute>();
        for (const body of this.view.bodies) {
            if (paint === "plain" || !body.shown.hasTriangles) {
                body.paint(undefined, this.look.colourOf(body));
                continue;
            }
            // What is counted differs between both sides of a question, even if they are one file.
            const colours =
                (paint === "visits" ? undefined : known.get(body.file)) ?? (await this.#coloursOf(body, paint));
            known.set(body.file, colours);
            body.paint(colours, this.look.colourOf(body));
        }
        if (this.#polyhedra !== undefined) {
            const { faces, edges } = this.#nodeColours(this.#polyhedra);
            const [drawn, lines] = this.#group.children as [Mesh, LineSegments];
            drawn.geometry.setAttribute("color", new BufferAttribute(faces, 3, true));
            lines.geometry.setAttribute("color", new BufferAttribute(edges, 3, true));
        }
        this.view.stage.draw();
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
            const numbers = await this.view.asker.ask("packets", body.file);
            numbers.forEach((number, triangle) => {
                put(triangle, number, () => distinct(number, colour));
            });
        } else {
            const side = body === this.pair.b ? this.#visits?.b : this.#visits?.a;
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
        const choose = (from: HTMLSelectElement, value: string | undefined) => {
            if ([...from.options].some((option) => option.value === value && !option.disabled)) {
                from.value = value ?? "";
            }
        };
        choose(this.#slabs, values.draw);
        choose(this.#paint, values.paint);
        const [file, level] = [this.#body()?.file, Number(values.level)];
        if (file !== undefined && Number.isInteger(level) && level >= 0) {
            this.#level.dataset.file = String(file);
            this.#level.max = String(level);
            this.#level.value = String(level);
        }
    }

    get state(): { draw: string; level: string; paint: string } {
        return { draw: this.#slabs.value, level: this.#level.value, paint: this.#paint.value };
    }
}
