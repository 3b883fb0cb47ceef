/** The keys of the page. */

import { Vector3 } from "three";
import type { App } from "./app.js";
import { h } from "./dom.js";
import { copyCommand } from "./link.js";
import { dialog } from "./panel.js";
import { fromQuaternion, move, placedAt, position, product, turn } from "./pose.js";

interface Key {
    /** How it is written in the list. */
    name: string;
    does: string;
    /** Whether an event is this key. */
    is: (event: KeyboardEvent) => boolean;
    run: (app: App, event: KeyboardEvent) => void;
}

const plain = (letter: string) => (event: KeyboardEvent) =>
    event.key.toLowerCase() === letter && !event.ctrlKey && !event.metaKey && !event.altKey;
const ARROWS: Record<string, [number, number]> = {
    ArrowLeft: [-1, 0],
    ArrowRight: [1, 0],
    ArrowUp: [0, 1],
    ArrowDown: [0, -1],
};
const isArrow = (event: KeyboardEvent) => ARROWS[event.key] !== undefined;

/** Moves or turns B in the plane of the picture. */
function nudge(app: App, event: KeyboardEvent, step: number): void {
    const body = app.view.handles.body;
    if (body === undefined) {
        return;
    }
    const [x, y] = ARROWS[event.key] ?? [0, 0];
    const away = event.key === "PageUp" ? -1 : event.key === "PageDown" ? 1 : 0;
    const right = new Vector3().setFromMatrixColumn(app.view.stage.camera.matrixWorld, 0);
    const up = new Vector3().setFromMatrixColumn(app.view.stage.camera.matrixWorld, 1);
    const back = new Vector3().setFromMatrixColumn(app.view.stage.camera.matrixWorld, 2);
    const along = right.multiplyScalar(x).addScaledVector(up, y).addScaledVector(back, away);
    const { pose } = body;
    if (app.view.handles.mode === "translate") {
        const [px, py, pz] = position(pose);
        const length = 0.01 * step * app.view.size;
        app.moveBody(body, placedAt(pose, [px + along.x * length, py + along.y * length, pz + along.z * length]));
        return;
    }
    const axis = new Vector3().crossVectors(back, along).normalize();
    if (away !== 0) {
        axis.copy(back).multiplyScalar(away);
    }
    const half = (step * Math.PI) / 180;
    const s = Math.sin(half);
    const turned = product(fromQuaternion([axis.x * s, axis.y * s, axis.z * s, Math.cos(half)], [0, 0, 0]), pose);
    const [cx, cy, cz] = move(pose, body.shown.centre);
    const [tx, ty, tz] = turn(turned, body.shown.centre);
    app.moveBody(body, placedAt(turned, [cx - tx, cy - ty, cz - tz]));
}

function toggleLocal({ view: { handles } }: App): void {
    handles.isLocal = !handles.isLocal;
}

