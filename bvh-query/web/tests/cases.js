/** Tests of the package that run in Node, in a page and in a worker. Each gets the package, and a function that reads files. */

import { equal, ok, random, refused } from "./expect.js";
import { writers } from "./formats.js";

const CUBE = Float64Array.from({ length: 24 }, (_, k) =>
    (k % 3 === 0 ? k / 3 : k % 3 === 1 ? k / 6 : k / 12) & 1 ? 1 : -1,
);
const CUBE_FACES = [
    0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6, 0, 1, 5, 0, 5, 4, 2, 6, 7, 2, 7, 3, 0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5,
];

const at = (x, y, z) => [1, 0, 0, x, 0, 1, 0, y, 0, 0, 1, z];
const cubeOf = (cbvh) => cbvh.Mesh.bake(CUBE, CUBE_FACES);
/** That cube and another one beyond its right side in one object, which is closed but not convex. */
const pairOf = (cbvh) =>
    cbvh.Mesh.bake(
        [...CUBE, ...CUBE.map((x, k) => (k % 3 === 0 ? x + 2.5 : x))],
        [...CUBE_FACES, ...CUBE_FACES.map((corner) => corner + 8)],
    );

/** A random rotation, of a quaternion, and a translation. */
function somewhere(cbvh, source, reach, count = 1) {
    const quaternions = source.numbers(4 * count, -1, 1);
    for (let k = 0; k < quaternions.length; k += 4) {
        const length = Math.hypot(...quaternions.subarray(k, k + 4));
        quaternions.subarray(k, k + 4).forEach((number, axis) => (quaternions[k + axis] = number / length));
    }
    return cbvh.pose(source.numbers(3 * count, -reach, reach), quaternions);
}

/** Asks everything about two meshes: whatever they hold, and whatever the numbers, with an answer or an error. */
function questions(cbvh, a, b, pose, [x, y, z, w, v, u]) {
    const { Motion, Scene } = cbvh;
    const scene = (work) => {
        const made = new Scene();
        try {
            made.add(a, null, { name: "a" });
            made.add(b, pose, { name: "b" });
            return work(made);
        } finally {
            made.free();
        }
    };
    const screw = () => Motion.screw(at(0, 0, 0), [x, y, z], [u, v, w], x, y);
    return [
        () => a.collide(b, pose),
        () => a.within(b, pose, x),
        () => a.distance(b, pose),
        () => a.distance(b, pose, { relErr: x, absErr: y }),
        () => a.relation(b, pose),
        () => a.contacts(b, pose),
        () => a.contactRegions(b, pose),
        () => a.patches(b, pose, { tolerance: x, maxContacts: 1000, maxPoints: 4 }),
        () => a.separation(b, pose, [x, y, z]),
        () => a.penetration(b, pose, { relativeGap: x, tolerance: y }),
        () => a.signedDistance(b, pose, { relativeGap: x, tolerance: y }),
        () => a.clash(b, pose, { clearance: x, tolerance: y, relativeGap: z, visits: 1000, magnitudes: true }),
        () => [a.intersection(b, pose), a.intersectionSurface(b, pose)],
        () => a.selfContacts(),
        () => a.openEdges(),
        () => a.motion(b, Motion.between(at(x, y, z), pose), { clearance: w, tolerance: v }),
        () => a.isFree(b, screw()),
        () => a.motion(b, Motion.through([...pose, ...at(u, v, w)])),
        () => a.closestPoints([x, y, z], { within: w, pose }),
        () => a.sides([x, y, z]),
        () => a.signedPointDistances([x, y, z, u, v, w]),
        () => a.firstHits([x, y, z], [u, v, w], { until: x }),
        () => a.anyHits([x, y, z], [u, v, w]),
        () => a.allHits([x, y, z], [u, v, w], { pose }),
        () => a.segmentHits([x, y, z], [u, v, w]),
        () => a.triangles(),
        () => a.validate(),
        () => cbvh.nearestPose(pose),
        () => scene((made) => [made.collide(), made.pairsInContact(), made.pairsWithin(x), made.within(y)]),
        () => scene((made) => [made.signedDistance({ relativeGap: x, tolerance: y })]),
        () => scene((made) => [made.distance(), made.relations(), made.contacts(), made.distances(["a", "b"])]),
        () => scene((made) => made.clashes({ clearance: x, tolerance: y })),
        () => scene((made) => made.motion(new Map([["b", screw()]]), { clearance: x })),
        () => scene((made) => [made.closestPoints([x, y, z]), made.sides([x, y, z]), made.allHits([x, y, z], [u, v, w])]),
    ];
}

/** Asks, and returns how many questions were refused; a trap would end the module. */
function refusals(work) {
    let count = 0;
    for (const question of work) {
        try {
            question();
        } catch (error) {
            refused(() => {
                throw error;
            });
            count++;
        }
    }
    return count;
}

