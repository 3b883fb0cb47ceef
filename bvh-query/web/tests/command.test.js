/** Compares answers with those of the command, which the environment variable CBVH names, bit for bit. */

import { execFileSync } from "node:child_process";
import { existsSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import os from "node:os";
import path from "node:path";
import test, { after } from "node:test";
import * as cbvh from "cbvh";
import { equal, ok, random } from "./expect.js";
import { ROOT } from "./files.js";

const COMMAND = process.env.CBVH;
const TESTDATA = path.join(ROOT, "testdata");
const SHARED = path.join(ROOT, "../shared");
const WITHOUT = COMMAND === undefined && "CBVH names no command";
const folder = mkdtempSync(path.join(os.tmpdir(), "cbvh-web-"));
after(() => rmSync(folder, { recursive: true }));
await cbvh.init();

const { Mesh, Motion, MotionKind, Scene } = cbvh;

/** The records that the command prints. */
const command = (...words) =>
    execFileSync(COMMAND, [...words, "--json"].map(String), {
        encoding: "utf8",
        maxBuffer: 2 ** 30,
        stdio: ["ignore", "pipe", "ignore"],
    })
        .trim()
        .split("\n")
        .map((line) => JSON.parse(line));

const write = (name, rows) => {
    writeFileSync(path.join(folder, name), rows.map((row) => [...row].map(String).join(" ") + "\n").join(""));
    return path.join(folder, name);
};

/** The first rows of a text file of numbers. */
function rowsOf(file, limit) {
    const lines = readFileSync(file, "utf8")
        .split("\n")
        .map((line) => line.split("#")[0].trim());
    return lines
        .filter((line) => line !== "")
        .slice(0, limit)
        .map((line) => line.split(/\s+/).map(Number));
}

const meshOf = (file, options) => Mesh.bakeFile(path.basename(file), readFileSync(file), options);

/** Element k of N answers, as the command prints it. */
const ofDistances = (answer, k) => ({
    distance: answer.distance[k],
    lower: answer.lower[k],
    upper: answer.upper[k],
    point_a: [...answer.pointA.subarray(3 * k, 3 * k + 3)],
    point_b: [...answer.pointB.subarray(3 * k, 3 * k + 3)],
    object_a: answer.objectA[k],
    triangle_a: answer.triangleA[k],
    object_b: answer.objectB[k],
    triangle_b: answer.triangleB[k],
});

const contactRows = (rows) =>
    Array.from({ length: rows.length / 4 }, (_, k) => {
        const [object_a, triangle_a, object_b, triangle_b] = rows.subarray(4 * k, 4 * k + 4);
        return { object_a, triangle_a, object_b, triangle_b };
    });

let compared = 0;
/** How often each kind of answer was compared, to see that there were several. */
const seen = new Map();
function same(mode, found, expected) {
    ok(
        expected.length > 0 && found.length === expected.length,
        `${mode}: ${expected.length} answers, found ${found.length}`,
    );
    expected.forEach((record, k) => equal(found[k], record, `${mode} ${k}`));
    compared += expected.length;
    found.forEach((record) =>
        seen.set(mode, (seen.get(mode) ?? new Set()).add(JSON.stringify(Object.values(record).slice(1)))),
    );
}

function pairs(fileA, fileB, poses, limit, within, options = []) {
    const chosen = Object.fromEntries(options);
    const [a, b, rows] = [meshOf(fileA, chosen), meshOf(fileB, chosen), rowsOf(poses, limit)];
    const numbers = Float64Array.from(rows.flat());
    const flags = options.flatMap(([name, value]) => [`--${name}`, value]);
    const ask = (mode, ...more) =>
        command("query", fileA, fileB, poses, "--mode", mode, "--limit", limit, ...flags, ...more);
    const each = (of) => rows.map((_, pose) => ({ pose, ...of(pose) }));
    const [collide, near] = [a.collideEach(b, numbers), a.withinEach(b, numbers, within)];
    same(
        "collide",
        each((k) => ({ collide: collide[k] === 1 })),
        ask("collide"),
    );
    same(
        "within",
        each((k) => ({ within: near[k] === 1 })),
        ask("within", "--within", within),
    );
    const [distances, contacts, relations] = [
        a.distanceEach(b, numbers),
        a.contactsEach(b, numbers),
        a.relationEach(b, numbers),
    ];
    same(
        "distance",
        each((k) => ofDistances(distances, k)),
        ask("distance"),
    );
    same(
        "contacts",
        each((k) => ({ contacts: contacts[k].length / 4, pairs: contactRows(contacts[k]) })),
        ask("contacts"),
    );
    same(
        "relation",
        each((k) => ({ relation: relations[k] })),
        ask("relation"),
    );
    a.free();
    b.free();
}

function motions(fileA, fileB, ways, limit, clearance) {
    const [a, b, rows] = [meshOf(fileA), meshOf(fileB), rowsOf(ways, limit)];
    const of = (from) => Float64Array.from(rows.flatMap((row) => row.slice(from, from + 12)));
    const found = a.motionEach(b, Motion.between(of(0), of(12)), { clearance });
    const free = a.isFreeEach(b, Motion.between(of(0), of(12)), { clearance });
    const record = (_, motion) => {
        const kind = found.kind[motion];
        equal(free[motion], Number(kind === MotionKind.FREE));
        const answer = MotionKind[kind].toLowerCase();
        if (kind === MotionKind.FREE) {
            return { motion, answer };
        }
        const at = kind === MotionKind.HIT ? "touching_at" : "at";
        return {
            motion,
            answer,
            free_until: found.freeUntil[motion],
            [at]: found.at[motion],
            ...ofDistances(found.nearest, motion),
        };
    };
    same("motion", rows.map(record), command("motion", fileA, fileB, ways, "--limit", limit, "--clearance", clearance));
    a.free();
    b.free();
}

function probes(file, points, rays, segments, limit) {
    const mesh = meshOf(file);
    const ask = (mode, probes) => command("probe", file, probes, "--mode", mode, "--limit", limit);
    const row = (answer, k, name) => ({
        [name]: answer[name][k],
        lower: answer.lower[k],
        upper: answer.upper[k],
        point: [...answer.point.subarray(3 * k, 3 * k + 3)],
        object: answer.object[k],
        triangle: answer.triangle[k],
    });
    const at = rowsOf(points, limit);
    const [closest, sides] = [mesh.closestPoints(at.flat()), mesh.sides(at.flat())];
    same(
        "closest",
        at.map((_, probe) => ({ probe, ...row(closest, probe, "distance") })),
        ask("closest", points),
    );
    same(
        "side",
        at.map((_, probe) => ({ probe, side: sides[probe] })),
        ask("side", points),
    );
    const halves = (rows) => [0, 3].map((from) => rows.flatMap((row) => row.slice(from, from + 3)));
    const [rayRows, segmentRows] = [rowsOf(rays, limit), rowsOf(segments, limit)];
    const [hits, meets] = [mesh.firstHits(...halves(rayRows)), mesh.segmentHits(...halves(segmentRows))];
    const hit = (k) => (hits.found[k] === 1 ? { hit: true, ...row(hits, k, "t") } : { hit: false });
    same(
        "ray",
        rayRows.map((_, probe) => ({ probe, ...hit(probe) })),
        ask("ray", rays),
    );
    same(
        "segment",
        segmentRows.map((_, probe) => ({ probe, meets: meets[probe] === 1 })),
        ask("segment", segments),
    );
    mesh.free();
}

/** Reads a scene in words as the contract of the command has it, and asks it frame by frame. */
function scenes(file, frames, limit, within) {
    const [meshes, scene, moving] = [new Map(), new Scene(), []];
    for (const line of readFileSync(file, "utf8").split("\n")) {
        const [word, ...fields] = line.split("#")[0].trim().split(/\s+/);
        if (word === "mesh") {
            meshes.set(fields[0], meshOf(path.resolve(path.dirname(file), fields[1])));
        } else if (word === "instance") {
            scene.add(meshes.get(fields[1]), fields.slice(2, 14).map(Number), { name: fields[0] });
        } else if (word === "moving") {
            moving.push(...fields);
        } else if (word === "allow") {
            scene.setAllowed(fields[0], fields[1]);
        }
    }
    // Questions are about pairs of which one moves.
    for (const id of scene.instances()) {
        const moves = moving.includes(scene.name(id));
        scene.setGroups(id, moves ? { member: 2, meets: 3 } : { member: 1, meets: 2 });
    }
    const rows = rowsOf(frames, limit);
    const named = (pairs) =>
        Array.from({ length: pairs.length / 2 }, (_, k) => ({
            a: scene.name(pairs[2 * k]),
            b: scene.name(pairs[2 * k + 1]),
        }));
    const found = { collide: [], pairs: [], distance: [], within: [] };
    rows.forEach((row, frame) => {
        scene.setPoses(moving, row);
        found.collide.push({ frame, collide: scene.collide() });
        found.pairs.push({ frame, pairs: named(scene.pairsInContact()) });
        found.within.push({ frame, pairs: named(scene.pairsWithin(within)) });
        const { a, b, nearest } = scene.distance();
        const answer = ofDistances(scene.distances([a, b]), 0);
        equal([nearest.distance, nearest.pointA, nearest.pointB], [answer.distance, answer.point_a, answer.point_b]);
        // The command prints points in the world.
        const world = scene.poses([a]);
        const place = ([x, y, z]) =>
            [0, 4, 8].map((k) => world[k] * x + world[k + 1] * y + world[k + 2] * z + world[k + 3]);
        answer.point_a = place(answer.point_a);
        answer.point_b = place(answer.point_b);
        found.distance.push({ frame, a: scene.name(a), b: scene.name(b), ...answer });
    });
    for (const mode of Object.keys(found)) {
        const distance = mode === "within" ? ["--within", within] : [];
        same(`scene ${mode}`, found[mode], command("scene", file, frames, "--mode", mode, "--limit", limit, ...distance));
    }
    scene.free();
    meshes.forEach((mesh) => mesh.free());
}

/** Twelve numbers: a random rotation, of a quaternion, and a translation. */
function somewhere(source, reach, offset) {
    const quaternion = source.numbers(4, -1, 1);
    const length = Math.hypot(...quaternion);
    return cbvh.pose(
        offset.map((x) => x + source.from(-reach, reach)),
        quaternion.map((x) => x / length),
    );
}

test("questions about the bundled meshes have the bits of the command", { skip: WITHOUT }, () => {
    const [source, offset] = [random(7), [300, -1600, -500]];
    const meshes = [path.join(TESTDATA, "fclenv.obj"), path.join(TESTDATA, "fclrob.obj")];
    const poses = write(
        "poses.txt",
        Array.from({ length: 200 }, () => somewhere(source, 1200, offset)),
    );
    for (const triangles of ["f32", "packed"]) {
        pairs(...meshes, poses, 200, 200, [["triangles", triangles]]);
    }
    const ways = Array.from({ length: 40 }, () => [...somewhere(source, 1200, offset), ...somewhere(source, 1200, offset)]);
    for (const clearance of [0, 3]) {
        motions(...meshes, write("motions.txt", ways), 40, clearance);
    }
    const triple = (reach) => [...source.numbers(3, -reach, reach)];
    const points = Array.from({ length: 200 }, () => triple(60));
    const rays = points.map((point) => [...point, ...triple(1)]);
    const segments = points.map((point, k) => [...point, ...points[199 - k]]);
    probes(meshes[1], write("p.txt", points), write("r.txt", rays), write("s.txt", segments), 200);
    // Neither of these meshes is closed: points are inside and outside a cube.
    const cube = path.join(folder, "cube.obj");
    const corners = Array.from({ length: 8 }, (_, k) => `v ${k & 1} ${(k >> 1) & 1} ${k >> 2}`);
    const faces = ["1 3 4 2", "5 6 8 7", "1 2 6 5", "3 7 8 4", "1 5 7 3", "2 4 8 6"].map((face) => `f ${face}`);
    writeFileSync(cube, [...corners, ...faces, ""].join("\n"));
    const near = (rows) => rows.map((row) => row.map((x) => x / 50));
    probes(cube, write("p.txt", near(points)), write("r.txt", near(rays)), write("s.txt", near(segments)), 200);
    const worlds = Array.from({ length: 20 }, () => [0, 1, 2].map(() => [...somewhere(source, 1200, offset)].join(" ")));
    const lines = [`mesh a ${meshes[0]}`, `mesh b ${meshes[1]}`, `instance wall a ${cbvh.IDENTITY.join(" ")}`];
    worlds[0].forEach((world, k) => lines.push(`instance robot${k} b ${world}`));
    lines.push("moving robot0 robot1 robot2", "allow robot0 robot1", "");
    writeFileSync(path.join(folder, "cell.scene"), lines.join("\n"));
    scenes(path.join(folder, "cell.scene"), write("frames.txt", worlds), 20, 400);
    for (const [mode, answers] of seen) {
        ok(answers.size > 1, `${mode}: several answers, found one to all`);
    }
    console.log(`${compared} answers have the bits of the command`);
});

test("a bake has the bytes of the command's", { skip: WITHOUT }, () => {
    const content = (file) =>
        JSON.parse(execFileSync(COMMAND, ["dump", file, "--json"], { encoding: "utf8" })).content_xxh3;
    for (const name of ["fclenv.obj", "fclrob.obj", "robot/link.obj"]) {
        for (const triangles of ["f32", "packed", "quantized"]) {
            const [own, its] = ["own.cbvh", "its.cbvh"].map((file) => path.join(folder, file));
            writeFileSync(own, meshOf(path.join(TESTDATA, name), { triangles }).bytes());
            execFileSync(COMMAND, ["validate", own]);
            execFileSync(COMMAND, ["verify", own, path.join(TESTDATA, name)]);
            execFileSync(COMMAND, [
                "bake",
                path.join(TESTDATA, name),
                "-o",
                its,
                "--triangles",
                triangles,
                "--force",
                "-q",
            ]);
            ok(content(own) !== undefined, "a checksum of the content");
            equal(content(own), content(its), name);
        }
    }
});

const LACKS = WITHOUT || (!existsSync(SHARED) && "there is no folder shared beside the checkout");

test("questions about larger meshes have the bits of the command", { skip: LACKS }, () => {
    const mesh = (name) => path.join(SHARED, "meshes", name);
    for (const line of readFileSync(path.join(SHARED, "poses", "pairs.txt"), "utf8")
        .trim()
        .split("\n")) {
        const [pair, a, b] = line.split(/\s+/);
        // The others take seconds to bake each time.
        if (["fcl", "bunny", "nao"].includes(pair)) {
            for (const kind of ["d0.5", "d0pen", "overlap"]) {
                pairs(mesh(a), mesh(b), path.join(SHARED, "poses", `${pair}_${kind}.txt`), 25, 0.05);
            }
        }
    }
    for (const kind of ["short", "spin"]) {
        const ways = (pair) => path.join(SHARED, "motions", `${pair}_${kind}.txt`);
        motions(mesh("fclenv.obj"), mesh("fclrob.obj"), ways("fcl"), 10, 0);
        motions(mesh("bunny.obj"), mesh("bunny.obj"), ways("bunny"), 10, 0);
    }
    const probe = (kind) => path.join(SHARED, "probes", `bunny_${kind}.txt`);
    probes(mesh("bunny.obj"), probe("points"), probe("rays"), probe("segments"), 100);
    scenes(path.join(SHARED, "scenes", "arm.scene"), path.join(SHARED, "scenes", "arm_frames.txt"), 10, 0.05);
    console.log(`${compared} answers have the bits of the command`);
});
