/** Tests of `CbvhWorker` that run in Node and in a page: what a worker answers is what the package answers here, to the bit. */

import { equal, ok, refused } from "./expect.js";

const at = (x) => [1, 0, 0, x, 0, 1, 0, 0, 0, 0, 1, 0];

/** The message of the error with which a promise is rejected. */
async function rejected(promise) {
    const found = await promise.then(
        () => undefined,
        (error) => error,
    );
    ok(found instanceof Error, `an Error, found ${found}`);
    return found;
}

const cases = {
    async "a worker answers what the package answers"(cbvh, start) {
        const worker = await start();
        const corner = [0, 0, 0, 1, 0, 0, 0, 1, 0];
        const pairs = [
            [cbvh.Mesh.bake(corner), await worker.Mesh.bake(corner)],
            [cbvh.box([2, 2, 2]), await worker.box([2, 2, 2])],
            [cbvh.sphere(0.5), await worker.sphere(0.5)],
        ];
        const poses = [...at(0), ...at(1.25), ...at(4)];
        for (const [a, remoteA] of pairs) {
            equal(await remoteA.bytes(), a.bytes(), "bytes");
            for (const name of ["triangleCount", "bounds", "names", "radius", "isSolid", "byteLength", "maxMove"]) {
                equal(await remoteA[name], a[name], name);
            }
            for (const [b, remoteB] of pairs) {
                for (const name of ["collideEach", "distanceEach", "relationEach", "contactsEach"]) {
                    equal(await remoteA[name](remoteB, poses), a[name](b, poses), name);
                }
                equal(await remoteA.distance(remoteB, at(4), { relErr: 0.1 }), a.distance(b, at(4), { relErr: 0.1 }));
                const [starts, ends] = [at(4), at(-4)];
                const there = await worker.Motion.between(starts, ends);
                const here = cbvh.Motion.between(starts, ends);
                equal(await remoteA.motion(remoteB, there), a.motion(b, here), "motion");
                equal(await there.count, 1);
            }
        }
        equal(await worker.pose([1, 2, 3], [0, 0, 0, 1]), cbvh.pose([1, 2, 3], [0, 0, 0, 1]));
        ok((await worker.memoryBytes()) > 0, "a memory");
        await worker.setTimeLimit(0);
        const { message } = await rejected(pairs[0][1].collide(pairs[1][1], at(0)));
        ok(message.includes("found the query stopped"), `a query that was stopped, found ${message}`);
        await worker.setTimeLimit();
        equal(await pairs[0][1].collide(pairs[1][1], at(0)), pairs[0][0].collide(pairs[1][0], at(0)), "without a limit");

        const [scene, remote] = [new cbvh.Scene(), await worker.Scene.make()];
        for (const [number, [mesh, held]] of pairs.entries()) {
            const id = scene.add(mesh, at(2 * number), { name: `body ${number}` });
            equal(await remote.add(held, at(2 * number), { name: `body ${number}` }), id, "id");
        }
        for (const name of ["pairsInContact", "contacts", "distance", "relations", "poses", "instances"]) {
            equal(await remote[name](), scene[name](), name);
        }
        const moved = cbvh.Motion.between(at(4), at(0));
        const paths = new Map([["body 2", await worker.Motion.between(at(4), at(0))]]);
        equal(await remote.motion(paths), scene.motion(new Map([["body 2", moved]])), "motion of a scene");
        // What an answer is, when that is a mesh, stays in the worker.
        equal(await (await remote.mesh("body 1")).triangleCount, scene.mesh("body 1").triangleCount);
        const single = pairs[1][0].bytes();
        equal(
            (await rejected(worker.Scene.open(single))).message,
            refused(() => cbvh.Scene.open(single)),
        );
        worker.terminate();
    },

    async "questions are answered in their order, and functions are called meanwhile"(cbvh, start) {
        const worker = await start();
        const heard = [];
        const cube = cbvh.box([1, 1, 1]);
        const made = worker.Mesh.bake(cube.triangles(), null, { onStage: (stage) => heard.push(stage) });
        const stages = [];
        cbvh.Mesh.bake(cube.triangles(), null, { onStage: (stage) => stages.push(stage) });
        const mesh = await made;
        equal(heard, stages);
        ok(heard.length > 0, "stages");
        const order = [];
        await Promise.all([3, 2, 1].map((x) => mesh.within(mesh, at(x), 0.5).then((near) => order.push([x, near]))));
        equal(order, [
            [3, false],
            [2, false],
            [1, true],
        ]);
        worker.terminate();
    },

    async "errors are those of the package"(cbvh, start) {
        const worker = await start();
        const [here, there] = [cbvh.box([1, 1, 1]), await worker.box([1, 1, 1])];
        for (const pose of [[1], [...at(0).slice(0, 11), Number.NaN], "no"]) {
            const expected = refused(() => here.collide(here, pose));
            equal((await rejected(there.collide(there, pose))).message, expected);
        }
        const kind = await rejected(there.collide(there, [1]));
        ok(kind instanceof TypeError, `a TypeError, found ${kind.name}`);
        ok((await rejected(worker.Mesh.open(new Uint8Array(9)))).message.includes("expected"), "a clear message");
        const other = await start();
        const foreign = await other.box([1, 1, 1]);
        const message = "expected an object of this worker, found one of another worker";
        equal((await rejected(there.collide(foreign, at(0)))).message, message);
        equal((await rejected(there.collide(Symbol(), at(0)))).name, "DataCloneError");
        other.terminate();

        await there.free();
        await there.free();
        const freed = "expected an object in use, found one that was freed";
        equal((await rejected(there.collide(there, at(0)))).message, freed);

        // Neither what waits nor what comes later waits for ever.
        const waiting = worker.box([2, 2, 2]);
        worker.terminate();
        const ended = "cbvh: expected a worker in use, found one that was terminated";
        equal((await rejected(waiting)).message, ended);
        equal((await rejected(worker.box([2, 2, 2]))).message, ended);
    },
};

/** Each takes the package and a function that starts a worker. A case that fails leaves no worker behind, for which a program would wait. */
export const remoteCases = Object.fromEntries(
    Object.entries(cases).map(([name, work]) => [
        name,
        async (cbvh, start) => {
            const workers = [];
            try {
                await work(cbvh, async () => {
                    workers.push(await start());
                    return workers.at(-1);
                });
            } finally {
                for (const worker of workers) {
                    worker.terminate();
                }
            }
        },
    ]),
);
