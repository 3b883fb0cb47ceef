/** What a link to this page says: the pose, the camera, the tab, and what is drawn. It is in the hash of the address. */

import { Vector3 } from "three";
import type { App } from "./app.js";
import { words } from "./pose.js";

/** Writes the present state. */
export function stateOf(app: App): string {
    const { camera, orbit } = app.stage;
    const parameters = new URLSearchParams();
    const numbers = (of: ArrayLike<number>) => Array.from(of, String).join(",");
    if (app.pair.isComplete) {
        parameters.set("pose", numbers(app.pair.pose));
    }
    const view = [...camera.position.toArray(), ...orbit.target.toArray()].map((value) => Number(value.toPrecision(7)));
    parameters.set("view", numbers(view));
    parameters.set("up", camera.up.y > 0.5 ? "y" : "z");
    parameters.set("tab", app.panel.current);
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
        parameters.set("time", String(app.motion.time));
    }
    if (app.mode === "scene") {
        parameters.set("frame", String(app.scene.frame));
    }
    if (app.selection !== undefined) {
        parameters.set("triangle", `${app.selection.body},${app.selection.triangle}`);
    }
    return parameters.toString().replaceAll("%2C", ",");
}

/** Goes to the state that the address names, if it names one. */
export async function restore(app: App): Promise<void> {
    const parameters = new URLSearchParams(location.hash.slice(1));
    const numbers = (name: string, count: number) => {
        const text = parameters.get(name);
        if (text === null || text === "") {
            return undefined;
        }
        const found = text.split(",").map(Number);
        return found.length === count && found.every(Number.isFinite) ? Float64Array.from(found) : undefined;
    };
    const up = parameters.get("up");
    if (up === "y" || up === "z") {
        app.stage.setUp(up);
    }
    const view = numbers("view", 6);
    if (view !== undefined) {
        app.stage.camera.position.copy(new Vector3().fromArray(view, 0));
        app.stage.orbit.target.copy(new Vector3().fromArray(view, 3));
        app.stage.orbit.update();
    }
    const [motion, time] = [numbers("motion", 24), numbers("time", 1)];
    if (motion !== undefined && app.pair.isComplete) {
        await app.motion.set(motion, numbers("clearance", 1)?.[0]);
        await app.motion.go(time?.[0] ?? 0);
    }
    const pose = numbers("pose", 12);
    if (pose !== undefined && app.pair.isComplete) {
        await app.pair.setPose(pose);
    }
    const frame = numbers("frame", 1)?.[0];
    if (frame !== undefined && app.mode === "scene") {
        await app.scene.go(frame);
    }
    const text = (name: string) => parameters.get(name) ?? undefined;
    app.inside.restore({ draw: text("draw"), level: text("level"), paint: text("paint") });
    const tab = text("tab");
    if (tab !== undefined) {
        app.panel.show(tab);
    }
    const triangle = numbers("triangle", 2);
    if (triangle !== undefined) {
        await app.select(triangle[0] ?? 0, triangle[1] ?? 0);
    }
}

/** The command line that asks the same. */
export function command(app: App): string {
    const quote = (word: string) => (/^[\w./+-]+$/.test(word) ? word : `'${word.replaceAll("'", "'\\''")}'`);
    const { a, b } = app.pair;
    if (app.mode === "scene" || a === undefined) {
        return app.mode === "scene" ? "cbvh scene SCENE FRAMES --mode pairs --list" : "cbvh view";
    }
    const path = (file: number) => quote(app.pathOf(file));
    if (b === undefined) {
        return `cbvh dump ${path(a.file)}`;
    }
    const { motion } = app.motion;
    if (app.panel.current === "motion" && motion !== undefined) {
        const clearance = app.motion.clearance > 0 ? ` --clearance ${app.motion.clearance}` : "";
        return `echo "${words(motion)}" | cbvh motion ${path(a.file)} ${path(b.file)} /dev/stdin${clearance}`;
    }
    const touches = app.pair.near?.distance.distance === 0;
    const mode = touches ? "contacts" : "distance";
    return `cbvh query ${path(a.file)} ${path(b.file)} --mode ${mode} --pose "${words(app.pair.pose)}"`;
}
