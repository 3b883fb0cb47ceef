/** Two meshes: moves B, asks about each pose, and shows the answers on the stage and as numbers. */

import type { DeepAnswer, NearAnswer } from "../worker/pairs.js";
import { Latest } from "./asker.js";
import type { Body } from "./bodies.js";
import { countOf, exact, fact, fill, h, milliseconds, pointOf, short } from "./dom.js";
import { messageOf } from "./errors.js";
import { Overlay } from "./overlays.js";
import { part } from "./panel.js";
import { axisAngle, fromAxisAngle, identity, numbersOf, type Pose, placedAt, position, words } from "./pose.js";
import { sharedFacts, trianglesOf } from "./shared.js";
import type { View } from "./view.js";

/** By the number of the relation. Of a mesh that is not closed nobody knows what is inside, but surfaces are apart or not. */
const RELATIONS = ["Touching", "Apart", "A is inside B", "B is inside A", "Partly inside", "Surfaces apart"] as const;
const APART = 1;
const UNDEFINED = 5;
/** More normals than this are not drawn: those of the largest patches are. */
const MAX_ARROWS = 24;
/** How long the pose stays before what takes longer is asked, in milliseconds. */
const PAUSE = 90;

export class Pair {
    #a: Body | undefined;
    #b: Body | undefined;
    pose: Pose = identity();
    /** The distance that the command was asked to compare with. */
    within: number | undefined;
    readonly #overlay: Overlay;
    readonly #deepOverlay: Overlay;
    readonly #latest = new Latest();
    readonly #answer = h("div", { class: "answer", "aria-live": "polite" });
    readonly #depth = h("div");
    readonly #speed = h("div", { class: "row" });
    readonly #fields: Record<string, HTMLInputElement> = {};
    readonly #rows = h("textarea", {
        class: "code",
        rows: "3",
        spellcheck: "false",
        "aria-label": "Twelve numbers of the pose",
    });
    #timer = 0;
    #asked = 0;
    near: NearAnswer | undefined;
    /** Called after each answer. */
    readonly onAnswer: ((answer: NearAnswer) => void)[] = [];

    constructor(readonly view: View) {
        this.#overlay = new Overlay(view.stage, 20);
        this.#deepOverlay = new Overlay(view.stage, 30);
        view.panel
            .add("pair", "Pair")
            .append(
                this.#answer,
                part("Depth and contact", this.#depth),
                part("Place of B in the frame of A", this.#poseFields()),
                part("Speed", this.#speed),
            );
        const measure = h("button", { type: "button", class: "button", click: () => void this.#measure() }, "Measure");
        fill(this.#speed, measure, h("span", { class: "muted" }, "questions per second in this page"));
    }

    get a(): Body | undefined {
        return this.#a;
    }

    get b(): Body | undefined {
        return this.#b;
    }

    get isComplete(): boolean {
        return this.#a !== undefined && this.#b !== undefined;
    }

    /** Adopts two meshes, or one. */
    async set(a: Body | undefined, b: Body | undefined, pose: Pose): Promise<void> {
        this.#a = a;
        this.#b = b;
        this.view.handles.attach(b);
        this.clear();
        if (b !== undefined) {
            await this.setPose(pose);
        }
    }

    clear(): void {
        clearTimeout(this.#timer);
        this.#asked++;
        this.near = undefined;
        this.#overlay.clear();
        this.#deepOverlay.clear();
        fill(this.#answer);
        fill(this.#depth);
    }

    /** Moves B, and asks. The answer has been shown when the promise is done. */
    setPose(pose: Pose): Promise<void> {
        const { b } = this;
        if (b === undefined) {
            return Promise.resolve();
        }
        this.pose = pose;
        b.setPose(pose);
        this.view.handles.follow();
        this.#showPose();
        return this.refresh();
    }

    /** Asks about the pose again. */
    refresh(): Promise<void> {
        clearTimeout(this.#timer);
        const number = ++this.#asked;
        return this.#latest.run(async () => {
            await this.#ask(this.pose);
            if (number === this.#asked) {
                this.#timer = window.setTimeout(() => void this.#latest.run(() => this.#askMore(number)), PAUSE);
            }
        });
    }

    async #ask(pose: Pose): Promise<void> {
        const { a, b } = this;
        if (a === undefined || b === undefined) {
            return;
        }
        try {
            const near = await this.view.asker.ask("near", a.side, b.side, pose, this.within);
            this.near = near;
            this.#showNear(near);
            this.view.setAnswer({
                distance: near.distance.distance,
                lower: near.distance.lower,
                upper: near.distance.upper,
                relation: near.relation,
                contacts: near.contacts,
                triangles: [a.shown.summary.triangles, b.shown.summary.triangles],
                pose: [...pose],
            });
            for (const told of this.onAnswer) {
                told(near);
            }
        } catch (error) {
            // What was known of another pose is no answer.
            this.near = undefined;
            this.#overlay.clear();
            this.#deepOverlay.clear();
            fill(this.#answer, h("p", { class: "problem" }, messageOf(error)));
            fill(this.#depth);
            this.view.setAnswer({ distance: null, error: messageOf(error), pose: [...pose] });
        }
    }

    async #askMore(number: number): Promise<void> {
        const { a, b, near } = this;
        if (a === undefined || b === undefined || near === undefined || number !== this.#asked) {
            return;
        }
        if (isApart(near)) {
            return;
        }
        try {
            const deep = await this.view.asker.ask("deep", a.side, b.side, this.pose);
            if (number === this.#asked) {
                this.#showDeep(deep);
            }
        } catch (error) {
            fill(this.#depth, h("p", { class: "problem" }, messageOf(error)));
        }
    }

    #showNear(near: NearAnswer): void {
        const { a, b } = this;
        if (a === undefined || b === undefined) {
            return;
        }
        const { distance } = near;
        const { palette } = this.view.stage;
        this.#overlay.clear();
        this.#deepOverlay.clear();
        if (near.contacts > 0) {
            this.#overlay.triangles(a, near.touchingA, palette.hit);
            this.#overlay.triangles(b, near.touchingB, palette.hit);
        } else {
            const ends = [...distance.pointA, ...distance.pointB];
            this.#overlay.segments(ends, palette.near, 3);
            this.#overlay.dots(ends, palette.near, 11);
            const middle = [0, 1, 2].map((k) => ((ends[k] ?? 0) + (ends[k + 3] ?? 0)) / 2);
            if (distance.distance > 0) {
                this.#overlay.label(short(distance.distance), middle, "near");
            }
        }
        const touches = near.contacts > 0 || distance.distance === 0;
        const name = RELATIONS[near.relation ?? (touches ? 0 : UNDEFINED)] ?? "";
        const kind = touches ? "hit" : isApart(near) ? "free" : "in";
        const summary = (body: Body, object: number, triangle: number) => {
            const { objects } = body.shown.summary;
            const of = objects.length > 1 ? ` of ${objects[object] || `object ${object}`}` : "";
            return `${countOf(triangle)}${of}`;
        };
        fill(
            this.#answer,
            h("div", { class: `relation ${kind}` }, name),
            h(
                "div",
                { class: "headline" },
                h("span", { class: "headline-number", title: String(distance.distance) }, short(distance.distance)),
                h("span", { class: "muted" }, touches ? "they have points in common" : "mesh units apart"),
            ),
            h(
                "dl",
                { class: "facts" },
                distance.lower !== distance.upper &&
                    fact(
                        "certainly",
                        h(
                            "span",
                            { class: "number", title: `${distance.lower} to ${distance.upper}` },
                            `${distance.lower} to ${distance.upper}`,
                        ),
                    ),
                near.within !== undefined && fact(`within ${this.within}`, near.within ? "yes" : "no"),
                touches && fact("contacts", `${countOf(near.contacts)} pairs of triangles`),
                fact("point on A", pointOf(distance.pointA)),
                fact("point on B", pointOf(distance.pointB)),
                fact("triangle of A", summary(a, distance.objectA, distance.triangleA)),
                fact("triangle of B", summary(b, distance.objectB, distance.triangleB)),
                near.relation === UNDEFINED && fact("inside", "unknown, because a mesh is not closed"),
                near.relation === undefined && fact("inside", "unknown, because a file does not state what is closed"),
                fact("answered in", `${milliseconds(near.distanceTook)} (distance), ${milliseconds(near.took)} (all)`),
            ),
        );
        fill(this.#depth, h("p", { class: "muted" }, isApart(near) ? `${name}.` : "…"));
    }

    #showDeep(deep: DeepAnswer): void {
        const { palette } = this.view.stage;
        const { near } = this;
        const { depth } = deep;
        this.#deepOverlay.clear();
        if (deep.shared !== undefined) {
            const { surface } = deep.shared;
            this.#deepOverlay.solid(surface.points, trianglesOf(surface), palette.shared);
        }
        this.#deepOverlay.segments(deep.curves, palette.hit, 2.5, { faint: 0.55 });
        const size = this.view.size;
        for (let k = 0; k < Math.min(deep.centres.length, 3 * MAX_ARROWS); k += 3) {
            const normal = deep.normals.subarray(k, k + 3);
            const length = 0.05 * size;
            this.#deepOverlay.arrow(
                deep.centres.subarray(k, k + 3),
                Array.from(normal, (value) => value * length),
                palette.normal,
                0.005,
            );
        }
        const rows: (HTMLElement | false)[] = [fact("patches", countOf(deep.patches))];
        if (typeof depth === "string") {
            rows.unshift(fact("depth", h("span", { class: "muted" }, this.#whyNoDepth() ?? depth)));
        } else {
            const from = near?.contacts === 0 ? near.distance.pointB : firstOf(deep.centres, depth.point);
            this.#deepOverlay.arrow(from, depth.translation, palette.depth, 0.012);
            if (depth.upper > 0.02 * size) {
                const tip = [0, 1, 2].map((k) => (from[k] ?? 0) + (depth.translation[k] ?? 0));
                this.#deepOverlay.label(`${short(depth.upper)} out`, tip, "depth");
            }
            rows.unshift(
                fact("depth", h("span", {}, "from ", exact(depth.lower), " to ", exact(depth.upper))),
                fact("moves B out", pointOf(depth.translation)),
            );
        }
        if (deep.shared !== undefined) {
            rows.push(...sharedFacts(deep.shared.measures));
        }
        rows.push(fact("answered in", milliseconds(deep.took)));
        const out =
            typeof depth !== "string" &&
            depth.upper > 0 &&
            h(
                "button",
                { type: "button", class: "button", click: () => this.#moveOut(depth.translation) },
                "Move B out",
            );
        fill(this.#depth, h("dl", { class: "facts" }, ...rows), out);
    }

    /** Says which meshes are not closed; `undefined` if another reason than that is in the way. */
    #whyNoDepth(): string | undefined {
        const open = [this.a, this.b].filter((body) => body?.shown.summary.closed === false);
        const names = open.map((body) => body?.name).join(" and ");
        return open.length > 0 ? `none, because ${names} ${open.length > 1 ? "are" : "is"} not closed` : undefined;
    }

    #moveOut(translation: Float64Array): void {
        const [x, y, z] = position(this.pose);
        const [dx = 0, dy = 0, dz = 0] = translation;
        void this.setPose(placedAt(this.pose, [x + dx, y + dy, z + dz]));
    }

    #poseFields(): HTMLElement {
        const field = (name: string, title: string, unit = "") => {
            const input = h("input", {
                type: "number",
                step: "any",
                class: "field",
                title,
                "aria-label": title,
                change: () => this.#readFields(),
            });
            this.#fields[name] = input;
            return h("label", { class: "field-of" }, h("span", {}, name.slice(-1)), input, unit);
        };
        const row = (title: string, ...fields: HTMLElement[]) =>
            h("div", { class: "fields" }, h("span", { class: "fields-title" }, title), ...fields);
        const above = (title: string, ...fields: HTMLElement[]) =>
            h("div", {}, h("div", { class: "fields-title" }, title), h("div", { class: "fields" }, ...fields));
        this.#rows.addEventListener("change", () => this.#readRows());
        const home = h(
            "button",
            { type: "button", class: "button", click: () => void this.setPose(identity()) },
            "Identity",
        );
        const copy = h(
            "button",
            { type: "button", class: "button", click: () => void this.view.copy(words(this.pose), "The pose") },
            "Copy",
        );
        return h(
            "div",
            {},
            above("position", field("px", "Position, x"), field("py", "Position, y"), field("pz", "Position, z")),
            above("axis of the rotation", field("ax", "Axis, x"), field("ay", "Axis, y"), field("az", "Axis, z")),
            row("angle", field("a°", "Angle in degrees")),
            h("div", { class: "fields-title" }, "rows of the 3 by 4 matrix"),
            this.#rows,
            h("div", { class: "row" }, copy, home),
        );
    }

    #showPose(): void {
        const { axis, angle } = axisAngle(this.pose);
        const values = {
            px: this.pose[3],
            py: this.pose[7],
            pz: this.pose[11],
            ax: axis[0],
            ay: axis[1],
            az: axis[2],
            "a°": angle,
        };
        for (const [name, value] of Object.entries(values)) {
            const field = this.#fields[name];
            if (field !== undefined && document.activeElement !== field) {
                field.value = String(Number((value ?? 0).toPrecision(7)));
            }
        }
        if (document.activeElement !== this.#rows) {
            const row = (at: number) => Array.from(this.pose.subarray(at, at + 4), String).join("  ");
            this.#rows.value = [0, 4, 8].map(row).join("\n");
        }
    }

    #readFields(): void {
        const value = (name: string) => Number(this.#fields[name]?.value ?? 0);
        const [at, axis] = [["px", "py", "pz"].map(value), ["ax", "ay", "az"].map(value)];
        const angle = value("a°");
        const place: [number, number, number] = [at[0] ?? 0, at[1] ?? 0, at[2] ?? 0];
        const known = axisAngle(this.pose);
        const turned =
            Math.abs(known.angle - angle) > 1e-6 || axis.some((v, k) => Math.abs(v - (known.axis[k] ?? 0)) > 1e-6);
        void this.setPose(turned ? fromAxisAngle(axis, angle, place) : placedAt(this.pose, place));
    }

    #readRows(): void {
        const numbers = numbersOf(this.#rows.value);
        if (numbers.length === 12 && numbers.every(Number.isFinite)) {
            this.#rows.classList.remove("wrong");
            void this.setPose(Float64Array.from(numbers));
        } else {
            this.#rows.classList.add("wrong");
            const found = numbers.length === 12 ? "one that is not finite" : String(numbers.length);
            this.view.messages.say(`A pose has 12 finite numbers, found ${found}.`);
        }
    }

    async #measure(): Promise<void> {
        const { a, b } = this;
        if (a === undefined || b === undefined) {
            return;
        }
        const { distance, collide } = await this.view.asker.ask("speed", a.side, b.side, this.pose);
        const text = `${countOf(Math.round(distance))} distances, ${countOf(Math.round(collide))} contact tests per second`;
        fill(this.#speed, this.#speed.firstChild ?? undefined, h("span", {}, text));
    }
}

/** The first of some points, or another one if there are none. */
const firstOf = (points: Float64Array, other: Float64Array): Float64Array =>
    points.length >= 3 ? points.slice(0, 3) : other;

/** Whether nothing touches, and nothing is known to be inside. */
export const isApart = ({ distance, relation = UNDEFINED }: NearAnswer): boolean =>
    distance.distance > 0 && (relation === APART || relation === UNDEFINED);
