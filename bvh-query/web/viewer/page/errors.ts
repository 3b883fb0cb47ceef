/** Shows errors: those of damaged files with the rule, the byte, what was expected and what was found. */

import { fact, h } from "./dom.js";

/** What a breach of the format says, if a message is one. */
interface Breach {
    before: string;
    byte: string;
    rule: string;
    meaning: string;
    expected: string;
    found: string;
    remedy: string;
}

function breachOf(message: string): Breach | undefined {
    const found = /^(.*?)byte (\d+): (R\d+) \((.*?)\): expected (.*), found (.*); ([^;]*)$/s.exec(message);
    if (found === null) {
        return undefined;
    }
    const [, before = "", byte = "", rule = "", meaning = "", expected = "", seen = "", remedy = ""] = found;
    return { before, byte, rule, meaning, expected, found: seen, remedy };
}

/** Describes an error of a file. */
export function describe(name: string, message: string): HTMLElement {
    const breach = breachOf(message);
    if (breach === undefined) {
        return h("div", {}, h("strong", {}, name === "" ? "" : `${name}: `), message);
    }
    return h(
        "div",
        { class: "breach" },
        h("strong", {}, `${name} is damaged`),
        h(
            "dl",
            { class: "facts" },
            fact("rule", `${breach.rule}: ${breach.meaning}`),
            fact("at byte", breach.byte),
            fact("expected", breach.expected),
            fact("found", breach.found),
        ),
        h("p", { class: "muted" }, `${breach.remedy}.`),
    );
}

export const messageOf = (error: unknown): string => (error instanceof Error ? error.message : String(error));

/** Shows that the page cannot work, in place of everything else. */
export function failPage(title: string, detail: string | Node): void {
    const root = document.documentElement;
    const text = typeof detail === "string" ? detail : (detail.textContent ?? "");
    root.dataset.state = "error";
    root.dataset.message = `${title}: ${text}`;
    document.getElementById("loading")?.remove();
    document
        .getElementById("app")
        ?.replaceChildren(h("main", { class: "failure", role: "alert" }, h("h1", {}, title), h("div", {}, detail)));
}