const KEYS: Key[] = [
    {
        name: "T",
        does: "move B with the handles, or hide them",
        is: plain("t"),
        run: (app) => app.setHandleMode("translate"),
    },
    {
        name: "R",
        does: "turn B with the handles, or hide them",
        is: plain("r"),
        run: (app) => app.setHandleMode("rotate"),
    },
    { name: "L", does: "handles along the axes of A or of B", is: plain("l"), run: (app) => toggleLocal(app) },
    {
        name: "Alt + arrows, Page Up, Page Down",
        does: "move or turn B by a small step, with Shift by a large one",
        is: (event) => event.altKey && (isArrow(event) || event.key.startsWith("Page")),
        run: (app, event) => nudge(app, event, event.shiftKey ? 10 : 1),
    },
    {
        name: "arrows",
        does: "turn the view",
        is: (event) => isArrow(event) && !event.altKey && !event.ctrlKey,
        run: (app, event) => {
            const [x, y] = ARROWS[event.key] ?? [0, 0];
            app.view.stage.turnBy(-0.12 * x, -0.1 * y);
        },
    },
    {
        name: "+ and −",
        does: "zoom",
        is: (event) => "+=-".includes(event.key) && event.key.length === 1,
        run: (app, event) => app.view.stage.turnBy(0, 0, event.key === "-" ? 1.15 : 1 / 1.15),
    },
    { name: "F", does: "fit everything into the view", is: plain("f"), run: (app) => app.fit() },
    {
        name: "1, 2, 3",
        does: "look along an axis",
        is: (event) => "123".includes(event.key) && !event.altKey && !event.ctrlKey,
        run: (app, event) => app.lookAlong(Number(event.key) - 1),
    },
    { name: "U", does: "swap the axis that is up", is: plain("u"), run: (app) => app.swapUp() },
    { name: "X", does: "see through the meshes", is: plain("x"), run: (app) => app.look.toggleXray() },
    { name: "E", does: "edges of triangles", is: plain("e"), run: (app) => app.look.toggleEdges() },
    { name: "S", does: "smooth or flat", is: plain("s"), run: (app) => app.look.toggleSmooth() },
    { name: "G", does: "grid", is: plain("g"), run: (app) => app.look.toggleGrid() },
    { name: "D", does: "dark or light", is: plain("d"), run: (app) => app.look.toggleTheme() },
    { name: "Space", does: "play or pause the motion or the frames", is: plain(" "), run: (app) => app.togglePlay() },
    {
        name: "[ and ]",
        does: "one step back or on",
        is: (event) => event.key === "[" || event.key === "]",
        run: (app, event) => app.step(event.key === "]" ? 1 : -1),
    },
    {
        name: "P",
        does: "ask about the triangle in the middle of the view",
        is: plain("p"),
        run: (app) => app.selection.pickMiddle(),
    },
    { name: "O", does: "open files", is: plain("o"), run: (app) => app.drop.choose() },
    { name: "C", does: "copy the command line", is: plain("c"), run: (app) => copyCommand(app) },
    {
        name: "Esc",
        does: "forget what is selected",
        is: (event) => event.key === "Escape",
        run: (app) => app.selection.clear(),
    },
    { name: "?", does: "this list", is: (event) => event.key === "?", run: () => showKeys() },
];

export function showKeys(): void {
    dialog(
        "Keys",
        h(
            "dl",
            { class: "keys" },
            ...KEYS.map(({ name, does }) => h("div", {}, h("dt", {}, h("kbd", {}, name)), h("dd", {}, does))),
        ),
        h("h2", {}, "Mouse and touch"),
        h(
            "dl",
            { class: "keys" },
            ...[
                ["drag, one finger", "turn the view"],
                ["right or Shift + drag, two fingers", "shift the view"],
                ["wheel, pinch", "zoom"],
                ["click, tap", "ask about a triangle"],
                ["drag a handle", "move or turn B"],
                ["drop a file", "the first becomes A, the next B"],
            ].map(([name = "", does = ""]) => h("div", {}, h("dt", {}, h("kbd", {}, name)), h("dd", {}, does))),
        ),
    );
}

/** Listens to the keys of the page. In fields, keys are text; buttons keep Space. */
export function listen(app: App): void {
    window.addEventListener("keydown", (event) => {
        const { target } = event;
        if (target instanceof HTMLElement) {
            const isField = target.matches("input:not([type=range]), textarea, select");
            const isTaken =
                target.matches("button, summary, input[type=range], [role=tab]") &&
                (event.key === " " || event.key === "Enter" || isArrow(event));
            if (
                (isField && event.key !== "Escape") ||
                (isTaken && !event.altKey) ||
                target.closest("dialog") !== null
            ) {
                return;
            }
        }
        const key = KEYS.find((one) => one.is(event));
        if (key !== undefined) {
            event.preventDefault();
            key.run(app, event);
        }
    });
}
