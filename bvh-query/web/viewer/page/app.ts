/** The application: what is on the stage, and the tabs that ask about it. */

import { type Box3, Vector3 } from "three";
import type { FileSummary } from "../worker/files.js";
import type { Asker } from "./asker.js";
import { Body, Shown } from "./bodies.js";
import type { Content, Show } from "./content.js";
import { bytesOf, countOf, fill, h, iconButton } from "./dom.js";
import { Drop } from "./drop.js";
import { Inside } from "./inside.js";
import { Look } from "./look.js";
import { MotionView } from "./motion.js";
import { Pair } from "./pair.js";
import { openParts, type Part } from "./parts.js";
import { identity, move, type Pose, placedAt } from "./pose.js";
import { Probes } from "./probes.js";
import { RobotView } from "./robot.js";
import { SceneView } from "./scene.js";
import { Selection } from "./selection.js";
import { View } from "./view.js";

export class App {
    readonly view: View;
    readonly look: Look;
    readonly selection: Selection;
    readonly pair: Pair;
    readonly motion: MotionView;
    readonly scene: SceneView;
    readonly robot: RobotView;
    readonly inside: Inside;
    readonly probes: Probes;
    readonly drop: Drop;
    /** The files of a pair, in the head of the panel. */
    readonly files = h("div", { class: "files" });
    readonly #invitation: HTMLElement;
    /** How the command line names what is drawn: a path, and an object of it. */
    readonly #words = new Map<number, string[]>();
    readonly #dropped = new Set<number>();

    constructor(asker: Asker, host: HTMLElement) {
        this.view = new View(asker, host);
        this.look = new Look(this.view);
        this.selection = new Selection(this.view);
        this.pair = new Pair(this.view);
        this.motion = new MotionView(this.view, this.pair);
        this.scene = new SceneView(this.view, this.look);
        this.robot = new RobotView(this.view, this.scene);
        this.inside = new Inside(this.view, this.pair, this.look);
        this.probes = new Probes(this.view, this.pair);
        this.drop = new Drop(this.view, (file) => this.take(file));
        this.#invitation = h(
            "div",
            { class: "invitation", hidden: true },
            h("h1", {}, "cbvh view"),
            h("p", {}, "Drop a mesh here to look at it, and a second one to ask about both."),
            iconButton("open", "Open files (O)", () => this.drop.choose(), "Open files"),
            h("p", { class: "muted" }, "OBJ, STL, PLY, GLB, COLLADA, XYZ, PCD or .cbvh. Nothing leaves this page."),
        );
        this.view.stageElement.append(this.#invitation);
        const { handles } = this.view;
        handles.onPose = (pose) => {
            if (handles.body !== undefined) {
                this.moveBody(handles.body, pose);
            }
        };
        this.look.onTheme = () => {
            if (this.pair.isComplete) {
                void this.pair.refresh();
            } else if (this.view.mode === "scene") {
                this.scene.recolour();
            }
        };
    }

    /** Shows the content that the command put into the page. */
    async show(content: Content, packed: string[], onFile: (name: string) => void): Promise<void> {
        const parts = await openParts(this.view.asker, content, packed, onFile);
        for (const { shown, words } of parts) {
            this.#words.set(shown.summary.number, words);
        }
        const { show } = content;
        if (show.kind === "scene" || show.kind === "clash") {
            await this.#showScene(parts, show);
            return;
        }
        if (show.kind === "robot") {
            await this.#showScene(parts, { ...show, kind: "scene", frames: [] });
            this.robot.set(show);
            return;
        }
        const [first, second = isTwice(content) ? parts[0] : undefined] = parts;
        if (first === undefined) {
            throw new Error("expected a file in this page, found none");
        }
        const { stage, panel } = this.view;
        const a = new Body("A", first.shown, stage, stage.palette.a);
        const b = second && new Body("B", second.shown, stage, stage.palette.b);
        const pose = show.kind === "pair" ? show.pose : show.kind === "motion" ? show.motion.slice(0, 12) : identity();
        this.pair.within = show.kind === "pair" ? show.within : undefined;
        await this.#showPair(a, b, Float64Array.from(pose));
        if (show.kind === "motion") {
            await this.motion.set(Float64Array.from(show.motion), show.clearance, show.tolerance);
            panel.show("motion");
        }
    }

    /** Shows that there is nothing yet. */
    showNothing(): void {
        this.#invitation.hidden = false;
        this.view.panel.element.hidden = true;
        this.view.handles.isShown = false;
        this.view.stage.groundAt(0, 1);
    }

