/**
 * Takes pictures of pages of `cbvh view`, as the book shows them: picture.js FOLDER PAGE.html[=TEXT]... writes FOLDER/PAGE.png, after a
 * click on the first thing that has this text. CHROMIUM names the browser, which needs no graphics card.
 */

import path from "node:path";
import { pathToFileURL } from "node:url";
import { chromium } from "playwright-core";

const [folder, ...pages] = process.argv.slice(2);
const browser = await chromium.launch({
    executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
    args: ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist"],
});
for (const [name, text] of pages.map((page) => page.split("="))) {
    const page = await browser.newPage({ viewport: { width: 980, height: 600 }, colorScheme: "light" });
    await page.goto(pathToFileURL(path.resolve(name)).href);
    await page.waitForSelector('html[data-state="ready"]');
    if (text !== undefined) {
        await page.getByText(text).first().click();
    }
    await page.waitForTimeout(1500);
    await page.screenshot({ path: path.join(folder, `${path.basename(name, ".html")}.png`) });
    await page.close();
}
await browser.close();
