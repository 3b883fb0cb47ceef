/** Motions of B: where they are certainly free, the first hit, and a slider that plays them. */

import { Mesh, type Object3D } from "three";
import { type MotionAnswer, MotionKind } from "../../ts/answers.js";
import { type Body, material } from "./bodies.js";
import { exact, fact, fill, h, milliseconds, pointOf } from "./dom.js";
import { messageOf } from "./errors.js";
import { Overlay } from "./overlays.js";
import type { Pair } from "./pair.js";
import { part } from "./panel.js";
import { Player } from "./player.js";
import { move, numbersOf } from "./pose.js";
import type { View } from "./view.js";

/** Places of B's centre along the path that are drawn. */
const PATH_POINTS = 96;

export class MotionView {
    readonly #overlay: Overlay;
    readonly #answerBox = h("div", { class: "answer" });
    readonly #player: Player = new Player(
        "Time of the motion",
        "any",
        (time) => this.go(time),
        () => this.#motion && this.#player.evenly(),
    );
    readonly #rows = h("textarea", {
        class: "code",
        rows: "6",
        spellcheck: "false",
        "aria-label": "24 numbers of the motion",
    });
    readonly #clearance = h("input", {
        type: "number",
        step: "any",
        min: "0",
        value: "0",
        class: "field",
        "aria-label": "Clearance",
    });
    #motion: Float64Array | undefined;
    #tolerance: number | undefined;
    #ghosts: Object3D[] = [];

    constructor(
        readonly view: View,
        readonly pair: Pair,
    ) {
        this.#overlay = new Overlay(view.stage, 10);
        this.#overlay.isVisible = false;
        const page = view.panel.add("motion", "Motion", (shown) => {
            this.#overlay.isVisible = shown;
            for (const ghost of this.#ghosts) {
                ghost.visible = shown;
            }
            if (!shown) {
                this.stop();
            }
        });
        this.#rows.addEventListener("change", () => this.#read());
        this.#clearance.addEventListener("change", () => void this.#ask());
        const set = (end: 0 | 1) => () => {
            const motion = this.#motion?.slice() ?? Float64Array.of(...pair.pose, ...pair.pose);
            motion.set(pair.pose, 12 * end);
            void this.set(motion);
        };
        page.append(
            this.#answerBox,
            this.#player.element,
            part(
                "Ends",
                h(
                    "div",
                    { class: "row" },
                    h("button", { type: "button", class: "button", click: set(0) }, "Start here"),
                    h("button", { type: "button", class: "button", click: set(1) }, "End here"),
                ),
                h(
                    "p",
                    { class: "muted" },
                    "Move B, then press one of these. The origin of B moves on a line, and B turns about one axis.",
                ),
                h("label", { class: "fields" }, h("span", { class: "fields-title" }, "clearance"), this.#clearance),
                h("div", { class: "fields-title" }, "pose at the start, pose at the end"),
                this.#rows,
            ),
        );
        this.#showNothing();
    }

    #showNothing(): void {
        this.#player.colour();
        fill(this.#answerBox, h("p", { class: "muted" }, "No motion yet. Set its start and its end below."));
    }

    get motion(): Float64Array | undefined {
        return this.#motion;
    }

    get clearance(): number {
        return Number(this.#clearance.value) || 0;
    }

    get tolerance(): number | undefined {
        return this.#tolerance;
    }

    get time(): number {
        return this.#player.value;
    }

    clear(): void {
        this.stop();
        this.#motion = undefined;
        this.#overlay.clear();
        this.#removeGhosts();
        this.#rows.value = "";
        this.#showNothing();
    }

    async set(motion: Float64Array, clearance?: number, tolerance?: number | null): Promise<void> {
        this.#motion = motion;
        if (clearance !== undefined) {
            this.#clearance.value = String(clearance);
        }
        this.#tolerance = tolerance ?? undefined;
        const row = (at: number) => Array.from(motion.subarray(at, at + 4), String).join("  ");
        this.#rows.value = [0, 4, 8, 12, 16, 20].map(row).join("\n");
        await this.#ask();
    }

    async #ask(): Promise<void> {
        const { a, b } = this.pair;
        const motion = this.#motion;
        if (a === undefined || b === undefined || motion === undefined) {
            return;
        }
        try {
            const answer = await this.view.asker.ask("motion", a.side, b.side, motion, this.clearance, this.#tolerance);
            this.#showAnswer(answer, answer.took);
            await this.#drawPath(b, motion, answer);
            await this.go(this.time);
        } catch (error) {
            // What was known of another motion is no answer.
            this.stop();
            this.#motion = undefined;
            this.#overlay.clear();
            this.#removeGhosts();
            this.#showNothing();
            fill(this.#answerBox, h("p", { class: "problem" }, messageOf(error)));
        }
    }

    #showAnswer(answer: MotionAnswer, took: number): void {
        const { kind, freeUntil, at, nearest } = answer;
        const { clearance } = this;
        const isHit = kind === MotionKind.HIT;
        const within = clearance > 0 ? ` by more than ${clearance}` : "";
        const name = ["Free", "Hit", "Near"][kind] ?? "";
        const says = [
            `apart${within} at every moment`,
            clearance > 0 ? `within ${clearance} at t = ${at}` : `touches at t = ${at}`,
            `within the clearance and the tolerance at t = ${at}, undecided there`,
        ][kind];
        fill(
            this.#answerBox,
            h("div", { class: `relation ${["free", "hit", "near"][kind] ?? ""}` }, name),
            h("p", {}, says ?? ""),
            h(
                "dl",
                { class: "facts" },
                fact("certainly free", "until t = ", exact(freeUntil)),
                kind !== 0 && fact(isHit ? "first hit" : "near", "t = ", exact(at)),
                nearest !== undefined && fact("point on A", pointOf(nearest.pointA)),
                nearest !== undefined && fact("triangles", `${nearest.triangleA} of A, ${nearest.triangleB} of B`),
                fact("answered in", milliseconds(took)),
            ),
            kind !== 0 &&
                h(
                    "button",
                    { type: "button", class: "button", click: () => void this.go(at) },
                    isHit ? "Go to the first hit" : "Go to this moment",
                ),
        );
        this.#player.colour(freeUntil, kind === 0 ? 1 : at);
    }

    async #drawPath(b: Body, motion: Float64Array, answer: MotionAnswer): Promise<void> {
        const times = Float64Array.from({ length: PATH_POINTS + 1 }, (_, k) => k / PATH_POINTS);
        const ends = answer.kind === 0 ? [0, 1] : [0, 1, answer.at];
        const poses = await this.view.asker.ask("motionPoses", motion, Float64Array.of(...times, ...ends));
        const centre = (k: number) => move(poses.subarray(12 * k, 12 * k + 12), b.shown.centre);
        const { palette } = this.view.stage;
        this.#overlay.clear();
        const [free, rest]: [number[], number[]] = [[], []];
        for (let k = 0; k < PATH_POINTS; k++) {
            const into = (times[k + 1] ?? 0) <= answer.freeUntil ? free : rest;
            into.push(...centre(k), ...centre(k + 1));
        }
        this.#overlay.segments(free, palette.near, 2.5);
        this.#overlay.segments(rest, palette.still, 2, { dashed: true });
        const { nearest } = answer;
        if (nearest !== undefined) {
            const isHit = answer.kind === MotionKind.HIT;
            this.#overlay.dots(nearest.pointA, isHit ? palette.hit : palette.near, 14);
            this.#overlay.label(isHit ? "first hit" : "near", nearest.pointA, isHit ? "hit" : "near");
        }
        this.#removeGhosts();
        if (b.shown.triangles > 300_000) {
            return;
        }
        ends.forEach((_, k) => {
            const ghost = new Mesh(
                b.mesh.geometry,
                material(k === 2 ? palette.hit : palette.b, { transparent: true, opacity: 0.16 }),
            );
            ghost.material.depthWrite = false;
            ghost.material.flatShading = b.mesh.material.flatShading;
            ghost.renderOrder = 2;
            const at = PATH_POINTS + 1 + k;
            this.view.stage.place(ghost, poses.slice(12 * at, 12 * at + 12), b.shown.centre);
            ghost.visible = this.view.panel.current === "motion";
            this.view.stage.scene.add(ghost);
            this.#ghosts.push(ghost);
        });
    }

    #removeGhosts(): void {
        for (const ghost of this.#ghosts.splice(0)) {
            ghost.removeFromParent();
        }
        this.view.stage.draw();
    }

    /** Moves B to a time from 0 to 1. */
    async go(to: number): Promise<void> {
        const motion = this.#motion;
        if (motion === undefined) {
            return;
        }
        const time = this.#player.nearest(to);
        this.#player.show(time, `t = ${time.toFixed(4)}`);
        await this.pair.setPose(await this.view.asker.ask("motionPoses", motion, Float64Array.of(time)));
    }

    toggle(): void {
        this.#player.toggle();
    }

    stop(): void {
        this.#player.stop();
    }

    #read(): void {
        const numbers = numbersOf(this.#rows.value);
        if (numbers.length === 24 && numbers.every(Number.isFinite)) {
            void this.set(Float64Array.from(numbers));
        } else {
            const found = numbers.length === 24 ? "one that is not finite" : String(numbers.length);
            this.view.messages.say(`A motion has 24 finite numbers, found ${found}.`);
        }
    }
}