    /** Adopts a file that was dropped: the first becomes A, the next B. */
    async take(summary: FileSummary): Promise<void> {
        const { view } = this;
        const shown = await Shown.of(summary, view.asker);
        this.#dropped.add(summary.number);
        this.#words.set(summary.number, [summary.name]);
        const isFirst =
            view.mode === "scene" ||
            view.bodies.length === 0 ||
            !view.bodies.some((body) => this.#dropped.has(body.file));
        if (isFirst) {
            this.#clear();
            await this.#showPair(new Body("A", shown, view.stage, view.stage.palette.a), undefined, identity());
            return;
        }
        const { a, b } = this.pair;
        b?.remove();
        const placed = new Body("B", shown, view.stage, view.stage.palette.b);
        const pose = b === undefined && a !== undefined ? besides(a, placed) : this.pair.pose;
        await this.#showPair(a, placed, pose);
    }

    #clear(): void {
        this.selection.clear();
        this.pair.clear();
        this.motion.clear();
        this.robot.clear();
        this.scene.clear();
        for (const body of this.view.bodies) {
            body.remove();
        }
        this.view.bodies = [];
        this.view.handles.attach(undefined);
    }

    async #showPair(a: Body | undefined, b: Body | undefined, pose: Pose): Promise<void> {
        const { view } = this;
        view.mode = "pair";
        this.#adopt([a, b].filter((body) => body !== undefined));
        const frame = a ?? b;
        if (frame !== undefined) {
            const { bounds } = frame.shown.summary;
            this.#setFrame(bounds, b === undefined ? [] : [b.shown.summary.bounds]);
        }
        a?.setPose(identity());
        b?.setPose(pose);
        view.panel.offer(b === undefined ? ["inside", "probes"] : ["pair", "motion", "inside", "probes"]);
        await this.pair.set(a, b, pose);
        this.#offer();
        if (b === undefined) {
            view.setAnswer({ distance: null, triangles: [a?.shown.summary.triangles] });
        }
    }

    async #showScene(parts: Part[], show: Extract<Show, { kind: "scene" | "clash" }>): Promise<void> {
        const { view } = this;
        view.mode = "scene";
        const instances = show.instances.map((instance, k) => ({
            ...instance,
            file: parts[k]?.shown.summary.number ?? instance.file,
        }));
        const bodies = parts.map(({ shown }, k) => {
            const { name = "", margin = 0, pose } = instances[k] ?? {};
            const body = new Body(name, shown, view.stage, view.stage.palette.still, margin);
            body.setPose(pose === undefined ? identity() : Float64Array.from(pose));
            return body;
        });
        this.#setFrame(boundsOf(bodies), []);
        // The coordinates of the stage are others now.
        for (const body of bodies) {
            body.setPose(body.pose);
        }
        this.#adopt(bodies);
        view.panel.offer(show.kind === "scene" ? ["scene", "inside", "probes"] : ["clash", "inside", "probes"]);
        await this.scene.set({ ...show, instances });
        this.#offer();
    }

    /** Chooses the coordinates of the stage. */
    #setFrame(bounds: Float64Array, others: Float64Array[]): void {
        const [x0 = 0, y0 = 0, z0 = 0, x1 = 0, y1 = 0, z1 = 0] = bounds;
        const sides = [bounds, ...others].map(([a = 0, b = 0, c = 0, d = 0, e = 0, f = 0]) =>
            Math.max(d - a, e - b, f - c),
        );
        this.view.size = Math.max(...sides) || 1;
        this.view.stage.setFrame([(x0 + x1) / 2, (y0 + y1) / 2, (z0 + z1) / 2], this.view.size);
    }

    #adopt(bodies: Body[]): void {
        this.view.bodies = bodies;
        this.view.panel.element.hidden = false;
        this.#invitation.hidden = true;
        this.view.handles.isShown = true;
        this.look.apply();
    }

    /** Tells the panel what is on the stage, and fits it into the picture. */
    #offer(): void {
        const { bodies, mode, stage } = this.view;
        if (mode === "scene") {
            const triangles = bodies.reduce((sum, body) => sum + body.shown.summary.triangles, 0);
            const text = `${countOf(bodies.length)} instances, ${countOf(triangles)} triangles`;
            fill(this.files, h("div", { class: "muted" }, text));
        } else {
            fill(this.files, ...bodies.map((body) => this.#fileRow(body)));
        }
        this.inside.offer();
        this.probes.offer();
        stage.fit(this.#ground());
    }

    #fileRow(body: Body): HTMLElement {
        const { summary, boxLevel } = body.shown;
        const [, object] = this.wordsOf(body);
        const detail = [
            object === undefined ? "" : `object ${object}`,
            `${countOf(summary.triangles)} triangles`,
            bytesOf(summary.bytes),
            summary.closed === true ? "closed" : summary.closed === false ? "open" : "",
            summary.radius > 0 ? `radius ${summary.radius}` : "",
            summary.solid ? "solid" : "",
        ].filter((text) => text !== "");
        return h(
            "div",
            { class: "file" },
            h("span", { class: `file-mark ${body.name.toLowerCase()}` }, body.name),
            h(
                "div",
                { class: "file-text" },
                h("div", { class: "file-name", title: summary.name }, summary.name),
                h("div", { class: "muted" }, detail.join(" · ")),
                boxLevel !== undefined && h("div", { class: "muted" }, `drawn as the boxes of level ${boxLevel}`),
            ),
            iconButton("save", `Save ${body.name} as .cbvh`, () => void this.#save(body)),
        );
    }

    /** Lays the ground below everything. Returns the box around it. */
    #ground(): Box3 {
        const { bodies, stage } = this.view;
        const box = stage.boxOf(bodies.map((body) => body.group));
        if (!box.isEmpty()) {
            const height = stage.camera.up.z > 0.5 ? box.min.z : box.min.y;
            stage.groundAt(height, box.getSize(new Vector3()).length() / 1.5);
        }
        return box;
    }

    /** How the command line names a body: a path, and the name of an object if the body is one of several. */
    wordsOf(body: Body): string[] {
        return this.#words.get(body.file) ?? [body.shown.summary.name];
    }

    async #save(body: Body): Promise<void> {
        const bytes = await this.view.asker.ask("bytes", body.file);
        const name = body.shown.summary.name.replace(/\.[^.]*$/, "");
        const address = URL.createObjectURL(new Blob([bytes as Uint8Array<ArrayBuffer>]));
        const link = h("a", { href: address, download: `${name}.cbvh` });
        link.click();
        setTimeout(() => URL.revokeObjectURL(address), 10_000);
    }

    /** Moves a body, and asks again. */
    moveBody(body: Body, pose: Pose): void {
        this.selection.clear();
        if (this.view.mode === "scene") {
            this.scene.moved(body, pose);
        } else {
            void this.pair.setPose(pose);
        }
    }

    setHandleMode(mode: "translate" | "rotate"): void {
        const { handles } = this.view;
        // The button of the present mode hides the handles.
        handles.isShown = !(handles.isShown && handles.mode === mode);
        handles.mode = mode;
        this.look.onChange();
    }

    fit(): void {
        const { bodies, stage } = this.view;
        stage.fit(stage.boxOf(bodies.filter((body) => body.isVisible).map((body) => body.group)), true);
    }

    lookAlong(axis: number): void {
        const eye = new Vector3(axis === 0 ? 1 : 0, axis === 1 ? -1 : 0, axis === 2 ? 1 : 0);
        // Straight from above, no direction of the picture would be up.
        this.view.stage.lookFrom(eye.addScalar(1e-4));
    }

    swapUp(): void {
        const { stage } = this.view;
        stage.setUp(stage.camera.up.z > 0.5 ? "y" : "z");
        this.#ground();
    }

    togglePlay(): void {
        (this.view.isRobot ? this.robot : this.view.mode === "scene" ? this.scene : this.motion).toggle();
    }

    step(by: number): void {
        if (this.view.mode === "scene" && !this.view.isRobot) {
            void this.scene.go(this.scene.frame + by);
        } else {
            const timed = this.view.isRobot ? this.robot : this.motion;
            void timed.go(timed.time + by / 100);
        }
    }
}

