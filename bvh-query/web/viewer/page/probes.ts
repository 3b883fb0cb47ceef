/** Points and rays: typed, asked of one mesh, and shown on the stage and as numbers. */

import type { Body } from "./bodies.js";
import { exact, fill, h, pointOf } from "./dom.js";
import { messageOf } from "./errors.js";
import { Overlay } from "./overlays.js";
import type { Pair } from "./pair.js";
import { part } from "./panel.js";
import type { View } from "./view.js";

const SIDES = new Map([
    [1, "inside"],
    [0, "on the surface"],
    [-1, "outside"],
    [2, "undefined: not closed"],
]);

/** Reads lines of numbers. */
function linesOf(text: string, count: number, name: string): Float64Array {
    const rows: number[] = [];
    text.split("\n").forEach((line, number) => {
        const words = (line.split("#")[0] ?? "").split(/[\s,;]+/).filter((word) => word !== "");
        if (words.length === 0) {
            return;
        }
        const numbers = words.map(Number);
        if (numbers.length !== count || !numbers.every(Number.isFinite)) {
            throw new Error(`line ${number + 1}: expected ${count} numbers for a ${name}, found "${line.trim()}"`);
        }
        rows.push(...numbers);
    });
    return Float64Array.from(rows);
}

export class Probes {
    readonly #page: HTMLElement;
    readonly #overlay: Overlay;
    readonly #body = h("select", { class: "field", "aria-label": "Mesh" });
    readonly #points = h("textarea", {
        class: "code",
        rows: "4",
        spellcheck: "false",
        placeholder: "x y z",
        "aria-label": "Points, three numbers on each line",
    });
    readonly #rays = h("textarea", {
        class: "code",
        rows: "4",
        spellcheck: "false",
        placeholder: "x y z   dx dy dz",
        "aria-label": "Rays, six numbers on each line: the origin and the direction",
    });
    readonly #pointAnswers = h("div");
    readonly #rayAnswers = h("div");
    #asked = 0;

    constructor(
        readonly view: View,
        pair: Pair,
    ) {
        this.#overlay = new Overlay(view.stage, 40);
        this.#overlay.isVisible = false;
        this.#page = view.panel.add("probes", "Probes", (shown) => {
            this.#overlay.isVisible = shown;
            if (shown) {
                void this.ask();
            }
        });
        for (const input of [this.#points, this.#rays, this.#body]) {
            input.addEventListener("input", () => void this.ask());
        }
        pair.onAnswer.push(() => {
            if (view.panel.current === "probes") {
                void this.ask();
            }
        });
        const example = h("button", { type: "button", class: "button", click: () => this.#example() }, "Example");
        this.#page.append(
            h("div", { class: "fields" }, h("span", { class: "fields-title" }, "ask"), this.#body, example),
            h("p", { class: "muted" }, "Coordinates are those of the stage, which is the frame of A."),
            part("Points: the closest surface, and the side", this.#points, this.#pointAnswers),
            part("Rays: the first hit", this.#rays, this.#rayAnswers),
        );
    }

    offer(): void {
        fill(this.#body, ...this.view.bodies.map((body, k) => h("option", { value: String(k) }, body.name)));
        this.#overlay.clear();
        fill(this.#pointAnswers);
        fill(this.#rayAnswers);
    }

    get #chosen(): Body | undefined {
        return this.view.bodies[Number(this.#body.value)];
    }

    #example(): void {
        const [x0 = 0, y0 = 0, z0 = 0, x1 = 0, y1 = 0, z1 = 0] = this.#chosen?.shown.summary.bounds ?? [];
        const round = (value: number) => String(Number(value.toPrecision(4)));
        const [x, y, z] = [(x0 + x1) / 2, (y0 + y1) / 2, (z0 + z1) / 2].map(round);
        const above = round(z1 + 0.4 * (z1 - z0 || x1 - x0));
        const left = round(x0 - 0.4 * (x1 - x0));
        this.#points.value = `${x} ${y} ${z}\n${x} ${y} ${above}\n${left} ${y} ${z}\n`;
        this.#rays.value = `${round(x0 + 0.3 * (x1 - x0))} ${y} ${above}  0 0 -1\n${left} ${y} ${z}  1 0.1 0\n`;
        void this.ask();
    }

    async ask(): Promise<void> {
        const body = this.#chosen;
        const number = ++this.#asked;
        if (body === undefined) {
            return;
        }
        this.#overlay.clear();
        const { palette } = this.view.stage;
        const size = this.view.size;
        try {
            const points = linesOf(this.#points.value, 3, "point");
            const { closest, sides } = await this.view.asker.ask("points", body.file, points, body.pose);
            if (number !== this.#asked) {
                return;
            }
            const segments: number[] = [];
            const rows = Array.from({ length: points.length / 3 }, (_, k) => {
                const [from, to] = [points.subarray(3 * k, 3 * k + 3), closest.point.subarray(3 * k, 3 * k + 3)];
                segments.push(...from, ...to);
                this.#overlay.label(String(k + 1), from, "probe");
                return h(
                    "tr",
                    {},
                    h("td", {}, String(k + 1)),
                    h("td", {}, exact(closest.distance[k] ?? 0)),
                    h("td", {}, SIDES.get(sides?.[k] ?? 2) ?? ""),
                    h("td", {}, String(closest.triangle[k] ?? "")),
                    h("td", {}, pointOf(to)),
                );
            });
            this.#overlay.segments(segments, palette.near, 2.5);
            this.#overlay.dots(points, palette.select, 11);
            this.#overlay.dots(closest.point, palette.near, 9);
            fill(
                this.#pointAnswers,
                rows.length > 0 && table(["", "distance", "side", "triangle", "closest point"], rows),
            );
        } catch (error) {
            fill(this.#pointAnswers, h("p", { class: "problem" }, messageOf(error)));
        }
        try {
            const rays = linesOf(this.#rays.value, 6, "ray");
            const count = rays.length / 6;
            const half = (start: number) =>
                Float64Array.from({ length: 3 * count }, (_, k) => rays[6 * Math.floor(k / 3) + start + (k % 3)] ?? 0);
            const [origins, directions] = [half(0), half(3)];
            const hits = await this.view.asker.ask("rays", body.file, origins, directions, body.pose);
            if (number !== this.#asked) {
                return;
            }
            const [hit, missed, dots]: [number[], number[], number[]] = [[], [], []];
            const rows = Array.from({ length: count }, (_, k) => {
                const [from, along] = [origins.subarray(3 * k, 3 * k + 3), directions.subarray(3 * k, 3 * k + 3)];
                const found = hits.found[k] === 1;
                const to = hits.point.subarray(3 * k, 3 * k + 3);
                if (found) {
                    hit.push(...from, ...to);
                    dots.push(...to);
                } else {
                    const length = (2 * size) / (Math.hypot(...along) || 1);
                    missed.push(...from, ...Array.from(from, (value, axis) => value + length * (along[axis] ?? 0)));
                }
                return h(
                    "tr",
                    {},
                    h("td", {}, String(k + 1)),
                    h("td", {}, found ? exact(hits.t[k] ?? 0) : "no hit"),
                    h("td", {}, found ? String(hits.triangle[k]) : ""),
                    h("td", {}, found && pointOf(to)),
                );
            });
            this.#overlay.segments(hit, palette.normal, 2.5);
            this.#overlay.segments(missed, palette.still, 2, { dashed: true });
            this.#overlay.dots(origins, palette.normal, 8);
            this.#overlay.dots(dots, palette.hit, 11);
            fill(this.#rayAnswers, rows.length > 0 && table(["", "t", "triangle", "point"], rows));
        } catch (error) {
            fill(this.#rayAnswers, h("p", { class: "problem" }, messageOf(error)));
        }
    }
}

const table = (head: string[], rows: HTMLElement[]): HTMLElement =>
    h(
        "div",
        { class: "scroll" },
        h("table", {}, h("thead", {}, h("tr", {}, ...head.map((text) => h("th", {}, text)))), h("tbody", {}, ...rows)),
    );
