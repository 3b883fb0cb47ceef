/** What is drawn on top of the meshes: touching triangles, closest points, curves, arrows, points and rays. */

import {
    BufferAttribute,
    BufferGeometry,
    CanvasTexture,
    ConeGeometry,
    CylinderGeometry,
    DoubleSide,
    Group,
    Mesh,
    MeshBasicMaterial,
    type Object3D,
    Points,
    PointsMaterial,
    Quaternion,
    Vector3,
} from "three";
import { LineMaterial } from "three/addons/lines/LineMaterial.js";
import { LineSegments2 } from "three/addons/lines/LineSegments2.js";
import { LineSegmentsGeometry } from "three/addons/lines/LineSegmentsGeometry.js";
import type { Body } from "./bodies.js";
import type { Stage } from "./stage.js";

let disc: CanvasTexture | undefined;

/** A round dot with a thin bright border. */
function dot(): CanvasTexture {
    if (disc === undefined) {
        const canvas = document.createElement("canvas");
        canvas.width = canvas.height = 64;
        const context = canvas.getContext("2d");
        if (context !== null) {
            context.arc(32, 32, 26, 0, 2 * Math.PI);
            context.fillStyle = "#ffffff";
            context.fill();
        }
        disc = new CanvasTexture(canvas);
    }
    return disc;
}

/** A group of drawings that is replaced as a whole. Coordinates are those of meshes in the world. */
export class Overlay {
    readonly #group = new Group();
    readonly #labels: (() => void)[] = [];

    constructor(
        readonly stage: Stage,
        /** Later ones are drawn over earlier ones. */
        readonly order: number,
    ) {
        stage.scene.add(this.#group);
    }

    clear(): void {
        for (const child of [...this.#group.children]) {
            child.traverse((part: Object3D) => {
                if (part instanceof Mesh || part instanceof Points || part instanceof LineSegments2) {
                    (part.geometry as BufferGeometry).dispose();
                    (part.material as MeshBasicMaterial).dispose();
                }
            });
            child.removeFromParent();
        }
        for (const remove of this.#labels.splice(0)) {
            remove();
        }
        this.stage.draw();
    }

    set isVisible(visible: boolean) {
        this.#group.visible = visible;
        this.stage.draw();
    }

    #add(object: Object3D, order = 0): void {
        object.renderOrder = this.order + order;
        this.#group.add(object);
        this.stage.draw();
    }

    #flat(points: ArrayLike<number>): Float32Array {
        const flat = new Float32Array(points.length);
        const place = new Vector3();
        for (let at = 0; at + 2 < points.length; at += 3) {
            this.stage.toStage([points[at] ?? 0, points[at + 1] ?? 0, points[at + 2] ?? 0], place);
            flat.set([place.x, place.y, place.z], at);
        }
        return flat;
    }

    /** Draws segments, 6 numbers for each, `width` pixels wide. */
    segments(
        points: ArrayLike<number>,
        colour: number,
        width: number,
        options: { faint?: number; dashed?: boolean } = {},
    ): void {
        if (points.length < 6) {
            return;
        }
        const draw = (opacity: number, depthTest: boolean) => {
            const geometry = new LineSegmentsGeometry();
            geometry.setPositions(this.#flat(points));
            const material = new LineMaterial({
                color: colour,
                linewidth: width,
                transparent: true,
                opacity,
                depthTest,
                dashed: options.dashed ?? false,
                dashSize: 0.012,
                gapSize: 0.008,
            });
            const lines = new LineSegments2(geometry, material);
            lines.frustumCulled = false;
            if (options.dashed === true) {
                lines.computeLineDistances();
            }
            this.#add(lines, depthTest ? 1 : 0);
        };
        // What is hidden shines through.
        draw(options.faint ?? 0.45, false);
        draw(1, true);
    }

    /** Draws dots, `size` pixels wide. */
    dots(points: ArrayLike<number>, colour: number, size: number): void {
        if (points.length < 3) {
            return;
        }
        const geometry = new BufferGeometry();
        geometry.setAttribute("position", new BufferAttribute(this.#flat(points), 3));
        const material = new PointsMaterial({
            color: colour,
            map: dot(),
            size,
            sizeAttenuation: false,
            transparent: true,
            alphaTest: 0.4,
            depthTest: false,
        });
        const dots = new Points(geometry, material);
        dots.frustumCulled = false;
        this.#add(dots, 2);
    }

    /** Draws an arrow with a head. Its thickness is that of the stage. */
    arrow(from: ArrayLike<number>, along: ArrayLike<number>, colour: number, thickness = 0.008): void {
        const start = this.stage.toStage(from);
        const vector = new Vector3(along[0] ?? 0, along[1] ?? 0, along[2] ?? 0).multiplyScalar(this.stage.scale);
        const length = vector.length();
        if (!(length > 1e-9)) {
            return;
        }
        const head = Math.min(5 * thickness, 0.45 * length);
        const radius = Math.min(thickness, 0.16 * length);
        const material = new MeshBasicMaterial({ color: colour, transparent: true, opacity: 0.95, depthTest: false });
        const shaft = new Mesh(new CylinderGeometry(0.45 * radius, 0.45 * radius, length - head, 12), material);
        shaft.position.y = (length - head) / 2;
        const tip = new Mesh(new ConeGeometry(1.5 * radius, head, 20), material);
        tip.position.y = length - head / 2;
        const arrow = new Group();
        arrow.add(shaft, tip);
        arrow.position.copy(start);
        arrow.quaternion.copy(new Quaternion().setFromUnitVectors(new Vector3(0, 1, 0), vector.divideScalar(length)));
        shaft.renderOrder = tip.renderOrder = this.order + 1;
        this.#add(arrow, 1);
    }

    /** Paints triangles of a body, given by their places in the drawn order. */
    triangles(body: Body, places: Uint32Array, colour: number, opacity = 1): void {
        if (places.length === 0 || !body.shown.hasTriangles) {
            return;
        }
        const positions = new Float32Array(9 * places.length);
        places.forEach((place, k) => {
            positions.set(body.shown.triangle(place), 9 * k);
        });
        const geometry = new BufferGeometry();
        geometry.setAttribute("position", new BufferAttribute(positions, 3));
        const material = new MeshBasicMaterial({
            color: colour,
            side: DoubleSide,
            transparent: opacity < 1,
            opacity,
            polygonOffset: true,
            polygonOffsetFactor: -2,
            polygonOffsetUnits: -2,
        });
        const mesh = new Mesh(geometry, material);
        mesh.matrixAutoUpdate = false;
        mesh.matrix.copy(body.group.matrix);
        this.#add(mesh);
    }

    /** Draws a translucent solid over everything: three places of points for each triangle. */
    solid(points: ArrayLike<number>, triangles: number[], colour: number): void {
        if (triangles.length === 0) {
            return;
        }
        const geometry = new BufferGeometry();
        geometry.setAttribute("position", new BufferAttribute(this.#flat(points), 3));
        geometry.setIndex(triangles);
        const material = new MeshBasicMaterial({
            color: colour,
            side: DoubleSide,
            transparent: true,
            opacity: 0.45,
            depthTest: false,
        });
        const solid = new Mesh(geometry, material);
        solid.name = "solid";
        solid.frustumCulled = false;
        this.#add(solid);
    }

    label(text: string, at: ArrayLike<number>, kind: string): void {
        this.#labels.push(this.stage.label(text, this.stage.toStage(at), kind));
    }
}
