/** Says what this page is, and under which licences its parts are. */

import { h } from "./dom.js";
import { dialog } from "./panel.js";
import { unpackText } from "./unpack.js";

declare const VERSION: string;

let known: Promise<string> | undefined;

export async function showAbout(): Promise<void> {
    known ??= unpackText("cbvh-licences");
    const licences = await known;
    dialog(
        "About",
        h(
            "p",
            {},
            `cbvh ${VERSION} answers exact collision and distance queries between triangle meshes. `,
            "This page contains the library, compiled to WebAssembly, and asks it in your browser. Nothing leaves this page.",
        ),
        h("p", {}, "cbvh is under the MIT licence or the Apache licence 2.0, as you choose."),
        h("h2", {}, "Code of other authors"),
        h("pre", { class: "licences" }, licences),
    );
}
