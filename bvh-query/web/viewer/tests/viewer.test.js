/**
 * Opens filled pages in headless Chromium, from files, as a user does. Answers are compared with those of the command, whose path
 * is in CBVH. CHROMIUM names the browser, and CBVH_PICTURES a folder for pictures of the page.
 */

import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { createHash } from "node:crypto";
import { existsSync, mkdirSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import os from "node:os";
import path from "node:path";
import test, { after } from "node:test";
import { pathToFileURL } from "node:url";
import { gunzipSync } from "node:zlib";
import { chromium } from "playwright-core";
import { ROOT } from "../../tests/files.js";
import { filled, MARK, template } from "./fill.js";
import { box, overlaps, ring, scene } from "./meshes.js";
import { allKinds, armAndCart, configurations } from "./robots.js";

const COMMAND = process.env.CBVH;
const WITHOUT = COMMAND === undefined && "CBVH names no command";
const MAX_BYTES = 1_600_000;
const folder = mkdtempSync(path.join(os.tmpdir(), "cbvh-page-"));
const pictures = process.env.CBVH_PICTURES;
if (pictures !== undefined) {
    mkdirSync(pictures, { recursive: true });
}

/** A graphics card in software, so that pages are drawn on any machine. */
const GRAPHICS = ["--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist"];
const launch = (graphics) =>
    chromium.launch({
        executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
        args: ["--no-sandbox", "--disable-background-networking", ...graphics],
    });
const browser = await launch(GRAPHICS);
after(async () => {
    await browser.close();
    rmSync(folder, { recursive: true });
});

const testdata = (name) => readFileSync(path.join(ROOT, "testdata", name));

/** What the command prints. */
const command = (...words) =>
    execFileSync(COMMAND, words.map(String), { encoding: "utf8", stdio: ["ignore", "pipe", "ignore"] });

const written = (name, text) => {
    const file = path.join(folder, name);
    writeFileSync(file, text);
    return file;
};

/** Bakes the text of a mesh file with the command. */
function baked(name, text, ...options) {
    const out = path.join(folder, `${name}.cbvh`);
    if (!existsSync(out)) {
        command("bake", written(name, text), "-o", out, ...options);
    }
    return readFileSync(out);
}

let opened = 0;

/** Opens a page from a file, and waits until it is drawn or refuses. */
async function open(
    html,
    { size = { width: 1280, height: 800 }, prepare, hash = "", dark = false, from = browser } = {},
) {
    const context = await from.newContext({
        viewport: size,
        colorScheme: dark ? "dark" : "light",
        acceptDownloads: true,
    });
    const page = await context.newPage();
    page.setDefaultTimeout(120_000);
    const [errors, requests] = [[], []];
    page.on("console", (message) => message.type() === "error" && errors.push(message.text()));
    page.on("pageerror", (error) => errors.push(String(error)));
    page.on("request", (request) => requests.push(request.url()));
    if (prepare !== undefined) {
        await page.addInitScript(prepare);
    }
    const file = written(`page-${opened++}.html`, html);
    await page.goto(pathToFileURL(file).href + hash);
    await page.waitForSelector('html:not([data-state="loading"])', { timeout: 120_000 });
    const close = async () => {
        const strange = requests.filter((url) => !/^(file|blob|data):/.test(url));
        assert.deepEqual(strange, [], "the page asked the network");
        await context.close();
    };
    return { page, errors, close };
}

const state = (page) => page.getAttribute("html", "data-state");
const answer = async (page) => JSON.parse(await page.getAttribute("html", "data-answer"));

/** Waits until the answer is another one. */
const changed = (page, before) =>
    page.waitForFunction((before) => document.documentElement.dataset.answer !== before, before, { timeout: 60_000 });

async function picture(page, name) {
    if (pictures !== undefined) {
        await page.waitForTimeout(800);
        await page.screenshot({ path: path.join(pictures, `${name}.png`) });
    }
}

const RING = () => baked("ring.obj", ring(64, 32));
const BOX = () => baked("box.obj", box());
const BESIDE = [1, 0, 0, 4.5, 0, 1, 0, 0.25, 0, 0, 1, 0.125];
const pair = (pose = BESIDE, more = {}) =>
    filled(
        [
            ["ring.cbvh", RING()],
            ["box.cbvh", BOX()],
        ],
        { kind: "pair", pose, ...more },
    );

test("the template is one small file with one place for content", () => {
    const html = template();
    assert.ok(html.length < MAX_BYTES, `${html.length} bytes`);
    assert.equal(html.split("\n").filter((line) => line === MARK).length, 1);
    assert.doesNotMatch(html, /(src|href)="(?!data:)/);
});

/** The digits of base 85, in their order. */
const DIGITS = String.fromCharCode(...Array.from({ length: 87 }, (_, k) => 40 + k)).replace(/[<>]/g, "");

/** What is packed in a part of a page. */
function part(html, id) {
    const [, text] = new RegExp(`id="${id}">([^<]*)<`).exec(html);
    const bytes = [];
    for (let place = 0; place < text.length; place += 5) {
        const digits = text.slice(place, place + 5);
        let word = [...digits.padEnd(5, "~")].reduce((sum, digit) => 85n * sum + BigInt(DIGITS.indexOf(digit)), 0n);
        for (let k = 0; k + 1 < digits.length; k++, word = (word << 8n) & 0xffffffffn) {
            bytes.push(Number(word >> 24n));
        }
    }
    return gunzipSync(Buffer.from(bytes));
}

test("the page allows its own code and style, and nothing else", () => {
    const html = template();
    const head = html.slice(0, html.indexOf("<style>"));
    const [, policy] = /<meta http-equiv="Content-Security-Policy" content="([^"]*)">/.exec(head);
    const allowed = (text) => `'sha256-${createHash("sha256").update(text).digest("base64")}'`;
    const [, style] = /<style>(.*?)<\/style>/s.exec(html);
    const [, boot] = /<script>(.*?)<\/script>/s.exec(html);
    assert.deepEqual(policy.split("; "), [
        "default-src 'none'",
        `script-src 'wasm-unsafe-eval' ${allowed(boot)} ${allowed(part(html, "cbvh-main"))}`,
        `style-src ${allowed(style)}`,
        "worker-src blob:",
        "img-src data:",
        "base-uri 'none'",
        "form-action 'none'",
    ]);
});

test("what gets into the page neither runs nor reaches the network", async () => {
    const { page } = await open(template());
    const refused = await page.evaluate(async () => {
        const refused = new Set();
        document.addEventListener("securitypolicyviolation", (event) => refused.add(event.effectiveDirective));
        const script = document.createElement("script");
        script.textContent = "window.strange = 1";
        const button = document.createElement("button");
        button.setAttribute("onclick", "window.strange = 2");
        const image = document.createElement("img");
        image.src = "https://cbvh.invalid/image.png";
        document.body.append(script, button, image);
        button.click();
        await fetch("https://cbvh.invalid/answer").catch(() => {});
        // The worker has the policy of the page.
        const code = "fetch('https://cbvh.invalid/').then(() => postMessage(0), () => postMessage(1))";
        const worker = new Worker(URL.createObjectURL(new Blob([code])));
        const isRefused = await new Promise((resolve) => {
            worker.onmessage = ({ data }) => resolve(data);
        });
        return [...refused].sort().concat(String(window.strange), String(isRefused));
    });
    assert.deepEqual(refused, ["connect-src", "img-src", "script-src-attr", "script-src-elem", "undefined", "1"]);
    await page.context().close();
});

