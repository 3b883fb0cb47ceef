/** The triangle that was asked about: which one a click hits, and a card that says where it is stored. */

import type { Place } from "../worker/files.js";
import { countOf, fact, fill, h, iconButton, pointOf } from "./dom.js";
import { messageOf } from "./errors.js";
import { Overlay } from "./overlays.js";
import { move } from "./pose.js";
import type { View } from "./view.js";

/** Where a ray hit. */
interface Hit {
    point: Float64Array;
    object: number;
    triangle: number;
}

export class Selection {
    /** The number of the body, and the place of the triangle in the drawn order. */
    current: { body: number; triangle: number } | undefined;
    readonly #overlay: Overlay;
    readonly #card = h("div", { class: "card", hidden: true });

    constructor(readonly view: View) {
        this.#overlay = new Overlay(view.stage, 50);
        view.stageElement.append(this.#card);
        const { canvas } = view.stage;
        let down: { x: number; y: number; free: boolean } | undefined;
        canvas.addEventListener("pointerdown", ({ clientX, clientY }) => {
            down = { x: clientX, y: clientY, free: !view.handles.isHovered };
        });
        canvas.addEventListener("pointerup", (event) => {
            const isClick = down?.free === true && Math.hypot(event.clientX - down.x, event.clientY - down.y) < 5;
            down = undefined;
            if (isClick && event.button === 0) {
                void this.#pick(event.clientX, event.clientY);
            }
        });
    }

    pickMiddle(): void {
        const { left, top, width, height } = this.view.stage.canvas.getBoundingClientRect();
        void this.#pick(left + width / 2, top + height / 2);
    }

    /** Asks which triangle a ray from the eye hits first: the library itself answers. */
    async #pick(clientX: number, clientY: number): Promise<void> {
        const { asker, bodies, messages, stage } = this.view;
        if (bodies.length === 0) {
            return;
        }
        const { origin, direction } = stage.rayAt(clientX, clientY);
        const [from, along] = [Float64Array.from(origin), Float64Array.from(direction)];
        try {
            let nearest: (Hit & { body: number; t: number; place: number }) | undefined;
            for (const number of await this.#candidates(from, along)) {
                const body = bodies[number];
                if (body === undefined || !body.isVisible) {
                    continue;
                }
                const { hits, places } = await asker.ask("firstHit", body.file, from, along, body.pose);
                const t = hits.t[0] ?? 0;
                if (hits.found[0] === 1 && (nearest === undefined || t < nearest.t)) {
                    const [object = 0, triangle = 0] = [hits.object[0], hits.triangle[0]];
                    nearest = { body: number, t, place: places[0] ?? -1, point: hits.point, object, triangle };
                }
            }
            if (nearest === undefined) {
                this.clear();
                return;
            }
            await this.select(nearest.body, nearest.place, nearest);
        } catch (error) {
            messages.say(messageOf(error), "error");
        }
    }

    async #candidates(from: Float64Array, along: Float64Array): Promise<number[]> {
        if (this.view.mode !== "scene") {
            return this.view.bodies.map((_, k) => k);
        }
        const { instance } = await this.view.asker.ask("sceneHit", from, along);
        return instance < 0 ? [] : [instance];
    }

    /** Shows a triangle of a body. Without a hit, one that is not drawn is not shown. */
    async select(number: number, triangle: number, hit?: Hit): Promise<void> {
        const { view } = this;
        const body = view.bodies[number];
        const isDrawn = body?.shown.hasTriangles === true && body.shown.has(triangle);
        if (body === undefined || (hit === undefined && !isDrawn)) {
            return;
        }
        this.clear();
        if (view.mode === "scene" && !view.isRobot) {
            view.handles.attach(body);
        }
        this.current = { body: number, triangle };
        const { shown } = body;
        const { palette } = view.stage;
        let place: Place | undefined;
        if (isDrawn) {
            place = await view.asker.ask("place", body.file, triangle);
            const corners = shown.triangle(triangle);
            const corner = (k: number) => [0, 1, 2].map((axis) => (corners[k + axis] ?? 0) + (shown.centre[axis] ?? 0));
            const [a, b, c] = [move(body.pose, corner(0)), move(body.pose, corner(3)), move(body.pose, corner(6))];
            this.#overlay.triangles(body, Uint32Array.of(triangle), palette.select, 0.35);
            this.#overlay.segments([...a, ...b, ...b, ...c, ...c, ...a], palette.select, 2.5);
        }
        if (hit !== undefined) {
            this.#overlay.dots(hit.point, palette.select, 9);
        }
        const id = place?.id ?? hit?.triangle;
        const object = place?.object ?? hit?.object ?? 0;
        const { objects } = shown.summary;
        this.#card.hidden = false;
        fill(
            this.#card,
            iconButton("close", "Close (Esc)", () => this.clear()),
            h("div", { class: "card-title" }, id === undefined ? body.name : `${body.name}, triangle ${countOf(id)}`),
            h(
                "dl",
                { class: "facts" },
                objects[object] !== undefined && objects[object] !== "" && fact("object", objects[object]),
                objects.length > 1 && fact("object number", String(object)),
                place !== undefined && fact("leaf packet", `${place.packet} of page ${place.page}`),
                hit !== undefined && fact("point", pointOf(hit.point)),
            ),
        );
    }

    clear(): void {
        this.current = undefined;
        this.#card.hidden = true;
        this.#overlay.clear();
    }
}
