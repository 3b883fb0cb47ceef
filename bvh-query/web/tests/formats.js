/** Writes triangles as mesh files of four formats. */

const encoder = new TextEncoder();

function obj(triangles) {
    const vertices = [];
    for (let k = 0; k < triangles.length; k += 3) {
        vertices.push(`v ${triangles[k]} ${triangles[k + 1]} ${triangles[k + 2]}`);
    }
    const faces = [];
    for (let k = 1; k <= vertices.length; k += 3) {
        faces.push(`f ${k} ${k + 1} ${k + 2}`);
    }
    return encoder.encode([...vertices, ...faces, ""].join("\n"));
}

function stl(triangles) {
    const count = triangles.length / 9;
    const view = new DataView(new ArrayBuffer(84 + 50 * count));
    view.setUint32(80, count, true);
    triangles.forEach((number, k) => view.setFloat32(84 + 50 * Math.floor(k / 9) + 12 + 4 * (k % 9), number, true));
    return new Uint8Array(view.buffer);
}

function ply(triangles) {
    const count = triangles.length / 9;
    const head = [
        "ply",
        "format binary_little_endian 1.0",
        `element vertex ${3 * count}`,
        ...["x", "y", "z"].map((axis) => `property float ${axis}`),
        `element face ${count}`,
        "property list uchar uint vertex_indices",
        "end_header\n",
    ].join("\n");
    const view = new DataView(new ArrayBuffer(36 * count + 13 * count));
    triangles.forEach((number, k) => view.setFloat32(4 * k, number, true));
    for (let face = 0; face < count; face++) {
        const at = 36 * count + 13 * face;
        view.setUint8(at, 3);
        [0, 1, 2].forEach((corner) => view.setUint32(at + 1 + 4 * corner, 3 * face + corner, true));
    }
    return new Uint8Array([...encoder.encode(head), ...new Uint8Array(view.buffer)]);
}

function glb(triangles) {
    const positions = Float32Array.from(triangles);
    const document = {
        asset: { version: "2.0" },
        buffers: [{ byteLength: positions.byteLength }],
        bufferViews: [{ buffer: 0, byteLength: positions.byteLength }],
        accessors: [{ bufferView: 0, componentType: 5126, count: positions.length / 3, type: "VEC3" }],
        meshes: [{ primitives: [{ attributes: { POSITION: 0 } }] }],
        nodes: [{ mesh: 0 }],
        scenes: [{ nodes: [0] }],
        scene: 0,
    };
    const text = encoder.encode(JSON.stringify(document));
    const json = new Uint8Array(Math.ceil(text.length / 4) * 4).fill(0x20);
    json.set(text);
    const view = new DataView(new ArrayBuffer(28 + json.length + positions.byteLength));
    const words = [0x46546c67, 2, view.byteLength, json.length, 0x4e4f534a];
    words.forEach((word, k) => view.setUint32(4 * k, word, true));
    const bytes = new Uint8Array(view.buffer);
    bytes.set(json, 20);
    view.setUint32(20 + json.length, positions.byteLength, true);
    view.setUint32(24 + json.length, 0x004e4942, true);
    bytes.set(new Uint8Array(positions.buffer), 28 + json.length);
    return bytes;
}

/** Makes a file of each format, by its ending. */
export const writers = { obj, stl, ply, glb };
