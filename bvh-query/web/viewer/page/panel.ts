/** The panel beside the stage: a head, tabs, and messages. On a narrow page it is a sheet below the stage. */

import { fill, h, iconButton } from "./dom.js";

interface Tab {
    name: string;
    button: HTMLButtonElement;
    page: HTMLElement;
    onShow: (shown: boolean) => void;
}

export class Panel {
    readonly element = h("aside", { class: "panel", "aria-label": "Questions and answers" });
    readonly head = h("div", { class: "panel-head" });
    readonly #bar = h("div", { class: "tabs", role: "tablist" });
    readonly #pages = h("div", { class: "pages" });
    readonly foot = h("div", { class: "panel-foot" });
    readonly #tabs: Tab[] = [];
    #current: Tab | undefined;

    constructor() {
        const grip = h("button", {
            type: "button",
            class: "grip",
            title: "Make the panel larger or smaller",
            "aria-label": "Make the panel larger or smaller",
            click: () => this.element.classList.toggle("tall"),
        });
        this.element.append(grip, this.head, this.#bar, this.#pages, this.foot);
        this.#bar.addEventListener("keydown", (event) => {
            const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
            const shown = this.#tabs.filter((tab) => !tab.button.hidden);
            if (step !== undefined && this.#current !== undefined) {
                const next = shown[(shown.indexOf(this.#current) + step + shown.length) % shown.length];
                if (next !== undefined) {
                    this.show(next.name);
                    next.button.focus();
                }
                event.preventDefault();
                event.stopPropagation();
            }
        });
    }

    /** Adds a tab. `onShow` is called when it is shown and when it is left. */
    add(name: string, title: string, onShow: (shown: boolean) => void = () => {}): HTMLElement {
        const page = h("section", {
            class: "page",
            role: "tabpanel",
            id: `page-${name}`,
            "aria-label": title,
            hidden: true,
        });
        const button = h(
            "button",
            {
                type: "button",
                class: "tab",
                role: "tab",
                id: `tab-${name}`,
                "aria-controls": `page-${name}`,
                "aria-selected": "false",
                tabindex: "-1",
                click: () => this.show(name),
            },
            title,
        );
        this.#bar.append(button);
        this.#pages.append(page);
        this.#tabs.push({ name, button, page, onShow });
        return page;
    }

    show(name: string): void {
        const next = this.#tabs.find((tab) => tab.name === name && !tab.button.hidden);
        if (next === undefined || next === this.#current) {
            return;
        }
        const last = this.#current;
        this.#current = next;
        for (const tab of this.#tabs) {
            const isNext = tab === next;
            tab.page.hidden = !isNext;
            tab.button.setAttribute("aria-selected", String(isNext));
            tab.button.tabIndex = isNext ? 0 : -1;
        }
        this.#pages.scrollTop = 0;
        last?.onShow(false);
        next.onShow(true);
    }

    get current(): string {
        return this.#current?.name ?? "";
    }

    /** Shows only these tabs, and the first of them unless the present one is among them. */
    offer(names: string[]): void {
        for (const tab of this.#tabs) {
            tab.button.hidden = !names.includes(tab.name);
        }
        this.#bar.hidden = names.length < 2;
        if (!names.includes(this.current)) {
            const last = this.#current;
            this.#current = undefined;
            last?.onShow(false);
            for (const tab of this.#tabs) {
                tab.page.hidden = true;
            }
            this.show(names[0] ?? "");
        }
    }
}

/** A part of a tab, with a heading. */
export const part = (title: string, ...children: (Node | string | undefined | false)[]): HTMLElement =>
    h("div", { class: "part" }, h("h2", {}, title), ...children);

/** Messages that come and go. */
export class Messages {
    readonly element = h("div", { class: "messages", role: "status", "aria-live": "polite" });

    /** Says something. Errors stay until they are closed. */
    say(text: string | Node, kind: "note" | "error" = "note"): void {
        const message = h("div", { class: `message ${kind}` }, h("div", { class: "message-text" }, text));
        const remove = () => message.remove();
        message.append(iconButton("close", "Close", remove));
        if (kind === "note") {
            setTimeout(remove, 4000);
        }
        this.element.append(message);
    }

    /** Shows that something is under way. Returns a function that changes the text, and one that ends it. */
    busy(title: string): { stage: (text: string) => void; end: () => void } {
        const stage = h("span", { class: "muted" });
        const message = h(
            "div",
            { class: "message busy" },
            h("span", { class: "spinner" }),
            h("div", {}, title, " ", stage),
        );
        this.element.append(message);
        return { stage: (text) => fill(stage, text), end: () => message.remove() };
    }
}

/** Shows text in a window on top of the page. */
export function dialog(title: string, ...children: (Node | string | undefined | false)[]): void {
    const shown = h("dialog", { class: "dialog", "aria-label": title });
    const close = () => shown.close();
    shown.append(
        h("header", { class: "dialog-head" }, h("h1", {}, title), iconButton("close", "Close", close)),
        h("div", { class: "dialog-body" }, ...children),
    );
    shown.addEventListener("close", () => shown.remove());
    shown.addEventListener("click", (event) => event.target === shown && close());
    document.body.append(shown);
    shown.showModal();
}
