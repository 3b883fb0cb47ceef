/** The package for Node, whose `fetch` reads no files. */

import { readFile } from "node:fs/promises";
import { init as start, type ModuleSource } from "./module.js";

export * from "./index.js";

export async function init(source?: ModuleSource): Promise<void> {
    await start(source ?? (await readFile(new URL("./raw/cbvh_bg.wasm", import.meta.url))));
}
