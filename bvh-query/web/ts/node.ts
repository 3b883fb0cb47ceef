/** The package for Node, whose `fetch` reads no files. */

import { readFile } from "node:fs/promises";
import { init as start, type ModuleSource } from "./module.js";

export * from "./index.js";

/** Loads the module, as in a browser; by default from the file beside this package's code. */
export async function init(source?: ModuleSource): Promise<void> {
    await start(source ?? (await readFile(new URL("./raw/cbvh_bg.wasm", import.meta.url))));
}
