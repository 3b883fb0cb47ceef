/** Makes elements of the page. */

type Child = Node | string | undefined | false;
type Attributes = Record<string, string | number | boolean | undefined | ((event: Event) => void)>;

/** Makes an element. Attributes that are functions listen to the event of their name; `false` and `undefined` are left out. */
export function h<Tag extends keyof HTMLElementTagNameMap>(
    tag: Tag,
    attributes: Attributes = {},
    ...children: Child[]
): HTMLElementTagNameMap[Tag] {
    const element = document.createElement(tag);
    for (const [name, value] of Object.entries(attributes)) {
        if (typeof value === "function") {
            element.addEventListener(name, value);
        } else if (name === "style") {
            // The page's policy refuses the attribute, but not what it stands for.
            element.style.cssText = String(value);
        } else if (value !== undefined && value !== false) {
            element.setAttribute(name, value === true ? "" : String(value));
        }
    }
    element.append(...children.filter((child): child is Node | string => child !== undefined && child !== false));
    return element;
}

/** Replaces what an element contains. */
export function fill(element: HTMLElement, ...children: Child[]): void {
    element.replaceChildren(
        ...children.filter((child): child is Node | string => child !== undefined && child !== false),
    );
}

const NAMESPACE = "http://www.w3.org/2000/svg";

/** The paths of icons, in a square of 24 units. */
const ICONS = {
    move: "M12 3v18M3 12h18M12 3l-3 3M12 3l3 3M12 21l-3-3M12 21l3-3M3 12l3-3M3 12l3 3M21 12l-3-3M21 12l-3 3",
    rotate: "M20 12a8 8 0 1 1-2.6-5.9M20 3v4.5h-4.5",
    fit: "M4 9V4h5M15 4h5v5M20 15v5h-5M9 20H4v-5M9 12h6M12 9v6",
    xray: "M12 5c5 0 8.5 4.5 9.5 7-1 2.5-4.5 7-9.5 7s-8.5-4.5-9.5-7C3.5 9.5 7 5 12 5zM12 9.200a2.8 2.8 0 1 0 0 5.6 2.8 2.8 0 0 0 0-5.600z",
    edges: "M12 3 3 8v8l9 5 9-5V8zM3 8l9 5 9-5M12 13v8",
    smooth: "M4 16c3-9 6-9 8-4s5 5 8-4",
    grid: "M4 4h16v16H4zM4 10h16M4 15h16M10 4v16M15 4v16",
    theme: "M12 4a8 8 0 1 0 0 16zM12 4a8 8 0 0 1 0 16",
    help: "M9 9.500a3 3 0 1 1 4.5 2.600c-1 .6-1.5 1.1-1.5 2.400M12 17.800v.2",
    about: "M12 11v6M12 7.500v.1",
    open: "M4 19V6h6l2 2.500h8V19zM12 17v-5M9.5 14l2.5-2.5 2.5 2.5",
    save: "M12 4v10M8 10.500l4 4 4-4M5 19h14",
    link: "M10 14a4 4 0 0 0 6 .3l3-3a4 4 0 0 0-5.6-5.600L12 7M14 10a4 4 0 0 0-6-.3l-3 3a4 4 0 0 0 5.6 5.600L12 17",
    command: "M5 7l5 5-5 5M12 17h7",
    play: "M8 5v14l11-7z",
    pause: "M8 5v14M16 5v14",
    up: "M12 20V5M6.5 10 12 4.5 17.5 10",
    close: "M6 6l12 12M18 6 6 18",
} as const;

export type IconName = keyof typeof ICONS;

export function icon(name: IconName): SVGSVGElement {
    const svg = document.createElementNS(NAMESPACE, "svg");
    svg.setAttribute("viewBox", "0 0 24 24");
    svg.setAttribute("class", "icon");
    svg.setAttribute("aria-hidden", "true");
    const path = document.createElementNS(NAMESPACE, "path");
    path.setAttribute("d", ICONS[name]);
    svg.append(path);
    return svg;
}

/** A button with an icon. Its title says its key. */
export function iconButton(name: IconName, title: string, press: () => void, text?: string): HTMLButtonElement {
    return h(
        "button",
        {
            type: "button",
            class: text === undefined ? "icon-button" : "button",
            title,
            "aria-label": title,
            click: press,
        },
        icon(name),
        text !== undefined && h("span", {}, text),
    );
}

/** A row of a list of facts. */
export const fact = (name: string, ...value: Child[]): HTMLElement =>
    h("div", { class: "fact" }, h("dt", {}, name), h("dd", {}, ...value));

/** Writes a length: six digits, which are enough to read. All digits are in the title. */
export function short(value: number): string {
    if (!Number.isFinite(value)) {
        return String(value);
    }
    const text = value.toPrecision(6);
    return text.includes("e") ? Number(text).toExponential() : String(Number(text));
}

/** A number that shows all its digits when the pointer rests on it. */
export const exact = (value: number): HTMLElement => h("span", { class: "number", title: String(value) }, short(value));

/** A point, as short numbers. */
export const pointOf = (point: ArrayLike<number>): HTMLElement =>
    h("span", { class: "number", title: Array.from(point, String).join(" ") }, Array.from(point, short).join(", "));

/** A size in bytes. */
export function bytesOf(count: number): string {
    if (count < 1000) {
        return `${count} B`;
    }
    const units = ["kB", "MB", "GB"];
    let [value, unit] = [count / 1000, 0];
    while (value >= 1000 && unit < 2) {
        value /= 1000;
        unit++;
    }
    return `${value.toPrecision(3)} ${units[unit] ?? "GB"}`;
}

/** A count with thin gaps between thousands. */
export const countOf = (count: number): string => String(count).replace(/\B(?=(\d{3})+$)/g, "\u202f");

/** A time. Browsers round it to a tenth of a millisecond. */
export const milliseconds = (value: number): string =>
    value < 0.1 ? "less than 0.1 ms" : `${value.toPrecision(value < 10 ? 2 : 3)} ms`;
