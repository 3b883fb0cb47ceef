/**
 * The stage: draws with three.js, when something has changed.
 *
 * Its unit is about the size of what it shows, and its origin is in the middle: mesh coordinates are brought there in double
 * precision, before anything is rounded for the graphics card.
 */

import {
    Box3,
    CanvasTexture,
    ConeGeometry,
    CylinderGeometry,
    GridHelper,
    Group,
    Matrix4,
    Mesh,
    MeshBasicMaterial,
    type Object3D,
    PerspectiveCamera,
    type Quaternion,
    Raycaster,
    Scene,
    Sprite,
    SpriteMaterial,
    SRGBColorSpace,
    Vector2,
    Vector3,
    WebGLRenderer,
} from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import { type Palette, palette } from "./colours.js";
import type { Point, Pose } from "./pose.js";

/** The axes of the corner: an arrow and a letter for each. */
function axes(): Object3D[] {
    const names = ["x", "y", "z"] as const;
    const colours = [0xe5484d, 0x2f9e63, 0x3b7ddd];
    return names.flatMap((name, axis) => {
        const material = new MeshBasicMaterial({ color: colours[axis] ?? 0 });
        const shaft = new Mesh(new CylinderGeometry(0.045, 0.045, 0.75, 10), material);
        shaft.position.y = 0.375;
        const tip = new Mesh(new ConeGeometry(0.13, 0.3, 16), material);
        tip.position.y = 0.85;
        const arrow = new Group();
        arrow.add(shaft, tip);
        arrow.rotation.set(axis === 2 ? Math.PI / 2 : 0, 0, axis === 0 ? -Math.PI / 2 : 0);
        const canvas = document.createElement("canvas");
        canvas.width = canvas.height = 128;
        const context = canvas.getContext("2d");
        if (context !== null) {
            context.font = "700 104px system-ui, sans-serif";
            context.textAlign = "center";
            context.textBaseline = "middle";
            context.fillStyle = `#${(colours[axis] ?? 0).toString(16).padStart(6, "0")}`;
            context.fillText(name, 64, 64);
        }
        const map = new CanvasTexture(canvas);
        map.colorSpace = SRGBColorSpace;
        const letter = new Sprite(new SpriteMaterial({ map, depthTest: false }));
        letter.scale.setScalar(0.42);
        letter.position.setComponent(axis, 1.3);
        return [arrow, letter];
    });
}

/** A label that stays at a place of the stage. */
interface Label {
    element: HTMLElement;
    place: Vector3;
}

export class Stage {
    readonly scene = new Scene();
    readonly camera = new PerspectiveCamera(38, 1, 0.01, 100);
    readonly orbit: OrbitControls;
    readonly canvas: HTMLCanvasElement;
    palette: Palette = palette(false);
    /** The mesh coordinates of the stage's origin. */
    #origin: Point = [0, 0, 0];
    /** The length of a mesh unit on the stage: a power of two. */
    #scale = 1;
    readonly #renderer: WebGLRenderer;
    readonly #overlay: HTMLElement;
    readonly #labels = new Set<Label>();
    readonly #frame = new Group();
    #grid: GridHelper | undefined;
    readonly #triad = new Scene();
    readonly #triadCamera = new PerspectiveCamera(30, 1, 0.1, 20);
    #isDue = false;
    readonly #beforeDrawing: (() => void)[] = [];
    #framesDrawn = 0;

