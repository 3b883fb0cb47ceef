/** Small meshes, poses and a scene for the tests of the page. */

/** A ring around the z axis, as OBJ. Its radii are 2 and 0.7. */
export function ring(around, across) {
    const lines = [];
    for (let k = 0; k < around; k++) {
        for (let l = 0; l < across; l++) {
            const [u, v] = [(2 * Math.PI * k) / around, (2 * Math.PI * l) / across];
            const radius = 2 + 0.7 * Math.cos(v);
            const corner = [radius * Math.cos(u), radius * Math.sin(u), 0.7 * Math.sin(v)].map(Math.fround);
            lines.push(`v ${corner.join(" ")}`);
        }
    }
    const at = (k, l) => (k % around) * across + (l % across) + 1;
    for (let k = 0; k < around; k++) {
        for (let l = 0; l < across; l++) {
            const [a, b, c, d] = [at(k, l), at(k + 1, l), at(k + 1, l + 1), at(k, l + 1)];
            lines.push(`f ${a} ${b} ${c}`, `f ${a} ${c} ${d}`);
        }
    }
    return `${lines.join("\n")}\n`;
}

/** A cube from -0.5 to 0.5, as OBJ. */
export function box() {
    const ends = [-0.5, 0.5];
    const corners = ends.flatMap((z) => ends.flatMap((y) => ends.map((x) => `v ${x} ${y} ${z}`)));
    const faces = ["1 3 4 2", "5 6 8 7", "1 2 6 5", "3 7 8 4", "1 5 7 3", "2 4 8 6"];
    return `${[...corners, ...faces.map((face) => `f ${face}`)].join("\n")}\n`;
}

/** Poses of the box around the ring, the same each time: some touch, some do not. */
export function overlaps(count) {
    let seed = 11;
    const random = () => {
        seed = (seed * 1103515245 + 12345) % 2147483648;
        return seed / 2147483648 - 0.5;
    };
    return Array.from({ length: count }, () => {
        const [x, y, z, w] = [random(), random(), random(), random()];
        const length = Math.hypot(x, y, z, w);
        const [i, j, k, r] = [x, y, z, w].map((value) => value / length);
        const place = [6 * random(), 6 * random(), 2.4 * random()];
        return [
            ...[1 - 2 * (j * j + k * k), 2 * (i * j - k * r), 2 * (i * k + j * r), place[0]],
            ...[2 * (i * j + k * r), 1 - 2 * (i * i + k * k), 2 * (j * k - i * r), place[1]],
            ...[2 * (i * k - j * r), 2 * (j * k + i * r), 1 - 2 * (i * i + j * j), place[2]],
        ];
    });
}

/** A ring that stands, and two boxes, one of which moves through the ring in three frames. */
export function scene() {
    const at = (x, y, z) => [1, 0, 0, x, 0, 1, 0, y, 0, 0, 1, z];
    // What moves is in group 2 and meets all, what stands is in group 1 and meets what moves.
    const instance = (name, file, pose, moving) => {
        const groups = moving ? { member: 2, meets: 3 } : { member: 1, meets: 2 };
        return { name, file, pose, margin: 0, moving, ...groups };
    };
    return {
        kind: "scene",
        instances: [
            instance("ring", 0, at(0, 0, 0), false),
            instance("traveller", 1, at(2, 0, 3), true),
            instance("wall", 1, at(-4, 0, 0), false),
        ],
        allowed: [],
        frames: [at(2, 0, 3), at(2, 0, 0.5), at(0, 0, -3)],
    };
}
