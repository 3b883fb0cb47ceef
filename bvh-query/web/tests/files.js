/** Files for tests, and a server that a browser loads them from. */

import { readFile, readdir } from "node:fs/promises";
import { createServer } from "node:http";
import path from "node:path";
import { fileURLToPath } from "node:url";

/** The root of the checkout. */
export const ROOT = fileURLToPath(new URL("../../../", import.meta.url));

export const read = async (name) => new Uint8Array(await readFile(path.join(ROOT, name)));

export const list = async (folder, prefix) =>
    (await readdir(path.join(ROOT, folder))).filter((name) => name.startsWith(prefix)).sort();

const TYPES = { ".html": "text/html", ".js": "text/javascript", ".wasm": "application/wasm" };

/** Serves the checkout, and lists of files at /list/FOLDER/PREFIX. */
export async function serve() {
    const server = createServer(async (request, response) => {
        const name = decodeURIComponent(new URL(request.url, "http://localhost").pathname);
        try {
            const [, word, folder, prefix] = name.split("/");
            const body = word === "list" ? JSON.stringify(await list(folder, prefix)) : await read(path.normalize(name));
            response.writeHead(200, { "content-type": TYPES[path.extname(name)] ?? "application/octet-stream" }).end(body);
        } catch {
            response.writeHead(404).end();
        }
    });
    await new Promise((resolve) => server.listen(0, "127.0.0.1", resolve));
    return { address: `http://127.0.0.1:${server.address().port}`, close: () => server.close() };
}
