/** Handles with which a body is moved and turned about its centre. */

import { Object3D, Quaternion } from "three";
import { TransformControls } from "three/addons/controls/TransformControls.js";
import type { Body } from "./bodies.js";
import { fromQuaternion, move, type Pose, placedAt, toQuaternion, turn } from "./pose.js";
import type { Stage } from "./stage.js";

export class Handles {
    readonly #controls: TransformControls;
    readonly #pivot = new Object3D();
    #body: Body | undefined;
    /** Called with each new pose while the body is dragged. */
    onPose: (pose: Pose) => void = () => {};

    constructor(readonly stage: Stage) {
        this.#controls = new TransformControls(stage.camera, stage.canvas);
        this.#controls.size = 0.75;
        this.#controls.setColors(0xe5484d, 0x2f9e63, 0x3b7ddd, 0xf2c037);
        stage.scene.add(this.#pivot, this.#controls.getHelper());
        this.#controls.addEventListener("change", () => stage.draw());
        this.#controls.addEventListener("dragging-changed", ({ value }) => {
            stage.orbit.enabled = !value;
        });
        this.#controls.addEventListener("objectChange", () => this.#moved());
    }

    get body(): Body | undefined {
        return this.#body;
    }

    get isDragging(): boolean {
        return this.#controls.dragging;
    }

    /** Whether the pointer is over a handle. */
    get isHovered(): boolean {
        return this.#controls.axis !== null;
    }

    attach(body: Body | undefined): void {
        this.#body = body;
        if (body === undefined) {
            this.#controls.detach();
        } else {
            this.follow();
            this.#controls.attach(this.#pivot);
        }
        this.#controls.getHelper().visible = this.isShown && body !== undefined;
        this.stage.draw();
    }

    /** Goes to where the body is. */
    follow(): void {
        const body = this.#body;
        if (body === undefined || this.#controls.dragging) {
            return;
        }
        this.stage.toStage(move(body.pose, body.shown.centre), this.#pivot.position);
        this.#pivot.quaternion.copy(new Quaternion(...toQuaternion(body.pose)));
        this.#pivot.updateMatrixWorld();
        this.stage.draw();
    }

    #moved(): void {
        const body = this.#body;
        if (body === undefined) {
            return;
        }
        const { x, y, z, w } = this.#pivot.quaternion;
        // While it is only moved, the rotation keeps its bits.
        const turned = this.mode === "rotate" ? fromQuaternion([x, y, z, w], [0, 0, 0]) : body.pose;
        const centre = this.stage.toMesh(this.#pivot.position);
        const [cx, cy, cz] = turn(turned, body.shown.centre);
        this.onPose(placedAt(turned, [centre[0] - cx, centre[1] - cy, centre[2] - cz]));
    }

    get mode(): "translate" | "rotate" {
        return this.#controls.mode === "rotate" ? "rotate" : "translate";
    }

    set mode(mode: "translate" | "rotate") {
        this.#controls.setMode(mode);
        this.stage.draw();
    }

    get isLocal(): boolean {
        return this.#controls.space === "local";
    }

    set isLocal(local: boolean) {
        this.#controls.setSpace(local ? "local" : "world");
        this.stage.draw();
    }

    get isShown(): boolean {
        return this.#controls.enabled;
    }

    set isShown(shown: boolean) {
        this.#controls.enabled = shown;
        this.#controls.getHelper().visible = shown && this.#body !== undefined;
        this.stage.draw();
    }
}
