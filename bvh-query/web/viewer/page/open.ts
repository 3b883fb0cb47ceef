/** Why a file is open: how many edges of which kind leave it open, the first ones in a list, and lines on the stage. */

import { BufferAttribute, BufferGeometry, Group, LineBasicMaterial, LineSegments, Points, PointsMaterial } from "three";
import type { OpenEdge } from "../../ts/answers.js";
import type { Handlers } from "../worker/worker.js";
import type { Body } from "./bodies.js";
import { fill, h } from "./dom.js";
import { describe, messageOf } from "./errors.js";
import { part } from "./panel.js";
import type { View } from "./view.js";

/** The size of a dot at an end of an edge, in pixels: an edge may be too short to be seen. */
const DOT = 7;

/** The open edges of one file. */
export class Open {
    readonly element = h("div");
    readonly #group = new Group();
    readonly #known = new Map<number, ReturnType<Handlers["openEdges"]>>();
    #body: Body | undefined;

    constructor(readonly view: View) {
        view.stage.scene.add(this.#group);
    }

    /** Forgets all files. */
    forget(): void {
        this.#known.clear();
        this.hide();
    }

    hide(): void {
        for (const child of [...this.#group.children]) {
            child.removeFromParent();
            if (child instanceof LineSegments || child instanceof Points) {
                (child.geometry as BufferGeometry).dispose();
                (child.material as LineBasicMaterial).dispose();
            }
        }
        this.#body = undefined;
        fill(this.element);
        this.view.stage.draw();
    }

    /** Shows the open edges of a file, of which there are none if it is closed. */
    async show(body: Body): Promise<void> {
        this.hide();
        if (body.shown.summary.closed !== false) {
            return;
        }
        this.#body = body;
        try {
            const found = this.#known.get(body.file) ?? (await this.view.asker.ask("openEdges", body.file));
            this.#known.set(body.file, found);
            if (this.#body === body) {
                this.#list(found);
                this.#draw(body, found.edges);
            }
        } catch (error) {
            fill(this.element, describe(body.shown.summary.name, messageOf(error)));
        }
    }

    #list({ text, edges }: ReturnType<Handlers["openEdges"]>): void {
        const rows = edges.map(({ kind, object, triangles, gap }) =>
            h(
                "tr",
                {},
                h("td", {}, kind),
                h("td", {}, String(object)),
                h("td", {}, [...triangles].join(", ")),
                h("td", {}, gap === undefined ? "" : gap.toExponential(2)),
            ),
        );
        const titles = ["edge", "object", "triangles", "gap"].map((title) => h("th", {}, title));
        const table = h("table", {}, h("thead", {}, h("tr", {}, ...titles)), h("tbody", {}, ...rows));
        fill(this.element, part("Open edges", h("p", {}, text), table));
    }

    #draw(body: Body, edges: OpenEdge[]): void {
        const [x = 0, y = 0, z = 0] = body.shown.centre;
        const ends = edges.flatMap(({ from, to }) => [...from, ...to]);
        const places = Float32Array.from(ends, (value, k) => value - ([x, y, z][k % 3] ?? 0));
        const geometry = () => new BufferGeometry().setAttribute("position", new BufferAttribute(places, 3));
        const look = { color: this.view.stage.palette.hit, depthTest: false, transparent: true };
        const lines = new LineSegments(geometry(), new LineBasicMaterial(look));
        const dots = new Points(geometry(), new PointsMaterial({ ...look, size: DOT, sizeAttenuation: false }));
        for (const drawn of [lines, dots]) {
            drawn.frustumCulled = false;
            drawn.renderOrder = 5;
            this.#group.add(drawn);
        }
        this.place();
    }

    /** Puts the lines where the file is. */
    place(): void {
        if (this.#body !== undefined) {
            this.view.stage.place(this.#group, this.#body.pose, this.#body.shown.centre);
        }
    }
}
