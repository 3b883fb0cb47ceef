/** Fills the page as the command does: with files and with what to show of them. */

import { readFileSync } from "node:fs";
import { fileURLToPath } from "node:url";
import { gzipSync } from "node:zlib";

const TEMPLATE = new URL("../../../view/page.html", import.meta.url);
export const MARK = "<!--cbvh:content-->";

export const template = () => readFileSync(process.env.CBVH_PAGE ?? fileURLToPath(TEMPLATE), "utf8");

/**
 * @param files Lists of a name and bytes.
 * @param show What to show.
 */
export function filled(files, show) {
    const content = {
        version: 1,
        files: files.map(([name, bytes]) => ({ name, path: name, bytes: bytes.length })),
        show,
    };
    const json = JSON.stringify(content).replaceAll("<", "\\u003c");
    const scripts = [`<script type="application/json" id="cbvh-content">${json}</script>`];
    for (const [, bytes] of files) {
        scripts.push(`<script type="text/plain" class="cbvh-file">${gzipSync(bytes).toString("base64")}</script>`);
    }
    return template().replace(MARK, () => scripts.join("\n"));
}
