/** The application: what is on the stage, the buttons around it, and what ties the parts of the page together. */

import { type Box3, Vector3 } from "three";
import type { FileSummary, Place } from "../worker/files.js";
import { showAbout } from "./about.js";
import type { Asker } from "./asker.js";
import { Body, Shown } from "./bodies.js";
import type { Content, ContentPart, Show } from "./content.js";
import { bytesOf, countOf, fact, fill, h, type IconName, iconButton, pointOf } from "./dom.js";
import { Drop } from "./drop.js";
import { messageOf } from "./errors.js";
import { Handles } from "./handles.js";
import { Inside } from "./inside.js";
import { showKeys } from "./keys.js";
import { command, stateOf } from "./link.js";
import { MotionView } from "./motion.js";
import { Overlay } from "./overlays.js";
import { Pair } from "./pair.js";
import { Messages, Panel } from "./panel.js";
import { identity, type Point, type Pose, placedAt } from "./pose.js";
import { Probes } from "./probes.js";
import { SceneView } from "./scene.js";
import { Stage } from "./stage.js";

/** A triangle that was asked about. */
interface Selection {
    /** The number of the body. */
    body: number;
    /** The place of the triangle in the drawn order. */
    triangle: number;
}

/** Where a ray hit. */
interface Hit {
    point: Float64Array;
    object: number;
    triangle: number;
}

export class App {
    readonly stage: Stage;
    readonly handles: Handles;
    readonly panel = new Panel();
    readonly messages = new Messages();
    readonly pair: Pair;
    readonly motion: MotionView;
    readonly scene: SceneView;
    readonly inside: Inside;
    readonly probes: Probes;
    readonly drop: Drop;
    readonly #selectOverlay: Overlay;
    readonly #card = h("div", { class: "card", hidden: true });
    readonly #invitation: HTMLElement;
    readonly #files = h("div", { class: "files" });
    readonly #tools = new Map<string, HTMLButtonElement>();
    bodies: Body[] = [];
    /** Two meshes or one, or a scene. */
    mode: "pair" | "scene" = "pair";
    selection: Selection | undefined;
    opacity = 1;
    /** The largest side of what is shown, in mesh units. */
    size = 1;
    /** Questions per second, once they were measured. */
    measured: { distance: number; collide: number } | undefined;
    #isSmooth = false;
    #hasEdges = false;
    #isDark = false;
    #content: Content | undefined;
    #dropped = new Set<number>();

    constructor(
        readonly asker: Asker,
        host: HTMLElement,
    ) {
        const stageElement = h("main", { class: "stage" });
        host.replaceChildren(stageElement, this.panel.element, this.messages.element);
        this.stage = new Stage(stageElement);
        this.handles = new Handles(this.stage);
        this.#selectOverlay = new Overlay(this.stage, 50);
        this.#invitation = h(
            "div",
            { class: "invitation", hidden: true },
            h("h1", {}, "cbvh view"),
            h("p", {}, "Drop a mesh here to look at it, and a second one to ask about both."),
            iconButton("open", "Open files (O)", () => this.drop.choose(), "Open files"),
            h("p", { class: "muted" }, "OBJ, STL, PLY, GLB or .cbvh. Nothing leaves this page."),
        );
        stageElement.append(this.#toolbar(), this.#card, this.#invitation);
        this.#head();
        this.pair = new Pair(this);
        this.motion = new MotionView(this);
        this.scene = new SceneView(this);
        this.inside = new Inside(this);
        this.probes = new Probes(this);
        this.drop = new Drop(this);
        this.#foot();
        this.handles.onPose = (pose) => {
            if (this.handles.body !== undefined) {
                this.moveBody(this.handles.body, pose);
            }
        };
        this.#listenToClicks();
        const prefersDark = window.matchMedia("(prefers-color-scheme: dark)");
        this.#setDark(prefersDark.matches);
        prefersDark.addEventListener("change", () => this.#setDark(prefersDark.matches));
    }

    // ---- What is shown

    /** Shows the content that the command put into the page. */
    async show(content: Content, packed: string[], onFile: (name: string) => void): Promise<void> {
        this.#content = content;
        const files: FileSummary[] = [];
        for (const [k, file] of content.files.entries()) {
            onFile(file.name);
            files.push(await this.asker.ask("openEmbedded", file.name, packed[k] ?? ""));
            packed[k] = "";
        }
        const { show } = content;
        if (show.kind === "scene" || show.kind === "clash") {
            const shown = await this.#parts(files, show.instances);
            await this.#showScene(shown, show);
            return;
        }
        const shown = await this.#parts(
            files,
            content.files.map((part, file) => ({ ...part, file })),
        );
        const [first, second = isTwice(content) ? shown[0] : undefined] = shown;
        if (first === undefined) {
            throw new Error("expected a file in this page, found none");
        }
        const a = new Body("A", first, this.stage, this.stage.palette.a);
        const b = second && new Body("B", second, this.stage, this.stage.palette.b);
        const pose = show.kind === "pair" ? Float64Array.from(show.pose) : identity();
        this.pair.within = show.kind === "pair" ? show.within : undefined;
        await this.#showPair(a, b, show.kind === "motion" ? Float64Array.from(show.motion.slice(0, 12)) : pose);
        if (show.kind === "motion") {
            await this.motion.set(Float64Array.from(show.motion), show.clearance, show.tolerance);
            this.panel.show("motion");
        }
    }

