/** Runs the cases in Node, and what is about Node alone. */

import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import test from "node:test";
import { MessageChannel, Worker } from "node:worker_threads";
import * as cbvh from "cbvh";
import { cases } from "./cases.js";
import { list, read } from "./files.js";
import { remoteCases } from "./remote.js";

await cbvh.init();
for (const [name, work] of Object.entries(cases)) {
    test(name, () => work(cbvh, read, list));
}

/** Runs a program in a process of its own, and returns what it prints. */
const run = (program, ...flags) =>
    execFileSync(process.execPath, [...flags, "--input-type=module", "-e", program], {
        cwd: new URL(".", import.meta.url),
        encoding: "utf8",
    }).trim();

test("nothing works before the module is loaded, and one that is not there can be loaded later", () => {
    const program = `
        import { init, initSync, Mesh, Motion, Scene, memoryBytes } from "cbvh";
        import { readFileSync } from "node:fs";
        const bytes = readFileSync(new URL("../dist/raw/cbvh_bg.wasm", "${import.meta.url}"));
        const works = [() => Mesh.open(new Uint8Array(9)), () => new Scene(), () => Motion.through([]), memoryBytes];
        for (const work of works) try { console.log(work()) } catch (error) { console.log(error.message) }
        const failing = init(new Uint8Array(9)).catch((error) => console.log(error.name));
        try { initSync(bytes) } catch (error) { console.log(error.message) }
        await failing;
        await init("data:text/plain,no").catch((error) => console.log(error.name));
        initSync(bytes);
        initSync(bytes);
        await init();
        console.log(Mesh.bake([0, 0, 0, 1, 0, 0, 0, 1, 0]).triangleCount);`;
    const message = "cbvh: expected a loaded module, found none; await init() first";
    const under = "cbvh: expected no init under way, found one; await it instead";
    const found = run(program).split("\n");
    assert.deepEqual(found, [message, message, message, "0", under, "CompileError", "CompileError", "1"]);
});

test("without SIMD or WebAssembly, the error says so", () => {
    const program = (before) => `
        ${before}
        const { init } = await import("cbvh");
        await init().catch((error) => console.log(error.message));`;
    assert.match(run(program("WebAssembly.validate = () => false;")), /expected WebAssembly with SIMD.*Safari 16\.4/);
    assert.match(run(program("delete globalThis.WebAssembly;")), /expected WebAssembly, found none/);
});

test("without room for an argument nothing is lost, and a bake without memory ends the module", () => {
    const program = `
        import { init, Mesh } from "cbvh";
        await init();
        const mesh = Mesh.bake([0, 0, 0, 1, 0, 0, 0, 1, 0]);
        const attempt = (work) => {
            try { work(); console.log("answered") } catch (error) { console.log(error.message) }
        };
        attempt(() => Mesh.open(new Uint8Array(200e6)));
        attempt(() => mesh.collideEach(mesh, new Float64Array(12 * 2 ** 21)));
        attempt(() => mesh.bytes());
        attempt(() => Mesh.bake(Float64Array.from({ length: 9 * 2 ** 18 }, (_, k) => (k * k) % 1000003)));
        attempt(() => mesh.bytes());
        attempt(() => Mesh.open(new Uint8Array(9)));`;
    const [open, poses, usable, full, later, latest] = run(program, "--wasm-max-mem-pages=1600").split("\n");
    assert.match(open, /^bytes: expected room in memory, found none for 200000000 bytes$/);
    assert.match(poses, /^poses: expected room in memory, found none for \d+ bytes$/);
    assert.equal(usable, "answered");
    assert.match(full, /^cbvh: expected memory for the answer, found no more of it/);
    assert.deepEqual([later, latest], [full, full]);
});

test("a worker gets the compiled module", async () => {
    const module = await WebAssembly.compile(await read("bvh-query/web/dist/raw/cbvh_bg.wasm"));
    const program = `
        import { parentPort, workerData } from "node:worker_threads";
        import { initSync, Mesh } from ${JSON.stringify(import.meta.resolve("cbvh"))};
        initSync(workerData);
        parentPort.postMessage(Mesh.bake([0, 0, 0, 1, 0, 0, 0, 1, 0]).bytes());`;
    const worker = new Worker(new URL(`data:text/javascript,${encodeURIComponent(program)}`), { workerData: module });
    const bytes = await new Promise((resolve, reject) => worker.once("message", resolve).once("error", reject));
    await worker.terminate();
    assert.equal(cbvh.Mesh.open(bytes).triangleCount, 1);
});

/** Starts a worker of Node, which serves a port. */
function start() {
    const { port1, port2 } = new MessageChannel();
    const program = `
        import { workerData } from "node:worker_threads";
        import { serve } from ${JSON.stringify(import.meta.resolve("cbvh"))};
        serve(workerData);`;
    const url = new URL(`data:text/javascript,${encodeURIComponent(program)}`);
    new Worker(url, { workerData: port2, transferList: [port2] });
    return cbvh.CbvhWorker.start(undefined, port1);
}

for (const [name, work] of Object.entries(remoteCases)) {
    test(`served by a worker: ${name}`, () => work(cbvh, start));
}

test("without a class Worker, a port is asked for", async () => {
    await assert.rejects(() => cbvh.CbvhWorker.start(), /^Error: port: expected a port to a worker that calls `serve`/);
});
