/** A slider with a button that plays it: the time of a motion, or the frame of a scene. */

import { fill, h, type IconName, iconButton } from "./dom.js";

/** How long a time from 0 to 1 plays, in milliseconds. */
const DURATION = 4000;

/** Returns the next value of the slider, or `undefined` at the end. */
type Next = () => number | undefined;

export class Player {
    readonly slider: HTMLInputElement;
    readonly element: HTMLElement;
    readonly #button = iconButton("play", "Play or pause (Space)", () => this.toggle());
    readonly #number = h("output", { class: "number time" });
    #value = 0;
    #playing = 0;

    /**
     * @param go Shows a value. It is called again only when its promise is done.
     * @param begin Starts to play from the present value; `undefined` if there is nothing to play.
     */
    constructor(
        label: string,
        step: "any" | "1",
        readonly go: (value: number) => Promise<void>,
        readonly begin: () => Next | undefined,
    ) {
        this.slider = h("input", {
            type: "range",
            min: "0",
            max: step === "any" ? "1" : "0",
            step,
            value: "0",
            class: "timeline plain",
            "aria-label": label,
        });
        this.slider.addEventListener("input", () => void go(this.slider.valueAsNumber));
        this.element = h("div", { class: "player" }, this.#button, this.slider, this.#number);
    }

    /** The value that was shown last. The slider keeps 15 of its digits. */
    get value(): number {
        return this.#value;
    }

    /** The value nearest to this one that the slider has. */
    nearest(value: number): number {
        const inside = Math.min(Math.max(value, 0), Number(this.slider.max));
        return this.slider.step === "1" ? Math.round(inside) : inside;
    }

    show(value: number, text: string): void {
        this.#value = value;
        this.slider.value = String(value);
        this.#number.textContent = text;
    }

    /** Colours a timeline: free until one time, and hit at another. Without times, it is plain. */
    colour(freeUntil?: number, hit = 1): void {
        const percent = (share: number) => `${(100 * share).toFixed(3)}%`;
        const { classList, style } = this.slider;
        classList.toggle("plain", freeUntil === undefined);
        style.setProperty("--free", percent(freeUntil ?? 1));
        style.setProperty("--hit", percent(hit));
    }

    /** Plays evenly until a time, from the start if it is past that. */
    evenly(until = 1): Next {
        const from = this.value >= until ? 0 : this.value;
        const began = performance.now() - from * DURATION;
        return () => {
            const time = (performance.now() - began) / DURATION;
            return time < until || this.value < until ? Math.min(time, until) : undefined;
        };
    }

    #setIcon(icon: IconName): void {
        fill(this.#button, ...iconButton(icon, "", () => {}).childNodes);
    }

    toggle(): void {
        if (this.#playing !== 0) {
            this.stop();
            return;
        }
        const next = this.begin();
        if (next === undefined) {
            return;
        }
        this.#setIcon("pause");
        const step = async () => {
            const value = next();
            if (value === undefined) {
                this.stop();
                return;
            }
            if (value !== this.value) {
                await this.go(value);
            }
            // It may have been stopped meanwhile.
            if (this.#playing !== 0) {
                this.#playing = requestAnimationFrame(() => void step());
            }
        };
        this.#playing = requestAnimationFrame(() => void step());
    }

    stop(): void {
        cancelAnimationFrame(this.#playing);
        this.#playing = 0;
        this.#setIcon("play");
    }
}