export const cases = {
    "a baked cube answers every question about pairs": (cbvh) => {
        const { Relation } = cbvh;
        const cube = cubeOf(cbvh);
        equal(cube.triangleCount, 12);
        equal(cube.bounds, [-1, -1, -1, 1, 1, 1]);
        equal([cube.collide(cube, at(2, 0, 0)), cube.collide(cube, at(2.5, 0, 0))], [true, false]);
        equal(cube.collideEach(cube, [...at(2, 0, 0), ...at(3, 0, 0)]), [1, 0]);
        equal(cube.collideEach(cube, []), []);
        equal([cube.within(cube, at(2.5, 0, 0), 0.5), cube.within(cube, at(2.5, 0, 0), 0.49)], [true, false]);
        const answer = cube.distance(cube, at(2.5, 0, 0));
        equal([answer.distance, answer.pointA[0], answer.pointB[0]], [0.5, 1, 1.5]);
        ok(answer.lower <= 0.5 && 0.5 <= answer.upper, "bounds around the distance");
        const both = cube.distanceEach(cube, [...at(2.5, 0, 0), ...at(0, 0, 4)]);
        equal([both.distance, both.pointA.length], [[0.5, 2], 6]);
        const loose = cube.distance(cube, at(2.5, 0, 0), { relErr: 0.5 });
        ok(loose.distance >= 0.5 && loose.distance <= 0.75, "a distance within the allowed error");
        equal(Relation[cube.relation(cube, at(9, 0, 0))], "APART");
        equal(Relation[cube.relation(cube, at(1, 0, 0))], "TOUCHING");
        const small = cbvh.Mesh.bake(
            CUBE.map((x) => x / 4),
            CUBE_FACES,
        );
        equal(cube.relation(small, cbvh.IDENTITY), Relation.B_IN_A);
        const contacts = cube.contacts(cube, at(2, 2, 2));
        ok(contacts.length > 0 && contacts.length % 4 === 0, "rows of four");
        equal(cube.contactsEach(cube, [...at(2, 2, 2), ...at(9, 0, 0)]), [contacts, []]);
    },

    "cubes overlap where and as deep as they do": (cbvh) => {
        const { RegionKind, Relation, SelfContactKind } = cbvh;
        const cube = cubeOf(cbvh);
        const near = (found, expected, error, what) =>
            ok(Math.abs(found - expected) <= error, `${what}: ${expected}, found ${found}`);
        // What they have in common is a box with the sides 1/2, 7/4 and 15/8.
        const corner = at(1.5, 0.25, 0.125);
        const moved = (by) => at(1.5 + by[0], 0.25 + by[1], 0.125 + by[2]);
        const depth = cube.penetration(cube, corner);
        ok(depth.lower <= 0.5 && depth.lower > 0.49 && depth.upper >= 0.5 && depth.upper < 0.505, "bounds around the depth");
        equal(cube.relation(cube, moved(depth.translation)), Relation.APART);
        equal(depth.radii, [0, 0]);
        const searched = cube.penetration(pairOf(cbvh), corner);
        ok(searched.lower > 0.25 && searched.lower <= 0.5 && searched.upper >= 0.5 && searched.upper < 0.505, "a search");
        near(searched.radii[0] + searched.radii[1], searched.lower, 1e-6, "radii");
        equal(cube.penetration(cube, at(9, 0, 0)).upper, 0);
        ok(cube.penetration(cube, corner, { tolerance: 0.01 }).lower > 0.01, "deeper than the tolerance");
        const both = cube.penetrationEach(cube, [...corner, ...at(9, 0, 0)]);
        equal([both.upper, both.point.length, both.radii.length], [[depth.upper, 0], 6, 4]);
        const up = cube.separation(cube, corner, [0, 0, 7]);
        near(up.upper, 1.875, 1e-9, "the way up");
        near(up.lower, up.upper, 1e-9, "both bounds");
        equal([up.translation[0], up.translation[1]], [0, 0]);
        equal(cube.relation(cube, moved(up.translation)), Relation.APART);
        const ways = cube.separationEach(cube, [...corner, ...at(9, 0, 0)], [-1, 0, 0, 1, 0, 0]);
        near(ways.upper[0], 3.5, 1e-9, "the way back");
        equal([ways.upper[1], ways.translation.length], [0, 6]);

        const regions = cube.contactRegions(cube, corner);
        equal(regions.triangles, cube.contacts(cube, corner));
        const count = regions.total;
        equal([regions.kind.length, regions.points.length, regions.normalA.length], [count, 18 * count, 3 * count]);
        regions.kind.forEach((kind, k) => {
            ok(kind === RegionKind.POINT || kind === RegionKind.SEGMENT, "faces that cross");
            for (let place = 18 * k; place < 18 * k + 3 * regions.count[k]; place += 3) {
                const point = [...regions.points.subarray(place, place + 3)];
                near(Math.max(...point.map(Math.abs)), 1, 1e-12, "on the first surface");
                const from = [1.5, 0.25, 0.125];
                near(Math.max(...point.map((x, axis) => Math.abs(x - from[axis]))), 1, 1e-12, "on the second surface");
            }
        });
        const few = cube.contactRegions(cube, corner, { limit: 3 });
        equal([few.kind.length, few.total], [3, count]);
        // The curve is six edges of the box, and faces that touch have an area.
        const patches = cube.patches(cube, corner);
        equal([patches.first, patches.count, patches.regions.total], [[0], [count], count]);
        near(patches.length[0], 2 * (0.5 + 1.75 + 1.875), 1e-9, "the length");
        ok(patches.depth[0] > 0.5 && patches.normal[0] > 0.9, "a direction and a depth");
        const face = cube.patches(cube, at(2, 0.5, 0));
        near(face.area[0], 3, 1e-9, "the area");
        equal([face.normal, face.count.length, face.regions.kind.includes(RegionKind.POLYGON)], [[1, 0, 0], 1, true]);
        equal(cube.patches(cube, corner, { maxContacts: 3 }).regions.kind.length, 3);
        equal(cube.patches(cube, at(9, 0, 0)).first, []);
        // The sides of the cube are 2: it is 0.25 deep in a floor, with four corners.
        const floor = cbvh.box([20, 20, 2]);
        const pressed = floor.patches(cube, at(0.5, 0.25, 1.75), { maxPoints: 4 });
        equal([pressed.firstPoint, pressed.pointCount, patches.pointCount, patches.points], [[0], [4], [0], []]);
        pressed.pointDepths.forEach((depth) => near(depth, 0.25, 1e-9, "the depth of a corner"));
        equal(pressed.pointNormals.length, 12);
        const rounded = Array.from(pressed.points, (v) => Math.round(1e6 * v) / 1e6);
        const places = [0, 3, 6, 9].map((k) => rounded.slice(k, k + 3)).sort((p, q) => p[0] - q[0] || p[1] - q[1]);
        equal(places, [
            [-0.5, -0.75, 0.875],
            [-0.5, 1.25, 0.875],
            [1.5, -0.75, 0.875],
            [1.5, 1.25, 0.875],
        ]);
        const margin = floor.rounded(0.5).patches(cube, at(0, 0, 2.25), { tolerance: 5, maxPoints: 1 });
        near(margin.pointDepths[0], -0.25, 1e-9, "minus the gap");

        equal([cube.openEdges().boundary, cube.openEdges().edges], [0, []]);
        // A tetrahedron whose last face has a corner of its own, a little off.
        const corners = [0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 1, 0, 1e-6];
        const faces = [0, 2, 1, 0, 1, 3, 0, 3, 2, 4, 2, 3];
        const open = cbvh.Mesh.bake(corners, faces).openEdges();
        equal([open.boundary, open.flipped, open.crowded, open.cracks, open.edges.length], [4, 0, 0, 4, 4]);
        equal([open.edges[0].kind, open.edges[3].triangles, open.proposedWeld], ["boundary", [3], 1e-5]);
        near(open.edges[0].gap, 1e-6, 1e-9, "the gap");
        ok(open.text.includes("bake with --weld 1e-5"), open.text);
        equal(cbvh.Mesh.bake(corners, faces, { weld: 1e-5 }).openEdges().boundary, 0);
        const hole = cbvh.Mesh.bake(corners, faces.slice(0, 9)).openEdges();
        equal([hole.boundary, hole.cracks, hole.proposedWeld], [3, 0, undefined]);

        equal(cube.selfContacts().triangles, []);
        const [first, crossing] = [
            [0, 0, 0, 1, 0, 0, 0, 1, 0],
            [0.2, 0.2, -1, 0.3, 0.2, -1, 0.2, 0.2, 1],
        ];
        const own = cbvh.Mesh.bake([...first, ...crossing, ...first]).selfContacts();
        equal(own.triangles, [0, 0, 0, 1, 0, 0, 0, 2, 0, 1, 0, 2]);
        equal(own.kind, [SelfContactKind.CROSSING, SelfContactKind.DUPLICATE, SelfContactKind.CROSSING]);
    },

    "a signed distance is a distance or minus a depth": (cbvh) => {
        const { box, cloud, Mesh, Relation } = cbvh;
        // A block passes through another one along x, from one side to the other: the number is a known function of the way.
        const [a, b] = [box([2, 4, 4]), box([1, 1, 1])];
        const way = Array.from({ length: 49 }, (_, step) => (step - 24) / 8);
        const all = a.signedDistanceEach(b, way.flatMap((x) => at(x, 0.25, 0)));
        equal([all.normal.length, all.pointA.length, all.pointB.length, all.translation.length], [147, 147, 147, 147]);
        const names = ["normal", "pointA", "pointB", "translation"];
        way.forEach((x, k) => {
            const [number, expected] = [a.signedDistance(b, at(x, 0.25, 0)), Math.abs(x) - 1.5];
            ok(number.lower <= expected && expected <= number.upper, `bounds around ${expected}`);
            ok(number.upper - number.lower < 1e-9, "bounds that are near each other");
            equal([number.isSigned, number.isSpent, all.isSigned[k], all.isSpent[k]], [true, false, 1, 0]);
            equal([number.lower, number.upper], [all.lower[k], all.upper[k]]);
            names.forEach((name) => equal(number[name], all[name].slice(3 * k, 3 * k + 3), name));
            ok(x === 0 || Math.abs(number.normal[0] - Math.sign(x)) < 1e-9, `a normal along x, found ${number.normal}`);
            const [dx, dy, dz] = number.translation;
            equal(a.relation(b, at(x + dx, 0.25 + dy, dz)) === Relation.APART, number.lower < 0 || expected > 0);
            const apart = number.normal.reduce((sum, n, axis) => sum + n * (number.pointB[axis] - number.pointA[axis]), 0);
            ok(Math.abs(apart - expected) < 1e-9, `points ${expected} apart along the normal, found ${apart}`);
        });
        // Two cubes in one mesh are not convex. The options are those of the depth.
        const [cube, pair] = [cubeOf(cbvh), pairOf(cbvh)];
        const deep = at(0.75, 0.25, 0.125);
        for (const options of [{}, { relativeGap: 100 }, { tolerance: 0.01 }]) {
            const [number, depth] = [cube.signedDistance(pair, deep, options), cube.penetration(pair, deep, options)];
            equal([number.lower, number.upper, number.translation], [-depth.upper, -depth.lower, depth.translation]);
        }
        const [number, distance] = [cube.signedDistance(pair, at(0, 9, 1)), cube.distance(pair, at(0, 9, 1))];
        equal([number.lower, number.upper, number.pointA], [distance.lower, distance.upper, distance.pointA]);
        // What has no inside has a distance only, and the answer says so; a radius gives an inside to a point.
        const open = Mesh.bake(CUBE, CUBE_FACES.slice(3));
        const [point, ball] = [cloud([0, 0, 0]), cloud([0, 0, 0], 0.5)];
        const cases = [
            [open, 4, 2, false],
            [open, 1.5, 0, false],
            [point, 2, 1, false],
            [point, 0.5, 0.5, false],
            [ball, 2, 0.5, true],
            [ball, 1.25, -0.25, true],
        ];
        for (const [other, x, expected, isSigned] of cases) {
            const { lower, upper, translation, ...found } = cube.signedDistance(other, at(x, 0, 0));
            ok(lower <= expected && expected <= upper && upper - lower < 1e-9, `bounds around ${expected}`);
            equal([found.isSigned, translation.every((by) => by === 0)], [isSigned, expected >= 0]);
        }
        equal(cube.signedDistanceEach(cube, []).isSigned, []);
    },

    "a scene has the least signed distance of its pairs": (cbvh) => {
        const { box, Mesh, Scene } = cbvh;
        const scene = new Scene();
        equal(scene.signedDistance(), undefined);
        // A block passes through a large one, and a third one is always 0.75 from that.
        const [large, small] = [box([2, 4, 4]), box([1, 1, 1])];
        const [a, b, c] = [scene.add(large), scene.add(small), scene.add(small, at(0, -3.25, 0))];
        for (let x = -3; x <= 3; x += 0.125) {
            scene.setPose(b, at(x, 0.25, 0));
            for (const options of [{}, { relativeGap: 1e-6 }, { tolerance: 0.25 }]) {
                const found = scene.signedDistance(options);
                const [{ lower, upper }, expected] = [found.nearest, Math.min(Math.abs(x) - 1.5, 0.75)];
                ok(lower <= expected && expected <= upper, `bounds around ${expected}, found ${lower} and ${upper}`);
                ok(Math.abs(x) === 2.25 || (found.a === a && found.b === (Math.abs(x) < 2.25 ? b : c)), `the pair at ${x}`);
                if (Math.abs(x) < 2.25) {
                    equal(found.nearest, large.signedDistance(small, at(x, 0.25, 0), options));
                }
            }
        }
        // What is not closed has no depth, and its number is 0 where it touches.
        scene.setPose(b, at(1, 0.25, 0));
        scene.setMesh(b, Mesh.bake(CUBE, CUBE_FACES.slice(3)));
        const { nearest, ...pair } = scene.signedDistance();
        equal([pair, nearest.lower, nearest.upper, nearest.isSigned], [{ a, b }, 0, 0, false]);
        // Of all pairs of other meshes it is the least.
        const places = [at(0, 0, 0), at(1.5, 0.25, 0), at(3.25, 0.125, 0.5), at(9, 0, 0), at(9, 0.5, 0.25)];
        const meshes = places.map((_, k) => (k % 2 ? pairOf(cbvh) : cubeOf(cbvh)));
        const other = new Scene();
        places.forEach((place, k) => other.add(meshes[k], place));
        const numbers = places.flatMap((to, j) =>
            places.slice(0, j).map((from, i) => meshes[i].signedDistance(meshes[j], cbvh.relative(from, to)).lower),
        );
        equal(other.signedDistance().nearest.lower, Math.min(...numbers));
        ok(Math.min(...numbers) < -0.5 && Math.max(...numbers) > 0.5, "pairs that overlap and others");
    },

    "parts clash as their gap and their depth say": (cbvh) => {
        const { ClashClass, Mesh, Relation, Scene } = cbvh;
        const [cube, same] = [cubeOf(cbvh), cubeOf(cbvh)];
        const small = Mesh.bake(CUBE.map((x) => x / 4), CUBE_FACES);
        const open = Mesh.bake(CUBE, CUBE_FACES.slice(3));
        const options = { clearance: 0.25, tolerance: 1e-3 };
        // The cube has sides of 2. Parts, where the second one is, and the class, the distance and the depth of the pair.
        const cases = [
            [cube, cube, [2.5, 0.25, 0.125], "APART", Infinity, undefined],
            [cube, cube, [2.125, 0.25, 0.125], "NEAR", 0.125, undefined],
            [cube, cube, [2, 0.25, 0.125], "TOUCHING", 0, 0],
            [cube, cube, [1.9375, 0.25, 0.125], "OVERLAPPING", 0, 0.0625],
            [cube, small, [0.5, 0, 0], "CONTAINED", 0, undefined],
            [small, cube, [0.5, 0, 0], "CONTAINED", 0, undefined],
            [cube, same, [1e-4, 0, 0], "DUPLICATED", 0, undefined],
            [cube, open, [1.5, 0.25, 0.125], "INTERSECTING", 0, undefined],
        ];
        for (const [a, b, place, name, distance, known] of cases) {
            const found = a.clash(b, at(...place), options);
            equal([ClashClass[found.kind], found.distance, found.depth === undefined], [name, distance, known === undefined], name);
            equal(found.relation, a.relation(b, at(...place)));
            const [least, most] = [found.depth?.lower ?? 0, found.depth?.upper ?? 0];
            ok(least <= (known ?? 0) && (known ?? 0) <= most && most <= 1.1 * least + 1e-6, `${name}: the depth ${known}`);
            if (found.depth !== undefined) {
                equal(found.depth.isSpent, false);
            }
            if (distance === 0) {
                const where = [...found.point];
                ok(where.every((x) => Math.abs(x) <= 1 + 1e-9), `${name}: a point of the cube, found ${where}`);
            } else {
                equal([...found.point], name === "NEAR" ? [1.0625, found.point[1], found.point[2]] : [0, 0, 0]);
            }
        }
        // Each of many is what it is alone.
        const several = cases.filter(([a, b]) => a === cube && b === cube);
        const each = cube.clashEach(cube, several.flatMap(([, , place]) => at(...place)), options);
        equal([...each.kind].map((kind) => ClashClass[kind]), several.map(([, , , name]) => name));
        equal([each.distance, each.point.length, each.depth.translation.length, each.depth.isSpent], [[Infinity, 0.125, 0, 0], 12, 12, [0, 0, 0, 0]]);
        equal([...each.depth.upper].map(Number.isNaN), [true, true, false, false]);
        equal(each.depth.upper[3], cube.clash(cube, at(1.9375, 0.25, 0.125), options).depth.upper);
        // Without visits, the depth of what is not convex stays unknown.
        const spent = cube.clash(pairOf(cbvh), at(1.9375, 0.25, 0.125), { ...options, visits: 200 });
        equal([ClashClass[spent.kind], spent.depth.isSpent], ["UNDECIDED", true]);
        ok(spent.depth.lower <= 0.0625 && spent.depth.upper >= 0.0625, "bounds around the depth");
        const gap = cube.clash(cube, at(2 + 2 ** -10, 0.25, 0.125), options);
        equal([ClashClass[gap.kind], gap.distance, gap.depth.lower, gap.depth.upper], ["TOUCHING", 2 ** -10, 0, 0]);
        // By default nothing is near, and the tolerance is 2e-6.
        equal(cube.clash(cube, at(2.125, 0, 0)).kind, ClashClass.APART);
        equal(cube.clash(cube, at(2 - 1e-6, 0.25, 0.125)).kind, ClashClass.TOUCHING);
        equal(cube.clash(cube, at(2 + 1e-6, 0.25, 0.125)).kind, ClashClass.TOUCHING);
        equal(cube.clash(cube, at(2 - 4e-6, 0.25, 0.125)).kind, ClashClass.OVERLAPPING);

        const scene = new Scene();
        const places = [at(0, 0, 0), at(1.5, 0.25, 0), at(3.5, 0.125, 0.5), at(6, 0, 0), at(6, 0, 0)];
        places.forEach((place) => scene.add(cube, place));
        const clashes = scene.clashes({ clearance: 0.75, tolerance: 1e-6 });
        equal(clashes.pairs, [0, 1, 1, 2, 2, 3, 2, 4, 3, 4]);
        equal([...clashes.clash.kind].map((kind) => ClashClass[kind]), ["OVERLAPPING", "TOUCHING", "NEAR", "NEAR", "DUPLICATED"]);
        equal([...clashes.clash.distance], [0, 0, 0.5, 0.5, 0]);
        const alone = cube.clash(cube, cbvh.relative(places[0], places[1]), { clearance: 0.75, tolerance: 1e-6 });
        equal([clashes.clash.depth.upper[0], clashes.clash.point.subarray(0, 3)], [alone.depth.upper, alone.point]);
        equal(scene.clashes().clash.relation, [Relation.TOUCHING, Relation.TOUCHING, Relation.TOUCHING]);
        equal(new Scene().clashes(), { pairs: [], clash: cube.clashEach(cube, []) });
    },

    "boxes have known volumes in common": (cbvh) => {
        const { box, ClashClass, Mesh, Scene } = cbvh;
        const [a, b] = [box([2, 4, 4]), box([1, 3, 1])];
        const way = [-3, -1.5, -1.25, -0.75, 0, 0.375, 1.375, 2];
        const poses = way.flatMap((x) => at(x, 0.25, 2));
        const all = a.intersectionEach(b, poses);
        const volumeOf = ({ points, loops }) => {
            // By the divergence theorem: cones over fans of all loops.
            let [sum, first] = [0, 0];
            const corner = (place) => points.subarray(3 * place, 3 * place + 3);
            for (const count of loops) {
                for (let k = 1; k + 1 < count; k++) {
                    const [p, q, r] = [first, first + k, first + k + 1].map(corner);
                    sum += p[0] * (q[1] * r[2] - q[2] * r[1]) + p[1] * (q[2] * r[0] - q[0] * r[2]) + p[2] * (q[0] * r[1] - q[1] * r[0]);
                }
                first += count;
            }
            return sum / 6;
        };
        way.forEach((x, k) => {
            const [lo, hi] = [Math.max(-1, x - 0.5), Math.min(1, x + 0.5)];
            const side = Math.max(hi - lo, 0);
            const found = a.intersection(b, at(x, 0.25, 2));
            ok(Math.abs(found.volume - side * 1.5) <= found.volumeError && found.volumeError < 1e-11, `the volume at ${x}`);
            const area = side > 0 ? 2 * (side * 3 + side * 0.5 + 1.5) : 0;
            ok(Math.abs(found.areaA + found.areaB - area) < 1e-12, `the area at ${x}`);
            equal(found.bounds, side > 0 ? [lo, -1.25, 1.5, hi, 1.75, 2] : undefined);
            equal([found.piercedA, found.piercedB], [undefined, undefined]);
            equal([all.volume[k], all.volumeError[k], all.areaA[k], all.areaB[k]], [found.volume, found.volumeError, found.areaA, found.areaB]);
            equal(Number.isNaN(all.bounds[6 * k]), side === 0);
            const surface = a.intersectionSurface(b, at(x, 0.25, 2));
            ok(Math.abs(volumeOf(surface) - side * 1.5) < 1e-12, `the surface at ${x}`);
            equal(surface.loops.reduce((sum, count) => sum + count, 0), surface.points.length / 3);
            equal(surface.polygons.reduce((sum, count) => sum + count, 0), surface.loops.length);
        });
        equal([all.bounds.length, all.piercedA.length, a.intersectionEach(b, []).volume], [48, 8, []]);
        // A rod through a plate pierces it by its thickness, and one that sticks in it does not.
        const [plate, rod] = [box([4, 3, 0.25]), box([0.5, 0.5, 2])];
        for (const [z, name, volume, pierced] of [[0.25, "PIERCING", 0.0625, 0.25], [1.0625, "PROTRUDING", 0.015625, undefined]]) {
            const found = plate.clash(rod, at(1, 0.5, z), { magnitudes: true });
            equal([ClashClass[found.kind], found.magnitudes.piercedA, found.magnitudes.piercedB], [name, pierced, undefined]);
            ok(Math.abs(found.magnitudes.volume - volume) < 1e-14, `a volume of ${volume}`);
            equal(found.magnitudes, plate.intersection(rod, at(1, 0.5, z)));
            equal(rod.intersection(plate, at(-1, -0.5, -z)).piercedB, pierced);
            equal([plate.clash(rod, at(1, 0.5, z)).kind, plate.clash(rod, at(1, 0.5, z)).magnitudes], [ClashClass.OVERLAPPING, undefined]);
        }
        // Of parts that are near, and of those that are not closed, there are none.
        const [cube, open] = [cubeOf(cbvh), Mesh.bake(CUBE, CUBE_FACES.slice(3))];
        equal(cube.clash(cube, at(2.125, 0.25, 0), { clearance: 0.25, magnitudes: true }).magnitudes, undefined);
        equal(cube.clash(open, at(1.5, 0.25, 0.125), { magnitudes: true }).magnitudes, undefined);
        // In a scene, boxes are in the world.
        const scene = new Scene();
        scene.add(plate, at(10, 0, 0));
        scene.add(rod, at(11, 0.5, 0.25));
        const { pairs, clash } = scene.clashes({ magnitudes: true });
        equal([pairs, [...clash.kind], clash.magnitudes.piercedA], [[0, 1], [ClashClass.PIERCING], [0.25]]);
        equal(clash.magnitudes.bounds, [10.75, 0.25, -0.125, 11.25, 0.75, 0.125]);
        equal(scene.clashes().clash.magnitudes, undefined);
    },

    "a baked cube answers every question about motions": (cbvh) => {
        const { Motion, MotionKind } = cbvh;
        const cube = cubeOf(cbvh);
        const through = Motion.between(at(5, 0, 0), at(-5, 0, 0));
        const hit = cube.motion(cube, through);
        equal(MotionKind[hit.kind], "HIT");
        ok(hit.freeUntil <= 0.3 && hit.at >= 0.3 - 1e-9 && hit.at < 0.3001, `a hit at 0.3, found ${hit.at}`);
        equal(hit.nearest.distance, 0);
        const past = Motion.between(at(5, 3, 0), at(-5, 3, 0));
        equal(cube.motion(cube, past), { kind: MotionKind.FREE, freeUntil: 1, at: NaN, nearest: undefined });
        equal([cube.isFree(cube, past), cube.isFree(cube, past, { clearance: 1 })], [true, false]);
        const many = Motion.between([...at(5, 0, 0), ...at(5, 3, 0)], [...at(-5, 0, 0), ...at(-5, 3, 0)]);
        equal([many.count, cube.isFreeEach(cube, many)], [2, [0, 1]]);
        const answers = cube.motionEach(cube, many);
        equal([answers.kind, answers.at[0], answers.nearest.distance], [[1, 0], hit.at, [0, NaN]]);
        equal(past.poses([0, 0.5, 1]), [...at(5, 3, 0), ...at(0, 3, 0), ...at(-5, 3, 0)]);
        equal(cube.isFree(cube, Motion.screw(at(5, 0, 0), [0, 0, 0], [0, 0, 1], 2 * Math.PI)), true);
        const round = Motion.through([...at(5, 0, 0), ...at(5, 5, 0), ...at(-5, 5, 0), ...at(-5, 0, 0)]);
        equal([cube.isFree(cube, round), round.poses([1])], [true, at(-5, 0, 0)]);
    },

    "a baked cube answers every question about points, rays and segments": (cbvh) => {
        const cube = cubeOf(cbvh);
        const closest = cube.closestPoints([3, 0, 0, 0, 0, 9], { within: 4 });
        equal(
            [closest.found, closest.distance, closest.point.subarray(0, 3)],
            [
                [1, 0],
                [2, NaN],
                [1, 0, 0],
            ],
        );
        equal(cube.sides([0, 0, 0, 1, 0, 0, 3, 0, 0]), [1, 0, -1]);
        equal(cube.sides([0, 0, 0], { pose: at(5, 0, 0) }), [-1]);
        equal(cube.signedPointDistances([0, 0, 0.5, 3, 0, 0]), [-0.5, 2]);
        const hits = cube.firstHits([-5, 0.1, 0.2, -5, 7, 0], [2, 0, 0, 2, 0, 0]);
        equal(
            [hits.found, hits.t],
            [
                [1, 0],
                [2, NaN],
            ],
        );
        equal(cube.anyHits([-5, 0.1, 0.2, -5, 7, 0], [2, 0, 0, 2, 0, 0]), [1, 0]);
        equal(cube.anyHits([-5, 0.1, 0.2, -5, 0, 0.1], [2, 0, 0, 2, 0, 0], { until: [1.9, 2] }), [0, 1]);
        const all = cube.allHits([-5, 0.1, 0.2], [2, 0, 0]);
        equal([all.length, all[0].t], [1, [2, 3]]);
        equal(cube.segmentHits([-5, 0.1, 0.2, 0, 0, 0], [0, 0.1, 0.2, 0.5, 0.5, 0.5]), [1, 0]);
        equal(cube.visible([-5, 0.1, 0.2, 0, 0, 0], [0, 0.1, 0.2, 0.5, 0.5, 0.5]), [0, 1]);
        equal(cube.visible([-5, 0.1, 0.2], [0, 0.1, 0.2], { margin: 2.5 }), [1]);
        const open = cbvh.Mesh.bake([0, 0, 0, 1, 0, 0, 0, 1, 0]);
        equal([open.sides([0, 0, 1]), open.signedPointDistances([0, 0, 1])], [[2], [NaN]]);
    },

    "scenes hold instances and answer every question": (cbvh) => {
        const { Motion, MotionKind, Scene } = cbvh;
        const [cube, scene] = [cubeOf(cbvh), new Scene()];
        equal(scene.distance(), undefined);
        const [a, b] = [scene.add(cube, null, { name: "a" }), scene.add(cube, at(2.5, 0, 0))];
        cube.free();
        equal([a, b, scene.find("a"), scene.find("c"), scene.name(b)], [0, 1, 0, undefined, undefined]);
        equal([scene.collide(), scene.within(0.5), scene.pairsWithin(0.5)], [false, true, [0, 1]]);
        const nearest = scene.distance();
        equal([nearest.a, nearest.b, nearest.nearest.distance], [0, 1, 0.5]);
        scene.setPose(b, at(0, 0, 3));
        equal([scene.distance().nearest.distance, scene.poses(["a", 1])], [1, [...at(0, 0, 0), ...at(0, 0, 3)]]);
        scene.setPoses(["a", b], [...at(0, 0, 1), ...at(0, 0, 2)]);
        equal(
            [scene.pairsInContact(), scene.contacts().pairs.subarray(0, 2)],
            [
                [0, 1],
                [0, 1],
            ],
        );
        equal(scene.relations(), { pairs: [0, 1], relations: [0] });
        scene.setTracking(true);
        scene.setAllowed("a", b);
        equal([scene.collide(), scene.allowed()], [false, [0, 1]]);
        scene.setAllowed(b, "a", false);
        scene.setGroups(b, { meets: 2 });
        equal([scene.collide(), scene.groups(b)], [true, { member: 0xffff_ffff, meets: 2 }]);
        scene.setGroups("a", { member: 1 });
        equal(scene.collide(), false);
        scene.setGroups("a", { member: 2 });
        // A number is never given again.
        scene.remove(b);
        const [mesh, c] = [scene.mesh("a"), scene.add(scene.mesh("a"), at(4, 0, 1))];
        equal([c, scene.instances(), mesh.triangleCount], [2, [0, 2], 12]);
        equal(
            refused(() => scene.name(1)),
            "id: expected an instance of the scene, found 1; was it removed?",
        );
        equal(scene.distances([c, "a"]).distance, [2]);
        const free = scene.motion(new Map([[c, Motion.between(at(4, 0, 1), at(4, 9, 1))]]));
        equal(free, { kind: MotionKind.FREE, freeUntil: 1, at: NaN, pair: undefined });
        const ways = new Map([
            [c, Motion.between(at(4, 0, 1), at(0, 0, 1))],
            ["a", Motion.between(at(0, 0, 1), at(4, 0, 1))],
        ]);
        const hit = scene.motion(ways);
        equal([hit.kind, hit.pair.a, hit.pair.b, scene.isFree(ways)], [MotionKind.HIT, 0, 2, false]);
        ok(Math.abs(hit.at - 0.25) < 1e-4, `a hit at 0.25, found ${hit.at}`);
        const closest = scene.closestPoints([8, 0, 1, 90, 0, 0], { within: 5 });
        equal(
            [closest.instance, closest.closest.distance],
            [
                [2, -1],
                [3, NaN],
            ],
        );
        equal([scene.sides([4, 0, 1, 2, 0, 1]), scene.signedPointDistances([4, 0, 1.5])], [[1, -1], [-0.5]]);
        const rays = [
            [-9, 0.1, 1],
            [1, 0, 0],
        ];
        equal([scene.firstHits(...rays).instance, scene.firstHits(...rays).hit.t, scene.anyHits(...rays)], [[0], [8], [1]]);
        equal(
            scene.allHits(...rays).map((hits) => [hits.instance, hits.hit.t]),
            [
                [
                    [0, 0, 2, 2],
                    [8, 10, 12, 14],
                ],
            ],
        );
        equal(scene.segmentHits([2, 0, 1], [2, 0, 9]), [0]);
        equal(scene.visible([2, 0, 1], [2, 0, 9], { margin: 0.1 }), [1]);
    },

    "simple shapes are exact, and margins count in every question": (cbvh) => {
        const [two, three] = [cbvh.sphere(2), cbvh.sphere(3)];
        ok(two.collide(three, at(3, 4, 0)), "radii that add up to the distance");
        ok(!two.collide(cbvh.sphere(3 - 2 ** -50), at(3, 4, 0)), "radii that do not");
        equal(two.distance(three, at(0, 0, 7)).distance, 2);
        equal(two.radius, 2);
        equal([...two.sides([2, 0, 0, 1, 1, 1, 3, 0, 0])], [cbvh.Side.ON, cbvh.Side.INSIDE, cbvh.Side.OUTSIDE]);
        equal(two.anyHits([-5, 0, 0, -5, 2, 0, -5, 2.5, 0], [1, 0, 0, 1, 0, 0, 1, 0, 0]), [1, 1, 0]);
        const ends = two.allHits([-5, 0, 0], [1, 0, 0])[0].t;
        ok(ends.length === 2 && Math.abs(ends[0] - 3) < 1e-9 && Math.abs(ends[1] - 7) < 1e-9, "in and out");
        const pipe = cbvh.cylinder(1, 4);
        ok(Math.abs(pipe.distance(cbvh.sphere(0.5), at(3, 0, 0)).distance - 1.5) < 0.003, "a cylinder");
        equal([pipe.isSolid, pipe.collide(cbvh.sphere(0.1), at(0.2, 0, 1))], [true, true]);
        ok(cbvh.cylinder(1, 4, 0.1).triangleCount < pipe.triangleCount, "a coarser cylinder");
        ok(Math.abs(cbvh.cone(1, 2).distance(cbvh.sphere(0.5), at(0, 0, 4)).distance - 1.5) < 1e-6, "a cone");
        equal(cbvh.ground().distance(cbvh.sphere(0.5), at(40, -30, 2)).distance, 1.5);
        equal([...cbvh.ground([2, 4], 3).bounds], [-1, -2, -3, 1, 2, 0]);
        equal(cbvh.heightField([0, 0, 0, 0, 0, 1], 3, [1, 2]).triangleCount, 4);
        ok(/maxError/.test(refused(() => cbvh.cylinder(1, 1, 1e-12))), "errors");
        ok(/columns/.test(refused(() => cbvh.heightField([0, 0, 0, 0], 1.5, [1, 1]))), "columns");
        ok(/sides/.test(refused(() => cbvh.ground([1, Infinity]))), "endless grounds");
        const box = cbvh.box([2, 2, 2], 0.25);
        ok(box.isSolid && box.collide(cbvh.sphere(0), at(0.5, 0, 0)), "what is inside a solid");
        ok(!cubeOf(cbvh).collide(cbvh.sphere(0), at(0.5, 0, 0)), "what is inside a surface");
        equal(box.distance(cbvh.sphere(0), at(2, 0, 0)).distance, 1);
        equal(cbvh.capsule(0.5, 2).distance(cbvh.sphere(0.5), at(0, 0, 3)).distance, 1);
        const cloud = cbvh.cloud([0, 0, 0, 1, 0, 0, 1, 0, 0], 0.25);
        equal([...cloud.contacts(cbvh.sphere(0.25), at(1.5, 0, 0))].filter((_, k) => k % 4 === 1), [1, 2]);
        const scene = new cbvh.Scene();
        scene.add(two, null, { name: "two" });
        scene.add(three, at(0, 0, 6), { name: "three" });
        equal([scene.collide(), scene.distance().nearest.distance], [false, 1]);
        scene.setMargin("two", 0.25);
        scene.setPairMargin("three", "two", 0.5);
        equal([scene.margin("two"), scene.pairMargin(0, 1)], [0.25, 0.5]);
        equal([scene.distance().nearest.distance, scene.distances([0, 1]).distance[0]], [0.25, 0.25]);
        scene.setMargin("three", 0.25);
        equal([scene.collide(), [...scene.pairsInContact()]], [true, [0, 1]]);
        for (const wrong of [-1, NaN, Infinity]) {
            ok(/radius/.test(refused(() => two.rounded(wrong))), "radius");
            ok(/margin/.test(refused(() => scene.setMargin("two", wrong))), "margin");
            ok(/sides/.test(refused(() => cbvh.box([1, 1, wrong]))), "sides");
        }
        ok(/closed/.test(refused(() => cbvh.Mesh.bake([0, 0, 0, 1, 0, 0, 0, 1, 0]).solid())), "open");
    },

    "instances follow what they are attached to, and meshes are swapped": (cbvh) => {
        const [cube, scene] = [cubeOf(cbvh), new cbvh.Scene()];
        scene.add(cube, at(3, 0, 0), { name: "wall" });
        scene.add(cube, at(0, 3, 0), { name: "gripper" });
        scene.add(cube, null, { name: "part" });
        const way = cbvh.Motion.between(at(0, 3, 0), at(8, 3, 0));
        equal([scene.parent("part"), scene.isFree(new Map([["gripper", way]]))], [undefined, true]);
        scene.attach("part", "gripper");
        equal(scene.parent("part"), 1);
        const hit = scene.motion(new Map([["gripper", way]]));
        equal([hit.kind, hit.pair.a, hit.pair.b], [cbvh.MotionKind.HIT, 0, 2]);
        ok(/part|gripper/.test(refused(() => scene.attach("gripper", "part"))), "a cycle");
        ok(/itself|not move/.test(refused(() => scene.attach("part", "part"))), "itself");
        const source = random(6);
        for (let round = 0; round < 20; round++) {
            scene.setPose("gripper", somewhere(cbvh, source, 3));
            const byHand = new cbvh.Scene();
            const poses = scene.poses();
            for (let k = 0; k < 3; k++) {
                byHand.add(cube, poses.slice(12 * k, 12 * k + 12));
            }
            equal([...scene.contacts().triangles], [...byHand.contacts().triangles]);
            equal(scene.distance(), byHand.distance());
            byHand.free();
        }
        scene.setPose("gripper", at(0, 9, 0));
        ok([...scene.poses(["part"])].every((x, k) => Math.abs(x - at(0, 6, 0)[k]) < 1e-14), "it follows");
        scene.detach("part");
        scene.remove("gripper");
        scene.setPose("part", at(-1, 3, 0));
        scene.setMargin("wall", 0.25);
        equal([scene.collide(), scene.parent("part")], [false, undefined]);
        scene.setMesh("wall", cbvh.Mesh.bake(CUBE.map((x) => 4 * x), CUBE_FACES));
        equal([scene.collide(), scene.margin("wall"), scene.mesh("wall").triangleCount], [true, 0.25, 12]);
        ok(/mesh/.test(refused(() => scene.setMesh("wall", 5))), "no mesh");
        ok(/removed/.test(refused(() => scene.attach("wall", 1))), "no parent");
    },

    "poses come of quaternions, rounded matrices and pairs of poses": (cbvh) => {
        equal(cbvh.pose([1, 2, 3, 4, 5, 6]), [...at(1, 2, 3), ...at(4, 5, 6)]);
        equal(cbvh.pose([1, 2, 3], [0, 0, 1, 0]), [-1, 0, 0, 1, 0, -1, 0, 2, 0, 0, 1, 3]);
        equal(cbvh.relative(at(1, 0, 0), at(3, 0, 0)), at(2, 0, 0));
        const source = random(5);
        const rounded = Float64Array.from(somewhere(cbvh, source, 1), Math.fround);
        const cube = cubeOf(cbvh);
        cube.collide(cube, cbvh.nearestPose(rounded.map((x) => x * (1 + 1e-5))));
    },

    "files of four formats are the same mesh": async (cbvh, read) => {
        const robot = cbvh.Mesh.bakeFile("fclrob.obj", await read("testdata/fclrob.obj"), { round: "f32" });
        const triangles = robot.triangles();
        equal([robot.triangleCount, triangles.length, robot.names], [216, 9 * 216, [""]]);
        const stages = [];
        for (const [ending, write] of Object.entries(writers)) {
            const stl = write(triangles);
            const other = cbvh.Mesh.bakeFile(`Robot.${ending.toUpperCase()}`, stl, {
                onStage: (stage) => stages.push(stage),
            });
            equal(other.triangles(), triangles, ending);
            equal(cbvh.Mesh.bakeFile("dropped", stl.buffer.slice(0)).triangleCount, 216, ending);
            equal(robot.collide(other, cbvh.IDENTITY), true);
        }
        equal([stages.length, stages[0], stages.at(-1)], [16, "preparing", "proving bounds"]);
        ok(
            /^robot\.obj: line 2: /.test(
                refused(() => cbvh.Mesh.bakeFile("robot.obj", new TextEncoder().encode("v 1 2 3\nv 1 2 x\n"))),
            ),
            "the line",
        );
        ok(/^robot\.stl: /.test(refused(() => cbvh.Mesh.bakeFile("robot.stl", new Uint8Array(90)))), "the file");
        ok(
            /found an unsupported format, \.abc/.test(refused(() => cbvh.Mesh.bakeFile("robot.abc", new Uint8Array(9)))),
            "the format",
        );
        const outside = { asset: { version: "2.0" }, buffers: [{ byteLength: 36, uri: "beside.bin" }] };
        Object.assign(outside, {
            bufferViews: [{ buffer: 0, byteLength: 36 }],
            meshes: [{ primitives: [{ attributes: { POSITION: 0 } }] }],
        });
        Object.assign(outside, {
            accessors: [{ bufferView: 0, componentType: 5126, count: 3, type: "VEC3" }],
            nodes: [{ mesh: 0 }],
        });
        refused(() => cbvh.Mesh.bakeFile("outside.gltf", new TextEncoder().encode(JSON.stringify(outside))));
    },

    "COLLADA becomes metres with z up": (cbvh) => {
        const dae = `<COLLADA><asset><unit meter="0.01"/><up_axis>Y_UP</up_axis></asset><library_geometries><geometry><mesh>
            <source id="s"><float_array id="a">100 0 200 300 0 200 100 100 200</float_array><technique_common>
            <accessor source="#a"/></technique_common></source><vertices id="v"><input semantic="POSITION" source="#s"/>
            </vertices><triangles><input semantic="VERTEX" source="#v"/><p>0 1 2</p></triangles></mesh></geometry>
            </library_geometries></COLLADA>`;
        for (const name of ["part.dae", "part"]) {
            const mesh = cbvh.Mesh.bakeFile(name, new TextEncoder().encode(dae));
            equal(Array.from(mesh.bounds, (value) => Math.round(value * 1e6) / 1e6), [1, -2, 0, 3, -2, 1], name);
        }
        const broken = new TextEncoder().encode(dae.replace("#s", "b.dae#s"));
        ok(/^part.dae: line 3: .*other files are not read/.test(refused(() => cbvh.Mesh.bakeFile("part.dae", broken))), "a reference");
    },

    "what a bake is told": (cbvh) => {
        const bake = (options) => cbvh.Mesh.bake(CUBE, CUBE_FACES, options);
        const sizes = ["f32", "packed", "quantized"].map((triangles) => bake({ triangles }).byteLength);
        ok(sizes[0] >= sizes[1] && sizes[1] >= sizes[2], `smaller files, found ${sizes}`);
        bake({ profile: "dop14-u8", effort: "quick", ids: false, topology: false, triangles: "quantized", maxError: 0.01 });
        const far = [1000.2, 0, 0, 1000.3, 0, 0, 1000.2, 0.1, 0];
        const rounded = cbvh.Mesh.bake(Float64Array.from(far), [0, 1, 2], { round: "f32" });
        equal(Array.from(rounded.triangles()), far.map(Math.fround));
        ok(/none, f32/.test(refused(() => bake({ round: "f16" }))), "the ways to round");
        const thick = bake({ radius: 0.25, solid: true });
        equal([thick.radius, thick.isSolid], [0.25, true]);
        equal(thick.distance(bake({}), cbvh.pose([3, 0, 0])).distance, 0.75);
        ok(/2\^118/.test(refused(() => bake({ radius: -1 }))), "radii");
        const warnings = [];
        const given = { dropNan: true, onWarning: (warning) => warnings.push(warning) };
        const holes = cbvh.Mesh.bakeFile("holes.xyz", new TextEncoder().encode("0 0 0\nnan nan nan\n3 0 0\n"), given);
        equal([holes.triangleCount, warnings], [2, ["holes.xyz: line 2: left out 1 point without a position"]]);
        const dots = cbvh.Mesh.bakeFile("dots.xyz", new TextEncoder().encode("0 0 0\n3 0 0\n3 0 0\n"), { radius: 1 });
        equal([dots.triangleCount, dots.radius], [3, 1]);
        const open = bake({ topology: false });
        ok(/bake it again with topology/.test(refused(() => open.sides([0, 0, 0]))), "what is missing");
        equal(cbvh.Mesh.bake(Float32Array.from(CUBE), Uint16Array.from(CUBE_FACES)).bytes(), bake({}).bytes());
        ok(/dop14-u8/.test(refused(() => bake({ profile: "best" }))), "the profiles that there are");
        ok(/quick, default/.test(refused(() => bake({ effort: "slow" }))), "the efforts that there are");
        ok(/^maxError: .*quantized/.test(refused(() => bake({ maxError: 1 }))), "what it needs");
        ok(/^ids: expected a boolean/.test(refused(() => bake({ ids: 1 }))), "the type");
        const told = new Error("no more");
        equal(
            refused(() =>
                bake({
                    onStage: () => {
                        throw told;
                    },
                }),
            ),
            "no more",
        );
        const mesh = cbvh.Mesh.bake(
            CUBE.map((x) => 0.1 + x / 3),
            CUBE_FACES,
        );
        equal(cbvh.Mesh.open(mesh.bytes()).triangles(), mesh.triangles());
    },

    "golden files open, and damaged ones say what is wrong": async (cbvh, read, list) => {
        for (const name of await list("testdata", "ok-")) {
            const mesh = cbvh.Mesh.open(await read(`testdata/${name}`));
            mesh.validate();
            // Without ids, triangles of several objects have no order.
            if (!/^ok-(profiles|exact)/.test(name)) {
                ok(mesh.triangles().length > 0, "triangles");
            }
            mesh.distance(mesh, at(9, 0, 0));
        }
        const topology = cbvh.Mesh.open(await read("testdata/ok-topology.cbvh"));
        equal(topology.object(0).triangleCount, 12);
        ok(/^object: expected a number below 4/.test(refused(() => topology.object(4))), "how many there are");
        [-1, 0.5, NaN, 1e300].forEach((number) => refused(() => topology.object(number)));
        const scene = cbvh.Scene.open(await read("testdata/ok-scene.cbvh"));
        equal(scene.instances(), [0, 1, 2]);
        scene.distance();
        ok(/expected a scene/.test(refused(() => cbvh.Scene.open(topology.bytes()))), "no instances");
        const bad = await list("testdata", "bad-");
        ok(bad.length > 40, "damaged files");
        for (const name of bad) {
            const file = await read(`testdata/${name}`);
            const found = refused(() => cbvh.Mesh.open(file).validate());
            // Where a section is damaged in a page, the page is named.
            const rule = name.slice(4, 7).replace("R10", "R15");
            ok(found.includes(rule), `${name}: the rule, found ${found}`);
        }
    },

    "no bytes trap": async (cbvh, read) => {
        const source = random(11);
        const known = cbvh.Mesh.bakeFile("fclrob.obj", await read("testdata/fclrob.obj"));
        const files = [await read("testdata/ok-everything.cbvh"), await read("testdata/ok-scene.cbvh"), known.bytes()];
        files.push(await read("testdata/ok-topology.cbvh"), await read("testdata/ok-turning.cbvh"));
        let [opened, refusedOnes] = [0, 0];
        for (let round = 0; round < 600; round++) {
            let bytes = files[round % files.length].slice();
            for (let change = source.below(4); change >= 0; change--) {
                bytes[source.below(bytes.length)] = source.below(3) === 0 ? 255 : source.below(256);
            }
            if (round % 7 === 0) {
                bytes = bytes.subarray(0, source.below(bytes.length));
            }
            refusedOnes += refusals([() => cbvh.Scene.open(bytes).free()]);
            let mesh;
            refusedOnes += refusals([() => (mesh = cbvh.Mesh.open(bytes))]);
            if (mesh !== undefined) {
                opened++;
                const pose = somewhere(cbvh, source, 100);
                refusedOnes += refusals(questions(cbvh, mesh, known, pose, source.numbers(6, -50, 50)));
                refusedOnes += refusals(questions(cbvh, known, mesh, pose, source.numbers(6, 0, 50)));
                mesh.free();
            }
        }
        ok(opened > 100 && refusedOnes > 1000, `files of both kinds, found ${opened} and ${refusedOnes}`);
        for (const [ending, write] of Object.entries(writers)) {
            const whole = write(known.triangles().subarray(0, 90));
            for (let round = 0; round < 100; round++) {
                const bytes = whole.slice(0, round % 3 === 0 ? source.below(whole.length) : whole.length);
                bytes[source.below(bytes.length)] = source.below(256);
                refusals([() => cbvh.Mesh.bakeFile(`x.${ending}`, bytes).free()]);
            }
        }
        known.free();
    },

    "no numbers trap": (cbvh) => {
        const source = random(3);
        const cube = cubeOf(cbvh);
        const strange = [
            0,
            -0,
            1,
            -1,
            1e-320,
            5e-324,
            1e300,
            -1e300,
            Infinity,
            -Infinity,
            NaN,
            2 ** 53,
            2 ** -500,
            2 ** 120,
        ];
        const number = () => (source.below(2) === 0 ? strange[source.below(strange.length)] : source.from(-3, 3));
        let found = 0;
        for (let round = 0; round < 400; round++) {
            const pose = source.below(2) === 0 ? somewhere(cbvh, source, 3) : Float64Array.from({ length: 12 }, number);
            const numbers = Array.from({ length: 6 }, number);
            found += refusals(questions(cbvh, cube, cube, pose, numbers));
            found += refusals([
                () => cbvh.pose([number(), number(), number()], [number(), number(), number(), number()]),
                () => cbvh.Mesh.bake(Array.from({ length: 9 }, number)).free(),
                () => cbvh.Mesh.bake(CUBE, [0, 1, source.below(2 ** 32)]).free(),
                () => cbvh.Mesh.bake(CUBE, CUBE_FACES, { triangles: "quantized", maxError: number() }).free(),
            ]);
        }
        ok(found > 1000, `errors, found ${found}`);
        equal(cube.collide(cube, cbvh.IDENTITY), true);
    },

    "wrong arguments are named": (cbvh) => {
        const { Mesh, Motion, Scene } = cbvh;
        const [cube, scene, gone, moved] = [cubeOf(cbvh), new Scene(), cubeOf(cbvh), new Float64Array(12)];
        gone.free();
        gone.free();
        scene.add(cube, null, { name: "a" });
        structuredClone(moved.buffer, { transfer: [moved.buffer] });
        const wrong = [
            [() => cube.collide(cube, [1, 2, 3]), "pose: expected 12 numbers, found 3"],
            [() => cbvh.capsule(1, -1), "length: expected a finite length of at least 0, found -1"],
            [() => cbvh.capsule(1, NaN), "length: expected a finite length of at least 0, found NaN"],
            [
                () => cube.collideEach(cube, new Float64Array(13)),
                "poses: expected 12 numbers for each, found 13 numbers in all",
            ],
            [
                () => cube.collideEach(cube, [...at(0, 0, 0), ...at(NaN, 0, 0)]),
                "poses[1]: row 1, column 4: expected a finite number, found NaN",
            ],
            [
                () => cube.collide(cube, moved),
                "pose: expected an array with its memory, found one whose buffer was transferred or shrunk",
            ],
            [() => cube.collide(cube), "pose: expected an array of numbers, found undefined"],
            [() => cube.collide(cube, "123456789012"), "pose: expected an array of numbers, found a string"],
            [() => cube.collide(cube, { length: 12 }), "pose: expected an array of numbers, found Object"],
            [() => cube.collide(cube, new BigInt64Array(12)), "pose: expected an array of numbers, found BigInt64Array"],
            [() => cube.collide(cube, Array(12)), "pose[0]: expected a number, found undefined"],
            [() => cube.collide({}, at(0, 0, 0)), "other: expected a Mesh, found Object"],
            [() => cube.collide(gone, at(0, 0, 0)), "other: expected a Mesh in use, found one that was freed"],
            [() => gone.bytes(), "mesh: expected a Mesh in use, found one that was freed"],
            [() => cube.within(cube, at(0, 0, 0), -1), "d: expected a finite distance of at least 0, found -1"],
            [() => cube.within(cube, at(0, 0, 0), "1"), "d: expected a number, found a string"],
            [() => cube.separation(cube, at(0, 0, 0), [NaN, 0, 0]), /^direction: expected numbers/],
            [() => cube.separation(cube, at(0, 0, 0), [0, 0, 0]), /^direction: expected numbers/],
            [() => cube.separation(cube, at(0, 0, 0), [0, 0]), "directions: expected 3 numbers for each, found 2 numbers in all"],
            [() => cube.separation(cube, at(0, 0, 0), []), "directions: expected as many as poses, 1, found 0"],
            [() => cube.penetration(cube, at(0, 0, 0), { relativeGap: 0 }), /^relative_gap: expected a finite part above 0/],
            [() => cube.penetration(cube, at(0, 0, 0), { tolerance: -1 }), /^tolerance: expected/],
            [() => cube.penetration(cube, at(0, 0, 0), { tolerance: "1" }), "tolerance: expected a number, found a string"],
            [() => cube.penetration(Mesh.bake([0, 0, 0, 1, 0, 0, 0, 1, 0]), at(0, 0, 0)), /^expected closed objects/],
            [() => cube.signedDistance(cube, at(0, 0, 0), { relativeGap: 0 }), /^relative_gap: expected a finite part above 0/],
            [() => cube.signedDistance(cube, at(0, 0, 0), { tolerance: -1 }), /^tolerance: expected/],
            [() => cube.signedDistance(cube, at(0, 0, 0), { tolerance: "1" }), "tolerance: expected a number, found a string"],
            [() => cube.signedDistance(gone, at(0, 0, 0)), "other: expected a Mesh in use, found one that was freed"],
            [() => cube.clash(cube, at(0, 0, 0), { clearance: -1 }), /^clearance: expected a finite length of at least 0/],
            [() => cube.clash(cube, at(0, 0, 0), { tolerance: NaN }), /^tolerance: expected a finite depth of at least 0/],
            [() => cube.clash(cube, at(0, 0, 0), { relativeGap: 0 }), /^relative_gap: expected a finite part above 0/],
            [() => cube.clash(cube, at(0, 0, 0), { relativeGap: "1" }), "relativeGap: expected a number, found a string"],
            [
                () => cube.clash(cube, at(0, 0, 0), { visits: 0.5 }),
                "visits: expected a whole number from 0 to 2^32 - 1, found 0.5",
            ],
            [() => cube.clash(cube, at(0, 0, 0), { magnitudes: 1 }), "magnitudes: expected a boolean, found a number"],
            [() => cube.intersection(gone, at(0, 0, 0)), "other: expected a Mesh in use, found one that was freed"],
            [() => cube.intersection(Mesh.bake(CUBE, CUBE_FACES.slice(3)), at(0, 0, 0)), /expected closed objects, found object 0 open/],
            [() => cube.intersectionSurface(cube, [1, 2]), /^pose/],
            [() => cube.clash(gone, at(0, 0, 0)), "other: expected a Mesh in use, found one that was freed"],
            [() => scene.signedDistance({ relativeGap: 0 }), /^relative_gap: expected a finite part above 0/],
            [() => scene.signedDistance({ tolerance: "1" }), "tolerance: expected a number, found a string"],
            [() => new cbvh.Scene().signedDistance({ tolerance: -1 }), /^tolerance: expected a finite depth of at least 0/],
            [() => new cbvh.Scene().clashes({ tolerance: -1 }), /^tolerance: expected a finite depth of at least 0/],
            [() => cube.patches(cube, at(0, 0, 0), { tolerance: NaN }), /^tolerance: expected/],
            [
                () => cube.patches(cube, at(0, 0, 0), { maxPoints: 0.5 }),
                "maxPoints: expected a whole number from 0 to 2^32 - 1, found 0.5",
            ],
            [
                () => cube.patches(cube, at(0, 0, 0), { maxContacts: -1 }),
                "maxContacts: expected a whole number from 0 to 2^32 - 1, found -1",
            ],
            [() => cube.contactRegions(cube, [1, 2]), "pose: expected 12 numbers, found 2"],
            [() => gone.selfContacts(), "mesh: expected a Mesh in use, found one that was freed"],
            [() => cube.motion(cube, {}), "motion: expected a Motion, found Object"],
            [
                () => cube.motion(cube, Motion.between(at(0, 0, 0).concat(at(1, 0, 0)), at(0, 0, 0).concat(at(1, 0, 0)))),
                "motion: expected one path, found 2",
            ],
            [() => Motion.between(at(0, 0, 0), [1]), "end: expected as many numbers as start, 12, found 1"],
            [() => Motion.through(at(0, 0, 0)), /^poses: /],
            [() => cube.closestPoints([1, 2]), "points: expected 3 numbers for each, found 2 numbers in all"],
            [() => cube.closestPoints([1, 2, 1e300]), /^point: expected finite coordinates of at most 2\^120/],
            [() => cube.firstHits([1, 2, 3], []), "directions: expected as many as origins, 1, found 0"],
            [
                () => cube.firstHits([1, 2, 3], [1, 1, 1], { until: [1, 2] }),
                "until: expected as many as origins, 1, found 2",
            ],
            [() => cube.firstHits([1, 2, 3], [0, 0, 0]), /^direction: /],
            [() => cube.object("body"), 'object: expected one object of this name, found 0 named "body"'],
            [() => Mesh.open("file"), "bytes: expected a Uint8Array or an ArrayBuffer, found a string"],
            [() => Mesh.open(new Uint8Array(0)), /R0/],
            [() => Mesh.bake(CUBE, [0, 1, 8]), /8/],
            [() => Mesh.bake(CUBE, [0, 1, -1]), "faces[2]: expected a whole number from 0 to 2^32 - 1, found -1"],
            [() => Mesh.bake(CUBE, [0, 1]), /^faces: expected three corners for each triangle/],
            [() => Mesh.bake([1, 2, 3]), "vertices: expected three corners for each triangle, found 1 corners"],
            [() => Mesh.bake([1, 2]), "vertices: expected 3 numbers for each, found 2 numbers in all"],
            [() => Mesh.bake([]), /triangle/],
            [() => scene.add(cube, null, { name: "a" }), /"a": expected a name of its own/],
            [() => scene.add(cube, at(2 ** 119, 0, 0)), /^pose: expected a translation of at most 2\^118/],
            [() => scene.setPose("b", at(0, 0, 0)), 'ids: expected an instance of the scene, found "b"'],
            [() => scene.setPose(7, at(0, 0, 0)), "ids: expected an instance of the scene, found 7; was it removed?"],
            [() => scene.setPose("a", at(2 ** 119, 0, 0)), /^instance "a": /],
            [() => scene.setPoses(["a"], []), "poses: expected as many as ids, 1, found 0"],
            [() => scene.setGroups("a", { member: -1 }), "member: expected a whole number from 0 to 2^32 - 1, found -1"],
            [() => scene.setTracking(1), "tracking: expected a boolean, found a number"],
            [() => scene.setAllowed("a", "a", "yes"), "allowed: expected a boolean, found a string"],
            [() => scene.isFree({ a: 1 }), "paths: expected a Map of instances to paths, found Object"],
            [
                () =>
                    scene.isFree(
                        new Map([
                            ["a", Motion.between(at(0, 0, 0), at(1, 0, 0))],
                            [0, Motion.through([...at(0, 0, 0), ...at(0, 0, 0)])],
                        ]),
                    ),
                "paths: expected one path for each instance, found two for one",
            ],
            [() => scene.distances([0]), /^pairs: /],
            [() => cbvh.pose([0, 0, 0], [1, 1, 1, 1]), /^quaternion\[0\]: /],
            [() => cbvh.relative(at(0, 0, 0), []), "b: expected as many as a, 1, found 0"],
        ];
        for (const [work, expected] of wrong) {
            const found = refused(work);
            ok(expected instanceof RegExp ? expected.test(found) : found === expected, `${expected}, found: ${found}`);
        }
    },

    "memory that is freed is used again": async (cbvh) => {
        const source = random(2);
        const vertices = source.numbers(9 * 2000, -1, 1);
        const round = () => {
            const mesh = cbvh.Mesh.bake(vertices);
            const scene = new cbvh.Scene();
            scene.add(mesh);
            scene.add(mesh, at(0.5, 0, 0));
            scene.collide();
            mesh.contacts(mesh, at(1.9, 0, 0));
            scene.free();
            const copy = cbvh.Mesh.open(mesh.bytes());
            copy.free();
            mesh.free();
            refused(() => cbvh.Mesh.open(new Uint8Array(100000)));
        };
        // Decoded nodes are kept until there are many, and how many that is grows up to a limit: only after some rounds is all
        // memory in use.
        for (let warm = 0; warm < 40; warm++) {
            round();
        }
        const before = cbvh.memoryBytes();
        for (let again = 0; again < 40; again++) {
            round();
        }
        equal(cbvh.memoryBytes() - before, 0, "growth in bytes");
        if (Symbol.dispose !== undefined) {
            const mesh = cubeOf(cbvh);
            mesh[Symbol.dispose]();
            refused(() => mesh.triangleCount);
        }
        // What nobody frees, the engine does, when it collects.
        if (globalThis.gc !== undefined) {
            const bytes = cbvh.Mesh.bake(vertices).bytes();
            for (let again = 0; again < 600; again++) {
                cbvh.Mesh.open(bytes);
                if (again % 50 === 0) {
                    globalThis.gc();
                    await new Promise((resolve) => setTimeout(resolve, 20));
                }
            }
            const grown = cbvh.memoryBytes() - before;
            ok(grown < 200 * bytes.length, `room for some of ${600 * bytes.length} bytes, found ${grown} more`);
        }
    },

    "a time limit ends calls that take longer"(cbvh) {
        // Triangles that all contain a point, each beside the others: of two such meshes, all pairs touch.
        const fan = (count) =>
            cbvh.Mesh.bake(Array.from({ length: count }, (_, k) => [0, 0, 0, 1, 0, 0, k, 1, 0]).flat());
        const [large, small, here] = [fan(3000), fan(100), at(0, 0, 0)];
        const scenes = [large, small].map((mesh) => {
            const scene = new cbvh.Scene();
            scene.add(mesh);
            scene.add(mesh);
            return scene;
        });
        const stopped = (work) => {
            const began = performance.now();
            const message = refused(work);
            ok(message.includes("found the query stopped"), `a call that was stopped, found ${message}`);
            const took = performance.now() - began;
            ok(took < 1500, `the end of a call, found it after ${took} ms`);
        };
        const short = [
            () => small.collide(small, here),
            () => small.distance(small, here),
            () => small.isFree(small, cbvh.Motion.between(here, at(9, 0, 0))),
            () => small.closestPoints([0, 0, 5]).distance,
            () => small.selfContacts().triangles,
            () => scenes[1].pairsInContact(),
            () => scenes[1].distances([0, 1]).distance,
        ];
        const expected = short.map((work) => work());
        try {
            cbvh.setTimeLimit(30);
            stopped(() => large.contacts(large, here));
            stopped(() => large.contactsEach(large, [here, here, here].flat()));
            stopped(() => scenes[0].contacts());
            cbvh.setTimeLimit(0);
            short.forEach(stopped);
            cbvh.setTimeLimit(60000);
            short.forEach((work, place) => equal(work(), expected[place], String(work)));
            for (const wrong of [-1, Number.NaN, "1"]) {
                ok(refused(() => cbvh.setTimeLimit(wrong)).startsWith("milliseconds: expected"), "the argument");
            }
        } finally {
            cbvh.setTimeLimit();
        }
        short.forEach((work, place) => equal(work(), expected[place], String(work)));
        equal(small.contacts(small, here).length, 4 * 100 * 100, "all contacts");
    },
};
