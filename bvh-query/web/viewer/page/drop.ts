/** Takes files that are dropped on the page or chosen: meshes are baked by the worker. */

import type { FileSummary } from "../worker/files.js";
import { h } from "./dom.js";
import { describe, messageOf } from "./errors.js";
import type { View } from "./view.js";

const ACCEPTED = ".cbvh,.obj,.stl,.ply,.glb,.gltf,.dae,.xyz,.pcd";

export class Drop {
    readonly #input = h("input", {
        type: "file",
        multiple: true,
        hidden: true,
        accept: ACCEPTED,
        "aria-label": "Mesh files",
    });
    readonly #shade = h(
        "div",
        { class: "drop-shade", hidden: true },
        h(
            "div",
            {},
            h("strong", {}, "Drop a mesh"),
            h("span", {}, "OBJ, STL, PLY, GLB, COLLADA, XYZ, PCD or .cbvh. The first becomes A, the next B."),
        ),
    );

    /** @param adopt Shows a file that was opened. */
    constructor(
        readonly view: View,
        readonly adopt: (file: FileSummary) => Promise<void>,
    ) {
        document.body.append(this.#input, this.#shade);
        this.#input.addEventListener("change", () => {
            const files = [...(this.#input.files ?? [])];
            this.#input.value = "";
            void this.take(files);
        });
        let depth = 0;
        const hasFiles = (event: DragEvent) => event.dataTransfer?.types.includes("Files") === true;
        window.addEventListener("dragenter", (event) => {
            if (hasFiles(event)) {
                depth++;
                this.#shade.hidden = false;
            }
        });
        window.addEventListener("dragleave", (event) => {
            if (hasFiles(event)) {
                depth = Math.max(depth - 1, 0);
                this.#shade.hidden = depth === 0;
            }
        });
        window.addEventListener("dragover", (event) => event.preventDefault());
        window.addEventListener("drop", (event) => {
            event.preventDefault();
            depth = 0;
            this.#shade.hidden = true;
            void this.take([...(event.dataTransfer?.files ?? [])]);
        });
    }

    /** Lets the user choose files. */
    choose(): void {
        this.#input.click();
    }

    /** Opens or bakes files, one after the other. */
    async take(files: File[]): Promise<void> {
        for (const file of files) {
            const busy = this.view.messages.busy(file.name);
            busy.stage("reading");
            try {
                const bytes = await file.arrayBuffer();
                const summary = await this.view.asker.askInStages(
                    (stage) => busy.stage(stage),
                    "open",
                    file.name,
                    bytes,
                );
                busy.stage("drawing");
                await this.adopt(summary);
            } catch (error) {
                document.documentElement.dataset.message = `${file.name}: ${messageOf(error)}`;
                this.view.messages.say(describe(file.name, messageOf(error)), "error");
            } finally {
                busy.end();
            }
        }
    }
}
