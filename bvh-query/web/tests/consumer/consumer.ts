/** A program in TypeScript that uses the package: it is only checked. */

import {
    CbvhWorker,
    IDENTITY,
    init,
    Mesh,
    Motion,
    MotionKind,
    nearestPose,
    pose,
    Relation,
    relative,
    Scene,
    Side,
    type BakeOptions,
    type Distance,
    type RemoteMesh,
    type SceneDistance,
} from "cbvh";

export async function ask(file: File): Promise<number> {
    await init();
    const options: BakeOptions = { triangles: "packed", onStage: (stage) => console.log(stage.length) };
    using a = Mesh.bakeFile(file.name, await file.arrayBuffer(), options);
    const b = Mesh.bake(new Float32Array(9), new Uint16Array(3));
    const at: Float64Array = relative(IDENTITY, nearestPose(pose([1, 2, 3], [0, 0, 0, 1])));
    const touching: boolean = a.collide(b, at);
    const flags: Uint8Array = a.collideEach(b, at);
    const nearest: Distance = a.distance(b, at, { relErr: 0.1 });
    const relation: Relation = a.relation(b, at);
    const name: string | undefined = Relation[relation];
    const motion = Motion.between(IDENTITY, at);
    const hit = a.motion(b, motion, { clearance: 1 });
    const end: number = hit.kind === MotionKind.HIT ? hit.at : 1;
    const inside: boolean = a.sides([0, 0, 0])[0] === Side.INSIDE;
    const scene = new Scene();
    const id: number = scene.add(a, at, { name: "a", meets: 1 });
    const pair: SceneDistance | undefined = scene.distance();
    const free: boolean = scene.isFree(new Map([["a", motion]]));
    scene.setPoses([id, "a"], at);
    b.free();

    // @ts-expect-error A pose is an array of numbers.
    a.collide(b, "identity");
    // @ts-expect-error Another mesh is asked for.
    a.collide(at, at);
    // @ts-expect-error Meshes are made by `open` and `bake`.
    new Mesh();
    // @ts-expect-error There is no such option.
    a.distance(b, at, { error: 1 });
    // @ts-expect-error There may be no pair.
    scene.distance().a;
    // @ts-expect-error Answers to many questions are arrays.
    const wrong: boolean = a.collideEach(b, at);

    return [touching, flags[0], nearest.pointA[0], name, end, inside, pair?.a, free, wrong].length;
}

export async function askLater(bytes: Uint8Array): Promise<number> {
    const worker = await CbvhWorker.start(new URL("cbvh_bg.wasm", "https://example.org"));
    const mesh: RemoteMesh = await worker.Mesh.bake(new Float32Array(9), null, { onStage: (stage) => console.log(stage.length) });
    const ball: RemoteMesh = await worker.sphere(1);
    const flags: Uint8Array = await mesh.collideEach(ball, IDENTITY);
    const nearest: Distance = await mesh.distance(await worker.Mesh.open(bytes), IDENTITY, { relErr: 0.1 });
    const triangles: number = await mesh.triangleCount;
    const scene = await worker.Scene.make();
    const id: number = await scene.add(mesh, null, { name: "a" });
    const motion = await worker.Motion.between(IDENTITY, pose([1, 0, 0], [0, 0, 0, 1]));
    const free: boolean = await scene.isFree(new Map([["a", motion]]));
    await mesh.free();

    // @ts-expect-error A mesh of the page is not one of the worker.
    mesh.collide(Mesh.open(bytes), IDENTITY);
    // @ts-expect-error Answers come later.
    const wrong: boolean = mesh.collide(ball, IDENTITY);

    worker.terminate();
    return [flags[0], nearest.distance, triangles, id, free, wrong].length;
}