/** Whether the only file of a page is both A and B. */
function isTwice({ show, files }: Content): boolean {
    return files.length === 1 && (show.kind === "pair" || show.kind === "motion") && (show.same ?? true);
}

/** A box around balls around bodies, where they are. */
function boundsOf(bodies: Body[]): Float64Array {
    const bounds = Float64Array.of(Infinity, Infinity, Infinity, -Infinity, -Infinity, -Infinity);
    for (const body of bodies) {
        const [x0 = 0, y0 = 0, z0 = 0, x1 = 0, y1 = 0, z1 = 0] = body.shown.summary.bounds;
        const reach = Math.hypot(x1 - x0, y1 - y0, z1 - z0) / 2;
        move(body.pose, body.shown.centre).forEach((middle, axis) => {
            bounds[axis] = Math.min(bounds[axis] ?? 0, middle - reach);
            bounds[axis + 3] = Math.max(bounds[axis + 3] ?? 0, middle + reach);
        });
    }
    return bodies.length > 0 ? bounds : new Float64Array(6);
}

/** A pose for B beside A, so that both are seen. */
function besides(a: Body, b: Body): Pose {
    const [boundsA, boundsB] = [a.shown.summary.bounds, b.shown.summary.bounds];
    const at = (bounds: Float64Array, place: number) => bounds[place] ?? 0;
    const gap = 0.15 * Math.max(at(boundsA, 3) - at(boundsA, 0), at(boundsB, 3) - at(boundsB, 0));
    const middle = (bounds: Float64Array, axis: number) => (at(bounds, axis) + at(bounds, axis + 3)) / 2;
    return placedAt(identity(), [
        at(boundsA, 3) - at(boundsB, 0) + gap,
        middle(boundsA, 1) - middle(boundsB, 1),
        middle(boundsA, 2) - middle(boundsB, 2),
    ]);
}
