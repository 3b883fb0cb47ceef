/** Starts the page: unpacks the worker and the module, shows the content, and says when it is drawn. */

import { App } from "./app.js";
import { Asker } from "./asker.js";
import { addButtons } from "./buttons.js";
import { readContent } from "./content.js";
import { describe, failPage, messageOf } from "./errors.js";
import { listen } from "./keys.js";
import { restore } from "./link.js";
import { unpack } from "./unpack.js";

/** Refuses a browser without WebAssembly. The worker checks for SIMD, and the stage for WebGL. */
function checkBrowser(): void {
    if (typeof WebAssembly !== "object" || typeof WebAssembly.instantiate !== "function") {
        throw new Error("this page needs WebAssembly, which is switched off in this browser");
    }
}

async function start(): Promise<void> {
    const root = document.documentElement;
    const loading = document.querySelector("#loading .loading-text");
    const say = (text: string) => {
        if (loading !== null) {
            loading.textContent = text;
        }
    };
    let name = "";
    try {
        checkBrowser();
        const filled = readContent();
        const [worker, module] = await Promise.all([unpack("cbvh-worker"), unpack("cbvh-module")]);
        performance.mark("unpacked");
        const asker = new Asker(worker);
        const started = asker.ask("start", module);
        const host = document.getElementById("app");
        if (host === null) {
            throw new Error("expected the element #app in this page, found none");
        }
        const app = new App(asker, host);
        addButtons(app);
        listen(app);
        const prefersDark = window.matchMedia("(prefers-color-scheme: dark)");
        app.look.setDark(prefersDark.matches);
        prefersDark.addEventListener("change", () => app.look.setDark(prefersDark.matches));
        await started;
        performance.mark("module started");
        if (filled === undefined) {
            app.showNothing();
        } else {
            await app.show(filled.content, filled.packed, (file) => {
                name = file;
                say(`Reading ${file}`);
            });
            await restore(app);
        }
        app.view.stage.drawNow();
        document.getElementById("loading")?.remove();
        root.dataset.state = "ready";
        performance.mark("drawn");
        Object.assign(window, { cbvhView: app });
    } catch (error) {
        const message = messageOf(error);
        failPage("This page cannot show the meshes", describe(name, message));
    }
}

void start();
