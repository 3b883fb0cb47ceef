/**
 * Moves one mesh past another, and shows the answers of the library. The address of the page may name other meshes, and the values of
 * the sliders: ?a=room.cbvh&b=robot.cbvh&x=0.5&turn=1.
 */

import { init, Mesh, pose, Relation } from "../dist/index.js";

const canvas = document.querySelector("canvas");
const context = canvas.getContext("2d");
const sliders = Object.fromEntries(["x", "y", "z", "turn"].map((name) => [name, document.getElementById(name)]));
const output = document.getElementById("answer");
const command = document.getElementById("command");
const message = document.getElementById("message");

/** The corners of a cube from -0.7 to 0.7: nine numbers for each triangle. */
export const cubeTriangles = [0, 1, 2].flatMap((axis) =>
    [-0.7, 0.7].flatMap((height) => {
        const corner = (u, v) => {
            const point = [0, 0, 0];
            point[axis] = height;
            point[(axis + 1) % 3] = height < 0 ? v : u;
            point[(axis + 2) % 3] = height < 0 ? u : v;
            return point;
        };
        const [a, b, c, d] = [corner(-0.7, -0.7), corner(0.7, -0.7), corner(0.7, 0.7), corner(-0.7, 0.7)];
        return [a, b, c, a, c, d].flat();
    }),
);

/** A ring around the z axis. */
function ringTriangles(around = 64, across = 32) {
    const point = (k, l) => {
        const [u, v] = [(2 * Math.PI * k) / around, (2 * Math.PI * l) / across];
        const radius = 2 + 0.7 * Math.cos(v);
        return [radius * Math.cos(u), radius * Math.sin(u), 0.7 * Math.sin(v)].map(Math.fround);
    };
    const triangles = [];
    for (let k = 0; k < around; k++) {
        for (let l = 0; l < across; l++) {
            const [a, b] = [point(k, l), point((k + 1) % around, l)];
            const [c, d] = [point((k + 1) % around, (l + 1) % across), point(k, (l + 1) % across)];
            triangles.push(a, b, c, a, c, d);
        }
    }
    return triangles.flat();
}

/** A mesh, and its triangles in its own frame. */
class Body {
    constructor(name, mesh) {
        Object.assign(this, { name, mesh, triangles: mesh.triangles() });
    }

    static async of(file) {
        const bytes = new Uint8Array(await file.arrayBuffer());
        const isBaked = file.name.toLowerCase().endsWith(".cbvh");
        return new Body(file.name, isBaked ? Mesh.open(bytes) : Mesh.bakeFile(file.name, bytes));
    }

    /** A mesh that is loaded from an address. */
    static async at(address) {
        const response = await fetch(address);
        if (!response.ok) {
            throw new Error(`${address}: status ${response.status}`);
        }
        return Body.of(new File([await response.blob()], new URL(response.url).pathname.split("/").pop()));
    }

    /** The longest side of its box. */
    get size() {
        const [x0, y0, z0, x1, y1, z1] = this.mesh.bounds;
        return Math.max(x1 - x0, y1 - y0, z1 - z0) || 1;
    }

    /** The middle of its box. */
    get middle() {
        return [0, 1, 2].map((axis) => (this.mesh.bounds[axis] + this.mesh.bounds[axis + 3]) / 2);
    }
}

let a, b;

/** The pose of B. The unit of the sliders for x, y and z is a fifth of A's size. */
function placeB() {
    const scale = a.size / 5;
    const [x, y, z, turn] = ["x", "y", "z", "turn"].map((name) => Number(sliders[name].value));
    const half = turn / 2;
    return pose([x * scale, y * scale, z * scale], [0, 0, Math.sin(half), Math.cos(half)]);
}

/** The name of the relation, or the error if a file was baked without topology. */
function relationOf(at) {
    try {
        return Relation[a.mesh.relation(b.mesh, at)];
    } catch (error) {
        return error.message;
    }
}

/** Asks about both meshes, and shows the answer. */
function update() {
    const at = placeB();
    const start = performance.now();
    const nearest = a.mesh.distance(b.mesh, at);
    const contacts = nearest.distance === 0 ? a.mesh.contacts(b.mesh, at) : new Uint32Array();
    const relation = relationOf(at);
    const took = performance.now() - start;
    const collide = contacts.length > 0;
    output.textContent = [
        collide ? `${contacts.length / 4} pairs of triangles touch` : `${nearest.distance} mesh units apart`,
        `certainly ${nearest.lower} to ${nearest.upper}`,
        `triangle ${nearest.triangleA} of A, triangle ${nearest.triangleB} of B`,
        `relation: ${relation.replaceAll("_", " ").toLowerCase()}; computed in ${took.toFixed(2)} ms`,
    ].join("\n");
    const triangles = [a.mesh.triangleCount, b.mesh.triangleCount];
    const { distance, lower, upper } = nearest;
    document.documentElement.dataset.answer = JSON.stringify({ collide, distance, lower, upper, relation, triangles });
    command.parentElement.hidden = ![a, b].every((body) => body.name.includes("."));
    command.textContent = `cbvh query ${a.name} ${b.name} --mode distance --pose "${[...at].join(" ")}"`;
    draw(at, nearest, contacts);
}

