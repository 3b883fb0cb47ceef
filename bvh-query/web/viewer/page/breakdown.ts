/** What a file consists of: bytes by kind, objects, and the levels of their trees. */

import type { FileSummary } from "../worker/files.js";
import type { Handlers } from "../worker/worker.js";
import { bytesOf, countOf, fact, h } from "./dom.js";
import { part } from "./panel.js";

export type Contents = ReturnType<Handlers["contents"]>;

/** More objects than this are not described. */
const MAX_OBJECTS = 200;
/** The colours of sections in the bar, as CSS. */
const SECTION_COLOURS: Record<string, string> = {
    header: "#94a3b8",
    objects: "#64748b",
    nodes: "#3b82f6",
    leaves: "#f59e0b",
    ids: "#10b981",
    duplicates: "#14b8a6",
    provenance: "#a78bfa",
    instances: "#f472b6",
    topology: "#fb7185",
    "between sections": "#cbd5e1",
};

const cells = (tag: "td" | "th", ...texts: (string | HTMLElement)[]) => texts.map((text) => h(tag, {}, text));

/** Describes a file. `check` is put below the bytes. */
export function describeContents(summary: FileSummary, contents: Contents, check: HTMLElement): HTMLElement[] {
    const { objects } = contents;
    const title = objects.length === 1 ? "Object" : `${countOf(objects.length)} objects`;
    return [part("Bytes", ...bytes(summary, contents), check), part(title, ...describeObjects(contents))];
}

function bytes(summary: FileSummary, contents: Contents): HTMLElement[] {
    const parts = contents.sections.map(({ name, bytes }) => ({ name, bytes }));
    const known = parts.reduce((sum, { bytes }) => sum + bytes, 0);
    const head = { name: "header", bytes: contents.headerBytes };
    const gaps = { name: "between sections", bytes: summary.bytes - known - head.bytes };
    const all = [head, ...parts, gaps].filter(({ bytes }) => bytes > 0);
    const triangles = Math.max(
        contents.objects.reduce((sum, object) => sum + object.triangles, 0),
        1,
    );
    const colour = (name: string) => SECTION_COLOURS[name] ?? "#8b949e";
    const bar = h(
        "div",
        { class: "bar", role: "img", "aria-label": "Bytes by kind" },
        ...all.map(({ name, bytes }) =>
            h("span", {
                style: `flex:${bytes} 0 0;background:${colour(name)}`,
                title: `${name}: ${bytesOf(bytes)}`,
            }),
        ),
    );
    const table = h(
        "table",
        {},
        h("thead", {}, h("tr", {}, ...cells("th", "kind", "bytes", "per triangle", "share"))),
        h(
            "tbody",
            {},
            ...all.map(({ name, bytes }) =>
                h(
                    "tr",
                    {},
                    h("td", {}, h("i", { class: "swatch", style: `background:${colour(name)}` }), name),
                    ...cells(
                        "td",
                        countOf(bytes),
                        (bytes / triangles).toFixed(2),
                        `${((100 * bytes) / summary.bytes).toFixed(1)} %`,
                    ),
                ),
            ),
        ),
    );
    const text = `${bytesOf(summary.bytes)}, format ${contents.version}`;
    return [h("p", { class: "muted" }, text), bar, table];
}

function describeObjects(contents: Contents): HTMLElement[] {
    let before = 0;
    const described = contents.objects.slice(0, MAX_OBJECTS).map((object, number) => {
        const levels = contents.levelLengths[number] ?? 0;
        const counts = contents.levelCounts.subarray(4 * before, 4 * (before + levels));
        before += levels;
        const rows = Array.from({ length: levels }, (_, level) => {
            const [treelets = 0, children = 0, packets = 0, inPackets = 0] = counts.subarray(4 * level, 4 * level + 4);
            return h(
                "tr",
                {},
                ...cells(
                    "td",
                    String(level),
                    countOf(treelets),
                    treelets > 0 ? (children / treelets).toFixed(2) : "",
                    countOf(packets),
                    packets > 0 ? (inPackets / packets).toFixed(2) : "",
                ),
            );
        });
        const closed = object.closed === undefined ? "not stated" : object.closed ? "yes" : "no";
        return h(
            "details",
            { open: contents.objects.length === 1 },
            h("summary", {}, object.name === "" ? `object ${number}` : object.name),
            h(
                "dl",
                { class: "facts" },
                fact("profile", object.profile),
                fact("triangles as", object.encoding),
                fact("triangles", countOf(object.triangles)),
                object.duplicates > 0 && fact("exact duplicates", countOf(object.duplicates)),
                object.degenerate > 0 && fact("without area", countOf(object.degenerate)),
                fact("closed", closed),
                fact("pages", countOf(object.pages)),
                fact("treelets", countOf(object.treelets)),
                fact("leaf packets", countOf(object.packets)),
                fact("depth", String(levels)),
            ),
            h(
                "table",
                {},
                h("thead", {}, h("tr", {}, ...cells("th", "level", "treelets", "children", "packets", "triangles"))),
                h("tbody", {}, ...rows),
            ),
        );
    });
    const more = contents.objects.length - described.length;
    return more > 0 ? [...described, h("p", { class: "muted" }, `and ${countOf(more)} more`)] : described;
}
