/** What all parts of the page share: the worker, the stage with its bodies, the panel, and messages. */

import type { Asker } from "./asker.js";
import type { Body } from "./bodies.js";
import { h } from "./dom.js";
import { Handles } from "./handles.js";
import { Messages, Panel } from "./panel.js";
import { Stage } from "./stage.js";

export class View {
    readonly stage: Stage;
    readonly handles: Handles;
    readonly panel = new Panel();
    readonly messages = new Messages();
    /** What surrounds the picture: controls are put on top of it. */
    readonly stageElement = h("main", { class: "stage" });
    bodies: Body[] = [];
    /** Two meshes or one, or a scene. */
    mode: "pair" | "scene" = "pair";
    /** Whether the scene is a robot, which sliders move. */
    isRobot = false;
    /** The largest side of what is shown, in mesh units. */
    size = 1;

    constructor(
        readonly asker: Asker,
        host: HTMLElement,
    ) {
        host.replaceChildren(this.stageElement, this.panel.element, this.messages.element);
        this.stage = new Stage(this.stageElement);
        this.handles = new Handles(this.stage);
    }

    /** Publishes an answer for programs that read the page. */
    setAnswer(answer: Record<string, unknown>): void {
        document.documentElement.dataset.answer = JSON.stringify(answer);
    }

    /** Copies text, and says so. */
    async copy(text: string, what: string): Promise<void> {
        try {
            await navigator.clipboard.writeText(text);
        } catch {
            // A page from a file may not have the clipboard.
            const area = h("textarea", { "aria-hidden": "true" });
            area.value = text;
            document.body.append(area);
            area.select();
            document.execCommand("copy");
            area.remove();
        }
        this.messages.say(`${what} was copied.`);
    }
}