/** Draws both meshes as seen along the x axis, somewhat from above. */
function draw(at, nearest, contacts) {
    const scale = canvas.height / (1.3 * a.size);
    const tilt = 0.5;
    const middle = a.middle;
    const project = (point) => {
        const [x, y, z] = point.map((value, axis) => value - middle[axis]);
        return [
            canvas.width / 2 + scale * (y - 0.25 * x),
            canvas.height / 2 - scale * (z * Math.cos(tilt) - x * Math.sin(tilt)),
        ];
    };
    const place = ([x, y, z]) => [0, 4, 8].map((row) => at[row] * x + at[row + 1] * y + at[row + 2] * z + at[row + 3]);
    const [inA, inB] = [new Set(), new Set()];
    for (let k = 0; k < contacts.length; k += 4) {
        inA.add(contacts[k + 1]);
        inB.add(contacts[k + 3]);
    }
    context.clearRect(0, 0, canvas.width, canvas.height);
    const paint = (body, move, touching, colour) => {
        const path = { free: new Path2D(), touching: new Path2D() };
        for (let k = 0; k < body.triangles.length; k += 9) {
            const corners = [0, 3, 6].map((c) => project(move(body.triangles.subarray(k + c, k + c + 3))));
            const of = touching.has(k / 9) ? path.touching : path.free;
            of.moveTo(...corners[2]);
            corners.forEach((corner) => of.lineTo(...corner));
        }
        context.lineWidth = 0.7;
        context.strokeStyle = colour;
        context.stroke(path.free);
        context.fillStyle = "#e0303088";
        context.fill(path.touching);
        context.strokeStyle = "#e03030";
        context.stroke(path.touching);
    };
    paint(a, (point) => point, inA, "#4477bb99");
    paint(b, place, inB, "#cc8822");
    context.lineWidth = 3;
    context.strokeStyle = "#22aa55";
    context.beginPath();
    context.moveTo(...project(nearest.pointA));
    context.lineTo(...project(nearest.pointB));
    context.stroke();
}

/** Lets the user drop or choose a file for one of the meshes. */
function takeFiles(element, put) {
    const take = async (file) => {
        try {
            const body = await Body.of(file);
            put(body).mesh.free();
            message.textContent = "";
            update();
            element.firstChild.textContent = file.name;
        } catch (error) {
            message.textContent = error.message;
        }
    };
    const input = Object.assign(document.createElement("input"), { type: "file", hidden: true });
    input.addEventListener("change", () => input.files[0] && take(input.files[0]));
    element.append(input);
    element.addEventListener("dragover", (event) => event.preventDefault());
    element.addEventListener("drop", (event) => {
        event.preventDefault();
        if (event.dataTransfer.files[0]) {
            take(event.dataTransfer.files[0]);
        }
    });
}

/** Moves B in the plane of the picture. */
canvas.addEventListener("pointerdown", (event) => canvas.setPointerCapture(event.pointerId));
canvas.addEventListener("pointermove", (event) => {
    if (event.buttons === 0 || a === undefined) {
        return;
    }
    const unit = (canvas.clientHeight / 1.3) * 0.2;
    sliders.y.value = Number(sliders.y.value) + event.movementX / unit;
    sliders.z.value = Number(sliders.z.value) - event.movementY / (unit * Math.cos(0.5));
    update();
});

try {
    await init();
    const given = new URLSearchParams(location.search);
    const meshAt = (name) => given.has(name) && Body.at(given.get(name));
    a = (await meshAt("a")) || new Body("A", Mesh.bake(ringTriangles()));
    b = (await meshAt("b")) || new Body("B", Mesh.bake(cubeTriangles));
    for (const [name, slider] of Object.entries(sliders)) {
        slider.value = given.get(name) ?? slider.value;
    }
    const swap = (old, found) => (found(), old);
    document.getElementById("drop-a").textContent = a.name;
    document.getElementById("drop-b").textContent = b.name;
    takeFiles(document.getElementById("drop-a"), (body) => swap(a, () => (a = body)));
    takeFiles(document.getElementById("drop-b"), (body) => swap(b, () => (b = body)));
    Object.values(sliders).forEach((slider) => slider.addEventListener("input", update));
    update();
    document.documentElement.dataset.state = "ready";
} catch (error) {
    message.textContent = error.message;
    document.documentElement.dataset.state = "error";
}
