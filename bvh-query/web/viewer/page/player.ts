/** A slider with a button that plays it: the time of a motion, or the frame of a scene. */

import { fill, h, type IconName, iconButton } from "./dom.js";

/** Returns the next value of the slider, or `undefined` at the end. */
type Next = () => number | undefined;

export class Player {
    readonly slider: HTMLInputElement;
    readonly element: HTMLElement;
    readonly #button = iconButton("play", "Play or pause (Space)", () => this.toggle());
    readonly #number = h("output", { class: "number time" });
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
        this.slider.addEventListener("input", () => void go(this.value));
        this.element = h("div", { class: "player" }, this.#button, this.slider, this.#number);
    }

    get value(): number {
        return this.slider.valueAsNumber;
    }

    /** The value nearest to this one that the slider has. */
    nearest(value: number): number {
        const inside = Math.min(Math.max(value, 0), Number(this.slider.max));
        return this.slider.step === "1" ? Math.round(inside) : inside;
    }

    show(value: number, text: string): void {
        this.slider.value = String(value);
        this.#number.textContent = text;
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