test("the committed page is that of these sources", { skip: process.env.CBVH_PAGE === undefined }, () => {
    const committed = readFileSync(path.join(ROOT, "bvh-query/view/page.html"), "utf8");
    for (const id of ["cbvh-main", "cbvh-worker"]) {
        assert.ok(part(committed, id).equals(part(template(), id)), `${id} differs: run bvh-query/web/viewer/build`);
    }
    // The bytes of the module depend on the compiler. What surrounds the parts has the hash of all its sources.
    const around = (html) => html.replace(/(<script type="text\/plain" id="[^"]*">)[^<]*/g, "$1");
    assert.match(around(template()), /<meta name="cbvh-sources" content="[0-9a-f]{64}">/);
    assert.equal(around(committed), around(template()));
});

test("the template alone invites to drop files", async () => {
    const { page, errors, close } = await open(template());
    assert.equal(await state(page), "ready");
    assert.ok(await page.isVisible("text=Drop a mesh here"));
    assert.deepEqual(errors, []);
    await picture(page, "empty");
    await close();
});

test("distances have the bits of the command, in 20 poses", { skip: WITHOUT }, async () => {
    const { page, errors, close } = await open(pair());
    assert.equal(await state(page), "ready");
    const poses = overlaps(20);
    const [a, b] = [path.join(folder, "ring.obj.cbvh"), path.join(folder, "box.obj.cbvh")];
    const rows = written("poses.txt", poses.map((pose) => `${pose.join(" ")}\n`).join(""));
    const records = command("query", a, b, rows, "--mode", "distance", "--json").trim().split("\n").map(JSON.parse);
    assert.equal(records.length, 20);
    let touching = 0;
    for (const [k, pose] of poses.entries()) {
        await page.fill('textarea[aria-label="Twelve numbers of the pose"]', pose.join(" "));
        await page.locator('textarea[aria-label="Twelve numbers of the pose"]').blur();
        await page.waitForFunction(
            (pose) => JSON.parse(document.documentElement.dataset.answer).pose.join() === pose,
            pose.join(),
        );
        const found = await answer(page);
        assert.equal(found.distance, records[k].distance);
        assert.equal(found.lower, records[k].lower);
        assert.equal(found.upper, records[k].upper);
        touching += found.contacts > 0 ? 1 : 0;
    }
    assert.ok(touching > 2 && touching < 18, `${touching} of 20 poses touch`);
    assert.deepEqual(errors, []);
    await close();
});

test("B is dragged with the mouse, by its handle", { skip: WITHOUT }, async () => {
    const { page, errors, close } = await open(pair());
    const before = await page.getAttribute("html", "data-answer");
    const [x, y] = await page.evaluate(() => {
        const {
            view: { stage },
            pair,
        } = window.cbvhView;
        const [px, py, pz] = [3, 7, 11].map((k) => pair.pose[k]);
        const at = stage.toStage([px, py, pz]).project(stage.camera);
        const { left, top, width, height } = stage.canvas.getBoundingClientRect();
        return [left + ((at.x + 1) / 2) * width, top + ((1 - at.y) / 2) * height];
    });
    await page.mouse.move(x, y);
    await page.waitForTimeout(100);
    await page.mouse.down();
    await page.mouse.move(x - 60, y + 12, { steps: 5 });
    await page.mouse.up();
    await changed(page, before);
    const [from, to] = [JSON.parse(before), await answer(page)];
    assert.notDeepEqual(to.pose, from.pose);
    // The rotation keeps its bits.
    [0, 1, 2, 4, 5, 6, 8, 9, 10].forEach((place) => {
        assert.equal(to.pose[place], from.pose[place]);
    });
    assert.notEqual(to.distance, from.distance);
    assert.deepEqual(errors, []);
    await picture(page, "distance");
    await close();
});

test("keys move B, turn the view and list themselves", { skip: WITHOUT }, async () => {
    const { page, errors, close } = await open(pair());
    await page.focus("canvas");
    let before = await page.getAttribute("html", "data-answer");
    await page.keyboard.press("Alt+Shift+ArrowLeft");
    await changed(page, before);
    await page.keyboard.press("r");
    before = await page.getAttribute("html", "data-answer");
    await page.keyboard.press("Alt+ArrowUp");
    await changed(page, before);
    const turned = await answer(page);
    assert.notEqual(turned.pose[0], 1);
    const view = () => page.evaluate(() => window.cbvhView.view.stage.camera.position.toArray());
    const eye = await view();
    await page.keyboard.press("ArrowLeft");
    assert.notDeepEqual(await view(), eye);
    await page.keyboard.press("?");
    assert.ok(await page.isVisible("dialog >> text=fit everything into the view"));
    await page.keyboard.press("Escape");
    await page.waitForFunction(() => document.querySelector("dialog") === null);
    await page.keyboard.press("d");
    assert.equal(await page.getAttribute("html", "data-theme"), "dark");
    // All controls can be reached.
    const unreachable = await page.evaluate(() =>
        [...document.querySelectorAll(".toolbar button, .panel button, .panel input, .panel textarea, .panel select")]
            .filter((control) => control.tabIndex < 0 && control.getAttribute("role") !== "tab")
            .map((control) => control.outerHTML),
    );
    assert.deepEqual(unreachable, []);
    const nameless = await page.evaluate(() =>
        [...document.querySelectorAll("button, input, select, textarea")]
            .filter((control) => `${control.textContent}${control.getAttribute("aria-label") ?? ""}`.trim() === "")
            .map((control) => control.outerHTML),
    );
    assert.deepEqual(nameless, []);
    assert.deepEqual(errors, []);
    await close();
});

test("contact shows its depth, and moves B out", { skip: WITHOUT }, async () => {
    const { page, errors, close } = await open(pair([1, 0, 0, 2.2, 0, 1, 0, 0.1, 0, 0, 1, 0.3]), { dark: true });
    const before = await page.getAttribute("html", "data-answer");
    assert.ok((await answer(page)).contacts > 0);
    const button = page.locator("button", { hasText: "Move B out" });
    await button.waitFor();
    await picture(page, "contact");
    await button.click();
    await changed(page, before);
    assert.deepEqual(errors, []);
    await close();
});

/** Shows facts of the page: names and what is beside them, with all digits where the page shortens. */
const factsIn = (page, box) =>
    page.evaluate((box) => {
        const rows = document.querySelectorAll(`${box} .fact`);
        const value = (row) =>
            row.querySelector("dd [title]")?.getAttribute("title") ?? row.querySelector("dd").textContent;
        return Object.fromEntries([...rows].map((row) => [row.querySelector("dt").textContent, value(row)]));
    }, box);

/** The triangles of each solid on the stage, and the volume that they enclose in mesh units. */
const solids = (page) =>
    page.evaluate(() => {
        const { stage } = window.cbvhView.view;
        const found = [];
        stage.scene.traverse((part) => {
            if (part.name === "solid") {
                const [places, points] = [part.geometry.index.array, part.geometry.attributes.position.array];
                const corner = (place) => points.subarray(3 * place, 3 * place + 3);
                let volume = 0;
                for (let k = 0; k < places.length; k += 3) {
                    const [p, q, r] = [0, 1, 2].map((l) => corner(places[k + l]));
                    const cross = [0, 1, 2].map(
                        (l) => q[(l + 1) % 3] * r[(l + 2) % 3] - q[(l + 2) % 3] * r[(l + 1) % 3],
                    );
                    volume += (p[0] * cross[0] + p[1] * cross[1] + p[2] * cross[2]) / 6;
                }
                found.push({ triangles: places.length / 3, volume: volume / stage.scale ** 3 });
            }
        });
        return found;
    });

test("what closed meshes have in common is drawn and measured", { skip: WITHOUT }, async () => {
    // A rod through a plate, which it pierces by its thickness, and through a face of two triangles: polygons with holes.
    const scaled = (...sides) =>
        box().replace(
            /^v (.*)$/gm,
            (_, row) =>
                `v ${row
                    .split(" ")
                    .map((x, k) => x * sides[k])
                    .join(" ")}`,
        );
    const files = [
        ["plate.cbvh", baked("plate.obj", scaled(4, 3, 0.25))],
        ["rod.cbvh", baked("rod.obj", scaled(0.5, 0.5, 2))],
    ];
    const at = (x, y, z) => [1, 0, 0, x, 0, 1, 0, y, 0, 0, 1, z];
    const { page, errors, close } = await open(filled(files, { kind: "pair", pose: at(1, 0.5, 0.25) }), { dark: true });
    await page.waitForSelector("text=volume in both");
    const facts = await factsIn(page, "#page-pair");
    assert.deepEqual([Number(facts["A is pierced"]), facts["B is pierced"]], [0.25, undefined]);
    assert.equal(facts["its box"], "0.5 0.5 0.25");
    assert.ok(Math.abs(Number(facts["volume in both"]) - 0.0625) < 1e-15, facts["volume in both"]);
    const [solid, ...more] = await solids(page);
    assert.deepEqual(more, []);
    assert.ok(Math.abs(solid.volume - 0.0625) < 1e-6, `${solid.volume}`);
    await picture(page, "shared");
    // Apart and touching meshes have nothing in common.
    for (const pose of [at(1, 0.5, 1.125), at(1, 0.5, 2)]) {
        const before = await page.getAttribute("html", "data-answer");
        await page.evaluate((pose) => window.cbvhView.pair.setPose(Float64Array.from(pose)), pose);
        await changed(page, before);
        await page.waitForTimeout(500);
        assert.deepEqual([await solids(page), await page.locator("text=volume in both").count()], [[], 0]);
    }
    assert.deepEqual(errors, []);
    await close();
});

test("meshes that are not closed have no depth, and the page says which", { skip: WITHOUT }, async () => {
    // The ring without its first triangle.
    const holed = baked("holed.obj", ring(64, 32).replace(/^f .*\n/m, ""));
    for (const [files, names] of [
        [["holed.cbvh", "box.cbvh"], "A is"],
        [["box.cbvh", "holed.cbvh"], "B is"],
        [["holed.cbvh", "holed.cbvh"], "A and B are"],
    ]) {
        const bytes = { "holed.cbvh": holed, "box.cbvh": BOX() };
        const show = { kind: "pair", pose: [1, 0, 0, 2.2, 0, 1, 0, 0.1, 0, 0, 1, 0.3] };
        const { page, errors, close } = await open(
            filled(
                files.map((name) => [name, bytes[name]]),
                show,
            ),
        );
        await page.waitForSelector(`text=none, because ${names} not closed`);
        assert.deepEqual([await solids(page), await page.locator("text=volume in both").count()], [[], 0]);
        assert.deepEqual(errors, []);
        await close();
    }
});

test("the edges that leave a mesh open are listed and drawn", { skip: WITHOUT }, async () => {
    const holed = baked("holed.obj", ring(64, 32).replace(/^f .*\n/m, ""));
    const { page, errors, close } = await open(filled([["holed.cbvh", holed]], { kind: "file" }));
    await page.click("#tab-inside");
    const part = page.locator("#page-inside .part", { hasText: "Open edges" });
    await part.locator("text=3 edges have one triangle").waitFor();
    const told = JSON.parse(command("validate", path.join(folder, "holed.obj.cbvh"), "--json")).open_edges;
    const cells = await part.locator("tbody tr").evaluateAll((rows) => rows.map((row) => row.cells[2].textContent));
    assert.deepEqual(
        cells,
        told.boundary.first.map(({ triangles }) => triangles.join(", ")),
    );
    // Lines and dots are on the stage while the tab is shown, and only then.
    const stage = () => page.locator("canvas").first().screenshot();
    const drawn = await stage();
    await page.click("#tab-probes");
    const without = await stage();
    await page.click("#tab-inside");
    await part.locator("text=3 edges have one triangle").waitFor();
    assert.ok(!drawn.equals(without) && drawn.equals(await stage()));
    assert.deepEqual(errors, []);
    await close();
    // A closed mesh has no such list.
    const other = await open(filled([["ring.cbvh", RING()]], { kind: "file" }));
    await other.page.click("#tab-inside");
    await other.page.waitForSelector("#page-inside dl.facts");
    assert.equal(await other.page.locator("text=Open edges").count(), 0);
    await other.close();
});

test("a motion has its certain time and its hit, as the command says", { skip: WITHOUT }, async () => {
    const end = [...BESIDE];
    end[3] = -4.5;
    const motion = [...BESIDE, ...end];
    const html = filled(
        [
            ["ring.cbvh", RING()],
            ["box.cbvh", BOX()],
        ],
        { kind: "motion", motion, clearance: 0.25, tolerance: null },
    );
    const { page, errors, close } = await open(html);
    const [a, b] = [path.join(folder, "ring.obj.cbvh"), path.join(folder, "box.obj.cbvh")];
    const file = written("motion.txt", `${motion.join(" ")}\n`);
    const [record] = command("motion", a, b, file, "--clearance", "0.25", "--json").trim().split("\n").map(JSON.parse);
    const shown = await page.locator("#page-motion .number").evaluateAll((all) => all.map((one) => one.title));
    assert.ok(shown.includes(String(record.free_until)), `${shown} has ${record.free_until}`);
    assert.ok(shown.includes(String(record.touching_at)), `${shown} has ${record.touching_at}`);
    const before = await page.getAttribute("html", "data-answer");
    await page.locator("button", { hasText: "Go to the first hit" }).click();
    await changed(page, before);
    assert.ok((await answer(page)).distance <= 0.25);
    assert.deepEqual(errors, []);
    await picture(page, "motion");
    await close();
});

test("the inside of a file has the numbers that dump prints", { skip: WITHOUT }, async () => {
    const { page, errors, close } = await open(filled([["ring.cbvh", RING()]], { kind: "file" }));
    assert.equal(await state(page), "ready");
    const dump = JSON.parse(command("dump", path.join(folder, "ring.obj.cbvh"), "--json"));
    const contents = await page.evaluate(async () => {
        const found = await window.cbvhView.view.asker.ask("contents", 0);
        return { ...found, levelCounts: [...found.levelCounts], levelLengths: [...found.levelLengths] };
    });
    assert.deepEqual(
        contents.sections,
        dump.sections.map(({ kind, offset, bytes }) => ({ name: kind, start: offset, bytes })),
    );
    const [object] = dump.objects;
    assert.deepEqual(contents.levelLengths, [object.levels.length]);
    object.levels.forEach((level, k) => {
        const [treelets, children, packets, triangles] = contents.levelCounts.slice(4 * k, 4 * k + 4);
        assert.equal(treelets, level.treelets);
        assert.equal(children / treelets, level.mean_children);
        assert.equal(packets, level.packets);
        assert.equal(packets === 0 ? 0 : triangles / packets, level.mean_triangles_per_packet);
    });
    // The nodes of each level cover all triangles: each corner is within one of them, for boxes and for all slabs.
    const outside = await page.evaluate(async (depth) => {
        const { asker, bodies } = window.cbvhView.view;
        const { positions } = bodies[0].shown;
        const missed = [];
        for (const slabs of ["boxes", "all"]) {
            for (let level = 0; level <= depth; level++) {
                const nodes = await asker.ask("level", 0, level, 100_000, slabs);
                const planes = [];
                for (let node = 0; node < nodes.count; node++) {
                    const faces = [];
                    for (let at = 3 * nodes.starts[node]; at < 3 * nodes.starts[node + 1]; at += 9) {
                        const p = (k) => nodes.positions[at + k];
                        const [u, v] = [
                            [p(3) - p(0), p(4) - p(1), p(5) - p(2)],
                            [p(6) - p(0), p(7) - p(1), p(8) - p(2)],
                        ];
                        const n = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
                        const length = Math.hypot(...n);
                        if (length > 1e-9) {
                            const unit = n.map((value) => value / length);
                            faces.push([...unit, unit[0] * p(0) + unit[1] * p(1) + unit[2] * p(2)]);
                        }
                    }
                    planes.push(faces);
                }
                for (let at = 0; at < positions.length; at += 27) {
                    const [x, y, z] = positions.subarray(at, at + 3);
                    const within = planes.some((faces) =>
                        faces.every(([a, b, c, d]) => a * x + b * y + c * z <= d + 1e-4),
                    );
                    if (!within) {
                        missed.push([slabs, level, x, y, z]);
                    }
                }
            }
        }
        return missed.slice(0, 3);
    }, object.levels.length);
    assert.deepEqual(outside, []);
    await page.selectOption('select[aria-label="Shape of nodes"]', "all");
    await page.waitForSelector("text=which are leaf packets");
    await page.selectOption('select[aria-label="Colours of triangles"]', "pages");
    await page.locator("button", { hasText: "Check the whole file" }).click();
    await page.waitForSelector("text=keeps all rules");
    assert.deepEqual(errors, []);
    await picture(page, "inside");
    await close();
});

test("what a question visits is counted on both meshes", { skip: WITHOUT }, async () => {
    const { page, errors, close } = await open(pair());
    await page.click("#tab-inside");
    await page.selectOption('select[aria-label="Colours of triangles"]', "visits");
    await page.waitForSelector("text=packet tests");
    const found = await page.evaluate(async () => {
        const {
            view: { asker },
            pair,
        } = window.cbvhView;
        const { nodeTests, packetTests, a, b } = await asker.ask(
            "visits",
            pair.a.side,
            pair.b.side,
            pair.pose,
            "distance",
        );
        const sum = (rows) => rows.reduce((total, count, k) => total + (k % 3 === 2 ? count : 0), 0);
        const met = (counts) => counts.reduce((total, count) => total + (count > 0 ? 1 : 0), 0);
        return {
            nodeTests,
            packetTests,
            a: sum(a.packets),
            b: sum(b.packets),
            met: [met(a.tested), met(b.tested)],
        };
    });
    assert.ok(found.nodeTests > 0 && found.packetTests > 0);
    assert.equal(found.a, found.b);
    assert.ok(found.a >= found.packetTests && found.met[0] > 0 && found.met[1] > 0, JSON.stringify(found));
    assert.deepEqual(errors, []);
    await picture(page, "visits");
    await close();
});

/** Drops a file on the page. */
const dropped = (page, name, bytes) =>
    page.evaluate(
        ([name, bytes]) => {
            const files = new DataTransfer();
            files.items.add(new File([new Uint8Array(bytes)], name));
            const event = new DragEvent("drop", { dataTransfer: files, bubbles: true, cancelable: true });
            document.body.dispatchEvent(event);
        },
        [name, [...bytes]],
    );

test("dropped files are baked: the first becomes A, the next B", async () => {
    const { page, errors, close } = await open(template());
    await dropped(page, "ring.obj", Buffer.from(ring(16, 8)));
    await page.waitForSelector(".file-name >> text=ring.obj");
    assert.deepEqual((await answer(page)).triangles, [256]);
    await dropped(page, "box.obj", Buffer.from(box()));
    await page.waitForSelector(".file-name >> text=box.obj");
    const found = await answer(page);
    assert.deepEqual(found.triangles, [256, 12]);
    assert.ok(found.distance > 0);
    const [download] = await Promise.all([page.waitForEvent("download"), page.click('[aria-label="Save A as .cbvh"]')]);
    assert.equal(download.suggestedFilename(), "ring.cbvh");
    const file = path.join(folder, "saved.cbvh");
    await download.saveAs(file);
    if (COMMAND !== undefined) {
        command("validate", file);
    }
    await dropped(page, "ring.cbvh", readFileSync(file));
    await page.waitForFunction(() => document.querySelectorAll(".file-name")[1]?.textContent === "ring.cbvh");
    assert.deepEqual((await answer(page)).triangles, [256, 256]);
    assert.deepEqual(errors, []);
    await close();
});

test("a damaged file says which rule it breaks, and where", async () => {
    const bad = testdata("bad-R15-flipped-bit.cbvh");
    const { page, close } = await open(filled([["bad.cbvh", bad]], { kind: "file" }));
    assert.equal(await state(page), "error");
    const message = await page.getAttribute("html", "data-message");
    assert.match(message, /R15/);
    assert.match(message, /byte\s*4096/);
    await picture(page, "damaged");
    await close();

    const other = await open(template());
    await dropped(other.page, "bad.cbvh", bad);
    await other.page.waitForSelector(".message.error >> text=R15");
    assert.equal(await state(other.page), "ready");
    await dropped(other.page, "notes.txt", Buffer.from("no mesh"));
    await other.page.waitForSelector(".message.error >> text=notes.txt");
    await other.close();
});

test("points and rays have answers", { skip: WITHOUT }, async () => {
    const { page, errors, close } = await open(filled([["box.cbvh", BOX()]], { kind: "file" }));
    await page.click("#tab-probes");
    await page.fill('textarea[aria-label^="Points"]', "0 0 0\n0 0 2\n");
    await page.fill('textarea[aria-label^="Rays"]', "0.1 0.2 3  0 0 -2\n");
    await page.waitForSelector("#page-probes td >> text=inside");
    const cells = await page
        .locator("#page-probes tbody tr")
        .evaluateAll((rows) => rows.map((row) => [...row.children].map((cell) => cell.textContent)));
    assert.deepEqual(
        cells.slice(0, 2).map((row) => row.slice(1, 3)),
        [
            ["0.5", "inside"],
            ["1.5", "outside"],
        ],
    );
    assert.equal(cells[2][1], "1.25");
    await page.fill('textarea[aria-label^="Points"]', "0 0\n");
    await page.waitForSelector("text=line 1: expected 3 numbers");
    assert.deepEqual(errors, []);
    await picture(page, "probes");
    await close();
});

test("a click asks about a triangle", { skip: WITHOUT }, async () => {
    const { page, errors, close } = await open(filled([["box.cbvh", BOX()]], { kind: "file" }));
    const { x, y, width, height } = await page.locator("canvas").boundingBox();
    await page.mouse.click(x + width / 2, y + height / 2);
    await page.waitForSelector(".card >> text=leaf packet");
    await page.keyboard.press("Escape");
    assert.equal(await page.isVisible(".card"), false);
    assert.deepEqual(errors, []);
    await close();
});

test("a link restores the pose and the view, and the command asks the same", { skip: WITHOUT }, async () => {
    const { page, close } = await open(pair());
    const before = await page.getAttribute("html", "data-answer");
    await page.focus("canvas");
    await page.keyboard.press("Alt+ArrowLeft");
    await changed(page, before);
    await page.keyboard.press("ArrowUp");
    await page.click("#tab-inside");
    const texts = await page.evaluate(async () => {
        const copied = [];
        window.cbvhView.view.copy = async (text) => {
            copied.push(text);
        };
        document.querySelector('[aria-label="Copy a link to this view"]').click();
        document.querySelector('[aria-label^="Copy the command line"]').click();
        return copied;
    });
    const found = await answer(page);
    const again = await open(pair(), { hash: new URL(texts[0]).hash });
    assert.deepEqual((await answer(again.page)).pose, found.pose);
    assert.equal(await again.page.getAttribute("#tab-inside", "aria-selected"), "true");
    await again.close();
    assert.match(texts[1], /^cbvh query ring\.cbvh box\.cbvh --mode distance --pose "/);
    const pose = /--pose "(.*)"/.exec(texts[1])[1];
    const [a, b] = [path.join(folder, "ring.obj.cbvh"), path.join(folder, "box.obj.cbvh")];
    const said = command("query", a, b, "--mode", "distance", "--pose", pose);
    assert.ok(said.startsWith(`distance ${found.distance}`), said);
    await close();
});

/** What a shell makes of the words of a line. */
const shellWords = (line) =>
    execFileSync("bash", ["-c", `printf '%s\\0' ${line}`], { encoding: "utf8" })
        .split("\0")
        .slice(0, -1);

test("the command names each file as a file", { skip: WITHOUT || process.platform === "win32" }, async () => {
    const { page, errors, close } = await open(pair());
    const names = [
        "-o",
        "--json",
        "-",
        "two words",
        'it\'s "$HOME" `date` \\ *',
        "$(date).cbvh",
        "~root",
        "=ls",
        "a\nb\u001b[201~\tc\u009b\u202e'\\d",
        "ü",
    ];
    for (const name of names) {
        const line = await page.evaluate((name) => {
            const { view } = window.cbvhView;
            let copied;
            view.copy = async (text) => {
                copied = text;
            };
            window.cbvhView.wordsOf = () => [name, name];
            document.querySelector('[aria-label^="Copy the command line"]').click();
            return copied;
        }, name);
        assert.doesNotMatch(line, /[\p{Cc}\p{Cf}]/u);
        const [program, question, a, b, ...rest] = shellWords(line);
        const file = name.startsWith("-") ? `./${name}` : name;
        assert.deepEqual([program, question, a, b, rest.at(-1)], ["cbvh", "query", file, file, `--object=${name}`]);
    }
    assert.deepEqual(errors, []);
    await close();
});

test("a notebook's frame gives the page what it needs", { skip: WITHOUT }, async () => {
    const source = readFileSync(path.join(ROOT, "bvh-query/python/python/cbvh/_view.py"), "utf8");
    const [, attributes] = /<iframe srcdoc="{page}"([^>]*)>/.exec(source);
    const inner = pair().replaceAll("&", "&amp;").replaceAll('"', "&quot;");
    const frameWith = attributes.replace("{style}", "width: 1000px; height: 600px");
    const outer = `<!doctype html><title>notebook</title><textarea></textarea><iframe srcdoc="${inner}"${frameWith}></iframe>`;
    const context = await browser.newContext({ viewport: { width: 1100, height: 800 }, acceptDownloads: true });
    const page = await context.newPage();
    const errors = [];
    page.on("console", (message) => message.type() === "error" && errors.push(message.text()));
    page.on("pageerror", (error) => errors.push(String(error)));
    await page.goto(pathToFileURL(written("notebook.html", outer)).href);
    const frame = page.frames()[1];
    await frame.waitForSelector('html[data-state="ready"]', { timeout: 120_000 });
    assert.ok((await frame.evaluate(() => JSON.parse(document.documentElement.dataset.answer))).distance > 0);
    const [download] = await Promise.all([
        page.waitForEvent("download"),
        frame.click('[aria-label="Save A as .cbvh"]'),
    ]);
    assert.equal(download.suggestedFilename(), "ring.cbvh");
    await frame.click('[aria-label^="Copy the command line"]');
    await frame.waitForSelector("text=The command was copied.");
    await page.focus("textarea");
    await page.keyboard.press("Control+V");
    assert.match(await page.inputValue("textarea"), /^cbvh query ring\.cbvh box\.cbvh --mode distance/);
    // The page can neither read nor change the notebook.
    const reached = await frame.evaluate(() => {
        const attempts = [
            () => window.parent.document.title,
            () => window.parent.location.href,
            () => window.localStorage.length,
            () => window.open("about:blank"),
        ];
        return attempts.map((attempt) => {
            try {
                return attempt();
            } catch (error) {
                return error.name;
            }
        });
    });
    assert.deepEqual(reached, ["SecurityError", "SecurityError", "SecurityError", null]);
    // A frame without the origin of the notebook may not have the clipboard, and copies another way.
    const isExpected = (text) => /Blocked opening 'about:blank'|Clipboard API has been blocked/.test(text);
    assert.deepEqual(
        errors.filter((text) => !isExpected(text)),
        [],
    );
    await context.close();
});

test("a scene plays its frames and finds the pairs that touch", { skip: WITHOUT }, async () => {
    const files = [
        ["ring.cbvh", RING()],
        ["box.cbvh", BOX()],
    ];
    const show = scene();
    const { page, errors, close } = await open(filled(files, show));
    assert.equal(await state(page), "ready");
    const seen = [];
    for (let frame = 0; frame < show.frames.length; frame++) {
        await page.evaluate((frame) => window.cbvhView.scene.go(frame), frame);
        seen.push((await answer(page)).touching);
    }
    assert.deepEqual(seen, [0, 1, 0]);
    await page.evaluate(() => window.cbvhView.scene.go(1));
    await page.locator(".list-row").first().click();
    await picture(page, "scene");
    assert.deepEqual(errors, []);
    await close();
});

/** Two boxes with a gap of 3, as two objects. */
function twoBoxes() {
    const far = box()
        .replaceAll(/^v (\S+)/gm, (_, x) => `v ${Number(x) + 4}`)
        .replaceAll(
            /^f (.*)$/gm,
            (_, list) =>
                `f ${list
                    .split(" ")
                    .map((corner) => Number(corner) + 8)
                    .join(" ")}`,
        );
    return `o near\n${box()}o far\n${far}`;
}

test("pages of the command show objects, scenes and clashes of one file", { skip: WITHOUT }, async () => {
    const source = written("two.obj", twoBoxes());
    const [objects, parts, out] = ["objects.cbvh", "parts.cbvh", "two.html"].map((name) => path.join(folder, name));
    command("bake", source, "-o", objects, "--split-objects");
    command("bake", source, "-o", parts, "--scene");
    const view = async (...words) => {
        command(...words, out);
        const { page, errors, close } = await open(readFileSync(out, "utf8"));
        assert.deepEqual([await state(page), errors], ["ready", []]);
        const triangles = await page.evaluate(() =>
            window.cbvhView.view.bodies.map((body) => body.shown.summary.triangles),
        );
        const boxes = await page.evaluate(() => window.cbvhView.view.bodies.map((body) => [...body.shown.centre]));
        const inside = await page.evaluate(async () => {
            const { asker, bodies } = window.cbvhView.view;
            const [objects, nodes] = [[], []];
            for (const { file } of bodies) {
                objects.push((await asker.ask("place", file, 0)).object);
                nodes.push((await asker.ask("level", file, 0, 100, "boxes")).count);
            }
            return { objects, nodes };
        });
        const line = await page.evaluate(() => {
            let copied;
            window.cbvhView.view.copy = async (text) => {
                copied = text;
            };
            document.querySelector('[aria-label^="Copy the command line"]').click();
            return copied;
        });
        const found = { ...(await answer(page)), triangles, boxes, line, ...inside };
        await close();
        return found;
    };

    const words = ["--object", "far", "--pose", BESIDE.join(" ")];
    const asked = JSON.parse(command("query", objects, objects, ...words, "--mode", "distance", "--json"));
    const pair = await view("view", objects, ...words, "-o");
    assert.deepEqual([pair.distance, pair.triangles, pair.boxes[0]], [asked.distance, [12, 12], [4, 0, 0]]);
    // The inside of an object: its own triangles and nodes, and the name that the command line takes.
    assert.deepEqual(
        [pair.objects, pair.nodes],
        [
            [1, 1],
            [1, 1],
        ],
    );
    assert.ok(pair.line.endsWith(" --object=far"), pair.line);
    const asks = pair.line
        .split(" ")
        .slice(1, 4)
        .concat(["--mode", "distance", ...words]);
    assert.ok(command(...asks).startsWith(`distance ${pair.distance}`));

    const scene = await view("view", parts, "-o");
    assert.deepEqual([scene.distance, scene.touching, scene.triangles], [3, 0, [12, 12]]);

    const clash = await view("clash", parts, "--clearance", 4, "--view");
    // The report is the command's: the page has no answer of its own before somebody chooses a clash.
    assert.deepEqual([clash.triangles, clash.clashes, clash.distance], [[12, 12], 1, null]);
});

/** Writes the page of a robot with the command. Returns what it shows, and its text. */
function robotPage(urdf, ...words) {
    const out = path.join(folder, "robot.html");
    command("robot", written("robot.urdf", urdf), ...words, "--view", out);
    const html = readFileSync(out, "utf8");
    const [, content] = /id="cbvh-content">(.*?)<\/script>/s.exec(html);
    return { html, show: JSON.parse(content).show };
}

const lines = (name, rows) => written(name, rows.map((row) => `${row.join(" ")}\n`).join(""));

/** The distance, and the pairs of bodies in contact, that the command finds in each configuration. */
function askedAbout(urdf, file, ...words) {
    const ask = (mode) =>
        command("robot", written("robot.urdf", urdf), file, ...words, "--mode", mode, "--json")
            .trim()
            .split("\n")
            .map(JSON.parse);
    const [distances, contacts] = [ask("distance"), ask("collide")];
    return distances.map(({ distance }, k) => ({ distance, touching: contacts[k].pairs?.length ?? 0 }));
}

const near = (found, expected, tolerance) => {
    assert.equal(found.length, expected.length);
    found.forEach((value, k) => {
        assert.ok(Math.abs(value - expected[k]) <= tolerance, `${value} is not ${expected[k]}, number ${k}`);
    });
};

test("a robot's links are where the library puts them, and touch as the command says", { skip: WITHOUT }, async () => {
    const asked = askedAbout(allKinds, lines("q.txt", configurations));
    assert.ok(new Set(asked.map(({ touching }) => touching)).size > 1, JSON.stringify(asked));
    const pages = configurations.map((values) => robotPage(allKinds, "--joints", values.join(" ")));
    const { page, errors, close } = await open(pages[1].html);
    assert.equal(await state(page), "ready");
    // As the library has placed it.
    near([(await answer(page)).distance], [asked[1].distance], 1e-15);
    for (const [k, values] of configurations.entries()) {
        const poses = await page.evaluate(async (values) => {
            const { robot, view } = window.cbvhView;
            await robot.place(values);
            return view.bodies.map((body) => [...body.pose]);
        }, values);
        near(
            poses.flat(),
            pages[k].show.instances.flatMap(({ pose }) => pose),
            1e-13,
        );
        const { distance, touching } = await answer(page);
        near([distance], [asked[k].distance], 1e-12);
        assert.equal(touching, asked[k].touching);
    }
    // The quaternion turns the shorter way: by a third of the angle from the one configuration to the other.
    const [start, goal] = [configurations[1], configurations[2]];
    const edge = robotPage(allKinds, "--edges", "--joints", [...start, ...goal].join(" "));
    const third = await open(edge.html);
    const values = await third.page.evaluate(async () => {
        await window.cbvhView.robot.go(1 / 3);
        return window.cbvhView.robot.values;
    });
    near(
        values.slice(0, 8),
        start.slice(0, 8).map((from, k) => from + (goal[k] - from) / 3),
        1e-13,
    );
    const cosine = (a, b) => Math.abs(a.reduce((sum, value, k) => sum + value * b[k], 0));
    const [from, to, at] = [start, goal, values].map((all) => all.slice(8));
    const angles = [Math.acos(cosine(from, at)), Math.acos(cosine(at, to))];
    const whole = Math.acos(cosine(from, to));
    near(angles, [whole / 3, (2 * whole) / 3], 1e-12);
    assert.deepEqual([...errors, ...third.errors], []);
    await third.close();
    await close();
});

test("sliders move the links of a robot, and links that touch are coloured", { skip: WITHOUT }, async () => {
    const { html } = robotPage(
        armAndCart,
        lines("q.txt", [
            [0.5, 3],
            [0, -12],
        ]),
    );
    const { page, errors, close } = await open(html);
    const slider = (name) => page.locator(`input[type=range][aria-label="${name}"]`);
    const ends = (name) => slider(name).evaluate(({ min, max }) => [Number(min), Number(max)]);
    assert.deepEqual(await ends("turn"), [-Math.PI, Math.PI]);
    assert.deepEqual(await ends("slide"), [-9, 9]);
    const look = () =>
        page.evaluate(() => {
            const { bodies, stage } = window.cbvhView.view;
            const { hit } = stage.palette;
            return bodies.map((body) => [body.name, body.pose[3], body.mesh.material.color.getHex() === hit]);
        });
    const set = async (name, value) => {
        const before = await page.getAttribute("html", "data-answer");
        await slider(name).fill(String(value));
        await changed(page, before);
    };
    assert.deepEqual(
        (await look()).map(([, , touches]) => touches),
        [false, false, false],
    );
    await set("turn", 0);
    assert.deepEqual(await look(), [
        ["arm", 1.5, false],
        ["cart", 3, false],
        ["cart", 3, false],
    ]);
    assert.equal((await answer(page)).distance, 0.75);
    await set("slide", 1.5);
    // Both halves of the cart touch the arm: one pair of bodies, and all of it is coloured.
    assert.deepEqual(await look(), [
        ["arm", 1.5, true],
        ["cart", 1.5, true],
        ["cart", 1.5, true],
    ]);
    assert.equal((await answer(page)).touching, 1);
    assert.equal(await page.locator("#page-scene .list-row").count(), 1);
    await picture(page, "robot");
    // A link to this view has the joint values, and so has the command.
    const hash = await page.evaluate(() => {
        document.querySelector('[aria-label^="Copy a link"]').click();
        return location.hash;
    });
    const again = await open(html, { hash });
    assert.deepEqual(await again.page.evaluate(() => window.cbvhView.robot.values), [0, 1.5]);
    await again.close();
    const said = await page.evaluate(() => {
        let copied;
        window.cbvhView.view.copy = async (text) => {
            copied = text;
        };
        document.querySelector('[aria-label^="Copy the command line"]').click();
        return copied;
    });
    assert.equal(said, 'cbvh robot URDF --joints "0 1.5"');
    // The other line of the file, whose value is outside of the limits, which are not checked.
    await page.selectOption('select[aria-label="Line of the file"]', { value: "1" });
    await page.waitForFunction(() => window.cbvhView.view.bodies[1].pose[3] === -12);
    assert.deepEqual(await ends("slide"), [-12, 9]);
    assert.ok(await page.isHidden('input[aria-label="Time of the edge"]'));
    assert.deepEqual(errors, []);
    await close();
});

test("an edge of a robot is played until it hits", { skip: WITHOUT }, async () => {
    const slide = Math.hypot(2, 0.125) + 0.25 + 1e-9;
    const edges = lines("e.txt", [
        [0, 2.5, 0, 4.5],
        [-1, 2.5, 1, 2.5],
        [-1, slide, 1, slide],
    ]);
    const words = ["--obstacle", `${written("box.obj", box())}@4.25 0 0 0 0 0 1`, edges, "--edges"];
    const records = command("robot", written("robot.urdf", armAndCart), ...words, "--json");
    const asked = records.trim().split("\n").map(JSON.parse);
    assert.deepEqual(
        asked.map((record) => record.answer),
        ["hit", "free", "near"],
    );
    const { page, errors, close } = await open(robotPage(armAndCart, ...words).html);
    const options = await page.locator('select[aria-label="Line of the file"] option').allTextContents();
    assert.deepEqual(
        options.map((text) => /^\d: [a-z]+/.exec(text)[0]),
        ["1: hit", "2: free", "3: near"],
    );
    const ended = async (number) => {
        await page.selectOption('select[aria-label="Line of the file"]', { value: String(number) });
        await page.locator('#page-scene [aria-label^="Play"]').first().click();
        await page.waitForFunction(() => window.cbvhView.robot.time > 0);
        // Its icon says when the player has stopped.
        await page.waitForFunction(
            () => document.querySelector("#page-scene .player path").getAttribute("d") === "M8 5v14l11-7z",
        );
        return page.evaluate(() => {
            const { robot, view } = window.cbvhView;
            const colours = view.bodies.map((body) => body.mesh.material.color.getHex());
            const { hit, near, moving, still } = view.stage.palette;
            const names = new Map([
                [hit, "hit"],
                [near, "near"],
                [moving, "moving"],
                [still, "still"],
            ]);
            return { time: robot.time, values: robot.values, colours: colours.map((colour) => names.get(colour)) };
        });
    };
    const hit = await ended(0);
    assert.equal(hit.time, asked[0].touching_at);
    near(hit.values, asked[0].joints, 1e-15);
    assert.deepEqual(hit.colours, ["moving", "hit", "hit", "hit"]);
    assert.equal((await factsIn(page, "#page-scene .part")).bodies, "cart, box");
    await picture(page, "edge");
    const free = await ended(1);
    assert.deepEqual([free.time, free.values, free.colours], [1, [1, 2.5], ["moving", "moving", "moving", "still"]]);
    const undecided = await ended(2);
    assert.equal(undecided.time, asked[2].at);
    assert.deepEqual(undecided.colours, ["near", "near", "near", "still"]);
    assert.ok(await page.isVisible("#page-scene .relation.near"));
    assert.deepEqual(errors, []);
    await close();
});

test("balls and capsules are drawn round, at their radius", { skip: WITHOUT }, async () => {
    const link = (shape) =>
        `<robot name="still"><link name="base"><collision><geometry>${shape}</geometry></collision></link></robot>`;
    for (const [shape, half] of [
        ['<sphere radius="0.75"/>', 0],
        ['<capsule radius="0.75" length="3"/>', 1.5],
    ]) {
        const { page, errors, close } = await open(robotPage(link(shape)).html);
        const positions = await page.evaluate(() => [...window.cbvhView.view.bodies[0].shown.positions]);
        assert.ok(positions.length > 900, `${positions.length}`);
        const [distances, heights] = [[], []];
        for (let k = 0; k < positions.length; k += 3) {
            const [x, y, z] = positions.slice(k, k + 3);
            distances.push(Math.hypot(x, y, z - Math.min(Math.max(z, -half), half)));
            heights.push(z);
        }
        near(
            distances,
            distances.map(() => 0.75),
            1e-6,
        );
        near([Math.min(...heights), Math.max(...heights)], [-half - 0.75, half + 0.75], 1e-6);
        assert.deepEqual(errors, []);
        await close();
    }
});

test("a robot without joints has a page without sliders", { skip: WITHOUT }, async () => {
    const { page, errors, close } = await open(
        robotPage(
            '<robot name="still"><link name="base"><collision><geometry><sphere radius="1"/></geometry></collision></link></robot>',
        ).html,
    );
    assert.equal(await state(page), "ready");
    assert.ok(await page.isVisible("text=This robot has no joints that move"));
    assert.equal(await page.locator("#page-scene input[type=range]:visible").count(), 0);
    assert.deepEqual(errors, []);
    await close();
});

test("numbers that are no pose have no answer, and the next ones have", { skip: WITHOUT }, async () => {
    const { page, errors, close } = await open(pair());
    const { distance } = await answer(page);
    const type = async (name, text) => {
        await page.fill(`textarea[aria-label="${name}"]`, text);
        await page.locator(`textarea[aria-label="${name}"]`).blur();
    };
    const skew = "1 0.5 0 4.5  0 1 0 0.25  0 0 1 0.125";
    await type("Twelve numbers of the pose", skew);
    await page.waitForSelector("#page-pair .problem");
    const said = await answer(page);
    assert.equal(said.distance, null);
    assert.match(said.error, /rigid|rotation/);
    await type("Twelve numbers of the pose", "1 0 0 1e999 0 1 0 0 0 0 1 0");
    await page.waitForSelector("text=found one that is not finite");
    await type("Twelve numbers of the pose", BESIDE.join(" "));
    await page.waitForFunction((d) => JSON.parse(document.documentElement.dataset.answer).distance === d, distance);
    assert.equal(await page.locator("#page-pair .problem").count(), 0);

    await page.click("#tab-motion");
    await type("24 numbers of the motion", `${skew} ${skew}`);
    await page.waitForSelector("#page-motion .problem");
    assert.equal(await page.evaluate(() => window.cbvhView.motion.motion), undefined);
    await page.keyboard.press("Space");
    await page.keyboard.press("]");
    await type("24 numbers of the motion", `${BESIDE.join(" ")} ${BESIDE.join(" ")}`);
    await page.waitForSelector("#page-motion .relation.free");
    assert.deepEqual(errors, []);
    await close();
});

test("a motion that comes near is not called a hit", { skip: WITHOUT }, async () => {
    const at = (y) => [1, 0, 0, 4.5, 0, 1, 0, y, 0, 0, 1, 0.125];
    // B goes by, hardly farther away than the clearance.
    const show = { kind: "motion", motion: [...at(-2), ...at(2)], clearance: 1.29, tolerance: 0.5 };
    const files = [
        ["ring.cbvh", RING()],
        ["box.cbvh", BOX()],
    ];
    const { page, errors, close } = await open(filled(files, show));
    await page.waitForSelector("#page-motion .relation.near");
    const shown = await page.locator("#page-motion, .stage").allInnerTexts();
    assert.deepEqual([shown.length, /first hit/i.test(shown.join())], [2, false]);
    await page.click("text=Go to this moment");
    assert.deepEqual(errors, []);
    await close();
});

test("a link with wrong numbers still shows the meshes", { skip: WITHOUT }, async () => {
    const skew = "1,0.5,0,0,0,1,0,0,0,0,1,0";
    const far = "view=1e300,0,0,0,0,0&time=-5&frame=1e9&triangle=7,1e9&tab=nothing&draw=zzz&paint=zzz&level=-1e9";
    for (const hash of [
        `#pose=${skew}&${far}`,
        `#motion=${skew},${skew}&clearance=-1&${far}`,
        "#pose=1,2&view=,,",
        "#%",
    ]) {
        const { page, errors, close } = await open(pair(), { hash });
        assert.deepEqual([await state(page), errors], ["ready", []], hash);
        await close();
    }
    const show = scene();
    const files = [
        ["ring.cbvh", RING()],
        ["box.cbvh", BOX()],
    ];
    const { page, errors, close } = await open(filled(files, show), { hash: "#frame=1e9&triangle=0,-3" });
    assert.deepEqual([await state(page), (await answer(page)).frame, errors], ["ready", show.frames.length - 1, []]);
    await page.keyboard.press("]");
    assert.equal((await answer(page)).frame, show.frames.length - 1);
    await close();
});

test("a clash report frames the chosen pair", { skip: WITHOUT }, async () => {
    const { instances } = scene();
    instances[1].pose = [1, 0, 0, 2.2, 0, 1, 0, 0.1, 0, 0, 1, 0.3];
    const files = [
        ["ring.cbvh", RING()],
        ["box.cbvh", BOX()],
    ];
    const depth = { lower: 0.896, upper: 0.9, point: [2.2, 0.1, 0.15], translation: [0, 0, 0.9] };
    const clashes = [
        { a: 0, b: 1, class: "overlapping", ...depth },
        { a: 0, b: 2, class: "near", distance: 0.8 },
        { a: 0, b: 1, class: "piercing", ...depth, volume: 0.5, pierced: [null, 0.25] },
        { a: 0, b: 1, class: "protruding", ...depth, volume: 0.125 },
    ];
    const show = { kind: "clash", instances, clashes };
    const { page, errors, close } = await open(filled(files, show));
    assert.equal(await state(page), "ready");
    const rows = page.locator(".list-row");
    assert.equal(await rows.count(), 4);
    assert.match(await rows.nth(2).textContent(), /piercing.*volume 0\.5.*0\.25 pierced/);
    assert.match(await rows.nth(3).textContent(), /protruding.*volume 0\.125$/);
    assert.doesNotMatch(await rows.nth(0).textContent(), /volume|pierced/);
    // Those that overlap have the colours of a hit.
    const colours = await page
        .locator(".badge")
        .evaluateAll((badges) => badges.map((badge) => getComputedStyle(badge).color));
    assert.deepEqual([colours[2], colours[3], colours[1] === colours[0]], [colours[0], colours[0], false]);
    await rows.first().click();
    await page.waitForSelector(".clash-facts >> text=moves B out");
    // The page measures what both have in common: the volume is that of the command.
    await page.waitForSelector(".clash-facts >> text=its box");
    const facts = await factsIn(page, ".clash-facts");
    const [solid, ...more] = await solids(page);
    assert.deepEqual(more, []);
    const volume = Number(facts["volume in both"]);
    assert.ok(volume > 0.1 && Math.abs(solid.volume - volume) < 1e-5 * volume, `${solid.volume} of ${volume}`);
    await picture(page, "clash");
    // Parts that are apart have no solid.
    await rows.nth(1).click();
    await page.waitForTimeout(500);
    assert.deepEqual(await solids(page), []);
    await page.selectOption('select[aria-label="Class of clashes"]', "near");
    assert.equal(await page.locator(".list-row").count(), 1);
    assert.deepEqual(errors, []);
    await close();
});

test("a narrow page has no horizontal overflow, in any tab", { skip: WITHOUT }, async () => {
    const { page, errors, close } = await open(pair(), { size: { width: 400, height: 800 } });
    for (const tab of ["pair", "motion", "inside", "probes"]) {
        await page.click(`#tab-${tab}`);
        await page.waitForTimeout(100);
        const wide = await page.evaluate(() => [
            document.documentElement.scrollWidth,
            document.querySelector(".pages").scrollWidth - document.querySelector(".pages").clientWidth,
        ]);
        assert.deepEqual(wide, [400, 0], tab);
    }
    await page.click("#tab-pair");
    await picture(page, "narrow");
    assert.deepEqual(errors, []);
    await close();
});

test("without WebAssembly, the page says so", async () => {
    const prepare = () => {
        delete window.WebAssembly;
    };
    const { page, close } = await open(template(), { prepare });
    assert.equal(await state(page), "error");
    assert.match(await page.getAttribute("html", "data-message"), /needs WebAssembly/);
    await close();
});

test("without WebGL, the page says so", async () => {
    const plain = await launch(["--disable-gpu", "--disable-software-rasterizer", "--disable-3d-apis"]);
    const { page, close } = await open(template(), { from: plain });
    assert.equal(await state(page), "error");
    assert.match(await page.getAttribute("html", "data-message"), /WebGL 2/);
    assert.ok(await page.isVisible("h1"));
    await close();
    await plain.close();
});

test("a page that was cut off says so", async () => {
    const html = filled([["ring.cbvh", Buffer.from("x")]], { kind: "file" }).replace(
        /<script type="text\/plain" class="cbvh-file">.*?<\/script>/s,
        "",
    );
    const { page, close } = await open(html);
    assert.equal(await state(page), "error");
    assert.match(await page.getAttribute("html", "data-message"), /expected 1 files in this page, found 0/);
    await close();
});
