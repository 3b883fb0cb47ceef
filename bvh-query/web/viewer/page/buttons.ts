/** The buttons of the page: the toolbar on the stage, and those in the head and at the foot of the panel. */

import { showAbout } from "./about.js";
import type { App } from "./app.js";
import { h, type IconName, iconButton } from "./dom.js";
import { showKeys } from "./keys.js";
import { copyCommand, copyLink } from "./link.js";

/** Adds all buttons, and keeps those pressed whose state is on. */
export function addButtons(app: App): void {
    const { look, view } = app;
    const { handles, panel, stage, stageElement } = view;
    const tool = (icon: IconName, title: string, press: () => void, isOn?: () => boolean) => {
        const button = iconButton(icon, title, press);
        return { button, isOn };
    };
    const handle = (mode: "translate" | "rotate") => () => handles.isShown && handles.mode === mode;
    const move = [
        tool("move", "Move B (T)", () => app.setHandleMode("translate"), handle("translate")),
        tool("rotate", "Turn B (R)", () => app.setHandleMode("rotate"), handle("rotate")),
    ];
    const see = [
        tool("fit", "Fit into the view (F)", () => app.fit()),
        tool(
            "xray",
            "See through (X)",
            () => look.toggleXray(),
            () => look.isXray,
        ),
        tool(
            "edges",
            "Edges (E)",
            () => look.toggleEdges(),
            () => look.hasEdges,
        ),
        tool(
            "smooth",
            "Smooth (S)",
            () => look.toggleSmooth(),
            () => look.isSmooth,
        ),
        tool(
            "grid",
            "Grid (G)",
            () => look.toggleGrid(),
            () => stage.showsGrid,
        ),
        tool("up", "Swap the axis that is up (U)", () => app.swapUp()),
    ];
    const buttons = (of: { button: HTMLElement }[]) => of.map(({ button }) => button);
    stageElement.append(
        h(
            "div",
            { class: "toolbar", role: "toolbar", "aria-label": "View" },
            ...buttons(move),
            h("span", { class: "gap" }),
            ...buttons(see),
        ),
    );
    look.onChange = () => {
        for (const { button, isOn } of [...move, ...see]) {
            if (isOn !== undefined) {
                button.setAttribute("aria-pressed", String(isOn()));
            }
        }
    };
    panel.head.append(
        h(
            "div",
            { class: "title" },
            h("strong", {}, "cbvh"),
            h("span", { class: "muted" }, "view"),
            h("span", { class: "grow" }),
            iconButton("open", "Open files (O)", () => app.drop.choose()),
            iconButton("theme", "Dark or light (D)", () => look.toggleTheme()),
            iconButton("help", "Keys (?)", () => showKeys()),
            iconButton("about", "About", () => void showAbout()),
        ),
        app.files,
    );
    const copies = "Copy the command line that asks the same (C)";
    panel.foot.append(
        iconButton("link", "Copy a link to this view", () => copyLink(app), "Copy link"),
        iconButton("command", copies, () => copyCommand(app), "Copy command"),
    );
}
