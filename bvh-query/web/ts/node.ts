/** The package for Node, whose `fetch` reads no files. */

import { readFile } from "node:fs/promises";
import { init as start, type ModuleSource } from "./module.js";
import type { Port } from "./remote.js";
import { serve as answer } from "./serve.js";

export * from "./index.js";

/** Loads the module, as in a browser; by default from the file beside this package's code. */
export async function init(source?: ModuleSource): Promise<void> {
    await start(source ?? (await readFile(new URL("./raw/cbvh_bg.wasm", import.meta.url))));
}

/** Answers the messages of a `CbvhWorker` at the other end of a port, as in a browser. */
export function serve(port: Port): void {
    answer(port, init);
}
