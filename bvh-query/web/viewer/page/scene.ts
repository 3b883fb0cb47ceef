/** Scenes: frames of moving instances with a slider, the pairs that touch, and the nearest pair. Clash reports: a list. */

import type { Intersection } from "../../ts/answers.js";
import type { FrameAnswer } from "../worker/scenes.js";
import { Latest } from "./asker.js";
import type { Body } from "./bodies.js";
import type { Content, ContentClash, ContentInstance } from "./content.js";
import { countOf, exact, fact, fill, h, milliseconds, pointOf, short } from "./dom.js";
import { messageOf } from "./errors.js";
import type { Look, Tint } from "./look.js";
import { Overlay } from "./overlays.js";
import { isApart } from "./pair.js";
import { part } from "./panel.js";
import { Player } from "./player.js";
import { move, type Pose } from "./pose.js";
import { piercedFacts, sharedFacts, trianglesOf } from "./shared.js";
import type { View } from "./view.js";

type SceneShow = Extract<Content["show"], { kind: "scene" | "clash" }>;

/** Frames per second while the frames play. */
const RATE = 24;
/** More pairs than this are not listed. */
const MAX_LISTED = 400;
/** More clashes than this are not listed. */
const MAX_LISTED_CLASHES = 2000;

export class SceneView implements Tint {
    readonly #overlay: Overlay;
    readonly #pairOverlay: Overlay;
    readonly #frameBox = h("div", { class: "answer" });
    readonly #list = h("div", { class: "list", role: "listbox", "aria-label": "Pairs that touch" });
    readonly #clashBox = h("div");
    readonly #player = new Player(
        "Frame",
        "1",
        (frame) => this.go(frame),
        () => this.#begin(),
    );
    readonly #filter = h("select", { class: "field", "aria-label": "Class of clashes" });
    readonly #latest = new Latest();
    #instances: ContentInstance[] = [];
    #clashes: ContentClash[] = [];
    #frames: number[][] = [];
    #moving: number[] = [];
    /** The names of instances that touch: a body of a robot has several, which have one name. */
    #touching = new Set<string>();
    #chosen: [number, number] | undefined;
    /** What a robot adds to the tab. */
    readonly extra = h("div");
    /** Instances that are coloured although they do not touch, by their names. */
    readonly marks = new Map<string, "hit" | "near">();

    constructor(
        readonly view: View,
        readonly look: Look,
    ) {
        this.#overlay = new Overlay(view.stage, 20);
        this.#pairOverlay = new Overlay(view.stage, 30);
        const scene = view.panel.add("scene", "Scene");
        scene.append(this.#frameBox, this.extra, this.#player.element, part("Pairs that touch", this.#list));
        const clash = view.panel.add("clash", "Clashes");
        clash.append(
            h("div", { class: "fields" }, h("span", { class: "fields-title" }, "show"), this.#filter),
            this.#clashBox,
        );
        this.#filter.addEventListener("change", () => this.#listClashes());
    }

    get frame(): number {
        return this.#player.value;
    }

    clear(): void {
        this.stop();
        this.#overlay.clear();
        this.#pairOverlay.clear();
        this.#instances = [];
        this.#clashes = [];
        this.#frames = [];
        this.#touching.clear();
        this.marks.clear();
        this.#chosen = undefined;
        this.look.tint = undefined;
    }

    async set(show: SceneShow): Promise<void> {
        this.clear();
        const { view } = this;
        this.look.tint = this;
        this.#instances = show.instances;
        this.#moving = show.instances.flatMap((instance, k) => (instance.moving ? [k] : []));
        await view.asker.ask(
            "makeScene",
            show.instances.map((instance) => ({ ...instance, pose: Float64Array.from(instance.pose) })),
            show.kind === "scene" ? show.allowed : [],
            show.kind === "scene" ? (show.pair_margins ?? []) : [],
        );
        if (show.kind === "scene") {
            this.#frames = show.frames;
            this.#player.slider.max = String(Math.max(this.#frames.length - 1, 0));
            this.#player.element.hidden = this.#frames.length < 2;
            await this.go(0);
        } else {
            this.#clashes = show.clashes;
            const classes = [...new Set(show.clashes.map((clash) => clash.class))];
            fill(
                this.#filter,
                h("option", { value: "" }, `all ${show.clashes.length}`),
                ...classes.map((name) => {
                    const count = show.clashes.filter((clash) => clash.class === name).length;
                    return h("option", { value: name }, `${name}: ${count}`);
                }),
            );
            this.#listClashes();
            this.look.apply();
            // The report is the command's. The page answers once a clash is chosen.
            view.setAnswer({ distance: null, clashes: show.clashes.length });
        }
    }

    #name(instance: number): string {
        return this.#instances[instance]?.name || `instance ${instance}`;
    }

    /** Shows a frame, counted from 0. */
    go(to: number): Promise<void> {
        if (this.#chosen !== undefined) {
            this.release();
        }
        const frame = this.#player.nearest(to);
        this.#player.show(frame, `${frame + 1} / ${this.#frames.length}`);
        const numbers = this.#frames[frame] ?? [];
        this.#moving.forEach((instance, k) => {
            const pose = Float64Array.from(numbers.slice(12 * k, 12 * k + 12));
            if (pose.length === 12) {
                this.view.bodies[instance]?.setPose(pose);
            }
        });
        this.view.handles.follow();
        return this.refresh();
    }

    /** Asks about the poses of all instances again. */
    refresh(): Promise<void> {
        const { view } = this;
        return this.#latest.run(async () => {
            const movable = Uint32Array.from(view.bodies, (_, k) => k);
            const poses = Float64Array.from(view.bodies.flatMap((body) => [...body.pose]));
            try {
                this.#showFrame(await view.asker.ask("frame", movable, poses));
            } catch (error) {
                // What was known of another frame is no answer.
                this.#touching.clear();
                this.recolour();
                this.#overlay.clear();
                fill(this.#list);
                fill(this.#frameBox, h("p", { class: "problem" }, messageOf(error)));
                view.setAnswer({ distance: null, error: messageOf(error), frame: this.frame });
            }
        });
    }

    #showFrame({ touching, nearest, took }: FrameAnswer): void {
        const { view } = this;
        const { palette } = view.stage;
        // One pair of instances for each pair of names.
        const named = new Map<string, [number, number]>();
        for (let k = 0; k + 1 < touching.length; k += 2) {
            const [a, b] = [touching[k] ?? 0, touching[k + 1] ?? 0];
            const names = `${this.#name(a)}\n${this.#name(b)}`;
            named.set(names, named.get(names) ?? [a, b]);
        }
        this.#touching = new Set(Array.from(touching, (instance) => this.#name(instance)));
        this.recolour();
        this.#overlay.clear();
        if (nearest !== undefined && nearest.distance > 0) {
            const ends = [...nearest.pointA, ...nearest.pointB];
            this.#overlay.segments(ends, palette.near, 3);
            this.#overlay.dots(ends, palette.near, 11);
            this.#overlay.label(short(nearest.distance), nearest.pointA, "near");
        }
        const pairs = named.size;
        view.setAnswer({ distance: nearest?.distance ?? null, touching: pairs, frame: this.frame, took });
        const [number, text] =
            pairs > 0
                ? [countOf(pairs), pairs === 1 ? "pair touches" : "pairs touch"]
                : nearest === undefined
                  ? ["0", "pairs can touch"]
                  : [short(nearest.distance), "to the nearest pair"];
        fill(
            this.#frameBox,
            h("div", { class: `relation ${pairs > 0 ? "hit" : "free"}` }, pairs > 0 ? "Touching" : "Apart"),
            h(
                "div",
                { class: "headline" },
                h("span", { class: "headline-number" }, number),
                h("span", { class: "muted" }, text),
            ),
            h(
                "dl",
                { class: "facts" },
                nearest !== undefined && fact("nearest pair", `${this.#name(nearest.a)}, ${this.#name(nearest.b)}`),
                nearest !== undefined && fact("distance", exact(nearest.distance)),
                fact("instances", `${countOf(this.#instances.length)}, ${countOf(this.#moving.length)} of which move`),
                fact("answered in", milliseconds(took)),
            ),
        );
        const listed = [...named.values()].slice(0, MAX_LISTED);
        const rows = listed.map(([a, b]) => this.#row(a, b, "", () => void this.choose(a, b)));
        fill(this.#list, ...(rows.length > 0 ? rows : [h("p", { class: "muted" }, "None in this frame.")]));
        if (pairs > MAX_LISTED) {
            this.#list.append(h("p", { class: "muted" }, `and ${countOf(pairs - MAX_LISTED)} more`));
        }
    }

    #row(a: number, b: number, detail: string | HTMLElement, press: () => void): HTMLElement {
        const isChosen = this.#chosen?.[0] === a && this.#chosen[1] === b;
        const row = h(
            "button",
            {
                type: "button",
                class: "list-row",
                role: "option",
                "aria-selected": String(isChosen),
                click: () => {
                    for (const other of row.parentElement?.querySelectorAll("[aria-selected=true]") ?? []) {
                        other.setAttribute("aria-selected", "false");
                    }
                    row.setAttribute("aria-selected", "true");
                    press();
                },
            },
            h("span", { class: "list-names" }, `${this.#name(a)} – ${this.#name(b)}`),
            detail,
        );
        return row;
    }

    /** Colours instances that touch. */
    recolour(): void {
        this.view.bodies.forEach((body, k) => {
            body.setColour(this.colourOf(k));
            if (this.#chosen === undefined) {
                body.setOpacity(this.look.opacityOf(body));
            }
        });
    }

    /** Whether an instance neither moves nor touches another one. */
    isBackground(instance: number): boolean {
        return this.#instances[instance]?.moving !== true && !this.#touching.has(this.#name(instance));
    }

    colourOf(instance: number): number {
        const { palette } = this.view.stage;
        const place = this.#chosen?.indexOf(instance) ?? -1;
        if (place >= 0) {
            return place === 0 ? palette.a : palette.b;
        }
        if (this.#clashes.length > 0) {
            return palette.still;
        }
        const name = this.#name(instance);
        const mark = this.#touching.has(name) ? "hit" : this.marks.get(name);
        if (mark !== undefined) {
            return palette[mark];
        }
        return this.#instances[instance]?.moving === true ? palette.moving : palette.still;
    }

    /** Shows a pair, and says why if it has no answer. */
    async choose(a: number, b: number, clash?: ContentClash): Promise<void> {
        try {
            await this.#showPair(a, b, clash);
        } catch (error) {
            this.view.messages.say(messageOf(error), "error");
        }
    }

    /** Frames a pair, and asks where it touches. */
    async #showPair(a: number, b: number, clash?: ContentClash): Promise<void> {
        const chosen: [number, number] = [a, b];
        this.#chosen = chosen;
        const { view } = this;
        const [first, second] = [view.bodies[a], view.bodies[b]];
        if (first === undefined || second === undefined) {
            return;
        }
        const { palette } = view.stage;
        view.bodies.forEach((body, k) => {
            const isOne = k === a || k === b;
            body.setOpacity(isOne ? (clash === undefined ? 1 : 0.62) : 0.08);
        });
        this.recolour();
        this.#pairOverlay.clear();
        const box = view.stage.boxOf([first.group, second.group]);
        view.stage.fit(box, true);
        const pose = await view.asker.ask("between", first.pose, second.pose);
        const near = await view.asker.ask("near", first.side, second.side, pose);
        // Meanwhile another pair may have been chosen.
        if (this.#chosen !== chosen) {
            return;
        }
        view.setAnswer({ distance: near.distance.distance, pair: [a, b], contacts: near.contacts });
        const toWorld = (points: ArrayLike<number>) => {
            const moved: number[] = [];
            for (let k = 0; k + 2 < points.length; k += 3) {
                moved.push(...move(first.pose, [points[k] ?? 0, points[k + 1] ?? 0, points[k + 2] ?? 0]));
            }
            return moved;
        };
        if (near.contacts > 0) {
            this.#pairOverlay.triangles(first, near.touchingA, palette.hit);
            this.#pairOverlay.triangles(second, near.touchingB, palette.hit);
        } else {
            const ends = toWorld([...near.distance.pointA, ...near.distance.pointB]);
            this.#pairOverlay.segments(ends, palette.near, 3);
            this.#pairOverlay.dots(ends, palette.near, 11);
        }
        if (clash?.point !== undefined) {
            this.#pairOverlay.dots(clash.point, palette.depth, 14);
            if (clash.translation !== undefined) {
                this.#pairOverlay.arrow(clash.point, clash.translation, palette.depth, 0.01);
            }
        }
        if (isApart(near)) {
            return;
        }
        const { curves, shared } = await view.asker.ask("deep", first.side, second.side, pose);
        if (this.#chosen !== chosen) {
            return;
        }
        this.#pairOverlay.segments(toWorld(curves), palette.hit, 2.5, { faint: 0.55 });
        if (shared !== undefined) {
            const { measures, surface } = shared;
            this.#pairOverlay.solid(toWorld(surface.points), trianglesOf(surface), palette.shared);
            if (clash !== undefined) {
                this.#showClash(clash, measures);
            }
        }
    }

    /** Shows all instances alike again. */
    release(): void {
        this.#chosen = undefined;
        this.#pairOverlay.clear();
        for (const body of this.view.bodies) {
            body.setOpacity(this.look.opacityOf(body));
        }
        this.recolour();
    }

    #listClashes(): void {
        const shown = this.#clashes.filter((clash) => this.#filter.value === "" || clash.class === this.#filter.value);
        const rows = shown.slice(0, MAX_LISTED_CLASHES).map((clash) => {
            const { volume, pierced = [] } = clash;
            const thickest = Math.max(...pierced.map((thickness) => thickness ?? 0));
            const depth =
                clash.distance !== undefined && clash.distance > 0
                    ? `${short(clash.distance)} apart`
                    : clash.upper !== undefined
                      ? `depth ${short(clash.lower ?? 0)} to ${short(clash.upper)}`
                      : "";
            const words = [
                depth,
                volume === undefined ? "" : `volume ${short(volume)}`,
                thickest > 0 ? `${short(thickest)} pierced` : "",
            ];
            const detail = h(
                "span",
                { class: "list-detail" },
                h("span", { class: `badge ${clash.class}` }, clash.class),
                h("span", { class: "muted" }, words.filter((word) => word !== "").join(", ")),
            );
            return this.#row(clash.a, clash.b, detail, () => {
                void this.choose(clash.a, clash.b, clash);
                this.#showClash(clash);
            });
        });
        const more = shown.length - rows.length;
        fill(
            this.#clashBox,
            h("div", { class: "list", role: "listbox", "aria-label": "Clashes" }, ...rows),
            more > 0 && h("p", { class: "muted" }, `and ${countOf(more)} more: choose a class`),
            h("div", { class: "clash-facts" }),
            h("button", { type: "button", class: "button", click: () => this.release() }, "Show all parts"),
        );
    }

    /** Shows the facts of a clash: those of the command and, once it is measured, what both parts have in common. */
    #showClash(clash: ContentClash, measures?: Intersection): void {
        const box = this.#clashBox.querySelector<HTMLElement>(".clash-facts");
        if (box !== null) {
            fill(
                box,
                h(
                    "dl",
                    { class: "facts" },
                    fact("A", this.#name(clash.a)),
                    fact("B", this.#name(clash.b)),
                    clash.upper !== undefined && fact("depth", exact(clash.lower ?? 0), " to ", exact(clash.upper)),
                    clash.distance !== undefined && clash.distance > 0 && fact("distance", exact(clash.distance)),
                    ...(measures !== undefined
                        ? sharedFacts(measures)
                        : [
                              clash.volume !== undefined && fact("volume in both", exact(clash.volume)),
                              ...piercedFacts(clash.pierced ?? []),
                          ]),
                    clash.point !== undefined && fact("point", pointOf(clash.point)),
                    clash.translation !== undefined && fact("moves B out", pointOf(clash.translation)),
                ),
            );
        }
    }

    toggle(): void {
        this.#player.toggle();
    }

    stop(): void {
        this.#player.stop();
    }

    #begin(): (() => number) | undefined {
        if (this.#frames.length < 2) {
            return undefined;
        }
        let last = Number.NEGATIVE_INFINITY;
        return () => {
            const now = performance.now();
            if (now - last < 1000 / RATE) {
                return this.frame;
            }
            last = now;
            return (this.frame + 1) % this.#frames.length;
        };
    }

    /** Moves an instance that the user drags. */
    moved(body: Body, pose: Pose): void {
        body.setPose(pose);
        void this.refresh();
    }
}
