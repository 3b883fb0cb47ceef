/** Runs the cases in a page and in a worker of Chromium, and the example page as a visitor does. CHROMIUM names the browser. */

import assert from "node:assert/strict";
import { mkdtemp, rm } from "node:fs/promises";
import os from "node:os";
import path from "node:path";
import test, { after } from "node:test";
import { chromium } from "playwright-core";
import { cases } from "./cases.js";
import { read, serve } from "./files.js";
import { writers } from "./formats.js";
import { remoteCases } from "./remote.js";

const server = await serve();
const browser = await chromium.launch({
    executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
    args: ["--no-sandbox", "--js-flags=--expose-gc"],
});
after(async () => {
    await browser.close();
    server.close();
});

/** Opens a page, and fails if it prints an error. */
async function open(address) {
    const page = await browser.newPage();
    const errors = [];
    page.on("console", (message) => message.type() === "error" && errors.push(message.text()));
    page.on("pageerror", (error) => errors.push(String(error)));
    await page.goto(server.address + address);
    return { page, errors };
}

for (const name of Object.keys({ ...cases, ...remoteCases })) {
    test(`page: ${name}`, async () => {
        const { page, errors } = await open("/bvh-query/web/tests/blank.html");
        const said = await page.evaluate(async (name) => (await import("./run.js")).run(name), name);
        assert.equal(said, "passed");
        assert.deepEqual(errors, []);
        await page.close();
    });
    if (name in remoteCases) {
        continue;
    }
    test(`worker: ${name}`, async () => {
        const { page, errors } = await open("/bvh-query/web/tests/blank.html");
        const said = await page.evaluate((name) => {
            const worker = new Worker("run.js", { type: "module" });
            return new Promise((resolve, reject) => {
                worker.onmessage = ({ data }) => (data === "ready" ? worker.postMessage(name) : resolve(data));
                worker.onerror = (event) => reject(new Error(event.message));
            });
        }, name);
        assert.equal(said, "passed");
        assert.deepEqual(errors, []);
        await page.close();
    });
}

test("a module that is not there is an error that names it", async () => {
    const { page } = await open("/bvh-query/web/tests/blank.html");
    const message = await page.evaluate(async () => {
        const { init } = await import("../dist/index.js");
        return init("/nowhere.wasm").catch((error) => error.message);
    });
    assert.equal(message, `cbvh: expected the module at ${server.address}/nowhere.wasm, found status 404`);
    await page.close();
});

test("a worker without a module is an error", async () => {
    const { page } = await open("/bvh-query/web/tests/blank.html");
    const message = await page.evaluate(async () => {
        const { CbvhWorker } = await import("../dist/index.js");
        return CbvhWorker.start("/nowhere.wasm").catch((error) => error.message);
    });
    assert.equal(message, `cbvh: expected the module at ${server.address}/nowhere.wasm, found status 404`);
    await page.close();
});

test("the example moves B, and takes dropped files of all formats", async () => {
    const { page, errors } = await open("/bvh-query/web/example/index.html");
    await page.waitForSelector('html[data-state="ready"]');
    const answer = async () => JSON.parse(await page.getAttribute("html", "data-answer"));
    const first = await answer();
    assert.equal(first.collide, false);
    const slide = (value) =>
        page.evaluate((value) => {
            const slider = document.querySelector("#y");
            slider.value = value;
            slider.dispatchEvent(new Event("input"));
        }, value);
    await slide(2);
    assert.equal((await answer()).collide, true);
    await slide(0);
    assert.deepEqual(await answer(), first);
    const box = await page.locator("canvas").boundingBox();
    await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
    const before = await answer();
    await page.mouse.down();
    await page.mouse.move(box.x + box.width / 2 + 60, box.y + box.height / 2 + 30, { steps: 4 });
    await page.mouse.up();
    assert.notDeepEqual(await answer(), before);

    const cube = await page.evaluate(async () => {
        const { cubeTriangles } = await import("./main.js");
        return [...cubeTriangles];
    });
    const files = Object.entries(writers).map(([ending, write]) => [
        `cube.${ending}`,
        [...write(Float64Array.from(cube))],
    ]);
    files.push(["baked.cbvh", [...(await read("testdata/ok-everything.cbvh"))]]);
    for (const [name, bytes] of files) {
        await page.evaluate(
            ([name, bytes]) => {
                const dropped = new DataTransfer();
                dropped.items.add(new File([new Uint8Array(bytes)], name));
                const event = new DragEvent("drop", { dataTransfer: dropped, bubbles: true, cancelable: true });
                document.querySelector("#drop-b").dispatchEvent(event);
            },
            [name, bytes],
        );
        await page.waitForFunction((name) => document.querySelector("#drop-b").textContent.includes(name), name);
        assert.equal((await answer()).triangles[1], name === "baked.cbvh" ? 13 : 12, name);
    }
    await page.evaluate(() => {
        const dropped = new DataTransfer();
        dropped.items.add(new File(["no mesh"], "notes.txt"));
        document
            .querySelector("#drop-a")
            .dispatchEvent(new DragEvent("drop", { dataTransfer: dropped, bubbles: true }));
    });
    await page.waitForFunction(() => document.querySelector("#message").textContent.startsWith("notes.txt: expected"));
    assert.deepEqual(errors, []);
    const folder = await mkdtemp(path.join(os.tmpdir(), "cbvh-web-"));
    const picture = process.env.CBVH_PICTURE ?? path.join(folder, "example.png");
    await page.screenshot({ path: picture });
    await rm(folder, { recursive: true });
    await page.close();
});
