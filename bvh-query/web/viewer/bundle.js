/**
 * Bundles the page into one file: node bundle.js PAGE.html SOURCES. Says what each part takes, and refuses a page that is too
 * large. The page states SOURCES, the hash of what it is built from.
 */

import { createHash } from "node:crypto";
import { mkdir, readFile, writeFile } from "node:fs/promises";
import path from "node:path";
import { fileURLToPath } from "node:url";
import { gzipSync } from "node:zlib";
import { build, transform } from "esbuild";

/** The most bytes of a page without meshes. */
const MAX_BYTES = 1_600_000;

const here = path.dirname(fileURLToPath(import.meta.url));
const inside = (...names) => path.join(here, ...names);
const read = (...names) => readFile(inside(...names), "utf8");
const { version } = JSON.parse(await read("..", "package.json"));

/** The raw module of this page, in place of that of the package. */
const rawModule = {
    name: "raw module",
    setup: (to) => to.onResolve({ filter: /\/raw\/cbvh\.js$/ }, () => ({ path: inside("dist", "raw", "cbvh.js") })),
};

async function bundle(entry) {
    const result = await build({
        entryPoints: [inside(entry)],
        bundle: true,
        write: false,
        minify: true,
        format: "iife",
        target: ["chrome100", "firefox113", "safari16.4"],
        legalComments: "none",
        define: { VERSION: JSON.stringify(version), "import.meta.url": '"about:blank"' },
        plugins: [rawModule],
        logLevel: "warning",
    });
    return Buffer.from(result.outputFiles[0].contents);
}

/** Of licences joined by "or", the MIT licence is chosen, so that texts of the Apache licence are left out. */
async function licences() {
    const line = "=".repeat(100);
    const [head, ...rest] = (await read("dist", "licences.txt")).split(`\n${line}\n`);
    const kept = [head];
    for (let place = 0; place + 1 < rest.length; place += 2) {
        const [names, text] = [rest[place], rest[place + 1]];
        const isApache = /^\s*Apache License/.test(text);
        const others = rest.filter((_, k) => k % 2 === 0 && k !== place).join("\n");
        if (!isApache || !names.split(", ").every((name) => others.includes(name))) {
            kept.push(`${names}\n${text.trim()}\n`);
        }
    }
    const { version: three } = JSON.parse(await read("..", "node_modules", "three", "package.json"));
    kept.push(`three ${three}\n\n${(await read("..", "node_modules", "three", "LICENSE")).trim()}\n`);
    return Buffer.from(kept.join(`\n${"-".repeat(72)}\n`));
}

/**
 * Writes bytes in base 85: five digits for each four bytes, which takes a sixteenth less than base64. The digits are the characters from
 * ( to ~ without < and >, which no program has to escape. The last word has a digit more than bytes.
 */
function base85(bytes) {
    let text = "";
    for (let place = 0; place < bytes.length; place += 4) {
        const count = Math.min(bytes.length - place, 4);
        let word = 0;
        for (let k = 0; k < 4; k++) {
            word = 256 * word + (k < count ? bytes[place + k] : 0);
        }
        const digits = Array.from({ length: 5 }, (_, k) => 40 + (Math.floor(word / 85 ** (4 - k)) % 85));
        const codes = digits.map((code) => (code < 60 ? code : code < 61 ? 61 : code + 2));
        text += String.fromCharCode(...codes.slice(0, count + 1));
    }
    return text;
}

/** Packs a part as gzip in base 85. The header of gzip has no time, so that the bytes depend on the part alone. */
function packed(id, bytes) {
    const small = gzipSync(bytes, { level: 9 });
    const text = base85(small);
    console.log(
        `${id.padEnd(14)} ${String(bytes.length).padStart(8)} bytes, ${String(small.length).padStart(7)} by gzip, ${text.length} in the page`,
    );
    return `<script type="text/plain" id="${id}">${text}</script>`;
}

/** What a policy calls the only text that an element may have. */
const allowed = (text) => `'sha256-${createHash("sha256").update(text).digest("base64")}'`;

const [to, sources] = process.argv.slice(2);
const main = await bundle("page/main.ts");
const parts = [
    packed("cbvh-main", main),
    packed("cbvh-worker", await bundle("worker/worker.ts")),
    packed("cbvh-module", await readFile(inside("dist", "raw", "cbvh_bg.wasm"))),
    packed("cbvh-licences", await licences()),
];
const minified = async (name, loader) =>
    (await transform(await read("page", name), { loader, minify: true })).code.trim();
const [style, boot] = [await minified("style.css", "css"), await minified("boot.js", "js")];
const fill = {
    "/*ALLOWED-STYLE*/": allowed(style),
    "/*ALLOWED-CODE*/": `${allowed(boot)} ${allowed(main)}`,
    "/*SOURCES*/": sources,
    "/*STYLE*/": style,
    "/*BOOT*/": boot,
    // The last ones: they may contain any marks.
    "/*PARTS*/": parts.join("\n"),
};
const page = Object.entries(fill).reduce(
    (text, [mark, by]) => text.replace(mark, () => by),
    await read("page", "index.html"),
);
if (page.split("\n").filter((line) => line === "<!--cbvh:content-->").length !== 1) {
    throw new Error("index.html: expected one line <!--cbvh:content-->");
}
console.log(`${"page".padEnd(14)} ${String(page.length).padStart(8)} bytes of at most ${MAX_BYTES}`);
if (page.length > MAX_BYTES) {
    throw new Error(`the page: expected at most ${MAX_BYTES} bytes, found ${page.length}`);
}
await mkdir(path.dirname(to), { recursive: true });
await writeFile(to, page);
