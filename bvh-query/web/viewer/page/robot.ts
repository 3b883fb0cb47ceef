/** Robots: a slider for each joint value, and the lines of a file: configurations, and edges that are played until they end. */

import type { Content, ContentLine, ContentValue } from "./content.js";
import { exact, fact, fill, h, pointOf, short } from "./dom.js";
import { between, framesOf } from "./kinematics.js";
import { Overlay } from "./overlays.js";
import { part } from "./panel.js";
import { Player } from "./player.js";
import { identity, product } from "./pose.js";
import type { SceneView } from "./scene.js";
import type { View } from "./view.js";

type End = NonNullable<ContentLine["end"]>;
type RobotShow = Extract<Content["show"], { kind: "robot" }>;

/** What an edge is called: free, or by what ends it. */
const kindOf = ({ end }: ContentLine) => (end === undefined ? "free" : end.hit ? "hit" : "near");

/** What is known of the end of an edge, and a button that goes there. */
const endFacts = ({ free_until, bodies, points }: End, click: () => void): HTMLElement[] => [
    h(
        "dl",
        { class: "facts" },
        fact("certainly free", "until t = ", exact(free_until)),
        fact("bodies", bodies.join(", ")),
        fact("point", pointOf(points[0])),
    ),
    h("button", { type: "button", class: "button", click }, "Go there"),
];

export class RobotView {
    /** The joint values that are shown. */
    values: number[] = [];
    readonly #overlay: Overlay;
    readonly #lines = h("select", { class: "field", "aria-label": "Line of the file" });
    readonly #answerBox = h("div");
    readonly #player: Player = new Player(
        "Time of the edge",
        "any",
        (time) => this.go(time),
        () => this.#line?.goal && this.#player.evenly(this.#line.end?.at),
    );
    readonly #linesPart = part(
        "Lines of the file",
        h("div", { class: "fields" }, h("span", { class: "fields-title" }, "line"), this.#lines),
        this.#answerBox,
        this.#player.element,
    );
    readonly #joints = h("div");
    #show: RobotShow | undefined;
    #line: ContentLine | undefined;
    #sliders: ((value: number) => void)[] = [];

    constructor(
        readonly view: View,
        readonly scene: SceneView,
    ) {
        this.#overlay = new Overlay(view.stage, 25);
        this.#lines.addEventListener("change", () => void this.choose(Number(this.#lines.value)));
        scene.extra.append(this.#linesPart, part("Joints", this.#joints));
        this.clear();
    }

    get time(): number {
        return this.#player.value;
    }

    clear(): void {
        this.stop();
        this.#mark();
        this.view.isRobot = false;
        this.scene.extra.hidden = true;
        this.#show = undefined;
        this.#line = undefined;
        this.#sliders = [];
        this.values = [];
    }

    /** Adds the sliders of a robot, whose instances are on the stage where its first line puts them. */
    set(show: RobotShow): void {
        this.#show = show;
        this.view.isRobot = true;
        this.scene.extra.hidden = false;
        this.values = show.values.map(({ at }) => at);
        const rows = show.values.map((value, k) => this.#slider(value, k));
        fill(
            this.#joints,
            ...rows,
            rows.length === 0 && h("p", { class: "muted" }, "This robot has no joints that move."),
        );
        this.#showValues();
        const options = show.lines.map((line, k) => {
            const end = line.end === undefined ? "" : ` at ${short(line.end.at)}`;
            const kind = line.goal === undefined ? "" : `: ${kindOf(line)}${end}`;
            return h("option", { value: k }, `${k + 1}${kind}`);
        });
        fill(this.#lines, ...options);
        this.#linesPart.hidden = options.length === 0;
        this.#showLine(0);
    }

    /** Adds a slider. It grows to hold the values that lines have, because limits of joints are not checked. */
    #slider({ name, lower, upper }: ContentValue, place: number): HTMLElement {
        const { size } = this.view;
        const ends = { min: lower ?? -size, max: upper ?? size };
        const slider = h("input", { type: "range", class: "timeline plain", step: "any", "aria-label": name, ...ends });
        const number = h("output", { class: "number" });
        slider.addEventListener("input", () => {
            this.stop();
            void this.place(this.values.map((value, k) => (k === place ? slider.valueAsNumber : value)));
        });
        this.#sliders.push((value) => {
            slider.min = String(Math.min(Number(slider.min), value));
            slider.max = String(Math.max(Number(slider.max), value));
            slider.value = String(value);
            number.textContent = short(value);
            number.title = String(value);
        });
        return h("label", { class: "joint" }, h("span", { class: "joint-name", title: name }, name), slider, number);
    }

    #showValues(): void {
        this.#sliders.forEach((show, k) => {
            show(this.values[k] ?? 0);
        });
    }

    /** Shows a line of the file, counted from 0, and goes there. */
    choose(number: number): Promise<void> {
        this.stop();
        this.#showLine(number);
        return this.place(this.#line?.start ?? this.values);
    }

    #showLine(number: number): void {
        const line = this.#show?.lines[number];
        this.#line = line;
        this.#lines.value = String(number);
        this.#player.element.hidden = line?.goal === undefined;
        fill(this.#answerBox);
        if (line?.goal === undefined) {
            return;
        }
        const { end } = line;
        this.#player.show(0, "t = 0");
        this.#player.colour(end?.free_until ?? 1, end?.at);
        const kind = kindOf(line);
        const [name, says] = {
            free: ["Free", "free at every moment"],
            hit: ["Hit", `hit at t = ${end?.at}`],
            near: ["Near", `nearer than the clearance and the tolerance at t = ${end?.at}, undecided there`],
        }[kind];
        fill(
            this.#answerBox,
            h("div", { class: `relation ${kind}` }, name),
            h("p", {}, says),
            ...(end === undefined ? [] : endFacts(end, () => void this.go(end.at))),
        );
    }

    /** Marks the bodies that end an edge, if it is shown where it ends: they may be apart, by the clearance or a rounding. */
    #mark(end?: End): void {
        this.#overlay.clear();
        this.scene.marks.clear();
        if (end === undefined) {
            return;
        }
        const kind = end.hit ? "hit" : "near";
        for (const name of end.bodies) {
            this.scene.marks.set(name, kind);
        }
        this.#overlay.dots(end.points.flat(), this.view.stage.palette[kind], 12);
        this.#overlay.label(end.hit ? "first hit" : "near", end.points[0], kind);
    }

    /** Moves all links to where joint values put them, and asks which touch there. */
    async place(values: number[], end?: End): Promise<void> {
        if (this.#show === undefined) {
            return;
        }
        const { instances, joints } = this.#show;
        this.values = values;
        this.#showValues();
        this.#mark(end);
        const frames = framesOf(joints, values);
        instances.forEach(({ frame, origin, moving }, k) => {
            if (moving) {
                this.view.bodies[k]?.setPose(product(frames[frame] ?? identity(), Float64Array.from(origin)));
            }
        });
        await this.scene.go(0);
    }

    /** Moves along the edge that is shown, to a time from 0 to 1. */
    async go(to: number): Promise<void> {
        const [show, line] = [this.#show, this.#line];
        if (show === undefined || line?.goal === undefined) {
            return;
        }
        const time = this.#player.nearest(to);
        this.#player.show(time, `t = ${time.toFixed(4)}`);
        const end = time === line.end?.at ? line.end : undefined;
        await this.place(between(show.joints, line.start, line.goal, time), end);
    }

    toggle(): void {
        this.#player.toggle();
    }

    stop(): void {
        this.#player.stop();
    }
}
