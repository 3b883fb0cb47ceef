/** Runs a case in a browser: in the page that imports this, or in the worker that this is. */

import * as cbvh from "../dist/index.js";
import { cases } from "./cases.js";
import { remoteCases } from "./remote.js";

async function get(address) {
    const response = await fetch(new URL(`../../../${address}`, import.meta.url));
    if (!response.ok) {
        throw new Error(`${address}: status ${response.status}`);
    }
    return response;
}

const read = async (name) => new Uint8Array(await (await get(name)).arrayBuffer());
const list = async (folder, prefix) => (await get(`list/${folder}/${prefix}`)).json();

/** Returns "passed", or the error. */
export async function run(name) {
    try {
        await cbvh.init();
        if (name in cases) {
            await cases[name](cbvh, read, list);
        } else {
            await remoteCases[name](cbvh, () => cbvh.CbvhWorker.start());
        }
        return "passed";
    } catch (error) {
        return error.stack;
    }
}

if (typeof WorkerGlobalScope !== "undefined") {
    globalThis.onmessage = async (event) => postMessage(await run(event.data));
    postMessage("ready");
}
