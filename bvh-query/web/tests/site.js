/**
 * Opens the site that .ci/site made, served by Python, in headless Chromium. What pages show is compared with what the command says,
 * whose path is in CBVH. CBVH_SITE names the folder, and CHROMIUM the browser.
 */

import assert from "node:assert/strict";
import { execFileSync, spawn } from "node:child_process";
import { once } from "node:events";
import path from "node:path";
import test, { after } from "node:test";
import { chromium } from "playwright-core";
import { ROOT } from "./files.js";

const { CBVH, CBVH_SITE, CHROMIUM } = process.env;

// Port 0 is one that is free, which the server prints.
const server = spawn("python3", ["-u", "-m", "http.server", "0", "--bind", "127.0.0.1", "--directory", CBVH_SITE], {
    stdio: ["ignore", "pipe", "ignore"],
});
const [line] = await once(server.stdout, "data");
const address = /http:\/\/[\d.]+:\d+\//.exec(String(line))[0];
const browser = await chromium.launch({
    executablePath: CHROMIUM ?? "/usr/bin/chromium",
    args: ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist"],
});
after(async () => {
    await browser.close();
    server.kill();
});

/** Opens a page, and collects errors, missing files, and requests to other servers. */
async function open(name) {
    const page = await browser.newPage();
    const wrong = [];
    page.on("console", (message) => message.type() === "error" && wrong.push(message.text()));
    page.on("pageerror", (error) => wrong.push(String(error)));
    page.on("response", (response) => response.status() >= 400 && wrong.push(`${response.status()} ${response.url()}`));
    page.on("request", (request) => {
        if (!request.url().startsWith(address) && !/^(blob|data):/.test(request.url())) {
            wrong.push(`a request to ${request.url()}`);
        }
    });
    await page.goto(address + name);
    return { page, wrong };
}

const answer = async (page) => JSON.parse(await page.getAttribute("html", "data-answer"));

/** What the command says about two meshes in a pose. */
function distance(a, b, pose) {
    const words = ["query", a, b, "--mode", "distance", "--json", "--pose", pose];
    return JSON.parse(execFileSync(CBVH, words, { cwd: ROOT, encoding: "utf8", stdio: ["ignore", "pipe", "ignore"] }));
}

test("the first page leads to the book, to pages of cbvh view and to the demo", async () => {
    const { page, wrong } = await open("");
    const links = await page.locator("a").evaluateAll((all) => all.map((link) => link.href));
    assert.ok(links.length >= 5, links.join(" "));
    for (const link of links) {
        const response = await page.goto(link);
        assert.equal(response.status(), 200, link);
        await page.waitForFunction(() => document.documentElement.dataset.state !== "loading");
        assert.notEqual(await page.getAttribute("html", "data-state"), "error", link);
    }
    assert.deepEqual(wrong, []);
    await page.close();
});

test("the book shows its pictures, the texts of programs, and finds words", async () => {
    const { page, wrong } = await open("book/guide/gallery.html");
    const widths = await page.locator("main img").evaluateAll((all) => all.map((image) => image.naturalWidth));
    assert.ok(widths.length >= 8 && widths.every((width) => width > 300), String(widths));
    await page.getByRole("link", { name: "sensors.py" }).click();
    assert.match(await page.locator("pre").textContent(), /import cbvh/);
    await page.goto(`${address}book/introduction.html?search=penetration`);
    await page.waitForSelector("#mdbook-searchresults li, #searchresults li");
    assert.deepEqual(wrong, []);
    await page.close();
});

test("the live page computes the distance of the command", async () => {
    const { page, wrong } = await open("view/room.html");
    await page.waitForSelector('html[data-state="ready"]', { timeout: 120_000 });
    const pose = "0.6 -0.8 0 -300  0.8 0.6 0 -1000  0 0 1 600";
    const expected = distance("testdata/fclenv.obj", "testdata/fclrob.obj", pose);
    assert.ok(expected.distance > 0);
    assert.equal((await answer(page)).distance, expected.distance);
    assert.deepEqual(wrong, []);
    await page.close();
});

test("the demo shows the distance of the command, wherever the mesh is moved", async () => {
    const { page: start } = await open("");
    const link = await start.locator('a[href^="demo/"]').getAttribute("href");
    await start.close();
    const { page, wrong } = await open(link);
    await page.waitForSelector('html[data-state="ready"]');
    const seen = new Set();
    for (const [name, value] of [
        ["x", -0.3],
        ["x", 1.5],
        ["z", 2.5],
        ["turn", 2],
        ["y", 0.25],
        ["z", 0.3],
        ["x", 0.8],
    ]) {
        await page.locator(`#${name}`).evaluate((slider, value) => {
            slider.value = value;
            slider.dispatchEvent(new Event("input"));
        }, value);
        const [, pose] = /^cbvh query room\.cbvh robot\.cbvh --mode distance --pose "([^"]*)"$/.exec(
            await page.locator("#command").textContent(),
        );
        const expected = distance(`${CBVH_SITE}/demo/room.cbvh`, `${CBVH_SITE}/demo/robot.cbvh`, pose);
        const found = await answer(page);
        for (const field of ["distance", "lower", "upper"]) {
            assert.equal(found[field], expected[field], `${field} at ${pose}`);
        }
        const text = await page.locator("#answer").textContent();
        assert.ok(
            text.includes(expected.distance > 0 ? `${expected.distance} mesh units apart` : "pairs of triangles touch"),
            text,
        );
        seen.add(expected.distance);
    }
    // The mesh did move, and some poses touch.
    assert.ok(seen.size >= 4 && seen.has(0), String([...seen]));
    assert.deepEqual(wrong, []);
    await page.close();
});
