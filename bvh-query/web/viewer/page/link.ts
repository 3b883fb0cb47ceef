/** What a link to this page says: the pose, the camera, the tab, and what is drawn. It is in the hash of the address. */

import { Vector3 } from "three";
import type { App } from "./app.js";
import { messageOf } from "./errors.js";
import { words } from "./pose.js";

/** Writes the present state. */
function stateOf(app: App): string {
    const { camera, orbit } = app.view.stage;
    const parameters = new URLSearchParams();
    const numbers = (of: ArrayLike<number>) => Array.from(of, String).join(",");
    if (app.pair.isComplete) {
        parameters.set("pose", numbers(app.pair.pose));
    }
    const view = [...camera.position.toArray(), ...orbit.target.toArray()].map((value) => Number(value.toPrecision(7)));
    parameters.set("view", numbers(view));
    parameters.set("up", camera.up.y > 0.5 ? "y" : "z");
    parameters.set("tab", app.view.panel.current);
    const { draw, level, paint } = app.inside.state;
    if (draw !== "none" || paint !== "plain") {
        Object.entries({ draw, level, paint }).forEach(([name, value]) => {
            parameters.set(name, value);
        });
    }
    const { motion } = app.motion;
    if (motion !== undefined) {
        parameters.set("motion", numbers(motion));
        parameters.set("clearance", String(app.motion.clearance));
        if (app.motion.tolerance !== undefined) {
            parameters.set("tolerance", String(app.motion.tolerance));
        }
        parameters.set("time", String(app.motion.time));
    }
    if (app.view.isRobot) {
        parameters.set("joints", numbers(app.robot.values));
    } else if (app.view.mode === "scene") {
        parameters.set("frame", String(app.scene.frame));
    }
    const { current } = app.selection;
    if (current !== undefined) {
        parameters.set("triangle", `${current.body},${current.triangle}`);
    }
    return parameters.toString().replaceAll("%2C", ",");
}

/** Copies a link to the present state, and goes to it. */
export function copyLink(app: App): void {
    location.hash = stateOf(app);
    void app.view.copy(location.href, "A link to this view");
}

/** Goes to the state that the address names, if it names one. What an address names wrongly is left out, and said. */
export async function restore(app: App): Promise<void> {
    try {
        await restoreFrom(app, new URLSearchParams(location.hash.slice(1)));
    } catch (error) {
        app.view.messages.say(`This link names something that cannot be shown: ${messageOf(error)}`, "error");
    }
}

async function restoreFrom(app: App, parameters: URLSearchParams): Promise<void> {
    const { panel, stage, mode } = app.view;
    const numbers = (name: string, count: number) => {
        const text = parameters.get(name);
        if (text === null || text === "") {
            return undefined;
        }
        const found = text.split(",").map(Number);
        return found.length === count && found.every(Number.isFinite) ? Float64Array.from(found) : undefined;
    };
    const number = (name: string) => numbers(name, 1)?.[0];
    const up = parameters.get("up");
    if (up === "y" || up === "z") {
        stage.setUp(up);
    }
    const camera = numbers("view", 6);
    // In units of the stage, in which everything has a size of about 1.
    if (camera?.every((value) => Math.abs(value) < 1e6)) {
        stage.camera.position.copy(new Vector3().fromArray(camera, 0));
        stage.orbit.target.copy(new Vector3().fromArray(camera, 3));
        stage.orbit.update();
    }
    const [motion, pose, frame] = [numbers("motion", 24), numbers("pose", 12), number("frame")];
    if (app.pair.isComplete) {
        if (motion !== undefined) {
            await app.motion.set(motion, number("clearance"), number("tolerance"));
            await app.motion.go(number("time") ?? 0);
        }
        if (pose !== undefined) {
            await app.pair.setPose(pose);
        }
    }
    const joints = numbers("joints", app.robot.values.length);
    if (joints !== undefined) {
        await app.robot.place([...joints]);
    } else if (frame !== undefined && mode === "scene") {
        await app.scene.go(frame);
    }
    const text = (name: string) => parameters.get(name) ?? undefined;
    app.inside.restore({ draw: text("draw"), level: text("level"), paint: text("paint") });
    panel.show(text("tab") ?? "");
    const triangle = numbers("triangle", 2);
    if (triangle !== undefined) {
        await app.selection.select(triangle[0] ?? 0, triangle[1] ?? 0);
    }
}

/** Copies the command line that asks the same, or says why there is none. */
export function copyCommand(app: App): void {
    const line = commandOf(app);
    if (line === undefined) {
        app.view.messages.say("No command asks about two objects with different names.");
    } else {
        void app.view.copy(line, "The command");
    }
}

/** The command line that asks the same; `undefined` if there is none. */
export function commandOf(app: App): string | undefined {
    const { mode, panel } = app.view;
    const { a, b } = app.pair;
    if (app.view.isRobot) {
        return `cbvh robot URDF --joints "${words(app.robot.values)}"`;
    }
    if (mode === "scene" || a === undefined) {
        return mode === "scene" ? "cbvh scene SCENE FRAMES --mode pairs --list" : "cbvh view";
    }
    const [[pathA = "", objectA], [pathB = "", objectB]] = [app.wordsOf(a), b === undefined ? [] : app.wordsOf(b)];
    if (b === undefined) {
        return `cbvh dump ${fileWord(pathA)}`;
    }
    if (objectA !== undefined && objectB !== undefined && objectA !== objectB) {
        return undefined;
    }
    const object = objectA ?? objectB;
    const files = `${fileWord(pathA)} ${fileWord(pathB)}`;
    const end = object === undefined ? "" : ` --object=${quoted(object)}`;
    const { motion, clearance, tolerance } = app.motion;
    if (panel.current === "motion" && motion !== undefined) {
        const within = clearance > 0 ? ` --clearance ${clearance}` : "";
        const unsure = tolerance === undefined ? "" : ` --tolerance ${tolerance}`;
        return `echo "${words(motion)}" | cbvh motion ${files} /dev/stdin${within}${unsure}${end}`;
    }
    const touches = app.pair.near?.distance.distance === 0;
    const asks = touches ? "contacts" : "distance";
    return `cbvh query ${files} --mode ${asks} --pose "${words(app.pair.pose)}"${end}`;
}

/** The path of a file for a shell. One that begins with a dash would be an option. */
const fileWord = (path: string): string => quoted(path.startsWith("-") ? `./${path}` : path);

/** A word for a shell. A terminal may obey control characters when the word is pasted, even within quotes. */
function quoted(word: string): string {
    if (/^[\w./+-]+$/.test(word)) {
        return word;
    }
    if (/[\p{Cc}\p{Cf}\p{Zl}\p{Zp}]/u.test(word)) {
        return `$'${word.replaceAll(/[\\'\p{Cc}\p{Cf}\p{Zl}\p{Zp}]/gu, octal)}'`;
    }
    return `'${word.replaceAll("'", "'\\''")}'`;
}

/** A character as bytes of UTF-8 within the quotes $'...'. */
const octal = (character: string): string =>
    Array.from(new TextEncoder().encode(character), (byte) => `\\${byte.toString(8).padStart(3, "0")}`).join("");