    constructor(host: HTMLElement) {
        this.canvas = document.createElement("canvas");
        this.canvas.tabIndex = 0;
        this.canvas.setAttribute("role", "application");
        this.canvas.setAttribute(
            "aria-label",
            "The meshes in space. Arrow keys turn the view, plus and minus zoom. Press the question mark for all keys.",
        );
        this.#overlay = document.createElement("div");
        this.#overlay.className = "labels";
        host.append(this.canvas, this.#overlay);
        const context = this.canvas.getContext("webgl2", { antialias: true, powerPreference: "high-performance" });
        if (context === null) {
            throw new Error(
                "this page draws with WebGL 2, which this browser does not offer; is the graphics card switched off?",
            );
        }
        this.#renderer = new WebGLRenderer({ canvas: this.canvas, context });
        this.#renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
        this.#renderer.autoClear = false;
        this.camera.up.set(0, 0, 1);
        this.camera.position.set(2.2, -2.8, 1.7);
        this.orbit = new OrbitControls(this.camera, this.canvas);
        this.orbit.enableDamping = true;
        this.orbit.dampingFactor = 0.18;
        this.orbit.zoomToCursor = true;
        this.orbit.addEventListener("change", () => this.draw());
        this.scene.add(this.#frame);
        this.#triad.add(...axes());
        new ResizeObserver(() => this.#resize(host)).observe(host);
        this.#resize(host);
        this.canvas.addEventListener("webglcontextrestored", () => this.draw());
    }

    #resize(host: HTMLElement): void {
        const [width, height] = [Math.max(host.clientWidth, 1), Math.max(host.clientHeight, 1)];
        this.#renderer.setSize(width, height, false);
        this.camera.aspect = width / height;
        this.camera.updateProjectionMatrix();
        this.draw();
    }

    get size(): Vector2 {
        return this.#renderer.getSize(new Vector2());
    }

    /** Calls a function before each picture. */
    beforeDrawing(work: () => void): void {
        this.#beforeDrawing.push(work);
    }

    /** Chooses which part of the world the stage shows: a point and a length that is about 1 from then on. */
    setFrame(origin: Point, size: number): void {
        this.#origin = origin;
        this.#scale = 2 ** -Math.ceil(Math.log2(size > 0 && Number.isFinite(size) ? size : 1));
    }

    get scale(): number {
        return this.#scale;
    }

    /** Brings a point to the stage. */
    toStage(point: ArrayLike<number>, to = new Vector3()): Vector3 {
        const [x, y, z] = this.#origin;
        return to.set((point[0] ?? 0) - x, (point[1] ?? 0) - y, (point[2] ?? 0) - z).multiplyScalar(this.#scale);
    }

    /** Brings a place of the stage to mesh coordinates. */
    toMesh(place: Vector3): Point {
        const [x, y, z] = this.#origin;
        return [place.x / this.#scale + x, place.y / this.#scale + y, place.z / this.#scale + z];
    }

    /** Places an object whose coordinates are in the frame of a mesh, less its centre. */
    place(object: Object3D, pose: Pose, centre: ArrayLike<number>): void {
        const m = (k: number) => pose[k] ?? 0;
        const c = (k: number) => centre[k] ?? 0;
        const at = [0, 4, 8].map((row) => m(row) * c(0) + m(row + 1) * c(1) + m(row + 2) * c(2) + m(row + 3));
        const { x, y, z } = this.toStage(at);
        const s = this.#scale;
        object.matrixAutoUpdate = false;
        object.matrix = new Matrix4().set(
            ...([s * m(0), s * m(1), s * m(2), x] as const),
            ...([s * m(4), s * m(5), s * m(6), y] as const),
            ...([s * m(8), s * m(9), s * m(10), z] as const),
            ...([0, 0, 0, 1] as const),
        );
        object.matrixWorldNeedsUpdate = true;
        this.draw();
    }

    setDark(dark: boolean): void {
        this.palette = palette(dark);
        this.#renderer.setClearColor(this.palette.background);
        this.#drawGrid();
    }

    /** Shows a grid below what is shown. */
    groundAt(height: number, size: number): void {
        this.#grid?.removeFromParent();
        const { grid, gridCentre } = this.palette;
        const step = 2 ** Math.round(Math.log2(size / 8));
        this.#grid = new GridHelper(24 * step, 24, gridCentre, grid);
        this.#grid.position.set(0, 0, height - 0.002 * size);
        if (this.camera.up.z > 0.5) {
            this.#grid.rotation.x = Math.PI / 2;
        } else {
            this.#grid.position.set(0, height - 0.002 * size, 0);
        }
        this.#grid.userData = { height, size };
        this.#frame.add(this.#grid);
        this.draw();
    }

    #drawGrid(): void {
        const at = this.#grid?.userData as { height: number; size: number } | undefined;
        if (at !== undefined) {
            this.groundAt(at.height, at.size);
        }
        this.draw();
    }

    set showsGrid(shown: boolean) {
        this.#frame.visible = shown;
        this.draw();
    }

    get showsGrid(): boolean {
        return this.#frame.visible;
    }

    /** Shows a part of the stage as large as possible, from where the camera looks. */
    fit(box: Box3, smooth = false): void {
        if (box.isEmpty()) {
            return;
        }
        const centre = box.getCenter(new Vector3());
        const away = this.camera.position.clone().sub(this.orbit.target);
        if (away.lengthSq() === 0) {
            away.set(1, -1, 1);
        }
        away.normalize();
        // Each corner of the box must be within the picture: it decides how far away the camera is at least.
        const right = new Vector3().crossVectors(this.camera.up, away).normalize();
        const above = new Vector3().crossVectors(away, right);
        const upright = Math.tan((this.camera.fov * Math.PI) / 360);
        const margin = 0.94;
        let distance = 1e-6;
        for (let corner = 0; corner < 8; corner++) {
            const offset = new Vector3(
                corner & 1 ? box.max.x : box.min.x,
                corner & 2 ? box.max.y : box.min.y,
                corner & 4 ? box.max.z : box.min.z,
            ).sub(centre);
            const sideways = Math.abs(offset.dot(right)) / (upright * this.camera.aspect * margin);
            const upwards = Math.abs(offset.dot(above)) / (upright * margin);
            distance = Math.max(distance, offset.dot(away) + Math.max(sideways, upwards));
        }
        const position = centre.clone().addScaledVector(away, distance);
        if (smooth) {
            this.#fly(position, centre);
        } else {
            this.camera.position.copy(position);
            this.orbit.target.copy(centre);
            this.orbit.update();
        }
        this.draw();
    }

    /** Looks from a direction. */
    lookFrom(direction: Vector3): void {
        const distance = this.camera.position.distanceTo(this.orbit.target);
        this.#fly(
            this.orbit.target.clone().addScaledVector(direction.normalize(), distance),
            this.orbit.target.clone(),
        );
    }

    #fly(position: Vector3, target: Vector3): void {
        if (window.matchMedia("(prefers-reduced-motion: reduce)").matches) {
            this.camera.position.copy(position);
            this.orbit.target.copy(target);
            this.orbit.update();
            this.draw();
            return;
        }
        const [fromPosition, fromTarget] = [this.camera.position.clone(), this.orbit.target.clone()];
        const began = performance.now();
        const step = () => {
            const share = Math.min((performance.now() - began) / 260, 1);
            const eased = 1 - (1 - share) ** 3;
            this.camera.position.lerpVectors(fromPosition, position, eased);
            this.orbit.target.lerpVectors(fromTarget, target, eased);
            this.orbit.update();
            this.draw();
            if (share < 1) {
                requestAnimationFrame(step);
            }
        };
        step();
    }

    /** Turns the view by angles in radians, and zooms by a factor. */
    turnBy(sideways: number, upwards: number, zoom = 1): void {
        const away = this.camera.position.clone().sub(this.orbit.target);
        const { up } = this.camera;
        const side = new Vector3().crossVectors(up, away).normalize();
        away.applyAxisAngle(up, sideways);
        const tilt = away.angleTo(up) + upwards;
        if (tilt > 0.05 && tilt < Math.PI - 0.05) {
            away.applyAxisAngle(side, upwards);
        }
        this.camera.position.copy(this.orbit.target).addScaledVector(away, zoom);
        this.orbit.update();
        this.draw();
    }

    /** Swaps the axis that is up: z or y. */
    setUp(axis: "y" | "z"): void {
        const from = this.camera.position.clone().sub(this.orbit.target);
        this.camera.up.set(0, axis === "y" ? 1 : 0, axis === "z" ? 1 : 0);
        this.camera.position.copy(this.orbit.target);
        this.camera.position.add(
            axis === "y" ? new Vector3(from.x, from.z, -from.y) : new Vector3(from.x, -from.z, from.y),
        );
        // The controls read the axis when they are made, and have no other way to learn of it.
        const { _quat, _quatInverse } = this.orbit as unknown as { _quat: Quaternion; _quatInverse: Quaternion };
        _quat.setFromUnitVectors(this.camera.up, new Vector3(0, 1, 0));
        _quatInverse.copy(_quat).invert();
        this.orbit.update();
        this.#drawGrid();
    }

    /** The ray through a point of the window, in mesh coordinates. */
    rayAt(clientX: number, clientY: number): { origin: Point; direction: Point } {
        const rectangle = this.canvas.getBoundingClientRect();
        const place = new Vector2(
            (2 * (clientX - rectangle.left)) / rectangle.width - 1,
            1 - (2 * (clientY - rectangle.top)) / rectangle.height,
        );
        const caster = new Raycaster();
        caster.setFromCamera(place, this.camera);
        const { x, y, z } = caster.ray.direction;
        return { origin: this.toMesh(caster.ray.origin), direction: [x, y, z] };
    }

    /** Adds a label at a place of the stage. Returns a function that removes it. */
    label(text: string, place: Vector3, kind: string): () => void {
        const element = document.createElement("div");
        element.className = `label ${kind}`;
        element.textContent = text;
        this.#overlay.append(element);
        const label = { element, place: place.clone() };
        this.#labels.add(label);
        this.draw();
        return () => {
            element.remove();
            this.#labels.delete(label);
        };
    }

    /** Draws soon. Nothing is drawn before `drawNow` was called once, when all of the content is there. */
    draw(): void {
        if (!this.#isDue && this.#framesDrawn > 0) {
            this.#isDue = true;
            requestAnimationFrame(() => this.drawNow());
        }
    }

    drawNow(): void {
        this.#isDue = false;
        const { camera, orbit } = this;
        if (orbit.enableDamping && orbit.enabled) {
            // It calls `draw` as long as the view moves.
            orbit.update();
        }
        const distance = Math.max(camera.position.distanceTo(orbit.target), 1e-6);
        camera.near = Math.max(distance * 0.01, 1e-5);
        camera.far = distance + 60;
        camera.updateProjectionMatrix();
        camera.updateMatrixWorld();
        for (const work of this.#beforeDrawing) {
            work();
        }
        const size = this.#renderer.getSize(new Vector2());
        this.#renderer.clear();
        this.#renderer.render(this.scene, camera);
        this.#drawTriad(size);
        this.#placeLabels(size);
        this.#framesDrawn++;
    }

    /** How many pictures were drawn. */
    get framesDrawn(): number {
        return this.#framesDrawn;
    }

    /** Draws the axes in a corner. */
    #drawTriad(size: Vector2): void {
        const side = 84;
        const away = this.camera.position.clone().sub(this.orbit.target).normalize();
        this.#triadCamera.position.copy(away.multiplyScalar(5.6));
        this.#triadCamera.up.copy(this.camera.up);
        this.#triadCamera.lookAt(0, 0, 0);
        this.#renderer.setViewport(8, 8, side, side);
        this.#renderer.clearDepth();
        this.#renderer.render(this.#triad, this.#triadCamera);
        this.#renderer.setViewport(0, 0, size.x, size.y);
    }

    #placeLabels(size: Vector2): void {
        for (const { element, place } of this.#labels) {
            const at = place.clone().project(this.camera);
            const shown = at.z > -1 && at.z < 1;
            element.hidden = !shown;
            if (shown) {
                const [x, y] = [((at.x + 1) / 2) * size.x, ((1 - at.y) / 2) * size.y];
                element.style.transform = `translate(${x.toFixed(1)}px, ${y.toFixed(1)}px)`;
            }
        }
    }

    /** The box of objects on the stage. */
    boxOf(objects: Iterable<Object3D>): Box3 {
        const box = new Box3();
        for (const object of objects) {
            object.updateWorldMatrix(true, true);
            box.union(new Box3().setFromObject(object));
        }
        return box;
    }
}
