/** How bodies look: their colours, how far one sees through them, edges, and the dark or the light theme. */

import type { Body } from "./bodies.js";
import type { View } from "./view.js";

/** How a scene shows its instances, by their numbers. */
export interface Tint {
    colourOf(instance: number): number;
    /** Whether the instance may be seen through. */
    isBackground(instance: number): boolean;
}

export class Look {
    /** Of a scene only. */
    tint: Tint | undefined;
    /** Called when something has changed that buttons show. */
    onChange: () => void = () => {};
    /** Called when the theme has changed, and with it the colours of what is drawn on top of bodies. */
    onTheme: () => void = () => {};
    isDark = false;
    isSmooth = false;
    hasEdges = false;
    #opacity = 1;

    constructor(readonly view: View) {}

    get isXray(): boolean {
        return this.#opacity < 1;
    }

    /** The colour of a body. */
    colourOf(body: Body): number {
        if (this.tint !== undefined) {
            return this.tint.colourOf(this.view.bodies.indexOf(body));
        }
        const { palette } = this.view.stage;
        return body.name === "B" ? palette.b : palette.a;
    }

    /** How opaque a body is: in scenes, what moves or touches is seen through the rest. */
    opacityOf(body: Body): number {
        const isShownWhole = this.tint?.isBackground(this.view.bodies.indexOf(body)) === false;
        return isShownWhole ? 1 : this.#opacity;
    }

    apply(): void {
        for (const body of this.view.bodies) {
            body.setSmooth(this.isSmooth);
            body.setOpacity(this.opacityOf(body));
            body.setEdges(this.hasEdges, this.isDark ? 0x000000 : 0x1b2430);
            body.setColour(this.colourOf(body));
        }
        this.onChange();
    }

    toggleXray(): void {
        this.#opacity = this.isXray ? 1 : 0.35;
        this.apply();
    }

    toggleEdges(): void {
        this.hasEdges = !this.hasEdges;
        this.apply();
    }

    toggleSmooth(): void {
        this.isSmooth = !this.isSmooth;
        this.apply();
    }

    toggleGrid(): void {
        this.view.stage.showsGrid = !this.view.stage.showsGrid;
        this.onChange();
    }

    toggleTheme(): void {
        this.setDark(!this.isDark);
    }

    setDark(dark: boolean): void {
        this.isDark = dark;
        document.documentElement.dataset.theme = dark ? "dark" : "light";
        this.view.stage.setDark(dark);
        this.apply();
        this.onTheme();
    }
}