    /** Reads what is drawn of files: all of a file, or an object of it. Each is read once, however often it is drawn. */
    async #parts(files: FileSummary[], parts: ({ name: string; file: number } & ContentPart)[]): Promise<Shown[]> {
        const read = new Map<string, Shown>();
        const shown: Shown[] = [];
        for (const { name, file, object = -1, solid = false } of parts) {
            const whole = files[file];
            if (whole === undefined) {
                throw new Error(`${name}: expected a file below ${files.length}, found ${file}`);
            }
            const key = `${file} ${object} ${solid}`;
            let found = read.get(key);
            if (found === undefined) {
                const isPart = object >= 0 || solid;
                const summary = isPart ? await this.asker.ask("openPart", whole.number, object, solid) : whole;
                found = await Shown.of(summary, this.asker);
                read.set(key, found);
            }
            shown.push(found);
        }
        return shown;
    }

    /** Shows that there is nothing yet. */
    showNothing(): void {
        this.#invitation.hidden = false;
        this.panel.element.hidden = true;
        this.handles.isShown = false;
        this.stage.groundAt(0, 1);
    }

    /** Adopts a file that was dropped: the first becomes A, the next B. */
    async take(summary: FileSummary): Promise<void> {
        const shown = await Shown.of(summary, this.asker);
        this.#dropped.add(summary.number);
        const isFirst =
            this.mode === "scene" ||
            this.bodies.length === 0 ||
            !this.bodies.some((body) => this.#dropped.has(body.file));
        if (isFirst) {
            this.#clear();
            await this.#showPair(new Body("A", shown, this.stage, this.stage.palette.a), undefined, identity());
            return;
        }
        const { a, b } = this.pair;
        b?.remove();
        const placed = new Body("B", shown, this.stage, this.stage.palette.b);
        const pose = b === undefined && a !== undefined ? besides(a, placed) : this.pair.pose;
        await this.#showPair(a, placed, pose);
    }

    #clear(): void {
        this.unselect();
        this.pair.clear();
        this.motion.clear();
        this.scene.clear();
        for (const body of this.bodies) {
            body.remove();
        }
        this.bodies = [];
        this.handles.attach(undefined);
    }

    async #showPair(a: Body | undefined, b: Body | undefined, pose: Pose): Promise<void> {
        this.mode = "pair";
        this.#adopt([a, b].filter((body) => body !== undefined));
        const frame = a ?? b;
        if (frame !== undefined) {
            const { bounds } = frame.shown.summary;
            this.#setFrame(bounds, b === undefined ? [] : [b.shown.summary.bounds]);
        }
        a?.setPose(identity());
        b?.setPose(pose);
        this.panel.offer(b === undefined ? ["inside", "probes"] : ["pair", "motion", "inside", "probes"]);
        await this.pair.set(a, b, pose);
        this.#offer();
        if (b === undefined) {
            this.setAnswer({ distance: null, triangles: [a?.shown.summary.triangles] });
        }
    }

    async #showScene(shown: Shown[], show: Extract<Show, { kind: "scene" | "clash" }>): Promise<void> {
        this.mode = "scene";
        const bodies = shown.map((of, k) => {
            const { name, margin } = show.instances[k] ?? { name: "", margin: 0 };
            return new Body(name, of, this.stage, this.stage.palette.still, margin);
        });
        const corners = show.instances.flatMap((instance, k) => {
            const [x = 0, y = 0, z = 0] = bodies[k]?.shown.centre ?? [];
            const p = (place: number) => instance.pose[place] ?? 0;
            const centre = [0, 4, 8].map((row) => p(row) * x + p(row + 1) * y + p(row + 2) * z + p(row + 3));
            const [x0 = 0, y0 = 0, z0 = 0, x1 = 0, y1 = 0, z1 = 0] = bodies[k]?.shown.summary.bounds ?? [];
            const reach = Math.hypot(x1 - x0, y1 - y0, z1 - z0) / 2;
            return [centre.map((value) => value - reach), centre.map((value) => value + reach)];
        });
        const end = (of: (...values: number[]) => number) =>
            [0, 1, 2].map((axis) => corners.reduce((e, c) => of(e, c[axis] ?? 0), c0(corners, axis)));
        this.#setFrame(Float64Array.of(...end(Math.min), ...end(Math.max)), []);
        this.#adopt(bodies);
        show.instances.forEach((instance, k) => {
            bodies[k]?.setPose(Float64Array.from(instance.pose));
        });
        this.panel.offer(show.kind === "scene" ? ["scene", "inside", "probes"] : ["clash", "inside", "probes"]);
        const instances = show.instances.map((instance, k) => ({
            ...instance,
            file: shown[k]?.summary.number ?? instance.file,
        }));
        await this.scene.set({ ...show, instances });
        this.#offer();
    }

    /** Chooses the coordinates of the stage. */
    #setFrame(bounds: Float64Array, others: Float64Array[]): void {
        const [x0 = 0, y0 = 0, z0 = 0, x1 = 0, y1 = 0, z1 = 0] = bounds;
        const sides = [bounds, ...others].map(([a = 0, b = 0, c = 0, d = 0, e = 0, f = 0]) =>
            Math.max(d - a, e - b, f - c),
        );
        this.size = Math.max(...sides) || 1;
        this.stage.setFrame([(x0 + x1) / 2, (y0 + y1) / 2, (z0 + z1) / 2], this.size);
    }

    #adopt(bodies: Body[]): void {
        this.bodies = bodies;
        this.panel.element.hidden = false;
        this.#invitation.hidden = true;
        this.handles.isShown = true;
        this.#applyLook();
    }

    /** Shows what has changed about the files. */
    #offer(): void {
        const seen = new Set<number>();
        fill(
            this.#files,
            ...this.bodies.slice(0, this.mode === "pair" ? 2 : 0).map((body) => {
                const { summary, boxLevel } = body.shown;
                seen.add(summary.number);
                const detail = [
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
                        boxLevel !== undefined &&
                            h("div", { class: "muted" }, `drawn as the boxes of level ${boxLevel}`),
                    ),
                    iconButton("save", `Save ${body.name} as .cbvh`, () => void this.#save(body)),
                );
            }),
        );
        if (this.mode === "scene") {
            const triangles = this.bodies.reduce((sum, body) => sum + body.shown.summary.triangles, 0);
            fill(
                this.#files,
                h(
                    "div",
                    { class: "muted" },
                    `${countOf(this.bodies.length)} instances, ${countOf(triangles)} triangles`,
                ),
            );
        }
        this.inside.offer();
        this.probes.offer();
        const ground = this.stage.boxOf(this.bodies.map((body) => body.group));
        const height = this.stage.camera.up.z > 0.5 ? ground.min.z : ground.min.y;
        this.stage.groundAt(height, ground.getSize(new Vector3()).length() / 1.5);
        this.stage.fit(ground);
    }

    // ---- Answers

    /** Publishes an answer for those who read the page by program. */
    setAnswer(answer: Record<string, unknown>): void {
        document.documentElement.dataset.answer = JSON.stringify(answer);
    }

    /** Moves a body, and asks again. */
    moveBody(body: Body, pose: Pose): void {
        this.unselect();
        if (this.mode === "scene") {
            this.scene.moved(body, pose);
        } else {
            void this.pair.setPose(pose);
        }
    }

    #listenToClicks(): void {
        const { canvas } = this.stage;
        let down: { x: number; y: number; free: boolean } | undefined;
        canvas.addEventListener("pointerdown", ({ clientX, clientY }) => {
            down = { x: clientX, y: clientY, free: !this.handles.isHovered };
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
        const { left, top, width, height } = this.stage.canvas.getBoundingClientRect();
        void this.#pick(left + width / 2, top + height / 2);
    }

    /** Asks which triangle a ray from the eye hits first: the library itself answers. */
    async #pick(clientX: number, clientY: number): Promise<void> {
        if (this.bodies.length === 0) {
            return;
        }
        const { origin, direction } = this.stage.rayAt(clientX, clientY);
        const [from, along] = [Float64Array.from(origin), Float64Array.from(direction)];
        try {
            let nearest: (Hit & { body: number; t: number; place: number }) | undefined;
            const candidates = await this.#candidates(from, along);
            for (const number of candidates) {
                const body = this.bodies[number];
                if (body === undefined || !body.isVisible) {
                    continue;
                }
                const { hits, places } = await this.asker.ask("firstHit", body.file, from, along, body.pose);
                const t = hits.t[0] ?? 0;
                if (hits.found[0] === 1 && (nearest === undefined || t < nearest.t)) {
                    const [object = 0, triangle = 0] = [hits.object[0], hits.triangle[0]];
                    nearest = { body: number, t, place: places[0] ?? -1, point: hits.point, object, triangle };
                }
            }
            if (nearest === undefined) {
                this.unselect();
                return;
            }
            await this.select(nearest.body, nearest.place, nearest);
        } catch (error) {
            this.messages.say(messageOf(error), "error");
        }
    }

    async #candidates(from: Float64Array, along: Float64Array): Promise<number[]> {
        if (this.mode !== "scene") {
            return this.bodies.map((_, k) => k);
        }
        const { instance } = await this.asker.ask("sceneHit", from, along);
        return instance < 0 ? [] : [instance];
    }

    /** Shows a triangle of a body. */
    async select(number: number, triangle: number, hit?: Hit): Promise<void> {
        const body = this.bodies[number];
        if (body === undefined) {
            return;
        }
        this.unselect();
        if (this.mode === "scene") {
            this.handles.attach(body);
        }
        this.selection = { body: number, triangle };
        const { shown } = body;
        let place: Place | undefined;
        if (triangle >= 0 && shown.boxLevel === undefined) {
            place = await this.asker.ask("place", body.file, triangle);
            const corners: Point[] = [0, 3, 6].map((k) => {
                const [x = 0, y = 0, z = 0] = shown.triangle(triangle).subarray(k, k + 3);
                const inMesh = [x, y, z].map((value, axis) => value + (shown.centre[axis] ?? 0));
                const p = (at: number) => body.pose[at] ?? 0;
                const [u = 0, v = 0, w = 0] = inMesh;
                return [0, 4, 8].map(
                    (row) => p(row) * u + p(row + 1) * v + p(row + 2) * w + p(row + 3),
                ) as unknown as Point;
            });
            const [a, b, c] = corners as [Point, Point, Point];
            const { palette } = this.stage;
            this.#selectOverlay.triangles(body, Uint32Array.of(triangle), palette.select, 0.35);
            this.#selectOverlay.segments([...a, ...b, ...b, ...c, ...c, ...a], palette.select, 2.5);
        }
        if (hit !== undefined) {
            this.#selectOverlay.dots(hit.point, this.stage.palette.select, 9);
        }
        const id = place?.id ?? hit?.triangle;
        const object = place?.object ?? hit?.object ?? 0;
        const { objects } = shown.summary;
        this.#card.hidden = false;
        fill(
            this.#card,
            iconButton("close", "Close (Esc)", () => this.unselect()),
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

    unselect(): void {
        this.selection = undefined;
        this.#card.hidden = true;
        this.#selectOverlay.clear();
    }

    // ---- Buttons

    #toolbar(): HTMLElement {
        const tool = (name: string, icon: IconName, title: string, press: () => void) => {
            const button = iconButton(icon, title, press);
            this.#tools.set(name, button);
            return button;
        };
        return h(
            "div",
            { class: "toolbar", role: "toolbar", "aria-label": "View" },
            tool("translate", "move", "Move B (T)", () => this.setHandleMode("translate")),
            tool("rotate", "rotate", "Turn B (R)", () => this.setHandleMode("rotate")),
            h("span", { class: "gap" }),
            tool("fit", "fit", "Fit into the view (F)", () => this.fit()),
            tool("xray", "xray", "See through (X)", () => this.toggleXray()),
            tool("edges", "edges", "Edges (E)", () => this.toggleEdges()),
            tool("smooth", "smooth", "Smooth (S)", () => this.toggleSmooth()),
            tool("grid", "grid", "Grid (G)", () => this.toggleGrid()),
            tool("up", "up", "Swap the axis that is up (U)", () => this.swapUp()),
        );
    }

    #head(): void {
        this.panel.head.append(
            h(
                "div",
                { class: "title" },
                h("strong", {}, "cbvh"),
                h("span", { class: "muted" }, "view"),
                h("span", { class: "grow" }),
                iconButton("open", "Open files (O)", () => this.drop.choose()),
                iconButton("theme", "Dark or light (D)", () => this.toggleTheme()),
                iconButton("help", "Keys (?)", () => showKeys()),
                iconButton("about", "About", () => void showAbout()),
            ),
            this.#files,
        );
    }

    #foot(): void {
        this.panel.foot.append(
            iconButton("link", "Copy a link to this view", () => this.#copyLink(), "Copy link"),
            iconButton(
                "command",
                "Copy the command line that asks the same (C)",
                () => this.copyCommand(),
                "Copy command",
            ),
        );
    }

    async copy(text: string, what: string): Promise<void> {
        try {
            await navigator.clipboard.writeText(text);
        } catch {
            // A page from a file may not have the clipboard.
            const area = h("textarea", { "aria-hidden": "true" });
            area.value = text;
            document.body.append(area);
            area.select();
            document.execCommand("copy");
            area.remove();
        }
        this.messages.say(`${what} was copied.`);
    }

    #copyLink(): void {
        location.hash = stateOf(this);
        void this.copy(location.href, "A link to this view");
    }

    copyCommand(): void {
        void this.copy(command(this), "The command");
    }

    /** The path of a file, as it was given on the command line. */
    pathOf(file: number): string {
        return (
            this.#content?.files[file]?.path ?? this.bodies.find((body) => body.file === file)?.shown.summary.name ?? ""
        );
    }

    async #save(body: Body): Promise<void> {
        const bytes = await this.asker.ask("bytes", body.file);
        const name = body.shown.summary.name.replace(/\.[^.]*$/, "");
        const address = URL.createObjectURL(new Blob([bytes as Uint8Array<ArrayBuffer>]));
        const link = h("a", { href: address, download: `${name}.cbvh` });
        link.click();
        setTimeout(() => URL.revokeObjectURL(address), 10_000);
    }

    setHandleMode(mode: "translate" | "rotate"): void {
        // The button of the present mode hides the handles.
        this.handles.isShown = !(this.handles.isShown && this.handles.mode === mode);
        this.handles.mode = mode;
        this.#showTools();
    }

    toggleLocal(): void {
        this.handles.isLocal = !this.handles.isLocal;
    }

    fit(): void {
        this.stage.fit(this.stage.boxOf(this.bodies.filter((body) => body.isVisible).map((body) => body.group)), true);
    }

    lookAlong(axis: number): void {
        this.stage.lookFrom(new Vector3(axis === 0 ? 1 : 0, axis === 1 ? -1 : 0, axis === 2 ? 1 : 0).addScalar(1e-4));
    }

    swapUp(): void {
        this.stage.setUp(this.stage.camera.up.z > 0.5 ? "y" : "z");
        const box: Box3 = this.stage.boxOf(this.bodies.map((body) => body.group));
        if (!box.isEmpty()) {
            this.stage.groundAt(
                this.stage.camera.up.z > 0.5 ? box.min.z : box.min.y,
                box.getSize(new Vector3()).length() / 1.5,
            );
        }
    }

    toggleXray(): void {
        this.opacity = this.opacity < 1 ? 1 : 0.35;
        this.#applyLook();
    }

    toggleEdges(): void {
        this.#hasEdges = !this.#hasEdges;
        this.#applyLook();
    }

    toggleSmooth(): void {
        this.#isSmooth = !this.#isSmooth;
        this.#applyLook();
    }

    toggleGrid(): void {
        this.stage.showsGrid = !this.stage.showsGrid;
        this.#showTools();
    }

    toggleTheme(): void {
        this.#setDark(!this.#isDark);
    }

    togglePlay(): void {
        if (this.mode === "scene") {
            this.scene.toggle();
        } else {
            this.motion.toggle();
        }
    }

    step(by: number): void {
        if (this.mode === "scene") {
            void this.scene.go(Math.max(0, this.scene.frame + by));
        } else {
            void this.motion.go(Math.min(Math.max(this.motion.time + by / 100, 0), 1));
        }
    }

    /** The colour of a body. */
    colourOf(body: Body): number {
        const { palette } = this.stage;
        if (this.mode === "scene") {
            return this.scene.colourOf(this.bodies.indexOf(body));
        }
        return body.name === "B" ? palette.b : palette.a;
    }

    /** How opaque a body is: in scenes, what moves or touches is seen through the rest. */
    opacityOf(body: Body): number {
        const isShownWhole = this.mode === "scene" && !this.scene.isBackground(this.bodies.indexOf(body));
        return isShownWhole ? 1 : this.opacity;
    }

    #applyLook(): void {
        for (const body of this.bodies) {
            body.setSmooth(this.#isSmooth);
            body.setOpacity(this.opacityOf(body));
            body.setEdges(this.#hasEdges, this.#isDark ? 0x000000 : 0x1b2430);
            body.setColour(this.colourOf(body));
        }
        this.#showTools();
    }

    #showTools(): void {
        const pressed = {
            xray: this.opacity < 1,
            edges: this.#hasEdges,
            smooth: this.#isSmooth,
            grid: this.stage.showsGrid,
            translate: this.handles.isShown && this.handles.mode === "translate",
            rotate: this.handles.isShown && this.handles.mode === "rotate",
        };
        for (const [name, is] of Object.entries(pressed)) {
            this.#tools.get(name)?.setAttribute("aria-pressed", String(is));
        }
    }

    #setDark(dark: boolean): void {
        this.#isDark = dark;
        document.documentElement.dataset.theme = dark ? "dark" : "light";
        this.stage.setDark(dark);
        this.#applyLook();
        if (this.pair.isComplete) {
            void this.pair.refresh();
        } else if (this.mode === "scene") {
            this.scene.recolour();
        }
    }
}

/** Whether the only file of a page is both A and B. */
function isTwice({ show, same, files }: Content): boolean {
    return files.length === 1 && (show.kind === "pair" || show.kind === "motion") && (same ?? show.same ?? true);
}

const c0 = (corners: number[][], axis: number): number => corners[0]?.[axis] ?? 0;

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
